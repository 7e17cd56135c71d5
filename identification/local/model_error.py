r"""Linear model error: what the inputs still explain of the residual, as changes of modes and static gain.

The H1 estimate E from inputs to residual is the response that the model lacks (Ljung 1999, section 16.6: model error
model). Around the modes, least squares lets poles, residues and a remainder of first order in s move:

.. math:: E(j\omega) \approx \sum_k \Big( \frac{R_k + \delta R_k}{s - \lambda_k - \delta\lambda_k}
          - \frac{R_k}{s - \lambda_k} \Big) + \overline{(\cdot)} + P_0 + P_1 s

as in modal analysis. The gain at rest changes by the mean of E well below the modes. The scatter of E makes the
variances of both.

Cites: ljung_1999.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from identification.local.models import LinearModel
from identification.records.frequency_response import FrequencyResponse, frequency_response

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
