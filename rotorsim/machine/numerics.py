"""Machine-file parts for the numerics: film grid, time step and tolerances."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from rotorsim.machine.part import Part, count, quantity

STEP = 1e-4
"""Longest time step [s] that is taken where a file gives none."""


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
    """Step, sampling and tolerances of the coupled solution.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Solver(time_step="50 us").time_step
    5e-05
    """

    time_step: float = quantity(
        "s", "Time step; the sampling time is a whole multiple of it. 0.1 ms is shortened until it is.", STEP,
        low=1e-7, high=1e-3,
    )  # fmt: skip
    sampling_rate: float | None = quantity(
        "Hz", "Rate of probes, encoder and laws; from drive.highest_speed when not given, and 5 kHz without that.",
        None, low=100, high=1e6, example=20e3,
    )  # fmt: skip
    tolerance: float = quantity(
        "1", "Tolerance of the film pressure, relative to ambient pressure.", 5e-6, above=0, high=1e-3
    )
    modes_per_plane: int = count("Rotor modes kept in each plane.", 6, low=1, high=40)
    minimum_film: float = quantity(
        "m", "Floor of the film thickness in the Reynolds equation.", 2.5e-7, above=0, high=1e-4
    )
