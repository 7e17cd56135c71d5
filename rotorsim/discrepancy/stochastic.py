r"""Motions that do not repeat: a random force at a place, a line between orders, a speed that wanders, drifts.

A force that repeats with no period leaves the blocks of a record apart. Their deviations d from their mean have

.. math:: E[d\,d'] = \sigma^2 I + H(\omega)\,\mathrm{diag}(S_x, S_y)\,H(\omega)'

with the noise sigma of each channel, the receptance H from a place and the spectrum S of the force there, flat or that
of one line at a share of the speed. The noise is a smooth function of the frequency, with a size of its own in each
record. S, sigma and the place follow from Whittle's likelihood over all records and lines away from the orders. Between
records that repeat each other a number of the machine may have changed: their difference is a step along the
sensitivities of one part of it. Records have no time: the steps' sizes are known, not their senses. A law is known from
a drift by what it explains where the numbers of that part may differ from record to record.

Where the speed wanders, the shaft is ahead of its mean by an angle phi in a block, or behind: the lines q of both
probes at 1X then move along one direction of all, i phi q, by which it is known from forces.

What is compared of two records is what the calibration leaves of each: their speeds may differ a little.

Assumes: a force whose x and y are not related; noise that changes little within an octave. Source: Whittle (1953).

Cites: whittle_1953.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.optimize import fmin_l_bfgs_b
from scipy.special import polygamma, psi

from rotorsim.base.errors import NoAnswerError
from rotorsim.base.rounding import answer
from rotorsim.discrepancy.comparison import Misfit, TwinComparison, between_orders, flagged, table
from rotorsim.discrepancy.fit import ParameterFit, prior_rows
from rotorsim.discrepancy.law_terms import ObservedPlaces, law_places
from rotorsim.discrepancy.trial import Trial, one_speed
from rotorsim.discrepancy.twin import Twin

CLEAR_GAIN = 100.0
"""Twice the gain in log-likelihood from which on a random force is stated."""
SURELY = 4.0
"""Standard deviations beyond what chance makes from which on lines at 1X move along themselves too."""
WHOLE_TURNS = 0.02
"""Distance of 1X to a line of a block, in lines, up to which the block holds whole turns."""
OF_CHANCE = 0.5
"""Mean gain of a record in which nothing wanders, as its variances are known by few numbers: 0.4 to 0.5."""
AROUND = 4
"""Lines on each side of 1X whose scatter across q is that of the noise there: those of a wander are along q."""
SAME_PLACE = 6.0
"""Twice the difference in log-likelihood within which places are not distinguished."""
LOUD = 5.0
"""Power of a line over that of its neighbours, in the mean of the records, from which on it is one."""
KNOTS = 6
"""Frequencies, evenly apart on a logarithmic axis, between which the logarithm of the noise is taken to be straight."""
NOISE_FREE = 12.0
"""Most change of the logarithm of the noise at such a frequency, and in a record."""
NOISE_OFF = 0.2
"""Relative change of the noise's variance that is allowed next to a line."""
OF_LINE = 0.05
"""The same of a line, as a share of its gain."""
ORDERS = np.arange(0.2, 0.95, 0.01)
"""Shares of the speed at which a line is looked for."""
NEAR_LINE = 1.6
"""Distance to a line, in lines of a block, within which its force is taken to lie."""
OFF = 3.0
"""Mean of records that repeat each other over its standard deviation by their differences, up to which it is chance: as
the mean square's share of both, over all records, for the difference of two alone is often small."""
CHANGED = 1.5
"""Mean square of the difference of records that repeat each other, in that of their blocks, from which on it counts."""
CHANGES = {".me~": "the unbalance [kg m]", ".k": "the relative compliance", ".c": "the relative loss"}
"""Words for numbers of the calibration, by a part of their keys."""
ONE_PLACE = 1e-6
"""Distance [m] within which two places are one."""
TURNING_PART = "unbalance"
"""Beginning of the keys of a part that turns with the shaft."""
PARTS = ("bearing", TURNING_PART, "shaft_stiffness", "shaft_damping")
"""Beginnings of the calibration's keys whose numbers may drift."""


@dataclass(frozen=True)
class StochasticForce:
    """A force or a change that does not repeat, with its place.

    kind : 'broadband force', 'line', 'drift' or 'speed wander'
    place : disc, bearing or part; `others` cannot be distinguished from it
    size, sd : of a broadband force [N/sqrt(Hz)] and of a line [N rms] along x and y; of a drift the change of `what`,
        root mean square over records that repeat each other; of a speed that wanders the shaft's angle [rad rms]
    order : share of the speed of a line, 0 without one
    gain : twice the gain in log-likelihood against none
    """

    kind: str
    place: str
    others: tuple[str, ...]
    size: tuple[float, float]
    sd: tuple[float, float]
    unit: str
    gain: float
    order: float = 0.0
    what: str = ""
    """Number of the machine that drifts."""

    @property
    def sentence(self) -> str:
        """Kind, place and size in one sentence."""
        if self.kind == "drift":
            others = f" (or {', '.join(self.others)})" if self.others else ""
            return (
                f"drift at {self.place}{others}, {self.what} changes by {self.size[0]:.3g} +- {self.sd[0]:.2g} (root "
                "mean square) between records that repeat each other"
            )
        if self.kind == "speed wander":
            size, sd = np.degrees([self.size[0], self.sd[0]])
            return (
                f"speed wander: the shaft's angle at 1X scatters by {size:.3g} +- {sd:.2g} deg rms between blocks, as "
                "where the speed wanders or the clock of the angle jitters"
            )
        sizes = " and ".join(f"{value:.3g} +- {sd:.2g}" for value, sd in zip(self.size, self.sd, strict=True))
        at = f" at {self.order:.2f} of the speed" if self.order else ""
        others = f" (or {', '.join(self.others)})" if self.others else ""
        return f"{self.kind}{at}, {self.place}{others}, {sizes} {self.unit} along x and y"


@dataclass(frozen=True, eq=False)
class BlockDeviations:
    """Outer products W (2, 2, k) of the blocks' deviations [m^2] and their number by record, on quiet lines (k,).

    `numbers` are those of the records in their comparison.
    """

    numbers: list[int]
    trials: list[Trial]
    W: list[np.ndarray]
    freedom: list[int]
    lines: list[np.ndarray]

    @classmethod
    def of(cls, trials: Sequence[Trial]) -> BlockDeviations:
        """BlockDeviations of all records with at least two blocks that repeat, by their own mean."""
        numbers = [i for i, t in enumerate(trials) if t.periodic and t.blocks > 1 and t.probe_angle is None]
        numbers = [i for i in numbers if between_orders(trials[i]).any()]
        own = [trials[i] for i in numbers]
        kept = [np.flatnonzero(between_orders(t)) for t in own]
        apart = [(t.spectra - t.spectra.mean(axis=0))[:, :, k] for t, k in zip(own, kept, strict=True)]
        return cls(
            numbers, own, [np.einsum("bik,bjk->ijk", d, d.conj()) for d in apart], [len(d) - 1 for d in apart], kept
        )

    def noise(self) -> float:
        """Variance of a line by the quiet half of all lines, over the distance between lines [m^2/Hz]."""
        each = [np.einsum("iik->k", w).real / (2 * n * t.frequencies[1])
                for w, n, t in zip(self.W, self.freedom, self.trials, strict=True)]  # fmt: skip
        return float(np.median(np.concatenate(each)))

    def shapes(self) -> list[np.ndarray]:
        """Straight pieces over log frequency by record (KNOTS + records, k), and ones for the record's own size."""
        f = [np.log(t.frequencies[k]) for t, k in zip(self.trials, self.lines, strict=True)]
        knots = np.linspace(min(map(np.min, f)), max(map(np.max, f)) + 1e-9, KNOTS)
        hats = [np.array([np.interp(one, knots, row) for row in np.eye(KNOTS)]) for one in f]
        sizes = np.eye(len(f))
        return [np.vstack([hat, np.tile(sizes[:, [i]], hat.shape[1])]) for i, hat in enumerate(hats)]

    def loss(
        self, noise: Sequence[np.ndarray], forces: Sequence[np.ndarray], S: np.ndarray, chosen: Sequence[np.ndarray]
    ) -> tuple[float, np.ndarray, list[np.ndarray]]:
        """Minus twice the log-likelihood on chosen lines, and its slopes by log S (2,) and by log noise (2, k).

        `noise` (2, k) [m^2] and `forces`, the responses (2, 2, 2, k) to spectra of one along x and y, are by record.
        """
        total, by_force, by_noise = 0.0, np.zeros(2), []
        for W, n, N, outer, own in zip(self.W, self.freedom, noise, forces, chosen, strict=True):
            (x, y), P = outer, S[0] * outer[0] + S[1] * outer[1]
            a, d, b = P[0, 0].real + N[0], P[1, 1].real + N[1], P[0, 1]
            # not a d - |b|^2, which next to a large force is the rounding of both
            of_forces = np.maximum((x[0, 0] * y[1, 1] + x[1, 1] * y[0, 0] - 2 * x[0, 1] * y[0, 1].conj()).real, 0.0)
            det = N[0] * N[1] + P[0, 0].real * N[1] + P[1, 1].real * N[0] + S[0] * S[1] * of_forces
            V = np.array([[d, -b], [-b.conj(), a]]) / det
            VW = np.einsum("abk,bck->ack", V, W)
            G = n * V - np.einsum("abk,bck->ack", VW, V)
            total += 2 * float(np.sum((n * np.log(det) + np.einsum("aak->k", VW).real)[own]))
            by_force += 2 * S * np.einsum("abk,ibak->ik", G, outer).real[:, own].sum(axis=1)
            by_noise.append(2 * N * np.array([G[0, 0].real, G[1, 1].real]) * own)
        return total, by_force, by_noise


@dataclass(frozen=True, eq=False)
class NoiseModel:
    """Noise by record (2, k) [m^2]: a first guess times the exponential of shapes (m, k) times numbers (2 m,)."""

    first: list[np.ndarray]
    shapes: list[np.ndarray]
    limit: float

    def at(self, x: np.ndarray) -> list[np.ndarray]:
        """The noise with these numbers."""
        pairs = zip(self.first, self.shapes, strict=True)
        return [first * np.exp(x.reshape(2, -1) @ shape) for first, shape in pairs]

    def fitted(
        self, own: BlockDeviations, forces: Sequence[np.ndarray], chosen: Sequence[np.ndarray], start: np.ndarray,
        scale: float = 0.0,
    ) -> tuple[np.ndarray, float, Callable[[np.ndarray], tuple[float, np.ndarray]]]:  # fmt: skip
        """Point of the least loss, log (S / scale) (2,) and the noise's numbers; its value there; the loss itself.

        Without a scale there is no force.
        """

        def loss(x: np.ndarray) -> tuple[float, np.ndarray]:
            value, by_force, by_noise = own.loss(self.at(x[2:]), forces, scale * np.exp(x[:2]), chosen)
            slopes = sum(one @ shape.T for one, shape in zip(by_noise, self.shapes, strict=True))
            return value, np.concatenate([by_force, np.ravel(slopes)])

        bounds = [(-20.0, 20.0)] * 2 + [(-self.limit, self.limit)] * (len(start) - 2)
        x, least, _ = fmin_l_bfgs_b(loss, start, bounds=bounds)
        return np.asarray(x), float(least), loss


def random_force(seen: ObservedPlaces) -> StochasticForce | None:
    """The random force that the scatter between blocks shows; None where smooth noise of the probes is all of it."""
    own = BlockDeviations.of(seen.comparison.trials)
    if not own.trials:
        return None
    quiet, every = own.noise(), [np.ones(len(k), bool) for k in own.lines]
    apart = [t.frequencies[1] for t in own.trials]
    H = {name: [m[i].H[k] for i, k in zip(own.numbers, own.lines, strict=True)] for name, m in seen.motions.items()}
    nothing = [np.zeros((2, 2, 2, len(k))) for k in own.lines]
    shapes = own.shapes()
    first = [np.full((2, len(k)), quiet * df) for k, df in zip(own.lines, apart, strict=True)]
    smooth = NoiseModel(first, shapes, NOISE_FREE)
    silent, least, _ = smooth.fitted(own, nothing, every, np.zeros(2 + 2 * len(shapes[0])))
    order = _line_order(own, smooth.at(silent[2:]))
    kind, chosen = "broadband force", every
    if order:
        kind = "line"
        chosen = [np.abs(t.frequencies[k] - order * abs(t.speed) / (2 * np.pi)) < NEAR_LINE * df
                  for t, k, df in zip(own.trials, own.lines, apart, strict=True)]  # fmt: skip
    noise = smooth
    if order:  # the noise is that of the other lines: next to a line alone it would explain it
        silent, _, _ = smooth.fitted(own, nothing, [~one for one in chosen], silent)
        noise = NoiseModel(smooth.at(silent[2:]), [np.ones((1, len(k))) for k in own.lines], NOISE_OFF)
        silent, least, _ = noise.fitted(own, nothing, chosen, np.zeros(4))

    def fitted(place: str) -> tuple[float, np.ndarray, np.ndarray]:
        """Twice the gain by a force at a place, log S (2,) and its standard deviations."""
        outer = [np.einsum("kia,kja->aijk", h, h.conj()) * c * _of_a_line(df, order)
                 for h, c, df in zip(H[place], chosen, apart, strict=True)]  # fmt: skip
        seen_of_one = [np.abs(o).max(axis=(0, 1, 2)) / df for o, df in zip(outer, apart, strict=True)]
        scale = quiet / max(float(np.mean(np.concatenate(seen_of_one))), 1e-300)
        tried = [noise.fitted(own, outer, chosen, np.array([s, s, *silent[2:]]), scale) for s in (-3.0, 1.0)]
        x, best, loss = min(tried, key=lambda one: one[1])
        h, bend = 0.05, np.zeros(2)
        for i in (0, 1):
            step = np.zeros(len(x))
            step[i] = h
            bend[i] = (loss(x + step)[1][i] - loss(x - step)[1][i]) / h / 4
        return least - best, np.log(scale) + x[:2], 1 / np.sqrt(np.maximum(bend, 1e-6))

    fits = {place: fitted(place) for place in H}
    place = max(fits, key=lambda name: fits[name][0])
    gain, log_s, sd = fits[place]
    if gain < CLEAR_GAIN:
        return None
    # a line leaks into its neighbours, which is not modelled
    near = max(SAME_PLACE, OF_LINE * gain) if order else SAME_PLACE
    others = tuple(name for name in fits if name != place and fits[name][0] > gain - near)
    size = np.sqrt(np.exp(log_s))
    of_size, unit = size * sd / 2, "N rms" if order else "N/sqrt(Hz)"
    return StochasticForce(kind, place, others, (float(size[0]), float(size[1])),
                           (float(of_size[0]), float(of_size[1])), unit, gain, order)  # fmt: skip


def wandering_speed(trials: Sequence[Trial]) -> StochasticForce | None:
    """The angle of the shaft that scatters between blocks, by the lines at 1X; None where they move otherwise.

    Twice the gain in log-likelihood is that of a variance along i q of its own over one variance of q and i q. An angle
    phi moves a line along q by phi^2 / 2 of it alone, and not with i q: a force, a stiffness or one probe that changes
    moves it along both.
    """
    gain, bent, expected, variance, excess, freedom = np.zeros(6)
    found = list[tuple[int, float, float]]()
    for t in trials:
        turns = abs(t.speed) / (2 * np.pi * t.frequencies[1])
        k, n = round(turns), t.blocks - 1
        if not t.periodic or n < 2 or t.orders or not 0 < k < len(t.frequencies) or abs(turns - k) > WHOLE_TURNS:
            continue
        lines = t.spectra[:, : len(t.channels), k]
        q, m = lines.mean(axis=0), 2 * lines.shape[1]
        if m < 4 or not (size := float(np.linalg.norm(q))):
            continue
        d = lines - q
        turned = d @ (q / size).conj()
        S = np.cov(np.array([turned.imag, turned.real]))
        around = np.arange(max(k - AROUND, 1), min(k + AROUND + 1, len(t.frequencies)))
        order = np.round(around / k)
        near = t.spectra[:, : len(t.channels), around[(order < 2) | (np.abs(around - order * k) > 1)]]
        near = near - near.mean(axis=0)
        across = near - (q / size)[:, None] * ((q / size).conj() @ near)[:, None]
        rest = max(float(np.sum(np.abs(across) ** 2)), 1e-300) / (n * near.shape[2] * (m - 2))
        most = rest + 2 * (S[0, 0] / size) ** 2  # the angle wanders within a block too
        along_q = min(max(S[1, 1], rest / 2), most)
        gain += n * (2 * np.log(np.trace(S) / 2) + 1 - np.log(S[0, 0] * along_q) - S[1, 1] / along_q) - OF_CHANCE
        bent -= n * np.log1p(-min(S[0, 1] ** 2 / (S[0, 0] * S[1, 1]), 1 - 1e-12))
        expected += n * (psi(n / 2) - psi((n - 1) / 2))
        variance += n**2 * (polygamma(1, (n - 1) / 2) - polygamma(1, n / 2))
        excess, freedom = excess + n * S[1, 1] / most, freedom + n
        found.append((n, S[0, 0] / size**2, rest / size**2))
    if gain < CLEAR_GAIN or bent > expected + SURELY * np.sqrt(variance) or excess > 2 * freedom:
        return None
    angle, sd = _common_angle(found)
    return StochasticForce("speed wander", "the shaft's angle", (), (angle, angle), (sd, sd), "rad rms", float(gain))


def _common_angle(found: Sequence[tuple[int, float, float]]) -> tuple[float, float]:
    """Angle [rad rms] and its standard deviation by degrees of freedom n, variances along i q and of others, over q^2.

    Records are weighted by the variance of what each shows.
    """
    n, along, others = np.array(found).T
    square = float(np.median(np.maximum(along - others, 0.0)))
    for _ in range(20):
        weight = n / (2 * (square + others) ** 2)
        square = max(float(weight @ (along - others) / weight.sum()), 1e-300)
    return float(np.sqrt(square)), float(1 / np.sqrt(weight.sum()) / (2 * np.sqrt(square)))


def _of_a_line(df: float, order: float) -> float:
    """Variance [N^2] of a line, where lines are `df` [Hz] apart, by a force of size one: broadband, or at an order."""
    return 1 / NEAR_LINE if order else 2 * df


def _leak(x: np.ndarray) -> np.ndarray:
    """Most of sinc^2 at x or beyond."""
    return np.asarray(np.maximum(np.pi * x, 1.0) ** -2)


def by_chance(force: StochasticForce, seen: ObservedPlaces) -> np.ndarray:
    """Standard deviations (n,) [m] of the means over blocks in a data vector that a random force makes by chance.

    A line of a block has the variance H S H', of which half is its real part's, and a mean a quarter; blocks are taken
    to be independent. A narrow force at an order leaks into lines x away, of a block or of all blocks together, with
    sinc^2 of x at most: its mean is at most the larger of both.
    """
    comparison = seen.comparison
    found = np.zeros(len(comparison.measured))
    for i, m in enumerate(seen.motions.get(force.place, [])):
        trial, f = comparison.trials[i], m.frequencies
        H, S, share = m.H, np.square(force.size), np.full(len(f), 2 * f[1] / trial.blocks)
        if force.order:
            turns = abs(trial.speed) / (2 * np.pi)
            x = np.maximum(np.abs(f - force.order * turns) - np.diff(ORDERS)[0] * turns / 2, 0.0) / f[1]
            share = 2 * np.maximum(_leak(x) / trial.blocks, _leak(trial.blocks * x))
            H = m.H[np.argmin(x)]
        sd = np.sqrt(np.abs(H) ** 2 @ S * share[:, None] / 2)
        sd[0] /= np.sqrt(2)
        found[comparison.layout.record == i] = trial.vector(sd.T[None] * (1 + 1j))
    drifts = np.flatnonzero(comparison.layout.drift)  # from the first block to the last, each next to its mean
    blocks = np.array([t.blocks for t in comparison.trials])[comparison.layout.record[drifts]]
    found[drifts] = found[drifts - 1] * np.sqrt(2 * blocks)
    return found


def repeating(comparison: TwinComparison, residual: np.ndarray, chance: np.ndarray | float = 0.0) -> list[Misfit]:
    """Groups of lines beyond the floor in the mean of the records that repeat each other: a gap that repeats.

    The floor has the standard deviations `chance` (n,) [m] of a random force too. Not those groups whose records differ
    by more than the floor and, over all records, by as much as their mean is off.
    """
    residual = residual * comparison.sigma / np.hypot(comparison.sigma, chance)
    record, mean, spread = comparison.layout.record, residual.copy(), np.zeros(len(residual))
    firsts = np.array(comparison.repeated)
    for first in np.unique(firsts):
        rows = [np.flatnonzero(record == i) for i in np.flatnonzero(firsts == first)]
        if len(rows) > 1 and len({len(row) for row in rows}) == 1:
            own = np.array([residual[row] for row in rows])
            mean[np.concatenate(rows)] = np.tile(own.mean(axis=0), len(rows))
            spread[np.concatenate(rows)] = np.tile(own.std(axis=0, ddof=1) / np.sqrt(len(rows)), len(rows))
    apart = {(f.number, f.channel, f.group): f.rms for f in table(comparison, spread) if f.rms > f.floor}
    shares = dict[tuple[str, str], list[float]]()
    for f in table(comparison, mean):
        if (own_spread := apart.get((f.number, f.channel, f.group))) is not None:
            shares.setdefault((f.channel, f.group), []).append(f.rms**2 / (f.rms**2 + own_spread**2))
    alike = {group for group, found in shares.items() if np.mean(found) < OFF**2 / (1 + OFF**2)}
    return [
        f
        for f in flagged(table(comparison, mean))
        if (f.number, f.channel, f.group) not in apart or (f.channel, f.group) not in alike
    ]


def _line_order(own: BlockDeviations, noise: Sequence[np.ndarray]) -> float:
    """Share of the speed at which most records show a line that does not repeat; 0 where none does.

    It stands out of the `noise` (2, k) [m^2] by record, and of its neighbours on both sides.
    """
    if one_speed(own.trials):
        return 0.0
    scores = np.zeros(len(ORDERS))
    for t, k, W, n, N in zip(own.trials, own.lines, own.W, own.freedom, noise, strict=True):
        f, power = t.frequencies[k], np.mean(np.einsum("iik->ik", W).real / N, axis=0) / n
        for i, order in enumerate(ORDERS):
            apart = (f - order * abs(t.speed) / (2 * np.pi)) / t.frequencies[1]
            sides = [(side * apart > NEAR_LINE) & (side * apart < 5 * NEAR_LINE) for side in (-1, 1)]
            if np.abs(apart).min() < 1.0 and all(side.any() for side in sides):
                there = float(power @ np.maximum(1.0 - np.abs(apart), 0.0))
                scores[i] += np.log(max(there / max(float(np.median(power[side])) for side in sides), 1.0))
    best = int(np.argmax(scores))
    return float(ORDERS[best]) if scores[best] > np.log(LOUD) * len(own.trials) else 0.0


@dataclass(frozen=True, eq=False)
class NotRepeated:
    """Force and drift that do not repeat in the records of a fit, each found when it is first asked for.

    None where there is none, and where the search for it has no answer.
    """

    fit: ParameterFit
    seen: ObservedPlaces

    @cached_property
    def force(self) -> StochasticForce | None:
        """The random force."""
        try:
            return random_force(self.seen)
        except NoAnswerError:
            return None

    @cached_property
    def chance(self) -> np.ndarray:
        """Standard deviations (n,) [m] that the random force gives the means over blocks."""
        return self._chance_in(self.seen)

    def _chance_in(self, seen: ObservedPlaces) -> np.ndarray:
        return np.zeros(len(seen.residual)) if self.force is None else by_chance(self.force, seen)

    @cached_property
    def drift(self) -> tuple[str, StochasticForce, np.ndarray] | None:
        """Beginning of the keys of the part that drifts, the drift, which is more than the force makes by chance, and
        the changes of the part's numbers.

        Without chance there is more of it: where it is none then the force need not be known.
        """
        comparison = self.seen.comparison
        try:
            alone = drift(comparison, self.fit, np.zeros(len(self.fit.residual)))
            return alone and drift(comparison, self.fit, self.chance)
        except NoAnswerError:
            return None

    @cached_property
    def wander(self) -> StochasticForce | None:
        """The speed that wanders."""
        return wandering_speed(self.seen.comparison.trials)

    @property
    def repeating(self) -> list[Misfit]:
        """Groups of lines whose gap repeats, next to the force and to a drift."""
        return repeating(self.seen.comparison, self.left, self.chance)

    def repeating_in(self, others: ObservedPlaces) -> list[Misfit]:
        """Groups of lines of records that were not fitted whose gap repeats, next to the force."""
        return repeating(others.comparison, others.residual, self._chance_in(others))

    @property
    def left(self) -> np.ndarray:
        """Whitened residual (n,) of the calibration solved once more, next to what does not repeat in each record."""
        fit, own = self.fit, list[np.ndarray]()
        if self.drift is not None:
            part, _, changes = self.drift
            own.append(fit.J[:, _parts(fit)[part]] @ changes)
        if self.wander is not None:
            own.append(sidebands(self.wander, self.seen.comparison))
        return fit.residual if self.force is None and not own else next_to(self.seen, fit, own, self.chance)

    @property
    def found(self) -> tuple[StochasticForce, ...]:
        """The speed that wanders, the drift and the random force, as far as there are any.

        Where the speed wanders, the phase of 1X differs between records as if an unbalance moved.
        """
        moved = self.drift and self.drift[1]
        if self.drift and self.wander and self.drift[0].startswith(TURNING_PART):
            moved = None
        return tuple(one for one in (self.wander, moved, self.force) if one is not None)

    def beyond_drift(self, columns: np.ndarray) -> float:
        """Fall of the sum of squares by columns (n, k) next to a drift; infinite without one."""
        return np.inf if self.drift is None else fall_next_to_drift(self.seen, self.fit, self.drift[0], columns)


def drift(
    comparison: TwinComparison, fit: ParameterFit, chance: np.ndarray
) -> tuple[str, StochasticForce, np.ndarray] | None:  # fmt: skip
    """The part of the machine, by its keys, whose numbers have changed between records that repeat each other.

    None for none. With the changes (k, pairs) of the part's k numbers, whose outer products add up to the covariance of
    these numbers in a record. What a fit leaves of the records' means differs by the scatter between blocks, and by the
    standard deviations `chance` (n,) [m] of a random force. Only records that begin at one angle of the shaft are
    compared: at another one what is missing in the model turns with it, as if it had changed.
    """
    trials, own, same = comparison.trials, BlockDeviations.of(comparison.trials), comparison.repeated
    pairs = [(i, j) for i, j in combinations(range(len(trials)), 2) if same[i] == same[j]]
    if not pairs or not own.trials:
        return None
    density, left, layout = own.noise(), fit.residual * comparison.sigma, comparison.layout
    steps, columns = [], []
    for i, j in pairs:
        at, other = (np.flatnonzero((layout.record == n) & (layout.frequency > 0)) for n in (i, j))
        if len(at) != len(other):
            continue
        noise = density * trials[i].frequencies[1] * (1 / trials[i].blocks + 1 / trials[j].blocks) / 2
        sigma = np.sqrt(noise + chance[at] ** 2 + chance[other] ** 2)
        steps.append((left[other] - left[at]) / sigma)
        columns.append(fit.J[at] * (comparison.sigma[at] / sigma)[:, None])
    whole = sum(float(d @ d) for d in steps)
    count = sum(len(d) for d in steps)
    if whole < CHANGED * count and whole - count < CLEAR_GAIN + 6 * np.sqrt(2 * count):
        return None
    found: dict[str, tuple[float, np.ndarray, np.ndarray]] = {}
    parts = _parts(fit)
    for part, own_columns in parts.items():
        gain, values, spread = 0.0, list[np.ndarray](), list[np.ndarray]()
        for d, J in zip(steps, columns, strict=True):
            A = J[:, own_columns]
            x = answer(np.linalg.lstsq, A, d, rcond=1e-9)[0]
            gain += float(d @ d - np.sum((d - A @ x) ** 2)) - 2.0 * len(x)
            values.append(x)
            spread.append(np.diag(answer(np.linalg.pinv, A.T @ A)))
        found[part] = gain, np.array(values), np.array(spread)
    if not found:
        return None
    part = max(found, key=lambda name: found[name][0])
    gain, changed, variances = found[part]
    if gain < CLEAR_GAIN or gain < 0.5 * (whole - count):
        return None
    near = (name for name in found if name != part and found[name][0] > gain - SAME_PLACE)
    others = tuple(part_name(comparison.twin, name) for name in near)
    columns_of = parts[part]
    shown = np.abs(changed).mean(axis=0) * np.linalg.norm(fit.J[:, columns_of], axis=0)
    most, key = int(np.argmax(shown)), fit.parameters[columns_of[int(np.argmax(shown))]].key
    step, own_variance = changed[:, most], variances[:, most]
    size = float(np.sqrt(np.mean(step**2)))
    sd = float(np.sqrt(step**2 @ own_variance) / len(step) / size)
    what = next((word for end, word in CHANGES.items() if end in key), key)
    place = part_name(comparison.twin, part)
    changes = changed.T / np.sqrt(2 * len(changed))
    return part, StochasticForce("drift", place, others, (size, size), (sd, sd), "", gain, what=what), changes


def next_to(
    seen: ObservedPlaces, fit: ParameterFit, own: Sequence[np.ndarray], chance: np.ndarray | float = 0.0
) -> np.ndarray:  # fmt: skip
    """Whitened residual (n,) of a calibration that is solved together with numbers of size one of each record.

    Columns of `own` (n, k) are what the numbers make of the data; the random force's standard deviations `chance` (n,)
    [m] weigh the lines. Without both, what does not repeat leads the calibration astray, which shows in all records.
    One number that drifts moves all lines of a record together: no scatter of single lines stands for it.
    """
    p, weight = prior_rows(fit.parameters), seen.comparison.sigma / np.hypot(seen.comparison.sigma, chance)
    X = np.column_stack([seen.J, *_each(seen, own)])
    prior = np.concatenate([p, np.ones(X.shape[1] - len(p))])
    A = np.vstack([weight[:, None] * X, np.diag(prior)])
    size = np.maximum(np.linalg.norm(A, axis=0), 1e-300)
    b = np.concatenate([weight * fit.residual, -p * fit.vector, np.zeros(len(prior) - len(p))])
    return np.asarray(fit.residual - X @ (answer(np.linalg.lstsq, A / size, b, rcond=1e-9)[0] / size))


def _each(seen: ObservedPlaces, own: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Columns (n, k) of numbers that each record has by itself."""
    record = seen.comparison.layout.record
    return [np.where((record == i)[:, None], columns, 0.0) for columns in own for i in np.unique(record)]


def sidebands(wander: StochasticForce, comparison: TwinComparison) -> np.ndarray:
    """Whitened data (n, 1) that a speed that wanders makes next to 1X in a record's mean, by its standard deviation.

    Where the angle changes by Delta within a block, in the mean, the lines k away from 1X, q, are those of a sawtooth,
    q Delta / (2 pi k). Blocks that know nothing of each other differ by the root of two times the angle.
    """
    found = []
    for t in comparison.trials:
        apart = np.arange(len(t.frequencies)) - abs(t.speed) / (2 * np.pi * t.frequencies[1])
        k = int(np.argmin(np.abs(apart)))
        shape = np.divide(np.sqrt(2) * wander.size[0], 2 * np.pi * apart, where=np.arange(len(apart)) != k,
                          out=np.zeros(len(apart)))  # fmt: skip
        found.append(t.vector(t.spectra.mean(axis=0)[None, :, k, None] * shape))
    return np.asarray((np.concatenate(found) / comparison.sigma)[:, None])


def fall_next_to_drift(seen: ObservedPlaces, fit: ParameterFit, part: str, columns: np.ndarray) -> float:
    """Fall of the sum of squares by columns (n, k) where the numbers of a part may differ from record to record."""
    p = prior_rows(fit.parameters)
    A = np.column_stack([seen.J, *_each(seen, [seen.J[:, _parts(fit)[part]]]), columns])
    A = np.vstack([A, np.eye(len(p), A.shape[1]) * np.pad(p, (0, A.shape[1] - len(p)))])
    b = np.concatenate([seen.residual, -p * fit.vector])
    A /= np.maximum(np.linalg.norm(A, axis=0), 1e-300)
    left = [b - M @ answer(np.linalg.lstsq, M, b, rcond=1e-9)[0] for M in (A[:, : -columns.shape[1]], A)]
    return float(left[0] @ left[0] - left[1] @ left[1])


def part_name(twin: Twin, part: str) -> str:
    """Part of the machine, by the beginning of its keys, as a law's place is named."""
    name, _, number = part.partition(".")
    if name == "bearing":
        return twin.machine.bearings_in_words[int(number)]
    if not number:
        return "the shaft"
    z = getattr(twin.effect(name, int(number)), "position", None)
    return next(
        (place for place, own in law_places(twin.machine).items() if z is None or abs(own - z) < ONE_PLACE), part
    )


def _parts(fit: ParameterFit) -> dict[str, list[int]]:
    """Columns of the calibration by part of the machine."""
    out: dict[str, list[int]] = {}
    for i, k in enumerate(fit.parameters):
        if k.trend or not k.key.startswith(PARTS):
            continue
        name = ".".join(k.key.split(".")[:2]) if "." in k.key else k.key
        out.setdefault(name, []).append(i)
    return out
