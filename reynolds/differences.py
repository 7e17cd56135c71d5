"""Derivatives of the cells' residual by central differences, for films without a closed form of them.

A cell's residual depends on the eight nodes around it and on its own. Nodes that are four lines or three rows apart
have no cell in common, so that twelve pairs of residuals give every derivative, to nine digits.

Cites: curtis_1974.
"""

from __future__ import annotations

import math

from reynolds.film import wrap
from reynolds.jit import inlined, shared
from reynolds.residual import cell_residual

STEP = 1e-5
"""Relative step of p^2, and step of a gap as a share of the clearance."""


@shared
def cells_only(w, F, L, U, iadt):
    """`residual.cell_residual` as a call."""
    cell_residual(w, F, L, U, iadt)


@inlined
def cells_there(w, F, L, U, iadt):
    """`cells_only` where it is: its callers have no further copy of its machine code."""
    cells_only(w, F, L, U, iadt)


@inlined
def shift(w, L, array, kept, line, row, factor, addend):
    """Write the array kept at offset `kept` back, with every fourth line's and third row's nodes changed."""
    for k in range(L.length):
        w[array + k] = w[kept + k]
    for i in range(line, L.n_theta, 4):
        for j in range(row, L.n_rows, 3):
            k = array + L.first + i * L.stride + j
            w[k] = w[k] * factor + addend
    wrap(w, L, array)


@inlined
def keep_neighbours(w, L, i, j, inverse):
    """Derivatives of the residuals about node (i, j), whose differences are those of w[dh] and r."""
    for di in range(-1, 2):
        line = L.first + (i + di + L.n_theta) % L.n_theta * L.stride
        for dj in range(-1, 2):
            if j + dj >= 0 and j + dj < L.n_rows:
                k = line + j + dj
                value = (w[L.dh + k] - w[L.r + k]) * inverse
                # a node is the western neighbour of the cell east of it
                if dj == 0:
                    w[(L.diag if di == 0 else (L.west if di > 0 else L.east)) + k] = value
                elif di == 0:
                    w[(L.down if dj > 0 else L.up) + k] = value
                elif L.textured == 1:
                    south, north = L.south_west if di > 0 else L.south_east, L.north_west if di > 0 else L.north_east
                    w[(south if dj > 0 else north) + k] = value


@inlined
def keep_push(w, L, i, j, inverse):
    """Derivative at node (i, j) of the push of the patches around it, whose differences are those of two arrays."""
    k = L.first + i * L.stride + j
    before = L.first + (i - 1 + L.n_theta) % L.n_theta * L.stride + j
    x = y = 0.0
    for corner in (k - 1, k, before - 1, before):
        x += w[L.shifted_x + corner] - w[L.push_x + corner]
        y += w[L.shifted_y + corner] - w[L.push_y + corner]
    w[L.push_x_by + k], w[L.push_y_by + k] = x * inverse, y * inverse


@inlined
def shift_strips(w, L, line, change):
    """Add a change to the deflection of every fourth strip, ghosts and edges too."""
    for i in range(line, L.n_theta, 4):
        start = L.bend + L.first + i * L.stride
        for k in range(start + L.half - 1, start + L.n_rows + 1):
            w[k] += change
            if i == 0:
                w[k + L.n_theta * L.stride] += change
            if i == L.n_theta - 1:
                w[k - L.n_theta * L.stride] += change


@inlined
def read_strips(w, F, L, iadt):
    """Derivatives of the deflection of every strip after q = p^2 along it."""
    strip = F.strip / (1.0 + F.bend_time * iadt)
    for i in range(L.n_theta):
        line = L.first + i * L.stride
        mean = 0.0
        for k in range(line, line + L.n_rows):
            mean += w[L.weight + k] * (w[L.p + k] - F.pa)
        on = 1.0 if mean >= 0.0 else 0.0
        for k in range(line, line + L.n_rows):
            w[L.strip_reads + k] = on * strip * 0.5 * w[L.weight + k] / w[L.p + k]
    wrap(w, L, L.strip_reads)


@shared
def strip_columns(w, F, L, U, iadt):
    """Derivatives of the residual, and of the push between the lines, after the deflection of every strip.

    Expects that the strips are held; a strip moves the residuals of its own line and of both next to it.
    """
    step = STEP * F.clearance
    for line in range(4):
        shift_strips(w, L, line, step)
        cells_there(w, F, L, U, iadt)
        for k in range(L.length):
            w[L.dh + k] = w[L.r + k]
        if L.textured == 1:
            for k in range(L.length):
                w[L.shifted_x + k], w[L.shifted_y + k] = w[L.push_x + k], w[L.push_y + k]
        shift_strips(w, L, line, -2.0 * step)
        cells_there(w, F, L, U, iadt)
        shift_strips(w, L, line, step)
        for i in range(line, L.n_theta, 4):
            own = L.first + i * L.stride
            before = L.first + (i - 1 + L.n_theta) % L.n_theta * L.stride
            behind = L.first + (i + 1) % L.n_theta * L.stride
            for j in range(L.n_rows):
                w[L.by_own + own + j] = (w[L.dh + own + j] - w[L.r + own + j]) * (0.5 / step)
                w[L.by_behind + before + j] = (w[L.dh + before + j] - w[L.r + before + j]) * (0.5 / step)
                w[L.by_before + behind + j] = (w[L.dh + behind + j] - w[L.r + behind + j]) * (0.5 / step)
            if L.textured == 1:
                x = y = 0.0
                for start in (own, before):
                    for k in range(start + L.half - 1, start + L.n_rows):
                        x += w[L.shifted_x + k] - w[L.push_x + k]
                        y += w[L.shifted_y + k] - w[L.push_y + k]
                w[L.strip_push + 2 * i], w[L.strip_push + 2 * i + 1] = x * (0.5 / step), y * (0.5 / step)


@shared
def differences(w, F, L, U, iadt, array, squared):
    """Derivatives after the nodes of an array: after q = p^2 for p (`squared`), else after the values themselves.

    Those of the residual stand as a Jacobian does, those of the push between lines in w[push_x_by] and w[push_y_by].
    """
    kept = L.two_p
    for k in range(L.length):
        w[kept + k] = w[array + k]
        w[L.diag + k] = w[L.west + k] = w[L.east + k] = w[L.down + k] = w[L.up + k] = 0.0
        if L.textured == 1:
            w[L.south_west + k] = w[L.south_east + k] = w[L.north_west + k] = w[L.north_east + k] = 0.0
    addend = 0.0 if squared else STEP * F.clearance
    for line in range(4):
        for row in range(3):
            shift(w, L, array, kept, line, row, math.sqrt(1.0 + STEP) if squared else 1.0, addend)
            cells_there(w, F, L, U, iadt)
            for k in range(L.length):
                w[L.dh + k] = w[L.r + k]
            if L.textured == 1:
                for k in range(L.length):
                    w[L.shifted_x + k], w[L.shifted_y + k] = w[L.push_x + k], w[L.push_y + k]
            shift(w, L, array, kept, line, row, math.sqrt(1.0 - STEP) if squared else 1.0, -addend)
            cells_there(w, F, L, U, iadt)
            for i in range(line, L.n_theta, 4):
                for j in range(row, L.n_rows, 3):
                    p = w[kept + L.first + i * L.stride + j]
                    inverse = 0.5 / (STEP * p * p) if squared else 0.5 / addend
                    keep_neighbours(w, L, i, j, inverse)
                    if L.textured == 1:
                        keep_push(w, L, i, j, inverse)
    for k in range(L.length):
        w[array + k] = w[kept + k]
    cells_there(w, F, L, U, iadt)


@inlined
def numerical_jacobian(w, F, L, U, iadt):
    """As `residual.jacobian`, with corners for grooves; leaves no residual of injectors behind.

    With strips the derivatives after q are those over a foil that is held, and its own follow them.
    """
    if L.strips == 1:
        w[L.held] = 1.0
        read_strips(w, F, L, iadt)
        strip_columns(w, F, L, U, iadt)
        differences(w, F, L, U, iadt, L.p, True)
        w[L.held] = 0.0
    else:
        differences(w, F, L, U, iadt, L.p, True)


@inlined
def gap_jacobian(w, F, L, U, iadt):
    """Derivatives after the gap at every node, in place of those after q."""
    differences(w, F, L, U, iadt, L.clearance, False)


@shared
def gap_derivative(w, F, L, U, iadt, axis, out):
    """Derivative of the cells' residual after the journal's displacement along an axis, into the array at `out`, and
    that of the push between the lines, into w[push + 2 + 2 axis]."""
    begin, step = w[L.journal + axis], STEP * F.clearance
    w[L.journal + axis] = begin + step
    cells_there(w, F, L, U, iadt)
    for k in range(L.length):
        w[L.two_p + k] = w[L.r + k]
    slope = L.push + 2 + 2 * axis
    if L.textured == 1:
        w[slope], w[slope + 1] = w[L.push], w[L.push + 1]
    w[L.journal + axis] = begin - step
    cells_there(w, F, L, U, iadt)
    for k in range(L.length):
        w[L.two_p + k] = (w[L.two_p + k] - w[L.r + k]) * (0.5 / step)
    if L.textured == 1:
        for e in range(2):
            w[slope + e] = (w[slope + e] - w[L.push + e]) * (0.5 / step)
    w[L.journal + axis] = begin
    cells_there(w, F, L, U, iadt)
    # `out` may be where the residual was
    for k in range(L.length):
        w[out + k] = w[L.two_p + k]
