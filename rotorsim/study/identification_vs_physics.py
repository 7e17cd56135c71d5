"""Campaign, identification from its records alone, and both against the linearised physics."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import identification as idn
from identification.campaign import Local, identify_all
from rotorsim.errors import DataError
from rotorsim.study.physics import Physics, physics

if TYPE_CHECKING:
    from rotorsim.plant.plant import Plant

SWEEP = (4, 5, 6, 7, 8)


@dataclass(frozen=True, eq=False)
class Study:
    """What the claims, tables and figures are made of.

    results: local models at the grid; validation: fit (2,) and ceiling (2,) of each on its second record, None where
    there is none; physics at the same points; centres: local models between the grid's points and the physics there;
    lpv, refined: plain surfaces and those refined by frequency responses; sweep: validation fits by model at a few
    points; actuators: the actuator models; runout: amplitude [m] before and after the filter at the fastest points.
    """

    results: list[idn.Identification]
    validation: list[tuple[np.ndarray, np.ndarray] | None]
    physics: list[Physics]
    centres: list[idn.Identification]
    lpv: idn.LpvModel
    refined: idn.LpvModel
    distances: dict[str, np.ndarray]
    sweep: list[tuple[str, dict[str, np.ndarray]]]
    actuators: list[idn.Identification]
    runout: list[tuple[float, np.ndarray, np.ndarray]]
    failed: list[str]

    @property
    def points(self) -> np.ndarray:
        """Operating points (k, 2) [rad/s, Pa] of `results`."""
        return np.array([(r.speed, r.pressure) for r in self.results])


def study(plant: Plant, folder: Path, workers: int = 2, sweeps: int = 3) -> Study:
    """The study of a folder of records that `make_records` filled; raises DataError if records are missing."""
    sources = idn.survey(idn.files_of([folder]))
    by_role = {role: [s for s in sources if s.role == role] for role in ("identification", "validation", "centre")}
    if not by_role["identification"]:
        raise DataError(f"{folder}: no record with the role 'identification'; let the study make its campaign")
    found = identify_all(by_role["identification"], 3, workers=workers)
    good = [one for one in found if one.result is not None]
    results = [one.result for one in good if one.result is not None]
    centres = [one.result for one in identify_all(by_role["centre"], 3, workers=workers) if one.result is not None]
    lpv = idn.fit_lpv(results, 2, centres)
    refined = idn.fit_lpv(results, 2, centres, refine="frequency")
    chosen = [good[i] for i in np.unique(np.linspace(0, len(good) - 1, min(sweeps, len(good))).astype(int))]
    return Study(
        results, [_validated(one, by_role["validation"]) for one in good],
        [physics(plant, r.speed, r.pressure) for r in results], centres, lpv, refined,
        _distances(lpv, refined, results, centres), [_sweep(one, by_role["validation"]) for one in chosen],
        [r for one in chosen if (r := identify_all([one.source], "actuator")[0].result) is not None],
        _runout(good), [one.error for one in found if one.error],
    )  # fmt: skip


def _second(one: Local, others: list[idn.Source]) -> idn.Source | None:
    near = [s for s in others if abs(s.speed - one.source.speed) < 5 and abs(s.pressure - one.source.pressure) < 1e4]
    return near[0] if near else None


def _validated(one: Local, others: list[idn.Source]) -> tuple[np.ndarray, np.ndarray] | None:
    second = _second(one, others)
    if second is None or one.result is None:
        return None
    signals = idn.filtered(*idn.open_pair(second))
    from identification.goodness import project

    return idn.fit_of(one.result.model, signals), idn.ceiling(project(signals.y, signals.Q), signals.noise)


def _sweep(one: Local, others: list[idn.Source]) -> tuple[str, dict[str, np.ndarray]]:
    """Validation fit (2,) of every model on one record and its second."""
    second = _second(one, others) or one.source
    signals, fits = idn.filtered(*idn.open_pair(second)), {}
    record, steady = idn.open_pair(one.source)
    cases = [(f"order {n}", "blackbox", n) for n in SWEEP] + [(f"Model {m}", m, 6) for m in ("1", "2", "3")]
    for label, kind, order in cases:
        found = idn.identify(record, kind, order, steady=steady)
        fits[label] = idn.fit_of(found.model, signals)
    return f"{one.source.speed * 30 / np.pi:.0f} rpm, {one.source.pressure * 1e-6:.2f} MPa", fits


def _distances(
    lpv: idn.LpvModel, refined: idn.LpvModel, results: list[idn.Identification], centres: list[idn.Identification]
) -> dict[str, np.ndarray]:
    """Relative distance of frequency responses of surfaces to local models, at the grid and in between."""
    found: dict[str, np.ndarray] = {}
    for where, locals_ in (("grid", results), ("between", centres)):
        if locals_:
            at, values = np.array([(r.speed, r.pressure) for r in locals_]), np.array([r.theta for r in locals_])
            found |= {f"plain, {where}": idn.distance(lpv, at, values)}
            found |= {f"refined, {where}": idn.distance(refined, at, values)}
    return found


def _runout(good: list[Local]) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Speed [rad/s] and amplitude (2,) [m] of what follows the shaft angle, before and after the filter.

    The filter comes from the steady run and acts on the other record's rest before the excitation, second half.
    """
    found = []
    for one in good:
        record, steady = idn.open_pair(one.source)
        if steady is None or one.source.pressure > 0.31e6:
            continue
        signals, raw = idn.filtered(record, steady), np.asarray(record["disc_measured"].values)
        part = slice(signals.rest // 2, signals.rest)
        angle = np.asarray(record["angle_measured"].values)[part]
        if len(angle) < 200:
            continue
        sizes = [np.ptp(idn.estimate_runout(angle, y[part]).at(np.linspace(0, 2 * np.pi, 361)), axis=0) / 2
                 for y in (raw, signals.y)]  # fmt: skip
        found.append((one.source.speed, sizes[0], sizes[1]))
    return found
