"""Records of a diagnosis as trials, with the checks before a fit and after it.

Sensors, speed, loop and units are checked when a record is loaded; units, channels and clocks against the response of
the machine file before the fit; the share that stays unexplained after it. A likely mistake is suggested and never
assumed: a diagnosis stops with the sentence. Effects that a set of records cannot distinguish are stated as sentences.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification import notes_of, read
from identification.records.prefilter import operating_point
from identification.records.sampling import sampling_time
from identification.records.schema import measured
from identification.records.sensors import DISPLACEMENTS, WORST
from rotorsim.base.display import listing
from rotorsim.base.errors import DataError, ReadError, SchemaError
from rotorsim.base.rounding import answer
from rotorsim.base.units import RIG_SAMPLE, TO_RPM
from rotorsim.discrepancy.calibration import ParameterPoint
from rotorsim.discrepancy.changes import PLANE, RING, RING_KEY, known_changes, ring_angle, ring_axes
from rotorsim.discrepancy.comparison import TwinComparison
from rotorsim.discrepancy.data_vector import EXCITED, repeats
from rotorsim.discrepancy.trial import (
    LARGEST_OFFSET,
    TURNING,
    Trial,
    displacement_of,
    drift_of,
    only_probe,
    stated,
    trial_of,
    with_repeats,
    without_drift,
)
from rotorsim.machine import Machine
from rotorsim.machine.numerics import FEWEST
from rotorsim.plant.mesh import Mesh

if TYPE_CHECKING:
    import xarray as xr

LARGEST_ACCURACY = 1e-3
"""Accuracy [m] from which a record shows nothing."""
TURNED = {60 / (2 * np.pi): "rpm taken for rad/s", 2 * np.pi: "Hz taken for rad/s", 60.0: "Hz taken for rpm"}
"""Ratios of a speed to the turning of the angle, or the other way round, that a wrong unit makes."""
FEWEST_LINES = 12
"""Excited lines of a record from which its frequencies and gains are laid over the twin's."""
SCALES = np.exp(np.linspace(np.log(0.5), np.log(2.0), 281))
"""Factors on the frequency that are tried."""
RINGING, FEWEST_PARTS, MOST_ORDERS, RESOLVED = 0.05, 5, 6, 3
"""Least length [s] of the parts of a record in which ringing is looked for, fewest of them, orders that are none, and
turns of a part at least: in a shorter one they are whatever lies between them too."""
HIT, LEAST_HIT = 10.0, 0.1
"""Motion of a part beyond the orders, over that of the last but one and over the whole, from which it was hit."""
AT_REST = 1e-3
"""Motion of a part over that of the whole below which the shaft was at rest."""
SAME_PLANE = 1e-3
"""Distance [m] up to which a probe of a record stands at a plane of the machine file."""
RIGHT_ANGLE = 1e-4
"""Missing cosine up to which two probes stand a right angle apart: under a degree."""
SPEED_CHANNELS = ("speed", "speed_measured", "angle", "angle_measured")
"""Channels that show the speed."""
NO_REFERENCE = (
    "{}: without the references of the injectors, which are taken as 0 V; if they were driven, what they do is taken "
    "for a fault: map reference_x and reference_y"
)
"""Note on records whose references are not known."""
FEWEST_POINTS = 4
"""Operating points from which a smooth trend differs from a missing effect."""
MORE_SPEEDS = FEWEST_POINTS - 1
"""Further speeds to record where there is one."""
CLEARLY_OFF = 0.02
"""Share by which half of the frequencies have to be off one way for a mass or a stiffness to be suggested."""
Source = Any
"""A Dataset, or the path of a file of it."""
UNLIKE, FOREIGN = 0.5, 0.8
"""Shares of the response that stay unexplained: from the first nothing is named, from the second it is refused."""


def stated_accuracy(record: xr.Dataset, name: str) -> float:
    """Attribute `accuracy` [m] of a record, 0 where there is none; raises DataError for one that is not a length."""
    wanted = "the standard deviation of an amplitude in metres"
    return stated(record.attrs, "accuracy", 0.0, lambda a: 0 <= a < LARGEST_ACCURACY, name, "the accuracy", wanted)


def check_constant(record: xr.Dataset, name: str) -> None:
    """The speed may differ by 2 % or 2 rad/s, in means of 250 samples."""
    speed = measured(record, "speed")
    if speed is None or speed.ndim == 0 or len(speed) < 1000:
        return
    slow = speed[: len(speed) // 250 * 250].reshape(-1, 250).mean(axis=1)[1:]
    if np.ptp(slow) > max(2.0, 0.02 * abs(slow.mean())):
        raise DataError(
            f"{name}: the speed goes from {slow.min() * TO_RPM:.0f} to {slow.max() * TO_RPM:.0f} rpm; "
            "give records at constant speed, or a run-up with its angle and without excitation: map the column of the "
            "angle or of a keyphasor, which 'rotorsim data check' looks for"
        )


def check_loop(record: xr.Dataset, name: str) -> None:
    """Closed loop: the dither that was added must be there, and the reference that acted is what is fed."""
    closed = "controller" in record.attrs or str(record.attrs.get("experiment", "")) == "controlled"
    if closed and "reference_external" not in record:
        raise DataError(
            f"{name}: was recorded in closed loop without the dither that was added; record reference_external as well",
            argument="reference_external",
        )


def check_turning(record: xr.Dataset, speed: float, n: int, name: str) -> None:
    """The angle must turn as fast as the speed signal."""
    angle = measured(record, "angle")
    if angle is None or angle.ndim == 0 or abs(speed) < TURNING or n < 1000:
        return
    slope = float(np.polyfit(RIG_SAMPLE * np.arange(n), np.unwrap(angle), 1)[0])
    if abs(slope - speed) < 0.02 * abs(speed) + 1.0:
        return
    raise DataError(
        f"{name}: the speed is {speed:.5g} rad/s, but the angle turns at {slope:.5g} rad/s; "
        f"{misread_speed(speed, slope)}",
        argument="speed",
        value=speed,
    )


def misread_speed(stated: float, shown: float, within: float = 0.02) -> str:
    """Advice about a stated speed that is not the one shown, by the unit that may be taken for another."""
    ratio = abs(stated / shown) if shown else np.inf
    units = [what for factor, what in TURNED.items() if min(abs(ratio / factor - 1), abs(ratio * factor - 1)) < within]
    return (
        f"is there {units[0]}? state the unit in the mapping; nothing was assumed" if units else "check both channels"
    )


def check_sensors(machine: Machine, record: xr.Dataset, name: str) -> None:
    """Raise DataError for a record without a speed, without x and y of the disc, or of another plane."""
    if not any(channel in record for channel in SPEED_CHANNELS):
        raise DataError(f"{name}: has no speed and no keyphasor; map one, or state [constants] speed in the mapping")
    if "disc_measured" in record or "disc" in record or "probe_measured" not in record:
        check_plane(machine, record.attrs.get("disc_position"), name)
    elif (probe := only_probe(record)) is not None:
        position = float(probe["probe_position"])
        check_plane(machine, None if np.isnan(position) else position, name)
    else:
        probes = ", ".join(map(str, record["probe"].values))
        raise DataError(
            f"{name}: has readings of {probes}, which are not x and y of the disc; a diagnosis needs one displacement "
            "probe with its angle, or two at one plane"
        )


def check_plane(machine: Machine, stated: Any, name: str) -> None:
    """Raise DataError where probes at the position `stated` [m] are not where the machine file has its own."""
    if stated is None:
        return
    own = Mesh(machine).probe
    if abs(float(stated) - own) > SAME_PLANE:
        raise DataError(
            f"{name}: its probes stand at {1e3 * float(stated):.6g} mm, the machine file's at {1e3 * own:.6g} mm; "
            "set [probe] position there, or [disc] position in the mapping"
        )


def check_ring(machine: Machine, trial: Trial) -> None:
    """Raise DataError for a single probe on a sensor ring that is turned: the record states where the probe stands."""
    if trial.probe_angle is not None and (trial.changes.get(RING_KEY) or ring_angle(machine)):
        raise DataError(
            f"{trial.name}: the sensor ring is turned, but the record has one probe; leave the ring out of [changes] "
            "and of the machine file, and state the angle of the probe"
        )


def open_records(sources: Source | Iterable[Source], mapping: Any = None) -> list[tuple[str, xr.Dataset]]:
    """Names and Datasets of records, no two of one name; a folder gives its .nc files, sorted by name."""
    out: list[tuple[tuple[str, ...], xr.Dataset]] = []
    alone = isinstance(sources, (str, Path)) or hasattr(sources, "attrs")
    for i, source in enumerate([sources] if alone else sources):
        if not isinstance(source, (str, Path)):
            out.append(((str(source.attrs.get("record", f"record {i + 1}")),), source))
            continue
        path = Path(source)
        files = sorted(path.rglob("*.nc")) if path.is_dir() else [path]
        if not files:
            raise DataError(f"{path}: no .nc record in it; give a folder of records or name the files")
        for file in files:
            try:
                out.append(((*file.parent.parts, file.stem), read(file, mapping)))
            except (ReadError, SchemaError) as error:
                raise DataError(str(error)) from error
    return list(zip(distinct_names([path for path, _ in out]), [record for _, record in out], strict=True))


def distinct_names(paths: Sequence[tuple[str, ...]]) -> list[str]:
    """Last parts of paths, with as many folders as make them different; a number where none do."""
    found = {path: path[-1] for path in paths}
    for depth in range(2, max(map(len, paths), default=0) + 1):
        alike = Counter(found.values())
        found = {path: "/".join(path[-depth:]) if alike[name] > 1 else name for path, name in found.items()}
    names = [found[path] for path in paths]
    alike, seen = Counter(names), Counter[str]()
    for i, name in enumerate(names):
        seen[name] += 1
        names[i] = f"{name} ({seen[name]})" if alike[name] > 1 else name
    return names


def record_notes(opened: Sequence[tuple[str, xr.Dataset]]) -> list[str]:
    """Sentences on parts that reading left out of records or changed in them, one for all records with the same."""
    of: dict[str, list[str]] = {}
    for name, record in opened:
        for text in notes_of(record):
            of.setdefault(text, []).append(name)
    return [
        f"{listing(names, 3) if len(names) < len(opened) else 'every record'}: {text}" for text, names in of.items()
    ]


def reference_notes(machine: Machine, opened: Sequence[tuple[str, xr.Dataset]]) -> list[str]:
    """Sentence on records without references of a machine with pins; none for tables of vectors."""
    names = [name for name, record in opened if "speed" not in record.dims and "reference" not in record]
    if not names or not any(one.reference for one in machine.injectors):
        return []
    return [NO_REFERENCE.format(listing(names, 3) if len(names) < len(opened) else "every record")]


@dataclass(frozen=True, eq=False)
class ProbeView:
    """Readings (n, 2) [m] of the probes of one plane, in their own directions where these are a right angle apart.

    angle : angle [rad] of the only probe; None where there are two
    names : names of the channels, where a record states them; none for x and y
    changes : direction [rad] of the first probe as that of the sensor ring, and the plane [m] where it is another one
    """

    readings: np.ndarray
    angle: float | None = None
    names: tuple[str, ...] = ()
    changes: Mapping[str, float] = field(default_factory=dict)


def views_of(machine: Machine, record: xr.Dataset, name: str) -> list[ProbeView]:
    """The machine file's own plane, and all others whose probes state where they stand."""
    motion, angle = displacement_of(record, name)
    names = tuple(str(record.attrs.get("disc_probes", "")).split(", "))
    angles = np.atleast_1d(np.asarray(record.attrs.get("disc_probe_angles", ()), float))
    turned = RING in str(record.attrs.get("changes", "")) or ring_angle(machine)
    own = ProbeView(motion, angle)
    if angle is None and len(angles) == len(names) == 2 and not turned:
        own = _along_probes(motion, names, angles, {})
    return [own, *(_other_planes(machine, record) if angle is None else ())]


def _along_probes(
    motion: np.ndarray, names: tuple[str, ...], angles: np.ndarray, plane: Mapping[str, float]
) -> ProbeView:
    """Motion in x and y (n, 2) [m] along two probes a right angle apart; x and y for others."""
    first = next((i for i in (0, 1) if abs(np.cos(angles[1 - i] - angles[i] - 0.5 * np.pi) - 1) < RIGHT_ANGLE), None)
    if first is None:
        return ProbeView(motion, changes=plane)
    angle = float(angles[first])
    ring = {RING_KEY: angle} if angle else {}
    return ProbeView(motion @ ring_axes(angle).T, None, (names[first], names[1 - first]), {**plane, **ring})


def _other_planes(machine: Machine, record: xr.Dataset) -> Iterator[ProbeView]:
    """Planes of `probe_measured` that are not the machine file's, with one displacement probe or two."""
    if not {"probe_quantity", "probe_angle", "probe_gain", "probe_position"} <= set(record.coords):
        return
    found, own = record["probe_measured"], Mesh(machine).probe
    ends = machine.shaft.start, machine.shaft.end
    z = np.asarray(found["probe_position"].values, float)
    of_use = np.isin(found["probe_quantity"].values, DISPLACEMENTS) & (np.abs(z - own) > SAME_PLANE)
    of_use &= (z >= ends[0]) & (z <= ends[1])
    for place in np.unique(z[of_use]):
        own_probes = found.isel(probe=np.flatnonzero(of_use & (z == place)))
        angles = np.asarray(own_probes["probe_angle"].values, float)
        readings = np.asarray(own_probes.values, float) / np.asarray(own_probes["probe_gain"].values, float)
        names = tuple(map(str, own_probes["probe"].values))
        seen, plane = np.column_stack([np.cos(angles), np.sin(angles)]), {PLANE: float(place)}
        if len(names) > 1 and answer(np.linalg.cond, seen) < WORST:
            yield _along_probes(answer(np.linalg.lstsq, seen, readings.T, rcond=None)[0].T, names, angles, plane)
        elif len(names) == 1:
            yield ProbeView(np.column_stack([readings[:, 0], 0 * readings[:, 0]]), float(angles[0]), names, plane)


def plane_notes(machine: Machine, opened: Sequence[tuple[str, xr.Dataset]]) -> list[str]:
    """Sentences on displacement probes that take no part, as they state no place on the shaft."""
    found: dict[str, None] = {}
    ends = machine.shaft.start, machine.shaft.end
    for _, record in opened:
        if "probe_measured" not in record or "disc_measured" not in record or "probe_position" not in record.coords:
            continue
        for probe, z in zip(record["probe"].values, record["probe_position"].values, strict=True):
            if not ends[0] <= float(z) <= ends[1]:  # nor a number
                found[str(probe)] = None
    if not found:
        return []
    return [f"{listing(list(found), 3)}: state no place on the shaft and take no part; give [probes] position"]


def make_trials(machine: Machine, records: Sequence[tuple[str, xr.Dataset]], role: str | None) -> list[Trial]:
    """Trials sorted by operating point, so that the order of the records has no effect."""
    trials = []
    for name, record in records:
        own = role or str(record.attrs.get("role", "fit"))
        check_sensors(machine, record, name)
        changes = known_changes(machine, record.attrs.get("changes"), name)
        for view in views_of(machine, record, name):
            shown = f"{name}, {1e3 * view.changes[PLANE]:.6g} mm" if PLANE in view.changes else name
            trials.append(replace(make_trial(record, own, shown, view), changes={**changes, **view.changes}))
            check_ring(machine, trials[-1])
            check_pressure(machine, trials[-1])
            check_turns(trials[-1])
    trials = [with_repeats(one, [t for t in trials if repeats(t, one)]) for one in trials]
    return sorted(trials, key=lambda t: (t.role, round(t.speed, 2), round(t.pressure, -2), t.amplitude, _digest(t)))


def make_trial(record: xr.Dataset, role: str = "fit", name: str = "record", view: ProbeView | None = None) -> Trial:
    """Trial from a record, as x and y of the disc or the probes of a view show it; raises DataError with a sentence."""
    Ts = sampling_time(record)
    if abs(Ts / RIG_SAMPLE - 1) > 1e-6:
        raise DataError(
            f"{name}: is sampled at {1 / Ts:.6g} Hz, a diagnosis needs 5000 Hz; resample it", argument="Ts", value=Ts
        )
    view = view or ProbeView(*displacement_of(record, name))
    displacement, n = view.readings, len(view.readings)
    speed, pressure = operating_point(record, Ts)
    check_constant(record, name)
    check_loop(record, name)
    check_turning(record, speed, n, name)
    if "force_position" in record.attrs:
        place = float(record.attrs["force_position"]) * 1e3
        raise DataError(f"{name}: was hit at {place:.6g} mm; a diagnosis takes forces on the disc: leave it out")
    check_hits(record, displacement, speed, name)
    rows = np.zeros((n, 6))
    rows[:, 0], rows[:, 1] = speed, pressure if np.isfinite(pressure) else 0.0
    for column, channel in ((2, "reference"), (4, "disc_force")):
        if channel in record:
            rows[:, column : column + 2] = record[channel].values
    found = trial_of(rows, displacement, _initial_angle(record, speed, n), name)
    wanted = f"the standard deviation of its offset, up to {LARGEST_OFFSET} seconds"
    clock = stated(record.attrs, "clock", 0.0, lambda c: 0 <= c <= LARGEST_OFFSET, name, "the clock", wanted)
    spectra = found.spectra
    if clock and found.repeating:
        f, duration = found.frequencies, found.length * RIG_SAMPLE
        spectra = without_drift(spectra, f, duration, drift_of(spectra, f, duration))
    return replace(
        found, role=role, spectra=spectra, accuracy=stated_accuracy(record, name), clock=clock,
        probe_angle=view.angle, names=view.names,
    )  # fmt: skip


def _initial_angle(record: xr.Dataset, speed: float, n: int) -> float:
    """Shaft angle [rad] at the first sample of a turn at constant speed that fits the encoder best."""
    angle = measured(record, "angle")
    if angle is None or abs(speed) < TURNING:
        return 0.0
    return float(np.mod(np.median(angle - speed * RIG_SAMPLE * np.arange(n)), 2 * np.pi))


def _digest(trial: Trial) -> str:
    return hashlib.sha256(np.ascontiguousarray(trial.spectra).tobytes()).hexdigest()


def data_hash(trials: Iterable[Trial]) -> str:
    """Short hash of all measured data, independent of their order."""
    return hashlib.sha256("".join(sorted(map(_digest, trials))).encode()).hexdigest()[:16]


def check_hits(record: xr.Dataset, displacement: np.ndarray, speed: float, name: str) -> None:
    """Raise DataError for a shaft that rings down, as after hits of a hammer, where no force is recorded."""
    excited = any(c in record and np.any(record[c].values) for c in ("reference", "disc_force"))
    turns = RESOLVED * 2 * np.pi / abs(speed) if abs(speed) > TURNING else 0.0
    part = round(max(RINGING, turns) / RIG_SAMPLE)
    count = len(displacement) // part
    if excited or count < FEWEST_PARTS:
        return
    t = np.arange(part) * RIG_SAMPLE
    turning = np.outer(t, speed * np.arange(1, MOST_ORDERS + 1) if abs(speed) > TURNING else ())
    known = np.column_stack([np.ones(part), t, np.cos(turning), np.sin(turning)])
    own = displacement[: count * part].reshape(count, part, -1)
    left = own - np.einsum("ij,njk->nik", known @ answer(np.linalg.pinv, known), own)
    size, moves = np.sqrt(np.mean(left**2, axis=(1, 2))), float(np.std(own - own.mean(axis=(0, 1))))
    rise = size[2:] / np.maximum(size[:-2], 1e-300)  # a start at rest falls, and never rises
    hits = np.flatnonzero((rise > HIT) & (size[2:] > LEAST_HIT * moves))
    if len(hits):
        first = hits[0]
        loudest = np.argmax(np.abs(left[first + 1 : first + 3]).max(axis=2))
        at, rest = float((first + 1) * part + loudest) * RIG_SAMPLE, size[first] < AT_REST * moves
        before = "was at rest before" if rest else f"{rise[first]:.0f} times what it did before"
        raise DataError(
            f"{name}: rings down from {at:.3g} s on, {before}, and no force is recorded; map the hammer's force, or "
            "leave the record out",
            argument="disc_force",
            value=at,
        )


def check_turns(trial: Trial) -> None:
    """Raise DataError for a shaft that turns too fast for the rate at which records are compared."""
    samples = 2 * np.pi / max(abs(trial.speed) * RIG_SAMPLE, 1e-300)
    if samples < FEWEST:
        raise DataError(
            f"{trial.name}: at {abs(trial.speed) * TO_RPM:.6g} rpm a turn has {samples:.2g} samples at the 5 kHz of a "
            f"diagnosis and needs {FEWEST}; give records of slower turns",
            argument="speed",
            value=trial.speed,
        )


def check_pressure(machine: Machine, trial: Trial) -> None:
    """Raise DataError for a pressure in other units or a displacement larger than any clearance."""
    if machine.film is None:
        return
    if trial.pressure != 0 and abs(trial.pressure) < 1e3:
        raise DataError(f"{trial.name}: the pressure is {trial.pressure:g} Pa; is it in MPa or bar? state the unit")


ONE_SPEED_ALONE = "one speed only: unbalance, bow and runout are the same in it, and so are delay and phase errors"
"""Note on records of one speed."""
ONE_EXCITATION = (
    "one excitation amplitude only: dry friction, dead zone, rub and other non-linear effects are "
    "indistinguishable from linear ones; record the same points with half the excitation"
)
"""Note on records that leave non-linear effects open."""

UNTESTED = (
    "no record was left untouched: nothing tests the verdict; record another operating point, and leave it "
    "untouched (--untouched, or its attribute role)"
)
"""Note on records of which each took part in the fit or in the choice."""


def limits(trials: Sequence[Trial], film: bool) -> list[str]:
    """Sentences on effects that this set of records cannot distinguish; none for tables of vectors alone."""
    swept = any(t.orders for t in trials)
    if all(t.orders for t in trials):
        return []
    notes = []
    speeds = {round(t.speed) for t in trials}
    points = {(round(t.speed), round(t.pressure, -4)) for t in trials}
    sizes = {round(t.amplitude, 3) for t in trials if t.amplitude > 0}
    if len(points) < FEWEST_POINTS and not swept:
        notes.append(
            f"operating points: {len(points)}; a smooth trend of the calibration is indistinguishable from a missing "
            f"effect whose force grows with speed or pressure; give at least {FEWEST_POINTS}"
        )
    if len(speeds) < 2 and not swept:
        notes.append(ONE_SPEED_ALONE)
    if len(sizes) < 2:
        notes.append(ONE_EXCITATION)
    if film and len({round(t.pressure, -4) for t in trials}) < 2:
        notes.append("one pressure only: supply droop, discharge and clearance are indistinguishable")
    return notes


def unexplained(comparison: TwinComparison, fitted: np.ndarray) -> float:
    """Fraction of the measured response to excitation not explained by a prediction (n,) [m]; 0 if unexcited.

    Orders of the shaft do not count: a missing force may well be larger than what the unbalance does.
    """
    layout = comparison.layout
    excited = np.isin(layout.group, [layout.groups.index(band) for band in EXCITED])
    y, f = comparison.measured[excited], fitted[excited]
    return float(np.linalg.norm(y - f)) / max(float(np.linalg.norm(y)), 1e-300)


def how_far_off(comparison: TwinComparison) -> str:
    """Text on frequencies and gains of the records against the machine file's; empty without excited lines."""
    found = [one for own in laid_over(comparison, comparison.predict(ParameterPoint())) for one in own]
    if not found:
        return ""
    shift, size = np.percentile(np.array(found), (25, 75), axis=0).T
    return f"frequencies {_off(*shift)}, gains {_off(*size)} of those in the file{_of_mass_or_stiffness(*shift)}"


def laid_over(comparison: TwinComparison, simulated: np.ndarray) -> list[list[tuple[float, float]]]:
    """Factors on frequency and size, channel by channel of every record with excited lines, the twin's loudest first.

    The magnitudes of the excited lines are laid over the twin's by a factor on the frequency, and one on the size.
    """
    found = list[list[tuple[float, float]]]()
    for i, trial in enumerate(comparison.trials):
        at = trial.excited[1:]
        if trial.orders or at.sum() < FEWEST_LINES:
            continue
        f, own = np.log(trial.frequencies[1:][at]), list[tuple[float, float, float]]()
        for y, s in zip(comparison.lines_of(i, comparison.measured), comparison.lines_of(i, simulated), strict=True):
            a, b = (np.log(np.maximum(np.abs(one[at]), 1e-12)) for one in (y, s))
            if np.ptp(a) and np.ptp(b):
                own.append((float(np.linalg.norm(s[at])), *_laid_over(f, a, b)))
        found += [[(shift, size) for _, shift, size in sorted(own, reverse=True)]] if own else []
    return found


def _of_mass_or_stiffness(low: float, high: float) -> str:
    """Text on the mass or the stiffness that moves all frequencies one way; empty where they do not go one way."""
    mean = float(np.sqrt(low * high))
    if not (high < 1 - CLEARLY_OFF or low > 1 + CLEARLY_OFF):
        return ""
    more = "more" if mean < 1 else "less"
    return (
        f"; all frequencies are {'lower' if mean < 1 else 'higher'}, as with a mass {mean**-2:.2g} times, or a "
        f"stiffness {mean**2:.2g} times, the file's, or {more} where only one of several is off: check masses, moduli, "
        "diameters and stiffnesses, and the units of each"
    )


def _laid_over(f: np.ndarray, a: np.ndarray, b: np.ndarray) -> tuple[float, float]:
    """Factors on frequency and size by which logarithms b (k,) over log frequencies f lie best over a (k,)."""
    best = min(SCALES, key=lambda scale: float(np.std(a - np.interp(f - np.log(scale), f, b))))
    return float(best), float(np.exp(np.median(a - np.interp(f - np.log(best), f, b))))


def _off(low: float, high: float) -> str:
    """Range of ratios as text."""
    return f"{100 * low:.0f} to {100 * high:.0f} %"


def check_after(comparison: TwinComparison, fitted: np.ndarray) -> list[str]:
    """Warnings for a poorly matching machine; raises DataError if the records cannot be this machine's."""
    share = unexplained(comparison, fitted)
    if share < UNLIKE:
        return []
    if share > FOREIGN:
        name, off = comparison.twin.machine.name, how_far_off(comparison)
        raise DataError(
            f"records: even re-calibrated, {name} leaves {100 * share:.0f} % of the response unexplained"
            f"{f' ({off})' if off else ''}; are they of this machine, at this speed and pressure? If so, calibrate its "
            "file first by 'rotorsim machine calibrate', with a file of the measured frequencies as its targets",
            argument="records",
            value=off,
        )
    return [
        f"re-calibrated, the machine file leaves {100 * share:.0f} % of the response unexplained: nothing is named; "
        "check that the records are of this machine"
    ]
