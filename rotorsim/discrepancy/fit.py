r"""Fits of a twin to records: damped least squares, standard deviations, re-calibration.

The linearised step has a line search, and residuals always come from the plant:

.. math:: \min_v \; |r(v)|^2 + |(v - v_0)/s|^2

The Jacobian J of a chord step is kept and corrected after each step by Broyden's rank-one update. Source: Nocedal &
Wright (2006), chapter 10 and section 11.1.

Standard deviations are those of the sandwich estimator over the m records, or of H^-1 where these are larger:

.. math:: V = H^{-1} \Big(\sum_i g_i g_i'\Big) H^{-1} \frac{m}{m-1}, \quad g_i = J_i' r_i, \quad H = J'J + P

Plain ones are too small where errors of a record hang together. Source: Huber (1967); Liang & Zeger (1986). J must be
the Jacobian AT the fitted point: that of a chord, updated step by step, is right along the steps and wrong across them,
which makes parameters that are nearly alike look well determined, and ends a fit where the sum of squares would still
fall along them.

A re-calibration fits, determines the discretisation error at the fitted point, and fits again. It starts with a scan of
the shaft's stiffness: a resonance that is off by more than its own width gives Gauss-Newton no slope to go down.

Priors that are alike for all bearings spread the change of one over all of them and over the shaft. So where bearings
leave their priors, fits with one of them far from the file and all others near it compete with one in which all are
near (`far_places`): the same physics, with the prior that a machine with one fault has.

Cites: nocedal_2006, huber_1967, liang_1986.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from rotorsim.base.errors import NoAnswerError
from rotorsim.base.rounding import answer, normal_root
from rotorsim.discrepancy.calibration import (
    DIRECTIONS,
    LAW,
    LOSS_SD,
    MESH,
    FitParameter,
    ParameterPoint,
    calibration,
    within,
)
from rotorsim.discrepancy.comparison import TwinComparison, flagged, table
from rotorsim.discrepancy.data_vector import TOLERANCE
from rotorsim.discrepancy.twin import Twin

MOST_STEPS, MOST_DAMPING = 8, 1e4
"""Most steps of a fit, and damping from which on it ends."""
UNTURNED = 1e-3
"""Damping below which a step is that of Gauss and Newton."""
FEW_STEPS = 3
"""Most steps of a fit that is one of several."""
LENGTHS = (1.0, 0.35, 0.35 * 0.35)
"""Shares of a step that are tried."""
ENOUGH = 1.0
"""Fall of the sum of squares in a step below which a fit ends (a thousandth of the sum at least)."""
MOST_ROUNDS = 4
"""Most fits with the Jacobian at their own point."""
STILL = 0.25
"""Fall of the sum of squares, as the Jacobian at the point foretells it, below which a fit has ended: half a standard
deviation."""
KEY = "shaft_stiffness"
"""Key of the parameter that is scanned."""
REACH, STEPS, FINER = 2.5, 21, 2
"""Reach of the scan in standard deviations of the prior, number of its steps, number of refinements."""
MOST_REPEATS = 2
"""Most continued fits from a rough one."""
IMPLAUSIBLE = 3.0
"""Standard deviations of its prior beyond which a calibration parameter is not believed."""
NATURAL = 2.0
"""Standard deviations of its prior within which a limit is a natural end: a shaft may have no damping."""
FAR = {"k": 1.0, "c": 5.0}
"""Prior standard deviations of the relative changes of compliance (k) and loss (c) of a bearing that is far off."""
NEAR, SHAFT = 0.2, 0.01
"""Prior standard deviations of the compliance of the other bearings, and of the shaft's stiffness."""
TIMES = (1 / 3, 0.5, 0.7, 1.0, 1.5, 2.5)
"""Multiples of a bearing's stiffness in the file at which its fit may begin: neighbours within a factor of 1.7."""
ONE_FAR = 8.0
"""Fall of the sum of squares with priors from which one bearing is far off: a few to one after the price of its wide
priors, 5 to 6. Of machines with supports within 20 % it is 3 at most."""
AS_FAR = 6.0
"""Difference of these sums below which records do not distinguish two places: 19 to 1."""
MOST_MOVED = 5.0
"""Most changes of all compliances and losses by their whole size that a group of lines may need."""
ROUGH = 0.02
"""Tolerance of the first fit, before the solver is proven."""


@dataclass(frozen=True, eq=False)
class ParameterFit:
    """Result of a fit: point, whitened residual (n,), Jacobian (n, k) there, sum of squares with priors."""

    parameters: tuple[FitParameter, ...]
    point: ParameterPoint
    residual: np.ndarray
    J: np.ndarray
    cost: float

    @property
    def chi2(self) -> float:
        """Sum of squared residuals without priors."""
        return float(self.residual @ self.residual)

    @property
    def vector(self) -> np.ndarray:
        """Values (k,) of the parameters."""
        return np.array([self.point.values.get(k, 0.0) for k in self.parameters])


def prior_rows(parameters: Sequence[FitParameter]) -> np.ndarray:
    """Square-root weights 1 / sd (k,) of the priors."""
    return np.array([1 / k.sd for k in parameters])


def cost_of(residual: np.ndarray, v: np.ndarray, p: np.ndarray) -> float:
    """Sum of squares with priors."""
    return float(residual @ residual + np.sum((v * p) ** 2))


def step_of(J: np.ndarray, r: np.ndarray, v: np.ndarray, p: np.ndarray, damping: float) -> np.ndarray:
    """Damped Gauss-Newton step (k,) for a residual r = measured - simulated."""
    H = J.T @ J + np.diag(p**2)
    scale = np.sqrt(np.maximum(np.diag(H), 1e-300))
    A = H / scale[:, None] / scale + damping * np.eye(len(v))
    g = (J.T @ r - p**2 * v) / scale
    return np.asarray(answer(np.linalg.lstsq, A, g, rcond=1e-12)[0] / scale)


class Simulated(Protocol):
    """Records that a plant with fit parameters is compared with."""

    def residual(self, point: ParameterPoint) -> np.ndarray:
        """Whitened residual (n,) at a point."""


def fit_parameters(
    comparison: Simulated,
    point: ParameterPoint,
    parameters: Sequence[FitParameter],
    J: np.ndarray,
    residual: np.ndarray | None = None,
    steps: int = MOST_STEPS,
    progress: Callable[[], None] | None = None,
) -> ParameterFit:
    """Fit parameters from the start `point` with the Jacobian J (n, k) there; ends where a step has no answer.

    It ends too, without a run, where J foretells no fall that counts, and where no length of a step helps that J
    foretells less from than ends a fit.
    """
    parameters, J = tuple(parameters), J.copy()
    p = prior_rows(parameters)
    r = comparison.residual(point) if residual is None else residual
    v = np.array([point.values.get(k, 0.0) for k in parameters])
    cost, damping = cost_of(r, v, p), 1e-6
    for _ in range(steps):
        try:
            step = step_of(J, r, v, p, damping)
        except NoAnswerError:
            break
        change = within(parameters, v + step) - v
        foretold, enough = cost - cost_of(r - J @ change, v + change, p), max(ENOUGH, 1e-3 * cost)
        # a step that is cut at a limit, or damped, foretells less than there is to gain
        whole = damping < UNTURNED and np.allclose(change, step)
        if whole and foretold < min(STILL, 1e-3 * cost):
            break
        for share in LENGTHS:
            there = point.moved(parameters, share * change)
            new = comparison.residual(there)
            if progress is not None:
                progress()
            if (found := cost_of(new, v + share * change, p)) < cost:
                break
        else:
            # no length of the step helps: turn it towards the steepest descent
            damping = max(1e3 * damping, 1e-3)
            if damping > MOST_DAMPING or (whole and foretold < enough):
                break
            continue
        moved = share * change
        miss = (r - new) - J @ moved
        weight = moved * np.sum(J**2, axis=0)
        J += np.outer(miss, weight) / max(float(weight @ moved), 1e-300)
        done = cost - found < max(ENOUGH, 1e-3 * found)
        point, r, v, cost = there, new, v + moved, found
        damping = damping * 0.3 if share == 1.0 else damping * 10
        if done:
            break
    return ParameterFit(parameters, point, r, J, cost)


def singular_directions(
    J: np.ndarray, parameters: Sequence[FitParameter], limit: float = 1e-2
) -> list[dict[str, float]]:
    """Null vectors of a calibration, with singular values below `limit` times the next one.

    Columns are scaled to unit length; each vector is a dictionary of the parameters that take part in it.
    """
    size = np.linalg.norm(J, axis=0)
    seen = size > 1e-9 * size.max()
    _, s, V = answer(np.linalg.svd, J[:, seen] / size[seen], full_matrices=False)
    names = [k.name for k, ok in zip(parameters, seen, strict=True) if ok]
    found = []
    for i in range(1, len(s)):
        if s[i] < limit * s[i - 1]:
            found += [{n: float(x) for n, x in zip(names, row, strict=True) if abs(x) > 0.2} for row in V[i:]]
            break
    return found


def finished(
    comparison: TwinComparison, fit: ParameterFit, progress: Callable[[], None] | None = None, central: bool = True,
    wanted: float = np.inf,
) -> ParameterFit:  # fmt: skip
    """Converged fit with Jacobians at its own point, by central differences or by one side, the last one included.

    It ends too where they do not promise half of the way to a sum of squares that is `wanted`.
    """
    for number in range(MOST_ROUNDS):
        fit = replace(fit, J=comparison.jacobian(fit.point, fit.parameters, progress=progress, central=central))
        if number == MOST_ROUNDS - 1 or fall(fit) < max(STILL, (fit.cost - wanted) / 2):
            break
        last, fit = fit, fit_parameters(comparison, fit.point, fit.parameters, fit.J, fit.residual, steps=2,
                                        progress=progress)  # fmt: skip
        if fit.point == last.point:  # the Jacobian is that of its point
            break
    return fit


def fall(fit: ParameterFit) -> float:
    """Predicted decrease of the sum of squares with priors in a Gauss-Newton step."""
    size, J, H = scaled(fit)
    g = J.T @ fit.residual - prior_rows(fit.parameters) ** 2 * fit.vector / size
    return float(np.sum((g @ answer(normal_root, H)) ** 2))


def fall_within(fit: ParameterFit, J: np.ndarray) -> float:
    """Predicted decrease by the first step of a fit with a Jacobian J (n, k), which ends at the parameters' limits."""
    p, v = prior_rows(fit.parameters), fit.vector
    change = within(fit.parameters, v + step_of(J, fit.residual, v, p, 0.0)) - v
    return max(fit.cost - cost_of(fit.residual - J @ (s * change), v + s * change, p) for s in (0.0, *LENGTHS))


def scaled(fit: ParameterFit) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Scales (k,) of the fit parameters, and Jacobian (n, k) and Hessian with priors (k, k) in these scales."""
    p = prior_rows(fit.parameters)
    size = np.sqrt(np.sum(fit.J**2, axis=0) + p**2)
    size[size == 0] = 1.0
    J = fit.J / size
    return size, J, J.T @ J + np.diag((p / size) ** 2)


def covariance(fit: ParameterFit, record: np.ndarray) -> np.ndarray:
    """Covariance (k, k) of the fit parameters; record (n,) is the record number of each value."""
    size, J, H = scaled(fit)
    root = answer(normal_root, H)
    inverse = root @ root.T
    g = np.array([J[record == i].T @ fit.residual[record == i] for i in np.unique(record)])
    g -= g.mean(axis=0)
    m = len(g)
    g = g @ root
    between = root @ (g.T @ g * m / max(m - 1, 1)) @ root.T
    grown = np.sqrt(np.maximum(np.diag(between), 0) / np.maximum(np.diag(inverse), 1e-300))
    factor = np.maximum(grown, 1.0) / size
    return np.asarray(inverse * np.outer(factor, factor))


def nearest(
    comparison: TwinComparison, parameters: tuple[FitParameter, ...], progress: Callable[[], None]
) -> ParameterPoint:
    """Point with the shaft stiffness that best fits the excited lines; origin for a machine without it."""
    parameter = next((k for k in parameters if k.key == KEY), None)
    if parameter is None:
        return ParameterPoint()
    layout = comparison.layout
    bands = [i for i, name in enumerate(layout.groups) if name.endswith("band") or name == "resonance"]
    counted = np.isin(layout.group, bands) & (layout.frequency > 0)
    if not counted.any():
        counted = layout.frequency > 0
    tried: dict[float, float] = {}
    values = np.linspace(-REACH, REACH, STEPS) * parameter.sd
    for _ in range(1 + FINER):
        for value in values:
            v = float(np.round(np.clip(value, parameter.low, parameter.high), 6))
            if v not in tried:
                r = (comparison.measured - comparison.predict(ParameterPoint({parameter: v})))[counted]
                tried[v] = float(r @ r)
                progress()
        best = min(tried, key=lambda v: (tried[v], v))
        gap = abs(values[1] - values[0]) / 3
        values = best + gap * np.array([-1.0, 1.0])
    return ParameterPoint({parameter: best}) if best else ParameterPoint()


def recalibrate(
    comparison: TwinComparison,
    fine: Twin | None,
    tolerance: float = TOLERANCE,
    progress: Callable[[], None] = lambda: None,
    law: tuple[Twin, Mapping[FitParameter, float]] | None = None,
) -> ParameterFit:
    """Fit the calibration parameters; sets the comparison's noise floor and discretisation correction."""
    points = len({(round(t.speed, 1), round(t.pressure, -3)) for t in comparison.trials})
    parameters: tuple[FitParameter, ...] = calibration(comparison.twin, points)
    start = nearest(comparison, parameters, progress)
    comparison.set_floor(start, None, max(tolerance, ROUGH))
    raw = comparison.stored.columns(start, parameters, progress)
    rough = fit_parameters(
        comparison, start, parameters, raw / comparison.sigma[:, None], steps=FEW_STEPS, progress=progress
    )
    rough = closer(comparison, rough, progress)
    first = comparison.sigma.copy()
    comparison.set_floor(rough.point, fine, tolerance, *(law or ()))
    J = rough.J * (first / comparison.sigma)[:, None]
    for parameter in (MESH, LAW):
        if parameter.key in comparison.directions:
            parameters = (*parameters, parameter)
            J = np.column_stack([J, comparison.directions[parameter.key] / comparison.sigma])
    return fit_parameters(comparison, rough.point, parameters, J, progress=progress)


def most_simulations(parameters: Sequence[FitParameter], repeats: int) -> int:
    """Most simulations of a re-calibration, of as many `repeats` of it, and of `far_places`."""
    columns = len({replace(k, trend="").name for k in parameters})
    bearings = len({k.key.split(".")[1] for k in parameters if k.key.startswith("bearing.")})
    few, many = columns + FEW_STEPS * len(LENGTHS), MOST_STEPS * len(LENGTHS)
    begin = STEPS + 2 * FINER + few + MOST_REPEATS * (columns + many) + many
    return begin + repeats * few + (1 + bearings) * (bearings > 1) * (2 * (many + few) + columns)


def null_vectors(there: ParameterFit, parameters: Sequence[FitParameter]) -> list[dict[str, float]]:
    """Combinations of calibration parameters that the records do not determine; Jacobian at the point."""
    free = [k for k in parameters if not k.trend and k not in (MESH, LAW)]
    return singular_directions(there.J[:, [there.parameters.index(k) for k in free]], free)


def closer(comparison: TwinComparison, rough: ParameterFit, progress: Callable[[], None]) -> ParameterFit:
    """Continue a fit that ended far from the records with new Jacobians, as long as the misfit falls."""
    for _ in range(MOST_REPEATS):
        if not flagged(table(comparison, rough.residual)):
            break
        J = comparison.jacobian(rough.point, rough.parameters, progress=progress)
        again = fit_parameters(comparison, rough.point, rough.parameters, J, rough.residual, progress=progress)
        enough = again.cost > 0.9 * rough.cost
        rough = again
        if enough:
            break
    return rough


def strained(base: ParameterFit, natural: float = NATURAL) -> list[str]:
    """Names of the machine's calibration parameters that a fit has moved to their limits or beyond their priors.

    Not the sensors' zeros and the injectors' law, nor trends, nor what stands at an end within `natural` deviations of
    its prior: a bearing that has lost its damping counts all the same, and so does a multiple of the solver's error.
    """
    found = []
    for parameter, value in zip(base.parameters, base.vector, strict=True):
        if parameter.trend or (parameter.key in DIRECTIONS and parameter != MESH):
            continue
        at_limit = (value <= parameter.low or value >= parameter.high) and abs(value) > natural * parameter.sd
        undamped = value <= parameter.low and parameter.key.startswith("bearing.") and ".c" in parameter.key
        if at_limit or undamped or abs(value) > IMPLAUSIBLE * parameter.sd:
            found.append(parameter.name)
    return found


def relinearised(
    comparison: TwinComparison, base: ParameterFit, progress: Callable[[], None] = lambda: None
) -> ParameterFit:
    """Repeat a fit with the Jacobian at its own solution."""
    J = comparison.jacobian(base.point, base.parameters, progress=progress)
    return fit_parameters(comparison, base.point, base.parameters, J, base.residual, steps=FEW_STEPS, progress=progress)


def far_places(
    comparison: TwinComparison, base: ParameterFit, progress: Callable[[], None] = lambda: None
) -> list[tuple[str, ParameterFit]]:
    """Fits with one bearing far from the machine file that the records do not distinguish, the best first.

    Each comes with the bearing's number, as text. None where no bearing leaves its prior, where bearings near the file
    fit as well, or where lines stay flagged. Nothing is fitted where no bearing moves such lines, nor where none is
    flagged and the tangent does not promise half of the fall that it takes.
    """
    own = [k.key.startswith("bearing.") for k in base.parameters]
    numbers = list(dict.fromkeys(k.key.split(".")[1] for k, mine in zip(base.parameters, own, strict=True) if mine))
    away = any(mine and abs(v) > k.sd for mine, k, v in zip(own, base.parameters, base.vector, strict=True))
    flags = flagged(table(comparison, base.residual))
    if len(numbers) < 2 or not (away or flags):
        return []
    moved = {(f.number, f.channel, f.group): f.chi2 for f in table(comparison, np.linalg.norm(base.J[:, own], axis=1))}
    if any(f.excess > MOST_MOVED**2 * moved[f.number, f.channel, f.group] for f in flags):
        return []
    foreseen_near, *ahead = (foreseen(base, _with_prior(base.parameters, number))(0.0) for number in ("", *numbers))
    if not flags and min(ahead) > foreseen_near - ONE_FAR / 2:
        return []
    near, *fits = (_with_far(comparison, base, number, progress) for number in ("", *numbers))
    found = sorted(zip(numbers, fits, strict=True), key=lambda one: one[1].cost)
    best = found[0][1]
    if best.cost > near.cost - ONE_FAR or flagged(table(comparison, best.residual)):
        return []
    return [(number, fit) for number, fit in found if fit.cost < best.cost + AS_FAR]


def far_off_file(fit: ParameterFit, far: str) -> list[str]:
    """Names of the numbers of its `far` bearing, by its number as text, that a fit of `far_places` has off the file.

    A loss counts where the damping, (1 + loss) / (1 - compliance)^2 of that of the file, differs as well. The number
    that is furthest off is always named; without a far bearing none is.
    """
    values = {k.key: v for k, v in zip(fit.parameters, fit.vector, strict=True)}
    off = dict[str, float]()
    for k in fit.parameters:
        if not (far and k.key.startswith(f"bearing.{far}.")):
            continue
        change, what = values[k.key], k.key.split(".")[2]
        if what[0] == "c":
            damping = (1 + change) / (1 - values[k.key.replace(".c", ".k")]) ** 2
            change = min(abs(change), abs(damping - 1))
        off[k.name] = abs(change) / (NEAR if what[0] == "k" else LOSS_SD)
    least = min(1.0, max(off.values(), default=0.0))
    return [name for name, share in off.items() if share >= least]


def _with_prior(parameters: Iterable[FitParameter], far: str) -> tuple[FitParameter, ...]:
    """Parameters with the priors of a machine whose bearing `far`, by its number as text, may be far from the file."""

    def own(k: FitParameter) -> FitParameter:
        _, number, what = k.key.split(".") if k.key.startswith("bearing.") else ("", "", k.key)
        if number and number == far:
            return replace(k, sd=FAR[what[0]])
        return replace(k, sd=NEAR if number and what[0] == "k" else SHAFT if what == KEY else k.sd)

    return tuple(map(own, parameters))


def foreseen(fit: ParameterFit, parameters: Sequence[FitParameter]) -> Callable[[np.ndarray | float], float]:
    """Sum of squares with the priors of `parameters` that a fit reaches by its tangent, of a shift of its residual.

    A shift is 0, or (n,) in floors, as of other readings.
    """
    p = prior_rows(parameters)
    A = np.vstack([fit.J, np.diag(p)])
    size = np.linalg.norm(A, axis=0)
    U, s, _ = answer(np.linalg.svd, A / np.where(size > 0, size, 1.0), full_matrices=False)
    U = U[:, s > 1e-12 * s[0]]

    def cost(shift: np.ndarray | float) -> float:
        wanted = np.append(fit.residual + shift, -p * fit.vector)
        return float(np.sum((wanted - U @ (U.T @ wanted)) ** 2))

    return cost


def _with_far(comparison: TwinComparison, base: ParameterFit, far: str, progress: Callable[[], None]) -> ParameterFit:
    """Fit with one bearing, by its number as text, far from the file and the others near it, the better of two.

    One starts at the calibration, which may have moved what is sound; the other begins with shaft and bearings of
    the file, the far one at the multiple of its stiffness that leaves least, with its damping: without any a resonance
    among the records is many times too high, and no fit comes back from there.
    """

    parameters = _with_prior(base.parameters, far)
    point = replace(base.point, values=dict(zip(parameters, map(float, base.vector), strict=True)))
    first = fit_parameters(comparison, point, parameters, base.J, base.residual, progress=progress)
    from_calibration = relinearised(comparison, first, progress)
    own = [k for k in parameters if far and k.key.startswith(f"bearing.{far}.")]
    kept = {k: v for k, v in point.values.items() if not (k.key.startswith("bearing.") or k.key == KEY)}
    starts = [
        # k / (1 - s) is so many times that of the file, and c (1 + l) / (1 - s)^2 is that of the file
        replace(base.point, values=kept | {k: 1 - 1 / n if ".k" in k.key else 1 / n**2 - 1 for k in own})
        for n in (TIMES if own else (1.0,))
    ]
    residuals = [comparison.residual(start) for start in starts]
    begin, residual = min(zip(starts, residuals, strict=True), key=lambda one: float(one[1] @ one[1]))
    J = comparison.jacobian(begin, parameters, progress=progress)
    anew = fit_parameters(comparison, begin, parameters, J, residual, progress=progress)
    from_file = relinearised(comparison, anew, progress)
    return min(from_calibration, from_file, key=lambda fit: fit.cost)
