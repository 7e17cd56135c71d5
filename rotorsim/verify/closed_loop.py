r"""Verification of a law on a nonlinear plant and on perturbed plants: criteria, alarms, rows of the result.

The loop is also closed with the full-order linear plant, film, rotor, actuators, hold and a sample of delay:

.. math:: G(z) = z^{-1} \, Z\{ H_0(s) \, G_{plant}(s) \, G_{actuators}(s) \}

Every film node is a state, a few hundred in all, so that neither truncation nor identification stands between law and
physics. The actuators' response is that of their pins to a small pseudo-random reference, as a second-order lag for
each axis: their hysteresis has no linearisation.

Cites: astrom_1997.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

import identification as idn
from rotorsim.base.display import Reported
from rotorsim.base.errors import LawError, RotorsimError
from rotorsim.base.units import KRPM, TO_UM
from rotorsim.control.law import Law
from rotorsim.control.plants import point_text
from rotorsim.control.runout import RunoutTable, check_runout
from rotorsim.control.sampled_loop import closed_poles, law_system, loop_of, smallest_damping
from rotorsim.control.systems import System, balanced_states, held, late, series
from rotorsim.experiments import prbs, slow_roll
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from rotorsim.verify import transients
from rotorsim.verify.runs import AnyLaw, Run, as_law
from rotorsim.verify.transients import POINTS, ImpactResponse, impact_responses

SHIPPED = ("dtu_gas_bearing", "dtu_gas_bearing_b", "dtu_gas_bearing_c")
"""Calibrations A, B, C."""
CORNERS = ((0.0, 0.3e6), (0.0, 0.7e6), (6 * KRPM, 0.3e6), (6 * KRPM, 0.7e6), (3 * KRPM, 0.5e6))
Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Verification(Reported):
    """Rows of a verification, the impact responses behind them, and the law's alarms in each run that had any."""

    law: AnyLaw
    machine: str
    rows: tuple[CriterionRow, ...]
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
        raise LawError(
            f"{plant.machine.name}: has no actuators that a law could drive; verify on a gas bearing",
            argument="machine",
            value=plant.machine.name,
        )
    report = progress or (lambda _: None)
    points = CORNERS if quick else POINTS
    report("impacts, open loop")
    before = open_loop or tuple(impact_responses(plant, None, *q) for q in points)
    report("impacts, closed loop")
    after = closed or tuple(impact_responses(plant, law, *q) for q in points)
    runs: dict[str, Any] = {}
    found = [*alarms_of_hits(after)]
    rows = [*_impact_rows(before, after, criteria)]
    if isinstance(law, Law) and law.runout is not None:
        report("slow roll")
        rows.append(_runout_row(plant, law.runout))
    report("noise")
    rest = transients.at_rest(plant, law)
    found.append(alarms_of_run("rest", rest))
    rows.append(at_most("noise in the reference at rest", transients.noise(rest).max(), criteria.noise, "V"))
    report("run-up and coast-down")
    rows += _runup_rows(plant, law, criteria, runs, quick)
    found.append(alarms_of_run("run-up and coast-down", runs["runup"][1]))
    report("ramps, steps, saturation, sensor faults")
    rows += _transient_rows(plant, law, criteria, found)
    if not quick:
        if isinstance(law, Law):
            report("full-order loops")
            rows += _full_order_rows(plant, law, criteria)
        for name, other in other_machines(plant):
            report(f"robustness: {name}")
            rows.append(_robustness(name, other, law, criteria, found))
    rows.append(alarm_row(found, criteria))
    had = tuple(one for one in found if one.bad)
    return Verification(law, plant.machine.name, tuple(rows), before, after, {"criteria": asdict(criteria)}, runs, had)


def _impact_rows(
    before: tuple[ImpactResponse, ...], after: tuple[ImpactResponse, ...], criteria: Criteria
) -> Iterator[CriterionRow]:
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
    yield CriterionRow(
        "smallest damping ratio, closed", held, None, "", None, f"{np.divide(held, free):.1f} x open loop"
    )
    yield holds(
        "no contact in the hits", not any(c.touched for c in after), "; ".join(dict.fromkeys(filter(None, ended)))
    )


def _runout_row(plant: Plant, table: RunoutTable) -> CriterionRow:
    """Rest of the runout that a law's table leaves at a slow roll of the plant."""
    found = check_runout(table, slow_roll(plant, pressure=0.7e6, revolutions=2))
    return at_most("runout left by the table", found.left * TO_UM, found.bound * TO_UM, "um rms", found.text)


def _runup_rows(
    plant: Plant, law: AnyLaw, criteria: Criteria, runs: dict[str, Any], quick: bool
) -> Iterator[CriterionRow]:
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


def _full_order_rows(plant: Plant, law: Law, criteria: Criteria) -> Iterator[CriterionRow]:
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
    yield CriterionRow("smallest damping of the full-order loop", damped.damping, None, "", None, remark)


def _transient_rows(plant: Plant, law: AnyLaw, criteria: Criteria, found: list[Alarms]) -> Iterator[CriterionRow]:
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
        found.append(alarms_of_run(name, run, sound="hangs" not in name))
        yield _transient_row(name, run, case(None), law.limit, criteria.transient)


def _transient_row(name: str, run: Run, alone: Run, limit: float, most: float | None) -> CriterionRow:
    """Departure of the disc under a law; the run without it moves the bound where it came to its end."""
    moved, free = transients.excursion(run), transients.excursion(alone)
    bound = None if most is None else TO_UM * max(most, 0.0 if alone.ended else 1.2 * free)
    if run.ended:
        return CriterionRow(name, moved, bound, "um", False, run.ended)
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
    gas = plant.machine.film_bearings[0]
    clearance = plant.machine.films[0].clearance
    for factor in (0.9, 1.1):
        changed = plant.machine.with_({f"bearings.{gas}.clearance": float(f"{clearance * factor:.9g}")})
        yield f"clearance {100 * factor - 100:+.0f} %", Plant(changed)


def _robustness(name: str, plant: Plant, law: AnyLaw, criteria: Criteria, found: list[Alarms]) -> CriterionRow:
    pairs, lost = [], []
    for q in CORNERS:
        try:
            pairs.append((impact_responses(plant, None, *q), impact_responses(plant, law, *q)))
        except RotorsimError as error:
            lost.append(str(error))
    found += alarms_of_hits((closed for _, closed in pairs), name)
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


@dataclass(frozen=True)
class Criteria:
    """Bounds. Ratios are closed over open loop, and below their bound by more than a rounding; None is not judged.

    Attributes
    ----------
    mean, worst : float or None
        Impact response, averaged over the twenty points and at the worst of them.
    effort : float or None
        Largest reference in the hits [V].
    noise : float or None
        Standard deviation of the reference at rest [V].
    amplitude : float or None
        Imbalance amplitude at the end of the run-up.
    transient : float or None
        Largest distance [m] of the disc from its moving mean of 0.1 s in ramps, steps and faults, or 1.2 times that
        of the open loop where this is more.
    disturbed : float or None
        Impact response at the worst point of changed machines.
    disk : float or None
        Disk margin with the plant's own linearisation, at the worst of five points; at least.
    suspended : float or None
        Part of the samples of a run with sound sensors in which an alarm suspends the law. A step of the pressure may
        suspend it for 50 samples, 1.25 % of a run; with more than 2 % figures are those of the plant without the law.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.verify.Criteria(worst=1.2).worst
    1.2
    """

    mean: float | None = 1.0
    worst: float | None = 1.0
    effort: float | None = 5.0
    noise: float | None = 1.0
    amplitude: float | None = 1.0
    transient: float | None = 30e-6
    disturbed: float | None = 1.0
    disk: float | None = 0.3
    suspended: float | None = 0.02


ROUNDING = 1e-3
"""A ratio that differs from its bound by less is printed as the bound, and is not below it."""


def edited(before: Mapping[str, float | None], now: Mapping[str, float | None]) -> list[str]:
    """A sentence for each bound, by name, that differs from that of the first verification in a folder.

    Examples
    --------
    >>> from dataclasses import asdict
    >>> edited(asdict(Criteria()), asdict(Criteria(worst=1.2)))
    ['worst: 1.0 at the first verification here, 1.2 now']
    """
    names = [name for name in before if before[name] != now.get(name)]  # not those of a later version
    return [f"{name}: {before.get(name)} at the first verification here, {now.get(name)} now" for name in names]


@dataclass(frozen=True)
class CriterionRow:
    """One criterion: what, measured and bound with their unit, whether it passed (None: not judged), a remark."""

    check: str
    measured: float
    bound: float | None
    unit: str
    passed: bool | None
    remark: str = ""


def at_most(check: str, measured: float, bound: float | None, unit: str = "", remark: str = "") -> CriterionRow:
    """A row that passes up to its bound."""
    return CriterionRow(check, float(measured), bound, unit, None if bound is None else bool(measured <= bound), remark)


def below(check: str, measured: float, bound: float | None, remark: str = "") -> CriterionRow:
    """A row of a ratio of closed over open loop, which passes below its bound; a law that does nothing has 1."""
    passed = None if bound is None else bool(measured < bound * (1 - ROUNDING))
    same = "as the open loop: the law changes nothing" if abs(measured - 1) < ROUNDING else ""
    return CriterionRow(check, float(measured), bound, "of open loop", passed, "; ".join(filter(None, (same, remark))))


def at_least(check: str, measured: float, bound: float | None, unit: str = "", remark: str = "") -> CriterionRow:
    """A row that passes from its bound on."""
    return CriterionRow(check, float(measured), bound, unit, None if bound is None else bool(measured >= bound), remark)


def holds(check: str, good: bool, remark: str = "") -> CriterionRow:
    """A row that passes or not."""
    return CriterionRow(check, float(good), 1.0, "", bool(good), remark)


@dataclass(frozen=True)
class Alarms:
    """Bad samples of a law in a run: how many of how many, a sentence with the last alarm, whether sensors are sound.

    Examples
    --------
    >>> Alarms("run-up", 40, 4000, "40 bad samples").share
    0.01
    """

    run: str
    bad: int
    samples: int
    sentence: str
    sound: bool = True

    @property
    def share(self) -> float:
        """Part of the samples in which the law was suspended."""
        return self.bad / self.samples if self.samples else 0.0

    @property
    def text(self) -> str:
        """Run, number, alarm."""
        return f"{self.run}: of {self.samples} samples {self.sentence}"


def alarms_of_run(name: str, run: Run, sound: bool = True) -> Alarms:
    """Alarms of a run of a verification."""
    return Alarms(name, *run.alarms, sound)


def alarms_of_hits(found: Iterable[ImpactResponse], machine: str = "") -> Iterator[Alarms]:
    """Alarms of the hits at each operating point."""
    for one in found:
        where = ", ".join(filter(None, (point_text(one.speed, one.pressure), machine)))
        yield Alarms(f"hits at {where}", one.bad, one.samples, one.alarm)


def alarm_row(found: Iterable[Alarms], criteria: Criteria) -> CriterionRow:
    """Largest part of a run with sound sensors in which the law was suspended."""
    sound = [one for one in found if one.sound]
    worst = max(sound, key=lambda one: one.share)
    runs = sum(one.bad > 0 for one in sound)
    remark = f"in {runs} of {len(sound)} runs; {worst.text}" if runs else ""
    most = None if criteria.suspended is None else 100 * criteria.suspended
    return at_most("suspended by alarms, sound sensors", 100 * worst.share, most, "% of a run", remark)


HIGHEST = 1000.0
"""Frequency [Hz] up to which margins are taken."""


@dataclass(frozen=True)
class FullOrder:
    """Loop at an operating point [rad/s], [Pa]: states, radius of the outermost pole, damping, margins."""

    speed: float
    pressure: float
    states: int
    radius: float
    damping_open: float
    damping: float
    peak: float
    disk_margin: float
    gain_margin: float
    phase_margin: float


def pins(plant: Plant, amplitude: float = 0.2) -> System:
    """Actuators (4 states, SI) from references to the displacement of a pin of each axis, as the plant shows it."""
    record = prbs(plant, 0.0, 0.5e6, amplitude=amplitude, duration=2.0, sequence=1)
    model = idn.identify(record, "actuator").model
    return System(model.A, model.B, model.C / 2, model.D)  # identified is the difference of a pair


def full_plant(plant: Plant, speed: float, pressure: float, actuators: System) -> System:
    """The sampled plant in um and V with the law's sample of delay."""
    found = plant.linearise(speed, pressure)
    per_volt = pin_per_volt(plant)
    rotor = System(found.A, found.B[:, :2] / per_volt, found.C * TO_UM, np.zeros((2, 2)))
    # pressures next to displacements would cost most of the digits
    return late(held(balanced_states(series(actuators, rotor)), plant.machine.sampling_time))


def pin_per_volt(plant: Plant) -> float:
    """Travel [m] of an ideal pin for a volt, which the linearisation assumes."""
    assert plant.machine.injection is not None
    return float(plant.machine.injection.pin_per_volt)


def full_order(plant: Plant, law: Law, points: Iterable[tuple[float, float]]) -> list[FullOrder]:
    """The loop at operating points [rad/s], [Pa]."""
    actuators, rows = pins(plant), []
    for speed, pressure in points:
        G, K = full_plant(plant, speed, pressure, actuators), law_system(law, speed, pressure)
        own = smallest_damping(np.linalg.eigvals(G.A), law.Ts)
        z = closed_poles(G, K)
        loop = loop_of(G, K, law.Ts, np.geomspace(0.5, HIGHEST, 150))
        rows.append(FullOrder(speed, pressure, G.order, float(np.abs(z).max()), own, smallest_damping(z, law.Ts),
                              loop.peak, loop.disk_margin, loop.gain_margin, loop.phase_margin))  # fmt: skip
    return rows
