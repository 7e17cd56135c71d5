r"""Bias of modes and static gains of a grey-box model, as far as its record shows it, and 90 % intervals.

Three things bias a fitted model that the variance of its parameters does not hold:

1. *Linear model error*: dynamics that the structure lacks. The record shows them as what the inputs explain of the
   residual; `model_error` turns that into a change c_1 of modes and gains. There is none where the residual passes the
   test of independence of the inputs.
2. *Amplitude*: K and D of a hardening or softening film depend on the amplitude of the record. The record shows that as
   what their change with the simulated amplitude explains of the residual; `amplitude` takes them back to rest, which
   changes modes and gains by c_2.
3. *Distortion*: what is neither linear in the inputs nor noise. A nonlinear plant answers a random input with a linear
   part, which is the best linear approximation and not the plant's linearisation, and with a part that scatters
   (Pintelon and Schoukens 2012, chapter 3). Both come from the same terms, and at each frequency the first is off by
   about as much as the second scatters, whatever the length of the record: under Gaussian motion of standard deviation
   r by 3 c r^3 against sqrt(6) c r^3 of a cubic term, and 0 against sqrt(2) c r^2 of a quadratic one. So the distortion
   bounds the error; with quadratic terms in it values near the bound are unlikely, which leaves as standard uncertainty
   that of a triangular distribution, the bound over sqrt(6) (GUM, 4.3.9). It acts alike over the width of a resonance,
   2 zeta f, hence of the covariance that distortion makes in a record of length T, which averages over T times as many
   independent lines,

.. math:: \Sigma_3 = \tfrac16\, T\, \overline{2 \zeta f}\, (1 - s)(1 - a)\, \Sigma_d

   with Sigma_d the part of the sandwich covariance that is not sensor noise (`confidence.spread`), s the share of the
   residual without that noise that 1. explains and a the share of the rest that 2. explains. Distortion that does not
   rise out of the noise counts as none. The bound holds for all inputs of an output together, and the cubic term shifts
   each response by 3 c r^2 of itself: of a gain g_ij counts the part of its input in the motion of its output, g_ij^2
   over the sum over the inputs.

How much of c_1 and c_2 is bias one record does not tell: the effects are correlated with each other and with what 3.
scatters. It lies between none and all, the nearer to all the more of the residual the effect explains. So the middle is
taken, or more, with a standard uncertainty whose 90 % interval has the width from none to all,

.. math:: b = -\tfrac12 \big((1 + s)\, c_1 + (1 - s)(1 + m)\, c_2\big), \qquad
          \text{interval} = \text{value} - b
          \pm 1.645 \sqrt{sd^2 + \frac{c_1^2 + (1 - s)\, c_2^2}{(2 \cdot 1.645)^2} + u^2 + \Sigma_3}

and besides what the scatter of c_1 and c_2, taken off their squares, makes of b, with m from 0 to 1 where a is 0.15 to
0.5: on the rig, where stroke and pressure matter as much as the orbit, it is 0.05 to 0.15, of cubic springs, of which
all is bias, 0.5 or more. Of gains m c_2 is taken, with half of c_2 as standard uncertainty: on the rig they do not
follow it.

A pole that 1. moves by more than its distance from the imaginary axis is beyond the steps of `model_error`: none of the
change is taken, and all of it is standard uncertainty.

A binary reference has one size of stroke, so what depends on the square of the stroke is the same throughout and leaves
no trace. Wide pins move the damping and hardly the frequencies, the orbit's square, which 2. sees, mainly the
frequencies. So damping ratios have one more part u, up to the size of the change of the pole in either direction, small
ones likelier (triangular), where 2. is not what distorts,

.. math:: u^2 = \tfrac16 (1 - s)(1 - m) (1 - \zeta^2) \Big|\frac{\delta\lambda}{\lambda}\Big|^2, \qquad
          \Big|\frac{\delta\lambda}{\lambda}\Big|^2 = \Big(\frac{\delta\omega}{\omega}\Big)^2
          + \frac{\delta\zeta^2}{1 - \zeta^2}

A film answers with any phase, so 3. shows how far a pole is shifted better than in which direction and is shared by
both.

Limits: nothing that leaves no trace in the record is seen, e.g. a wrong scale of a sensor. Fits by prediction error
have no second part.

The second part follows from the change of stiffness and damping with the amplitude of motion. A fit gives K and D at
the amplitude of its record; the plant's linearisation is that of no amplitude. With the square m_k of the simulated
orbit's amplitude over its mean, parameters theta + beta m_k have the sensitivities

.. math:: s^i_{k+1} = F s^i_k + m_k (F_i x_k + G_i w_k)

to beta, as describing functions of odd nonlinearities do: a spring K (1 + h x^2) is one of stiffness K (1 + 3/4 h a^2)
at amplitude a. Least squares of the residual on the sensitivities to theta, and to beta of K and D, gives the change of
theta on the way to rest. It counts where beta differs from zero by Hotelling's test, with as many degrees of freedom as
the covariance has independent stretches: 3/2 of the record over the window of its correlations (Priestley 1981, 6.2).

The first part is the H1 estimate E from inputs to residual of what the model lacks (Ljung 1999, section 16.6: model
error model). Around the modes, least squares lets poles, residues and a remainder of first order in s move:

.. math:: E(j\omega) \approx \sum_k \Big( \frac{R_k + \delta R_k}{s - \lambda_k - \delta\lambda_k}
          - \frac{R_k}{s - \lambda_k} \Big) + \overline{(\cdot)} + P_0 + P_1 s

as in modal analysis. The gain at rest changes by the mean of E well below the modes. The scatter of E makes the
variances of both.

Cites: ljung_1999, gelb_1968, gum_2008, pintelon_2012, priestley_1981.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.stats import f

from identification.local.confidence import WINDOW, Spread, propagate, sandwich
from identification.local.greybox import modes, static_gain
from identification.local.least_squares import FitProblem, GreyBox, scores_of
from identification.local.models import LinearModel
from identification.local.simulation import respond
from identification.records.frequency_response import FrequencyResponse, frequency_response
from identification.records.prefilter import parts_of

if TYPE_CHECKING:
    from identification.records.prefilter import Signals

BAND = (0.6, 1.4)
"""Lines around the modes, in units of their mean frequency."""
BELOW = 0.25
"""Lines for the gain at rest, as a share of the first natural frequency."""
OSCILLATING = 0.7
"""Largest damping ratio of a mode that a response shows."""
STEPS = 4
"""Steps by Gauss and Newton."""
FEWEST = 20
"""Least number of lines around the modes."""
LEAKAGE = 35 / 18
"""Lines that count as one: behind a Hann window errors of the estimate correlate by (2/3)^2 and (1/6)^2 with those
of the next two lines on either side (of white noise measured: 1.86)."""


class ModelRemainder(NamedTuple):
    """Changes (8,) of wn [rad/s], zeta, static gain [m/V] (row by row) that the model lacks, their variances (8,), and
    the share that the inputs explain linearly of the residual's power around the modes, sensor noise left out."""

    change: np.ndarray
    variance: np.ndarray
    share: float


def model_error(
    model: LinearModel, wn: np.ndarray, zeta: np.ndarray, u: np.ndarray, residual: np.ndarray, Ts: float,
    noise: np.ndarray, parts: Sequence[slice] = (),
) -> ModelRemainder:  # fmt: skip
    """Error of a continuous model with modes wn (2,) [rad/s], zeta (2,), by inputs u (n, 2) and residual (n, 2).

    noise (2,): standard deviations of the sensors' white noise [m].
    """
    found = frequency_response(u, residual, Ts, parts=parts)
    assert found.variance is not None
    around = (found.omega > BAND[0] * wn.mean()) & (found.omega < BAND[1] * wn.mean())
    modes = spread = np.zeros((2, 2))
    if np.all(zeta < OSCILLATING) and np.count_nonzero(around) > FEWEST:
        modes, spread = _modes_moved(model, wn, zeta, found, around)
    low = found.omega < BELOW * wn[0]
    gain = scatter = np.zeros((2, 2))
    if low.any():
        scatter = LEAKAGE * found.variance[low].mean(axis=0) / (2 * np.count_nonzero(low))
        gain = found.G[low].real.mean(axis=0)
    change, variance = (np.concatenate([a.ravel(), b.ravel()]) for a, b in ((modes, gain), (spread, scatter)))
    if not modes.any():  # modes that no response shows: none of the rest is accounted for
        return ModelRemainder(change, variance, 0.0)
    ratio = noise / np.maximum(residual.std(axis=0), 1e-300)
    return ModelRemainder(change, variance, _share(found, around, u.shape[1], ratio))


def _share(found: FrequencyResponse, around: np.ndarray, inputs: int, noise: np.ndarray) -> float:
    """Share of the power that the inputs explain, less what they explain by chance; white noise, of so many standard
    deviations of the residual (p,), left out."""
    every = found.power / np.maximum(found.coherence, 1e-12)
    total, explained = float(every[around].sum()), float(found.power[around].sum())
    white = np.count_nonzero(around) * float(np.sum(np.minimum(noise, 1) ** 2 * every.mean(axis=0)))
    chance = min(inputs / found.segments, 0.5)
    linear = max(explained - chance * total, 0.0) / (1 - chance)
    return linear / max(total - white, linear, 1e-300)


def _modes_moved(
    model: LinearModel, wn: np.ndarray, zeta: np.ndarray, found: FrequencyResponse, at: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Changes (2, 2) of wn and of zeta, and their variances."""
    poles, residues = _rotor_modes(model, wn, zeta)
    s, rest = 1j * found.omega[at], np.zeros((2, *residues[0].shape))
    wanted = found.G[at] + _response(s, poles, residues, rest)
    for _ in range(STEPS):
        columns = _columns(s, poles, residues).reshape(-1, wanted.size).T
        scale = np.linalg.norm(columns, axis=0)
        inverse = np.linalg.pinv(np.vstack([columns.real, columns.imag]) / scale, rcond=1e-8) / scale[:, None]
        left = (wanted - _response(s, poles, residues, rest)).ravel()
        step = inverse @ np.concatenate([left.real, left.imag])
        half = poles.size * residues[0].size * 2
        change = step[4 : 4 + half].reshape(2, 2, *residues[0].shape)
        poles = poles + step[:4:2] + 1j * step[1:4:2]
        residues = residues + change[:, 0] + 1j * change[:, 1]
        rest = rest + step[4 + half :].reshape(rest.shape)
    most = np.array([wn, zeta])
    moved = np.array([np.abs(poles) - wn, -poles.real / np.abs(poles) - zeta])
    moved = np.clip(np.where(np.isfinite(moved), moved, most), -most, most)
    assert found.variance is not None
    variance = found.variance[at].ravel()
    spread = (inverse[:4] ** 2 @ np.concatenate([variance, variance]) / 2 * LEAKAGE).reshape(2, 2)
    sigma, omega, size = poles.real, poles.imag, np.abs(poles)
    toward = np.array([[sigma / size, omega / size], [-(omega**2) / size**3, sigma * omega / size**3]])
    return moved, np.asarray(np.einsum("qpk,kp->qk", toward**2, spread))


def _response(s: np.ndarray, poles: np.ndarray, residues: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Response (f, p, m) of modes and of the remainder P_0 + P_1 s."""
    found = rest[0] + rest[1] * s[:, None, None]
    for pole, residue in zip(poles, residues, strict=True):
        found = found + residue / (s - pole)[:, None, None] + residue.conj() / (s - pole.conj())[:, None, None]
    return np.asarray(found)


def _rotor_modes(model: LinearModel, wn: np.ndarray, zeta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Poles (2,) above the real axis that come closest to the modes, and their residues (2, p, m)."""
    values, vectors = np.linalg.eig(model.A)
    wanted = wn * (-zeta + 1j * np.sqrt(1 - zeta**2))
    chosen = [int(np.argmin(np.abs(values - pole))) for pole in wanted]
    left = np.linalg.inv(vectors)
    residues = np.einsum("pk,km->kpm", model.C @ vectors[:, chosen], left[chosen] @ model.B)
    return values[chosen], residues


def _columns(s: np.ndarray, poles: np.ndarray, residues: np.ndarray) -> np.ndarray:
    """Responses (20 + 8, f, p, m) of a change of each pole's and residue's real and imaginary part, and of P_0, P_1."""
    found = []
    for pole, residue in zip(poles, residues, strict=True):
        one = residue / ((s - pole) ** 2)[:, None, None]
        other = residue.conj() / ((s - pole.conj()) ** 2)[:, None, None]
        found += [one + other, 1j * (one - other)]
    units = [np.eye(residues[0].size)[k].reshape(residues[0].shape) for k in range(residues[0].size)]
    for pole in poles:
        one, other = 1 / (s - pole), 1 / (s - pole.conj())
        for factor in (one + other, 1j * (one - other)):
            found += [factor[:, None, None] * unit for unit in units]
    for factor in (np.ones_like(s), s):
        found += [factor[:, None, None] * unit for unit in units]
    return np.array(found)


MOVING = 8
"""K and D, the first parameters of every structure that moves, depend on the amplitude."""
KNOWN_MOTION = 0.99


class AtRest(NamedTuple):
    """Change (q,) of the parameters from the record's amplitude to none, its covariance (q, q), and the share of the
    distortion (residual less noise) that dependence on the amplitude explains."""

    change: np.ndarray
    covariance: np.ndarray
    share: float

    def first(self, count: int) -> AtRest:
        """The change of the first parameters alone."""
        return AtRest(self.change[:count], self.covariance[:count, :count], self.share)

    def joined(self, count: int) -> AtRest:
        """The change with further parameters that stay as they are."""
        q = len(self.change)
        covariance = np.zeros((q + count, q + count))
        covariance[:q, :q] = self.covariance
        return AtRest(np.concatenate([self.change, np.zeros(count)]), covariance, self.share)


def nothing(count: int) -> AtRest:
    """No change of so many parameters."""
    return AtRest(np.zeros(count), np.zeros((count, count)), 0.0)


def at_rest(problem: FitProblem, theta: np.ndarray, x0: np.ndarray, Ts: float, noise: np.ndarray) -> AtRest:
    """Parameters at no amplitude, less those of an output-error fit that ended at theta (q,), x0; noise (2,) [m]."""
    residual, J = scores_of(problem, theta, x0)
    columns = np.concatenate([J, _modulated(problem, theta, x0)], axis=-1)
    flat = columns.reshape(-1, columns.shape[-1])
    scale = np.sqrt(np.maximum(np.sum(flat**2, axis=0), 1e-300))
    flat = flat / scale
    step = np.linalg.pinv(flat.T @ flat, rcond=1e-12, hermitian=True) @ (flat.T @ residual.ravel())
    left = residual - (flat @ step).reshape(residual.shape)
    covariance = sandwich(left, columns / scale, Ts)
    beta, q = slice(-MOVING, None), len(theta)
    size = float(step[beta] @ np.linalg.pinv(covariance[beta, beta], hermitian=True) @ step[beta])
    free = 1.5 * len(residual) * Ts / WINDOW
    rest = free - MOVING + 1
    if not (rest > 1 and size > MOVING * free / rest * f.ppf(KNOWN_MOTION, MOVING, rest)):
        return nothing(q)
    distortion = np.sum(residual**2) - len(residual) * np.sum(noise**2)
    explained = np.sum(residual**2) - np.sum(left**2)
    share = min(float(explained / distortion), 1.0) if distortion > explained else 1.0
    return AtRest((step / scale)[:q], (covariance / np.outer(scale, scale))[:q, :q], share)


def _modulated(problem: FitProblem, theta: np.ndarray, x0: np.ndarray) -> np.ndarray:
    """Sensitivities (n, p, MOVING) to changes of K and D that follow the square of the amplitude."""
    F, G, H, _ = problem.model.sampled(theta)
    slopes = problem.model.derivatives(theta)[0]
    n, p = len(F), len(H)
    parts = list(parts_of(problem.breaks, len(problem.w)))
    through, begin = np.zeros((n, problem.w.shape[1])), x0.reshape(-1, n)
    states = np.vstack([respond(F, G, np.eye(n), through, begin[k], problem.w[at]) for k, at in enumerate(parts)])
    x, v = states[:, :2], _velocity(problem, theta, states)
    frequency = np.linalg.norm(v) / max(float(np.linalg.norm(x)), 1e-300)
    square = np.sum(x**2 + (v / frequency) ** 2, axis=1)
    square = square / max(float(square.mean()), 1e-300)
    both, none, zero = np.hstack([states, problem.w]), np.zeros((p, n)), np.zeros(n)
    found = []
    for i in range(MOVING):
        push = np.ascontiguousarray((both @ slopes[:, :, i].T) * square[:, None])
        moved = [respond(F, np.eye(n), H, none, zero, push[at]) for at in parts]
        found.append(problem.project(np.vstack(moved)))
    return np.stack(found, axis=-1)


def _velocity(problem: FitProblem, theta: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Velocity x' (n, 2): the states v, and what the inputs add to them at once as the rates of the pins do."""
    assert isinstance(problem.model, GreyBox)
    B = problem.model.structure.matrices(theta)[1]
    return np.asarray(states[:, 2:4] + problem.w[:, : B.shape[1]] @ B[:2].T)


LEVEL = 0.9
"""Share of intervals that hold the truth."""
REACH = 0.5 / NormalDist().inv_cdf(0.5 + LEVEL / 2)
"""Standard deviation over the range from none to all, which the interval of LEVEL holds."""
TRIANGULAR = 1 / 6
"""Variance of a triangular distribution over its bound squared."""
MAIN = (0.15, 0.5)
"""Shares of the distortion that the dependence on the amplitude explains, from m = 0 to 1."""
LEAST_ANGLE = 0.5
"""Least 1 - zeta^2 by which a change of a damping ratio is taken for one of the angle of its poles."""
POLES = np.arange(8) < 4
"""Values of the eight that belong to poles."""
CERTAIN = 3.0
"""Standard deviations of the noise's variance by which the residual's exceeds it where there is distortion."""


@dataclass(frozen=True)
class Interval:
    """A value with standard deviation, bias (what it is expected to be too high by), the standard uncertainty of the
    bias, and the 90 % interval, in `unit`. Where no bias is stated both are None, and the interval knows of none.

    Examples
    --------
    >>> import rotorsim as rs
    >>> one = rs.identification.Interval("f_1", 120.0, sd=0.3, bias=0.5, bias_sd=0.4, unit="Hz")
    >>> round(one.low, 2), round(one.high, 2)
    (118.68, 120.32)
    """

    name: str
    value: float
    sd: float
    bias: float | None
    bias_sd: float | None
    unit: str

    @property
    def half_width(self) -> float:
        """Half of the interval."""
        return NormalDist().inv_cdf(0.5 + LEVEL / 2) * float(np.hypot(self.sd, self.bias_sd or 0.0))

    @property
    def low(self) -> float:
        """Lower end."""
        return self.value - (self.bias or 0.0) - self.half_width

    @property
    def high(self) -> float:
        """Upper end."""
        return self.value - (self.bias or 0.0) + self.half_width


class Bias(NamedTuple):
    """Expected bias (value less truth) and its standard uncertainty, each (8,): wn [rad/s], zeta (2,), static gain
    [m/V] row by row."""

    expected: np.ndarray
    sd: np.ndarray


def bias(
    kind: str, theta: np.ndarray, spread: Spread, calm: AtRest, model: LinearModel, signals: Signals,
    residual: np.ndarray, independent: bool,
) -> Bias:  # fmt: skip
    """Bias of a grey-box model that moves, from its residual (n, 2) on its own record."""
    wn, zeta = modes(theta)
    start = min(signals.rest, len(residual) // 2)
    excited = residual[start:]
    parts = list(parts_of([at - start for at in signals.breaks if at > start], len(excited)))
    error = model_error(model, wn, zeta, signals.u[start:], excited, signals.Ts, signals.noise, parts)
    if independent:
        error = ModelRemainder(np.zeros(8), np.zeros(8), 0.0)

    def properties(values: np.ndarray) -> np.ndarray:
        return np.concatenate([*modes(values), static_gain(kind, values).ravel()])

    follows = float(np.clip(calm.share / max(1 - error.share, 1e-9), 0, 1))
    third = np.zeros(8)
    if _distorted(excited, signals):
        lines = len(excited) * signals.Ts * float(np.mean(2 * zeta * wn)) / (2 * np.pi)
        rest = lines * (1 - error.share) * (1 - follows) * TRIANGULAR
        third = rest * propagate(properties, theta, spread.distortion) ** 2
        third[4:] *= _part_of_the_input(static_gain(kind, theta)).ravel()
    most = np.abs(properties(theta))
    change = np.clip(properties(theta + calm.change) - properties(theta), -most, most)
    scatter = propagate(properties, theta, calm.covariance) ** 2
    main = float(np.interp(follows, MAIN, (0.0, 1.0)))
    taken, first = _of_linear_error(error, wn, zeta)
    moving = (1 - error.share) * np.where(POLES, (1 + main) / 2, main)
    moved = (1 - error.share) * np.maximum(change**2 - scatter, 0)
    second = np.where(POLES, REACH**2, 0.25) * moved + moving**2 * scatter
    second[2:4] += TRIANGULAR * (1 - main) * 2 * of_any_phase(moved, wn, zeta)[2:4]
    expected = 0.0 - taken - moving * change
    return Bias(expected, np.sqrt(first + second + of_any_phase(third, wn, zeta)))


def _of_linear_error(error: ModelRemainder, wn: np.ndarray, zeta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Part (8,) that is taken of the changes by the linear model error, and the variance (8,) that they leave."""
    far = np.hypot(error.change[:2], wn * error.change[2:4]) > zeta * wn
    far = np.concatenate([far, far, np.zeros(4, bool)])
    part = np.where(far, 0.0, (1 + error.share) / 2)
    near = REACH**2 * np.maximum(error.change**2 - error.variance, 0) + part**2 * error.variance
    return part * error.change, np.where(far, error.change**2, near)


def _part_of_the_input(gain: np.ndarray) -> np.ndarray:
    """Part (2, 2) that each input has in the power of each output's motion, of equal inputs."""
    power = gain**2
    return np.asarray(power / np.maximum(power.sum(axis=1, keepdims=True), 1e-300))


def of_any_phase(variance: np.ndarray, wn: np.ndarray, zeta: np.ndarray) -> np.ndarray:
    """Variances of wn (2,), zeta (2,) and more, each pole's spread evenly over size and angle of the pole.

    A damping ratio near 1 hardly changes with the angle of its poles, so what it changes by is spread no wider than at
    0.7; modes that do not oscillate keep what they have.
    """
    size, angle = wn**2, np.maximum(1 - zeta**2, LEAST_ANGLE)
    each = (variance[:2] / size + variance[2:4] / angle) / 2
    oscillates = zeta < 1
    spread = np.concatenate([each * size, each * angle])
    return np.concatenate([np.where(np.tile(oscillates, 2), spread, variance[:4]), variance[4:]])


def _distorted(residual: np.ndarray, signals: Signals) -> bool:
    """Whether the residual of any output is more than the noise at rest, which is known from half of the rest."""
    known = max(signals.rest // 2, 200)
    limit = signals.noise**2 * (1 + CERTAIN * np.sqrt(2 / known))
    return bool(np.any(np.mean(residual**2, axis=0) > limit))
