r"""Critical speeds: speeds Omega that equal the natural frequency \|lambda(Omega)\| of a mode.

Undamped with constant bearings they are the real eigenvalues of K q = Omega^2 (M - i G) q (forward and backward whirl
at once). These are the first guesses; from there every one is followed with damping and tables by the secant method on
\|lambda\| - Omega, the mode being the one whose frequency is nearest to the speed and whose shape is alike.

Source: Friswell et al. (2010), section 6.8.

Cites: friswell_2010.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig

from fe_shaft import modal
from fe_shaft.assembly import AssembledRotor
from fe_shaft.checks import ShaftError
from fe_shaft.labelled import dataset
from rotorsim.base.rounding import EPS

if TYPE_CHECKING:
    import xarray as xr

_PASSES = 30


@dataclass(frozen=True, eq=False)
class CriticalSpeedResult:
    """Critical speeds, ascending.

    Attributes
    ----------
    wn : ndarray (n_critical,)
        Speeds that equal the undamped natural frequency of a mode [rad/s].
    wd : ndarray (n_critical,)
        The damped natural frequency of that mode there [rad/s].
    damping_ratio : ndarray (n_critical,)
        Its damping ratio there [1].
    whirl : ndarray (n_critical,) of str
        Its whirl; unbalance drives forward whirl, and any whirl of an unsymmetric rotor.
    """

    wn: NDArray[np.float64]
    wd: NDArray[np.float64]
    damping_ratio: NDArray[np.float64]
    whirl: NDArray[np.str_]

    def dataset(self) -> xr.Dataset:
        """Labelled data over critical."""
        over = ("critical",)
        return dataset(
            {
                "wn": (over, self.wn, "rad/s", "critical speed"),
                "wd": (over, self.wd, "rad/s", "damped natural frequency at the critical speed"),
                "damping_ratio": (over, self.damping_ratio, "1", "damping ratio at the critical speed"),
                "whirl": (over, self.whirl, "", "sense of whirl"),
            },
            {},
        )


def run_critical_speed(rotor: AssembledRotor, limit: float | None = None, count: int = 6) -> CriticalSpeedResult:
    """The `count` lowest critical speeds of `rotor`, up to `limit` [rad/s] where one is given."""
    if count < 1 or (limit is not None and not limit > 0):
        raise ShaftError(f"critical speed: count = {count}, limit = {limit}; both must be positive.")
    found: list[tuple[float, complex, str]] = []
    for guess in _guesses(rotor)[: 2 * count]:
        speed, value, sense = _refine(rotor, guess)
        new = all(abs(speed - f[0]) > 1e-7 * speed or abs(value - f[1]) > 1e-6 * speed or sense != f[2] for f in found)
        if np.isfinite(speed) and new and (limit is None or speed <= limit):
            found.append((speed, value, sense))
    found = sorted(found, key=lambda entry: entry[0])[:count]
    values = np.array([entry[1] for entry in found], dtype=complex)
    wn = np.array([entry[0] for entry in found])
    return CriticalSpeedResult(wn, values.imag, -values.real / np.abs(values), np.array([entry[2] for entry in found]))


def _guesses(rotor: AssembledRotor) -> NDArray[np.float64]:
    """Undamped critical speeds with the bearings as they are at the speed itself, or nearest to it in their tables."""
    block = np.ix_(rotor.free, rotor.free)
    tables = [np.asarray(b.frequency) for b in rotor.bearing_elements if b.frequency is not None]
    speed = 0.0 if not tables else float(max(table[0] for table in tables))
    M = rotor.parts.M[block] - 1j * rotor.parts.G[block]
    unit = 1 / np.sqrt(np.diag(rotor.parts.M)[rotor.free])
    mass, spring = eig(M * unit * unit[:, None], rotor.K(speed)[block] * unit * unit[:, None], right=False,
                       homogeneous_eigvals=True)  # fmt: skip
    moving = np.abs(spring) > len(M) * EPS * np.abs(spring).max()  # else the motion of a rigid body
    inverse = mass[moving] / spring[moving]
    real = inverse.real > 1e-12 * np.abs(inverse).max(initial=0.0)
    real &= np.abs(inverse.imag) < 0.3 * np.abs(inverse)
    return np.sort(1 / np.sqrt(inverse[real].real))


def _refine(rotor: AssembledRotor, guess: float) -> tuple[float, complex, str]:
    """Secant steps from a guess; NaN where they do not settle."""
    points: list[tuple[float, float]] = []
    speed, shape, value, sense = guess, None, complex(np.nan), ""
    for _ in range(_PASSES):
        run = modal.run_modal(rotor, speed)
        mode = _nearest(run, speed, shape)
        value, shape, sense = complex(run.eigenvalues[mode]), run.shapes[:, mode], str(run.whirl[mode])
        gap = abs(value) - speed
        if abs(gap) <= 1e-10 * speed:
            return speed, value, sense
        points.append((speed, gap))
        slope = -0.8 if len(points) < 2 else (points[-1][1] - points[-2][1]) / (points[-1][0] - points[-2][0])
        speed = speed - gap / slope if slope < -1e-3 else speed + gap
        if not 0 < speed < 10 * guess:
            break
        if abs(speed - points[-1][0]) <= 1e-11 * speed:
            return speed, value, sense
    return float("nan"), value, sense


def _nearest(run: modal.ModalResult, speed: float, shape: NDArray[np.complex128] | None) -> int:
    """The mode that is like `shape` and near in frequency."""
    far = np.abs(run.wn - speed) / speed
    if shape is None:
        return int(far.argmin())
    size = np.linalg.norm(run.shapes, axis=0) * np.linalg.norm(shape)
    return int((np.abs(run.shapes.conj().T @ shape) / size - far).argmax())
