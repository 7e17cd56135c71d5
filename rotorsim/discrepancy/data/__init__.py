"""Measured records as spectra over whole periods, and checks before the fit."""
