"""Checks of exported units: standard, trajectory against the Python plant, importers."""
