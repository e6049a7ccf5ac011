"""Checks of photographs while they can be taken again: one file per kind, pure functions of what was seen."""
