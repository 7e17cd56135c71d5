r"""Runout table: what the sensors read of the turning surface, which a law subtracts from each sample.

A probe that looks at a turning shaft reads motion and surface together. What it reads while the shaft turns too slowly
to move is the surface, a function of the shaft angle alone:

.. math:: y_k - r(\varphi_k), \qquad r(\varphi) = \sum_{n=1}^{N} a_n \cos n\varphi + b_n \sin n\varphi

fitted to a slow roll (thesis, 2.6.2) and kept as a table over the angle that the encoder reads, with straight lines
between its points. The mean is left in the reading: it is the position.

Cites: thesis, api_670.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from datetime import UTC, date, datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.records.schema import machine_of, measured
from identification.records.sensors import estimate_runout
from rotorsim.base.errors import LawError
from rotorsim.base.units import RPM, TO_RPM, TO_UM

if TYPE_CHECKING:
    import xarray as xr

POINTS = 720
"""Angles of a table: half a degree apart."""
ORDERS = 36
"""Highest order of the shaft angle in a table."""
FASTEST = 400.0 * RPM
"""Highest speed [rad/s] of a slow roll."""
TURNS = 2.0
"""Least number of revolutions of a slow roll."""


@dataclass(frozen=True, eq=False)
class RunoutTable:
    """Runout of the two sensors over the shaft angle.

    Parameters
    ----------
    values : array (n, 2)
        Reading of x and y [m] at n angles evenly from 0 over one turn, of mean zero.
    speed : float
        Speed of the slow roll [rad/s].
    turns : float
        Revolutions that the table is a mean of.
    machine : str
        Name of the machine; empty where the record states none.
    taken : str
        Date of the slow roll, YYYY-MM-DD; empty where it is not known.

    Raises
    ------
    LawError
        For values of another shape, of fewer than 8 angles, or not finite, for a speed and turns that are no numbers,
        and for a date that is none.

    Examples
    --------
    >>> import numpy as np
    >>> from rotorsim.control import RunoutTable
    >>> angle = np.arange(360) * np.pi / 180
    >>> RunoutTable(1e-6 * np.column_stack([np.cos(angle), np.sin(angle)])).peak.round(9).tolist()
    [1e-06, 1e-06]
    """

    values: np.ndarray
    speed: float = 0.0
    turns: float = 0.0
    machine: str = ""
    taken: str = ""

    def __post_init__(self) -> None:
        try:
            values, numbers = np.ascontiguousarray(self.values, float), [float(self.speed), float(self.turns)]
        except (TypeError, ValueError) as error:
            raise LawError("runout: holds text or lists where a table has numbers; take it again") from error
        if not (np.isfinite(numbers).all() and min(numbers) >= 0.0):
            raise LawError(f"runout: speed = {self.speed}, turns = {self.turns}; give finite numbers, 0 or more")
        object.__setattr__(self, "values", values)
        if values.ndim != 2 or values.shape[1] != 2 or len(values) < 8 or not np.isfinite(values).all():
            raise LawError(
                f"runout: a table of shape {values.shape}; give finite readings (n, 2) [m], n at least 8",
                argument="values",
            )
        if self.taken:
            try:
                date.fromisoformat(self.taken)
            except (TypeError, ValueError) as error:
                raise LawError(f"runout: taken = {self.taken!r}; give a date YYYY-MM-DD", argument="taken") from error

    @property
    def peak(self) -> np.ndarray:
        """Largest reading (2,) [m]."""
        return np.asarray(np.abs(self.values).max(axis=0))

    def at(self, angle: Any) -> np.ndarray:
        """Runout (k, 2) [m] at shaft angles (k,) [rad], as a running law takes it off."""
        place = np.mod(np.atleast_1d(np.asarray(angle, float)), 2 * np.pi) / (2 * np.pi) * len(self.values)
        low = np.floor(place).astype(int)
        share, n = (place - low)[:, None], len(self.values)
        return np.asarray((1 - share) * self.values[low % n] + share * self.values[(low + 1) % n])

    def age(self, today: date | None = None) -> int | None:
        """Days since the slow roll; None where its date is not known."""
        return ((today or datetime.now(UTC).date()) - date.fromisoformat(self.taken)).days if self.taken else None

    @property
    def origin(self) -> str:
        """Size, slow roll and date in one line."""
        x, y = self.peak * TO_UM
        when = f"taken {self.taken}" if self.taken else "date not known"
        of = f" of {self.machine}" if self.machine else ""
        return f"x {x:.3g}, y {y:.3g} um 0-pk, {self.turns:.3g} turns{of} at {self.speed * TO_RPM:.4g} rpm, {when}"

    @property
    def text(self) -> str:
        """Size, slow roll, date and age in one line."""
        age = self.age()
        if age is None:
            return self.origin
        return f"{self.origin}, {'in the future' if age < 0 else 'today' if not age else f'{age} days ago'}"

    @classmethod
    def from_dict(cls, data: Any) -> RunoutTable:
        """Table of what `to_dict` gave; raises LawError."""
        names = [field.name for field in fields(cls)]
        if not isinstance(data, dict) or not {"values"} <= data.keys() <= {*names}:
            raise LawError(f"runout: is not a table; its entries are {', '.join(names)}", argument="runout")
        return cls(**data)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists for JSON."""
        return {**self.__dict__, "values": self.values.tolist()}


def runout_table(slow_roll: xr.Dataset, points: int = POINTS, orders: int = ORDERS, taken: str = "") -> RunoutTable:
    """Table of a slow roll.

    Parameters
    ----------
    slow_roll : Dataset
        Record of the schema with `disc_measured` and the shaft angle, of whole or more turns at one low speed.
    points, orders : int
        Number of angles and highest order of the table; fewer orders where the record has too few samples a turn.
    taken : str
        Date YYYY-MM-DD; that of the record, its attribute `date`, where it is not given.

    Raises
    ------
    LawError
        For a record without angle or reading, of fewer than two turns, or above 400 rpm, where the shaft moves.

    Examples
    --------
    >>> import rotorsim as rs
    >>> slow = rs.experiments.slow_roll(plant, speed=10.5, pressure=0.5e6, revolutions=2)
    >>> law = law.with_(runout=rs.control.runout_table(slow))
    """
    if not hasattr(slow_roll, "data_vars"):
        raise LawError(
            f"runout: {type(slow_roll).__name__} is no record; open it, e.g. rs.identification.read('slow.nc')",
            argument="slow_roll",
        )
    angle = measured(slow_roll, "angle")
    if angle is None or "disc_measured" not in slow_roll:
        raise LawError("runout: the slow roll has no shaft angle or no disc_measured; map the encoder and the probes")
    y = np.asarray(slow_roll["disc_measured"].values, float)
    time = np.asarray(slow_roll["time"].values, float)
    good = np.isfinite(angle) & np.isfinite(y).all(axis=1)
    angle, y, time = angle[good], y[good], time[good]
    if angle.size > 1 and np.abs(np.diff(angle)).max() > np.pi:
        raise LawError("runout: the shaft angle jumps; give it unwrapped, in one piece", argument="angle")
    turns = abs(angle[-1] - angle[0]) / (2 * np.pi) if angle.size > 1 else 0.0
    if turns < TURNS * (1 - 1e-3):
        raise LawError(
            f"runout: the slow roll has {turns:.3g} turns; record {TURNS:g} or more, e.g. --revolutions 5",
            argument="turns",
        )
    speed = abs(angle[-1] - angle[0]) / (time[-1] - time[0])
    fastest = _fastest(angle, time)
    if fastest > FASTEST:
        raise LawError(
            f"runout: {fastest * TO_RPM:.4g} rpm is no slow roll, the shaft itself moves; record below "
            f"{FASTEST * TO_RPM:.4g} rpm",
            argument="speed",
            value=fastest,
        )
    if slow_roll.attrs.get("slow_roll"):
        raise LawError("runout: the record's slow roll is subtracted, nothing is left of it; give the original")
    machine = machine_of(slow_roll).rpartition(" ")[0]
    found = estimate_runout(angle, y, count=orders).at(2 * np.pi * np.arange(points) / points)
    return RunoutTable(found - found.mean(axis=0), float(speed), float(turns), machine, taken or date_of(slow_roll))


def date_of(record: xr.Dataset) -> str:
    """Date YYYY-MM-DD of a record by its attribute `date`; empty where it has none that can be read."""
    try:
        return datetime.fromisoformat(str(record.attrs["date"])).date().isoformat()
    except (KeyError, ValueError):
        return ""


def _fastest(angle: np.ndarray, time: np.ndarray) -> float:
    """Highest speed [rad/s] over a quarter of a turn, which an encoder's counts do not move."""
    turned = np.abs(angle - angle[0])
    marks = np.searchsorted(np.maximum.accumulate(turned), np.arange(0.0, turned[-1], np.pi / 2))
    return float((np.diff(turned[marks]) / np.maximum(np.diff(time[marks]), 1e-12)).max())


@dataclass(frozen=True)
class RunoutCheck:
    """A runout table next to another slow roll of the same sensors: rms over both axes [m], angle [rad].

    `reading` is the runout of the slow roll, `left` what the table leaves of it, `turned_left` what it would leave
    turned by `turn`, the angle at which it fits best.
    """

    reading: float
    left: float
    turn: float
    turned_left: float

    @property
    def bound(self) -> float:
        """Largest rest [m] of a table that is that of the surface."""
        return max(LEFT * self.reading, SMALL)

    @property
    def text(self) -> str:
        """The rest that the table leaves, and its cause where it is above the bound."""
        found = f"leaves {self.left * TO_UM:.2g} of {self.reading * TO_UM:.2g} um rms at a slow roll"
        if self.left <= self.bound:
            return found
        if self.turned_left <= self.bound:
            return f"{found}: it fits turned by {np.degrees(self.turn):.3g} deg, the zero of the shaft angle has moved"
        return f"{found}: the surface is another one; take the table again"


LEFT = 0.33
"""Share of the runout that a table leaves at most while it counts as that of the surface."""
SMALL = 0.1e-6
"""Rest [m] that sensors with a usual noise leave of any table."""


def check_runout(table: RunoutTable, slow_roll: xr.Dataset) -> RunoutCheck:
    """Rest that a table leaves of the runout of another slow roll, as it stands and turned to where it fits best.

    Raises LawError as `runout_table` does.

    Examples
    --------
    >>> import rotorsim as rs
    >>> slow = rs.experiments.slow_roll(plant, speed=10.5, pressure=0.5e6, revolutions=2)
    >>> found = rs.control.check_runout(rs.control.runout_table(slow), slow)
    >>> found.left < 0.01 * found.reading
    True
    """
    n = len(table.values)
    now = runout_table(slow_roll, points=n).values
    product = np.fft.irfft((np.conj(np.fft.rfft(table.values, axis=0)) * np.fft.rfft(now, axis=0)).sum(axis=1), n)
    shift = int(product.argmax())

    def rms(values: np.ndarray) -> float:
        return float(np.sqrt(np.mean(values**2)))

    turn = (shift if 2 * shift <= n else shift - n) * 2 * np.pi / n
    return RunoutCheck(rms(now), rms(now - table.values), turn, rms(now - np.roll(table.values, shift, axis=0)))
