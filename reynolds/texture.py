r"""Fluxes and friction of a film whose gap is not smooth: many narrow grooves, steps and pockets, jumps between lobes.

Between four nodes lies a patch with one groove depth d, groove share alpha and groove angle beta from the
circumferential direction. Pressure falls alike along ridges (thickness h) and grooves (h + d), and the flow across them
is the same through both, so that the mean flux of the narrow-groove theory is

.. math:: \mathbf q = \tfrac{U}{2}\,p\,(S\cos\beta\,\mathbf e_s - T\sin\beta\,\mathbf e_n)
          - \frac{1}{24\mu}\left(A\,\mathbf e_s\mathbf e_s + B\,\mathbf e_n\mathbf e_n\right)\nabla p^2

.. math:: A = \alpha G(h+d) + (1-\alpha) G(h), \quad B^{-1} = \alpha / G(h+d) + (1-\alpha) / G(h), \quad
          S = h + \alpha d, \quad T = B\,(\alpha (h+d) / G(h+d) + (1-\alpha) h / G(h))

with e_s along the grooves, e_n across, and G(h) = h^3, or h^2 (h + 6 lambda) for a gas that slips (`reynolds.film`).
Grooves on the journal turn with it: there the relative flux has U reversed and all gas moves with the surface, which
adds U p S. A step or pocket is a patch that is all groove (alpha = 1). Half a face of a cell lies in one patch; flux at
it takes the gradient along the face from both of the patch's sides.

A patch that edges cut is a laminate of its pieces, by the same two rules: the flux normal to an edge and the gradient
along it are the same on both sides. A lane is what lies behind one another in the direction of a flux, and lanes lie
side by side; both are exact for edges that cross the patch, wherever they do. p^2 falls from line to line as the
resistance that is passed, not as the length: so do the shares that the two have of a piece's axial flux, its mass and
the area that their pressures act on, mass and area with the resistances of a journal in the middle. The pressure at an
edge differs from that by what the surface piles up there,

.. math:: \Delta p = 6\mu U \sum_{passed} r\,(S - \bar S), \qquad r = \frac{a}{A}, \quad \bar S = \sum r S \Big/ \sum r

over pieces of the lengths a, as at a Rayleigh step. A piece is dragged along at its own pressure, the pressure at an
edge falls towards the ends of a pocket, and it pushes the journal. Every piece has the thickness of its middle. What
acts between two lines is summed with exp(i theta) integrated over the pieces, divided by sinc^2(step / 2), the factor
that the trapezoidal rule leaves out everywhere, so that the force of a long film is exact up to that factor, and that
of a journal in the middle of equal pockets vanishes.

The friction torque is that of `reynolds.film`, summed over what is there: the gap is that of ridge, groove or pocket,
and so is the gradient,

.. math:: \overline{h\,\partial_y p^2} = S\cos\beta\,\partial_s p^2 - T\sin\beta\,\partial_n p^2
          + 12\mu U p \sin^2\!\beta\left(W - \frac{T^2}{B}\right), \quad
          W = \frac{\alpha (h+d)^2}{G(h+d)} + \frac{(1-\alpha) h^2}{G(h)}

with U reversed for grooves on the journal, whose flanks the pressure pushes: h dp/dy less that mean acts there in its
place.

Source: Vohr & Chow (1965), narrow-groove theory; Hamrock (2004), ch. 16.

Cites: hamrock_2004, vohr_1965.
"""

from __future__ import annotations

from reynolds.film import shear_gap, slip_length, smooth_torque
from reynolds.grid import LAMINATE, MEDIUM
from reynolds.jit import inlined, kernel


@inlined
def mean_flow(h, depth, share, slip):
    """A, B [m3] and S, T [m] of a patch: conductances along and across its grooves, what the surface drags along and
    across."""
    g = h + depth
    rest = 1.0 - share
    along = share * g * g * (g + slip) + rest * h * h * (h + slip)
    a, b = share / (g * (g + slip)), rest / (h * (h + slip))
    across = 1.0 / (a / g + b / h)
    return along, across, share * g + rest * h, across * (a + b)


@inlined
def flux_along(w, L, k, U, h, p, dy, dz, jump, step, mu, slip, grooved):
    """Circumferential flux of patch k at thickness h and pressure p for the gradients dy, dz of p^2 [Pa2/m].

    `jump` is the change of p over the face, which the flux is blended with where the cell number exceeds 2. Of the
    film: `step` [m] along the circumference, viscosity, slip [Pa m] and `grooved`.
    """
    a, b, s, t = mean_flow(h, w[L.depth + k], w[L.share + k], slip / p)
    cc, sc = w[L.cos_squared + k], w[L.sin_cos + k]
    conductance = a * cc + b * (1.0 - cc)
    drag = s + grooved * (cc * s + (1.0 - cc) * t - s)
    carried = 0.5 * U * drag
    blend = 0.5 * abs(carried) - conductance * p / (12.0 * mu * step)
    blend = blend if blend > 0.0 else 0.0
    return carried * p - blend * jump - (conductance * dy + (a - b) * sc * dz) / (24.0 * mu)


@inlined
def flux_across(w, L, k, U, h, p, dy, dz, mu, slip, grooved):
    """Axial flux of patch k; as `flux_along`."""
    a, b, s, t = mean_flow(h, w[L.depth + k], w[L.share + k], slip / p)
    cc, sc = w[L.cos_squared + k], w[L.sin_cos + k]
    conductance = a * (1.0 - cc) + b * cc
    return 0.5 * U * grooved * sc * (s - t) * p - ((a - b) * sc * dy + conductance * dz) / (24.0 * mu)


@inlined
def patch_fluxes(w, F, L, U):
    """Fluxes through the four half faces of every patch, divided by twice the step; one loop without branches."""
    # the loop runs side by side if it reads nothing that it might have written
    length, width, mu, slip, grooved = F.dy, F.dz, w[L.mu], w[L.slip], F.grooved
    t, a = 0.5 / length, 0.5 / width
    for k in range(L.first - L.stride - 1, L.first + L.n_theta * L.stride):
        e, n = k + L.stride, k + 1
        ne = e + 1
        p, pe, pn, pne = w[L.p + k], w[L.p + e], w[L.p + n], w[L.p + ne]
        h, he, hn, hne = w[L.h + k], w[L.h + e], w[L.h + n], w[L.h + ne]
        ys, yn = (pe * pe - p * p) / length, (pne * pne - pn * pn) / length
        zw, ze = (pn * pn - p * p) / width, (pne * pne - pe * pe) / width
        y, z = 0.5 * (ys + yn), 0.5 * (zw + ze)
        inside, south = w[L.patch + k], w[L.patch_south + k]
        below = flux_along(w, L, k, U, 0.5 * (h + he), 0.5 * (p + pe), ys, z, pe - p, length, mu, slip, grooved)
        above = flux_along(w, L, k, U, 0.5 * (hn + hne), 0.5 * (pn + pne), yn, z, pne - pn, length, mu, slip, grooved)
        west = flux_across(w, L, k, U, 0.5 * (h + hn), 0.5 * (p + pn), y, zw, mu, slip, grooved)
        east = flux_across(w, L, k, U, 0.5 * (he + hne), 0.5 * (pe + pne), y, ze, mu, slip, grooved)
        w[L.south + k], w[L.north + k] = south * t * below, inside * t * above
        w[L.face_west + k], w[L.face_east + k] = inside * a * west, inside * a * east


@inlined
def sides(w, F, L, k, axis):
    """Pressure, gradient of p^2 along an axis (0: theta, 1: z), change of p and thickness on the near and the far side
    of patch k, and the mean gradient along the other axis."""
    step, aside = (L.stride, 1) if axis == 0 else (1, L.stride)
    length, width = (1.0 / F.dy, 1.0 / F.dz) if axis == 0 else (1.0 / F.dz, 1.0 / F.dy)
    a, b, c, d = w[L.p + k], w[L.p + k + step], w[L.p + k + aside], w[L.p + k + aside + step]
    near = 0.5 * (a + b), (b * b - a * a) * length, b - a, 0.5 * (w[L.h + k] + w[L.h + k + step])
    far = 0.5 * (c + d), (d * d - c * c) * length, d - c, 0.5 * (w[L.h + k + aside] + w[L.h + k + aside + step])
    return near, far, 0.5 * (c * c - a * a + d * d - b * b) * width


@inlined
def middle(w, L, k):
    """Mean thickness [m] of patch k, mean pressure [Pa], and slip [m] there."""
    n, e = k + 1, k + L.stride
    h = 0.5 * (0.5 * (w[L.h + k] + w[L.h + e]) + 0.5 * (w[L.h + n] + w[L.h + e + 1]))
    p = 0.25 * (w[L.p + k] + w[L.p + e] + w[L.p + n] + w[L.p + e + 1])
    return h, p, slip_length(w, L, p)


@inlined
def incline(w, L, k):
    """Change of thickness [m] from line to line in patch k."""
    n, e = k + 1, k + L.stride
    return 0.5 * (w[L.h + e] - w[L.h + k] + w[L.h + e + 1] - w[L.h + n])


@inlined
def piece(w, F, L, i, j, s, t, h, rise):
    """Thickness, depth, groove share, cos^2 and sin cos of the groove angle of piece (s, t) of the patch behind line i
    and row j, whose mean thickness is h and rises by `rise` from line to line."""
    line, row = i * L.pieces + s, j * L.pieces + t
    slant = w[L.row_slant + row]
    depth, share, cc, sc = 0.0, 0.0, 1.0, 0.0
    if slant != 0.0:
        depth, share, cc, sc = w[L.groove], w[L.groove + 1], w[L.groove + 2], slant * w[L.groove + 3]
    for n in range(L.n_steps):
        if w[L.line_cover + line * L.n_steps + n] * w[L.row_cover + row * L.n_steps + n] > 0.0:
            depth, share, cc, sc = w[L.step_depth + n], 1.0, 1.0, 0.0
    inside = h + rise * (w[L.line_middle + line] - 0.5) + w[L.line_lift + line]
    return max(inside, F.h_min), depth, share, cc, sc


@inlined
def find_media(w, F, L, i, j, h, rise, slip, bent):
    """Put the `MEDIUM` of every piece of the patch behind line i and row j, of mean thickness h, into w[media].

    Conductances [m3] along the circumference, between both axes and along the axis, and the drag [m] along both. Pieces
    that are `bent` are as much thicker [m] as w[media] states in the place of the pressure.
    """
    for s in range(L.pieces):
        for t in range(L.pieces):
            if w[L.line_piece + i * L.pieces + s] * w[L.row_piece + j * L.pieces + t] > 0.0:
                c = L.media + MEDIUM * (s * L.pieces + t)
                thick, depth, share, cc, sc = piece(w, F, L, i, j, s, t, h, rise)
                if bent:
                    thick = max(thick + w[c + 5], F.h_min)
                # without grooves nothing lies side by side
                thick, depth = (thick, depth) if 0.0 < share < 1.0 else (thick + share * depth, 0.0)
                a = b = thick * thick * (thick + slip)
                drag = across = thick
                if depth > 0.0:
                    a, b, drag, across = mean_flow(thick, depth, share, slip)
                w[c], w[c + 1], w[c + 2] = a * cc + b * (1.0 - cc), (a - b) * sc, a * (1.0 - cc) + b * cc
                w[c + 3] = drag + F.grooved * (cc * drag + (1.0 - cc) * across - drag)
                w[c + 4] = F.grooved * sc * (drag - across)


@inlined
def medium(w, L, axis, m, other):
    """Place in w[media] of piece m along an axis in the other axis' piece `other`; conductances [m3] along the axis,
    between both and along the other one, drag [m] along both."""
    c = L.media + MEDIUM * (m * L.pieces + other if axis == 0 else other * L.pieces + m)
    if axis == 0:
        return c, w[c], w[c + 1], w[c + 2], w[c + 3], w[c + 4]
    return c, w[c + 2], w[c + 1], w[c], w[c + 4], w[c + 3]


@kernel
def lane(w, F, L, i, j, axis, other, U, p):
    """Put what the pieces behind one another along an axis, in the other axis' piece `other`, are together into
    w[laminate]."""
    begin = L.line_piece + i * L.pieces if axis == 0 else L.row_piece + j * L.pieces
    inverse = cross = rest = drag = carry = 0.0
    for m in range(L.pieces):
        share = w[begin + m]
        if share > 0.0:
            _, along, between, aside, moved, moved_aside = medium(w, L, axis, m, other)
            one = share / along
            inverse += one
            cross += one * between
            drag += one * moved
            rest += share * aside - one * between * between
            carry += share * moved_aside - one * between * moved
    along = 1.0 / inverse
    o = L.laminate + LAMINATE * other
    w[o], w[o + 1], w[o + 2] = along, along * cross, 1.0 / (rest + along * cross * cross)
    w[o + 3], w[o + 4] = along * drag, carry + along * cross * drag
    if axis == 0:
        w[o + 5] = w[o + 6] = w[L.media + MEDIUM * other + 5] = 0.0
        # pieces come first that are there
        if w[begin + 1] > 0.0:
            add_pressures(w, F, L, begin, other, o, U, p)


@inlined
def add_pressures(w, F, L, begin, other, o, U, p):
    """Put what the surface adds to the pressures of the pieces of a lane into w[media], and what they drag at their own
    pressures beyond that of the mean pressure p behind the lane at w[o].

    What is added is kept below the pressure itself, where the cell number is large.
    """
    lean = pushed = passed = rise = 0.0
    for m in range(L.pieces):
        share = w[begin + m]
        if share > 0.0:
            c, own, _, _, moved, _ = medium(w, L, 0, m, other)
            own = share / own
            step = 6.0 * w[L.mu] * U * F.dy * (own * moved - own * w[o + 3])
            middle = rise + 0.5 * step
            w[c + 5] = middle * p / (p + abs(middle))
            lean += own * moved * ((passed + 0.5 * own) * w[o] - 0.5)
            pushed += own * moved * w[c + 5]
            passed += own
            rise += step
    w[o + 5], w[o + 6] = 0.5 * F.dy * w[o] * lean, w[o] * pushed


@inlined
def beyond_mean(w, F, p, gradient, passed, c):
    """Pressure [Pa] in the middle of the piece at w[c], behind a share `passed` of the resistance, less the mean p."""
    return max(0.5 * F.dy * gradient / p * (passed - 0.5) + w[c + 5], -0.9 * p)


@inlined
def bend_pieces(w, F, L, k, i, j, U, h, rise, p, slip, gradient):
    """Find the media of a patch again, with the foil bent by the pressure of every piece, no straight line's."""
    for t in range(L.pieces):
        if w[L.row_piece + j * L.pieces + t] > 0.0:
            lane(w, F, L, i, j, 0, t, U, p)
            passed = 0.0
            for s in range(L.pieces):
                length = w[L.line_piece + i * L.pieces + s]
                if length > 0.0:
                    c, along, _, _, _, _ = medium(w, L, 0, s, t)
                    own = length * w[L.laminate + LAMINATE * t] / along
                    uneven = passed + 0.5 * own - w[L.line_middle + i * L.pieces + s] + 0.5
                    w[c + 5] = w[L.soft + k] * beyond_mean(w, F, p, gradient, uneven, c)
                    passed += own
    find_media(w, F, L, i, j, h, rise, slip, True)


@kernel
def find_pieces(w, F, L, k, i, j, U, h, rise, p, slip, gradient):
    """Find the media of patch k at its thickness h, which rises by `rise` from line to line, and its pressure p with a
    gradient of p^2 along the circumference."""
    find_media(w, F, L, i, j, h, rise, slip, False)
    if L.foil == 1 and w[L.line_piece + i * L.pieces + 1] > 0.0:
        bend_pieces(w, F, L, k, i, j, U, h, rise, p, slip, gradient)


@inlined
def find_lanes(w, F, L, i, j, axis, U, p, gradient, mean):
    """Find all lanes along an axis from w[media], for a pressure p and a gradient of p^2 along it; returns the flux
    (times 24 mu) along the other axis, the same through all of them, and what they resist it with [1/m3]."""
    flow = inverse = 0.0
    for o in range(L.pieces):
        share = w[(L.row_piece + j * L.pieces if axis == 0 else L.line_piece + i * L.pieces) + o]
        if share > 0.0:
            lane(w, F, L, i, j, axis, o, U, p)
            c = L.laminate + LAMINATE * o
            one = share * w[c + 2]
            flow += one * (12.0 * w[L.mu] * U * p * w[c + 4] - w[c + 1] * gradient)
            inverse += one
    return (flow - mean) / inverse, inverse


@inlined
def carried(w, L, U, axis, c, p, gradient):
    """Flux (times 24 mu) that the surface drags through the lane at w[c] at a mean pressure and a gradient of p^2."""
    mean = w[c + 3] * p
    if axis == 0:
        mean += w[c + 5] * gradient / p + w[c + 6]
    return 12.0 * w[L.mu] * U * mean


@inlined
def lane_flux(w, L, U, axis, c, p, gradient, mean, flow):
    """Flux (times 24 mu) along an axis in the lane at w[c] for a pressure and a gradient of p^2 along it, and the
    gradient along the other axis there."""
    if L.grooved == 1:
        mean = (12.0 * w[L.mu] * U * p * w[c + 4] - w[c + 1] * gradient - flow) * w[c + 2]
    return carried(w, L, U, axis, c, p, gradient) - w[c] * gradient - w[c + 1] * mean, mean


@inlined
def side_flux(w, F, L, U, axis, c, side, mean, flow, middle_h, middle_slip, smooth):
    """`lane_flux` at one side of the patch, with the blend where the cell number exceeds 2.

    Where no edge lies between the sides, the lane is that of the thickness in the patch's middle; a `smooth` gap's
    difference to that of the side is added, so that pieces without depth are no pieces.
    """
    p, gradient, jump, h = side
    flux, _ = lane_flux(w, L, U, axis, c, p, gradient, mean, flow)
    wider = h * h * (h + slip_length(w, L, p)) - middle_h * middle_h * (middle_h + middle_slip) if smooth else 0.0
    flux -= wider * gradient
    if axis == 0:
        drag = w[c + 3] + h - middle_h
        flux += 12.0 * w[L.mu] * U * p * (h - middle_h)
        flux -= max(6.0 * w[L.mu] * abs(U * drag) - 2.0 * (w[c] + wider) * p / F.dy, 0.0) * jump
    return flux


@inlined
def twice_inside(w, L, k, row):
    """Sum [Pa] of the pressures on both lines at node k of a row inside the film; 0 at its edges."""
    return w[L.p + k] + w[L.p + k + L.stride] if row >= 0 and row < L.n_rows else 0.0


@inlined
def mixed_fluxes(w, F, L, k, i, j, axis, U, h, p, slip, around):
    """Fluxes through the near and the far half face of a patch along an axis, weighted by their shares of the face, for
    the sides `around` it.

    They are divided by the step. From side to side p^2 falls as the resistance that is passed, and so do the shares of
    a lane that the two have. Along z it falls by what the surface adds to the pieces' pressures, too, which the lanes
    along the circumference have left in w[media].
    """
    near, far, mean = around
    flow, resistance = find_lanes(w, F, L, i, j, axis, U, p, 0.5 * (near[1] + far[1]), mean)
    passes = 1.0 / resistance
    smooth = axis == 0 or w[L.line_piece + i * L.pieces + 1] == 0.0
    sum_near = sum_far = passed = below = above = 0.0
    last = 0
    if axis == 1:
        below, above = twice_inside(w, L, k, j + L.half - 1), twice_inside(w, L, k + 1, j + L.half)
        for t in range(L.pieces):
            last = t if w[L.row_piece + j * L.pieces + t] > 0.0 else last
    for o in range(L.pieces):
        share = w[(L.row_piece + j * L.pieces if axis == 0 else L.line_piece + i * L.pieces) + o]
        if share > 0.0:
            c = L.laminate + LAMINATE * o
            own = share * w[c + 2] * passes
            at_near = side_flux(w, F, L, U, axis, c, near, mean, flow, h, slip, smooth)
            at_far = side_flux(w, F, L, U, axis, c, far, mean, flow, h, slip, smooth)
            if axis == 1:
                e = L.media + MEDIUM * o * L.pieces + 5
                more = w[c] * (w[e] * below - w[e + MEDIUM * last] * above) / F.dz
                at_near += more
                at_far += more
            sum_near += share * (1.0 - passed - 0.5 * own) * at_near
            sum_far += share * (passed + 0.5 * own) * at_far
            passed += own
    scale = 1.0 / (24.0 * w[L.mu] * (F.dy if axis == 0 else F.dz))
    return sum_near * scale, sum_far * scale


@inlined
def inside_film(L, j):
    """Mean over patch row j of what the surface adds, as a share of that inside: nothing at the edges of the film."""
    return 0.5 if j == L.n_rows - L.half or (j == 0 and L.half == 0) else 1.0


@inlined
def push_journal(w, L, k, i, width, t):
    """Add the force on the journal [N] of what the surface adds to the pressures between line i and the next, in the
    lanes t of a `width` in shares of a row, to w[push] and to that of patch k."""
    begins = 0.0
    for s in range(L.pieces):
        if w[L.line_piece + i * L.pieces + s] > 0.0:
            rise = 2.0 * (w[L.media + MEDIUM * (s * L.pieces + t) + 5] - begins)
            turn = L.line_turn + 4 * (i * L.pieces + s)
            x = width * (begins * w[turn] + rise * w[turn + 2])
            y = width * (begins * w[turn + 1] + rise * w[turn + 3])
            w[L.push] += x
            w[L.push + 1] += y
            w[L.push_x + k] += x
            w[L.push_y + k] += y
            begins += rise


@kernel
def cut_patches(w, F, L, U):
    """`patch_fluxes` of the patches that edges cut."""
    w[L.push] = w[L.push + 1] = 0.0
    for line in range(-1, L.n_theta):
        i = line if line >= 0 else L.n_theta - 1
        for j in range(L.n_rows + 1 - L.half):
            k = L.first + line * L.stride + j + L.half - 1
            if w[L.mixed + k] > 0.0:
                h, p, slip = middle(w, L, k)
                around = sides(w, F, L, k, 0)
                find_pieces(w, F, L, k, i, j, U, h, incline(w, L, k), p, slip, 0.5 * (around[0][1] + around[1][1]))
                south, north = mixed_fluxes(w, F, L, k, i, j, 0, U, h, p, slip, around)
                if line >= 0:
                    w[L.push_x + k] = w[L.push_y + k] = 0.0
                    for t in range(L.pieces if w[L.line_piece + i * L.pieces + 1] > 0.0 else 0):
                        push_journal(w, L, k, i, w[L.row_piece + j * L.pieces + t] * inside_film(L, j), t)
                west, east = mixed_fluxes(w, F, L, k, i, j, 1, U, h, p, slip, sides(w, F, L, k, 1))
                w[L.south + k], w[L.north + k] = w[L.patch_south + k] * south, north
                w[L.face_west + k], w[L.face_east + k] = west, east


@inlined
def textured_fluxes(w, F, L, U):
    """Flux per length through the theta and z faces behind each node, divided by the step."""
    patch_fluxes(w, F, L, U)
    cut_patches(w, F, L, U)
    for k in range(L.first - L.stride, L.first + L.n_theta * L.stride):
        w[L.flow_t + k] = w[L.south + k] + w[L.north + k - 1]
    for k in range(L.first - 1, L.first + L.n_theta * L.stride):
        w[L.flow_z + k] = w[L.face_west + k] + w[L.face_east + k - L.stride]


@inlined
def jump_along_z(w, F, L, k, conductance, pushed):
    """Put the conductance [m3] of half a cell, times its share of the face, for a smooth gap's, and add the flux of
    what the surface adds to its pressure."""
    h, p, p_z = 0.5 * (w[L.h + k] + w[L.h + k + 1]), w[L.p + k], w[L.p + k + 1]
    more = conductance - 0.5 * h * h * (h + slip_length(w, L, 0.5 * (p + p_z)))
    flux = more * (p * p - p_z * p_z) + pushed
    w[L.flow_z + k] += w[L.link + k] * flux / (24.0 * w[L.mu] * F.dz * F.dz)


@kernel
def jump_fluxes(w, F, L, U):
    """Correct the fluxes of a smooth gap where it jumps between lobes, in films without pockets and grooves."""
    w[L.push] = w[L.push + 1] = 0.0
    for line in range(-1, L.n_theta):
        i = line if line >= 0 else L.n_theta - 1
        first = L.first + line * L.stride
        if w[L.mixed + first] > 0.0:
            for k in range(first, first + L.n_rows):
                p, p_t = w[L.p + k], w[L.p + k + L.stride]
                h, mean = 0.5 * (w[L.h + k] + w[L.h + k + L.stride]), 0.5 * (p + p_t)
                c, gradient = L.laminate, (p_t * p_t - p * p) / F.dy
                rise = w[L.h + k + L.stride] - w[L.h + k]
                find_pieces(w, F, L, k, i, 0, U, h, rise, mean, slip_length(w, L, mean), gradient)
                lane(w, F, L, i, 0, 0, 0, U, mean)
                if line >= 0:
                    w[L.push_x + k] = w[L.push_y + k] = 0.0
                    push_journal(w, L, k, i, 0.5 if L.half == 1 and k == first else 1.0, 0)
                blend = max(6.0 * w[L.mu] * abs(U) * w[c + 3] - 2.0 * w[c] * mean / F.dy, 0.0)
                flux = carried(w, L, U, 0, c, mean, gradient) - w[c] * gradient - blend * (p_t - p)
                w[L.flow_t + k] = flux / (24.0 * w[L.mu] * F.dy)
            for row in range(L.half - 1, L.n_rows):
                k = first + row
                h, p, slip = middle(w, L, k)
                below, above, _ = sides(w, F, L, k, 0)
                find_pieces(w, F, L, k, i, 0, U, h, incline(w, L, k), p, slip, 0.5 * (below[1] + above[1]))
                lane(w, F, L, i, 0, 0, 0, U, p)
                rise = twice_inside(w, L, k, row) - twice_inside(w, L, k + 1, row + 1)
                near = far = near_rise = far_rise = passed = 0.0
                for s in range(L.pieces):
                    share = w[L.line_piece + i * L.pieces + s]
                    if share > 0.0:
                        c, one, _, _, _, _ = medium(w, L, 0, s, 0)
                        own = share * w[L.laminate] / one
                        before, behind = share * (1.0 - passed - 0.5 * own) * one, share * (passed + 0.5 * own) * one
                        near, far = near + before, far + behind
                        near_rise, far_rise = near_rise + before * w[c + 5], far_rise + behind * w[c + 5]
                        passed += own
                jump_along_z(w, F, L, k, near, near_rise * rise)
                jump_along_z(w, F, L, k + L.stride, far, far_rise * rise)


@inlined
def traction(w, F, L, h, depth, share, cc, sc, slip, U, p, dy, dz):
    """Mean stress [Pa] against the journal's motion in a piece with the gradients dy, dz of p^2."""
    _, b, s, t = mean_flow(h, depth, share, slip)
    g, rest = h + depth, 1.0 - share
    sense = F.grooved if cc < 1.0 else 1.0
    uneven = share / (g + slip) + rest / (h + slip) - t * t / b
    push = s * (cc * dy + sc * dz) + t * ((1.0 - cc) * dy - sc * dz)
    push += 12.0 * w[L.mu] * U * sense * (1.0 - cc) * p * uneven
    shear = w[L.mu] * U * (share / shear_gap(g, slip) + rest / shear_gap(h, slip))
    return shear + 0.25 * (sense * push + (1.0 - sense) * h * dy) / p


@kernel
def textured_torque(w, F, L, speed):
    """Torque as in `film.smooth_torque`, patch by patch."""
    U = speed * F.radius
    total = 0.0
    for i in range(L.n_theta):
        for j in range(L.n_rows + 1 - L.half):
            k = L.first + i * L.stride + j + L.half - 1
            near, far, mean = sides(w, F, L, k, 0)
            h, p, slip = middle(w, L, k)
            gradient = 0.5 * (near[1] + far[1])
            rise = incline(w, L, k)
            find_pieces(w, F, L, k, i, j, U, h, rise, p, slip, gradient)
            flow, _ = find_lanes(w, F, L, i, j, 0, U, p, gradient, mean)
            for t in range(L.pieces):
                width = w[L.row_piece + j * L.pieces + t]
                if width > 0.0:
                    o, passed = L.laminate + LAMINATE * t, 0.0
                    flux, dz = lane_flux(w, L, U, 0, o, p, gradient, mean, flow)
                    for s in range(L.pieces):
                        length = w[L.line_piece + i * L.pieces + s]
                        if length > 0.0:
                            thick, depth, grooves, cc, sc = piece(w, F, L, i, j, s, t, h, rise)
                            c, along, cross, _, drag, _ = medium(w, L, 0, s, t)
                            own = length * w[o] / along
                            more = beyond_mean(w, F, p, gradient, passed + 0.5 * own, c)
                            inside = p + more
                            if L.foil == 1:
                                uneven = passed + 0.5 * own - w[L.line_middle + i * L.pieces + s] + 0.5
                                bent = w[L.soft + k] * beyond_mean(w, F, p, gradient, uneven, c)
                                thick = max(thick + bent, F.h_min)
                            dy = (12.0 * w[L.mu] * U * inside * drag - cross * dz - flux) / along
                            if w[L.mixed + k] > 0.0:
                                dy += (1.0 - inside_film(L, j)) * (w[o] * gradient / along - dy)
                            stress = traction(w, F, L, thick, depth, grooves, cc, sc, slip, U, inside, dy, dz)
                            total += width * length * stress
                            passed += own
    return F.radius * F.dy * F.dz * total * (1.0 + L.half)


@inlined
def friction_torque(w, F, L, speed):
    """Friction torque [N m] at shaft speed `speed` [rad/s]; positive brakes a positive speed."""
    return textured_torque(w, F, L, speed) if L.textured == 1 else smooth_torque(w, F, L, speed)
