r"""Grey-box models of the thesis: Models 1 to 3 and actuators, with start values from the data.

The structures are affine: Model 1 (eq. 2.12), Model 2's rotor-bearing part (2.13), Model 3 (2.18), actuators.
Model 3 is a rotor on stiffness K, damping D and input gain B behind first-order lags P = diag(p1, p2):

.. math:: A = \begin{bmatrix} 0 & I & 0\\ K & D & B\\ 0 & 0 & -P \end{bmatrix},\;
          B_u = \begin{bmatrix} 0\\ 0\\ P \end{bmatrix},\; C = [I\; 0\; 0]

K, D, B are divided by the mass; K and D are negative definite, as in the thesis. References may act later by a dead
time 2/r on each axis, (r - s)/(r + s) in front of the lag (first-order Pade approximation). The lag then stands for the
slowest of what lies between reference and force, the dead time for what is left.

Model 2 takes the film's force to be a delayed copy of the pins' motion. With rates it is B u(t - 2/r) + R u'(t), for a
film follows a pin over a range of times and passes part of it across; then x' = v + R u.

Starts come from the peak of the frequency response and Levy's linear least squares (1959).

.. math:: (j\omega)^2 G = K G + j\omega D G + B\, h(\omega)

is linear in K, D and B once the actuators' lag h is guessed; a few guesses are tried and the fit takes the best.

Cites: levy_1959, theisen_2016, thesis.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from identification.local.structures import Matrices, Structure
from identification.records.frequency_response import FrequencyResponse, frequency_response

PAIRS = ("xx", "xy", "yx", "yy")
KDB = tuple(f"{letter}_{pair}" for letter in "KDB" for pair in PAIRS)
UNITS = {
    "K": "1/s^2",
    "D": "1/s",
    "B": "m/(s^2 V)",
    "R": "m/(s V)",
    "p": "rad/s",
    "r": "1/s",
    "a0": "1/s^2",
    "a1": "1/s",
    "b": "m/(s^2 V)",
}
"""Unit by the first part of a parameter's name; B and R of Model 2 are per metre of pin and not per volt."""


def split(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """K [1/s^2], D [1/s], B [m/(s^2 V)] of the first twelve parameters."""
    return theta[:4].reshape(2, 2), theta[4:8].reshape(2, 2), theta[8:12].reshape(2, 2)


def _rotor(theta: np.ndarray, n: int, m: int = 2) -> Matrices:
    K, D, _ = split(theta)
    A, B, C = np.zeros((n, n)), np.zeros((n, m)), np.zeros((2, n))
    A[:2, 2:4], A[2:4, :2], A[2:4, 2:4] = np.eye(2), K, D
    C[:, :2] = np.eye(2)
    return A, B, C, np.zeros((2, m))


def model_1(theta: np.ndarray) -> Matrices:
    """Static actuators: 4 states."""
    A, B, C, D = _rotor(theta, 4)
    B[2:4] = split(theta)[2]
    return A, B, C, D


def model_2(theta: np.ndarray) -> Matrices:
    """Input delays 2/r_x, 2/r_y as first-order Pade approximations: 6 states; its input is what the pins do."""
    A, B, C, D = _rotor(theta, 6)
    T, gain = np.diag(theta[12:14]), split(theta)[2]
    A[2:4, 4:6], A[4:6, 4:6] = 2 * gain @ T, -T
    B[2:4], B[4:6] = -gain, np.eye(2)
    return A, B, C, D


def model_2_rated(theta: np.ndarray) -> Matrices:
    """Model 2 whose force follows the rates of the pins too, by R (2, 2) behind its fourteen parameters: 6 states."""
    A, B, C, D = model_2(theta[:14])
    rates = theta[14:18].reshape(2, 2)
    B[:2] = rates
    B[2:4] += split(theta)[1] @ rates
    return A, B, C, D


def model_3(theta: np.ndarray) -> Matrices:
    """Lags p_x, p_y that take actuators and film together: 6 states."""
    A, B, C, D = _rotor(theta, 6)
    P = np.diag(theta[12:14])
    A[2:4, 4:6], A[4:6, 4:6], B[4:6] = split(theta)[2], -P, P
    return A, B, C, D


def model_3_delayed(theta: np.ndarray) -> Matrices:
    """Model 3 behind dead times 2/r_x, 2/r_y as first-order Pade approximations: 8 states."""
    A, B, C, D = _rotor(theta, 8)
    P, R = np.diag(theta[12:14]), np.diag(theta[14:16])
    A[2:4, 4:6], A[4:6, 4:6], A[4:6, 6:8], A[6:8, 6:8] = split(theta)[2], -P, 2 * P @ R, -R
    B[4:6], B[6:8] = -P, np.eye(2)
    return A, B, C, D


def actuator(theta: np.ndarray) -> Matrices:
    """One second-order lag b / (s^2 + a1 s + a0) for each axis, a0 = p1 p2, a1 = p1 + p2, b = gain a0 (eq. 2.16)."""
    A, B, C = np.zeros((4, 4)), np.zeros((4, 2)), np.zeros((2, 4))
    for axis in range(2):
        a0, a1, b = theta[3 * axis : 3 * axis + 3]
        at = slice(2 * axis, 2 * axis + 2)
        A[at, at], B[2 * axis + 1, axis], C[axis, 2 * axis] = [[0, 1], [-a0, -a1]], b, 1
    return A, B, C, np.zeros((2, 2))


def cascade(theta: np.ndarray, rotor: Callable[[np.ndarray], Matrices] = model_2) -> Matrices:
    """Model 2 from references to disc: the six actuator parameters after those of the rotor, 10 states."""
    A, B, C, _ = rotor(theta[:-6])
    a, b, c, _ = actuator(theta[-6:])
    top, n, m = np.hstack([A, B @ c]), len(A), len(a)
    return (np.vstack([top, np.hstack([np.zeros((m, n)), a])]), np.vstack([np.zeros((n, 2)), b]),
            np.hstack([C, np.zeros((2, m))]), np.zeros((2, 2)))  # fmt: skip


ACTUATOR = tuple(f"{letter}_{axis}" for axis in "xy" for letter in ("a0", "a1", "b"))
ROTOR_2 = (*KDB, "r_x", "r_y")
RATES = tuple(f"R_{pair}" for pair in PAIRS)
RATED = "2-rate"
"""Model 2 with the rates of the pins, among STRUCTURES."""
LATE_3 = (*KDB, "p_x", "p_y", "r_x", "r_y")
DELAYED = "3-delay"
"""Model 3 with dead times, among STRUCTURES."""
SHORTEST_DEAD = 1e-5
"""Dead times [s] below this are none."""


def _built_in(
    name: str, parameters: tuple[str, ...], matrices: Callable[[np.ndarray], Matrices], highest: float = np.inf
) -> Structure:
    """A model of the thesis; the last two parameters stay below `highest`."""
    none = (-np.inf, np.inf)
    bounds = () if highest == np.inf else (none,) * (len(parameters) - 2) + ((-np.inf, highest),) * 2
    units = tuple(UNITS[one[:2] if one[:2] in UNITS else one[0]] for one in parameters)
    positive = tuple(one for one in parameters if one[0] in "pra")
    return Structure(name, parameters, matrices, bounds=bounds, units=units, positive=positive, affine=True)


STRUCTURES = {
    "1": _built_in("Model 1", KDB, model_1),
    "rotor": _built_in("Model 2 behind its actuators", ROTOR_2, model_2),
    "2": _built_in("Model 2", (*ROTOR_2, *ACTUATOR), cascade),
    "rotor-rate": _built_in("Model 2 with rates behind its actuators", (*ROTOR_2, *RATES), model_2_rated),
    RATED: _built_in("Model 2 with rates", (*ROTOR_2, *RATES, *ACTUATOR), partial(cascade, rotor=model_2_rated)),
    "3": _built_in("Model 3", (*KDB, "p_x", "p_y"), model_3),
    DELAYED: _built_in("Model 3 with dead times", LATE_3, model_3_delayed, 2 / SHORTEST_DEAD),
    "actuator": _built_in("actuator", ACTUATOR, actuator),
}
"""Structures by their names in `identify(model=)`."""


def modes(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Natural frequencies [rad/s], ascending, and damping ratios (2,) of rotor and film, lags left out.

    Where a pair of poles does not oscillate its frequency is |s| and its damping ratio -Re s/|s|.
    """
    K, D, _ = split(theta)
    poles = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [K, D]]))
    chosen = poles[np.argsort(-poles.imag)][:2]
    chosen = chosen[np.argsort(np.abs(chosen))]
    return np.abs(chosen), -chosen.real / np.abs(chosen)


def static_gain(kind: str, theta: np.ndarray) -> np.ndarray:
    """Gain (2, 2) at rest: disc per reference [m/V]; of actuators pin per reference [m/V]."""
    if kind == "actuator":
        return np.diag(theta[2::3] / theta[0::3])
    K, _, B = split(theta)
    gain = -np.linalg.solve(K, B)
    return np.asarray(gain @ static_gain("actuator", theta[-6:]) if kind in ("2", RATED) else gain)


def delays(kind: str, theta: np.ndarray) -> np.ndarray:
    """Delay (2,) [s] of each axis: 1/p of Model 3 and its dead time, 2/r of Model 2, with rates less R/B, a1/a0 of
    actuators, none in Model 1."""
    if kind in ("3", DELAYED):
        return np.asarray(1 / theta[12:14] + dead_times(kind, theta))
    if kind in ("2", "rotor"):
        return np.asarray(2 / theta[12:14])
    if kind in (RATED, "rotor-rate"):
        return np.asarray(2 / theta[12:14] - theta[14:18:3] / theta[8:12:3])
    if kind == "actuator":
        return np.asarray(theta[1::3] / theta[0::3])
    return np.zeros(2)


def dead_times(kind: str, theta: np.ndarray) -> np.ndarray:
    """Dead time (2,) [s] of each axis of Model 3, 2/r; zero in other structures."""
    return np.asarray(2 / theta[14:16]) if kind == DELAYED else np.zeros(2)


def actuator_poles(theta: np.ndarray) -> np.ndarray:
    """Poles (2, 2) [rad/s], axis by axis, positive and ascending; the magnitude twice where they oscillate."""
    rows = []
    for axis in range(2):
        a0, a1, _ = theta[3 * axis : 3 * axis + 3]
        root = np.sqrt(max(a1**2 / 4 - a0, 0.0))
        rows.append([a1 / 2 - root, a1 / 2 + root] if root else [np.sqrt(a0)] * 2)
    return np.array(rows)


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
