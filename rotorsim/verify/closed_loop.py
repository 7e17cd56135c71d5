"""`closed_loop`: verification of a law on a nonlinear plant and on perturbed plants."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from rotorsim.base.constants import KRPM, TO_UM
from rotorsim.base.display import Reported
from rotorsim.base.errors import RotorsimError
from rotorsim.control.designs.plants import point_text
from rotorsim.control.errors import LawError
from rotorsim.control.law import Law
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from rotorsim.verify import alarms, transients
from rotorsim.verify.alarms import Alarms
from rotorsim.verify.criteria import Criteria, Row, at_least, at_most, below, holds
from rotorsim.verify.full_order import full_order
from rotorsim.verify.impacts import POINTS, ImpactResponse, impact_responses
from rotorsim.verify.other import AnyLaw, as_law
from rotorsim.verify.running import Run

SHIPPED = ("dtu_gas_bearing", "dtu_gas_bearing_b", "dtu_gas_bearing_c")
"""Calibrations A, B, C."""
CORNERS = ((0.0, 0.3e6), (0.0, 0.7e6), (6 * KRPM, 0.3e6), (6 * KRPM, 0.7e6), (3 * KRPM, 0.5e6))
Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Verification(Reported):
    """Rows of a verification, the impact responses behind them, and the law's alarms in each run that had any."""

    law: AnyLaw
    machine: str
    rows: tuple[Row, ...]
    open: tuple[ImpactResponse, ...]
    closed: tuple[ImpactResponse, ...]
    settings: dict[str, Any] = field(default_factory=dict)
    runs: dict[str, Any] = field(default_factory=dict)
    alarms: tuple[Alarms, ...] = ()

    @property
    def remark(self) -> str:
        """A sentence if the law was designed on a model of another machine; else empty."""
        return self.law.other_machine(self.machine) if isinstance(self.law, Law) else ""

    @property
    def passed(self) -> bool:
        """Whether every judged row passed."""
        return all(row.passed is not False for row in self.rows)

    @property
    def table(self) -> list[dict[str, Any]]:
        """The rows as plain values."""
        return [asdict(row) for row in self.rows]

    @property
    def ratios(self) -> np.ndarray:
        """Closed over open norm of the impact response (points, 2)."""
        return np.array([np.divide(c.response, o.response) for c, o in zip(self.closed, self.open, strict=True)])


def closed_loop(
    law: AnyLaw | Any, plant: Plant, criteria: Criteria | None = None, quick: bool = False,
    progress: Progress | None = None,
    open_loop: tuple[ImpactResponse, ...] | None = None, closed: tuple[ImpactResponse, ...] | None = None,
) -> Verification:  # fmt: skip
    """Verify a law on a plant.

    Parameters
    ----------
    law : Law or controller
        As it is to run, with the way it finds its centre (`average` or `centre`). A linear system of the package
        `control` becomes a law; another of its systems, a function or an object with a `step` runs in Python, without
        the rows that need matrices.
    plant : Plant
        With a gas film and actuators.
    criteria : Criteria, optional
        What it must reach.
    quick : bool
        Five impact points in place of twenty, no other machines, a quicker run-up.
    progress : callable, optional
        Called with the name of each step before it starts.
    open_loop, closed : impact responses, optional
        Of the plant without and with the law at the same points, if they are known.

    Raises
    ------
    LawError, DataError
        If law and plant do not go together.

    Examples
    --------
    >>> import rotorsim as rs
    >>> result = rs.verify.closed_loop(rs.load_law("law.json"), plant)
    >>> result.passed
    True
    """
    criteria, law = criteria or Criteria(), as_law(law)
    if isinstance(law, Law):
        law.check_sampling(plant.machine.sampling_time)
        law.check_machine(plant.machine.name)
    if plant.assembly.film_model is None or plant.machine.actuators is None:
        raise LawError(f"{plant.machine.name}: has no actuators that a law could drive; verify on a gas bearing")
    report = progress or (lambda _: None)
    points = CORNERS if quick else POINTS
    report("impacts, open loop")
    before = open_loop or tuple(impact_responses(plant, None, *q) for q in points)
    report("impacts, closed loop")
    after = closed or tuple(impact_responses(plant, law, *q) for q in points)
    runs: dict[str, Any] = {}
    found = [*alarms.of_hits(after)]
    rows = [*_impact_rows(before, after, criteria)]
    report("noise")
    rest = transients.at_rest(plant, law)
    found.append(alarms.of_run("rest", rest))
    rows.append(at_most("noise in the reference at rest", transients.noise(rest).max(), criteria.noise, "V"))
    report("run-up and coast-down")
    rows += _runup_rows(plant, law, criteria, runs, quick)
    found.append(alarms.of_run("run-up and coast-down", runs["runup"][1]))
    report("ramps, steps, saturation, sensor faults")
    rows += _transient_rows(plant, law, criteria, found)
    if not quick:
        if isinstance(law, Law):
            report("full-order loops")
            rows += _full_order_rows(plant, law, criteria)
        for name, other in other_machines(plant):
            report(f"robustness: {name}")
            rows.append(_robustness(name, other, law, criteria, found))
    rows.append(alarms.row(found, criteria))
    had = tuple(one for one in found if one.bad)
    return Verification(law, plant.machine.name, tuple(rows), before, after, {"criteria": asdict(criteria)}, runs, had)


def _impact_rows(
    before: tuple[ImpactResponse, ...], after: tuple[ImpactResponse, ...], criteria: Criteria
) -> Iterator[Row]:
    ratio = response_ratios(zip(before, after, strict=True))
    ended = [c.ended or (o.ended and f"without control {o.ended}") for c, o in zip(after, before, strict=True)]
    for axis, name in enumerate("xy"):
        yield below(f"impact response along {name}, mean", ratio[:, axis].mean(), criteria.mean)
    kept = [c for o, c in zip(before, after, strict=True) if c.ended or not o.ended]
    worst = kept[int(ratio.max(axis=1).argmax())] if kept else after[0]
    where = worst.ended or point_text(worst.speed, worst.pressure)
    yield below("impact response, worst point", ratio.max(), criteria.worst, where)
    effort = np.array([c.effort for c in after])
    yield at_most("control effort, mean", effort.mean(), None, "V/N")
    yield at_most("largest reference in a hit", max(c.largest for c in after), criteria.effort, "V")
    free, held = (min((one.damping for one in some if not one.ended), default=np.nan) for some in (before, after))
    yield Row("smallest damping ratio, closed", held, None, "", None, f"{np.divide(held, free):.1f} x open loop")
    yield holds(
        "no contact in the hits", not any(c.touched for c in after), "; ".join(dict.fromkeys(filter(None, ended)))
    )


def _runup_rows(plant: Plant, law: AnyLaw, criteria: Criteria, runs: dict[str, Any], quick: bool) -> Iterator[Row]:
    stop, rate = 6 * KRPM, (1.5 if quick else 0.5) * KRPM
    pair = [transients.runup(plant, one, rate, 0.7e6, stop) for one in (None, law)]
    runs["runup"] = pair
    half = len(pair[0].table) // 2
    first, last = half - pair[0].count(0.35), half
    if any(run.ended for run in pair):
        yield holds("run-up and coast-down", False, pair[1].ended or pair[0].ended)
        return
    ratio = transients.amplitude(pair[1], first, last) / transients.amplitude(pair[0], first, last)
    yield below("imbalance amplitude at 6 krpm, 0.7 MPa", ratio, criteria.amplitude)
    yield holds("run-up and coast-down without contact", not pair[1].touched)


def _full_order_rows(plant: Plant, law: Law, criteria: Criteria) -> Iterator[Row]:
    found = full_order(plant, law, CORNERS)
    worst = max(found, key=lambda one: one.radius)
    unstable = sum(not one.radius < 1 for one in found)
    remark = f"{unstable} of {len(found)} points unstable; largest pole radius {worst.radius:.4f}"
    yield holds(f"full-order loops of {worst.states} states stable", not unstable, remark)
    weak = min(found, key=lambda one: one.disk_margin)
    where = point_text(weak.speed, weak.pressure)
    remark = f"at {where}: gain x{weak.gain_margin:.2f}, phase {weak.phase_margin:.0f} deg; at least"
    yield at_least("disk margin of the full-order loop", weak.disk_margin, criteria.disk, "", remark)
    damped = min(found, key=lambda one: one.damping)
    remark = f"open loop {min(one.damping_open for one in found):.3f}"
    yield Row("smallest damping of the full-order loop", damped.damping, None, "", None, remark)


def _transient_rows(plant: Plant, law: AnyLaw, criteria: Criteria, found: list[Alarms]) -> Iterator[Row]:
    cases = {
        "speed ramp of 60 krpm/s": lambda one: transients.speed_ramp(plant, one, 60 * KRPM),
        "pressure step 0.3 to 0.7 MPa": lambda one: transients.pressure_step(plant, one),
        "pressure ramp 0.7 to 0.3 MPa": lambda one: transients.pressure_ramp(plant, one),
        "hit of 100 N (saturation)": lambda one: transients.overload(plant, one, 100.0),
        "sensor x hangs": lambda one: transients.frozen_sensor(plant, one, 0),
        "sensor y hangs": lambda one: transients.frozen_sensor(plant, one, 1),
    }
    for name, case in cases.items():
        run = case(law)
        found.append(alarms.of_run(name, run, sound="hangs" not in name))
        yield _transient_row(name, run, case(None), law.limit, criteria.transient)


def _transient_row(name: str, run: Run, alone: Run, limit: float, most: float | None) -> Row:
    """Departure of the disc under a law; the run without it moves the bound where it came to its end."""
    moved, free = transients.excursion(run), transients.excursion(alone)
    bound = None if most is None else TO_UM * max(most, 0.0 if alone.ended else 1.2 * free)
    if run.ended:
        return Row(name, moved, bound, "um", False, run.ended)
    saturated = 100 * float(np.mean(np.abs(run.reference).max(axis=1) >= limit))
    remark = f"open loop {alone.ended or f'{TO_UM * free:.1f} um'}; limited in {saturated:.1f} % of the samples"
    row = at_most(name, moved * TO_UM, bound, "um", remark)
    return replace(row, passed=False, remark=f"contact; {remark}") if run.touched and not alone.touched else row


def other_machines(plant: Plant) -> Iterator[tuple[str, Plant]]:
    """The shipped calibrations, where the machine is one of them, and clearances 10 % off; all as finely computed.

    What was changed of the machine is changed in those with another clearance; the others are named as shipped then.
    """
    fine = {"grid": plant.machine.grid, "solver": plant.machine.solver}
    if plant.machine.name in SHIPPED:
        shipped = {name: load_machine(name).with_(fine) for name in SHIPPED}
        differs = shipped.pop(plant.machine.name) != plant.machine
        for name, machine in shipped.items():
            yield f"{name} as shipped" if differs else name, Plant(machine)
    gas = next(i for i, one in enumerate(plant.machine.bearings) if getattr(one, "kind", "") == "gas_film")
    clearance = float(plant.machine.bearings[gas].clearance)  # type: ignore[union-attr]
    for factor in (0.9, 1.1):
        changed = plant.machine.with_({f"bearings.{gas}.clearance": float(f"{clearance * factor:.9g}")})
        yield f"clearance {100 * factor - 100:+.0f} %", Plant(changed)


def _robustness(name: str, plant: Plant, law: AnyLaw, criteria: Criteria, found: list[Alarms]) -> Row:
    pairs, lost = [], []
    for q in CORNERS:
        try:
            pairs.append((impact_responses(plant, None, *q), impact_responses(plant, law, *q)))
        except RotorsimError as error:
            lost.append(str(error))
    found += alarms.of_hits((closed for _, closed in pairs), name)
    remark = f"{len(lost)} of {len(CORNERS)} points without equilibrium" if lost else "worst of five points"
    remark = "; ".join(dict.fromkeys([remark, *(one.ended for pair in pairs for one in pair if one.ended)]))
    return below(f"impact response on {name}", worst_ratio(pairs), criteria.disturbed, remark)


def response_ratios(pairs: Iterable[tuple[ImpactResponse, ImpactResponse]]) -> np.ndarray:
    """Closed over open response (n, 2) of pairs (open, closed).

    Infinite where the run under the law ended; where the one without it did there is nothing to compare with, so those
    points are left out. One row of NaN, which passes nowhere, where none is left.
    """
    with np.errstate(invalid="ignore"):
        rows = [
            np.full(2, np.inf) if closed.ended else np.divide(closed.response, alone.response)
            for alone, closed in pairs
            if closed.ended or not alone.ended
        ]
    return np.array(rows) if rows else np.full((1, 2), np.nan)


def worst_ratio(pairs: Sequence[tuple[ImpactResponse, ImpactResponse]]) -> float:
    """Largest closed over open response of pairs (open, closed); NaN, which passes nowhere, where there is none."""
    return float(response_ratios(pairs).max())
