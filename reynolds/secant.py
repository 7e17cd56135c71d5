r"""Secant pairs: what a frozen factorisation has missed, kept from stage to stage.

While the rotor moves, the factorisation H of Newton's method grows old and the iteration converges linearly. Two
corrections of one stage show it: a step s was made, the residual changed by y, and H y is not s. Broyden's update

.. math:: H' = \left(I + \frac{a\,s^T}{s^T H y}\right) H, \qquad a = s - H y,

makes it so and changes nothing across s. It costs a scalar product and a sum for each pair, and what is learnt in one
stage serves the next ones, whose error lies in the same directions. After `PAIRS` of them the next one starts again
from H itself; a new factorisation forgets all. The scalar product is that of the film; the journal's step goes along.
Source: Broyden (1965); Kelley (1995), chapter 7 (limited memory).
"""

from __future__ import annotations

from reynolds.jit import inlined
from reynolds.lanes import dot, two_dots

KNOWN = 6
"""Place in w[convergence] of the number of pairs."""
PAIRS = 2
LEAST = 0.1
"""Smallest s H y over s s of a pair that is kept."""


@inlined
def forget(w, L):
    """Go on with the factorisation alone."""
    w[L.convergence + KNOWN] = 0.0


@inlined
def correct(w, L, n):
    """Correct the step (r and the journal's) that iteration n of a stage has found with the factorisation alone."""
    if n > 0 and w[L.convergence + KNOWN] == PAIRS:
        start_again(w, L)
        apply_pairs(w, L)
    else:
        apply_pairs(w, L)
        if n > 0:
            add_pair(w, L)


@inlined
def keep_step(w, L):
    """Keep the step just made (r and the journal's) for the pair that the next iteration makes of it."""
    for k in range(L.first, L.first + L.span):
        w[L.step + k] = w[L.r + k]
    x = L.small + L.n_inj
    w[L.move], w[L.move + 1] = w[x], w[x + 1]


@inlined
def apply_pairs(w, L):
    """Correct the step by all pairs; keeps it as the factorisation gave it in `plain_step`."""
    for k in range(L.first, L.first + L.span):
        w[L.plain_step + k] = w[L.r + k]
    x = L.small + L.n_inj
    w[L.plain_move], w[L.plain_move + 1] = w[x], w[x + 1]
    for i in range(int(w[L.convergence + KNOWN])):
        apply_pair(w, L, i, dot(w, L.pair_step + i * L.length + L.first, L.r + L.first, L.span))


@inlined
def apply_pair(w, L, i, product):
    """Correct the step by pair i; `product`: of its step and the present one."""
    factor = product * w[L.pair_scale + i]
    change = L.pair_change + i * L.length
    for k in range(L.first, L.first + L.span):
        w[L.r + k] += factor * w[change + k]
    for axis in range(2):
        w[L.small + L.n_inj + axis] += factor * w[L.pair_move + 2 * i + axis]


@inlined
def add_pair(w, L):
    """Learn from the step made before, of which H y = s - z is known by the present step z, and correct z by it."""
    own, product = two_dots(w, L.step + L.first, L.step + L.first, L.r + L.first, L.span)
    scale = own - product
    if not scale > LEAST * own:
        return
    i = int(w[L.convergence + KNOWN])
    o = i * L.length
    for k in range(L.first, L.first + L.span):
        w[L.pair_step + o + k] = w[L.step + k]
        w[L.pair_change + o + k] = w[L.r + k]
    for axis in range(2):
        w[L.pair_move + 2 * i + axis] = w[L.small + L.n_inj + axis]
    w[L.pair_scale + i] = 1.0 / scale
    w[L.convergence + KNOWN] = i + 1.0
    apply_pair(w, L, i, product)


@inlined
def start_again(w, L):
    """Put one pair in the place of all: of the step made before and what the factorisation alone saw of it."""
    forget(w, L)
    # H y, from the steps that the factorisation alone gave before and gives now
    for k in range(L.first, L.first + L.span):
        w[L.pair_change + k] = w[L.plain_step + k] - w[L.r + k]
    own, scale = two_dots(w, L.step + L.first, L.step + L.first, L.pair_change + L.first, L.span)
    if not scale > LEAST * own:
        return
    for k in range(L.first, L.first + L.span):
        w[L.pair_step + k] = w[L.step + k]
        w[L.pair_change + k] = w[L.step + k] - w[L.pair_change + k]
    for axis in range(2):
        seen = w[L.plain_move + axis] - w[L.small + L.n_inj + axis]
        w[L.pair_move + axis] = w[L.move + axis] - seen
    w[L.pair_scale] = 1.0 / scale
    w[L.convergence + KNOWN] = 1.0
