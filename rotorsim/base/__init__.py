"""Lowest layer, without imports from the other packages: files, units, locks, interrupts, rounding, versions."""
