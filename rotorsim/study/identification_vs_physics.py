"""Identification study: campaign, identification from its records, comparison with the linearised physics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

import identification as idn
from identification.local.fits import actuator_signals
from rotorsim.base.constants import TO_MPA, TO_RPM
from rotorsim.base.errors import DataError
from rotorsim.study.coherent import Coherent, coherent
from rotorsim.study.local_models import RECIPE, Local, Progress, at_points, make_locals
from rotorsim.study.physics import Physics, physics
from rotorsim.study.pool import Each, processes

if TYPE_CHECKING:
    from rotorsim.plant.plant import Plant

SWEEP = (4, 5, 6, 7, 8)
Row = tuple[str, dict[str, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Study:
    """Data of the tables and figures.

    points: local models over the grid; physics: the linearised plant there; centres: local models between the grid's
    points; extra: those at further points that are not on the grid; lpv, refined: plain surfaces of Model 3 and
    those refined by frequency responses; lpv_2: surfaces of Model 2; distances: of the responses of surfaces from local
    ones; sweep: fits of second records by model at the compared points; actuators: the actuator models there and
    their fits (2,) of second records; coherent: surfaces of black-box models and those of Model 3.
    """

    points: list[Local]
    physics: list[Physics]
    centres: list[Local]
    extra: list[Local]
    lpv: idn.LpvModel
    refined: idn.LpvModel
    lpv_2: idn.LpvModel
    distances: dict[str, np.ndarray]
    sweep: list[Row]
    actuators: list[tuple[idn.Identification, np.ndarray]]
    coherent: Coherent | None
    failed: list[str]

    @property
    def results(self) -> list[idn.Identification]:
        """Models 3 over the grid."""
        return self.models("3")

    def models(self, kind: str) -> list[idn.Identification]:
        """Models '2' or '3' over the grid."""
        return [point.found[kind] for point in self.points]

    def at(self, wanted: Sequence[tuple[float, float]]) -> list[Local]:
        """Local models at points [rad/s, Pa]; those without a record are left out."""
        return at_points([*self.points, *self.extra], wanted)

    @property
    def q(self) -> np.ndarray:
        """Operating points (k, 2) [rad/s, Pa] of the grid."""
        return np.array([(r.speed, r.pressure) for r in self.results])


def _no_progress() -> None:
    pass


ROLES = ("identification", "validation", "centre", "extra", "extra_second")


def study(
    plant: Plant,
    sources: Sequence[idn.Source],
    workers: int = 1,
    order: int = 2,
    progress: Progress = _no_progress,
    compared: Sequence[tuple[float, float]] | None = None,
) -> Study:
    """The study of records with the roles ROLES: of the grid, between its points, and at extra points.

    Parameters
    ----------
    plant : Plant
        Of the same machine; only for the comparison.
    sources : sequence of Source
    workers : processes; a script that asks for more than one runs under if __name__ == '__main__'
    order : degree of the surfaces
    progress : called after each record of the grid
    compared : points [rad/s, Pa] at which models of all orders are compared; by default the first, the middle and the
        last of the grid

    Raises
    ------
    DataError
        If records are missing.
    UnfitError
        If the points are too few for the surfaces.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.study.study(plant, rs.study.sources_of(["study"]))  # doctest: +SKIP
    """
    by_role = {role: [s for s in sources if s.role == role] for role in ROLES}
    if not by_role["identification"]:
        raise DataError("study: no record with the role 'identification'; let the study make its own campaign")
    with processes(workers) as each:
        return _study(plant, by_role, each, order, progress, compared)


def _study(
    plant: Plant, by_role: Mapping[str, list[idn.Source]], each: Each, order: int, progress: Progress,
    compared: Sequence[tuple[float, float]] | None,
) -> Study:  # fmt: skip
    points, failed = make_locals(by_role["identification"], by_role["validation"], each, progress)
    if not points:
        raise DataError(failed[0])
    centres, lost = make_locals(by_role["centre"], (), each, progress)
    extra, missed = make_locals(by_role["extra"], by_role["extra_second"], each, progress)
    results, held = ([point.found["3"] for point in some] for some in (points, centres))
    lpv, refined = (idn.fit_lpv(results, order, held, refine=name) for name in ("none", "frequency"))
    chosen = _some(points) if compared is None else at_points([*points, *extra], compared)
    sweep, actuators = compare_models(chosen, each)
    return Study(
        points, [physics(plant, r.speed, r.pressure) for r in results], centres, extra, lpv, refined,
        idn.fit_lpv([point.found["2"] for point in points], order), _distances(lpv, refined, results, held),
        sweep, actuators, coherent(points, each), [*failed, *lost, *missed],
    )  # fmt: skip


def _some(points: Sequence[Local]) -> list[Local]:
    """The first, the middle and the last point."""
    return [points[k] for k in sorted({0, len(points) // 2, len(points) - 1})]


def compare_models(
    points: Sequence[Local], each: Each
) -> tuple[list[Row], list[tuple[idn.Identification, np.ndarray]]]:
    """Fits (2,) of second records by model at each point, with the point's name; actuator models and their fits."""
    kinds = [("blackbox", n) for n in reversed(SWEEP)] + [("1", 0), ("actuator", 0)]  # what takes longest first
    jobs = [(k, *kind) for kind in kinds for k in range(len(points))]
    made = each(_identified, [(points[k].source, kind, n) for k, kind, n in jobs])
    found = dict(zip(jobs, made, strict=True))
    rows, actuators = [], []
    for k, point in enumerate(points):
        models = {f"order {n}": found[k, "blackbox", n] for n in SWEEP} | {"Model 1": found[k, "1", 0]}
        models |= {f"Model {kind}": point.found[kind] for kind in ("2", "3")}
        signals = idn.filtered(*idn.open_pair(point.second), RECIPE)
        rows.append(_compared(point, models, signals))
        one = found[k, "actuator", 0]
        actuators.append((one, idn.fit_of(one.model, actuator_signals(signals))))
    return rows, actuators


def _identified(job: tuple[idn.Source, str, int]) -> idn.Identification:
    source, kind, order = job
    record, steady = idn.open_pair(source)
    return idn.identify(record, kind, order, steady=steady, settings=RECIPE)


def _compared(point: Local, models: Mapping[str, idn.Identification], signals: idn.Signals) -> Row:
    """Fits of models on the second record of a point."""
    fits = {name: idn.fit_of(one.model, signals) for name, one in models.items()}
    at = f"{point.source.speed * TO_RPM:.0f} rpm, {point.source.pressure * TO_MPA:.2f} MPa"
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
