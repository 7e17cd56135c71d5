r"""Film thickness, slip at the walls, film forces and friction torque.

.. math:: h = c - X\cos\theta - Y\sin\theta, \qquad
          F_X = -\int (p - p_a)\cos\theta \,\mathrm dA, \quad F_Y = -\int (p - p_a)\sin\theta\,\mathrm dA

with theta on the bearing from x towards y, (X, Y) the journal's displacement, F the force ON the journal. The
thickness is kept above `h_min` by a parabola that joins h = 2 h_min smoothly, so that a touch leaves the equations
regular; the contact force is an effect of its own. A foil (`reynolds.sleeve.Foil`) adds its deflection.

Journal and sleeve are closest where the gap between them, `open_gap` at the nodes, has a local minimum round the
sleeve. The sleeve's form (`reynolds.sleeve.stretches`) and the journal's part are exact there, what effects and a foil
add is a cubic through the lines of the grid, Catmull & Rom's; where the form of a foil jumps it is a cubic on either
side, and the pressure at the jump is that of a Rayleigh step. Over z the smallest counts. A plain sleeve has the one
place e = (X^2 + Y^2)^(1/2) and the gap c - e. A groove leaves ridges, and a pocket as long as the film leaves the land
at its sides, where a journal touches first.

.. math:: M = \int R \left(\frac{\mu U}{h} + \frac{h}{2}\,\partial_y p\right) \mathrm dA

is the friction torque against the rotation: Couette drag plus the pressure-driven part. Source: Hamrock (2004), section
8.5.

A gas that slips at both walls (first order, Burgdorfer 1959) passes a gap h as if h^3 were h^2 (h + 6 lambda), and
drags as if h were h + 2 lambda, with the mean free path lambda = lambda_a p_a / p: at a wall its speed is that of the
wall and lambda times the slope of the profile. The pressure-driven part of the friction balances the pressures on a gap
and has no slip in it.

Cites: burgdorfer_1959, hamrock_2004.
"""

from __future__ import annotations

import math

from reynolds.grid import JUMP, KINK, PLACE, STRETCH
from reynolds.jit import inlined, view
from reynolds.vectors import two_dots

STEEPEST = 1e300
"""Second derivative [m] of the gap at the edge of a pocket."""
FLATTEST = 1e-9
"""Least second derivative [m] of the gap where it is smallest."""
HALVINGS = 60


@view
def open_gap(w, L, k, x, y):
    """Distance [m] from a journal at (x, y) to the sleeve at node k, land or ridge; negative where they overlap."""
    return (
        w[L.clearance + k] - x * w[L.cos + k] - y * w[L.sin + k]
        if L.foil == 0
        else w[L.clearance + k] - x * w[L.cos + k] - y * w[L.sin + k] + w[L.bend + k]
    )


@inlined
def bend_foil(w, F, L, iadt):
    """Deflection of the foil [m] under the present pressure at the end of a stage; iadt = 0 is at rest."""
    past = F.bend_time * iadt
    inverse = 1.0 / (1.0 + past)
    if L.strips == 1 and F.strip > 0.0:
        if w[L.held] == 0.0:
            bend_strips(w, F, L, past, inverse)
    else:
        for k in range(L.length):
            w[L.bend + k] = (w[L.soft + k] * (w[L.p + k] - F.pa) + past * w[L.bend_rhs + k]) * inverse


@inlined
def bend_strips(w, F, L, past, inverse):
    """Deflection of the foil [m] by the mean pressure along every strip of bumps, a line of the grid.

    Where the mean is below the ambient pressure the foil lifts off: the bumps are unloaded, and the film does not pull
    the journal.
    """
    for i in range(-1, L.n_theta + 1):
        line = L.first + i * L.stride
        mean = 0.0
        for k in range(line, line + L.n_rows):
            mean += w[L.weight + k] * (w[L.p + k] - F.pa)
        mean *= F.strip
        on = 1.0 if mean >= 0.0 else 0.0
        bend = (on * mean + past * w[L.bend_rhs + line]) * inverse
        for k in range(line + L.half - 1, line + L.n_rows + 1):
            w[L.bend + k] = bend
            w[L.force_x + k], w[L.force_y + k] = on * w[L.whole_x + k], on * w[L.whole_y + k]


@inlined
def thickness(w, F, L):
    """Fill h (ghosts and edges too) from the journal position."""
    x, y = w[L.journal], w[L.journal + 1]
    low = F.h_min
    inverse = 0.25 / low
    for k in range(L.length):
        gap = open_gap(w, L, k, x, y)
        near = gap if gap > 0.0 else 0.0
        near = near if near < 2.0 * low else 2.0 * low
        # the parabola lies above the gap and touches it at 2 h_min, where `near` ends
        kept = low + near * near * inverse
        w[L.h + k] = kept if kept > gap else gap


@inlined
def thickness_slope(w, F, L):
    """Fill the slope dh/d(nominal gap), ghosts and edges too."""
    x, y = w[L.journal], w[L.journal + 1]
    low = F.h_min
    inverse = 0.5 / low
    for k in range(L.length):
        gap = open_gap(w, L, k, x, y)
        w[L.slope + k] = min(max(gap, 0.0), 2.0 * low) * inverse


@inlined
def outline(w, L):
    """Least of what effects and foil add to the sleeve's form [m] at every line, over z, edges included."""
    for i in range(L.n_theta):
        line = L.first + i * L.stride
        low = 1e300
        for k in range(line + L.half - 1, line + L.n_rows + 1):
            low = min(low, open_gap(w, L, k, 0.0, 0.0) - w[L.form + k])
        w[L.outline + 1 + i] = low
    w[L.outline] = w[L.outline + L.n_theta]
    w[L.outline + L.n_theta + 1] = w[L.outline + 1]
    w[L.outline + L.n_theta + 2] = w[L.outline + 2]


@inlined
def bend_at_edges(w, F, L, first, count, x, y):
    """Least of what effects and foil add [m] at the edges between the `count` stretches from `first`, of one cell.

    At a row the flux is that of the face all the way through the cell, so that p^2 falls in a stretch of length a and
    gap g by Y a / g^3 and rises by X a / g^2, as in a Rayleigh step; X follows from p on both lines.
    """
    line = L.first + int(w[L.stretches + STRETCH * first]) * L.stride
    for row in range(L.half - 1, L.n_rows + 1):
        k = line + row
        near = open_gap(w, L, k, 0.0, 0.0) - w[L.form + k]
        far = open_gap(w, L, k + L.stride, 0.0, 0.0) - w[L.form + k + L.stride]
        p, p_far = w[L.p + k], w[L.p + k + L.stride]
        slip = slip_length(w, L, 0.5 * (p + p_far))
        fall = 24.0 * w[L.mu] * F.dy * F.dy * w[L.flow_t + k]
        drag = resistance = rise = 0.0
        q = p * p
        for turn in range(2):
            for m in range(first, first + count):
                o = L.stretches + STRETCH * m
                middle = 0.5 * (w[o + 1] + w[o + 2])
                gap = 0.5 * (w[o + 7] + w[o + 11] - x * (w[o + 5] + w[o + 9]) - y * (w[o + 6] + w[o + 10]))
                gap = max(gap + near + (far - near) * middle, F.h_min)
                one = (w[o + 2] - w[o + 1]) / (gap * gap * (gap + slip))
                if turn == 0:
                    drag, resistance = drag + one * gap, resistance + one
                elif m + 1 < first + count:
                    share = w[o + 2]
                    q += (rise * gap - fall) * one
                    inside = row >= 0 and row < L.n_rows
                    more = math.sqrt(max(q, 1e-4 * F.pa * F.pa)) - p - (p_far - p) * share if inside else 0.0
                    value = near + (far - near) * share + w[L.soft + k] * more
                    w[L.added + m + 1] = min(w[L.added + m + 1], value)
            rise = (p_far * p_far - p * p + fall * resistance) / drag


@inlined
def bend_between_lines(w, F, L, x, y):
    """Fill w[added], what effects and foil add [m] at the beginning of every stretch, from the outline."""
    count = int(F.stretches)
    first = 0
    while first < count:
        line = int(w[L.stretches + STRETCH * first])
        last = first + 1
        w[L.added + first] = w[L.outline + 1 + line]
        while last < count and int(w[L.stretches + STRETCH * last]) == line:
            w[L.added + last] = 1e300
            last += 1
        if last > first + 1:
            bend_at_edges(w, F, L, first, last - first, x, y)
        first = last


@inlined
def neighbour(w, F, L, m, way):
    """Distance [steps] from where stretch m begins to the next such place before (-1) or behind (1) it, and what is
    added [m] there."""
    count = int(F.stretches)
    before = L.stretches + STRETCH * ((m - 1 + count) % count)
    if way < 0:
        return w[before + 1] - w[before + 2], w[L.added + (m - 1 + count) % count]
    o = L.stretches + STRETCH * m
    return w[o + 2] - w[o + 1], w[L.added + (m + 1) % count]


@inlined
def slope_at(w, F, L, m, side):
    """Slope of what is added [m/step] where stretch m begins, on the side before (-1) or behind (1) it.

    It is that of the parabola through three places, of one side where the form jumps.
    """
    count = int(F.stretches)
    jumps = w[L.stretches + STRETCH * m + STRETCH - 1] > 0.0
    here = w[L.added + m]
    a, u = neighbour(w, F, L, m, side)
    if jumps:
        # with another jump at the second place there is no third
        other = (m + side + count) % count
        if w[L.stretches + STRETCH * other + STRETCH - 1] > 0.0:
            return (u - here) / a
        b, v = neighbour(w, F, L, other, side)
        b += a
    else:
        b, v = neighbour(w, F, L, m, -side)
    return ((u - here) / a * b - (v - here) / b * a) / (b - a)


@inlined
def added_cubic(w, F, L, o):
    """Coefficients of the cubic of what is added to the form in the stretch at w[o], in shares of the step there."""
    if L.foil == 1 and L.textured == 1 and F.jumps > 0.0:
        m = (o - L.stretches) // STRETCH
        low, size = w[o + 1], w[o + 2] - w[o + 1]
        a, b = w[L.added + m], w[L.added + (m + 1) % int(F.stretches)]
        before, after = slope_at(w, F, L, m, 1), slope_at(w, F, L, (m + 1) % int(F.stretches), -1)
        mean = (b - a) / size
        two, three = (3.0 * mean - 2.0 * before - after) / size, (before + after - 2.0 * mean) / (size * size)
        # about the line where the stretch begins instead of its own beginning
        return (
            a - low * (before - low * (two - low * three)),
            before - low * (2.0 * two - 3.0 * low * three),
            two - 3.0 * low * three,
            three,
        )
    i = L.outline + 1 + int(w[o])
    a, b = w[i], w[i + 1]
    before, after = 0.5 * (b - w[i - 1]), 0.5 * (w[i + 2] - a)
    return a, before, 3.0 * (b - a) - 2.0 * before - after, 2.0 * (a - b) + before + after


@inlined
def gap_at_end(w, F, L, o, end, x, y):
    """Gap [m] and its derivative after the angle at the low (0) or high (1) end of the stretch at w[o]."""
    share, e = w[o + 1 + end], o + 5 + 4 * end
    zero, one, two, three = added_cubic(w, F, L, o)
    gap = w[e + 2] + (((three * share + two) * share + one) * share + zero) - x * w[e] - y * w[e + 1]
    added = ((3.0 * three * share + 2.0 * two) * share + one) * (F.radius / F.dy)
    return gap, w[e + 3] + added + x * w[e + 1] - y * w[e]


@inlined
def gap_within(w, F, L, o, share, x, y):
    """Sleeve's distance [m] from its centre in the stretch at w[o], the direction there, first and second derivative of
    the gap after the angle."""
    i = int(w[o])
    zero, one, two, three = added_cubic(w, F, L, o)
    per = F.radius / F.dy
    angle = (i + share) / per
    c, s = math.cos(angle), math.sin(angle)
    arc_c, arc_s = F.lobe * math.cos(angle - w[o + 3]), F.lobe * math.sin(angle - w[o + 3])
    sleeve = F.wide - arc_c + w[o + 4] + (((three * share + two) * share + one) * share + zero)
    slope = arc_s + ((3.0 * three * share + 2.0 * two) * share + one) * per + x * s - y * c
    return sleeve, c, s, slope, arc_c + (6.0 * three * share + 2.0 * two) * per * per + x * c + y * s


@inlined
def turning_point(w, F, L, o, x, y):
    """Share of the step at which the gap of the stretch at w[o], falling at its low and rising at its high end, is
    smallest."""
    low, high = w[o + 1], w[o + 2]
    share = 0.5 * (low + high)
    for _ in range(HALVINGS):
        _, _, _, slope, bend = gap_within(w, F, L, o, share, x, y)
        if slope < 0.0:
            low = share
        else:
            high = share
        following = share - slope / bend * (F.radius / F.dy) if bend > 0.0 else low
        if not low < following < high:
            following = 0.5 * (low + high)
        moved = abs(following - share)
        share = following
        if moved < 1e-15:
            break
    return share


@inlined
def keep_place(w, F, L, number, o, share, x, y, sharp):
    """Write a place in the stretch at w[o], a `sharp` one at an edge; returns how many there are now."""
    if number == L.n_theta:
        return number
    sleeve, c, s, _, bend = gap_within(w, F, L, o, share, x, y)
    place = L.places + PLACE * number
    w[place], w[place + 1] = sleeve, x * c + y * s
    w[place + 2], w[place + 3] = c, s
    w[place + 4] = STEEPEST if sharp else max(bend, FLATTEST)
    return number + 1


@inlined
def closest_places(w, F, L, x, y, mean, uneven):
    """Put the places where the gap round a journal at (x, y) is smallest into w[places]; returns their number.

    `mean` [m] is the mean distance of the sleeve, the only one where nothing makes it `uneven`; there is no place
    where the gap is the same all round.
    """
    if L.foil == 0 and uneven == 0.0 and F.recessed == 0.0:
        e = math.sqrt(x * x + y * y)
        if e == 0.0:
            return 0
        w[L.places], w[L.places + 1] = mean, e
        w[L.places + 2], w[L.places + 3] = x / e, y / e
        w[L.places + 4] = e
        return 1
    outline(w, L)
    if L.foil == 1 and L.textured == 1 and F.jumps > 0.0:
        bend_between_lines(w, F, L, x, y)
    number, count = 0, int(F.stretches)
    last = L.stretches + STRETCH * (count - 1)
    gap, slope = gap_at_end(w, F, L, last, 1, x, y)
    for k in range(count):
        o = L.stretches + STRETCH * k
        begins, falls = gap_at_end(w, F, L, o, 0, x, y)
        if begins > gap + JUMP:
            if slope <= 0.0:
                number = keep_place(w, F, L, number, last, w[last + 2], x, y, True)
        elif gap > begins + JUMP:
            if falls >= 0.0:
                number = keep_place(w, F, L, number, o, w[o + 1], x, y, True)
        elif slope < 0.0 <= falls:
            number = keep_place(w, F, L, number, o, w[o + 1], x, y, falls - slope > KINK)
        gap, slope = gap_at_end(w, F, L, o, 1, x, y)
        if falls < 0.0 <= slope:
            number = keep_place(w, F, L, number, o, turning_point(w, F, L, o, x, y), x, y, False)
        last = o
    return number


@inlined
def smallest_gap(w, L, number, mean):
    """Smallest gap [m], all angles and z, of the places that `closest_places` found; `mean` where there is none."""
    if number == 0:
        return mean
    low = 1e300
    for k in range(number):
        o = L.places + PLACE * k
        low = min(low, w[o] - w[o + 1])
    return low


@view
def slip_length(w, L, p):
    """6 lambda [m] of the gas at pressure p [Pa], 0 for one that does not slip; w[slip] is 6 lambda p."""
    return w[L.slip] / p


@view
def shear_gap(h, slip):
    """Gap [m] whose drag is that of the gap h [m] with slip = 6 lambda [m]."""
    return h + slip * (1.0 / 3.0)


@inlined
def slip_flow(w, L, kt, kz):
    """Add the flow of a gas that slips at both walls, with w[slip] = 6 lambda p at once for all cells."""
    slip = 2.0 * w[L.slip]
    for k in range(L.first - L.stride, L.first + L.n_theta * L.stride):
        hf = 0.5 * (w[L.h + k] + w[L.h + k + L.stride])
        hz = 0.5 * (w[L.h + k] + w[L.h + k + 1])
        w[L.flow_t + k] -= kt * slip * (hf * hf) * (w[L.p + k + L.stride] - w[L.p + k])
        w[L.flow_z + k] += kz * slip * w[L.link + k] * (hz * hz) * (w[L.p + k] - w[L.p + k + 1])


@inlined
def slip_jacobian(w, L, k, face_t, face_z, kt, kz):
    """Derivative after q = p^2 at node k of the slip flow through a theta or z face with thickness face_t, face_z."""
    return w[L.slip] / w[L.p + k] * kt * face_t * face_t, w[L.slip] / w[L.p + k] * kz * face_z * face_z


@view
def mean_gap(w, L, k):
    """Mean thickness [m] in cell k, grooves and steps with it."""
    return w[L.h + k] if L.textured == 0 else w[L.h + k] + w[L.deep + k]


@view
def stored(w, L, k):
    """Mass p h of cell k (times R_g T); grooves and steps hold gas too, and cells that edges cut are more or less
    broad, and as much further round the sleeve."""
    return (
        w[L.p + k] * w[L.h + k]
        if L.textured == 0
        else w[L.p + k]
        * (
            w[L.h + k] * w[L.broad + k]
            + w[L.deep + k]
            - w[L.journal] * w[L.ahead_x + k]
            - w[L.journal + 1] * w[L.ahead_y + k]
        )
    )


@inlined
def wrap(w, L, array):
    """Copy the ring's ends into the ghost lines."""
    start = array + L.first
    end = start + L.n_theta * L.stride
    for j in range(L.n_rows):
        w[start - L.stride + j] = w[end - L.stride + j]
        w[end + j] = w[start + j]


@inlined
def force(w, L):
    """Film force on the journal [N] into w[force]; the constant ambient pressure adds nothing over a full turn."""
    w[L.force], w[L.force + 1] = force_of(w, L, L.p)


@inlined
def force_of(w, L, array):
    """Force (fx, fy) [N] on the journal of the pressures in the array at offset `array`."""
    fx, fy = two_dots(w, array + L.first, L.force_x + L.first, L.force_y + L.first, L.span)
    return (fx, fy) if L.textured == 0 else (fx + w[L.push], fy + w[L.push + 1])


@inlined
def smooth_torque(w, F, L, speed):
    """Friction torque [N m] of a film with a smooth gap at shaft speed `speed` [rad/s]; positive brakes a positive
    speed."""
    drag = w[L.mu] * speed * F.radius
    inside = 0.0
    edges = 0.0
    for i in range(L.n_theta):
        line = L.first + i * L.stride
        for j in range(L.n_rows):
            k = line + j
            slope = (w[L.p + k + L.stride] - w[L.p + k - L.stride]) / (2.0 * F.dy)
            gap = shear_gap(w[L.h + k], slip_length(w, L, w[L.p + k]))
            inside += w[L.weight + k] * (drag / gap + 0.5 * w[L.h + k] * slope)
        # the edges carry half a cell of Couette drag on either side
        slip = slip_length(w, L, F.pa)
        upper = shear_gap(w[L.h + line + L.n_rows], slip)
        lower = upper if L.half == 1 else shear_gap(w[L.h + line - 1], slip)
        edges += 0.5 * drag * (1.0 / upper + 1.0 / lower)
    return F.radius * F.dy * F.dz * (inside * (1.0 + L.half) + edges)
