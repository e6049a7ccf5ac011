"""Do observers agree? The experiment with paired comparisons, and what follows from it."""
