r"""Forecast of an experiment: responses that the rivals predict in it, and the odds that its record should leave.

.. math:: y \sim N\big(m_k,\; \Sigma + J_k V_k J_k' + \tau_k^2 U U'\big)

m_k is the plant's response at the fitted point of explanation k, V_k the covariance of its parameters after the records
there are, J_k their sensitivities in the new run: a rival differs by the part that it cannot be re-fitted to. Sigma is
the floor, U the directions of the model's form error. Sensitivities come from the plant in a `close` look; in a first
look those of the usual excitation at the operating point stand for them, in proportion to the excitation and, of the
motion, turned with the ring of the probes.

.. math:: \ln p(y \mid k) = -\tfrac12\big(\ln|C| / T + \ln|I + F' C^{-1} F / T| + r' (T C + F F')^{-1} r\big), \quad
          C = \Sigma + U U', \quad F F' = J V J'

with r = y - m_k and the power 1/T of the likelihood as in the evidence: it is the change of its logarithm by the new
record. The expected entropy is a mean over draws; a plug-in estimate without J V J' is wrong by factors. Explanations
that are not followed are counted with the rival whose response they share so far: a run leaves their ratio to it as it
is. Sources: Lindley (1956); MacKay (2003), chapter 28.

Cites: lindley_1956, mackay_2003.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from rotorsim.base.rounding import answer
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.discrepancy.calibration import DIRECTIONS, FitParameter, ParameterPoint
from rotorsim.discrepancy.changes import ring_axes
from rotorsim.discrepancy.comparison import LOST, TwinComparison
from rotorsim.discrepancy.data_vector import EXCITED, GROUPS, DataLayout, floor, make_layout
from rotorsim.discrepancy.evidence import ModelForm, model_form, posterior_root, whitened_size
from rotorsim.discrepancy.fit import ParameterFit
from rotorsim.discrepancy.run_ups import RunupTrial
from rotorsim.discrepancy.trial import Trial
from rotorsim.discrepancy.verdict import SURE, TEMPERATURE, entropy
from rotorsim.effects import REGISTRY

DRAWS = 48
"""Draws of a new record for each explanation."""
Columns = dict[tuple[int, str], np.ndarray]
"""Sensitivities (n,) [m per unit] by number of the explanation and key; -1 is common to all."""


@dataclass(frozen=True)
class PredictedResponse:
    """Response (n,) [m] that an explanation predicts in a new run, and the directions that leave it open.

    spread : sensitivities times a root of the parameters' covariance (n, k) [m]
    form : directions of the model's form error, as large as it is (n, m) [m]
    """

    mean: np.ndarray
    spread: np.ndarray
    form: np.ndarray

    @property
    def open(self) -> np.ndarray:
        """All directions that leave it open (n, k + m) [m]."""
        return np.concatenate([self.spread, self.form], axis=1)


@dataclass(frozen=True)
class Outlook:
    """Odds that a run should leave.

    entropy : bit
    decided : chance that the truth is settled
    of_effects : the same if one of the rivals that name effects is true; 0 if there are none
    truths, chances : for each rival as the truth its mean probability (k,), and the chance that it is settled (k,)
    """

    entropy: float
    decided: float
    of_effects: float
    truths: np.ndarray
    chances: np.ndarray


@dataclass(frozen=True)
class CurrentOdds:
    """Odds before a run; with `rest` they sum to 1.

    odds : probabilities (k,) of the rivals
    rest : probabilities (k,) of what is not followed, by the rival whose response it shares so far
    effects : which rivals (k,) name effects; what is not followed fares as those do on average
    beyond : the part of `rest` that is not in the catalogue, which no run settles
    """

    odds: np.ndarray
    rest: np.ndarray
    effects: np.ndarray
    beyond: float = 0.0

    @classmethod
    def of(cls, *odds: float) -> CurrentOdds:
        """Odds of rivals that all name effects, with nothing left out."""
        return cls(np.array(odds), np.zeros(len(odds)), np.ones(len(odds), bool))

    @property
    def entropy(self) -> float:
        """Entropy [bit]."""
        return float(entropy(np.concatenate([self.odds, self.rest])))


def outlook(
    today: CurrentOdds, predicted: Sequence[PredictedResponse], sigma: np.ndarray, temperature: float, seed: int = 0,
    sure: float = SURE,
) -> Outlook:  # fmt: skip
    """Expected odds after a new record, from those of k rivals `today` and the k responses that they predict.

    `sigma` (n,) [m] is the standard deviation of every number of the record, `temperature` what logarithms of the
    evidence are divided by. Plans have the same `seed` of draws, so that they compare. Raises NoAnswerError where a
    covariance has no inverse.
    """
    rng = np.random.default_rng([seed, 22])
    scaled = [PredictedResponse(p.mean / sigma, p.spread / sigma[:, None], p.form / sigma[:, None]) for p in predicted]
    densities = [PredictiveDensity.of(p, temperature) for p in scaled]
    odds, whole = today.odds, today.odds + today.rest
    entropies, chances, truths = np.zeros(len(odds)), np.zeros(len(odds)), np.zeros(len(odds))
    for k, truth in enumerate(scaled):
        S = truth.open
        drawn = truth.mean + rng.normal(size=(DRAWS, S.shape[1])) @ S.T + rng.normal(size=(DRAWS, len(sigma)))
        p = np.log(whole) + np.stack([density.log(drawn) for density in densities], axis=1)
        p = np.exp(p - p.max(axis=1, keepdims=True))
        p /= p.sum(axis=1, keepdims=True)
        own, rest = p * odds / whole, p * today.rest / whole
        entropies[k], truths[k] = float(entropy(np.hstack([own, rest])).mean()), float(own[:, k].mean())
        chances[k] = float((own[:, k] >= sure).mean())
    of_effects = _of_effects(today, chances)
    decided = _expected(today, chances) - today.beyond * of_effects
    return Outlook(_expected(today, entropies), decided, of_effects, truths, chances)


def _expected(today: CurrentOdds, values: np.ndarray) -> float:
    """Mean over the truths (k,); what is not followed has that of the rivals which name effects."""
    others = _of_effects(today, values) if today.effects.any() else float(today.odds @ values / today.odds.sum())
    return float(today.odds @ values + today.rest.sum() * others)


def _of_effects(today: CurrentOdds, values: np.ndarray) -> float:
    """Mean over the truths (k,) that name effects; 0 if there are none."""
    named = today.odds * today.effects
    return float(named @ values / named.sum()) if named.any() else 0.0


@dataclass(frozen=True)
class PredictiveDensity:
    """Predictive density of a whitened record: mean (n,), open directions S (n, k), its constant, temperature."""

    mean: np.ndarray
    S: np.ndarray
    inner: np.ndarray
    constant: float
    temperature: float

    @classmethod
    def of(cls, p: PredictedResponse, temperature: float) -> PredictiveDensity:
        """Density of a prediction in standard deviations; raises NoAnswerError where it has none."""
        S = np.concatenate([p.form, p.spread / np.sqrt(temperature)], axis=1)
        inner = np.eye(S.shape[1]) + S.T @ S
        m = p.form.shape[1]
        whole = float(answer(np.linalg.slogdet, inner)[1])
        form = float(answer(np.linalg.slogdet, inner[:m, :m])[1]) if m else 0.0
        return cls(p.mean, S, inner, -0.5 * (form / temperature + whole - form), temperature)

    def log(self, drawn: np.ndarray) -> np.ndarray:
        """Logarithm of the density at records (d, n), without the term n ln 2 pi."""
        r = drawn - self.mean
        a = r @ self.S
        q = (r**2).sum(axis=1) - (a * answer(np.linalg.solve, self.inner, a.T).T).sum(axis=1)
        return np.asarray(self.constant - 0.5 * q / self.temperature)


def separation(predicted: Sequence[PredictedResponse], sigma: np.ndarray) -> np.ndarray:
    """Sums of squares (k, k) between the responses of explanations, each re-fitted to the other's mean."""
    out = np.zeros((len(predicted), len(predicted)))
    for k, p in enumerate(predicted):
        S = p.open / sigma[:, None]
        M = np.eye(S.shape[1]) + S.T @ S
        for i, other in enumerate(predicted):
            d = (other.mean - p.mean) / sigma
            a = S.T @ d
            out[i, k] = max(float(d @ d - a @ answer(np.linalg.solve, M, a)), 0.0)
    return np.maximum(out, out.T)


@dataclass(eq=False)
class Forecast:
    """Explanations by their fits and the relative error of the model's form that each leaves."""

    comparison: TwinComparison
    fits: Sequence[ParameterFit]
    errors: Sequence[float]

    @cached_property
    def roots(self) -> list[np.ndarray]:
        """Roots of the covariances of every fit's parameters."""
        part = self.comparison
        size = whitened_size(part.layout, part.predict(self.fits[0].point), part.sigma)
        form: ModelForm = model_form(part.layout, part.trials, size)
        pairs = zip(self.fits, self.errors, strict=True)
        return [posterior_root(form, fit, error, TEMPERATURE) for fit, error in pairs]

    @cached_property
    def varied(self) -> list[tuple[int, FitParameter]]:
        """Parameters whose sensitivities the plant is run for: those of all fits at the first one's point."""
        own = [{p.key: replace(p, trend="") for p in fit.parameters if p.key not in DIRECTIONS} for fit in self.fits]
        common = [key for key in own[0] if all(key in other for other in own)]
        found = [(-1, own[0][key]) for key in common]
        return found + [(k, p) for k, one in enumerate(own) for key, p in one.items() if key not in common]

    def means(self, trials: Sequence[Trial]) -> list[list[np.ndarray]]:
        """Responses (n,) [m] of every explanation in every trial."""
        points = {self._acting(fit): fit.point for fit in reversed(self.fits)}  # of some explanations it is the same
        flat = self._run([(trial, point) for trial in trials for point in points.values()])
        found = [{acting: next(flat) for acting in points} for _ in trials]
        return [[own[self._acting(fit)] for fit in self.fits] for own in found]

    def _acting(self, fit: ParameterFit) -> tuple[Any, ...]:
        """Cause of a response: values, and an effect's options where its size is not zero."""
        values = tuple(sorted((p.name, v) for p, v in fit.point.values.items() if v))
        own = {p.name for p in fit.parameters} - {p.name for p in self.fits[0].parameters}
        return values, tuple(sorted(fit.point.fixed.items())) if own & dict(values).keys() else ()

    def columns(
        self,
        trials: Sequence[Trial],
        means: Sequence[Sequence[np.ndarray]],
        of_sensors: bool = False,
        own: bool = False,
    ) -> list[Columns]:
        """Sensitivities of every trial; to effects `of_sensors` alone, or to what explanations have of their `own`.

        Those of a parameter without solution a step away are zero.
        """
        varied = [(k, p) for k, p in self.varied if not of_sensors or is_of_sensor(p.key)]
        varied = [(k, p) for k, p in varied if not own or k >= 0]
        points = {k: self.fits[max(k, 0)].point for k, _ in varied}
        moved = [points[k].moved([p], np.array([self._step(points[k], p)])) for k, p in varied]
        flat = self._run([(trial, point) for trial in trials for point in moved])
        out = []
        for known in means:
            found: Columns = {}
            for k, p in varied:
                change = (next(flat) - known[max(k, 0)]) / self._step(points[k], p)
                found[k, p.key] = change if np.abs(change).max() * p.step < LOST else np.zeros_like(change)
            out.append(found)
        return out

    @staticmethod
    def _step(point: ParameterPoint, p: FitParameter) -> float:
        value = point.values.get(p, 0.0)
        return p.step if value + p.step <= p.high else -p.step

    def _run(self, jobs: Sequence[tuple[Trial, ParameterPoint]]) -> Iterator[np.ndarray]:
        """Responses (n,) [m] of trials at points."""
        found = self.comparison.run(jobs, self.comparison.twin)
        return (trial.vector(spectra) for (trial, _), spectra in zip(jobs, found, strict=True))

    def predicted(
        self, trial: Trial, means: Sequence[np.ndarray], columns: Columns, sigma: np.ndarray
    ) -> list[PredictedResponse]:
        """Predictions of all explanations in a trial whose numbers have the standard deviations sigma (n,) [m]."""
        layout = make_layout([trial])
        form = model_form(layout, [trial], whitened_size(layout, np.max(np.abs(means), axis=0), sigma))
        shape = form.directions * np.sqrt(form.variances) * sigma[:, None]
        out = []
        for k, (fit, root, mean, error) in enumerate(zip(self.fits, self.roots, means, self.errors, strict=True)):
            J = np.column_stack([self._column(k, p, trial, layout, columns) for p in fit.parameters])
            out.append(PredictedResponse(mean, J @ root, error * shape))
        return out

    def _column(self, k: int, p: FitParameter, trial: Trial, layout: DataLayout, columns: Columns) -> np.ndarray:
        if p.key in DIRECTIONS:
            channel = {"offset_x": 0, "offset_y": 1}.get(p.key, -1)
            slow = (layout.frequency == 0) & ~layout.drift & (layout.channel == channel)
            return slow.astype(float)
        found = columns.get((-1, p.key), columns.get((k, p.key), np.zeros(len(layout.record))))
        return found * p.share(trial.speed, trial.pressure)

    def floor(self, trial: Trial, means: Sequence[np.ndarray]) -> np.ndarray:
        """Standard deviations (n,) [m] that the numbers of a trial should have, from the scatter of the records."""
        part, layout = self.comparison, make_layout([trial])
        assert part.scatter is not None
        scatter, slow, drifts = part.scatter
        alike = [i for i, t in enumerate(part.trials) if bool(t.orders) == bool(trial.orders)] or [0]
        # what scatters is alike in every sample: a line's scatter falls with the root of their number
        samples = np.array([_samples(part.trials[i]) for i in alike])
        each = [np.median(scatter[i][:, 1 : part.trials[i].spectra.shape[2]]) for i in alike]
        line = float(np.median(np.array(each) * np.sqrt(samples))) / np.sqrt(_samples(trial))
        response = np.max(np.abs(means), axis=0)
        return floor(
            [trial], layout, np.full((1, 2, trial.spectra.shape[2]), line), np.median(slow[alike], axis=0)[None],
            np.median(drifts[alike], axis=0)[None], response, self._solver_share * response, part.tolerance,
        )  # fmt: skip

    @cached_property
    def _solver_share(self) -> float:
        """Solver's error relative to the response, typical of the records."""
        part = self.comparison
        size = np.abs(part.measured)
        large = size > np.percentile(size, 80)
        return float(np.median(np.abs(part.correction[large]) / np.maximum(size[large], 1e-300)))


def _samples(trial: Trial) -> float:
    """Samples that a line of a trial, or a vector of a run-up, is taken over."""
    if isinstance(trial, RunupTrial):
        return float(np.median(2 * np.pi * trial.turns / (np.abs(trial.speeds) * RIG_SAMPLE)))
    return float(trial.length * trial.blocks)


def _drive(trial: Trial) -> float:
    """Rms of a trial's excitation about its mean [V or N]."""
    rows = trial.rows[trial.start : trial.start + trial.blocks * trial.length]
    driving = rows[:, 2:4] if rows[:, 2:4].any() else rows[:, 4:6]
    return float(np.sqrt(driving.var(axis=0).sum()))


def in_proportion(columns: Columns, usual: Trial, other: Trial) -> Columns | None:
    """Sensitivities of another excitation at one operating point; None where its lines are others."""
    if usual.spectra.shape != other.spectra.shape or usual.orders or other.orders or _drive(usual) == 0:
        return None
    layout, size = make_layout([usual]), _drive(other) / _drive(usual)
    driven = np.isin(layout.group, [GROUPS.index(name) for name in (*EXCITED, "between")])
    return {key: np.where(driven, size, 1.0) * column for key, column in columns.items()}


def is_of_sensor(key: str) -> bool:
    """Whether a parameter is of an effect on the readings."""
    effect = REGISTRY.get(key.partition(".")[0])
    return effect is not None and effect.port == "sensor"


def on_turned_ring(columns: Columns, angle: float) -> Columns:
    """Sensitivities of the motion in the axes of a ring of probes that is turned further by an angle [rad]."""
    turn = ring_axes(angle)
    return {key: (turn @ one.reshape(2, -1)).ravel() for key, one in columns.items() if not is_of_sensor(key[1])}
