"""Sampling time of controllers and records."""

SAMPLE = 2e-4
"""5 kHz [s]."""
