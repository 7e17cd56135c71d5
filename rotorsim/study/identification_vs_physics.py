"""Campaign, identification from its records alone, and both against the linearised physics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

import identification as idn
from identification.campaign import identify_source
from rotorsim.errors import DataError
from rotorsim.study.coherent import Coherent, coherent
from rotorsim.study.locals import Local, Told, make_locals
from rotorsim.study.physics import Physics, physics
from rotorsim.study.pool import Each, processes

if TYPE_CHECKING:
    from rotorsim.plant.plant import Plant

SWEEP = (4, 5, 6, 7, 8)
Row = tuple[str, dict[str, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Study:
    """What the claims, tables and figures are made of.

    points: local models over the grid; physics: what the linearised plant says there; centres: Models 3 between the
    grid's points; lpv, refined: plain surfaces of Model 3 and those refined by frequency responses; lpv_2: surfaces of
    Model 2; distances: of the responses of surfaces from local ones; sweep: validation fits by model at a few points;
    actuators: the actuator models there; coherent: surfaces of black-box models beside those of Model 3.
    """

    points: list[Local]
    physics: list[Physics]
    centres: list[idn.Identification]
    lpv: idn.LpvModel
    refined: idn.LpvModel
    lpv_2: idn.LpvModel
    distances: dict[str, np.ndarray]
    sweep: list[Row]
    actuators: list[idn.Identification]
    coherent: Coherent | None
    failed: list[str]

    @property
    def results(self) -> list[idn.Identification]:
        """Models 3 over the grid."""
        return [point.found["3"] for point in self.points]

    @property
    def q(self) -> np.ndarray:
        """Operating points (k, 2) [rad/s, Pa] of the grid."""
        return np.array([(r.speed, r.pressure) for r in self.results])


def _silent() -> None:
    pass


def study(
    plant: Plant, sources: Sequence[idn.Source], workers: int = 1, sweeps: int = 3, order: int = 2, told: Told = _silent
) -> Study:
    """The study of records with the roles identification, validation and centre.

    Parameters
    ----------
    plant : Plant
        Of the same machine; only for the comparison.
    sources : sequence of Source
    workers : processes; a script that asks for more than one runs under if __name__ == '__main__'
    sweeps : number of points, 1 to 3, at which all models and orders are compared
    order : degree of the surfaces
    told : called after each record of the grid

    Raises
    ------
    DataError
        If records are missing.
    UnfitError
        If the points are too few for the surfaces.
    """
    by_role = {role: [s for s in sources if s.role == role] for role in ("identification", "validation", "centre")}
    if not by_role["identification"]:
        raise DataError("study: no record with the role 'identification'; let the study make its own campaign")
    with processes(workers) as each:
        return _study(plant, by_role, each, sweeps, order, told)


def _study(
    plant: Plant, by_role: Mapping[str, list[idn.Source]], each: Each, sweeps: int, order: int, told: Told
) -> Study:
    points, failed = make_locals(by_role["identification"], by_role["validation"], each, told)
    if not points:
        raise DataError(failed[0])
    results = [point.found["3"] for point in points]
    centres = [one.result for one in each(identify_source, by_role["centre"]) if one.result is not None]
    lpv, refined = (idn.fit_lpv(results, order, centres, refine=name) for name in ("none", "frequency"))
    sweep, actuators = compare_models(spread(points, sweeps), each)
    return Study(
        points, [physics(plant, r.speed, r.pressure) for r in results], centres, lpv, refined,
        idn.fit_lpv([point.found["2"] for point in points], order), _distances(lpv, refined, results, centres),
        sweep, actuators, coherent(points, each), failed,
    )  # fmt: skip


def spread(points: Sequence[Local], count: int) -> list[Local]:
    """The first point, the middle one and the one where Model 3 fits worst; as many of them as asked for."""
    worst = int(np.argmin([point.found["3"].fit.mean() for point in points]))
    return [points[i] for i in dict.fromkeys([0, len(points) // 2, worst][:count])]


def compare_models(points: Sequence[Local], each: Each) -> tuple[list[Row], list[idn.Identification]]:
    """Validation fits (2,) of every model at each point, with the point's name; actuator models of the points."""
    kinds = [("blackbox", n) for n in reversed(SWEEP)] + [("1", 0), ("actuator", 0)]  # what takes longest first
    jobs = [(k, *kind) for kind in kinds for k in range(len(points))]
    made = each(_identified, [(points[k].source, kind, n) for k, kind, n in jobs])
    found = dict(zip(jobs, made, strict=True))
    rows = []
    for k, point in enumerate(points):
        models = {f"order {n}": found[k, "blackbox", n] for n in SWEEP} | {"Model 1": found[k, "1", 0]}
        models |= {f"Model {kind}": point.found[kind] for kind in ("2", "3")}
        rows.append(_compared(point, models))
    return rows, [found[k, "actuator", 0] for k in range(len(points))]


def _identified(job: tuple[idn.Source, str, int]) -> idn.Identification:
    source, kind, order = job
    record, steady = idn.open_pair(source)
    return idn.identify(record, kind, order, steady=steady)


def _compared(point: Local, models: Mapping[str, idn.Identification]) -> Row:
    """Fits of models on the second record of a point."""
    signals = idn.filtered(*idn.open_pair(point.second))
    fits = {name: idn.fit_of(one.model, signals) for name, one in models.items()}
    at = f"{point.source.speed * 30 / np.pi:.0f} rpm, {point.source.pressure * 1e-6:.2f} MPa"
    return at, {**fits, "noise ceiling": point.ceiling}


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
