r"""The H-infinity problem: the generalised plant of mixed sensitivity, and its minimum gamma between proven bounds.

The generalised plant (thesis eq. E.16) has 12 states for Model 3:

.. math:: z = \begin{bmatrix} W_p (w_1 + G u + G_f w_2)\\ W_u u\end{bmatrix}, \qquad y = w_1 + G u + G_f w_2

w_1 disturbs the output, as in the thesis. w_2, absent unless `force` is positive, disturbs the rotor's accelerations,
as a hammer does; without it an optimal controller may cancel the plant's lightly damped poles, which then stay in the
answer to forces.

The weighting filters are those of thesis E.13 to E.15 and of Paper G (G.6 to G.8), with rates per ms:

.. math:: w_p = \frac{s^2 + 2\zeta_1\omega s + \omega^2 k_0}{s^2 + 2\zeta_2\omega s + \omega^2}, \qquad
          w_u = \frac{s/M_b + \omega_b}{s + \omega_b A_b}

Bounds of gamma come from above by loops: a gamma is reached where a controller's own closed loop is stable and its norm
is below gamma. From below by Parrott's theorem at single frequencies, D11 among them (infinity): with the rows V of the
left null space

.. math:: V \begin{bmatrix} A - i\omega I & B_2\\ C_1 & D_{12} \end{bmatrix} = 0, \quad V = [V_1\; V_2]: \quad
          \gamma \ge \bar\sigma\left((V_2 V_2^H)^{-1/2} (V_1 B_1 + V_2 D_{11})\right)

whatever the controller, and the same of the transposed plant. Between the two the theorem below decides: a central
controller whose loop is unstable, by more than rounding, shows that no other reaches its gamma either. Where rounding
leaves it open nothing is concluded, and another gamma is tried. Below the gammas refused in this way more are tried:
one that is reached after all shows that the theorem's word cannot be taken there.

The central controller for a given gamma is that of Zhou, Doyle, Glover (1996), theorem 17.1. After scaling u and z so
that D12 = [0; I], and y and w so that D21 = [0 I], with D_{1*} = [D11 D12], D_{*1} = [D11; D21]:

.. math:: R = D_{1*}^T D_{1*} - diag(\gamma^2 I, 0), \qquad \tilde R = D_{*1} D_{*1}^T - diag(\gamma^2 I, 0)

A controller with norm below gamma exists if both Riccati equations have stabilising solutions X, Y >= 0 whose product
has a spectral radius below gamma^2; this one then has it, and its loop is unstable otherwise. The signs of X and Y are
therefore not asked for here (where X = 0 they are rounding): the loop is asked. A diagonal scaling of
the plant's states (balancing) improves the conditioning first.

Cites: benner_2001, skogestad_2005, thesis, zhou_1996.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.linalg import matrix_balance, schur

from rotorsim.base.errors import DesignError
from rotorsim.base.rounding import EPS, unstable_poles
from rotorsim.control.designs.specification import Specification, number
from rotorsim.control.plants import axis_modes
from rotorsim.control.systems import System, block_diag, equalising, largest, peak_gain, side_by_side, with_middles


@dataclass(frozen=True)
class Weights(Specification):
    """Weights of thesis section E.3."""

    zeta_1: float = number(0.3, "1", "Damping ratio of W_p's zeros; W_p and its inverse are stable above 0.", above=0)
    zeta_2: float = number(0.05, "1", "Damping ratio of W_p's poles; W_p and its inverse are stable above 0.", above=0)
    k_0: float = number(1 / 3, "1", "W_p at rest; W_p and its inverse are stable above 0.", above=0)
    A_b: float = number(10.0, "1", "Inverse of W_u at rest; W_u and its inverse are stable above 0.", above=0)
    over_M_b: float = number(15.0, "1", "1/M_b: W_u at high frequency.")
    omega_b: float = number(
        2000 * np.pi, "1/s", "Corner of W_u; W_u and its inverse are stable above 0.", above=0, example=6280.0
    )
    force: float = number(0.0, "1", "Level of the force among the disturbances.", low=0)


RIG = Weights(zeta_2=0.1, k_0=0.9, force=0.3)
"""Weights for the virtual rig, chosen by a search over a grid of weights on its identified Model 2 alone.

The thesis' k_0 = 1/3 lets the loop amplify slow disturbances three times: the law softens the bearing, and hits of 20 N
then leave the range in which the film is linear. A force among the disturbances asks for damping instead.
"""
MILD = Weights(k_0=0.5, force=0.1)
"""Between the thesis' weights and `RIG`: hits of 20 N stay where the film is linear. They were picked by runs of the
plant at the twenty points of `rotorsim.verify`, out of eight sets, with an LPV law of constant Y; at the twelve
others of that search LPV leaves 0.66, H-infinity 0.655."""


class Generalised(NamedTuple):
    """x' = A x + B1 w + B2 u, z = C1 x + D11 w + D12 u, y = C2 x + D21 w (+ D22 u, which is zero)."""

    A: np.ndarray
    B1: np.ndarray
    B2: np.ndarray
    C1: np.ndarray
    C2: np.ndarray
    D11: np.ndarray
    D12: np.ndarray
    D21: np.ndarray

    @property
    def order(self) -> int:
        """Number of states."""
        return len(self.A)


def mixed_sensitivity(plant: System, weights: Weights) -> Generalised:
    """The generalised plant of a continuous plant in um, V and ms."""
    wx, wy = axis_modes(plant)
    Wp = side_by_side(*(notch(w, weights.zeta_1, weights.zeta_2, weights.k_0) for w in (wx, wy)))
    one = high_pass(weights.omega_b / 1e3, weights.A_b, weights.over_M_b)
    Wu = side_by_side(one, one)
    n, p, u = plant.order, Wp.order, Wu.order
    Bf = np.zeros((n, 0))
    if weights.force > 0:
        Bf = np.zeros((n, 2))
        Bf[2:4] = weights.force * np.eye(2)
    nw = 2 + Bf.shape[1]
    W1 = np.hstack([np.eye(2), np.zeros((2, nw - 2))])
    A = block_diag(plant.A, Wp.A, Wu.A)
    A[n : n + p, :n] = Wp.B @ plant.C
    B1 = np.vstack([np.hstack([np.zeros((n, 2)), Bf]), Wp.B @ W1, np.zeros((u, nw))])
    B2 = np.vstack([plant.B, np.zeros((p, 2)), Wu.B])
    C1 = np.block([[Wp.D @ plant.C, Wp.C, np.zeros((2, u))], [np.zeros((2, n + p)), Wu.C]])
    C2 = np.hstack([plant.C, np.zeros((2, p + u))])
    D11 = np.vstack([Wp.D @ W1, np.zeros((2, nw))])
    return Generalised(A, B1, B2, C1, C2, D11, np.vstack([np.zeros((2, 2)), Wu.D]), W1)


def closed(P: Generalised, K: System) -> System:
    """From w to z with the controller in place."""
    A = np.block([[P.A + P.B2 @ K.D @ P.C2, P.B2 @ K.C], [K.B @ P.C2, K.A]])
    B = np.vstack([P.B1 + P.B2 @ K.D @ P.D21, K.B @ P.D21])
    C = np.hstack([P.C1 + P.D12 @ K.D @ P.C2, P.D12 @ K.C])
    return System(A, B, C, P.D11 + P.D12 @ K.D @ P.D21)


def notch(omega: float, zeta_1: float, zeta_2: float, k_0: float, level: float = 1.0) -> System:
    """level * w_p in the thesis' realisation (G.7), states y and y' of the filter."""
    A = np.array([[0.0, 1.0], [-(omega**2), -2 * zeta_2 * omega]])
    C = level * np.array([[omega**2 * (k_0 - 1), 2 * omega * (zeta_1 - zeta_2)]])
    return System(A, np.array([[0.0], [1.0]]), C, np.array([[level]]))


def high_pass(omega_b: float, A_b: float, over_M_b: float) -> System:
    """w_u; `over_M_b` is 1/M_b, the gain at high frequency, 1/A_b that at rest."""
    pole = omega_b * A_b
    return System(
        np.array([[-pole]]), np.array([[1.0]]), np.array([[omega_b - over_M_b * pole]]), np.array([[over_M_b]])
    )


TOLERANCE = 1e-6
ROUNDING = 3e-6
"""Share by which the norm of a loop may exceed the gamma that it was made for."""
LEAST, HIGHEST = 1e-9, 1e12
"""Gamma that counts as zero, and largest gamma that is searched, both in the plant's own unit."""
SHARES = (0.5, 0.25, 0.75, 0.125, 0.375, 0.625, 0.875)
"""Places in a bracket that are tried, in turn."""


class Bounds(NamedTuple):
    """No controller goes below `low`, one reaches `high`."""

    low: float
    high: float


def solve(P: Generalised, tolerance: float = TOLERANCE) -> float:
    """Smallest gamma that a controller was seen to reach; raises DesignError if none stabilises the plant."""
    return bounds(P, tolerance).high


def controller(P: Generalised, gamma: float) -> System:
    """The central controller for gamma, whose loop keeps it; raises DesignError if there is none."""
    scaled = normalised(P)
    found = central(scaled.P, gamma / scaled.unit)
    if found is None:
        raise DesignError(why_out_of_reach(scaled, gamma))
    K = System(found.A, found.B @ scaled.Sy, scaled.Su @ found.C, scaled.Su @ found.D @ scaled.Sy)
    norm = peak_gain(closed(P, K))
    if norm <= gamma * (1 + ROUNDING):
        return K
    if np.isfinite(norm):
        raise DesignError(
            f"h-infinity: by rounding the controller for gamma = {gamma:.7g} reaches {norm:.7g}; raise backoff"
        )
    raise DesignError(why_out_of_reach(scaled, gamma))


def bounds(P: Generalised, tolerance: float = TOLERANCE) -> Bounds:
    """Proven bounds of the smallest gamma; raises DesignError if no controller stabilises the plant."""
    scaled = normalised(P)
    P, floor = scaled.P, max(frequency_bound(scaled.P), LEAST)
    highest = HIGHEST * max(floor, 1.0)
    high = next((g for g in np.geomspace(2 * floor, highest, 30) if reached(P, g)), None)
    if high is None:
        raise DesignError(why_out_of_reach(scaled, highest * scaled.unit))
    found = enclosed(partial(reached, P), Bounds(floor, high), tolerance)
    return Bounds(float(found.low * scaled.unit), float(found.high * scaled.unit))


Decide = Callable[[float], bool | None]
"""Whether a gamma is reached (a proof), is not (the theorem's word), or nothing can be concluded."""


def enclosed(decide: Decide, proven: Bounds, tolerance: float) -> Bounds:
    """Bounds that hold whatever `decide` refuses: where it reaches less than it refused, only the proven low stays."""
    found, contradicted = narrowed(decide, proven, tolerance), False
    while found.low > proven.low * (1 + tolerance):
        below = next((g for g in between(proven.low, found.low) if decide(g)), None)
        if below is None:
            break
        found, contradicted = narrowed(decide, Bounds(proven.low, below), tolerance), True
    return Bounds(proven.low, found.high) if contradicted else found


def narrowed(decide: Decide, found: Bounds, tolerance: float) -> Bounds:
    """Bounds `tolerance` apart, tried from below first, or as near as decisions go."""
    low, high = found
    if decide(gamma := low * (1 + tolerance)) and gamma < high:
        return Bounds(low, gamma)
    while high > low * (1 + tolerance):
        answers = ((gamma, decide(gamma)) for gamma in between(low, high))
        gamma, answer = next((one for one in answers if one[1] is not None), (high, None))
        if answer is None:
            break
        low, high = (low, gamma) if answer else (gamma, high)
    return Bounds(low, high)


def between(low: float, high: float) -> Iterator[float]:
    """Gammas within a bracket, its middle first."""
    return (low ** (1 - share) * high**share for share in SHARES)


def reached(P: Generalised, gamma: float) -> bool | None:
    """Whether a normalised plant's central controller keeps gamma; None where rounding leaves it open."""
    K = central(P, gamma)
    if K is None:
        return None
    loop = closed(P, K)
    if unstable_poles(loop.A):
        return False
    return True if peak_gain(loop) <= gamma * (1 + ROUNDING) else None


def frequency_bound(P: Generalised) -> float:
    """Lower bound on gamma from single frequencies, for any controller (Parrott's theorem)."""
    best = max(highest_frequency_bound(P), parrott(P, np.append(np.abs(np.linalg.eigvals(P.A)), 0.0)))
    while best > 0 and (better := parrott(P, level_frequencies(P, best * (1 + TOLERANCE)))) > best:
        best = better
    return best


def level_frequencies(P: Generalised, gamma: float) -> np.ndarray:
    """Frequencies at which a single one may force gamma: eigenvalues of both Hamiltonians, and between them."""
    values = [np.linalg.eigvals(hamiltonian(*equation(side, gamma)[:3])[0]) for side in (P, dual(P))]
    return with_middles(np.concatenate(values))


def parrott(P: Generalised, frequencies: np.ndarray) -> float:
    """Largest gamma that one of the frequencies (f,) forces."""
    return max(_gain_beyond_u(P, frequencies), _gain_beyond_u(dual(P), frequencies))


def _gain_beyond_u(P: Generalised, frequencies: np.ndarray) -> float:
    """Largest gain from w to the part of z that u does not reach, at the frequencies (f,)."""
    n, (p, m) = P.order, P.D12.shape
    if p == m:
        return 0.0
    states = np.diag(np.repeat([1.0, 0.0], [n, max(p, m)]))[: n + p, : n + m]
    pencil = np.block([[P.A, P.B2], [P.C1, P.D12]]) - 1j * frequencies[:, None, None] * states
    V = np.linalg.svd(pencil)[0][..., m - p :].conj().swapaxes(-1, -2)
    Q, size, _ = np.linalg.svd(V[..., n:], full_matrices=False)
    known = size[:, -1] > 1e-8  # else a mode next to the axis is out of u's reach, and V2 has no digits
    gain = Q.conj().swapaxes(-1, -2) @ (V @ np.vstack([P.B1, P.D11]))
    return float(largest(gain[known] / size[known][..., None]).max(initial=0.0))


def why_out_of_reach(scaled: Scaled, gamma: float) -> str:
    """Which condition of the theorem fails."""
    P, unit = scaled.P, scaled.unit
    text = f"h-infinity: no controller reaches gamma = {gamma:.4g}: "
    highest, single = highest_frequency_bound(P) * unit, frequency_bound(P) * unit
    if gamma <= highest:
        return text + f"the weights at infinite frequency alone ask for {highest:.4g}; lower W_p there"
    if gamma <= single:
        return text + f"the weights at a single frequency alone ask for {single:.4g}; lower W_p or W_u there"
    for side, word in ((P, "the state-feedback Riccati equation (W_p against W_u) has no solution; lower W_p or W_u"),
                       (dual(P), "the estimation Riccati equation has no solution; the disturbances are not seen well "
                                 "enough")):  # fmt: skip
        found = state_side(side, gamma / unit)
        if found is None or unstable_poles(side.A + side.B2 @ found[1][side.B1.shape[1] :]):
            return text + word
    return text + "both Riccati equations hold and only their coupling fails; relax W_p or W_u a little"


class Scaled(NamedTuple):
    """Plant with normal D12, D21 in balanced states and with z in a unit of its own; u = Su u', y' = Sy y."""

    P: Generalised
    Su: np.ndarray
    Sy: np.ndarray
    unit: float


def normalised(P: Generalised) -> Scaled:
    """The plant with D12 = [0; I] and D21 = [0 I]; raises DesignError where a rank is missing."""
    Q, Su = _columns_last(P.D12, "D12: some reference costs nothing at high frequency; give W_u a gain there")
    Qw, Sy = _columns_last(P.D21.T, "D21: some measurement has no disturbance; give it noise")
    Sy = Sy.T
    scaled = balanced(Generalised(
        P.A, P.B1 @ Qw, P.B2 @ Su, Q.T @ P.C1, Sy @ P.C2, Q.T @ P.D11 @ Qw, Q.T @ P.D12 @ Su, Sy @ P.D21 @ Qw
    ))  # fmt: skip
    unit = _unit(scaled)
    scaled = scaled._replace(C1=scaled.C1 / unit, D11=scaled.D11 / unit, B2=scaled.B2 * unit)
    return Scaled(balanced(scaled), Su * unit, Sy, unit)


def _unit(P: Generalised) -> float:
    """The unit of z in which w to z is as large as u to y: a power of two."""
    into, out = (float(np.linalg.norm(one)) / max(float(np.linalg.norm(two)), 1e-300)
                 for one, two in ((P.B1, P.B2), (P.C1, P.C2)))  # fmt: skip
    return float(2.0 ** np.round(np.log2(into * out) / 2)) if 0 < into * out < np.inf else 1.0


def _columns_last(D: np.ndarray, fault: str) -> tuple[np.ndarray, np.ndarray]:
    """Orthogonal Q and S with Q' D S = [0; I]; columns of D may differ in unit."""
    m = D.shape[1]
    units = np.linalg.norm(D, axis=0)
    units = 2.0 ** np.round(np.log2(np.where(units > 0, units, 1.0)))
    U, values, V = np.linalg.svd(D / units)
    if len(values) < m or values[-1] <= 1e-12 * values[0]:
        raise DesignError(f"h-infinity: rank of {fault}")
    return np.hstack([U[:, m:], U[:, :m]]), V.T / values / units[:, None]


def highest_frequency_bound(P: Generalised) -> float:
    """Lower bound on gamma from D11 alone, the plant at infinite frequency."""
    m2, p2 = P.B2.shape[1], P.C2.shape[0]
    top, left = P.D11[: P.D11.shape[0] - m2], P.D11[:, : P.D11.shape[1] - p2]
    return max((float(np.linalg.norm(block, 2)) for block in (top, left) if block.size), default=0.0)


def central(P: Generalised, gamma: float) -> System | None:
    """Central controller of a normalised plant; None where a Riccati equation has no stabilising solution."""
    if gamma <= highest_frequency_bound(P):
        return None
    state, output = state_side(P, gamma), state_side(dual(P), gamma)
    if state is None or output is None:
        return None
    try:
        K = _assemble(P, gamma, *state, output[0], output[1].T)
    except np.linalg.LinAlgError:
        return None
    return K if all(np.all(np.isfinite(M)) for M in K) else None


def dual(P: Generalised) -> Generalised:
    """The transposed plant."""
    return Generalised(P.A.T, P.C1.T, P.C2.T, P.B1.T, P.B2.T, P.D11.T, P.D21.T, P.D12.T)


def state_side(P: Generalised, gamma: float) -> tuple[np.ndarray, np.ndarray] | None:
    """X and F = -R^-1 (D1*' C1 + B' X) of one Riccati equation, None where it has no stabilising solution."""
    try:
        A, S, Q, G, inner = equation(P, gamma)
        X = stabilising(A, S, Q)
    except np.linalg.LinAlgError:
        return None
    return None if X is None else (X, -(G + inner @ X))


def equation(P: Generalised, gamma: float) -> tuple[np.ndarray, ...]:
    """A, S, Q of A'X + XA - X S X + Q = 0, and R^-1 D1*' C1, R^-1 B'."""
    B, D = np.hstack([P.B1, P.B2]), np.hstack([P.D11, P.D12])
    m1, n = P.B1.shape[1], P.order
    R = D.T @ D
    R[:m1, :m1] -= gamma**2 * np.eye(m1)
    inner = np.linalg.solve(R, np.hstack([D.T @ P.C1, B.T]))
    G, S = inner[:, :n], inner[:, n:]
    return P.A - B @ G, B @ S, P.C1.T @ P.C1 - P.C1.T @ D @ G, G, S


def hamiltonian(A: np.ndarray, S: np.ndarray, Q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The Hamiltonian balanced by states x_i / t_i and costates x_i t_i, and t (n,) (Benner 2001)."""
    n = len(A)
    H = np.block([[A, -S], [-Q, -A.T]])
    _, (scale, _) = matrix_balance(H, permute=False, separate=True)
    t = 2.0 ** np.round((np.log2(scale[:n]) - np.log2(scale[n:])) / 2)
    both = np.concatenate([t, 1 / t])
    return H * both / both[:, None], t


def stabilising(A: np.ndarray, S: np.ndarray, Q: np.ndarray) -> np.ndarray | None:
    """X with A'X + XA - X S X + Q = 0 and A - S X stable from the ordered Schur form, or None."""
    n = len(A)
    H, t = hamiltonian(A, S, Q)
    _, Z, count = schur(H, output="real", sort="lhp")
    fold = Z[:n, :n].T @ Z[n:, :n]
    if count != n or np.abs(fold - fold.T).max() > np.sqrt(EPS):  # X is symmetric, or the axis split a pair
        return None
    X = np.linalg.solve(Z[:n, :n].T, Z[n:, :n].T) / t / t[:, None]
    return (X + X.T) / 2


def _assemble(P: Generalised, gamma: float, X: np.ndarray, F: np.ndarray, Y: np.ndarray, L: np.ndarray) -> System:
    m1, m2 = P.B1.shape[1], P.B2.shape[1]
    p1, p2 = P.C1.shape[0], P.C2.shape[0]
    a, b = p1 - m2, m1 - p2
    D1111, D1112, D1121, D1122 = P.D11[:a, :b], P.D11[:a, b:], P.D11[a:, :b], P.D11[a:, b:]
    middle = np.linalg.solve(gamma**2 * np.eye(a) - D1111 @ D1111.T, D1112)
    DK = -D1121 @ D1111.T @ middle - D1122
    F12, F2 = F[b:m1], F[m1:]
    L12, L2 = L[:, a:p1], L[:, p1:]
    Z = np.linalg.inv(np.eye(P.order) - Y @ X / gamma**2)
    BK = Z @ (-L2 + (P.B2 + L12) @ DK)
    CK = F2 - DK @ (P.C2 + F12)
    AK = P.A + np.hstack([P.B1, P.B2]) @ F - BK @ (P.C2 + F12)
    return System(AK, BK, CK, DK)


def balance(plants: list[Generalised]) -> np.ndarray:
    """One diagonal scaling (n,) that equalises rows and columns of the largest entries over all plants."""
    whole = []
    for P in plants:
        inputs, outputs = np.hstack([P.B1, P.B2]), np.vstack([P.C1, P.C2])
        whole.append(np.abs(np.block([[P.A, inputs], [outputs, np.zeros((outputs.shape[0], inputs.shape[1]))]])))
    return equalising(np.max(whole, axis=0), plants[0].order)


def rescaled(P: Generalised, T: np.ndarray) -> Generalised:
    """The plant in the states T x."""
    return P._replace(A=P.A * T[:, None] / T, B1=P.B1 * T[:, None], B2=P.B2 * T[:, None], C1=P.C1 / T, C2=P.C2 / T)


def balanced(P: Generalised) -> Generalised:
    """The plant in states scaled by powers of two, which round nothing."""
    return rescaled(P, 2.0 ** np.round(np.log2(balance([P]))))
