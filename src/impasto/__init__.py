"""Measure how a painted surface reflects light, and show it under any light."""
