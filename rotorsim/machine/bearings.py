"""Machine-file parts of bearings without a film: springs and dampers, constant or as tables over the speed, housings.

A bearing acts on the shaft by -K x - C v - M a, with x its displacement against the housing where the bearing has a
`support`, else against the ground; a housing is a mass on springs and dampers of its own.

Cites: friswell_2010.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from itertools import pairwise
from math import hypot
from typing import Any, Literal, Self

import numpy as np
from pydantic import Field

from fe_shaft.shaft import mirrored
from rotorsim.base.units import show
from rotorsim.machine.part import Part, quantity

CHORDS = 4
"""Parts between two kinks of a table over speed and whirl frequency."""


class Support(Part):
    """The housing of a bearing: a mass on springs and dampers to the ground.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Support(mass="12 kg", kxx="50 MN/m", cxx="900 N*s/m").stiffness
    (50000000.0, 50000000.0)
    """

    mass: float = quantity("kg", "Mass of the housing that moves.", above=0, high=1e6, example=12.0)
    kxx: float = quantity("N/m", "Stiffness to the ground in x.", above=0, high=1e14, example=50e6)
    kyy: float | None = quantity("N/m", "The same in y; as in x when not given.", None, above=0, high=1e14, example=5e7)
    cxx: float = quantity("N*s/m", "Damping to the ground in x.", 0.0, low=0, high=1e12, example=900.0)
    cyy: float | None = quantity(
        "N*s/m", "The same in y; as in x when not given.", None, low=0, high=1e12, example=900.0
    )

    @property
    def stiffness(self) -> tuple[float, float]:
        """Stiffness in x and y [N/m]."""
        return self.kxx, self.kxx if self.kyy is None else self.kyy

    @property
    def damping(self) -> tuple[float, float]:
        """Damping in x and y [N s/m]."""
        return self.cxx, self.cxx if self.cyy is None else self.cyy


class BearingCoefficients(Part):
    """Stiffness and damping in two directions."""

    kxx: float = quantity("N/m", "Stiffness in x.", low=0, high=1e14, example=50e6)
    kyy: float | None = quantity("N/m", "Stiffness in y; as in x when not given.", None, low=0, high=1e14, example=50e6)
    kxy: float = quantity("N/m", "Force in x for a displacement in y.", 0.0, low=-1e14, high=1e14, example=1e6)
    kyx: float = quantity("N/m", "Force in y for a displacement in x.", 0.0, low=-1e14, high=1e14, example=1e6)
    cxx: float = quantity("N*s/m", "Damping in x.", 0.0, low=0, high=1e12, example=200.0)
    cyy: float | None = quantity(
        "N*s/m", "Damping in y; as in x when not given.", None, low=0, high=1e12, example=200.0
    )
    cxy: float = quantity("N*s/m", "Force in x for a velocity in y.", 0.0, low=-1e12, high=1e12, example=100.0)
    cyx: float = quantity("N*s/m", "Force in y for a velocity in x.", 0.0, low=-1e12, high=1e12, example=100.0)

    @property
    def K(self) -> np.ndarray:
        """Stiffness (2, 2) [N/m]."""
        return np.array([[self.kxx, self.kxy], [self.kyx, self.kxx if self.kyy is None else self.kyy]])

    @property
    def C(self) -> np.ndarray:
        """Damping (2, 2) [N s/m]."""
        return np.array([[self.cxx, self.cxy], [self.cyx, self.cxx if self.cyy is None else self.cyy]])

    def problems(self) -> Iterator[tuple[str, str]]:
        """The damping takes energy out, whatever the direction of motion."""
        (cxx, cxy), (cyx, cyy) = self.C
        least = 0.5 * (cxx + cyy - hypot(cxx - cyy, cxy + cyx))
        if least < -1e-9 * (abs(cxx) + abs(cyy) + abs(cxy) + abs(cyx)):
            yield "cxx", f"the damping is negative in one direction ({least:.4g} N*s/m); correct the signs of the table"


class BearingPart(Part):
    """A bearing of any kind: where it stands, and what rotor, limits and drawings ask of it."""

    kind: str = Field(description="Kind of the bearing.")
    name: str | None = Field(None, description="Name of the bearing.")
    position: float = quantity("m", "Coordinate z of the bearing.", low=-100, high=100, example=0.05)

    @property
    def speeds(self) -> np.ndarray:
        """Speeds (points,) [rad/s] of its coefficients; none where these are the same at every speed or not known."""
        return np.zeros(0)

    @property
    def coefficients(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Stiffness [N/m] and damping [N s/m], (2, 2) or of each of `speeds`; None where they are computed."""
        return None

    @property
    def masses(self) -> tuple[float, float]:
        """Mass terms in x and y [kg]."""
        return 0.0, 0.0

    @property
    def spring(self) -> float | None:
        """Isotropic stiffness [N/m] that stands for it where the rotor's modes are chosen; None for constant ones."""
        return None

    @property
    def ends(self) -> tuple[float, float]:
        """Coordinates z [m] between which it acts."""
        return self.position, self.position


class BearingMass(BearingPart):
    """Mass terms of a bearing or seal, the same at every speed: they have no weight."""

    mxx: float | None = quantity(
        "kg", "Mass of oil, gas or a ring that moves with the shaft against the housing, in x; it has no weight.", None,
        low=0, high=1e6, example=2.0,
    )  # fmt: skip
    myy: float | None = quantity("kg", "The same in y; as in x when not given.", None, low=0, high=1e6, example=2.0)

    @property
    def masses(self) -> tuple[float, float]:
        """Mass terms in x and y [kg]."""
        mxx = self.mxx or 0.0
        return mxx, mxx if self.myy is None else self.myy


class LinearBearing(BearingCoefficients, BearingMass):
    """A spring and damper on the shaft.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.LinearBearing(kind="linear", position="0 mm", kxx="1 MN/m").kxx
    1000000.0
    """

    kind: Literal["linear"] = Field(description="Always 'linear'.")
    support: Support | None = Field(None, description="The housing, where it moves.")

    @property
    def coefficients(self) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness (2, 2) [N/m] and damping (2, 2) [N s/m]."""
        return self.K, self.C


class Point(BearingCoefficients):
    """Coefficients of a bearing at one speed, and at one whirl frequency where they depend on it.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Point(speed="3000 rpm", kxx="20 MN/m", cxx="30 kN*s/m").cxx
    30000.0
    """

    speed: float = quantity("rad/s", "Speed of the shaft.", low=0, high=1e6, example=314.0)
    whirl_frequency: float | None = quantity(
        "rad/s", "Frequency of the whirl, where coefficients depend on it; every speed has the same ones.", None,
        low=0, high=1e6, example=150.0,
    )  # fmt: skip


class TableBearing(BearingMass):
    """A bearing whose stiffness and damping are a table over the speed, linear in between.

    Below its first speed and above its last one the values there hold. It is the table of a shaft that turns from x to
    y; of one that turns the other way the cross terms have the opposite sign.

    A table over the whirl frequency too counts at the frequency of the speed, where unbalance drives the shaft; modes
    of other frequencies are found with the coefficients at their own.

    Examples
    --------
    >>> import rotorsim as rs
    >>> points = [{"speed": "0 rpm", "kxx": "10 MN/m"}, {"speed": "3000 rpm", "kxx": "20 MN/m"}]
    >>> rs.machine.TableBearing(kind="table", position="0 mm", points=points).at(157.0796)[0].round(-3)[0].tolist()
    [15000000.0, 0.0]
    """

    kind: Literal["table"] = Field(description="Always 'table'.")
    points: tuple[Point, ...] = Field(min_length=2, description="Coefficients by ascending speed.")
    support: Support | None = Field(None, description="The housing, where it moves.")

    @cached_property
    def whirl(self) -> np.ndarray:
        """Whirl frequencies (w,) [rad/s] of the table; none where it is over the speed alone."""
        return _fixed(np.unique([p.whirl_frequency for p in self.points if p.whirl_frequency is not None]))

    @cached_property
    def grid(self) -> tuple[np.ndarray, np.ndarray]:
        """Speeds (s,) [rad/s] and stiffness and damping (s, w, 2, 2, 2) [N/m, N s/m]; w is 1 without a whirl axis."""
        values = np.array([(p.K, p.C) for p in self.points])
        speeds = np.unique([p.speed for p in self.points])
        return _fixed(speeds), _fixed(values.reshape(len(speeds), -1, 2, 2, 2))

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with arrays of its own points."""
        copied = super().model_copy(update=update, deep=deep)
        for name in ("whirl", "grid"):
            copied.__dict__.pop(name, None)
        return copied

    @property
    def speeds(self) -> np.ndarray:
        """Speeds (points,) [rad/s] between which a machine takes synchronous coefficients as linear.

        They are so between kinks at speeds and whirl frequencies. Over both they have a term in the speed squared, of
        which `CHORDS` parts between two kinks leave the inverse square of their number.
        """
        own = self.grid[0]
        kinks = np.union1d(own, self.whirl)
        if len(own) < 2 or not self.whirl.size:
            return kinks
        parts = kinks[:-1, None] + np.diff(kinks)[:, None] * np.arange(CHORDS) / CHORDS
        return np.append(parts.ravel(), kinks[-1])

    @property
    def reach(self) -> tuple[float, float]:
        """First and last speed [rad/s] of the table; of one at a single speed, of its synchronous coefficients."""
        own = self.grid[0] if len(self.grid[0]) > 1 else self.speeds
        return float(own[0]), float(own[-1])

    @property
    def coefficients(self) -> tuple[np.ndarray, np.ndarray]:
        """Synchronous stiffness [N/m] and damping [N s/m], each (points, 2, 2), at `speeds`."""
        if not self.whirl.size:
            return np.array([p.K for p in self.points]), np.array([p.C for p in self.points])
        values = np.array([self.at(speed) for speed in self.speeds])
        return values[:, 0], values[:, 1]

    @property
    def table(self) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
        """Stiffness and damping (..., 2, 2) over the axes [rad/s], by their names in `fe_shaft.BearingElement`."""
        speeds, values = self.grid
        axes = {"frequency": speeds, "whirl_frequency": self.whirl}
        kept = {name: axis for name, axis in axes.items() if axis.size > 1}
        shape = (*map(len, kept.values()), 2, 2)
        return values[:, :, 0].reshape(shape), values[:, :, 1].reshape(shape), kept

    @property
    def spring(self) -> float:
        """Mean stiffness [N/m] of both directions at the median speed."""
        K, _ = self.at(float(np.median(self.speeds)))
        return max(0.5 * float(np.trace(K)), 1.0)

    def at(self, speed: float, whirl: float | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness (2, 2) [N/m] and damping (2, 2) [N s/m] at a speed [rad/s] of either sense.

        The `whirl` frequency [rad/s] is that of the speed where none is given.
        """
        known, both = self.grid
        turning = abs(speed)
        values = _between(known, both, turning)
        K, C = _between(self.whirl, values, turning if whirl is None else whirl)
        return (mirrored(K), mirrored(C)) if speed < 0 else (K, C)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Speeds ascend, whirl frequencies at each speed, the same ones at every speed."""
        over = sum(p.whirl_frequency is not None for p in self.points)
        if 0 < over < len(self.points):
            yield "points", "some have a whirl_frequency and some have none; give it at all of them or at none"
            return
        keys = [(p.speed, p.whirl_frequency or 0.0) for p in self.points]
        for i, (before, key) in enumerate(pairwise(keys), 1):
            if not key > before:
                name, k = ("speed", 0) if not over or key[0] != before[0] else ("whirl_frequency", 1)
                shown, last = show(key[k], "rad/s"), show(before[k], "rad/s")
                yield f"points.{i}.{name}", f"'{shown}' is not above the one before, '{last}'; sort the table"
                return
        every = [(speed, whirl) for speed in sorted({s for s, _ in keys}) for whirl in sorted({w for _, w in keys})]
        if missing := sorted(set(every) - set(keys)):
            speed, whirl = (show(value, "rad/s") for value in missing[0])
            yield (
                "points",
                f"at '{speed}' the whirl_frequency '{whirl}' is missing; every speed needs the same ones",
            )


def _fixed(values: np.ndarray) -> np.ndarray:
    """An array that is kept, and so may not be written to."""
    values.flags.writeable = False
    return values


def _between(axis: np.ndarray, values: np.ndarray, at: float) -> np.ndarray:
    """Values (n, ...) along an ascending axis (n,), linear in between and held beyond; the only ones of no axis."""
    if len(axis) < 2:
        return np.asarray(values[0])
    k = min(max(int(np.searchsorted(axis, at)), 1), len(axis) - 1)
    share = min(max((at - axis[k - 1]) / (axis[k] - axis[k - 1]), 0.0), 1.0)
    return np.asarray(values[k - 1] + share * (values[k] - values[k - 1]))
