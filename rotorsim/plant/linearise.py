r"""The plant linearised about an equilibrium, from the analytic Jacobians of its own kernels.

States: q of every film node, plenum pressures, modal displacements and velocities; inputs: the two reference voltages,
the disc force (2) and the supply pressure; outputs: disc x, y. The film's descriptor form of `reynolds.perturbation`
couples to the rotor through X = Phi_b q and F; its storage matrix is diagonal, so A is explicit.

The delay of an axis is that of the film force behind the reference with the journal held in place: the phase delay of
-F_y (J + i omega S)^-1 J_u at the axis' natural frequency. It is what plenum and film take to answer the pin; nothing
in the model is called a delay.

Pins are ideal here, `pin_per_volt` metres for a volt: actuators are fast against the rotor, and their hysteresis has no
linear model. Forces that vary with the shaft angle (a crack) and the flow in a supply line are held.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, eigs, splu

from reynolds.injector import Injector
from reynolds.perturbation import LinearFilm, linear_film
from rotorsim.errors import DataError
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.equilibrium import damping, rows, stiffness

INPUTS = ("reference_x", "reference_y", "disc_force_x", "disc_force_y", "supply_pressure")
OUTPUTS = ("disc_x", "disc_y")


@dataclass(frozen=True, eq=False)
class LinearPlant:
    """S x' = J x + E u, y = H x with diagonal S; A, B, C, D [SI] follow.

    wn [rad/s], zeta and whirl ('forward', 'backward', 'mixed') are those of the oscillating modes, ascending in wn;
    static_gain (2, 2) [m/V] from reference to disc; delay (2,) [s] by axis. Eigenvalues are looked for around `near`
    [rad/s], the rotor's first natural frequency on its nominal bearing.
    """

    S: np.ndarray
    J: Any
    E: np.ndarray
    H: np.ndarray
    near: float
    film: LinearFilm | None = None
    inputs: tuple[str, ...] = INPUTS
    outputs: tuple[str, ...] = OUTPUTS

    @cached_property
    def A(self) -> np.ndarray:
        """State matrix (n, n), dense."""
        return np.asarray(self.J.toarray() / self.S[:, None])

    @cached_property
    def B(self) -> np.ndarray:
        """Input matrix (n, 5)."""
        return self.E / self.S[:, None]

    @property
    def C(self) -> np.ndarray:
        """Output matrix (2, n)."""
        return self.H

    @property
    def D(self) -> np.ndarray:
        """Feedthrough (2, 5): none."""
        return np.zeros((2, len(self.inputs)))

    def transfer(self, s: complex) -> np.ndarray:
        """Transfer function (2, 5) at the complex frequency s [rad/s]."""
        return np.asarray(self.H @ splu((s * sparse.diags(self.S) - self.J).tocsc()).solve(self.E.astype(complex)))

    @cached_property
    def _modes(self) -> tuple[np.ndarray, np.ndarray]:
        values, vectors = _near_eigenvalues(self.S, self.J, self.near)
        keep = values.imag > 0.44 * np.abs(values)
        order = np.argsort(np.abs(values[keep]))
        return values[keep][order], vectors[:, keep][:, order]

    @property
    def eigenvalues(self) -> np.ndarray:
        """Eigenvalues [rad/s] with zeta < 0.9 near the first critical speeds, upper half plane, ascending."""
        return self._modes[0]

    @property
    def wn(self) -> np.ndarray:
        """Natural frequencies |s| [rad/s]."""
        return np.abs(self._modes[0])

    @property
    def zeta(self) -> np.ndarray:
        """Damping ratios -Re s / |s|."""
        return -self._modes[0].real / np.abs(self._modes[0])

    @property
    def _disc_shapes(self) -> np.ndarray:
        return self.H @ self._modes[1]

    @property
    def whirl(self) -> tuple[str, ...]:
        """Sense of whirl of each mode at the disc, from its orbit: forward is from x to y."""
        x, y = self._disc_shapes
        sense = 2 * np.imag(np.conj(x) * y) / (np.abs(x) ** 2 + np.abs(y) ** 2)
        # x = Re(X exp(st)): the orbit turns from x to y when y lags x, Im(conj(X) Y) < 0
        return tuple("mixed" if abs(v) < 0.02 else ("forward" if v < 0 else "backward") for v in sense)

    @cached_property
    def static_gain(self) -> np.ndarray:
        """Disc displacement per volt of reference (2, 2) [m/V]."""
        return np.asarray(-(self.H @ splu(self.J.tocsc()).solve(self.E[:, :2])))

    @cached_property
    def delay(self) -> np.ndarray:
        """Delay (2,) [s] of the film force behind the reference of its axis; NaN without injectors."""
        if self.film is None or not self.E[:, :2].any():
            return np.full(2, np.nan)
        n = len(self.film.S)
        delays = np.zeros(2)
        for axis in range(2):
            omega = self.wn[self._mode_of_axis(axis)]
            matrix = self.film.J + 1j * omega * sparse.diags(self.film.S)
            force = self.film.F_y @ splu(matrix.tocsc()).solve(self.E[:n, axis].astype(complex))
            static = self.film.F_y @ splu(self.film.J.tocsc()).solve(self.E[:n, axis])
            delays[axis] = -np.angle(force[axis] / static[axis]) / omega
        return delays

    def _mode_of_axis(self, axis: int) -> int:
        """Which of the two lowest modes moves the disc most along an axis."""
        shapes = np.abs(self._disc_shapes[:, :2])
        share = shapes / shapes.sum(axis=0)
        return int(share[axis].argmax())


def linearise(a: Assembly, w: np.ndarray, speed: float) -> LinearPlant:
    """Linear model about the equilibrium in workspace w at `speed` [rad/s]."""
    if a.film_model is None:
        return _rotor_only(a, w, speed)
    film = linear_film(a.film_model, a.film, w, a.ix, a.P.film, speed)
    K, C, Bf, Bd = _rotor(a, w, speed)
    n, m = len(film.S), len(K)
    eye = sparse.identity(m)
    J = sparse.bmat(
        [
            [-film.J, -sparse.csr_matrix(film.J_X @ Bf), -sparse.csr_matrix(film.S_X @ Bf)],
            [None, None, eye],
            [sparse.csr_matrix(Bf.T @ film.F_y), -sparse.csr_matrix(K), -sparse.csr_matrix(C)],
        ]
    ).tocsc()  # fmt: skip
    E = np.zeros((n + 2 * m, 5))
    E[:n, :2] = -film.J_u[:, :-1] @ _pin_gains(a)
    E[:n, 4] = -film.J_u[:, -1]
    E[n + m :, 2:4] = Bd.T
    H = np.hstack([np.zeros((2, n)), Bd, np.zeros((2, m))])
    return LinearPlant(np.concatenate([film.S, np.ones(2 * m)]), J, E, H, a.mesh.reduced.frequencies.min(), film)


def _pin_gains(a: Assembly) -> np.ndarray:
    """Change of each pin's conductance per volt of reference (n_inj, 2)."""
    L, common = a.film, a.machine.injection
    gains = np.zeros((L.n_inj, 2))
    if common is None or a.film_model is None:
        return gains
    for k, injector in enumerate(a.film_model.injectors):
        step = 1e-9
        slope = (_conductance(a, k, injector, step) - _conductance(a, k, injector, -step)) / (2 * step)
        gains[k] = slope * a.P.pin_x[k], slope * a.P.pin_y[k]
    return gains


def _conductance(a: Assembly, k: int, injector: Injector, step: float) -> float:
    """Pin conductance of injector k with its pin `step` [m] beyond the bias, effects on it included."""
    common = a.machine.injection
    assert common is not None
    opening = max(common.seat_gap - common.pin_bias - step, common.minimum_gap) / common.seat_gap
    for call in a.calls:
        if call.effect.port == "injector":
            kernel = type(call.effect).kernel
            opening, _ = getattr(kernel, "py_func", kernel)(0.0, k, opening, 0.0, getattr(a.P, call.record))
    return injector.conductance((1 - opening) * common.seat_gap)


def _rotor(a: Assembly, w: np.ndarray, speed: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Modal stiffness and damping, rows of journal and disc; a support that does not move the film is left out."""
    K, C, Bd = stiffness(a, w, speed), damping(a, w, speed), rows(a, a.rotor.disc, w)
    Bf = np.zeros_like(Bd) if a.film_model is None else rows(a, a.rotor.journal, w)
    moves = (np.arange(a.rotor.n) < a.rotor.n_shaft) | Bf.any(axis=0)
    moves[a.rotor.n_shaft :] = np.repeat(moves[a.rotor.n_shaft :].reshape(-1, 2).any(axis=1), 2)
    return K[np.ix_(moves, moves)], C[np.ix_(moves, moves)], Bf[:, moves], Bd[:, moves]


def _rotor_only(a: Assembly, w: np.ndarray, speed: float) -> LinearPlant:
    K, C, _, Bd = _rotor(a, w, speed)
    m = len(K)
    J = np.block([[np.zeros((m, m)), np.eye(m)], [-K, -C]])
    E = np.zeros((2 * m, 5))
    E[m:, 2:4] = Bd.T
    near = a.mesh.reduced.frequencies.min()
    return LinearPlant(np.ones(2 * m), sparse.csc_matrix(J), E, np.hstack([Bd, np.zeros((2, m))]), near)


def _near_eigenvalues(S: np.ndarray, J: Any, near: float, count: int = 8) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues of (J, S) nearest to i near, by shift and invert (all of them when the system is small)."""
    n = len(S)
    if n <= 4 * count:
        return np.linalg.eig(J.toarray() / S[:, None])
    shift = 1j * near
    factor = splu((J - shift * sparse.diags(S)).tocsc())
    operator = LinearOperator((n, n), matvec=lambda x: factor.solve(S * x), dtype=complex)
    start = np.ones(n, complex)
    inverse, vectors = eigs(operator, k=count, v0=start, tol=1e-12)
    if not np.all(np.isfinite(inverse)):
        raise DataError("linearise: the eigenvalues did not converge; refine the grid")
    return shift + 1 / inverse, vectors


__all__ = ["INPUTS", "OUTPUTS", "LinearPlant", "linearise"]
