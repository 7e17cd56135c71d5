r"""Campbell diagram: natural frequencies over speed, every mode followed.

The modes of two speeds span a subspace of displacements in which the rotor at both speeds has exactly these
eigenvalues. There its matrices are changed from one speed to the other in as many steps as `modes.follower.through`
takes to be certain which mode becomes which. With constant bearings only the lowest modes are computed; that none below
the last one is missing is proven by the argument principle.

The lowest modes of all speeds come at once, from a Krylov space of the inverse state matrix,
A^-1 (q, v) = (-K^-1 (D q + M v), q), which needs K^-1 C, K^-1 G, K^-1 M once where K does not change with the speed.
The space, started from two vectors so that it also finds double
frequencies, holds the modes of smallest \|lambda\|; it is built for all speeds in the same few matrix products. What
has not converged is left to the caller, who solves the whole problem there.

Source: A. Ruhe, Math. Comp. 33 (1979) 680 (the band form of the Arnoldi process).

Cites: ruhe_1979.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import LinAlgError, lu_factor, lu_solve

from fe_shaft import modal
from fe_shaft.assembly import AssembledRotor, loose_motions
from fe_shaft.modal import dataset
from fe_shaft.modes.follower import through
from fe_shaft.modes.pencil import Quotient, Region, SecondOrder
from fe_shaft.modes.spectrum import missing_in
from fe_shaft.shaft import ShaftError, grid

if TYPE_CHECKING:
    import xarray as xr

Matrix = NDArray[np.float64]
_SMALL = 24
"""Degrees of freedom up to which the whole problem is solved at once."""
_DISTINCT, _ONE = 1e-7, 1e-5
"""Singular value over the largest of shapes that add a direction; distance of eigenvalues over size that are one."""
_DEPTHS = (20, 36)
"""Krylov vectors beyond four for each wanted mode: tried one after the other."""
_CONVERGED = 1e-9
"""Residual of an eigenvalue over its size: the square of it is the error where the problem is near a symmetric one."""
_LEAST_CONDITION = 1e-14


@dataclass(frozen=True, eq=False)
class CampbellResult:
    """Modes over speed.

    Attributes
    ----------
    speeds : ndarray (n_speeds,)
        [rad/s]
    wn, wd, damping_ratio : ndarray (n_speeds, n_modes)
        [rad/s], [rad/s], [1]; ascending `wn`, NaN at the end of a speed at which fewer modes oscillate.
    whirl : ndarray (n_speeds, n_modes) of str
        As in ModalResult; empty where `wn` is NaN.
    branch : ndarray (n_speeds, n_modes) of int
        Number of the branch that a mode belongs to, counted by frequency where the branches begin; -1 at a NaN.
    """

    speeds: NDArray[np.float64]
    wn: NDArray[np.float64]
    wd: NDArray[np.float64]
    damping_ratio: NDArray[np.float64]
    whirl: NDArray[np.str_]
    branch: NDArray[np.intp]

    @property
    def log_dec(self) -> NDArray[np.float64]:
        """Logarithmic decrements (n_speeds, n_modes) [1]."""
        return 2 * np.pi * self.damping_ratio * self.wn / self.wd

    def along_branch(self, name: str) -> NDArray[np.float64]:
        """`wn`, `wd`, `damping_ratio` or `log_dec` with one branch a column (n_speeds, n_branches), NaN outside."""
        values = getattr(self, name)
        table = np.full((len(self.speeds), self.branch.max() + 1), np.nan)
        rows, columns = np.nonzero(self.branch >= 0)
        table[rows, self.branch[rows, columns]] = values[rows, columns]
        return table

    def dataset(self) -> xr.Dataset:
        """Labelled data over speed and branch."""
        sense = np.full((len(self.speeds), self.branch.max() + 1), "", dtype="U8")
        rows, columns = np.nonzero(self.branch >= 0)
        sense[rows, self.branch[rows, columns]] = self.whirl[rows, columns]
        over = ("speed", "branch")
        return dataset(
            {
                "wn": (over, self.along_branch("wn"), "rad/s", "undamped natural frequency"),
                "wd": (over, self.along_branch("wd"), "rad/s", "damped natural frequency"),
                "damping_ratio": (over, self.along_branch("damping_ratio"), "1", "damping ratio"),
                "log_dec": (over, self.along_branch("log_dec"), "1", "logarithmic decrement"),
                "whirl": (over, sense, "", "sense of whirl"),
            },
            {
                "speed": (("speed",), self.speeds, "rad/s", "speed of the shaft"),
                "branch": (("branch",), np.arange(sense.shape[1]), "1", "number of the branch"),
            },
        )


def run_campbell(rotor: AssembledRotor, speeds: ArrayLike, frequencies: int | None = 6) -> CampbellResult:
    """The lowest modes of `rotor` at each of `speeds` (n_speeds,) [rad/s], ascending.

    Parameters
    ----------
    frequencies : int or None
        Modes to find; None for all that oscillate.

    Raises
    ------
    ShaftError
        If the speeds are empty, not finite or not ascending, or if a bearing's table does not cover them.

    Examples
    --------
    >>> rotor.run_campbell([0.0, 100.0, 200.0], frequencies=4).wn.shape
    (3, 4)
    """
    speeds = grid("campbell: speeds [rad/s]", speeds)
    if frequencies is not None and frequencies < 1:
        raise ShaftError(f"campbell: frequencies = {frequencies}; ask for at least one mode.")
    runs = _lowest(rotor, speeds, frequencies)
    wn, wd, zeta = (_table([getattr(r, name) for r in runs], np.nan) for name in ("wn", "wd", "damping_ratio"))
    sense = _table([r.whirl for r in runs], "")
    branch = _table(follow(rotor, runs), -1)
    return CampbellResult(speeds, wn, wd, zeta, sense, branch)


def _lowest(rotor: AssembledRotor, speeds: NDArray[np.float64], count: int | None) -> list[modal.ModalResult]:
    constant = all(bearing.constant for bearing in rotor.bearing_elements) and not rotor.parts.N.any()
    constant = constant and not rotor.hysteretic
    if count is None or not constant or len(rotor.free) <= _SMALL:
        return [_whole(rotor, float(speed), count) for speed in speeds]
    block = np.ix_(rotor.free, rotor.free)
    parts = (rotor.parts.M, rotor.C(), rotor.parts.G, rotor.K())
    inverse = None if loose_motions(rotor) else inverted(*(matrix[block] for matrix in parts))
    runs: dict[int, modal.ModalResult] = {}
    for more in _DEPTHS:
        left = np.array([i for i in range(len(speeds)) if i not in runs], dtype=int)
        if inverse is not None and left.size and 4 * count + more < len(rotor.free):
            found = krylov_modes(inverse, speeds[left], 4 * count + more)
            settled = [
                _select(rotor, float(speeds[i]), count, *(part[k] for part in found)) for k, i in enumerate(left)
            ]
            runs |= {int(i): run for i, run in zip(left, settled, strict=True) if run is not None}
    return [runs.get(i) or _whole(rotor, float(speed), count) for i, speed in enumerate(speeds)]


def _select(
    rotor: AssembledRotor,
    speed: float,
    count: int,
    values: NDArray[np.complex128],
    vectors: NDArray[np.complex128],
    residual: NDArray[np.float64],
) -> modal.ModalResult | None:
    """The `count` lowest oscillations out of a Krylov space; None where one of them is not settled."""
    order = np.argsort(np.abs(values), kind="stable")
    values, vectors, residual = values[order], vectors[:, order], residual[order]
    keep = np.flatnonzero(values.imag > 1e-6 * np.abs(values))[:count]
    if len(keep) < count or not np.all(converged(residual[: keep[-1] + 1])):
        return None
    M, D, K = modal.free_matrices(rotor, speed)
    if not _complete(SecondOrder(M, D, K), values, int(keep[-1])):
        return None
    values = modal.damped_by_work(M, D, K, values[keep], vectors[:, keep])
    return modal.named(rotor, speed, values, vectors[:, keep])


def _complete(pencil: SecondOrder, values: NDArray[np.complex128], last: int) -> bool:
    """Whether no eigenvalue is missing up to number `last` of the found ones (k,), ascending in modulus."""
    size = np.abs(values)
    above = size[size > (1 + _ONE) * size[last]]
    reach = float(size[last] * min(1.05, np.sqrt(above[0] / size[last]) if len(above) else 1.05))
    known = values[(size < reach) & (values.imag >= 0)]
    return missing_in(Region(reach, _ONE * reach, 1.0), Quotient(pencil, known)) == 0


def _whole(rotor: AssembledRotor, speed: float, count: int | None) -> modal.ModalResult:
    """The lowest modes out of the whole problem."""
    run = modal.run_modal(rotor, speed)
    if count is None:
        return run
    return run.take(slice(count))


def follow(rotor: AssembledRotor, runs: list[modal.ModalResult]) -> list[NDArray[np.intp]]:
    """Branch of every mode of every run; the runs are ascending in speed."""
    labels = [np.arange(len(runs[0].wn))]
    fresh = len(labels[0])
    for here, there in pairwise(runs):
        label = np.full(len(there.wn), -1)
        for j, k in _pairs(rotor, here, there).items():
            label[k] = labels[-1][j]
        for mode in np.flatnonzero(label < 0):
            label[mode], fresh = fresh, fresh + 1
        labels.append(label)
    return _by_frequency(labels, fresh)


def _pairs(rotor: AssembledRotor, here: modal.ModalResult, there: modal.ModalResult) -> dict[int, int]:
    """Modes of one speed and those of the next one that they become, where that is certain."""
    if not len(here.wn) or not len(there.wn):
        return {}
    shapes = np.hstack([here.shapes, there.shapes])[rotor.free]
    weight = np.sqrt(np.diag(rotor.parts.M)[rotor.free])[:, None]
    u, size, _ = np.linalg.svd(weight * shapes / np.linalg.norm(weight * shapes, axis=0), full_matrices=False)
    basis = u[:, size > _DISTINCT * size[0]] / weight
    if rotor.by_whirl:
        return _pairs_by_whirl(rotor, here, there, basis)
    return _certain(_reduced(rotor, here.speed, basis), _reduced(rotor, there.speed, basis), here, there)


def _certain(
    first: NDArray[Any], last: NDArray[Any], here: modal.ModalResult, there: modal.ModalResult
) -> dict[int, int]:
    """Modes that become one another on the way from a first state matrix to the last one."""
    values = np.linalg.eigvals(first)
    chosen = np.abs(values[:, None] - here.eigenvalues).argmin(axis=0)
    found = through(first, last, np.unique(chosen))
    if found is None:
        return {}
    after = found[0][chosen]
    near = np.abs(after[:, None] - there.eigenvalues)
    taken: dict[int, int] = {}
    for j, k in zip(*np.unravel_index(near.argsort(axis=None), near.shape), strict=True):
        if near[j, k] < _ONE * there.wn[k] and j not in taken and k not in taken.values():
            taken[int(j)] = int(k)
    return taken


def _pairs_by_whirl(
    rotor: AssembledRotor, here: modal.ModalResult, there: modal.ModalResult, basis: NDArray[Any]
) -> dict[int, int]:
    """The same where each mode has the matrices of its own frequency: one mode after the other, the nearest first."""
    first = [_reduced(rotor, here.speed, basis, wn) for wn in here.wn]
    last = [_reduced(rotor, there.speed, basis, wn) for wn in there.wn]
    taken: dict[int, int] = {}
    for j, before in enumerate(here.eigenvalues):
        for k in np.abs(there.eigenvalues - before).argsort(kind="stable").tolist():
            if k not in taken.values() and _certain(first[j], last[k], here.take(j), there.take(k)):
                taken[j] = k
                break
    return taken


def _reduced(rotor: AssembledRotor, speed: float, basis: NDArray[Any], frequency: float | None = None) -> NDArray[Any]:
    """State matrix (2k, 2k) at a speed and whirl frequency in a basis (n_free, k) of displacements."""
    M, D, K = (basis.conj().T @ X @ basis for X in modal.free_matrices(rotor, speed, frequency))
    k = len(M)
    return np.block([[np.zeros((k, k)), np.eye(k)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])


def _by_frequency(labels: list[NDArray[np.intp]], count: int) -> list[NDArray[np.intp]]:
    """Branches renumbered in the order in which they appear, the lowest frequency of the first speed being 0."""
    number: dict[int, int] = {}
    for label in labels:
        for branch in label:
            number.setdefault(int(branch), len(number))
    return [np.array([number[int(branch)] for branch in label], dtype=np.intp) for label in labels]


def _table(rows: list[NDArray], fill: float | str) -> NDArray:
    """Rows of unequal length as one array, filled up at the end."""
    table = np.full((len(rows), max(len(row) for row in rows)), fill, dtype=rows[0].dtype)
    for line, row in zip(table, rows, strict=True):
        line[: len(row)] = row
    return table


@dataclass(frozen=True, eq=False)
class Inverse:
    """K^-1 M, K^-1 C, K^-1 G of scaled coordinates, the frequency [rad/s] that makes them plain numbers, the scale."""

    M: Matrix
    C: Matrix
    G: Matrix
    frequency: float
    scale: Matrix


def inverted(M: Matrix, C: Matrix, G: Matrix, K: Matrix) -> Inverse | None:
    """Prepare; None where K is singular, as for a free rotor."""
    scale = 1 / np.sqrt(np.diag(M))
    M, C, G, K = (scale[:, None] * matrix * scale for matrix in (M, C, G, K))
    try:
        factor = lu_factor(K)
    except (LinAlgError, ValueError):
        return None
    pivots = np.abs(np.diag(factor[0]))
    if pivots.min() < _LEAST_CONDITION * pivots.max():
        return None
    n = len(M)
    parts = lu_solve(factor, np.hstack([M, C, G]))
    mass = parts[:, :n]
    frequency = float(1 / np.sqrt(max(np.abs(np.diag(mass)).sum(), np.finfo(float).tiny)))
    return Inverse(
        mass * frequency**2, parts[:, n : 2 * n] * frequency, parts[:, 2 * n :] * frequency, frequency, scale
    )


def krylov_modes(inverse: Inverse, speeds: Matrix, depth: int) -> tuple[Matrix, Matrix, Matrix]:
    """Eigenvalues (n_speeds, depth) [rad/s], vectors (n_speeds, n, depth) and relative residuals (n_speeds, depth)."""
    basis, H = _arnoldi(inverse, speeds, depth)
    theta, y = np.linalg.eig(H[:, :depth])
    tail = np.linalg.norm(H[:, depth:] @ y, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        residual = tail / np.abs(theta)
        values = inverse.frequency / theta
    n = len(inverse.M)
    vectors = inverse.scale[:, None] * (basis[:, :depth, :n].transpose(0, 2, 1) @ y)
    return values, vectors, residual


def converged(residual: Matrix) -> NDArray[np.bool_]:
    """Which residuals mark an eigenvalue as found."""
    return np.asarray(residual < _CONVERGED)


def _arnoldi(inverse: Inverse, speeds: Matrix, depth: int) -> tuple[Matrix, Matrix]:
    """Basis (n_speeds, depth + 2, 2n) and band Hessenberg matrix (n_speeds, depth + 2, depth)."""
    n, count = len(inverse.M), len(speeds)
    basis = np.zeros((count, depth + 2, 2 * n))
    H = np.zeros((count, depth + 2, depth))
    start = np.random.default_rng(0).standard_normal((2, 2 * n))
    basis[:, :2] = np.linalg.qr(start.T)[0].T
    stacked = np.hstack([inverse.C.T, inverse.G.T])
    for j in range(depth):
        q, v = basis[:, j, :n], basis[:, j, n:]
        forces = q @ stacked
        w = np.concatenate([-(forces[:, :n] + speeds[:, None] * forces[:, n:] + v @ inverse.M.T), q], axis=1)
        known = basis[:, : j + 2]
        for _ in range(2):  # twice is enough
            part = np.matmul(known, w[:, :, None])
            w = w - np.matmul(part.transpose(0, 2, 1), known)[:, 0]
            H[:, : j + 2, j] += part[:, :, 0]
        length = np.linalg.norm(w, axis=1)
        H[:, j + 2, j] = length
        basis[:, j + 2] = w / np.maximum(length, np.finfo(float).tiny)[:, None]
    return basis, H
