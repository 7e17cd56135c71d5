r"""Linear model of the plant about an equilibrium, from the analytic Jacobians of its kernels.

States: q of every film node, plenum pressures, modal displacements and velocities; inputs: the two reference voltages,
the disc force (2) and the supply pressure; outputs: disc x, y. The film's descriptor form of `reynolds.perturbation`
couples to the rotor through X = Phi_b q and F; its storage matrix is diagonal, so A is explicit.

The delay of an axis is that of the film force behind the reference with the journal held in place: the phase delay of
-F_y (J + i omega S)^-1 J_u at the axis' natural frequency. It is what plenum and film take to answer the pin; nothing
in the model is called a delay.

Pins are ideal here, `pin_per_volt` metres for a volt times the gain of the effects on their references: actuators are
fast against the rotor, and their hysteresis has no linear model. Delays of references are not in the model. Forces that
vary with the shaft angle (a crack) and the flow in a supply line are held.

One LU factorisation gives the film's frequency response at complex frequency s: dynamic stiffness, damping, actuation.
With A(s) = J + s S of `reynolds.perturbation` and L(s) = A^-T F_y' (two adjoint solves),

.. math:: Z(s) = L'(J_X + s S_X), \qquad \delta F = -Z X - L' J_u u, \qquad
          K + i\omega C = Z(i\omega), \qquad C(0) = L'(S_X - S A^{-1} J_X)

Modes come from one search, that of `fe_shaft.spectrum`: all of a stated region, their number proven by the argument
principle. The determinant of a film is divided by its diagonal, whose roots are real and negative: what is left turns
little along the border.

Cites: hamrock_2004.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse

from fe_shaft.pencil import Modes, Region, each_once, log_of
from reynolds.injector import Injector
from reynolds.perturbation import Kernels, LinearFilm, linear_film, side_by_side, tilted_film, with_tilt
from rotorsim.base.display import Card, Shown
from rotorsim.base.errors import DataError
from rotorsim.base.processes import one_thread
from rotorsim.base.rounding import first_of_largest, repeated, whirl_sense
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.film_response import FilmFactors, FilmResponse
from rotorsim.plant.simulation import damping, rows, stiffness

INPUTS = ("reference_x", "reference_y", "disc_force_x", "disc_force_y", "supply_pressure")
OUTPUTS = ("disc_x", "disc_y")
DAMPED = 0.5
"""Damping ratio from which a mode lies outside the region."""
ABOVE = 1.02
"""Reach of a region over the highest frequency that it has to hold."""
BELOW = 1e-4
"""Floor of a region over its reach."""
FIRST = 2
"""Pairs of the rotor's modes on its nominal bearings that a region holds."""
STIFFER = 2.0
"""Factor up to which films may raise the frequencies of these pairs before they leave the region of a linear model."""


STILL = 1e-7
"""Motion of the disc over what its modes' displacements could move it, up to which it stands still."""
LAST_KINK = 2e3
"""Least speed [rad/s] of the last kink, which lies beyond those of all tables: they hold their values there."""


def region_up_to(hints: np.ndarray, highest: float) -> Region:
    """Region of modes up to the `highest` speed and of the first pairs among the rotor's natural frequencies (n,).

    All in rad/s.
    """
    reach = ABOVE * max(highest, 1.1 * float(np.sort(hints)[: 2 * FIRST].max()))
    return Region(reach, BELOW * reach, DAMPED)


@dataclass(frozen=True, eq=False)
class LinearRotor:
    """Modal stiffness, damping (m, m) at speed, rows of the journals Bf (2 films, m)."""

    stiffness: np.ndarray
    damping: np.ndarray
    Bf: np.ndarray

    def at(self, s: np.ndarray) -> np.ndarray:
        """Dynamic stiffness (k, m, m) without films at complex frequencies s (k,) [rad/s]."""
        found = self.stiffness + s[:, None, None] * self.damping
        diagonals = np.einsum("kii->ki", found)
        diagonals += s[:, None] ** 2
        return found


@dataclass(frozen=True, eq=False, repr=False)
class LinearPlant(Shown):
    """S x' = J x + E u, y = H x with diagonal S; A, B, C, D [SI] follow.

    wn [rad/s], zeta and whirl ('forward', 'backward', 'mixed') are those of the oscillating modes, ascending in wn: all
    of the `region`, damping ratios below one half, if their number is `proven`.
    static_gain (2, 2) [m/V] from reference to disc; delay (2,) [s] by axis. `hints` (k,) [rad/s] are the natural
    frequencies of the rotor on its nominal bearings. `rotor` holds modal stiffness and damping and the rows of the
    journal; the film's own matrices are in `film`; the shaft turns at `speed` [rad/s].
    """

    S: np.ndarray
    E: np.ndarray
    H: np.ndarray
    hints: np.ndarray
    rotor: LinearRotor
    film: LinearFilm | None = None
    speed: float = 0.0
    inputs: tuple[str, ...] = INPUTS
    outputs: tuple[str, ...] = OUTPUTS
    complete: dict[Region, Modes] = field(default_factory=dict, init=False)

    def card(self) -> Card:
        """States, modes, signals."""
        modes = [
            f"{wn / (2 * np.pi):.4g} Hz, damping {zeta:.3g}, {whirl}"
            for wn, zeta, whirl in zip(self.wn[:4], self.zeta, self.whirl, strict=False)
        ]
        rows = [(f"mode {k}", one) for k, one in enumerate(modes, 1)]
        if not self.proven:
            rows.append(("modes", "perhaps not all: their number is not proven"))
        rows += [("in", ", ".join(self.inputs)), ("out", ", ".join(self.outputs))]
        return Card(f"LinearPlant: {len(self.S)} states", rows)

    @cached_property
    def J(self) -> Any:
        """Sparse matrix (n, n) by columns."""
        film, Bf = self.film, self.rotor.Bf
        if film is None:
            return sparse.csc_matrix(self.A)
        springs, dampers = sparse.csr_matrix(self.rotor.stiffness), sparse.csr_matrix(self.rotor.damping)
        eye = sparse.identity(len(self.rotor.stiffness))
        return sparse.bmat(
            [
                [-film.J, -sparse.csr_matrix(film.J_X @ Bf), -sparse.csr_matrix(film.S_X @ Bf)],
                [None, None, eye],
                [sparse.csr_matrix(Bf.T @ film.F_y), -springs, -dampers],
            ]
        ).tocsc()  # fmt: skip

    @cached_property
    def A(self) -> np.ndarray:
        """State matrix (n, n), dense."""
        if self.film is None:
            m = len(self.rotor.stiffness)
            return np.block([[np.zeros((m, m)), np.eye(m)], [-self.rotor.stiffness, -self.rotor.damping]])
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

    def to_control(self) -> Any:
        """The model as control.StateSpace, continuous, of full order; inputs and outputs have their names.

        Its states are those of the model times powers of two (`balanced`): thicknesses of micrometres next to pressures
        of megapascals make slycot's frequency response wrong by percents.

        Raises DataError where the package `control` is missing.

        Examples
        --------
        >>> import rotorsim as rs
        >>> system = rs.Plant("dtu_gas_bearing").linearise(300.0, 0.5e6).to_control()
        >>> system.input_labels[:2]
        ['reference_x', 'reference_y']
        """
        from rotorsim.base.foreign_systems import balanced, state_space

        A, B, C = balanced(self.A, self.B, self.C)
        return state_space(A, B, C, self.D, 0.0, self.inputs, self.outputs)

    @cached_property
    def response(self) -> FilmResponse:
        """The film's answers over frequency; raises DataError for a machine without a film."""
        if self.film is None:
            raise DataError("linear model: the machine has no gas film, so there is no film response")
        return FilmResponse(self.film)

    def transfer(self, s: complex) -> np.ndarray:
        """Transfer function (2, 5) at the complex frequency s [rad/s]."""
        m = len(self.rotor.stiffness)
        shifted, drive = self.factor(s), self.E[-m:].astype(complex)
        if self.film is not None and shifted.film is not None:
            drive = drive + self.rotor.Bf.T @ (self.film.F_y @ shifted.film.solve(self.E[: -2 * m]))
        return np.asarray(self.H[:, -2 * m : -m] @ np.linalg.solve(shifted.stiffness[0], drive))

    def dynamic_stiffness(self, s: complex) -> np.ndarray:
        """Modal dynamic stiffness (m, m) of rotor and film."""
        return self.factor(s).stiffness[0]

    @property
    def region(self) -> Region:
        """Region of the complex plane [rad/s] whose modes are counted.

        It reaches over the speed and twice the first pairs of the rotor's modes on its nominal bearings, without a film
        over all modes that the rotor keeps.
        """
        if self.film is None:
            values = np.linalg.eigvals(self.A)
            return region_up_to(self.hints, float(np.abs(values[values.imag > 0]).max(initial=0.0)))
        return region_up_to(self.hints, max(abs(self.speed), STIFFER * float(np.sort(self.hints)[: 2 * FIRST].max())))

    @cached_property
    def modes(self) -> Modes:
        """All modes of the region and those that grow without oscillation; among others that the search met."""
        from fe_shaft.spectrum import modes_in  # a matrix alone needs none

        with one_thread():
            return modes_in(self, self.region, np.unique(np.round(self.hints, 3)).tolist())

    @property
    def proven(self) -> bool:
        """Whether it is proven that no mode of the region is missing."""
        return self.modes.proven

    @cached_property
    def _modes(self) -> tuple[np.ndarray, np.ndarray]:
        listed = self.modes.take(self.region.holds(self.modes.values))
        return listed.values, listed.right

    @property
    def eigenvalues(self) -> np.ndarray:
        """Eigenvalues [rad/s] of the modes listed, upper half plane, ascending."""
        return self._modes[0]

    @property
    def wn(self) -> np.ndarray:
        """Natural frequencies abs(s) [rad/s]."""
        return np.abs(self.eigenvalues)

    @property
    def zeta(self) -> np.ndarray:
        """Damping ratios -Re s / abs(s)."""
        return -self.eigenvalues.real / np.abs(self.eigenvalues)

    @property
    def vectors(self) -> np.ndarray:
        """States (n, n_modes) of each mode."""
        return self._modes[1]

    @property
    def shapes(self) -> np.ndarray:
        """Modal displacements of the rotor (m, n_modes) in each mode."""
        m = len(self.rotor.stiffness)
        return self._modes[1][-2 * m : -m]

    @property
    def _disc_shapes(self) -> np.ndarray:
        return self.H @ self._modes[1]

    @property
    def whirl(self) -> tuple[str, ...]:
        """Sense of whirl of each mode at the disc, from its orbit: forward is that of the rotation, x to y at rest."""
        return tuple(whirl_sense(self.whirl_ratio).tolist())

    @property
    def whirl_ratio(self) -> np.ndarray:
        """Roundness of each mode's orbit at the disc (n_modes,): 1 a forward circle, 0 a line, -1 a backward circle."""
        return self.roundness(*self._modes)

    def roundness(self, values: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """Roundness (k,) of the orbits of modes (n, k) at the disc, positive where they turn as the shaft does.

        It is 0 where an eigenvalue (k,) is there twice, as at rest: every orbit in the plane is a mode then. Where the
        disc stands still up to rounding, in a node of the mode, it is that of the whole shaft, weighted by its mass.
        """
        # x = Re(X exp(st)): the orbit turns from x to y when y lags x, Im(conj(X) Y) < 0
        m = len(self.rotor.stiffness)
        x, y = self.H @ vectors
        along, across = vectors[-2 * m : -m].reshape(2, m // 2, -1)  # the shaft's modes in one plane and in the other
        size, whole = np.abs(x) ** 2 + np.abs(y) ** 2, np.sum(np.abs(along) ** 2 + np.abs(across) ** 2, axis=0)
        still = size <= STILL**2 * np.sum(self.H**2) * whole
        area = np.where(still, np.sum(np.conj(along) * across, axis=0).imag, np.imag(np.conj(x) * y))
        found = -2 * area / np.where(still, whole, size)
        return np.where(repeated(values), 0.0, found if self.speed >= 0 else -found)

    @cached_property
    def static_gain(self) -> np.ndarray:
        """Disc displacement per volt of reference (2, 2) [m/V]."""
        return np.real(self.transfer(0)[:, :2])

    @cached_property
    def delay(self) -> np.ndarray:
        """Delay (2,) [s] of the film force behind the reference of its axis; NaN without injectors."""
        if self.film is None or not self.E[:, :2].any():
            return np.full(2, np.nan)
        pins = self.E[: len(self.film.S), :2]
        delays, static = np.zeros(2), self.response.factors(np.zeros(1)).solve(pins)
        for axis in range(2):
            omega = float(self.wn[self.mode_of_axis(axis)])
            moving = self.response.factors(np.array([1j * omega])).solve(pins[:, [axis]])
            force = self.film.F_y[axis]
            delays[axis] = -np.angle((force @ moving / (force @ static[:, [axis]])).item()) / omega
        return delays

    def mode_of_axis(self, axis: int) -> int:
        """Number, 0 or 1, of the low mode that moves the disc most along an axis; x has the lower of two alike."""
        shapes = np.abs(self._disc_shapes[:, :2])
        x = first_of_largest(shapes[0] / shapes.sum(axis=0))
        return x if axis == 0 else shapes.shape[1] - 1 - x

    @property
    def size(self) -> int:
        """Number of states n."""
        return len(self.S)

    def times_J(self, x: np.ndarray) -> np.ndarray:
        """J x for x (n, k)."""
        rotor, film, m = self.rotor, self.film, len(self.rotor.stiffness)
        y, q, v = x[: -2 * m], x[-2 * m : -m], x[-m:]
        force = -rotor.stiffness @ q - rotor.damping @ v
        if film is None:
            return np.concatenate([v, force])
        gas = -(film.J @ y) - film.J_X @ (rotor.Bf @ q) - film.S_X @ (rotor.Bf @ v)
        return np.concatenate([gas, v, force + rotor.Bf.T @ (film.F_y @ y)])

    def times_S(self, x: np.ndarray, transposed: bool = False) -> np.ndarray:
        """S x for x (n, k); S is diagonal, so the transposed one is the same."""
        return self.S[:, None] * x

    def factor(self, s: complex | np.ndarray) -> ShiftedPlant:
        """Factors of J - s S at s [rad/s], one or (k,)."""
        return ShiftedPlant(self, np.atleast_1d(s))

    @cached_property
    def log_det(self) -> Callable[[np.ndarray], np.ndarray]:
        """Logarithm at s (k,) of det(J - s S) over terms with roots that are real and negative, up to a constant.

        The determinant is that of the film with the journals held times that of the dynamic stiffness.
        """
        rotor = self.rotor

        def log_det(s: np.ndarray) -> np.ndarray:
            bare = rotor.at(s)
            if self.film is None:
                return log_of(bare)
            film = self.response.factors(s)
            return log_of(bare + rotor.Bf.T @ film.Z @ rotor.Bf) + film.log

        return each_once(log_det)


@dataclass(frozen=True, eq=False)
class ShiftedPlant:
    """J - s S at complex frequencies s (k,), with the film's factors and the rotor condensed onto them.

    Right-hand sides (n, k) have one column a frequency; with one frequency any number of columns is solved for.
    """

    model: LinearPlant
    s: np.ndarray

    @cached_property
    def film(self) -> FilmFactors | None:
        """The film at s; None without one."""
        return None if self.model.film is None else self.model.response.factors(self.s)

    @cached_property
    def stiffness(self) -> np.ndarray:
        """Modal dynamic stiffness (k, m, m)."""
        rotor = self.model.rotor
        bare = rotor.at(self.s)
        return bare if self.film is None else bare + rotor.Bf.T @ self.film.Z @ rotor.Bf

    @cached_property
    def _compliance(self) -> np.ndarray:
        return np.linalg.inv(self.stiffness)

    def solve(self, b: np.ndarray) -> np.ndarray:
        """(J - s S)^-1 b."""
        rotor, film, m = self.model.rotor, self.model.film, len(self.model.rotor.stiffness)
        y, v, force = b[: -2 * m], b[-2 * m : -m], b[-m:] + rotor.damping @ b[-2 * m : -m] + self.s * b[-2 * m : -m]
        if film is not None and self.film is not None:
            y = self.film.solve(y + film.S_X @ (rotor.Bf @ v))
            force = force + rotor.Bf.T @ (film.F_y @ y)
        q = -self._times(self._compliance, force)
        if film is not None and self.film is not None:
            X = rotor.Bf @ q
            y = -y - self.film.solve(film.J_X @ X + self.s * (film.S_X @ X))
        return np.concatenate([y, q, v + self.s * q])

    def adjoint(self, b: np.ndarray) -> np.ndarray:
        """(J - s S)^-H b."""
        rotor, film, m, back = self.model.rotor, self.model.film, len(self.model.rotor.stiffness), self.s.conj()
        y, force, last = b[: -2 * m], b[-2 * m : -m] + back * b[-m:], b[-m:]
        if film is not None and self.film is not None:
            y = self.film.solve(y, adjoint=True)
            force = force - rotor.Bf.T @ (film.J_X.T @ y + back * (film.S_X.T @ y))
        force = -self._times(self._compliance.conj().transpose(0, 2, 1), force)
        if film is not None and self.film is not None:
            y = self.film.solve(film.F_y.T @ (rotor.Bf @ force), adjoint=True) - y
            last = last + rotor.Bf.T @ (film.S_X.T @ y)
        return np.concatenate([y, last + rotor.damping.T @ force + back * force, force])

    def _times(self, matrices: np.ndarray, x: np.ndarray) -> np.ndarray:
        """A matrix (k, m, m) a frequency times its column of x (m, k); one matrix times all columns."""
        return matrices[0] @ x if len(self.s) == 1 else (matrices @ x.T[..., None])[..., 0].T


@dataclass(frozen=True, eq=False)
class RotorModels:
    """Linear models over speeds from 0 of a machine without films whose forces are linear in its motion.

    Stiffness and damping (kinks, 2, m, m) are linear in the speed between `kinks` (k,) [rad/s] and beyond the last.
    """

    first: LinearPlant
    kinks: np.ndarray
    matrices: np.ndarray

    def at(self, speed: float) -> LinearPlant:
        """The model at a speed [rad/s]."""
        k = min(max(int(np.searchsorted(self.kinks, speed)), 1), len(self.kinks) - 1)
        low, high = self.kinks[k - 1 : k + 1]
        before, after = self.matrices[k - 1 : k + 1]
        K, D = before + (speed - low) / (high - low) * (after - before)
        one = self.first
        return LinearPlant(one.S, one.E, one.H, one.hints, LinearRotor(K, D, one.rotor.Bf), None, speed)


def rotor_models(a: Assembly) -> RotorModels | None:
    """Models over the speed; None with films or with forces whose tangent may change with the speed."""
    if a.films or any(c.effect.port == "motion" and (c.effect.steady or c.effect.states) for c in a.calls):
        return None
    speeds = a.mesh.tables.speeds
    kinks = np.unique([0.0, *speeds, max(2 * speeds.max(initial=0.0), LAST_KINK)])
    with one_thread():
        every = [_linearised(a, a.w, speed, False) for speed in kinks.tolist()]
    matrices = np.array([(one.rotor.stiffness, one.rotor.damping) for one in every])
    return RotorModels(every[0], kinks, matrices)


def linearise(a: Assembly, w: np.ndarray, speed: float, moment: bool = False) -> LinearPlant:
    """Linear model about the equilibrium in workspace w at `speed` [rad/s], on request with the films' `moment`."""
    with one_thread():
        return _linearised(a, w, speed, moment)


def _linearised(a: Assembly, w: np.ndarray, speed: float, moment: bool) -> LinearPlant:
    rotor, Bd = _rotor(a, w, speed, moment)
    m = len(rotor.stiffness)
    film = linear_films(a, w, speed, moment) if a.films else None
    n = 0 if film is None else len(film.S)
    E = np.zeros((n + 2 * m, 5))
    E[n + m :, 2:4] = Bd.T
    if film is not None:
        E[:n, :2] = -film.J_u[:, :-1] @ _pin_gains(a)
        E[:n, 4] = -film.J_u[:, -1]
    H = np.hstack([np.zeros((2, n)), Bd, np.zeros((2, m))])
    S = np.concatenate([np.zeros(0) if film is None else film.S, np.ones(2 * m)])
    return LinearPlant(S, E, H, a.mesh.reduced.frequencies, rotor, film, speed)


def linear_films(a: Assembly, w: np.ndarray, speed: float, moment: bool = False) -> LinearFilm:
    """Linear model of all films side by side: X and F hold the journals one after the other.

    With their `moment` tilts and moments of every film follow its displacements and forces.
    """
    own = sys.modules[a.module.newton.__module__]
    kernels = Kernels(own.linear_terms, own.gap_terms)
    found: list[LinearFilm] = []
    for k, model in enumerate(a.films):
        parts = a.film, a.film_part(w, k), a.film_indices(k), a.film_constants(k), speed, kernels
        film = linear_film(model, *parts)
        if moment:
            tilted = tilted_film(model, *parts)
            film = side_by_side([film, tilted]) if model.grid.half else with_tilt(film, tilted)
        found.append(film)
    return side_by_side(found)


def _pin_gains(a: Assembly) -> np.ndarray:
    """Change of each injector's conductance per volt of reference (injectors of all films, 2)."""
    n, first = a.film.n_inj, a.machine.pinned_film
    gains = np.zeros((n * len(a.films), 2))
    if first is None:
        return gains
    for k, injector in enumerate(a.films[first].injectors, first * n):
        step = 1e-9
        slope = (_conductance(a, k, injector, step) - _conductance(a, k, injector, -step)) / (2 * step)
        gains[k] = slope * _travel_per_volt(a, k)
    return gains


def _travel_per_volt(a: Assembly, k: int) -> np.ndarray:
    """Travel (2,) [m/V] of the pin of injector k per volt of each reference; effects that delay them are left out."""
    passed = np.eye(2)  # rows: the references of the pin; columns: those given
    for call in a.calls:
        if call.effect.port == "reference" and not call.effect.states:
            kernel = type(call.effect).kernel
            change, p = getattr(kernel, "py_func", kernel), getattr(a.P, call.record)
            passed = np.array([change(a.w, 0, a.P.pinned[k], 0, x, y, p) for x, y in passed.T]).T
    return np.array([a.P.pin_x[k], a.P.pin_y[k]]) @ passed


def _conductance(a: Assembly, k: int, injector: Injector, step: float) -> float:
    """Pin conductance of injector k with its pin `step` [m] beyond the bias, effects on it included."""
    common = a.machine.injection
    assert common is not None
    opening = max(common.seat_gap - common.pin_bias - step, common.minimum_gap) / common.seat_gap
    for call in a.calls:
        if call.effect.port == "injector" and call.film in (None, k // a.film.n_inj):
            kernel = type(call.effect).kernel
            j = k % a.film.n_inj
            opening, _ = getattr(kernel, "py_func", kernel)(0.0, j, opening, 0.0, getattr(a.P, call.record))
    return injector.conductance((1 - opening) * common.seat_gap)


def _rotor(a: Assembly, w: np.ndarray, speed: float, moment: bool) -> tuple[LinearRotor, np.ndarray]:
    """The rotor and rows of the disc (2, m); a support that does not move the film is left out.

    With the films' `moment` the tilts of every journal follow its displacements.
    """
    Bd = rows(a, a.rotor.disc, w)
    n = a.rotor.n
    journals = []
    for k, film in enumerate(a.machine.films):
        journals.append(rows(a, a.rotor.journal + 2 * n * k, w))
        if moment:
            turned = a.mesh.slope(film.position)
            journals.append(np.pad(turned, ((0, 0), (0, n - turned.shape[1]))))
    Bf = np.concatenate(journals) if journals else np.zeros_like(Bd)
    moves = (np.arange(a.rotor.n) < a.rotor.n_machine) | Bf.any(axis=0)
    moves[a.rotor.n_machine :] = np.repeat(moves[a.rotor.n_machine :].reshape(-1, 2).any(axis=1), 2)
    kept = np.ix_(moves, moves)
    rotor = LinearRotor(stiffness(a, w, speed)[kept], damping(a, w, speed)[kept], Bf[:, moves])
    return rotor, Bd[:, moves]
