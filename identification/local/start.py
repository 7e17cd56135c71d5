r"""Start values from the data: peak of the frequency response and Levy's linear least squares (1959).

.. math:: (j\omega)^2 G = K G + j\omega D G + B\, h(\omega)

is linear in K, D and B once the actuators' lag h is guessed; a few guesses are tried and the fit takes the best.

Cites: levy_1959.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.local.greybox import DELAYED, split
from identification.records.frequency_response import FrequencyResponse, frequency_response

COHERENT = 0.3
BROAD = 0.3
"""Damping ratio of a start whose resonance is so wide that it covers the data's."""
CORNERS = (600.0, 2500.0)
"""Guesses of the lag's corner [rad/s]."""
DEAD_TIME = 4e-4
"""Guess of a dead time [s]."""


def start_values(kind: str, u: np.ndarray, y: np.ndarray, Ts: float) -> list[np.ndarray]:
    """Candidates for the parameters of a structure, from inputs u (n, 2) and outputs y (n, 2)."""
    if kind == "actuator":
        return [_actuator(u, y)]
    return response_starts(kind, frequency_response(u, y, Ts))


def response_starts(kind: str, response: FrequencyResponse) -> list[np.ndarray]:
    """Candidates for the parameters of a structure, from a frequency response."""
    response = filled(response)
    peak = peak_frequency(response)
    held = np.exp(-0.5j * response.omega * response.Ts)
    candidates: list[np.ndarray] = []
    late = [2 / DEAD_TIME] * 2 if kind == DELAYED else []
    for corner in CORNERS:
        if kind == "2":
            lag = (
                np.asarray(held) / np.exp(-0.5j * response.omega * response.Ts) * np.exp(-1j * response.omega / corner)
            )
            more = [2 * corner] * 2
        else:
            lag = np.asarray(held / (1 + 1j * response.omega / corner))
            more = [corner] * 2
        KDB = levy(response, peak, held if kind == "1" else lag)
        for values in (KDB, crude(response, peak)):
            candidates.append(np.concatenate([values, [] if kind == "1" else more, late]))
    return candidates


def filled(response: FrequencyResponse) -> FrequencyResponse:
    """The response with straight lines through elements that were not measured at a line."""
    if np.all(np.isfinite(response.G)):
        return response
    G = response.G.copy()
    for row, column in np.ndindex(G.shape[1:]):
        known = np.isfinite(G[:, row, column])
        G[:, row, column] = np.interp(response.omega, response.omega[known], G[known, row, column])
    return replace(response, G=G)


def peak_frequency(response: FrequencyResponse) -> float:
    """Frequency [rad/s] where the outputs move fastest because of the inputs."""
    trusted = response.coherence.max(axis=1) > COHERENT
    speed = response.power.sum(axis=1) * response.omega**2
    return float(response.omega[int(np.argmax(np.where(trusted, speed, 0) if trusted.any() else speed))])


def levy(response: FrequencyResponse, peak: float, lag: np.ndarray) -> np.ndarray:
    """K, D, B (12,) by linear least squares on the response around its peak."""
    s = 1j * response.omega
    band = (response.omega > 0.1 * peak) & (response.omega < 1.8 * peak)
    weight = np.sqrt(response.coherence.mean(axis=1))[band] / (1 + np.abs(s[band] / peak) ** 2)
    G, s, lag = response.G[band], s[band], lag[band]
    KDB = np.empty((3, 2, 2))
    for row in range(2):
        columns, target = [], []
        for j in range(2):
            unit = np.eye(2)[j]
            terms = [G[:, 0, j], G[:, 1, j], s * G[:, 0, j], s * G[:, 1, j], unit[0] * lag, unit[1] * lag]
            columns.append(np.column_stack(terms) * weight[:, None])
            target.append(s**2 * G[:, row, j] * weight)
        M, b = np.vstack(columns), np.concatenate(target)
        M, b = np.vstack([M.real, M.imag]), np.concatenate([b.real, b.imag])
        scale = np.linalg.norm(M, axis=0) + 1e-300
        KDB[:, row] = (np.linalg.lstsq(M / scale, b, rcond=None)[0] / scale).reshape(3, 2)
    return KDB.ravel()


def crude(response: FrequencyResponse, peak: float) -> np.ndarray:
    """K, D, B (12,) of two equal modes at the peak with 5 % damping and the response's low-frequency gain."""
    low = response.omega < 0.4 * peak
    low = low if low.any() else np.ones(len(low), bool)
    gain = np.mean(response.G[low].real, axis=0)
    return np.concatenate([-(peak**2) * np.eye(2).ravel(), -0.1 * peak * np.eye(2).ravel(), peak**2 * gain.ravel()])


def broadened(theta: np.ndarray) -> np.ndarray:
    """The same parameters with damping ratios of BROAD: from a sharp resonance at a wrong frequency no fit finds away,
    for the simulation and the data have nothing in common there."""
    K, _, _ = split(theta)
    wide = theta.copy()
    wide[4:8] = (-2 * BROAD * np.diag(np.sqrt(np.abs(np.diag(K))))).ravel()
    return wide


def _actuator(u: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Poles at 2500 and 6000 rad/s and the gain of a straight line through the settled part of the data."""
    theta = []
    for axis in range(2):
        before, after = u[:-5, axis], y[5:, axis]
        gain = before @ after / max(before @ before, 1e-300)
        theta += [2500.0 * 6000.0, 8500.0, gain * 2500.0 * 6000.0]
    return np.array(theta)
