"""Benchmarks: speed, accuracy and the shipped rig against its references, measured on this computer."""
