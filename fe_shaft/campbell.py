"""Campbell diagram: natural frequencies over speed, every mode followed.

The lowest modes of a large rotor are refined from those of the speed before; that none below the last one is missing is
proven by the argument principle, else the whole problem is solved.

The modes of two speeds span a subspace of displacements in which the rotor at both speeds has exactly these
eigenvalues. There its matrices are changed from one speed to the other in as many steps as `modes.follower.through`
takes to be certain which mode becomes which.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fe_shaft import modal
from fe_shaft.assembly import AssembledRotor, loose_motions
from fe_shaft.follower import through
from fe_shaft.modal import dataset
from fe_shaft.pencil import OSCILLATES, Modes, Region, SecondOrder
from fe_shaft.shaft import ShaftError, grid
from fe_shaft.spectrum import SMALL, counted, everything, refined

if TYPE_CHECKING:
    import xarray as xr

Matrix = NDArray[np.float64]
_DISTINCT, _ONE = 1e-7, 1e-5
"""Singular value over the largest of shapes that add a direction; distance of eigenvalues over size that are one."""
_REACH, _AROUND = 1.1, 1.5
"""Reach of the region in which modes are counted, and of those refined, over the highest mode asked for."""


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
    """The lowest modes at each speed, refined from those of the speed before if it is proven that none is missing."""
    if count is None or rotor.by_whirl or 2 * len(rotor.free) <= SMALL or loose_motions(rotor):
        return [modal.run_modal(rotor, speed).take(slice(count)) for speed in speeds.tolist()]
    runs: list[modal.ModalResult] = []
    known, region = None, Region(0.0, 0.0)
    for speed in speeds.tolist():
        pencil = SecondOrder(*modal.free_matrices(rotor, speed))
        if known is not None:
            known = counted(pencil, refined(pencil, known), region)
        if known is None or not known.proven or region.holds(known.values).sum() < count:
            known, region = _from_whole(pencil, count)
        order = np.argsort(np.abs(known.values), kind="stable")
        lowest = known.take(order[region.holds(known.values[order])][:count])
        vectors = lowest.right[: len(pencil.M)]
        values = modal.damped_by_work(pencil.M, pencil.D, pencil.K, lowest.values, vectors)
        runs.append(modal.named(rotor, speed, values, vectors))
    return runs


def _from_whole(pencil: SecondOrder, count: int) -> tuple[Modes, Region]:
    """The lowest modes out of the whole problem, and the region that holds `count` oscillations of any damping."""
    known = everything(pencil)
    size = np.abs(known.values)
    highest = float(np.sort(size[known.values.imag > OSCILLATES * size])[:count].max(initial=0.0))
    known = known.take(size < _AROUND * highest)
    return known, Region(_REACH * highest, _ONE * highest, 1.0)


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
