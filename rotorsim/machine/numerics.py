"""Machine-file parts for the numerics: film grid, time step and tolerances."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from rotorsim.base.constants import SAMPLE
from rotorsim.base.units import show
from rotorsim.machine.part import Part, count, quantity


class Grid(Part):
    """Grid of the gas film.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Grid(n_theta=48, n_z=16).n_theta
    48
    """

    n_theta: int = count("Intervals round the circumference.", 32, low=8, high=512, multiple=4)
    n_z: int = count("Intervals along the full length of the film.", 16, low=4, high=256, multiple=2)
    symmetry: Literal["auto", "none"] = Field(
        "auto", description="'auto' solves half a film that is symmetric about its middle, 'none' always all of it."
    )


class Solver(Part):
    """Step and tolerances of the coupled solution.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Solver(time_step="50 us").time_step
    5e-05
    """

    time_step: float = quantity(
        "s", "Time step; the sampling time of 0.2 ms is a whole multiple of it.", 1e-4, low=1e-7, high=1e-3
    )
    tolerance: float = quantity(
        "1", "Tolerance of the film pressure, relative to ambient pressure.", 5e-6, above=0, high=1e-3
    )
    modes_per_plane: int = count("Rotor modes kept in each plane.", 6, low=1, high=40)
    minimum_film: float = quantity(
        "m", "Floor of the film thickness in the Reynolds equation.", 2.5e-7, above=0, high=1e-4
    )

    def problems(self) -> Iterator[tuple[str, str]]:
        """The step divides the sample."""
        steps = SAMPLE / self.time_step
        if steps < 0.5 or abs(steps - round(steps)) > 1e-9 * steps:
            shown = show(self.time_step, "s")
            yield "time_step", f"'{shown}' does not divide the sampling time 0.2 ms; write e.g. '0.1 ms'"
