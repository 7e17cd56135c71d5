"""Lowest layer, without imports from the other packages: files, locks, interrupts, rounding, versions."""
