r"""Newton's method for one implicit stage of film, plena and journal, with a frozen factorisation.

The stage's equations are the film's residual, the plena (eliminated analytically) and the journal's

.. math:: A\,X - B\,F(p) = b,

where A = I, B = W (compliance of the rotor over a stage) in time, A = K, B = I for a static shaft and B = 0 for a
journal held in place. The film's ring is bordered by one unknown per injector (its change of flow) and the two of the
journal. Several films on one rotor are corrected each by itself (`read_correction`, `finish_correction`); the forces
that are left of their borders without the injectors meet in one small system. Rows are scaled by (h_0/h)^3 against the
frozen thickness h_0 and the unknown is q = p^2: the film's stiffness in these
variables hardly depends on where the journal is, so one factorisation lasts for hundreds of steps.

Where polynomials in time miss a stage by far, a thin gap moves round the sleeve, and storage and shear, which do not
grow with h^3, hold its cells: rows are scaled by their diagonals, those of the factors over those at present. The flow
of an injector whose plenum is at the film's pressure is a root of their difference: the chord to where the correction
leads takes the place of the tangent.

Cites: golub_2013, kelley_1998.
"""

from __future__ import annotations

import math

from numpy import float32

from reynolds.differences import gap_derivative, gap_jacobian, numerical_jacobian
from reynolds.film import force_of, thickness_slope, wrap
from reynolds.injector import nozzle, nozzle_table
from reynolds.jit import inlined, kernel
from reynolds.residual import (
    CAREFUL,
    eliminate_plenum,
    injected_derivative,
    jacobian,
    residual,
    thickness_derivative,
)
from reynolds.ring import close_ring, close_spike, factor, open_solve, spike_rhs
from reynolds.vectors import add_columns, dot, two_dots, wide_vectors

RATE, AGE, FACTORISATIONS, ITERATIONS = 0, 1, 2, 3
"""Places in w[convergence]: estimated rate, stages since it was measured, and two counters."""
SURPRISE, FRESH = 6, 7
"""Places in w[convergence]: largest first correction of the stage, and whether the next solve factorises."""
LIMIT, CUT, LEFT, OVERRUNS = 8, 9, 10, 11
"""Places in w[convergence] for bounded work: count at which a stage ends (0: never), error of a stage that ended so
(0: it did not), largest of them, and steps with such a stage."""
DISTANT = 12
"""Place in w[convergence] of whether the film's stage began far from its starting values."""
BOWED = 13
"""Place in w[convergence] of whether the last correction took chords of flows: it is small where they are steep."""
PRICE = 10.0
"""Corrections that take as long as new factors."""
FAR = 0.03
"""First correction above which starting values are carried masses and every step has factors of its own."""
CHORDS = 2
"""Most solutions of the small system with chords of the injectors' flows."""
BENT = 0.01
"""Share by which chord and tangent of a flow differ from which on the chord is taken."""
MAX_AGE = 48
NEAR = 0.1
"""Correction above which factors of the present state would not last to the answer."""
MOST = 20
"""Most corrections with the same factors."""
LONGEST_MOVE = 0.2
"""Most of the clearance that the journal moves in one correction."""
NOT_CONVERGED = -1
STALE_FACTORS = -2


@inlined
def journal_direction(w, L, axis):
    """Film thickness derivative after the journal's x (axis 0) or y displacement, into dh."""
    source = L.cos if axis == 0 else L.sin
    for k in range(L.length):
        w[L.dh + k] = -w[source + k] * w[L.slope + k]


@inlined
def read_force(w, L, array):
    """Force (fx, fy) [N] that the change of pressure q / (2 p) of the array q at offset `array` makes."""
    for k in range(L.first, L.first + L.n_theta * L.stride):
        w[L.dp + k] = 0.5 * w[array + k] / w[L.p + k]
    fx, fy = two_dots(w, L.dp + L.first, L.force_x + L.first, L.force_y + L.first, L.span)
    return fx, fy


@inlined
def read_footprint(w, ix, L, i, array):
    """Footprint reading of injector i of the change of q in the array at offset `array`."""
    weight = L.reader_weight if w[L.outward + i] > 0.0 else L.plain_weight
    value = 0.0
    for n in range(ix[L.reader_start + i], ix[L.reader_start + i + 1]):
        value += w[weight + n] * w[array + ix[L.reader_cell + n]]
    return value


@inlined
def refresh(w, ix, F, L, U, iadt):
    """Factorise at the present state: ring, borders and the small system. Leaves no residual behind."""
    wide_vectors()
    residual(w, ix, F, L, U, iadt)
    thickness_slope(w, F, L)
    cell_jacobian(w, F, L, U, iadt)
    factor(w, L)
    for k in range(L.length):
        w[L.h_frozen + k] = w[L.h + k]
        w[L.p_frozen + k] = w[L.p + k]
        w[L.scale + k] = 1.0
    spike_rhs(w, L)
    for border in range(L.n_border):
        border_column(w, ix, F, L, U, iadt, border, L.border + border * L.length)
    open_solve(w, L, L.spike, 2 * L.n_rows + L.n_border)
    for c in range(2 * L.n_rows):
        close_spike(w, L, c)
    close_ring(w, L, L.border, L.n_border)
    for border in range(L.n_border):
        keep_border(w, ix, L, border)
    w[L.convergence + FACTORISATIONS] += 1.0
    w[L.convergence + AGE] = MAX_AGE


@inlined
def cell_jacobian(w, F, L, U, iadt):
    """Derivatives of the residual after q: of a plain film in closed form, of any other by differences."""
    if L.foil == 1 or L.textured == 1:
        numerical_jacobian(w, F, L, U, iadt)
    else:
        jacobian(w, F, L, U, iadt)


@inlined
def journal_derivative(w, ix, F, L, U, iadt, axis, gain, column):
    """Derivative of the residual after the journal's displacement along an axis, into the array at offset `column`."""
    journal_direction(w, L, axis)
    if L.foil == 1 or L.textured == 1:
        gap_derivative(w, F, L, U, iadt, axis, column)
    else:
        thickness_derivative(w, F, L, U, iadt, column)
    injected_derivative(w, ix, F, L, gain, column)


@kernel
def linear_terms(w, ix, F, L, U):
    """Jacobian without storage at the present state, and thickness derivatives after X and Y in borders 0 and 1."""
    residual(w, ix, F, L, U, 0.0)
    thickness_slope(w, F, L)
    cell_jacobian(w, F, L, U, 0.0)
    for axis in range(2):
        journal_derivative(w, ix, F, L, U, 0.0, axis, L.film_h, L.border + axis * L.length)
    residual(w, ix, F, L, U, 0.0)


@kernel
def gap_terms(w, F, L, U):
    """Derivatives of the cells' residual without storage after the gap at every node, where `linear_terms` has those
    after q."""
    gap_jacobian(w, F, L, U, 0.0)


@inlined
def keep_border(w, ix, L, border):
    """Store what injectors and journal read of a border's solution."""
    column = L.border + border * L.length
    fx, fy = read_force(w, L, column)
    if L.textured == 1 and border >= L.n_inj:
        slope = L.push + 2 + 2 * (border - L.n_inj)
        fx, fy = fx + w[slope], fy + w[slope + 1]
    w[L.border_force + 2 * border] = fx
    w[L.border_force + 2 * border + 1] = fy
    for i in range(L.n_inj):
        w[L.border_reader + i * L.n_border + border] = read_footprint(w, ix, L, i, column)


@inlined
def border_column(w, ix, F, L, U, iadt, c, column):
    """Right-hand side of border c: a unit film flow of injector c, or a unit journal displacement."""
    if c >= L.n_inj:
        journal_derivative(w, ix, F, L, U, iadt, c - L.n_inj, L.gain_h, column)
        for k in range(L.length):
            w[column + k] = -w[column + k]
    else:
        for k in range(L.length):
            w[column + k] = 0.0
        for n in range(ix[L.source_start + c], ix[L.source_start + c + 1]):
            w[column + ix[L.source_cell + n]] += w[L.source_weight + n] * F.source


@inlined
def flow_rows(w, ix, L):
    """Rows of the border system for the changes of the film flows, as scaled rows see them."""
    nb = L.n_border
    distant = w[L.convergence + DISTANT] > 0.0
    for i in range(L.n_inj):
        cell = ix[L.source_cell + ix[L.source_start + i]]
        ratio = w[L.h + cell] / w[L.h_frozen + cell]
        own = 1.0 / w[L.scale + cell] if distant else ratio * ratio * ratio
        for c in range(nb):
            w[L.small_matrix + c * nb + i] = -w[L.gain_q + i] * w[L.border_reader + i * nb + c]
        w[L.small_matrix + i * nb + i] += own


@inlined
def journal_rows(w, L):
    """Rows of the border system for the journal's displacement."""
    nb = L.n_border
    for row in range(2):
        r = L.n_inj + row
        b = L.journal_b + 2 * row
        for c in range(nb):
            f = L.border_force + 2 * c
            w[L.small_matrix + c * nb + r] = -(w[b] * w[f] + w[b + 1] * w[f + 1])
        for col in range(2):
            w[L.small_matrix + (L.n_inj + col) * nb + r] += w[L.journal_a + 2 * row + col]


@inlined
def eliminate_small(w, matrix, x, n, number):
    """Eliminate the first `number` unknowns of the column-major n x n system in place: all n leave the solution in x.

    The small system is near the unit matrix: no pivoting.
    """
    for c in range(number):
        pivot = 1.0 / w[matrix + c * n + c]
        w[x + c] *= pivot
        for a in range(n):
            if a != c:
                w[x + a] -= w[matrix + c * n + a] * w[x + c]
        for b in range(c + 1, n):
            factor = w[matrix + b * n + c] * pivot
            for a in range(n):
                if a != c:
                    w[matrix + b * n + a] -= w[matrix + c * n + a] * factor
            w[matrix + b * n + c] = factor


@inlined
def own_share(p, h, iadt, drag, cross, spread):
    """Derivative of a cell's residual after its own q, were pressure p and gap h all around it."""
    upwind = max(drag - p * h * h * cross, 0.0)
    return 0.5 * h / p * (iadt + 2.0 * upwind) + spread * h * h * h


@inlined
def find_scales(w, F, L, U, iadt):
    """Scales of the rows for a distant stage: their diagonals when the factors were made over those at present."""
    drag = abs(U / (4.0 * F.dy))
    cross = 1.0 / (12.0 * w[L.mu] * F.dy * F.dy)
    spread = (1.0 / (F.dy * F.dy) + 1.0 / (F.dz * F.dz)) / (12.0 * w[L.mu])
    for k in range(L.first, L.first + L.n_theta * L.stride):
        then = own_share(w[L.p_frozen + k], w[L.h_frozen + k], iadt, drag, cross, spread)
        w[L.scale + k] = then / own_share(w[L.p + k], w[L.h + k], iadt, drag, cross, spread)


@inlined
def scale_rows(w, L):
    """Turn r into the scaled right-hand side and fill two_p, which makes changes of p from those of q.

    In trouble (`CAREFUL`) p changes by the frozen derivative: storage is linear in p, and a gap that opens fast empties
    almost to zero pressure, where steps in q would overshoot for ever.
    """
    careful = w[L.convergence + CAREFUL] > 0.0
    distant = w[L.convergence + DISTANT] > 0.0
    for k in range(L.first, L.first + L.n_theta * L.stride):
        p, h = w[L.p + k], w[L.h + k]
        # of the precision of a correction: a quarter of the time of a division in full precision
        inverse = float(float32(1.0) / float32(p * h))
        ratio = w[L.h_frozen + k] * p * inverse
        w[L.two_p + k] = 0.5 * h * inverse
        w[L.r + k] *= -(w[L.scale + k] if distant else ratio * ratio * ratio)
    if careful:
        for k in range(L.first, L.first + L.n_theta * L.stride):
            w[L.two_p + k] = 0.5 / w[L.p_frozen + k]


@inlined
def read_ring(w, ix, L):
    """Reactions of injectors and journal to the ring's solution in r: footprints into w[reading], and the film force
    [N] with it."""
    for k in range(L.first, L.first + L.n_theta * L.stride):
        w[L.dp + k] = w[L.p + k] + w[L.r + k] * w[L.two_p + k]
    fx, fy = force_of(w, L, L.dp)
    for i in range(L.n_inj):
        w[L.reading + i] = read_footprint(w, ix, L, i, L.r)
    return fx, fy


@inlined
def chord_flows(w, L, iadt, flows, dx, dy):
    """Chords of the injectors' flows to where the film flows from offset `flows` and the journal's move lead, in place
    of tangents; returns whether they differ."""
    table = nozzle_table(w, L.nozzle)
    bent = False
    for i in range(L.n_inj):
        row = L.border_reader + i * L.n_border
        dq = w[L.reading + i] + w[row + L.n_inj] * dx + w[row + L.n_inj + 1] * dy
        for c in range(L.n_inj):
            dq += w[row + c] * w[flows + c]
        p, plenum, by_plenum, by_q = w[L.local_p + i], w[L.plenum + i], w[L.film_p + i], w[L.film_q + i]
        dh = -(w[L.inj_cos + i] * dx + w[L.inj_sin + i] * dy)
        dP = max(-(w[L.shift + i] + w[L.pull_q + i] * dq + w[L.pull_h + i] * dh), -0.8 * plenum)
        flux, _, _ = nozzle(plenum + dP, math.sqrt(max(p * p + dq, 0.04 * p * p)), table)
        line, change = by_plenum * dP + by_q * dq, w[L.curtain + i] * w[L.local_h + i] * flux - w[L.film_flow + i]
        share = min(max(change / line, 0.02), 50.0) if line != 0.0 else 1.0
        bent = bent or abs(share - 1.0) > BENT
        eliminate_plenum(w, L, i, iadt, 1.0, by_plenum * share, by_q * share)
    return bent


@inlined
def tangents_serve(w, L):
    """Whether tangents of the injectors' flows serve: in stages near their start, and where the residual has chords."""
    return w[L.convergence + DISTANT] == 0.0 or w[L.convergence + CAREFUL] > 0.0 or L.n_inj == 0


@inlined
def solve_borders(w, ix, L, iadt):
    """Changes of the film flows and of the journal into w[small]; expects the ring's solution in r."""
    fx, fy = read_ring(w, ix, L)
    solve_small(w, ix, L, fx, fy)
    w[L.convergence + BOWED] = 0.0
    for _ in range(CHORDS):
        if tangents_serve(w, L) or not chord_flows(w, L, iadt, L.small, w[L.small + L.n_inj], w[L.small + L.n_inj + 1]):
            return
        w[L.convergence + BOWED] = 1.0
        solve_small(w, ix, L, fx, fy)


@inlined
def flow_sides(w, L, x):
    """Right-hand sides of the flows' rows into the array from offset x."""
    for i in range(L.n_inj):
        w[x + i] = w[L.defect + i] + w[L.gain_q + i] * w[L.reading + i]


@inlined
def solve_small(w, ix, L, fx, fy):
    """Changes of the film flows and of the journal into w[small]; (fx, fy) is the film force of the ring's solution."""
    flow_rows(w, ix, L)
    journal_rows(w, L)
    nb, ni = L.n_border, L.n_inj
    o = L.small + nb
    flow_sides(w, L, o)
    for row in range(2):
        a, b = L.journal_a + 2 * row, L.journal_b + 2 * row
        w[o + ni + row] = (
            w[L.journal_rhs + row] - w[a] * w[L.journal] - w[a + 1] * w[L.journal + 1] + w[b] * fx + w[b + 1] * fy
        )
    eliminate_small(w, L.small_matrix, o, nb, nb)
    for a in range(nb):
        w[L.small + a] = w[o + a]


@inlined
def add_borders(w, L):
    """r += border columns times their unknowns."""
    add_columns(w, L.r, L.border, L.length, L.small, L.n_border, L.first, L.n_theta * L.stride)


@inlined
def update(w, ix, F, L):
    """Apply the correction in r; returns its size: rms of the pressures / ambient + journal / clearance scale."""
    ni = L.n_inj
    for k in range(L.first, L.first + L.n_theta * L.stride):
        dp = w[L.r + k] * w[L.two_p + k]
        w[L.dp + k] = dp
        least, most = 0.2 * w[L.p + k], 5.0 * w[L.p + k]
        new = w[L.p + k] + dp
        new = least if new < least else new
        w[L.p + k] = most if new > most else new
    total = dot(w, L.dp + L.first, L.dp + L.first, L.span)
    wrap(w, L, L.p)
    dx, dy = w[L.small + ni], w[L.small + ni + 1]
    longest = LONGEST_MOVE * F.clearance
    w[L.journal] += min(max(dx, -longest), longest)
    w[L.journal + 1] += min(max(dy, -longest), longest)
    for i in range(ni):
        dq = read_footprint(w, ix, L, i, L.r)
        dh = -(w[L.inj_cos + i] * dx + w[L.inj_sin + i] * dy)
        change = w[L.shift + i] + w[L.pull_q + i] * dq + w[L.pull_h + i] * dh
        w[L.plenum + i] = min(max(w[L.plenum + i] - change, 0.2 * w[L.plenum + i]), 5.0 * w[L.plenum + i])
    return math.sqrt(total / (L.n_theta * L.n_rows)) / F.pa + (abs(dx) + abs(dy)) / F.clearance


@inlined
def newton(w, ix, F, L, U, iadt, tolerance, patient, careful):
    """Iterate until what is left is below `tolerance`; returns the number of iterations or a negative status.

    The error left after a correction d is estimated as d rate / (1 - rate); the rate is measured by two corrections
    and kept for the stages that follow, at most MAX_AGE of them. On success r holds the residual of the answer.
    STALE_FACTORS asks the caller for `refresh` and another, `careful` go: where corrections hardly become smaller and,
    unless the caller is `patient`, where new factors cost less than the corrections that the old ones still need.
    """
    wide_vectors()
    before = 0.0
    n = 0
    done = False
    while True:
        w[L.convergence + CAREFUL] = 1.0 if careful or n >= 4 else 0.0
        residual(w, ix, F, L, U, iadt)
        if done:
            return n
        solve_ring(w, L)
        solve_borders(w, ix, L, iadt)
        add_borders(w, L)
        size = update(w, ix, F, L)
        n += 1
        w[L.convergence + ITERATIONS] += 1.0
        verdict = judge_correction(w, L.convergence, n, size, before, tolerance, patient)
        if verdict < 0:
            return verdict
        done = verdict > 0
        before = size


@inlined
def solve_ring(w, L):
    """Solution of the ring alone, without borders, for the residual in r."""
    scale_rows(w, L)
    open_solve(w, L, L.r, 1)
    close_ring(w, L, L.r, 1)


@inlined
def judge_correction(w, c, n, size, before, tolerance, patient):
    """1 if what is left after the n-th correction is small enough, 0 if not, or a negative status.

    A correction by chords is never the last: a steep one is small however much is left. `size` and `before` are those
    of this correction and of the last one; w[c:] is the film's memory of convergence.
    """
    if not size < 1e6 and (w[c + LIMIT] == 0.0 or size != size):
        return NOT_CONVERGED
    rate = w[c + RATE]
    known = w[c + AGE] < MAX_AGE
    if n == 1:
        w[c + SURPRISE] = max(w[c + SURPRISE], size)
    else:
        rate = size / before
        w[c + RATE] = max(rate, 0.02)
        w[c + AGE] = 0.0
        known = True
    small = size < 1e-3 * tolerance or (known and rate < 1.0 and size * rate < tolerance * (1.0 - rate))
    if small and w[c + BOWED] == 0.0:
        w[c + AGE] += 1.0
        return 1
    impatient = n > 1 and not patient and w[c + CAREFUL] == 0.0 and size < NEAR
    stale = n == MOST or (n > 3 and rate > 0.5) or (impatient and lasts_long(size, rate, tolerance))
    if w[c + LIMIT] > 0.0:
        return bounded_verdict(w, c, stale, known, size, rate)
    return STALE_FACTORS if stale else 0


@inlined
def bounded_verdict(w, c, stale, known, size, rate):
    """As `judge_correction` where the answer is not there yet and work is bounded: new factors need room for a
    correction after them; without room, or where corrections grow, the stage ends with what it has."""
    room = room_left(w, c)
    if stale and room > PRICE:
        return STALE_FACTORS
    if room >= 1.0 and not (stale and rate >= 1.0):
        return 0
    cut_short(w, c, size * rate / (1.0 - rate) if known and rate < 1.0 else size)
    return 1


@inlined
def room_left(w, c):
    """Corrections that bounded work leaves to a stage; more than any stage needs where it is not bounded."""
    if w[c + LIMIT] == 0.0:
        return 1e9
    return w[c + LIMIT] - w[c + ITERATIONS] - PRICE * w[c + FACTORISATIONS]


@inlined
def cut_short(w, c, error):
    """Note a stage that ends with an error (pressure / ambient + journal / clearance) above the tolerance."""
    w[c + CUT] = max(w[c + CUT], error)
    w[c + LEFT] = max(w[c + LEFT], error)


@inlined
def lasts_long(size, rate, tolerance):
    """Whether ten more corrections at this rate, the price of new factors, would not do."""
    square = rate * rate
    fourth = square * square
    return size * (fourth * fourth * square) > tolerance * (1.0 - rate)


@inlined
def begin_correction(w, ix, F, L, U, iadt, careful):
    """Residual of a film at the present state, into r."""
    wide_vectors()
    w[L.convergence + CAREFUL] = 1.0 if careful else 0.0
    residual(w, ix, F, L, U, iadt)


@inlined
def force_rows(w, L):
    """Rows of the border system for the film force, in place of those for the journal."""
    nb = L.n_border
    for c in range(nb):
        for axis in range(2):
            w[L.small_matrix + c * nb + L.n_inj + axis] = -w[L.border_force + 2 * c + axis]


@inlined
def read_correction(w, ix, L, iadt):
    """Share of a film in the common system of several films: its force as the journal moves, its injectors eliminated.

    Expects the residual in r and leaves the ring's solution there. In w[small_matrix], column by column, and in
    w[small + n_border] stand the rows of the flows and of the force [N] for the journal's displacement.
    """
    wide_vectors()
    solve_ring(w, L)
    fx, fy = read_ring(w, ix, L)
    eliminate_flows(w, ix, L, fx, fy)
    w[L.convergence + BOWED] = 0.0
    for _ in range(CHORDS):
        if tangents_serve(w, L) or not chord_flows(w, L, iadt, L.small + L.n_border, 0.0, 0.0):
            return
        w[L.convergence + BOWED] = 1.0
        eliminate_flows(w, ix, L, fx, fy)


@inlined
def eliminate_flows(w, ix, L, fx, fy):
    """Small system of a film for the force (fx, fy) of the ring's solution, its injectors eliminated."""
    flow_rows(w, ix, L)
    force_rows(w, L)
    x = L.small + L.n_border
    flow_sides(w, L, x)
    w[x + L.n_inj], w[x + L.n_inj + 1] = fx, fy
    eliminate_small(w, L.small_matrix, x, L.n_border, L.n_inj)


@inlined
def finish_correction(w, ix, F, L):
    """Apply the journal's change in w[small] and those that follow; returns the correction's size as `update` does."""
    wide_vectors()
    nb, x, y = L.n_border, L.small_matrix + L.n_inj * L.n_border, L.small_matrix + (L.n_inj + 1) * L.n_border
    dx, dy = w[L.small + L.n_inj], w[L.small + L.n_inj + 1]
    for i in range(L.n_inj):
        w[L.small + i] = w[L.small + nb + i] - (w[x + i] * dx + w[y + i] * dy)
    add_borders(w, L)
    return update(w, ix, F, L)
