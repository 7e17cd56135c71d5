r"""Calibration of a machine file: free parameters within bounds, fitted to measured or published values.

Least squares on (model - target) / tolerance over the fitted targets, parameters scaled to 0..1 between their bounds.
With J the Jacobian at the end, the covariance of the scaled parameters is (J'J)^-1 (tolerances taken as standard
deviations); a right singular vector of J with singular value below `WEAK` moves across half its bounds before the
targets notice: it is called not identifiable.

A faint pull towards the start (`PULL`) keeps a parameter that no target feels where it was; without it the trust region
of a matrix that lacks rank makes every step too long, and the fit ends early. It moves the others by PULL^2 / s^2.

What a target that is not met could reach is found by weighing it `HEAVY` times as much as the others, by steps from the
end of the fit; the target that then pays most is named as the one that contradicts it.

A fit to ranges is a calibration and no prediction; what is predicted are the targets of that role.

Some figures are compared as a campaign measures them: identified in simulated records, with pins as their sensors read
them. A pair of pins is the thesis' model of actuators (two real poles and a gain by axis, Table C.2), its fit that of
another record. A delay is that of Model 2 behind the pins' readings, so a sensor's lag counts to the pins and not to
the film.

Cites: thesis.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import least_squares, lsq_linear
from threadpoolctl import threadpool_limits

from identification import Prefilter, filtered, fit_of, identify
from identification.local.fits import actuator_signals
from identification.local.greybox import actuator_poles
from rotorsim.analysis.operating_map import operating_point
from rotorsim.analysis.supply import lift_off
from rotorsim.analysis.targets import AXES, BARE, PINS, Parameter, Target, Targets, split, value_at
from rotorsim.analysis.whirl_onset import whirl_onset
from rotorsim.base.errors import DataError, RotorsimError
from rotorsim.base.files import write_text
from rotorsim.base.interrupt import finishing
from rotorsim.experiments import prbs, steady
from rotorsim.machine.file_text import remarked, with_value, with_values
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant
from rotorsim.plant.linearise import LinearPlant

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.plant import Plant

RECIPE = Prefilter(median=3)
"""The thesis' prefilter: a running median of three."""
DURATION = 2.0
"""Duration [s] of each record, with and without excitation."""


def pin_figures(plant: Plant, speed: float, pressure: float) -> dict[str, float]:
    """Poles [rad/s], gain and fit of the pairs of pins as read, at a speed [rad/s] and gauge pressure [Pa].

    Raises
    ------
    DataError
        If the machine has no actuators whose pins could be read.
    """
    first, second = (_record(plant, speed, pressure, number) for number in (1, 2))
    found = identify(first, "actuator", settings=RECIPE)
    assert plant.machine.actuators is not None
    poles, gain = actuator_poles(found.theta), np.diag(found.static_gain) / plant.machine.actuators.sensor_sensitivity
    fit = fit_of(found.model, actuator_signals(filtered(second, None, RECIPE)))
    columns = {"pole_slow": poles[:, 0], "pole_fast": poles[:, 1], "pin_gain": gain, "pin_fit": fit}
    return {f"{name}_{axis}": float(values[k]) for name, values in columns.items() for k, axis in enumerate("xy")}


def read_delays(plant: Plant, speed: float, pressure: float) -> dict[str, float]:
    """Delay [s] by axis that Model 2 finds behind the pins as read, at a speed [rad/s] and gauge pressure [Pa].

    Raises
    ------
    DataError
        If the machine has no actuators whose pins could be read.
    """
    excited = _record(plant, speed, pressure, 1)
    quiet = steady(plant, speed, pressure, duration=DURATION) if speed else None
    found = identify(excited, "2", steady=quiet, settings=RECIPE, dead_time=0.0)
    return {f"delay_read_{axis}": float(found.delay[k]) for k, axis in enumerate("xy")}


def _record(plant: Plant, speed: float, pressure: float, number: int) -> xr.Dataset:
    if plant.machine.actuators is None:
        raise DataError(f"{plant.machine.name}: has no actuators whose pins could be read; take a machine that has")
    return prbs(plant, speed, pressure, amplitude=1.0, duration=DURATION, sequence=number)


WEAK = 2.0
STEP = 1e-3
PULL = 1e-3
HEAVY = 100.0
"""Weight of a target that is sought alone."""
STEPS = 8
"""Most steps towards such a target."""
ASKED = 1e-3
"""Distance from a target over its tolerance at which it is reached."""
SHARES = (1.0, 0.25, 0.06)
"""Shares of a step that are tried in turn until it comes closer."""
FARTHEST = 0.3
"""Length of one such step over the distance between the bounds."""
LOST = 30.0
"""Residual of every target where the machine is not lifted or not valid, and of one that is not known there."""

Progress = Callable[[int, float], None]


@dataclass(frozen=True)
class CalibrationRow:
    """A target before and after: smallest and largest value [SI] over the operating points, and what that counts as."""

    target: Target
    before: tuple[float, float]
    after: tuple[float, float]

    @property
    def verdicts(self) -> tuple[str, str]:
        """Verdict before and after."""
        return self.target.verdict(self.before), self.target.verdict(self.after)


@dataclass(frozen=True)
class Reach:
    """Fitted number that is not met, what it comes to when it weighs most, and the one that pays most for it.

    Names are those of targets, of a range with the end; `asked`, `reached` (with all targets) and `alone` (when it
    weighs most) in SI. `other` is empty, and its numbers None, where none pays.
    """

    name: str
    quantity: str
    asked: float
    reached: float
    alone: float
    other: str
    other_quantity: str
    other_asked: float | None
    other_reached: float | None
    other_then: float | None


@dataclass(frozen=True, eq=False)
class Calibration:
    """Result of a calibration; `machine` has the new values, `values` and `sd` are in each parameter's unit."""

    machine: Machine
    parameters: tuple[Parameter, ...]
    values: np.ndarray
    sd: np.ndarray
    correlation: np.ndarray
    singular_values: np.ndarray
    directions: np.ndarray
    at_bound: np.ndarray
    rows: tuple[CalibrationRow, ...]
    reach: tuple[Reach, ...]
    cost: tuple[float, float]
    ended: str

    @property
    def unidentifiable(self) -> tuple[str, ...]:
        """Directions that the targets do not determine, as text."""
        texts = []
        for size, v in zip(self.singular_values, self.directions, strict=True):
            if size < WEAK:
                order = np.argsort(-np.abs(v))
                texts.append(" ".join(f"{v[k]:+.2f} {self.parameters[k].name}" for k in order if abs(v[k]) > 0.15))
        return tuple(texts)

    def met(self, role: str | None = None) -> tuple[int, int, int]:
        """Targets met before, met after, and in all."""
        rows = [r for r in self.rows if role in (None, r.target.role)]
        both = [r.verdicts for r in rows]
        return sum(b == "met" for b, _ in both), sum(a == "met" for _, a in both), len(rows)


def judge(machine: Machine, targets: Targets) -> dict[str, str]:
    """The verdict on every target by name, of a machine as it is.

    Examples
    --------
    >>> import rotorsim as rs
    >>> verdicts = rs.analysis.judge(machine, rs.analysis.read_targets("dtu_orifice"))  # doctest: +SKIP
    """
    ends = _read(machine, targets, targets.targets)
    return {t.name: t.verdict(e) for t, e in zip(targets.targets, ends, strict=True)}


def calibrate(machine: Machine, targets: Targets, passes: int = 20, progress: Progress | None = None) -> Calibration:
    """Fit the parameters of `targets`, from their start values; `progress` receives (evaluations, cost).

    Raises
    ------
    DataError
        If a field of a parameter does not exist or the machine at the start is not valid or not lifted.

    Examples
    --------
    >>> import rotorsim as rs
    >>> targets = rs.analysis.read_targets("dtu_orifice")
    >>> found = rs.analysis.calibrate(machine, targets)  # doctest: +SKIP
    """
    parameters = tuple(_started(machine, p) for p in targets.parameters)
    targets = replace(targets, parameters=parameters)
    state = _Fit(machine, targets, progress)
    begin = np.array([(p.start - p.low) / (p.high - p.low) for p in targets.parameters])
    if progress:
        progress(0, state.cost)
    before = _read(machine, targets, targets.targets)
    first = state.residual(begin, strict=True)
    try:
        fit = least_squares(lambda x: np.concatenate([state.residual(x), PULL * (x - begin)]),
                            np.clip(begin, 1e-6, 1 - 1e-6),
                            lambda x: np.concatenate([state.jacobian(x), PULL * np.eye(len(x))]),
                            bounds=(0, 1), max_nfev=passes, xtol=1e-6, ftol=1e-6)  # fmt: skip
        ended = "complete" if fit.status > 0 else "passes"
    except KeyboardInterrupt:
        finishing()
        ended = "interrupted"
    return _outcome(state, targets, before, first, state.best if ended == "interrupted" else fit.x, ended)


def _started(machine: Machine, parameter: Parameter) -> Parameter:
    """The parameter with the machine's own value as its start, where the targets give none."""
    if not np.isnan(parameter.start):
        return parameter
    field = parameter.fields[0]
    number, unit = split(field.path, value_at(machine._source or machine.text, field.path))
    if unit != parameter.unit:
        raise DataError(
            f"parameters.{parameter.name}: bounds are in '{parameter.unit}', the machine's {field.path} in '{unit}'; "
            "write the bounds in that unit or give a start"
        )
    start = (number - field.offset) / field.scale
    if not parameter.low <= start <= parameter.high:
        raise DataError(
            f"parameters.{parameter.name}: the machine has {start:g} {unit}, not between {parameter.low:g} and "
            f"{parameter.high:g}; widen the bounds or give a start"
        )
    return replace(parameter, start=start)


class _Fit:
    """Residuals over scaled parameters, each computed once, with the best so far."""

    def __init__(self, machine: Machine, targets: Targets, progress: Progress | None) -> None:
        self.machine, self.targets, self.progress = machine, targets, progress
        self.count, self.cost = 0, np.inf
        self.best = np.zeros(len(targets.parameters))
        self.fitted = [t for t in targets.targets if t.role == "fit"]
        numbers = [(t, end) for t in self.fitted for end in (("",) if t.at else (", lowest", ", highest"))]
        self.names = [f"{t.name}{end}" for t, end in numbers]
        self.quantities, self.tolerances = [t.quantity for t, _ in numbers], [t.tolerance for t, _ in numbers]
        self.asked = [t.high if end == ", highest" else t.low for t, end in numbers]
        self.known: dict[bytes, np.ndarray] = {}

    def values(self, x: np.ndarray) -> np.ndarray:
        return np.array([p.low + v * (p.high - p.low) for p, v in zip(self.targets.parameters, x, strict=True)])

    def with_parameters(self, x: np.ndarray) -> Machine:
        changed = {
            field.path: parameter.text(field.scale * value + field.offset)
            for parameter, value in zip(self.targets.parameters, self.values(x), strict=True)
            for field in parameter.fields
        }
        return Machine.from_text(with_values(self.machine._source or self.machine.text, changed))

    def residual(self, x: np.ndarray, strict: bool = False) -> np.ndarray:
        """Deviations (n,) in tolerances, two for a range and one for a value."""
        key = x.tobytes()
        if key not in self.known:
            self.known[key] = self._residual(x, strict)
        return self.known[key]

    def _residual(self, x: np.ndarray, strict: bool) -> np.ndarray:
        try:
            ends = _read(self.with_parameters(x), self.targets, self.fitted)
        except RotorsimError as error:
            if strict:
                raise DataError(f"calibrate: at the start values {error}; correct start or fields") from error
            return np.full(sum(1 if t.at else 2 for t in self.fitted), LOST)
        off = [(e - (t.low, t.high)) / t.tolerance for t, e in zip(self.fitted, np.array(ends), strict=True)]
        r = np.concatenate([two[:1] if t.at else two for t, two in zip(self.fitted, off, strict=True)])
        r = np.where(np.isfinite(r), r, LOST)
        self.count += 1
        if r @ r < self.cost:
            self.cost, self.best = float(r @ r), x.copy()
        if self.progress:
            self.progress(self.count, self.cost)
        return np.asarray(r)

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """One-sided differences, inwards at a bound."""
        here, columns = self.residual(x), []
        for k in range(len(x)):
            step = STEP if x[k] + STEP <= 1 else -STEP
            moved = x.copy()
            moved[k] += step
            columns.append((self.residual(moved) - here) / step)
        return np.stack(columns, axis=1)


def axis_modes(model: LinearPlant) -> tuple[int, int]:
    """Number of the mode that moves x and of the one that moves y; in order of frequency when both are one."""
    first = model.mode_of_axis(0), model.mode_of_axis(1)
    return first if first[0] != first[1] else (0, 1)


def figures(plant: Plant, speed: float, pressure: float) -> dict[str, float]:
    """All figures of an operating point, those of modes NaN where a mode may be missing; raises NoLiftOffError."""
    point = operating_point(plant, speed, pressure, (0.0,))
    model, found = point.model, dict[str, float]()
    known = model.proven and model.wn.size >= len(AXES)
    for axis, mode in zip(AXES, axis_modes(model) if known else (0, 1), strict=True):
        wn, zeta = (float(each[mode]) if known else float("nan") for each in (model.wn, model.zeta))
        found |= {f"wn_{axis}": wn, f"zeta_{axis}": zeta}
    for i, a in enumerate(AXES):
        found[f"delay_{a}"] = float(model.delay[i])
        found |= {f"gain_{a}{b}": float(model.static_gain[i, j]) for j, b in enumerate(AXES)}
    rest = point.equilibrium
    return found | {
        "eccentricity_ratio": rest.eccentricity_ratio,
        "h_min": rest.h_min,
        "mass_flow": float(rest.mass_flow.sum()),
    }


@lru_cache(maxsize=64)
def bare(plant: Plant, quantity: str, speed: float, pressure: float) -> float:
    """A figure of no single operating point."""
    if quantity == "lift_off":
        return float(lift_off(plant, [speed])[0])
    return float(whirl_onset(plant, [pressure])["onset_speed"][0])


def _read(machine: Machine, targets: Targets, asked: Sequence[Target]) -> list[tuple[float, float]]:
    """Smallest and largest value of each asked target's quantity; every operating point is computed once."""
    plant = Plant(machine)
    kinds = (figures, pin_figures, read_delays)
    point = cache(lambda kind, speed, pressure: kinds[kind](plant, speed, pressure))
    with threadpool_limits(1):  # the matrices are small
        return [_ends(target, point, plant, targets) for target in asked]


def _kind(quantity: str) -> int:
    """Number of the function that computes a quantity: of the linear plant, of a record of pins or of the disc."""
    return 1 if quantity[:-2] in PINS else 2 if quantity.startswith("delay_read") else 0


def _ends(
    target: Target, point: Callable[[int, float, float], dict[str, float]], plant: Plant, targets: Targets
) -> tuple[float, float]:
    """Smallest and largest value of a target's quantity over the operating points, or its value at one."""
    name = target.quantity
    if name in BARE:
        over = targets.speeds if name == "lift_off" else targets.pressures
        grid = [(float(v), 0.0) if name == "lift_off" else (0.0, float(v)) for v in over]
        values = [bare(plant, name, *at) for at in ([target.at] if target.at else grid)]
    else:
        grid = [(float(s), float(p)) for p in targets.pressures for s in targets.speeds]
        values = [point(_kind(name), *at)[name] for at in ([target.at] if target.at else grid)]
    return min(values), max(values)


def _outcome(
    state: _Fit, targets: Targets, before: list[tuple[float, float]], first: np.ndarray, x: np.ndarray, ended: str
) -> Calibration:
    machine = state.with_parameters(x)
    after = _read(machine, targets, targets.targets)
    rows = tuple(CalibrationRow(*entry) for entry in zip(targets.targets, before, after, strict=True))
    J, last = state.jacobian(x), state.residual(x)
    reach = tuple(_reach(state, x, J, int(k)) for k in np.flatnonzero(np.abs(last) > 1)) if ended == "complete" else ()
    _, s, V = np.linalg.svd(J, full_matrices=len(J) < J.shape[1])
    s = np.concatenate([s, np.zeros(len(V) - len(s))])
    covariance = (V.T / np.maximum(s, 1e-6) ** 2) @ V
    spread = np.sqrt(np.diag(covariance))
    width = np.array([p.high - p.low for p in targets.parameters])
    return Calibration(
        machine, targets.parameters, state.values(x), spread * width, covariance / np.outer(spread, spread), s, V,
        (x < 1e-3) | (x > 1 - 1e-3), rows, reach, (float(first @ first), float(last @ last)), ended,
    )  # fmt: skip


def _reach(state: _Fit, x: np.ndarray, J: np.ndarray, k: int) -> Reach:
    """Number k weighed most, by Gauss-Newton steps from the end x of the fit of all, whose Jacobian is J."""
    weights = np.where(np.arange(len(J)) == k, HEAVY, 1.0)[:, None]
    before = best = state.residual(x)
    at = x
    for _ in range(STEPS):
        low, high = np.maximum(-at, -FARTHEST), np.minimum(1 - at, FARTHEST)
        system, aim = np.vstack([weights * J, PULL * np.eye(len(x))]), np.append(-weights[:, 0] * best, PULL * (x - at))
        step = lsq_linear(system, aim, (low - 1e-12, high + 1e-12)).x
        tried = [np.clip(at + share * step, 0.0, 1.0) for share in SHARES]
        found = next(((new, r) for new in tried if abs((r := state.residual(new))[k]) < abs(best[k])), None)
        if found is None:
            break
        at, best = found
        if abs(best[k]) < ASKED:
            break
        J = state.jacobian(at)
    paid = np.where(np.arange(len(J)) == k, -np.inf, np.abs(best) - np.abs(before))
    other = int(paid.argmax()) if len(paid) > 1 and paid.max() > 0.1 else -1

    def number(i: int, r: np.ndarray) -> float:
        return state.asked[i] + state.tolerances[i] * float(r[i])

    mine = (state.names[k], state.quantities[k], state.asked[k], number(k, before), number(k, best))
    if other < 0:
        return Reach(*mine, "", "", None, None, None)
    theirs = (state.names[other], state.quantities[other], state.asked[other])
    return Reach(*mine, *theirs, number(other, before), number(other, best))


def save_calibrated(found: Calibration, name: str, path: str | Path, loaded: Machine) -> None:
    """Write the machine file with the new values: comments kept where they still hold, a remark at its head.

    Parameters
    ----------
    found : Calibration
        Result of `calibrate`.
    name : str
        Name of the targets, for the remark.
    path : path
        File to write; raises WriteError.
    loaded : Machine
        The machine before; its film grid is kept.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.calibrate(machine, rs.analysis.read_targets("dtu_orifice"))  # doctest: +SKIP
    >>> rs.analysis.save_calibrated(found, "dtu_orifice", "calibrated.toml", machine)  # doctest: +SKIP
    """
    path = Path(path)
    values = ", ".join(
        f"{p.name} {v:.5g} {p.unit}".strip() for p, v in zip(found.parameters, found.values, strict=True)
    )
    before, after, total = found.met()
    used, grid = found.machine, (found.machine.grid.n_theta, found.machine.grid.n_z)
    same = used.film is None or grid == (loaded.grid.n_theta, loaded.grid.n_z)
    on = "" if same else f", on a film grid of {grid[0]} x {grid[1]}"
    head = (
        f"# Calibrated, not predicted: fitted to '{name}': {values}.\n"
        f"# Targets met: {before} before, {after} after, of {total}{on}.\n"
    )
    machine = found.machine.replace("grid.n_theta", loaded.grid.n_theta).replace("grid.n_z", loaded.grid.n_z)
    changed = [f.path for p in found.parameters for f in p.fields]
    text = remarked(machine._source or machine.text, changed, f"calibrated to '{name}'")
    write_text(path, head + with_value(text, "name", path.stem))


def calibration_numbers(found: Calibration) -> dict[str, Any]:
    """Calibration result as plain numbers in SI, parameters in their own units.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.calibrate(machine, rs.analysis.read_targets("dtu_orifice"))  # doctest: +SKIP
    >>> rs.analysis.calibration_numbers(found)["cost"]  # doctest: +SKIP
    """
    return {
        "ended": found.ended,
        "cost": list(found.cost),
        "parameters": [
            {"name": p.name, "unit": p.unit, "start": p.start, "value": v, "sd": s, "at_bound": bool(b)}
            for p, v, s, b in zip(
                found.parameters, found.values.tolist(), found.sd.tolist(), found.at_bound, strict=True
            )
        ],
        "correlation": found.correlation.tolist(),
        "singular_values": found.singular_values.tolist(),
        "not_identifiable": list(found.unidentifiable),
        "targets": [
            {"name": r.target.name, "role": r.target.role, "target": [r.target.low, r.target.high],
             "before": list(r.before), "after": list(r.after), "verdicts": list(r.verdicts)}
            for r in found.rows
        ],
        "reach": [asdict(one) for one in found.reach],
        "met": dict(zip(("before", "after", "of"), found.met(), strict=True)),
    }  # fmt: skip
