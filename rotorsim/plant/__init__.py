"""The coupled plant: shaft, film, injectors and effects, stepped together."""

from rotorsim.plant.plant import Plant

__all__ = ["Plant"]
