"""Measured minus simulated, weighted by the noise floor of each line."""
