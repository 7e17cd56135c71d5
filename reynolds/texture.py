r"""Fluxes of a film on a surface with many narrow grooves, or with steps.

Between four nodes lies a patch with one groove depth d, groove share alpha and groove angle beta from the
circumferential direction. Pressure falls alike along ridges (thickness h) and grooves (h + d), and the flow across them
is the same through both, so that the mean flux of the narrow-groove theory is

.. math:: \mathbf q = \tfrac{U}{2}\,p\,(S\cos\beta\,\mathbf e_s - T\sin\beta\,\mathbf e_n)
          - \frac{1}{24\mu}\left(A\,\mathbf e_s\mathbf e_s + B\,\mathbf e_n\mathbf e_n\right)\nabla p^2

.. math:: A = \alpha (h+d)^3 + (1-\alpha) h^3, \quad B^{-1} = \alpha (h+d)^{-3} + (1-\alpha) h^{-3}, \quad
          S = h + \alpha d, \quad T = B\,(\alpha (h+d)^{-2} + (1-\alpha) h^{-2})

with e_s along the grooves and e_n across. Grooves on the journal turn with it: there the relative flux has U reversed
and all gas moves with the surface, which adds U p S. A step or pocket is a patch that is all groove (alpha = 1). Half a
face of a cell lies in one patch; flux at it takes the gradient along the face from both of the patch's sides.

Source: Vohr & Chow (1965), narrow-groove theory; Hamrock (2004), ch. 16.

Cites: hamrock_2004, vohr_1965.
"""

from __future__ import annotations

from reynolds.jit import inlined


@inlined
def mean_flow(h, depth, share):
    """A, B [m3] and S, T [m] of a patch: conductances along and across its grooves, what the surface drags along and
    across."""
    g = h + depth
    rest = 1.0 - share
    along = share * g * g * g + rest * h * h * h
    a, b = share / (g * g), rest / (h * h)
    across = 1.0 / (a / g + b / h)
    return along, across, share * g + rest * h, across * (a + b)


@inlined
def flux_along(w, F, L, k, U, h, p, dy, dz, jump):
    """Circumferential flux of patch k at thickness h and pressure p for the gradients dy, dz of p^2 [Pa2/m].

    `jump` is the change of p over the face, which the flux is blended with where the cell number exceeds 2.
    """
    a, b, s, t = mean_flow(h, w[L.depth + k], w[L.share + k])
    cc, sc = w[L.cos_squared + k], w[L.sin_cos + k]
    conductance = a * cc + b * (1.0 - cc)
    drag = s + F.grooved * (cc * s + (1.0 - cc) * t - s)
    carried = 0.5 * U * drag
    blend = max(0.5 * abs(carried) - conductance * p / (12.0 * w[L.mu] * F.dy), 0.0)
    return carried * p - blend * jump - (conductance * dy + (a - b) * sc * dz) / (24.0 * w[L.mu])


@inlined
def flux_across(w, F, L, k, U, h, p, dy, dz):
    """Axial flux of patch k; as `flux_along`."""
    a, b, s, t = mean_flow(h, w[L.depth + k], w[L.share + k])
    cc, sc = w[L.cos_squared + k], w[L.sin_cos + k]
    conductance = a * (1.0 - cc) + b * cc
    return 0.5 * U * F.grooved * sc * (s - t) * p - ((a - b) * sc * dy + conductance * dz) / (24.0 * w[L.mu])


@inlined
def patch_fluxes(w, F, L, U):
    """Fluxes through the four half faces of every patch, divided by twice the step; one loop without branches."""
    t, a = 0.5 / F.dy, 0.5 / F.dz
    for k in range(L.first - L.stride - 1, L.first + L.n_theta * L.stride):
        e, n = k + L.stride, k + 1
        ne = e + 1
        p, pe, pn, pne = w[L.p + k], w[L.p + e], w[L.p + n], w[L.p + ne]
        h, he, hn, hne = w[L.h + k], w[L.h + e], w[L.h + n], w[L.h + ne]
        ys, yn = (pe * pe - p * p) / F.dy, (pne * pne - pn * pn) / F.dy
        zw, ze = (pn * pn - p * p) / F.dz, (pne * pne - pe * pe) / F.dz
        y, z = 0.5 * (ys + yn), 0.5 * (zw + ze)
        inside, south = w[L.patch + k], w[L.patch_south + k]
        w[L.south + k] = south * t * flux_along(w, F, L, k, U, 0.5 * (h + he), 0.5 * (p + pe), ys, z, pe - p)
        w[L.north + k] = inside * t * flux_along(w, F, L, k, U, 0.5 * (hn + hne), 0.5 * (pn + pne), yn, z, pne - pn)
        w[L.face_west + k] = inside * a * flux_across(w, F, L, k, U, 0.5 * (h + hn), 0.5 * (p + pn), y, zw)
        w[L.face_east + k] = inside * a * flux_across(w, F, L, k, U, 0.5 * (he + hne), 0.5 * (pe + pne), y, ze)


@inlined
def textured_fluxes(w, F, L, U):
    """Flux per length through the theta and z faces behind each node, divided by the step."""
    patch_fluxes(w, F, L, U)
    for k in range(L.first - L.stride, L.first + L.n_theta * L.stride):
        w[L.flow_t + k] = w[L.south + k] + w[L.north + k - 1]
    for k in range(L.first - 1, L.first + L.n_theta * L.stride):
        w[L.flow_z + k] = w[L.face_west + k] + w[L.face_east + k - L.stride]
