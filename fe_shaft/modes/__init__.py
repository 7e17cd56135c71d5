"""Modes of a pencil in a region of the complex plane: found, counted, followed over a parameter, crossed with lines."""
