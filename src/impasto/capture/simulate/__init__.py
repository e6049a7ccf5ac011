"""Simulate a painting and the camera that takes it: photographs of which the truth is known."""

from impasto.capture.simulate.capture import Simulation, simulate

__all__ = ["Simulation", "simulate"]
