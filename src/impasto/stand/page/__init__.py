"""The page for a tablet at the stand."""
