"""Compiled kernels of the plant's step, which are also templates of the composed module."""
