r"""Fixed amount of arithmetic of the film step's kind, a yardstick for its time; never to be changed.

Two chains of dense blocks, :math:`x_i = B_i (b_i - w_i x_{i-1})`, as when the film's lines are eliminated, then flat
passes over all cells, as when its residual is evaluated: 64 lines of 16 cells, in doubles. A time divided by the
reference's, measured in turns in one process, depends little on the processor's clock and on what else runs. The files
in `history/` quote that ratio: another reference would break the series. It depends on numpy and numba alone.
"""

import statistics
import time
from collections.abc import Callable

import numba
import numpy as np

LINES, ROWS = 64, 16
CELLS, HALF = LINES * ROWS, LINES // 2
X, RHS, COUPLING, FLOW, LANE, BLOCKS = (ROWS + k * (CELLS + 2 * ROWS) for k in range(6))
"""Places of the arrays in the workspace, each with a free line before and after it; the blocks come last."""


def workspace() -> np.ndarray:
    """Blocks by columns, couplings and right-hand side, always the same; the solution starts as 0."""
    line, column, row = np.ogrid[:LINES, :ROWS, :ROWS]
    cells = np.arange(float(CELLS))
    w = np.zeros(BLOCKS + CELLS * ROWS)
    w[RHS : RHS + CELLS] = 1.0 + 0.5 * np.cos(0.1 * cells)
    w[COUPLING : COUPLING + CELLS] = 0.3 + 0.1 * np.sin(cells)
    w[BLOCKS:] = np.where(column == row, 0.5, 0.02 * np.cos(1.0 * line + 2.0 * column + 3.0 * row)).ravel()
    return w


@numba.njit(nogil=True, error_model="numpy")
def work(w, passes):
    """Do the work `passes` times, each from the last one's result; returns the sum of the solution."""
    for _ in range(passes):
        for step in range(HALF):
            for chain in range(2):
                line = step + chain * HALF
                x, block = X + line * ROWS, BLOCKS + line * ROWS * ROWS
                for a in range(ROWS):
                    w[LANE + a] = w[x + RHS - X + a] - w[x + COUPLING - X + a] * w[x - ROWS + a]
                for a in range(ROWS):
                    w[x + a] = 0.0
                for c in range(0, ROWS, 4):
                    column = block + c * ROWS
                    p, q, r, s = w[LANE + c], w[LANE + c + 1], w[LANE + c + 2], w[LANE + c + 3]
                    for a in range(ROWS):
                        w[x + a] += (p * w[column + a] + q * w[column + ROWS + a]) + (
                            r * w[column + 2 * ROWS + a] + s * w[column + 3 * ROWS + a]
                        )
        for k in range(CELLS):
            here, there, h = w[X + k], w[X + k + ROWS], w[COUPLING + k]
            upwind = 0.1 - 0.01 * (here + there) * h
            upwind = upwind if upwind > 0.0 else 0.0
            jump = there * there - here * here
            w[FLOW + k] = 0.2 * (here + there) - upwind * (there - here) - h * h * h * jump
        for k in range(CELLS):
            change = 0.1 * (w[FLOW + k - ROWS] - w[FLOW + k]) + 0.05 * w[RHS + k] / (1.0 + w[COUPLING + k])
            w[X + k] = 0.5 * w[X + k] + change
    return w[X : X + CELLS].sum()


def in_turns(run: Callable[[], object], samples: int, passes: int, rounds: int) -> dict[str, float]:
    """Processor time [us] of a sample, of which a call of `run` takes `samples`, and its ratio to that of `work`.

    Both are medians over `rounds` turns of a call and of `passes` of the reference.
    """
    w = workspace()
    turns = [(_time(run) / samples, _time(lambda: work(w, passes)) / passes) for _ in range(rounds + 2)][2:]
    ratio = statistics.median(step / reference for step, reference in turns)
    return {"us": round(statistics.median(turn[0] for turn in turns) * 1e6, 2), "ratio": round(ratio, 3)}


def _time(run: Callable[[], object]) -> float:
    begin = time.thread_time()
    run()
    return time.thread_time() - begin
