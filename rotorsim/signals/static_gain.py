"""Static gain from the rest positions of a staircase: linear fit per input, deviations, hysteresis loops of the pins.

.. math:: d_i = d_{i0} + G_{ij} r_j

fitted by least squares over the rests of input j with the other input at its usual value. Source: thesis, section C.3.1
and figure C.5. Works on any record of the schema, so also on one of a rig.

Cites: thesis.
"""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from identification.records.schema import measured_name
from rotorsim.base.errors import DataError
from rotorsim.signals.record_blocks import MissingError, Values, blocks, need, sampling_time

LEAST = 0.1
"""Shortest stretch [s] that counts where no number of samples is given."""
FEWEST = 3
"""Levels of a gain."""


@dataclass(frozen=True)
class Holds:
    """Steps in order: `reference` (step, axis) [V], `disc` (step, axis) [m], `pin` (step, injector) [m] or None, over
    samples `start` to `stop` (step,); `output` is the displacement's name."""

    reference: np.ndarray
    disc: np.ndarray
    pin: np.ndarray | None
    start: np.ndarray
    stop: np.ndarray
    output: str


def find_holds(record: xr.Dataset, shortest: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First sample, sample after the last, reference (step, axis) [V] of stretches of `shortest` samples or more."""
    found: list[tuple[int, int, np.ndarray]] = []
    begin, last, position = 0, None, 0
    for block in blocks(record, ("reference",)):
        r = block["reference"]
        joined = r if last is None else np.vstack((last, r))
        shift = position - (last is not None)
        for i in np.flatnonzero(np.any(np.diff(joined, axis=0) != 0, axis=1)) + 1:
            if shift + i - begin >= shortest:
                found.append((begin, int(shift + i), joined[i - 1]))
            begin = int(shift + i)
        last, position = r[-1:], position + len(r)
    if last is not None and position - begin >= shortest:
        found.append((begin, position, last[0]))
    starts, stops, values = ([row[k] for row in found] for k in range(3))
    return np.array(starts, int), np.array(stops, int), np.array(values, float).reshape(len(found), 2)


def rest(record: xr.Dataset, output: str, shortest: int | None = None, share: float = 0.5) -> Holds:
    """Mean positions in the last `share` of every hold, over whole revolutions where the shaft makes one in it.

    Records of any length: displacements are read in blocks, and only if the reference takes enough levels. Raises
    MissingError if neither axis of the reference rests at three levels.
    """
    need("reference" in record, "The record has no reference of the actuators.")
    least = max(2, round(LEAST / sampling_time(record))) if shortest is None else shortest
    start, stop, reference = find_holds(record, least)
    levels = max(len(np.unique(reference[:, axis])) for axis in (0, 1))
    seconds = f"{least * sampling_time(record):.3g} s or longer"
    need(levels >= FEWEST, f"The reference rests at {levels} levels for {seconds}; a gain takes {FEWEST}.")
    names = [output, *filter(None, [measured_name(record, "pin")])]
    first = [b - _window(record, a, b, share) for a, b in zip(start, stop, strict=True)]
    means = [_means(record, names, a, b) for a, b in zip(first, stop, strict=True)]
    disc, *pin = (np.array([row[name] for row in means]) for name in names)
    return Holds(reference, disc, pin[0] if pin else None, start, stop, output)


def _window(record: xr.Dataset, start: int, stop: int, share: float) -> int:
    """Samples to average at the end of a hold."""
    n = max(round((stop - start) * share), 1)
    if "speed" not in record:
        return n
    speed = abs(float(_means(record, ["speed"], start, stop)["speed"]))
    turn = 2 * np.pi / (speed * round(sampling_time(record), 12)) if speed > 0 else np.inf
    return round(n // turn * turn) if n >= turn else n


def _means(record: xr.Dataset, names: list[str], start: int, stop: int) -> Values:
    """Mean of some variables from sample `start` to before `stop`, read in blocks."""
    totals: Values = {}
    for block in blocks(record[names].isel(time=slice(start, stop)), names):
        totals = {name: totals.get(name, 0.0) + block[name].sum(axis=0) for name in names}
    return {name: total / (stop - start) for name, total in totals.items()}


SHORTEST = 10
"""Samples that a step needs at least; shorter ones are not a rest."""
EXCITED = ("prbs", "chirp", "multisine")
"""Experiments that move the reference faster than the disc comes to rest."""
AXIS = ("x", "y")
NAMES = {
    "gain": "static gain",
    "offset": "disc at no reference",
    "deviation_max": "largest deviation from linear",
    "deviation_rms": "rms deviation from linear",
    "hysteresis": "largest opening between up and down",
}


@dataclass(frozen=True)
class Branches:
    """Rests of one input, numbers `steps` of all holds, in order: `reference` (step,) [V], `position` (step, output)
    [m], `rising` (step,) whether the reference rose to the step; fitted `gain` (output,) [m/V], `offset` (output,) [m],
    `deviation` (step, output) [m]."""

    axis: int
    steps: np.ndarray
    reference: np.ndarray
    position: np.ndarray
    rising: np.ndarray
    gain: np.ndarray
    offset: np.ndarray
    deviation: np.ndarray
    other_moves: bool

    @property
    def opening(self) -> np.ndarray:
        """Largest distance (output,) [m] between rising and falling branch at one reference; NaN without both."""
        return branch_distance(self.reference, self.position)


def static_gain_map(record: xr.Dataset, share: float = 0.5, variable: str | None = None) -> xr.Dataset:
    """Static gains of a staircase record.

    Parameters
    ----------
    record : Dataset
        With `reference` [V] and `disc_measured` or `disc` [m]; each step drives one axis, or neither.
    share : float
        Last part of every step that is averaged, above 0 and at most 1.
    variable : str, optional
        Displacement to take; `disc_measured` if the record has it, else `disc`.

    Returns
    -------
    Dataset
        reference (step, axis) [V] and disc (step, axis) [m]; gain (output, input) [m/V], offset (output, input) [m],
        deviation_max, deviation_rms and hysteresis (output, input) [m] for the driven inputs: the largest and the rms
        distance from the line, and the largest opening between the ways up and down, 0 without both.

    Raises
    ------
    DataError
        If a variable is missing, the experiment never rests or no axis of the reference rests at three levels.

    Examples
    --------
    >>> import rotorsim as rs
    >>> steps = rs.experiments.staircase(plant, pressure=0.5e6, axis="x", step=1.0, hold=0.2)
    >>> rs.signals.static_gain_map(steps)["gain"].dims
    ('output', 'input')
    """
    if not 0 < share <= 1:
        raise DataError(f"share = {share}: must be above 0 and at most 1; give e.g. 0.5")
    if record.attrs.get("experiment") in EXCITED:
        raise DataError(
            f"record: the reference of '{record.attrs['experiment']}' does not wait until the disc rests; "
            "give the record of a staircase",
            argument="experiment",
            value=record.attrs["experiment"],
        )
    wanted = ("disc_measured", "disc") if variable is None else (variable,)
    disc = next((name for name in wanted if name in record), None)
    if disc is None or "reference" not in record:
        raise DataError(f"record: lacks 'reference' or '{wanted[0]}'; give the record of a staircase")
    try:
        holds = rest(record, disc, SHORTEST, share)
    except MissingError as error:
        raise DataError(f"record: {error} Give the record of a staircase") from error
    fits = static_gain(holds)
    length, gain = {"units": "m"}, {"units": "m/V"}
    columns = {name: np.stack([_numbers(fit)[name] for fit in fits], axis=1) for name in NAMES}
    variables = {
        name: (("output", "input"), columns[name], (gain if name == "gain" else length) | {"long_name": label})
        for name, label in NAMES.items()
    }
    steps = {"reference": (("step", "axis"), holds.reference, {"units": "V", "long_name": "reference of a step"}),
             "disc": (("step", "axis"), holds.disc, length | {"long_name": "disc at rest"})}  # fmt: skip
    coords = {"axis": list(AXIS), "output": list(AXIS), "input": [AXIS[fit.axis] for fit in fits]}
    return xr.Dataset(steps | variables, coords, {"share": share})


def _numbers(fit: Branches) -> dict[str, np.ndarray]:
    """Variables (output,) of one input."""
    left = fit.deviation
    return {"gain": fit.gain, "offset": fit.offset, "deviation_max": np.abs(left).max(axis=0),
            "deviation_rms": np.sqrt((left**2).mean(axis=0)), "hysteresis": np.nan_to_num(fit.opening)}  # fmt: skip


def static_gain(holds: Holds) -> list[Branches]:
    """Branches of every input that takes three levels or more; the disc's positions are the outputs.

    Test: ``test_signals.py::test_a_known_gain_with_a_loop_is_found``.
    """
    chosen = [(axis, *_steps_of(holds, axis)) for axis in (0, 1)]
    return [_fit(holds, *c) for c in chosen if len(np.unique(holds.reference[c[1], c[0]])) >= FEWEST]


def _steps_of(holds: Holds, axis: int) -> tuple[np.ndarray, bool]:
    """Steps to or from which this input moves with the other at its usual value; all if these are too few."""
    other, length = holds.reference[:, 1 - axis], holds.stop - holds.start
    levels, index = np.unique(other, return_inverse=True)
    usual = levels[np.bincount(index, weights=length).argmax()]
    own = holds.reference[:, axis]
    changes = np.concatenate(([False], np.diff(own) != 0, [False]))
    steps = np.flatnonzero((other == usual) & (changes[:-1] | changes[1:]))
    if len(np.unique(holds.reference[steps, axis])) >= FEWEST:
        return steps, False
    return np.arange(len(other)), len(levels) > 1


def _fit(holds: Holds, axis: int, steps: np.ndarray, other_moves: bool) -> Branches:
    r, d = holds.reference[steps, axis], holds.disc[steps]
    slope, offset = np.polyfit(r, d, 1)
    left = d - np.outer(r, slope) - offset
    return Branches(axis, steps, r, d, directions(r), slope, offset, left, other_moves)


def directions(r: np.ndarray) -> np.ndarray:
    """Whether each value (n,) was reached from below; where nothing changes, as before."""
    change = np.sign(np.diff(r))
    moved = np.flatnonzero(change)
    if not moved.size:
        return np.ones(r.shape, bool)
    last = np.maximum.accumulate(np.where(change != 0, np.arange(change.size), moved[0]))
    return np.append(change[moved[0]] > 0, change[last] > 0)


def branch_distance(r: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Largest distance (output,) between rests d (n, output) at one r (n,) reached from below and from above, else NaN.

    The first rest was reached from neither.
    """
    way = np.sign(np.diff(r, prepend=r[0]))
    pairs = [(d[(r == level) & (way > 0)], d[(r == level) & (way < 0)]) for level in np.unique(r)]
    widest = [np.abs(up[:, None] - down[None]).max(axis=(0, 1)) for up, down in pairs if len(up) and len(down)]
    return np.max(widest, axis=0) if widest else np.full(d.shape[1], np.nan)


STILL = 1e-9
"""Pins that travel less [m] are left out."""


@dataclass(frozen=True)
class HysteresisLoop:
    """Rests of one pin (`injector` from 1): `pin` (step,) [m] over `reference` (step,) [V] of `axis`, its `travel` [m]
    and its `opening` [m], the largest distance of its branches at one reference (NaN without two branches)."""

    injector: int
    axis: int
    reference: np.ndarray
    pin: np.ndarray
    rising: np.ndarray
    travel: float
    opening: float


def loops(holds: Holds, gains: list[Branches]) -> list[HysteresisLoop]:
    """The loop of every pin that moves, over the input that moves it most."""
    if holds.pin is None:
        return []
    found = []
    for k in range(holds.pin.shape[1]):
        best = max((_loop(holds, g, k) for g in gains), key=lambda loop: loop.travel, default=None)
        if best is not None and best.travel > STILL:
            found.append(best)
    return found


def _loop(holds: Holds, gain: Branches, k: int) -> HysteresisLoop:
    assert holds.pin is not None
    pin = holds.pin[gain.steps, k]
    opening = float(branch_distance(gain.reference, pin[:, None])[0])
    return HysteresisLoop(k + 1, gain.axis, gain.reference, pin, gain.rising, float(np.ptp(pin)), opening)
