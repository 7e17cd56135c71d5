"""Compiled kernel module of one machine: the functions that Python calls, with shapes and units.

`compose` writes such a module. Everywhere w (n,) is the workspace (all states, float64), ix (m,) its integers and P the
parameter record; a function reads and writes w in place and allocates nothing.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

Array = np.ndarray


class KernelModule(Protocol):
    """Entry points of a composed module; their code is in `rotorsim.plant.kernels`."""

    __name__: str
    __file__: str | None
    newton: Any
    """Film solver, of the module that machines with the same film share."""

    def settle(self, w: Array, initial: Array, ix: Array, P: Any, speed: float, supply: float) -> int:
        """Fill w with the equilibrium at speed [rad/s] and supply [Pa, absolute]; a code of `equilibrium_kernel`."""

    def run(self, w: Array, ix: Array, P: Any, inputs: Array, out: Array, steps_per_sample: int) -> int:
        """Advance one sample per row of `inputs` (k, 6), writing `out` (k, columns); returns the samples done.

        inputs: speed at the sample's end [rad/s], supply [Pa, absolute], references x, y [V], disc force x, y [N].
        """

    def static_terms(self, w: Array, P: Any, speed: float, moving: bool) -> None:
        """Write the steady modal force and the modal stiffness at rest at speed [rad/s]."""

    def narrowest(self, w: Array, P: Any) -> float:
        """Smallest distance [m] between journal and sleeve."""

    def supply_line(self, w: Array, P: Any, h: float, supply: float, flow: float) -> tuple[float, float]:
        """Pressure [Pa, absolute] behind the line at start and end of h [s] at supply [Pa, absolute], flow [kg/s]."""

    def serve(
        self, task: int, w: Array, initial: Array, ix: Array, P: Any, u: Array, out: Array, steps: int
    ) -> int:  # fmt: skip
        """Settle, advance or read, as a co-simulation unit asks; a row u (6,) of inputs; returns a status."""
