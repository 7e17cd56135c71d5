r"""Natural frequencies, damping and whirl from the eigenvalues of the state matrix.

.. math:: \frac{d}{dt}\begin{bmatrix} q \\ \dot q \end{bmatrix} =
          \begin{bmatrix} 0 & I \\ -M^{-1}K & -M^{-1}D \end{bmatrix}
          \begin{bmatrix} q \\ \dot q \end{bmatrix}, \quad D = C + \Omega G, \quad
          \lambda = -\zeta\omega_n + i\omega_n\sqrt{1-\zeta^2}

Bearings whose tables hang on the whirl frequency, and hysteretic shafts, are taken, mode by mode, at that mode's own
frequency |lambda|; the modes end where the tables do.

The orbit of a node is an ellipse: x + i y is a forward circle of radius |X + iY|/2 plus a backward circle of radius |X
- iY|/2: their sum and difference are the half axes, and the larger one names the whirl. Whirl is forward where it turns
as the shaft does; a shaft at rest counts as turning from x to y.

Source: Friswell et al. (2010), chapters 3 and 5.

Cites: friswell_2010.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve, eig

from fe_shaft.assembly import AssembledRotor
from fe_shaft.shaft import HOLD, ShaftError
from rotorsim.base.rounding import SPLIT_ZERO, divergence

if TYPE_CHECKING:
    import xarray as xr

# Real eigenvalues (overdamped or rigid-body motion) that rounding has split into a pair are not oscillations.
_REAL = 1e-6  # smallest wd / wn
_MATCHED = 12  # modes that are matched with what depends on the whirl frequency
_PASSES = 50
_STILL = 1e-3  # a node that moves less than this part of the largest motion does not count for the whirl
_PLANAR = 1e-3  # circles whose radii differ by less than this part of their sum make a straight line

Variable = tuple[tuple[str, ...], Any, str, str]
"""Dimensions, values, unit, long name."""


def dataset(variables: dict[str, Variable], coords: dict[str, Variable], **attrs: Any) -> xr.Dataset:
    """A Dataset of (dimensions, values, unit, long name)."""
    import xarray as xr

    def unpack(table: dict[str, Variable]) -> dict[str, Any]:
        return {
            key: (dims, np.asarray(values), {"units": unit, "long_name": text})
            for key, (dims, values, unit, text) in table.items()
        }

    return xr.Dataset(unpack(variables), unpack(coords), attrs)


def half_axes(
    x: NDArray[np.complex128], y: NDArray[np.complex128], speed: float = 0.0
) -> tuple[NDArray[np.float64], ...]:
    """Major and minor half axis, in the unit of x, of Re(x exp(st)) with Im s >= 0; the minor one is negative in
    backward whirl of a shaft at `speed` [rad/s]."""
    y = y if speed >= 0 else -y
    forward, backward = np.abs(x + 1j * y) / 2, np.abs(x - 1j * y) / 2
    return forward + backward, forward - backward


def inclination(x: NDArray[np.complex128], y: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Angle of the major axis from x towards y [rad], between -pi/2 and pi/2."""
    forward, backward = x + 1j * y, np.conj(x) + 1j * np.conj(y)
    angle = (np.angle(forward) + np.angle(backward)) / 2
    return np.asarray((angle + np.pi / 2) % np.pi - np.pi / 2)


def whirl_sense(x: NDArray[np.complex128], y: NDArray[np.complex128], speed: float = 0.0) -> NDArray[np.str_]:
    """'forward', 'backward' or 'mixed' for node amplitudes `x`, `y` (n_nodes, n_modes) at a shaft `speed` [rad/s].

    'mixed' where nodes disagree or move on a straight line.
    """
    major, minor = half_axes(x, y, speed)
    moving = major > _STILL * major.max(axis=0)
    turn = np.where(np.abs(minor) < _PLANAR * major, 0.0, np.sign(minor))
    all_forward = np.all((turn > 0) | ~moving, axis=0)
    all_backward = np.all((turn < 0) | ~moving, axis=0)
    return np.where(all_forward, "forward", np.where(all_backward, "backward", "mixed"))


@dataclass(frozen=True, eq=False)
class ModalResult:
    """Oscillating modes at one speed, by ascending `wn`.

    Attributes
    ----------
    speed : float
        [rad/s]
    eigenvalues : ndarray (n_modes,) complex
        With positive imaginary part [rad/s].
    shapes : ndarray (ndof, n_modes) complex
        Displacements, the largest transverse one being 1 [m/m, rad/m].
    whirl : ndarray (n_modes,) of str
        'forward', 'backward', or 'mixed' where nodes disagree or move on a straight line.
    nodes_pos : ndarray (n_nodes,)
        Positions of the shaft's nodes [m].
    divergence : float
        Largest rate [1/s] of a motion that grows without oscillation, 0 where none does, with tables over the whirl
        frequency at their lowest one; NaN where it was not computed.
    """

    speed: float
    eigenvalues: NDArray[np.complex128]
    shapes: NDArray[np.complex128]
    whirl: NDArray[np.str_]
    nodes_pos: NDArray[np.float64]
    divergence: float = float("nan")

    @property
    def wn(self) -> NDArray[np.float64]:
        """Undamped natural frequencies (n_modes,) [rad/s]."""
        return np.abs(self.eigenvalues)

    @property
    def wd(self) -> NDArray[np.float64]:
        """Damped natural frequencies (n_modes,) [rad/s]."""
        return self.eigenvalues.imag

    @property
    def damping_ratio(self) -> NDArray[np.float64]:
        """Damping ratios zeta (n_modes,) [1]; negative when unstable."""
        return -self.eigenvalues.real / self.wn

    @property
    def log_dec(self) -> NDArray[np.float64]:
        """Logarithmic decrements 2 pi zeta / sqrt(1 - zeta^2) (n_modes,) [1]."""
        return -2 * np.pi * self.eigenvalues.real / self.wd

    def take(self, which: int | slice) -> ModalResult:
        """One mode, or those of a slice."""
        chosen = slice(which, which + 1) if isinstance(which, int) else which
        return replace(
            self, eigenvalues=self.eigenvalues[chosen], shapes=self.shapes[:, chosen], whirl=self.whirl[chosen]
        )

    @property
    def node_shapes(self) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Amplitudes x and y of the shaft's nodes, each (n_nodes, n_modes)."""
        nodes = 4 * len(self.nodes_pos)
        return self.shapes[0:nodes:4], self.shapes[1:nodes:4]

    def dataset(self) -> xr.Dataset:
        """All of it as labelled data over mode and node, with the half axes and inclinations of the orbits."""
        x, y = self.node_shapes
        major, minor = half_axes(x, y, self.speed)
        per_node = ("node", "mode")
        return dataset(
            {
                "wn": (("mode",), self.wn, "rad/s", "undamped natural frequency"),
                "wd": (("mode",), self.wd, "rad/s", "damped natural frequency"),
                "damping_ratio": (("mode",), self.damping_ratio, "1", "damping ratio"),
                "log_dec": (("mode",), self.log_dec, "1", "logarithmic decrement"),
                "whirl": (("mode",), self.whirl, "", "sense of whirl"),
                "x": (per_node, x, "1", "mode shape in x"),
                "y": (per_node, y, "1", "mode shape in y"),
                "major": (per_node, major, "1", "major half axis of the orbit"),
                "minor": (per_node, minor, "1", "minor half axis of the orbit, negative in backward whirl"),
                "inclination": (per_node, inclination(x, y), "rad", "angle of the major axis from x"),
            },
            {
                "mode": (("mode",), np.arange(len(self.wn)), "1", "number of the mode"),
                "z": (("node",), self.nodes_pos, "m", "position along the shaft"),
            },
            speed=self.speed,
        )


def state_matrix(M: NDArray[Any], D: NDArray[Any], K: NDArray[Any]) -> NDArray[np.float64]:
    """State matrix (2n, 2n) of M q'' + D q' + K q = 0, for M, D, K (n, n) in SI."""
    n = len(M)
    try:
        factor = cho_factor(M)
    except LinAlgError as error:
        raise ShaftError(
            "modal: the mass matrix is singular, some degree of freedom has no mass; give every pedestal a PointMass."
        ) from error
    return np.block([[np.zeros((n, n)), np.eye(n)], [-cho_solve(factor, K), -cho_solve(factor, D)]])


def oscillations(
    M: NDArray[Any], D: NDArray[Any], K: NDArray[Any]
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Eigenvalues (n_modes,) [rad/s] of positive imaginary part, ascending, and vectors (n, n_modes)."""
    return _oscillating(M, D, K, *eig(state_matrix(M, D, K)))


def _oscillating(
    M: NDArray[Any], D: NDArray[Any], K: NDArray[Any], values: NDArray[np.complex128], vectors: NDArray[np.complex128]
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Eigenvalues (n_modes,) and vectors of the oscillations among all eigenvalues (2n,) and vectors (2n, 2n)."""
    modulus = np.abs(values)
    keep = np.flatnonzero((values.imag > _REAL * modulus) & (modulus > SPLIT_ZERO * modulus.max()))
    keep = keep[np.argsort(modulus[keep], kind="stable")]
    shapes = vectors[: len(M), keep]
    return damped_by_work(M, D, K, values[keep], shapes), shapes


def damped_by_work(
    M: NDArray[Any], D: NDArray[Any], K: NDArray[Any], values: NDArray[np.complex128], shapes: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    r"""Eigenvalues (n_modes,) with the real part that the work in their shapes (n, n_modes) gives.

    .. math:: \sigma = -\frac{\omega\, v^H C v + \mathrm{Im}\, v^H N v}{2 \omega\, v^H M v + \mathrm{Im}\, v^H G v}

    with D = C + G and K's unsymmetric part N: exact for an exact shape, and rounded against the damping instead of the
    largest eigenvalue (an undamped rotor of 30 elements on soft bearings had damping ratios of -2.8e-8).
    """

    def work(X: NDArray[Any]) -> NDArray[np.complex128]:
        return np.asarray(np.sum(shapes.conj() * (X @ shapes), axis=0))

    omega, inertia, spin = values.imag, work(M).real, work((D - D.T) / 2).imag
    lost = omega * work((D + D.T) / 2).real + work((K - K.T) / 2).imag
    whole = 2 * omega * inertia + spin
    known = whole > 1e-3 * (2 * omega * inertia + np.abs(spin))  # else two modes are about to flutter
    return np.where(known, -lost / np.where(known, whole, 1.0), values.real) + 1j * omega


def free_matrices(
    rotor: AssembledRotor, speed: float, frequency: float | None = None
) -> tuple[NDArray[np.float64], ...]:
    """M, C + speed G, K of the degrees of freedom that nothing holds, bearings at a whirl `frequency` [rad/s]."""
    block = np.ix_(rotor.free, rotor.free)
    D = rotor.C(speed, frequency) + speed * rotor.parts.G
    return rotor.parts.M[block], D[block], rotor.K(speed, frequency)[block]


def run_modal(rotor: AssembledRotor, speed: float) -> ModalResult:
    """Modes of `rotor` at `speed` [rad/s]; motions that do not oscillate are left out, but for `divergence`.

    Repeated frequencies (a symmetric rotor at rest) have arbitrary shapes, and so an arbitrary whirl.

    Examples
    --------
    >>> rotor.run_modal(100.0).wn[:2].round().tolist()
    [210.0, 210.0]
    """
    M, D, K = free_matrices(rotor, speed, _start(rotor) if rotor.by_whirl else None)
    values, vectors = eig(state_matrix(M, D, K))
    found = _matched(rotor, speed) if rotor.by_whirl else _oscillating(M, D, K, values, vectors)
    return replace(named(rotor, speed, *found), divergence=divergence(values))


def named(
    rotor: AssembledRotor, speed: float, values: NDArray[np.complex128], vectors: NDArray[np.complex128]
) -> ModalResult:
    """The result for eigenvalues (n_modes,) and vectors (n_free, n_modes)."""
    shapes = np.zeros((rotor.ndof, len(values)), dtype=complex)
    shapes[rotor.free] = vectors
    nodes = 4 * rotor.n_nodes
    x, y = shapes[0:nodes:4], shapes[1:nodes:4]
    transverse = np.concatenate([x, y])
    largest = transverse[np.abs(transverse).argmax(axis=0), np.arange(len(values))]
    shapes = shapes / largest
    return ModalResult(float(speed), values, shapes, whirl_sense(x, y, speed), rotor.nodes_pos)


def _start(rotor: AssembledRotor) -> float:
    """Lowest frequency [rad/s] inside every table over the whirl frequency."""
    tables = [b.whirl_frequency for b in rotor.bearing_elements if b.whirl_frequency is not None]
    return float(max((np.asarray(table)[0] for table in tables), default=0.0))


def _matched(rotor: AssembledRotor, speed: float) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """The lowest modes, each with the bearings at its own frequency."""
    values, _ = oscillations(*free_matrices(rotor, speed, _start(rotor)))
    count = min(_MATCHED, len(values))
    found, shapes = [], []
    ends = [np.asarray(b.whirl_frequency)[-1] for b in rotor.bearing_elements
            if b.whirl_frequency is not None and b.extrapolate != HOLD]  # fmt: skip
    last = min(ends, default=np.inf)
    for mode in range(count):
        frequency = min(float(abs(values[mode])), last)
        for _ in range(_PASSES):
            now, shape = oscillations(*free_matrices(rotor, speed, frequency))
            before, frequency = frequency, float(abs(now[min(mode, len(now) - 1)]))
            if abs(frequency - before) <= 1e-9 * frequency or frequency > last:
                break
        if frequency > last:
            break
        found.append(now[min(mode, len(now) - 1)])
        shapes.append(shape[:, min(mode, len(now) - 1)])
    if not found:
        raise ShaftError(
            f"modal: every mode is above the bearings' tables, which end at {last:g} rad/s; extend them or set "
            "extrapolate='hold'."
        )
    order = np.argsort(np.abs(found))
    return np.array(found)[order], np.stack(shapes, axis=1)[:, order]
