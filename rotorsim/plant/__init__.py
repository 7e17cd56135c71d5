"""Coupled plant: shaft, film, injectors and effects in one time step."""

from rotorsim.plant.plant import Plant

__all__ = ["Plant"]
