r"""Campbell diagram: natural frequencies over speed, with modes tracked by their shapes (MAC).

Modes are followed from speed to speed by their shapes (modal assurance with the mass matrix) and frequencies: the
assignment with the largest sum wins. It runs from the highest speed down, because at rest the two whirls of a symmetric
rotor are one double mode with arbitrary shapes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fe_shaft import krylov, modal
from fe_shaft.assembly import AssembledRotor
from fe_shaft.checks import ShaftError, grid
from fe_shaft.labelled import dataset
from fe_shaft.static import loose_motions

if TYPE_CHECKING:
    import xarray as xr

_SMALL = 24
"""Degrees of freedom up to which the whole problem is solved at once."""
_DEPTHS = (20, 36)
"""Krylov vectors beyond four for each wanted mode: tried one after the other."""


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
    inverse = None if loose_motions(rotor) else krylov.invert(*(matrix[block] for matrix in parts))
    runs: dict[int, modal.ModalResult] = {}
    for more in _DEPTHS:
        left = np.array([i for i in range(len(speeds)) if i not in runs], dtype=int)
        if inverse is not None and left.size and 4 * count + more < len(rotor.free):
            found = krylov.lowest(inverse, speeds[left], 4 * count + more)
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
    if len(keep) < count or not np.all(krylov.converged(residual[: keep[-1] + 1])):
        return None
    M, D, K = modal.free_matrices(rotor, speed)
    values = modal.damped_by_work(M, D, K, values[keep], vectors[:, keep])
    return modal.named(rotor, speed, values, vectors[:, keep])


def _whole(rotor: AssembledRotor, speed: float, count: int | None) -> modal.ModalResult:
    """The lowest modes out of the whole problem."""
    run = modal.run_modal(rotor, speed)
    if count is None:
        return run
    return modal.ModalResult(
        run.speed, run.eigenvalues[:count], run.shapes[:, :count], run.whirl[:count], run.nodes_pos
    )


def follow(rotor: AssembledRotor, runs: list[modal.ModalResult]) -> list[NDArray[np.intp]]:
    """Branch of every mode of every run; the runs are ascending in speed."""
    from scipy.optimize import linear_sum_assignment  # slow to import, and no run-up needs it

    weight = np.sqrt(np.diag(rotor.parts.M))[:, None]
    shapes = [weight * run.shapes for run in runs]
    shapes = [s / np.linalg.norm(s, axis=0) for s in shapes]
    labels = [np.arange(len(runs[-1].wn))]
    fresh = len(labels[0])
    for i in range(len(runs) - 2, -1, -1):
        above, label = runs[i + 1], np.full(len(runs[i].wn), -1)
        if len(above.wn) and len(label):
            likeness = np.abs(shapes[i].conj().T @ shapes[i + 1]) ** 2
            apart = np.abs(runs[i].eigenvalues[:, None] - above.eigenvalues) / above.wn
            rows, columns = linear_sum_assignment(likeness - 2 * apart, maximize=True)
            label[rows] = labels[0][columns]
        for mode in np.flatnonzero(label < 0):
            label[mode], fresh = fresh, fresh + 1
        labels.insert(0, label)
    return _by_frequency(labels, fresh)


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
