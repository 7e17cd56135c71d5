r"""Linear bearings: constant coefficients, or tables over shaft speed and whirl frequency.

The force on the shaft is -[k] (x, y) - [c] (dx, dy), relative to the ground or to the node `n_link` of a pedestal.
Between the entries of a table coefficients are linear; outside it they are refused, or held constant on request.

A table over the speed is that of a shaft that turns from x to y. A shaft that turns the other way is its mirror image:
coefficients at abs(Omega) with the cross terms of the opposite sign. Constant coefficients do not know of the rotation
and hold for either sense.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fe_shaft.shaft import ShaftError, grid

_NAMES = ("kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy")
HOLD = "hold"


@dataclass(frozen=True, eq=False)
class BearingElement:
    """Linear bearing on node `n`.

    Parameters
    ----------
    n : int
        Node.
    kxx, kxy, kyx, kyy : float or array
        Stiffness [N/m]; `kyy` defaults to `kxx`, the cross terms to 0. An array is a table: (n_speed,), or
        (n_speed, n_whirl) where both axes are given, or (n_whirl,) with `whirl_frequency` alone.
    cxx, cxy, cyx, cyy : float or array
        Damping [N s/m]; `cyy` defaults to `cxx`, the cross terms to 0.
    frequency : array (n_speed,), optional
        Speeds of the shaft at which the tables stand [rad/s], ascending from 0 or above; a shaft that turns the other
        way has the same table with cross terms of the opposite sign.
    whirl_frequency : array (n_whirl,), optional
        Whirl frequencies at which the tables stand [rad/s], ascending.
    n_link : int, optional
        Node that carries the bearing; the ground without it. A number behind the shaft's last node is a pedestal,
        which moves in x and y and needs a PointMass and a bearing of its own.
    extrapolate : {'error', 'hold'}
        What to do outside a table.

    Raises
    ------
    ShaftError
        If a table holds NaN, is unsorted, does not fit its axes or begins below 0.

    Examples
    --------
    >>> import fe_shaft
    >>> fe_shaft.BearingElement(0, kxx=[1e6, 2e6], cxx=[100.0, 80.0], frequency=[0.0, 500.0]).n
    0
    """

    n: int
    kxx: ArrayLike
    cxx: ArrayLike
    kyy: ArrayLike | None = None
    kxy: ArrayLike = 0.0
    kyx: ArrayLike = 0.0
    cyy: ArrayLike | None = None
    cxy: ArrayLike = 0.0
    cyx: ArrayLike = 0.0
    frequency: ArrayLike | None = None
    whirl_frequency: ArrayLike | None = None
    n_link: int | None = None
    extrapolate: str = "error"

    def __post_init__(self) -> None:
        """Make the bearing isotropic where the y direction is not given; check the tables."""
        owner = f"bearing at node {self.n}"
        for name, other in (("kyy", "kxx"), ("cyy", "cxx")):
            if getattr(self, name) is None:
                object.__setattr__(self, name, getattr(self, other))
        for axis in ("frequency", "whirl_frequency"):
            if getattr(self, axis) is not None:
                object.__setattr__(self, axis, _from_rest(f"{owner}: {axis} [rad/s]", getattr(self, axis)))
        if self.extrapolate not in ("error", HOLD):
            raise ShaftError(f"{owner}: extrapolate = {self.extrapolate!r}; choose 'error' or 'hold'.")
        for name in _NAMES:
            object.__setattr__(self, name, self._checked(name, owner))

    @property
    def axes(self) -> tuple[NDArray[np.float64], ...]:
        """Axes of the tables [rad/s]: speed, whirl frequency, as far as they are given."""
        return tuple(np.asarray(a) for a in (self.frequency, self.whirl_frequency) if a is not None)

    @property
    def constant(self) -> bool:
        """Whether no coefficient depends on speed or whirl frequency."""
        return not self.axes

    def _checked(self, name: str, owner: str) -> Any:
        value = np.asarray(getattr(self, name), dtype=float)
        if not np.all(np.isfinite(value)):
            raise ShaftError(f"{owner}: {name} holds {value[~np.isfinite(value)].flat[0]:g}; give finite numbers only.")
        if value.ndim == 0:
            return float(value)
        sizes = tuple(len(axis) for axis in self.axes)
        if value.shape != sizes:
            raise ShaftError(
                f"{owner}: {name} has shape {value.shape}, but its axes have {sizes or 'no'} entries; "
                "give `frequency` and `whirl_frequency` that fit."
            )
        return value

    @property
    def stiffness(self) -> NDArray[np.float64]:
        """Stiffness (2, 2) [N/m] of a constant bearing, else of the tables' first entry."""
        return self._matrix("k", lambda value: np.asarray(value).flat[0])

    @property
    def damping(self) -> NDArray[np.float64]:
        """Damping (2, 2) [N s/m] of a constant bearing, else of the tables' first entry."""
        return self._matrix("c", lambda value: np.asarray(value).flat[0])

    def stiffness_at(self, speed: float, whirl: float | None = None) -> NDArray[np.float64]:
        """Stiffness (2, 2) [N/m] at `speed` [rad/s], the mirror image's where it is negative.

        The `whirl` frequency is the speed where it is not given.
        """
        return self._at("k", speed, whirl)

    def damping_at(self, speed: float, whirl: float | None = None) -> NDArray[np.float64]:
        """Damping (2, 2) [N s/m], likewise."""
        return self._at("c", speed, whirl)

    def _at(self, kind: str, speed: float, whirl: float | None) -> NDArray[np.float64]:
        if self.constant:
            return self._matrix(kind, lambda value: value)
        point = {"frequency": abs(speed), "whirl_frequency": abs(speed if whirl is None else whirl)}
        weights = [self._weights(axis, x) for axis, x in point.items() if getattr(self, axis) is not None]
        found = self._matrix(kind, lambda value: _contract(value, weights))
        return mirrored(found) if speed < 0 and self.frequency is not None else found

    def _matrix(self, kind: str, read: Any) -> NDArray[np.float64]:
        return np.array([[read(getattr(self, f"{kind}{row}{column}")) for column in "xy"] for row in "xy"], dtype=float)

    def _weights(self, axis: str, x: float) -> NDArray[np.float64]:
        """Weights (n,) of the entries along an axis."""
        grid = np.asarray(getattr(self, axis))
        if not grid[0] * (1 - 1e-9) - 1e-9 <= x <= grid[-1] * (1 + 1e-9) and self.extrapolate != HOLD:
            what = "speed" if axis == "frequency" else "whirl frequency"
            raise ShaftError(
                f"bearing at node {self.n}: {what} {x:g} rad/s is outside its table, {grid[0]:g} to {grid[-1]:g} "
                "rad/s; extend the table or set extrapolate='hold'."
            )
        return np.array([np.interp(x, grid, unit) for unit in np.eye(len(grid))])


def mirrored(coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients (..., 2, 2) of the mirror image, y to -y: cross terms change their sign.

    Examples
    --------
    >>> import numpy as np
    >>> from fe_shaft.bearing import mirrored
    >>> mirrored(np.array([[2.0, 1.0], [-1.0, 2.0]])).tolist()
    [[2.0, -1.0], [1.0, 2.0]]
    """
    return coefficients * np.array([[1.0, -1.0], [-1.0, 1.0]])


def _from_rest(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """An ascending axis (n,) of magnitudes; raises ShaftError for a negative one."""
    found = grid(name, values)
    if found[0] < 0:
        raise ShaftError(
            f"{name}: the table begins at {found[0]:g}; begin at 0 or above, negative ones are the mirror image."
        )
    return found


def _contract(value: Any, weights: list[NDArray[np.float64]]) -> float:
    if np.ndim(value) == 0:
        return float(value)
    for weight in weights:
        value = weight @ value
    return float(value)
