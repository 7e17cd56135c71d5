"""Proportional law, and harmonics of the speed next to a law."""
