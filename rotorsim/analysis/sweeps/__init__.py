"""Sweeps for design: quantities of a machine over values of its file, over speed and supply pressure."""
