"""Computations behind the figures: pure functions of records and arrays, without a plotting library."""
