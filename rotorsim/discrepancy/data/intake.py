"""Loading of measured records for a diagnosis, checks of their units, and limits of the data set."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification import notes_of, read
from identification.errors import ReadError, SchemaError
from rotorsim.base.constants import RIG_SAMPLE, TO_RPM
from rotorsim.base.errors import DataError
from rotorsim.base.sentences import listing
from rotorsim.discrepancy.data.changes import known_changes
from rotorsim.discrepancy.data.sensors import check_ring, check_sensors
from rotorsim.discrepancy.data.spectra import Trial, make_trial
from rotorsim.machine import Machine
from rotorsim.machine.numerics import FEWEST

if TYPE_CHECKING:
    import xarray as xr

FEWEST_POINTS = 4
Source = Any
"""A Dataset, or the path of a file of it."""


def open_records(sources: Iterable[Source], mapping: Any = None) -> list[tuple[str, xr.Dataset]]:
    """Names and Datasets of records; a folder gives its .nc files, sorted by name."""
    out: list[tuple[str, xr.Dataset]] = []
    for i, source in enumerate(sources):
        if not isinstance(source, (str, Path)):
            out.append((str(source.attrs.get("record", f"record {i + 1}")), source))
            continue
        path = Path(source)
        files = sorted(path.rglob("*.nc")) if path.is_dir() else [path]
        if not files:
            raise DataError(f"{path}: no .nc record in it; give a folder of records or name the files")
        for file in files:
            try:
                out.append((file.stem, read(file, mapping)))
            except (ReadError, SchemaError) as error:
                raise DataError(str(error)) from error
    return out


def record_notes(opened: Sequence[tuple[str, xr.Dataset]]) -> list[str]:
    """What reading left out of records or changed in them, a sentence for all records of which it is the same."""
    of: dict[str, list[str]] = {}
    for name, record in opened:
        for text in notes_of(record):
            of.setdefault(text, []).append(name)
    return [
        f"{listing(names, 3) if len(names) < len(opened) else 'every record'}: {text}" for text, names in of.items()
    ]


def make_trials(machine: Machine, records: Sequence[tuple[str, xr.Dataset]], role: str | None) -> list[Trial]:
    """Trials sorted by operating point, so that the order of the records has no effect."""
    trials = []
    for name, record in records:
        own = role or str(record.attrs.get("role", "fit"))
        check_sensors(machine, record, name)
        changes = known_changes(machine, record.attrs.get("changes"), name)
        trials.append(replace(make_trial(record, own, name), changes=changes))
        check_ring(machine, trials[-1])
        check_units(machine, trials[-1])
        check_turns(trials[-1])
    return sorted(trials, key=lambda t: (t.role, round(t.speed, 2), round(t.pressure, -2), t.amplitude, _digest(t)))


def _digest(trial: Trial) -> str:
    return hashlib.sha256(np.ascontiguousarray(trial.spectra).tobytes()).hexdigest()


def data_hash(trials: Iterable[Trial]) -> str:
    """Short hash of all measured data, independent of their order."""
    return hashlib.sha256("".join(sorted(map(_digest, trials))).encode()).hexdigest()[:16]


def check_turns(trial: Trial) -> None:
    """Raise DataError for a shaft that turns too fast for the rate at which records are compared."""
    samples = 2 * np.pi / max(abs(trial.speed) * RIG_SAMPLE, 1e-300)
    if samples < FEWEST:
        raise DataError(
            f"{trial.name}: at {abs(trial.speed) * TO_RPM:.6g} rpm a turn has {samples:.2g} samples at the 5 kHz of a "
            f"diagnosis and needs {FEWEST}; give records of slower turns"
        )


def check_units(machine: Machine, trial: Trial) -> None:
    """Raise DataError for a pressure in other units or a displacement larger than any clearance."""
    if machine.film is None:
        return
    if trial.pressure != 0 and abs(trial.pressure) < 1e3:
        raise DataError(f"{trial.name}: the pressure is {trial.pressure:g} Pa; is it in MPa or bar? state the unit")


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
            f"{len(points)} operating points: a smooth trend of the calibration is indistinguishable from a missing "
            f"effect whose force grows with speed or pressure; give at least {FEWEST_POINTS}"
        )
    if len(speeds) < 2 and not swept:
        notes.append("one speed only: unbalance, bow and runout are the same in it, and so are delay and phase errors")
    if len(sizes) < 2:
        notes.append(
            "one excitation amplitude only: hysteresis, dead zone, rub and other non-linear effects are "
            "indistinguishable from linear ones"
        )
    if film and len({round(t.pressure, -4) for t in trials}) < 2:
        notes.append("one pressure only: supply droop, discharge and clearance are indistinguishable")
    return notes
