"""Lights of a stand: one file per kind, listed in `impasto.stand.drivers`."""
