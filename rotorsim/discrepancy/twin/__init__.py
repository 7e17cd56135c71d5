"""Simulated machine of a diagnosis, compiled with every candidate effect; cached responses."""
