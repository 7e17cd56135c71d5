r"""Finite-volume residual of the modified Reynolds equation and its Jacobian.

.. math:: \partial_t(p h) + \partial_y\!\left(\tfrac{U}{2} p h - \tfrac{h^3}{24\mu}\,\partial_y p^2\right)
          + \partial_z\!\left(-\tfrac{h^3}{24\mu}\,\partial_z p^2\right) = R_g T\, \dot m''

with y = R theta in the direction of the surface's motion, U = Omega R, and the injected flux m'' positive INTO the
film. Source: thesis eq. (1.4) with the viscosity and the sign of the injection term restored by the mass balance (as
printed, "+12 p V_I" lacks mu and fits only a V_I counted out of the film); Hamrock (2004), ch. 16. Assumes an ideal
isothermal gas, laminar flow, no inertia.

A gas that slips at the walls (first order, Burgdorfer 1959; `reynolds.film`) flows as if h^3 p were
h^3 p + 6 \lambda_a p_a h^2, with lambda_a the mean free path at ambient pressure; a tilted or out-of-round gap is a
matter of h alone.

The unknown is p at the nodes; diffusion is written in q = p^2, storage in m = p h, both with face values of h; the
shear flow is central and blended with upwind where the cell number 6 mu U dy / (p h^2) exceeds 2. Each residual is
divided by dy dz and has the unit Pa m/s.

Cites: burgdorfer_1959, hamrock_2004, thesis.
"""

from __future__ import annotations

import math

from reynolds.film import bend_foil, mean_gap, slip_flow, slip_jacobian, stored, thickness
from reynolds.injector import laminar_flow, nozzle, nozzle_table, orifice_flow
from reynolds.jit import inlined
from reynolds.texture import jump_fluxes, textured_fluxes

CAREFUL = 4
"""Place in w[convergence] that asks for chord slopes of the injectors' flows."""


@inlined
def fluxes(w, F, L, U):
    """Flux per length through the theta and z faces behind each node, divided by the step."""
    shear = U / (4.0 * F.dy)
    drag = abs(shear)
    # h_1 + h_2 and its cube stand for twice the face's thickness and eight times its cube
    cross = 1.0 / (48.0 * w[L.mu] * F.dy * F.dy)
    kt = 1.0 / (192.0 * w[L.mu] * F.dy * F.dy)
    kz = 1.0 / (192.0 * w[L.mu] * F.dz * F.dz)
    for k in range(L.first - L.stride, L.first + L.n_theta * L.stride):
        p, p_t, p_z = w[L.p + k], w[L.p + k + L.stride], w[L.p + k + 1]
        h, h_t, h_z = w[L.h + k], w[L.h + k + L.stride], w[L.h + k + 1]
        m, m_t = p * h, p_t * h_t
        h2, z2 = h + h_t, h + h_z
        upwind = drag - (m + m_t) * h2 * cross
        upwind = upwind if upwind > 0.0 else 0.0
        w[L.flow_t + k] = shear * (m + m_t) - upwind * (m_t - m) - kt * (h2 * h2 * h2) * (p_t * p_t - p * p)
        w[L.flow_z + k] = kz * w[L.link + k] * (z2 * z2 * z2) * (p * p - p_z * p_z)
    if w[L.slip] > 0.0:
        slip_flow(w, L, 8.0 * kt, 8.0 * kz)


@inlined
def footprint_mean(w, ix, L, k):
    """Mean of q over the footprint of injector k; sets w[outward] to whether the sub-grid correction is in it.

    The correction belongs to a source. Where the nodes show that q dips (backflow, or squeezed by a fast journal) the
    plain mean is read: it stays positive, whatever the neighbours are.
    """
    plain = 0.0
    corrected = 0.0
    for n in range(ix[L.reader_start + k], ix[L.reader_start + k + 1]):
        p = w[L.p + ix[L.reader_cell + n]]
        q = p * p
        plain += w[L.plain_weight + n] * q
        corrected += w[L.reader_weight + n] * q
    outward = (corrected - plain) * w[L.beta + k] >= 0.0
    w[L.outward + k] = 1.0 if outward else 0.0
    return corrected if outward else plain


@inlined
def read_footprints(w, ix, F, L):
    """Pressure and thickness that every injector's nozzle sees, into w[local_p] and w[local_h]."""
    for k in range(L.n_inj):
        q_loc = footprint_mean(w, ix, L, k)
        h_loc = 0.0
        for n in range(ix[L.source_start + k], ix[L.source_start + k + 1]):
            h_loc += w[L.source_weight + n] * mean_gap(w, L, ix[L.source_cell + n])
        w[L.local_h + k] = h_loc * (1.0 + L.half)
        w[L.local_p + k] = max(q_loc, 1e-4 * F.pa * F.pa)
    for k in range(L.n_inj):  # side by side: none waits for another's root
        w[L.local_p + k] = math.sqrt(w[L.local_p + k])


@inlined
def pin_flows(w, L, table):
    """Flow of every pin and its derivative after the plenum's pressure; each law has a loop, so lanes, of its own."""
    if w[L.law] == 1.0:
        for k in range(L.n_inj):
            flow, slope = laminar_flow(w[L.plenum + k], w[L.supply + k], w[L.pin_conductance + k])
            w[L.pin_flow + k] = flow
            w[L.pin_p + k] = slope
    else:
        for k in range(L.n_inj):
            flow, slope = orifice_flow(w[L.plenum + k], w[L.supply + k], w[L.pin_conductance + k], table)
            w[L.pin_flow + k] = flow
            w[L.pin_p + k] = slope


@inlined
def injection(w, ix, F, L, iadt):
    """Pin and film flow of every injector, the plenum's residual and what Newton needs of both.

    Eliminating the plenum pressure leaves the change of the film flow, d m_film = defect + gain_q dq_loc + gain_h
    dh_loc; the plenum itself changes by dP = -shift - pull_q dq_loc - pull_h dh_loc. The injectors' nozzles are
    evaluated side by side, in lanes.
    """
    read_footprints(w, ix, F, L)
    careful = w[L.convergence + CAREFUL] > 0.0
    table = nozzle_table(w, L.nozzle)
    pin_flows(w, L, table)
    for k in range(L.n_inj):
        plenum, p_loc = w[L.plenum + k], w[L.local_p + k]
        flux, d_up, d_down = nozzle(plenum, p_loc, table)
        # the tangent of a root function overshoots through zero and back for ever; the chord lands there
        chord = flux / (plenum - p_loc)
        by_chord = careful and abs(plenum - p_loc) > 1e-6 * plenum
        d_up, d_down = (max(d_up, chord), min(d_down, -chord)) if by_chord else (d_up, d_down)
        area = w[L.curtain + k] * w[L.local_h + k]
        w[L.film_flow + k] = area * flux
        w[L.film_p + k] = area * d_up
        w[L.film_h + k] = w[L.curtain + k] * flux
        w[L.film_q + k] = area * d_down * 0.5 / p_loc
        eliminate_plenum(w, L, k, iadt, area, d_up, area * d_down * 0.5 / p_loc)


@inlined
def eliminate_plenum(w, L, k, iadt, area, d_up, film_q):
    """Eliminate the plenum of injector k from the flow into the film and its derivatives: area * d_up after the
    plenum's pressure, film_q after q, w[film_h] after the thickness."""
    storage = w[L.capacity + k] * iadt
    residual = storage * (w[L.plenum + k] - w[L.plenum_rhs + k]) - w[L.pin_flow + k] + w[L.film_flow + k]
    inverse = 1.0 / (storage - w[L.pin_p + k] + area * d_up)
    through = 1.0 - area * d_up * inverse
    w[L.defect + k] = -residual * area * d_up * inverse
    w[L.gain_q + k] = through * film_q
    w[L.gain_h + k] = through * w[L.film_h + k]
    w[L.shift + k] = residual * inverse
    w[L.pull_q + k] = film_q * inverse
    w[L.pull_h + k] = w[L.film_h + k] * inverse


@inlined
def cell_residual(w, F, L, U, iadt):
    """Residual of every cell [Pa m/s] into r without injectors, with the storage term (m - m_rhs) iadt."""
    if L.foil == 1:
        bend_foil(w, F, L, iadt)
    thickness(w, F, L)
    if L.textured == 1 and L.grooved + L.n_steps > 0:
        textured_fluxes(w, F, L, U)
    else:
        fluxes(w, F, L, U)
        if L.textured == 1:
            jump_fluxes(w, F, L, U)
    for k in range(L.first, L.first + L.n_theta * L.stride):
        w[L.r + k] = (
            w[L.weight + k] * ((stored(w, L, k) - w[L.m_rhs + k]) * iadt + w[L.flow_t + k] - w[L.flow_t + k - L.stride])
            + w[L.flow_z + k]
            - w[L.flow_z + k - 1]
        )


@inlined
def residual(w, ix, F, L, U, iadt):
    """Residual of every cell [Pa m/s] into r, that of the plena with it."""
    cell_residual(w, F, L, U, iadt)
    injection(w, ix, F, L, iadt)
    for i in range(L.n_inj):
        rate = F.source * w[L.film_flow + i]
        for n in range(ix[L.source_start + i], ix[L.source_start + i + 1]):
            w[L.r + ix[L.source_cell + n]] -= rate * w[L.source_weight + n]


@inlined
def add_slip_jacobian(w, L, kt, kz):
    """Add the part of a gas that slips to the derivatives after q."""
    s = L.stride
    for k in range(L.first, L.first + L.n_theta * s):
        he = 0.5 * (w[L.h + k] + w[L.h + k + s])
        hw = 0.5 * (w[L.h + k] + w[L.h + k - s])
        hu = 0.5 * (w[L.h + k] + w[L.h + k + 1])
        hd = 0.5 * (w[L.h + k] + w[L.h + k - 1])
        a = w[L.weight + k]
        own_e, own_u = slip_jacobian(w, L, k, he, hu, kt, kz)
        own_w, own_d = slip_jacobian(w, L, k, hw, hd, kt, kz)
        own_u, own_d = own_u * w[L.link + k], own_d * w[L.link + k - 1]
        to_east, _ = slip_jacobian(w, L, k + s, he, hu, kt, kz)
        to_west, _ = slip_jacobian(w, L, k - s, hw, hd, kt, kz)
        _, to_up = slip_jacobian(w, L, k + 1, he, hu, kt, kz)
        _, to_down = slip_jacobian(w, L, k - 1, hw, hd, kt, kz)
        w[L.diag + k] += a * (own_e + own_w) + own_u + own_d
        w[L.east + k] -= a * to_east
        w[L.west + k] -= a * to_west
        w[L.up + k] -= to_up * w[L.link + k]
        w[L.down + k] -= to_down * w[L.link + k - 1]


@inlined
def jacobian(w, F, L, U, iadt):
    """Derivatives of the residual after q of the cell and its four neighbours, without the injectors.

    `diag`, `west`, `east` (theta - and +), `down`, `up` (z - and +); call `residual` first.
    """
    shear = U / (4.0 * F.dy)
    drag = abs(shear)
    cross = 1.0 / (12.0 * w[L.mu] * F.dy * F.dy)
    kt = 1.0 / (24.0 * w[L.mu] * F.dy * F.dy)
    kz = 1.0 / (24.0 * w[L.mu] * F.dz * F.dz)
    s = L.stride
    for k in range(L.first, L.first + L.n_theta * s):
        own, west, east = w[L.p + k] * w[L.h + k], w[L.p + k - s] * w[L.h + k - s], w[L.p + k + s] * w[L.h + k + s]
        he = 0.5 * (w[L.h + k] + w[L.h + k + s])
        hw = 0.5 * (w[L.h + k] + w[L.h + k - s])
        ue = max(drag - 0.5 * (own + east) * he * cross, 0.0)
        uw = max(drag - 0.5 * (own + west) * hw * cross, 0.0)
        # derivative of the blend itself, where it is active
        be = 0.5 * he * cross * (east - own) if ue > 0.0 else 0.0
        bw = 0.5 * hw * cross * (own - west) if uw > 0.0 else 0.0
        ke, kw = kt * he * he * he, kt * hw * hw * hw
        to_q = 0.5 * w[L.h + k] / w[L.p + k]
        east_q = 0.5 * w[L.h + k + s] / w[L.p + k + s]
        west_q = 0.5 * w[L.h + k - s] / w[L.p + k - s]
        hu = 0.5 * (w[L.h + k] + w[L.h + k + 1])
        hd = 0.5 * (w[L.h + k] + w[L.h + k - 1])
        up = kz * w[L.link + k] * hu * hu * hu
        down = kz * w[L.link + k - 1] * hd * hd * hd
        a = w[L.weight + k]
        w[L.diag + k] = a * (to_q * (iadt + (shear + ue + be) - (shear - uw + bw)) + ke + kw) + up + down
        w[L.east + k] = a * (east_q * (shear - ue + be) - ke)
        w[L.west + k] = a * (-west_q * (shear + uw + bw) - kw)
        w[L.up + k] = -up
        w[L.down + k] = -down
    if w[L.slip] > 0.0:
        add_slip_jacobian(w, L, kt, kz)


@inlined
def thickness_derivative(w, F, L, U, iadt, out):
    """Derivative of the cells' residual in the direction w[dh] of the film thickness, into the array at `out`."""
    shear = U / (4.0 * F.dy)
    drag = abs(shear)
    cross = 1.0 / (12.0 * w[L.mu] * F.dy * F.dy)
    kt = 1.0 / (24.0 * w[L.mu] * F.dy * F.dy)
    kz = 1.0 / (24.0 * w[L.mu] * F.dz * F.dz)
    s = L.stride
    for k in range(L.first - s, L.first + L.n_theta * s):
        hf = 0.5 * (w[L.h + k] + w[L.h + k + s])
        df = 0.5 * (w[L.dh + k] + w[L.dh + k + s])
        p, p_t, p_z = w[L.p + k], w[L.p + k + s], w[L.p + k + 1]
        a, b = p * w[L.dh + k], p_t * w[L.dh + k + s]
        ms = p_t * w[L.h + k + s] + p * w[L.h + k]
        jump = p_t * w[L.h + k + s] - p * w[L.h + k]
        upwind = max(drag - 0.5 * ms * hf * cross, 0.0)
        blend = -0.5 * cross * ((a + b) * hf + ms * df) if upwind > 0.0 else 0.0
        w[L.flow_t + k] = (
            shear * (a + b) - upwind * (b - a) - blend * jump - kt * 3.0 * hf * hf * df * (p_t * p_t - p * p)
        )
        hz = 0.5 * (w[L.h + k] + w[L.h + k + 1])
        dz = 0.5 * (w[L.dh + k] + w[L.dh + k + 1])
        w[L.flow_z + k] = kz * w[L.link + k] * 3.0 * hz * hz * dz * (p * p - p_z * p_z)
    if w[L.slip] > 0.0:
        twice = 4.0 * w[L.slip]
        for k in range(L.first - s, L.first + L.n_theta * s):
            hf, df = 0.5 * (w[L.h + k] + w[L.h + k + s]), 0.5 * (w[L.dh + k] + w[L.dh + k + s])
            hz, dz = 0.5 * (w[L.h + k] + w[L.h + k + 1]), 0.5 * (w[L.dh + k] + w[L.dh + k + 1])
            w[L.flow_t + k] -= kt * twice * hf * df * (w[L.p + k + s] - w[L.p + k])
            w[L.flow_z + k] += kz * twice * w[L.link + k] * hz * dz * (w[L.p + k] - w[L.p + k + 1])
    for k in range(L.first, L.first + L.n_theta * s):
        w[out + k] = (
            w[L.weight + k] * (w[L.p + k] * w[L.dh + k] * iadt + w[L.flow_t + k] - w[L.flow_t + k - s])
            + w[L.flow_z + k]
            - w[L.flow_z + k - 1]
        )


@inlined
def injected_derivative(w, ix, F, L, gain, out):
    """Add what the injectors' flows change by in the direction w[dh].

    They grow with the local thickness by w[gain]: `film_h` at a fixed plenum pressure, `gain_h` with the plenum
    following.
    """
    for i in range(L.n_inj):
        rate = F.source * w[gain + i] * local_thickness(w, ix, L, i, L.dh)
        for n in range(ix[L.source_start + i], ix[L.source_start + i + 1]):
            w[out + ix[L.source_cell + n]] -= rate * w[L.source_weight + n]


@inlined
def local_thickness(w, ix, L, i, array):
    """Mean of the film array over the footprint of injector i."""
    value = 0.0
    for n in range(ix[L.source_start + i], ix[L.source_start + i + 1]):
        value += w[L.source_weight + n] * w[array + ix[L.source_cell + n]]
    return value * (1.0 + L.half)
