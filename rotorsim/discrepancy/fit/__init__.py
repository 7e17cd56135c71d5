"""Calibration: fit parameters, damped least squares, standard deviations."""
