"""From answers to an interval scale, its limits, and what may be wrong with it."""
