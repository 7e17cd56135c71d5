"""Recursive estimate of a parameter-varying model, sample by sample."""
