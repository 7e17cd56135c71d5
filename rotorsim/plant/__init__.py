"""Coupled plant: shaft, film, injectors and effects in one time step."""

from typing import TYPE_CHECKING

from rotorsim.base.public import named
from rotorsim.plant.controller import Controller
from rotorsim.plant.equilibrium import Equilibrium
from rotorsim.plant.linearise import LinearPlant
from rotorsim.plant.plant import Plant, compile_kernels
from rotorsim.plant.simulation import Simulation
from rotorsim.plant.validity import Exceeded, range_of_validity

__all__ = [
    "Controller",
    "Equilibrium",
    "Exceeded",
    "LinearPlant",
    "Plant",
    "Simulation",
    "compile_kernels",
    "range_of_validity",
]


if not TYPE_CHECKING:
    __getattr__, __dir__ = named(__name__, __all__)
