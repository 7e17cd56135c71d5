r"""Direct solver for the ring of theta lines (block cyclic tridiagonal, diagonal couplings).

Line i has a tridiagonal block D_i in z and diagonal couplings W_i, E_i to its neighbours (tridiagonal ones where the
film is textured: its Jacobian has corners). The ring is cut at two
opposite lines; the lines of either half are eliminated by two chains that meet half-way,

.. math:: D_i \leftarrow D_i - W_i D_{i-1}^{-1} E_{i-1},

and the cuts are closed by spikes: x_i = x'_i - S_i x_c, with x' the solution for x_c = 0 at both cuts c. Only D_i^{-1}
and S_i are stored, as dense blocks column by column, so that a solve is two small matrix-vector products a line in four
chains that do not wait for each other, and two where a spike reaches: it fades with the distance from its cut, and what
is below `FADED` of its start is left out, which costs an iteration that corrects itself nothing. Source: Golub & Van
Loan (2013), sections 4.5 and 4.8 (block elimination, bordering).

Cites: golub_2013.
"""

from __future__ import annotations

from reynolds.jit import inlined
from reynolds.vectors import (
    add_columns,
    clear_column,
    copy,
    exceed,
    invert_two,
    less_product,
    less_scaled,
    multiply,
    multiply_columns,
    times,
    tridiagonal,
)

REACH = 5
"""Place in w[convergence] of the number of lines to either side of a cut at which its spike is not faded."""
FADED = 1e-3


@inlined
def invert_block(w, block, n):
    """Invert in place by Gauss-Jordan, column by column; the blocks are diagonally dominant, so no pivoting."""
    for c in range(n):
        clear_column(w, block, n, c)


@inlined
def load_block(w, L, i, k):
    """Write the tridiagonal block of the line starting at cell k into inverse block i."""
    n = L.n_rows
    tridiagonal(w, L.inverse + i * n * n, L.down + k, L.diag + k, L.up + k, n)
    if L.strips == 1:
        for b in range(n):
            for a in range(n):
                w[L.inverse + i * n * n + b * n + a] += w[L.by_own + k + a] * w[L.strip_reads + k + b]


@inlined
def eliminate(w, L, i, other, to_other, from_other):
    """D_i -= T_i D_other^-1 F_other, T and F diagonal (array offsets), or tridiagonal in a textured film."""
    n = L.n_rows
    k, ko = L.first + i * L.stride, L.first + other * L.stride
    block, inverse = L.inverse + i * n * n, L.inverse + other * n * n
    if L.strips == 1:
        eliminate_strip(w, L, block, inverse, k, ko, to_other, from_other)
    elif L.textured == 0:
        less_scaled(w, block, to_other + k, inverse, from_other + ko, n)
    else:
        for b in range(n):
            for a in range(n):
                for p in range(max(a - 1, 0), min(a + 2, n)):
                    for q in range(max(b - 1, 0), min(b + 2, n)):
                        left, right = corner(L, to_other, p - a) + k + a, corner(L, from_other, b - q) + ko + q
                        w[block + b * n + a] -= w[left] * w[inverse + q * n + p] * w[right]


@inlined
def eliminate_strip(w, L, block, inverse, k, ko, to_other, from_other):
    """`eliminate` column by column, where the couplings have the strips under the lines from cells k and ko."""
    n, lead = L.n_rows, (L.n_rows + 15) // 8 * 8
    x, y, z = L.lanes + 8, L.lanes + 8 + lead, L.lanes + 8 + 2 * lead
    for b in range(n):
        for q in range(n):
            w[x + q] = w[by_strip(L, from_other) + ko + q] * w[L.strip_reads + k + b]
        w[x + b] += w[from_other + ko + b]
        if L.textured == 1:
            for q in range(max(b - 1, 0), min(b + 2, n)):
                if q != b:
                    w[x + q] += w[corner(L, from_other, b - q) + ko + q]
        for q in range(-1, n + 1):
            w[y + q] = 0.0
        for p in range(n):
            for q in range(n):
                w[y + q] += w[inverse + p * n + q] * w[x + p]
        times_line(w, L, z, to_other, k, y)
        for a in range(n):
            w[block + b * n + a] -= w[z + a]


@inlined
def by_strip(L, side):
    """Offset of the derivatives after the strip under the line on a side (west or east)."""
    return L.by_before if side == L.west else L.by_behind


@inlined
def strip_on(w, L, side, k, x):
    """Deflection of the strip under the line on a side of that from cell k, whose line has the values from x."""
    line = L.strip_reads + (k - L.stride if side == L.west else k + L.stride)
    value = 0.0
    for e in range(L.n_rows):
        value += w[line + e] * w[x + e]
    return value


@inlined
def corner(L, side, rows):
    """Offset of the couplings with the line on a side (west or east), that many rows up."""
    if rows == 0:
        return side
    if side == L.west:
        return L.south_west if rows < 0 else L.north_west
    return L.south_east if rows < 0 else L.north_east


@inlined
def coupling(w, L, side, k, x):
    """Flux that cell k takes from the line on a side, whose value in the same row is at x."""
    value = w[side + k] * w[x]
    if L.textured == 1:
        value += w[corner(L, side, -1) + k] * w[x - 1] + w[corner(L, side, 1) + k] * w[x + 1]
    return value


@inlined
def less_line(w, L, y, a, side, k, x):
    """y = a - (couplings of the line from cell k with the values from x)."""
    less_product(w, y, a, side + k, x, L.n_rows)
    if L.textured == 1:
        for e in range(L.n_rows):
            w[y + e] -= w[corner(L, side, -1) + k + e] * w[x + e - 1] + w[corner(L, side, 1) + k + e] * w[x + e + 1]
    if L.strips == 1:
        bend = strip_on(w, L, side, k, x)
        for e in range(L.n_rows):
            w[y + e] -= w[by_strip(L, side) + k + e] * bend


@inlined
def times_line(w, L, y, side, k, x):
    """y = couplings of the line from cell k with the values from x."""
    times(w, y, side + k, x, L.n_rows)
    if L.textured == 1:
        for e in range(L.n_rows):
            w[y + e] += w[corner(L, side, -1) + k + e] * w[x + e - 1] + w[corner(L, side, 1) + k + e] * w[x + e + 1]
    if L.strips == 1:
        bend = strip_on(w, L, side, k, x)
        for e in range(L.n_rows):
            w[y + e] += w[by_strip(L, side) + k + e] * bend


@inlined
def factor(w, L):
    """Eliminate the four chains of the Jacobian in diag, west, east, down, up; `close_spike` completes the factors.

    The lines at one distance from the cuts are inverted side by side: they do not wait for each other.
    """
    n, half, middle = L.n_rows, L.n_theta // 2, L.n_theta // 4
    for cut in range(0, L.n_theta, half):
        load_block(w, L, cut, L.first + cut * L.stride)
    for step in range(1, middle):
        for cut in range(0, L.n_theta, half):
            load_line(w, L, cut + step, step > 1, False)
            load_line(w, L, cut + half - step, False, step > 1)
        for cut in range(0, L.n_theta, half):
            invert_two(w, L.inverse + (cut + step) * n * n, L.inverse + (cut + half - step) * n * n, n)
    for cut in range(0, L.n_theta, half):
        load_line(w, L, cut + middle, True, True)
    invert_two(w, L.inverse + middle * n * n, L.inverse + (half + middle) * n * n, n)


@inlined
def load_line(w, L, i, after_west, after_east):
    """Write the block of line i into inverse block i, less what the eliminated lines to its sides leave of it."""
    load_block(w, L, i, L.first + i * L.stride)
    if after_west:
        eliminate(w, L, i, i - 1, L.west, L.east)
    if after_east:
        eliminate(w, L, i, i + 1, L.east, L.west)


@inlined
def spike_rhs(w, L):
    """Couplings of the open chains to the unknowns of the cut lines (the first line's rows, then the other's)."""
    for k in range(2 * L.n_rows * L.length):
        w[L.spike + k] = 0.0
    for c in range(2 * L.n_rows):
        column = L.spike + c * L.length
        after, before, row = beside_cut(L, c)
        w[column + after + row] = w[L.west + after + row]
        w[column + before + row] = w[L.east + before + row]
        if L.textured == 1:
            # the unknown lies south of the cells one row up
            if row + 1 < L.n_rows:
                w[column + after + row + 1] = w[L.south_west + after + row + 1]
                w[column + before + row + 1] = w[L.south_east + before + row + 1]
            if row > 0:
                w[column + after + row - 1] = w[L.north_west + after + row - 1]
                w[column + before + row - 1] = w[L.north_east + before + row - 1]
        if L.strips == 1:
            reads = w[L.strip_reads + L.first + c // L.n_rows * (L.n_theta // 2) * L.stride + row]
            for e in range(L.n_rows):
                w[column + after + e] += w[L.by_before + after + e] * reads
                w[column + before + e] += w[L.by_behind + before + e] * reads


@inlined
def beside_cut(L, c):
    """Starts of the lines after and before the cut of unknown c, and its row."""
    cut = c // L.n_rows * (L.n_theta // 2)
    before = (cut + L.n_theta - 1) % L.n_theta
    return L.first + (cut + 1) * L.stride, L.first + before * L.stride, c % L.n_rows


@inlined
def close_spike(w, L, c):
    """Column of the block that closes the ring, from solved spike c, and how far the spikes reach up to it."""
    n, half, column = L.n_rows, L.n_theta // 2, L.spike + c * L.length
    for a in range(2 * n):
        after, before, row = beside_cut(L, a)
        line = L.first + a // n * half * L.stride
        own = w[L.inverse + (a // n * half) * n * n + (c % n) * n + row] if a // n == c // n else 0.0
        w[L.closure + c * 2 * n + a] = own - (
            coupling(w, L, L.east, line + row, column + after + row)
            + coupling(w, L, L.west, line + row, column + before + row)
        )
        if L.strips == 1:
            w[L.closure + c * 2 * n + a] -= w[L.by_behind + line + row] * strip_on(w, L, L.east, line, column + after)
            w[L.closure + c * 2 * n + a] -= w[L.by_before + line + row] * strip_on(w, L, L.west, line, column + before)
    reach = 1 if c == 0 else int(w[L.convergence + REACH])
    while strong_beyond(w, L, c, reach):
        reach += 1
    w[L.convergence + REACH] = reach
    if c == 2 * n - 1:
        invert_block(w, L.closure, 2 * n)


@inlined
def strong_beyond(w, L, c, reach):
    """Whether a value of spike c is not faded more than `reach` lines from its cut."""
    after, before, _ = beside_cut(L, c)
    column = L.spike + c * L.length
    for distance in range(reach, L.n_theta // 2 - 1):
        line = distance * L.stride
        if exceed(w, column + after + line, L.n_rows, FADED) or exceed(w, column + before - line, L.n_rows, FADED):
            return True
    return False


@inlined
def open_solve(w, L, columns, count):
    """Solve the four open chains in place for `count` right-hand sides from offset `columns`; the cut lines stay.

    Several are the spikes, zero but for the lines next to their cut, where the chains from the other cut begin with
    zeros, and the borders. A line is solved for all of them before the next one: they do not wait for each other.
    """
    half, middle = L.n_theta // 2, L.n_theta // 4
    for step in range(1, middle):
        for cut in range(2):
            i, j = cut * half + step, cut * half + half - step
            for group in range(1 if count == 1 else 2):
                first, number = columns_from(L, columns, count, cut, group)
                solve_line(w, L, i, first, number, 2 * cut, step > 1, False, False)
                first, number = columns_from(L, columns, count, 1 - cut, group)
                solve_line(w, L, j, first, number, 2 * cut + 1, False, step > 1, False)
    for cut in range(2):
        solve_line(w, L, cut * half + middle, columns, count, 2 * cut, True, True, False)
    for back in range(1, middle):
        for cut in range(2):
            i, j = cut * half + middle - back, cut * half + middle + back
            solve_line(w, L, i, columns, count, 2 * cut, False, True, True)
            solve_line(w, L, j, columns, count, 2 * cut + 1, True, False, True)


@inlined
def columns_from(L, columns, count, cut, group):
    """Offset and number of the columns that a chain from a cut begins with: its spikes, or (group 1) the borders."""
    n = L.n_rows
    if count == 1:
        return columns, 1
    return (columns + cut * n * L.length, n) if group == 0 else (columns + 2 * n * L.length, count - 2 * n)


@inlined
def solve_line(w, L, i, columns, count, lane, after_west, after_east, back):
    """Solve line i for `count` right-hand sides less what the lines to its sides add; `back` takes it from the line."""
    n, lead = L.n_rows, (L.n_rows + 7) // 8 * 8
    a = L.first + i * L.stride
    x = L.lanes + (lane * lead if count == 1 else 0)
    for c in range(count):
        r, y = columns + c * L.length + a, x + c * lead
        if back:
            times_line(w, L, y, L.west if after_west else L.east, a, r - L.stride if after_west else r + L.stride)
        elif after_west:
            less_line(w, L, y, r, L.west, a, r - L.stride)
            if after_east:
                less_line(w, L, y, y, L.east, a, r + L.stride)
        elif after_east:
            less_line(w, L, y, r, L.east, a, r + L.stride)
        else:
            copy(w, y, r, n)
    multiply_columns(w, L.inverse + i * n * n, x, lead, columns + a, L.length, n, count, back)


@inlined
def close_ring(w, L, columns, count):
    """Turn the open chains' solutions, `count` from offset `columns`, into the ring's; edge values become 0.

    Each part of the spikes is added to all of them before the next part is read.
    """
    n, s, half = L.n_rows, L.stride, L.n_theta // 2
    room = (2 * n + 7) // 8 * 8
    cuts = L.lanes + room
    for c in range(count):
        solve_cuts(w, L, columns + c * L.length, L.lanes, cuts + c * room)
    lines = lines_at_once(L)
    for near in range(0, half, lines):
        if near < w[L.convergence + REACH]:
            far = near + lines
            second = L.spike + n * L.length
            # from the edge before a line, which is 0, to the last one's row: full lines of the cache
            after = L.first + (near + 1) * s - 1
            for c in range(count):
                r, one, two = columns + c * L.length, cuts + c * room, cuts + c * room + n
                add_columns(w, r, L.spike, L.length, one, n, after, lines * s)
                add_columns(w, r, L.spike, L.length, one, n, L.first + (L.n_theta - far) * s, lines * s)
                add_columns(w, r, second, L.length, two, n, after + half * s, lines * s)
                add_columns(w, r, second, L.length, two, n, L.first + (half - far) * s, lines * s)
    for c in range(count):
        r = columns + c * L.length
        for a in range(n):
            w[r + L.first + a] = -w[cuts + c * room + a]
            w[r + L.first + half * s + a] = -w[cuts + c * room + n + a]


@inlined
def solve_cuts(w, L, r, known, cuts):
    """Negative values at the cut lines, to offset `cuts`, for the open chains' solution at offset r."""
    n, s, half = L.n_rows, L.stride, L.n_theta // 2
    for i in range(L.n_theta):
        for e in range(n, s):
            w[r + L.first + i * s + e] = 0.0
    for cut in range(2):
        line, x = L.first + cut * half * s, known + cut * n
        before = line - s if cut == 1 else line + (L.n_theta - 1) * s
        less_line(w, L, x, r + line, L.east, line, r + line + s)
        less_line(w, L, x, x, L.west, line, r + before)
    for a in range(2 * n):
        w[cuts + a] = 0.0
    multiply(w, L.closure, known, cuts, 2 * n, True)


@inlined
def lines_at_once(L):
    """Number of lines, a divisor of those between the cuts, in which the reach of the spikes is counted."""
    half = L.n_theta // 2
    return 8 if half % 8 == 0 else 4 if half % 4 == 0 else 2
