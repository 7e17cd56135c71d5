"""Benchmarks: speed, accuracy and verdicts of the installed software, measured on this computer."""
