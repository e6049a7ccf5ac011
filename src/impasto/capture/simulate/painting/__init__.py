"""The simulated paintings: relief, paints, and strokes that lay the one on the other."""
