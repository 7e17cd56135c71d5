"""Identification against the linearised physics: local models of a campaign's records, surfaces, held-out points.

Local models are Models 3 and 2 of each operating point, validated on a second record. Surfaces through black-box models
in one coherent basis are compared with those of Model 3 at points held out: the fit takes those of the grid's first,
middle and last speed and pressure. The responses at all other points of the grid are those of Model 2 there, which
comes closest to the records.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

import identification as idn
from identification.campaign import identify_source
from identification.local.confidence import project
from identification.local.fits import actuator_signals
from identification.local.greybox import levy
from identification.records.frequency_response import FrequencyResponse
from rotorsim.analysis.supply import regulator_pressure
from rotorsim.base.errors import DataError
from rotorsim.base.processes import Each, processes
from rotorsim.base.units import TO_MPA, TO_RPM, TO_UM

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.plant.plant import Plant

MODELS = ("3", "2")
"""Models of every local point."""
RECIPE = idn.Prefilter(median=3)
"""The thesis' prefilter: a running median of three. Its Model 3 has no dead time."""
NEAR = (5.0, 1e4)
"""Tolerances [rad/s] and [Pa] within which two records are at the same operating point."""
Progress = Callable[[], None]
LINES = 60
"""Number of frequencies at which responses are compared."""
SWEEP = (4, 5, 6, 7, 8)
"""Orders of the black-box models that are compared."""
AHEAD = (4, 6, 8)
"""Orders of those that minimise the error of prediction too, as the thesis' ssest does unless set otherwise."""
Row = tuple[str, dict[str, np.ndarray]]
ROLES = ("identification", "validation", "centre", "extra", "extra_second")
HEADS = ("rpm", "MPa", "f1", "f1 phys", "f2", "f2 phys", "zeta1", "z1 phys", "zeta2", "z2 phys", "Gxx", "Gxx phys",
         "Gyy", "Gyy phys", "Gxy", "Gxy phys", "Gyx", "Gyx phys", "delay x", "film x", "delay y", "film y", "fit x",
         "fit y", "ceil x", "ceil y")  # fmt: skip
"""Heads of the table over the grid."""
GAINS = ((0, 0), (1, 1), (0, 1), (1, 0))
"""Entries of the static gain in the table, in the order of its columns."""


@dataclass(frozen=True, eq=False)
class Physics:
    """wn [rad/s], zeta, delay [s] (2,), static_gain (2, 2) [m/V], K, D, B (12,) that come closest to its response.

    The delay is the film's alone; an identified one contains the actuators. K, D, B are a least-squares fit to the
    response of the linearised plant between 0.1 and 1.8 times the first natural frequency, the film's delay given.
    """

    wn: np.ndarray
    zeta: np.ndarray
    static_gain: np.ndarray
    delay: np.ndarray
    KDB: np.ndarray


def physics(plant: Plant, speed: float, pressure: float) -> Physics:
    """The linearised plant at `speed` [rad/s] and gauge `pressure` [Pa] at the injectors, as a record has it."""
    found = plant.linearise(speed, regulator_pressure(plant.assembly, speed, pressure))
    peak = float(found.wn[0])
    omega = np.linspace(0.1 * peak, 1.8 * peak, 60)
    G = np.array([found.transfer(1j * w)[:, :2] for w in omega])
    ones = np.ones((len(omega), 2))
    response = FrequencyResponse(omega, G, ones, ones, 1)
    KDB = levy(response, peak, np.exp(-1j * omega * found.delay.mean()))
    return Physics(found.wn[:2], found.zeta[:2], found.static_gain, found.delay, KDB)


@dataclass(frozen=True, eq=False)
class LocalModels:
    """One operating point.

    found: Models '3' and '2'; validation: their fits (2,) on the second record, empty without one; ceiling (2,): noise
    ceiling of that record; runout: amplitudes (2,) [m, 0-pk] of what follows the shaft angle before the excitation
    begins, raw and filtered, None where the shaft does not turn.
    """

    source: idn.Source
    second: idn.Source
    found: dict[str, idn.Identification]
    validation: dict[str, np.ndarray]
    ceiling: np.ndarray
    runout: tuple[np.ndarray, np.ndarray] | None


def at_points(locals_: Sequence[LocalModels], wanted: Iterable[tuple[float, float]]) -> list[LocalModels]:
    """Local models at operating points [rad/s, Pa], in that order; a point without one is left out."""
    found = [[one for one in locals_ if _same(one.source, *q)] for q in wanted]
    return [some[0] for some in found if some]


def _same(source: idn.Source, speed: float, pressure: float) -> bool:
    return abs(source.speed - speed) < NEAR[0] and abs(source.pressure - pressure) < NEAR[1]


def second_of(source: idn.Source, others: Sequence[idn.Source]) -> idn.Source | None:
    """The other record at the same operating point."""
    near = [s for s in others if _same(s, source.speed, source.pressure)]
    return near[0] if near else None


def make_locals(
    sources: Sequence[idn.Source], others: Sequence[idn.Source], each: Each, progress: Progress
) -> tuple[list[LocalModels], list[str]]:
    """Local models of all records that could be identified, in their order, and a sentence for each that could not."""
    made: list[LocalModels | str] = []
    for one in each(_local_of, [(source, second_of(source, others)) for source in sources]):
        made.append(one)
        progress()
    return [m for m in made if isinstance(m, LocalModels)], [m for m in made if isinstance(m, str)]


def _local_of(pair: tuple[idn.Source, idn.Source | None]) -> LocalModels | str:
    try:
        return _local(*pair)
    except idn.SchemaError as error:
        return f"{pair[0].path}: {error}"


def _local(source: idn.Source, second: idn.Source | None) -> LocalModels:
    record, steady = idn.open_pair(source)
    found = {kind: idn.identify(record, kind, steady=steady, settings=RECIPE, dead_time=0.0) for kind in MODELS}
    runout = runout_amplitudes(record, steady)
    if second is None:
        return LocalModels(source, source, found, {}, found["3"].ceiling, runout)
    signals = idn.filtered(*idn.open_pair(second), RECIPE)
    fits = {kind: idn.fit_of(one.model, signals) for kind, one in found.items()}
    return LocalModels(source, second, found, fits, idn.ceiling(project(signals.y, signals.Q), signals.noise), runout)


def runout_amplitudes(record: xr.Dataset, steady: xr.Dataset | None) -> tuple[np.ndarray, np.ndarray] | None:
    """Amplitudes (2,) [m, 0-pk] raw and filtered, of the second half of the record's rest before the excitation.

    The filter comes from the steady run; None without one or where the shaft hardly turns.
    """
    if steady is None:
        return None
    signals, raw = idn.filtered(record, steady, RECIPE), np.asarray(record["disc_measured"].values)
    part = slice(signals.rest // 2, signals.rest)
    angle = np.asarray(record["angle_measured"].values)[part]
    if len(angle) < 200 or abs(angle[-1] - angle[0]) < 4 * np.pi:
        return None
    turn = np.linspace(0, 2 * np.pi, 361)
    before, after = (np.ptp(idn.estimate_runout(angle, y[part]).at(turn), axis=0) / 2 for y in (raw, signals.y))
    return before, after


@dataclass(frozen=True, eq=False)
class Coherent:
    """Relative distance (k,) of frequency responses at the other points: surfaces of Model 3, and of black-box models
    of order 6 in one coherent basis; number of those that are unstable there; number of points they were made from."""

    grey: np.ndarray
    black: np.ndarray
    unstable: int
    made_from: int


def coherent(points: Sequence[LocalModels], each: Each = map) -> Coherent | None:
    """The comparison; None where the grid has fewer than three lines each way or no point is left."""
    q = np.array([(p.source.speed, p.source.pressure) for p in points])
    lines = [np.unique(np.round(column, 3)) for column in q.T]
    few = [set(line[[0, len(line) // 2, -1]]) for line in lines]
    inside = [all(np.round(v, 3) in kept for v, kept in zip(at, few, strict=True)) for at in q]
    taken = [p for p, yes in zip(points, inside, strict=True) if yes]
    others = [p for p, yes in zip(points, inside, strict=True) if not yes]
    if min(map(len, lines)) < 3 or not others:
        return None
    black = [one.result for one in each(partial(identify_source, model="blackbox"), [p.source for p in taken])]
    if any(result is None for result in black):
        return None
    grey_lpv = idn.fit_lpv([p.found["3"] for p in taken], 2)
    black_lpv = idn.fit_lpv([result for result in black if result is not None], 2)
    made = [black_lpv.at(p.source.speed, p.source.pressure) for p in others]
    greys = [grey_lpv.at(p.source.speed, p.source.pressure) for p in others]
    return Coherent(_response_distances(greys, others), _response_distances(made, others),
                    sum(not model.stable for model in made), len(taken))  # fmt: skip


def _response_distances(models: Sequence[idn.LinearModel], points: Sequence[LocalModels]) -> np.ndarray:
    found = []
    for model, point in zip(models, points, strict=True):
        one = point.found["2"]
        omega = np.geomspace(0.05, 2.5, LINES) * one.wn.mean()
        wanted = one.model.transfer(omega)
        found.append(np.linalg.norm(model.transfer(omega) - wanted) / np.linalg.norm(wanted))
    return np.array(found)


@dataclass(frozen=True, eq=False)
class Study:
    """Data of the tables and figures.

    points: local models over the grid; physics: the linearised plant there; centres: local models between the grid's
    points; extra: those at further points that are not on the grid; lpv, refined: plain surfaces of Model 3 and
    those refined by frequency responses; lpv_2: surfaces of Model 2; distances: of the responses of surfaces from local
    ones; sweep: fits of second records by model at the compared points; actuators: the actuator models there and
    their fits (2,) of second records; coherent: surfaces of black-box models and those of Model 3.
    """

    points: list[LocalModels]
    physics: list[Physics]
    centres: list[LocalModels]
    extra: list[LocalModels]
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

    def at(self, wanted: Sequence[tuple[float, float]]) -> list[LocalModels]:
        """Local models at points [rad/s, Pa]; those without a record are left out."""
        return at_points([*self.points, *self.extra], wanted)

    @property
    def q(self) -> np.ndarray:
        """Operating points (k, 2) [rad/s, Pa] of the grid."""
        return np.array([(r.speed, r.pressure) for r in self.results])


def study(
    plant: Plant,
    sources: Sequence[idn.Source],
    workers: int = 1,
    order: int = 2,
    progress: Progress = lambda: None,
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
    few = [points[k] for k in sorted({0, len(points) // 2, len(points) - 1})]
    chosen = few if compared is None else at_points([*points, *extra], compared)
    sweep, actuators = compare_models(chosen, each)
    return Study(
        points, [physics(plant, r.speed, r.pressure) for r in results], centres, extra, lpv, refined,
        idn.fit_lpv([point.found["2"] for point in points], order), _distances(lpv, refined, results, held),
        sweep, actuators, coherent(points, each), [*failed, *lost, *missed],
    )  # fmt: skip


def compare_models(
    points: Sequence[LocalModels], each: Each
) -> tuple[list[Row], list[tuple[idn.Identification, np.ndarray]]]:
    """Fits (2,) of second records by model at each point, with the point's name; actuator models and their fits."""
    kinds = [("blackbox", n, "pem") for n in reversed(AHEAD)] + [("blackbox", n, "auto") for n in reversed(SWEEP)]
    kinds += [("1", 0, "auto"), ("actuator", 0, "auto")]  # what takes longest first
    jobs = [(k, *kind) for kind in kinds for k in range(len(points))]
    made = each(_identified, [(points[k].source, *kind) for k, *kind in jobs])
    found = dict(zip(jobs, made, strict=True))
    rows, actuators = [], []
    for k, point in enumerate(points):
        models = {f"order {n}": found[k, "blackbox", n, "auto"] for n in SWEEP}
        models |= {f"order {n} by prediction": found[k, "blackbox", n, "pem"] for n in AHEAD}
        models |= {"Model 1": found[k, "1", 0, "auto"]}
        models |= {f"Model {kind}": point.found[kind] for kind in ("2", "3")}
        signals = idn.filtered(*idn.open_pair(point.second), RECIPE)
        rows.append(_compared(point, models, signals))
        one = found[k, "actuator", 0, "auto"]
        actuators.append((one, idn.fit_of(one.model, actuator_signals(signals))))
    return rows, actuators


def _identified(job: tuple[idn.Source, str, int, str]) -> idn.Identification:
    source, kind, order, method = job
    record, steady = idn.open_pair(source)
    return idn.identify(record, kind, order, method, steady=steady, settings=RECIPE)


def _compared(point: LocalModels, models: Mapping[str, idn.Identification], signals: idn.Signals) -> Row:
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


def rows(study: Study, kind: str = "3") -> list[list[float]]:
    """Numbers under HEADS of a model over the grid: Hz, um/V, ms, per cent."""
    found = []
    for point, p in zip(study.points, study.physics, strict=True):
        r = point.found[kind]
        row = [r.speed * TO_RPM, r.pressure * TO_MPA]
        row += [v / (2 * np.pi) for pair in zip(r.wn, p.wn, strict=True) for v in pair]
        row += [v for pair in zip(r.zeta, p.zeta, strict=True) for v in pair]
        row += [v * TO_UM for at in GAINS for v in (r.static_gain[at], p.static_gain[at])]
        row += [v * 1e3 for pair in zip(r.delay, p.delay, strict=True) for v in pair]
        found.append([float(v) for v in [*row, *(100 * r.fit), *(100 * r.ceiling)]])
    return found


def errors(study: Study, kind: str) -> dict[str, np.ndarray]:
    """Relative errors (k, 2) of a model against the physics: wn, zeta, gain (the direct ones)."""
    found = [point.found[kind] for point in study.points]
    out = {key: np.array([getattr(r, key) / getattr(p, key) - 1 for r, p in zip(found, study.physics, strict=True)])
           for key in ("wn", "zeta")}  # fmt: skip
    gains = [np.diag(r.static_gain) / np.diag(p.static_gain) - 1 for r, p in zip(found, study.physics, strict=True)]
    return {**out, "gain": np.array(gains)}


def summary(study: Study) -> dict[str, dict[str, float]]:
    """Largest and mean errors [%] of Models 2 and 3 against the physics."""
    names = {"wn": "frequency", "zeta": "zeta", "gain": "direct gain"}
    return {
        f"Model {kind}": {
            f"{name}, {word}": float(100 * value)
            for key, name in names.items()
            for word, value in (("largest", np.abs(found[key]).max()), ("mean", found[key].mean()))
        }
        for kind in ("2", "3")
        for found in [errors(study, kind)]
    }
