"""Uncertainty of local models: covariance of the parameters, bias of modes and gains."""
