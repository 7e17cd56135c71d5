"""Secant pairs of Newton's method: the secant equation, and faster convergence of a linear problem."""

import numpy as np
import pytest

from reynolds.grid import Grid, make_layout
from reynolds.secant import KNOWN, PAIRS, correct, forget, keep_step

LAYOUT = make_layout(Grid(0.02, 0.04, 8, 4), 0, [1], [1])
SPAN = slice(0, LAYOUT.n_theta * LAYOUT.n_rows)
MOVE = LAYOUT.small + LAYOUT.n_inj


class Workspace:
    """A film's workspace whose steps are vectors: the film's values, then the journal's two."""

    def __init__(self):
        self.w = np.zeros(LAYOUT.size)
        self.cells = LAYOUT.first + np.arange(SPAN.stop)

    def corrected(self, plain, n):
        """The step that iteration n makes of the one that the factorisation alone gives."""
        self.w[LAYOUT.r + self.cells], self.w[MOVE : MOVE + 2] = plain[:-2], plain[-2:]
        if n > 0 or self.known:
            correct(self.w, LAYOUT, n)
        keep_step(self.w, LAYOUT)
        return np.r_[self.w[LAYOUT.r + self.cells], self.w[MOVE : MOVE + 2]]

    @property
    def known(self):
        """Number of pairs."""
        return int(self.w[LAYOUT.convergence + KNOWN])


def random_problem(rng, size):
    """Matrix H A = I + E of a factorisation that has grown old in one direction, and a right-hand side H b."""
    direction = rng.normal(size=size)
    direction /= np.linalg.norm(direction)
    other = 0.1 * rng.normal(size=(size, size)) / np.sqrt(size)
    return np.eye(size) + 0.45 * np.outer(direction, direction) + 0.3 * other, rng.normal(size=size)


@pytest.mark.parametrize("stages", [1, 2, 3])
def test_the_last_two_steps_satisfy_the_secant_equation(stages):
    rng = np.random.default_rng(3)
    space, size = Workspace(), SPAN.stop + 2
    for _ in range(stages):
        matrix, right = random_problem(rng, size)
        x = np.zeros(size)
        first = space.corrected(right - matrix @ x, 0)
        space.corrected(right - matrix @ (x + first), 1)
    assert 1 <= space.known <= PAIRS
    assert space.corrected(-(matrix @ first), 0) == pytest.approx(-first, rel=1e-9, abs=1e-9)


def test_pairs_of_earlier_stages_speed_up_the_next():
    rng = np.random.default_rng(5)
    space, size = Workspace(), SPAN.stop + 2
    matrix, _ = random_problem(rng, size)
    left, plain = [], []
    for _ in range(4):
        right, x = rng.normal(size=size), np.zeros(size)
        for n in range(3):
            x = x + space.corrected(right - matrix @ x, n)
        left.append(np.linalg.norm(right - matrix @ x))
        plain.append(np.linalg.norm(np.linalg.matrix_power(np.eye(size) - matrix, 3) @ right))
    assert np.mean(left) < 0.25 * np.mean(plain)


def test_forgotten_pairs_change_nothing():
    rng = np.random.default_rng(7)
    space, size = Workspace(), SPAN.stop + 2
    matrix, right = random_problem(rng, size)
    first = space.corrected(right, 0)
    space.corrected(right - matrix @ first, 1)
    forget(space.w, LAYOUT)
    assert np.array_equal(space.corrected(right, 0), right)


def test_a_step_that_changed_nothing_makes_no_pair():
    space, size = Workspace(), SPAN.stop + 2
    right = np.random.default_rng(9).normal(size=size)
    space.corrected(right, 0)
    # the residual is where it was: s H y is zero
    assert np.array_equal(space.corrected(right, 1), right)
    assert space.known == 0
