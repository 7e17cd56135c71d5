"""Ideal actuators: pins that follow the reference voltage at once, and the supply pressure.

Pin k = bias + gain_x r_x + gain_y r_y [m]; a longer pin closes its seat (thesis eq. C.1: the two pins of an axis
share the reference with opposite signs). When a pin or the supply jumps between samples, the plenum's rate at the
start of the step is the one after the jump.
"""

from __future__ import annotations

from reynolds.injector import pin_flow
from reynolds.jit import inlined


@inlined
def set_pins(w, P, FL, R, ref_x, ref_y):
    """Move the pins to the reference [V]."""
    for k in range(FL.n_inj):
        pin = P.pin_bias[k] + P.pin_x[k] * ref_x + P.pin_y[k] * ref_y
        if pin != w[R.pin + k]:
            w[R.pin + k] = pin
            gap = max(P.seat_gap - pin, P.minimum_gap)
            opening = gap / P.seat_gap
            if FL.law == 1 and P.loss_exponent != 1.0:
                opening = opening**P.loss_exponent
            throttle(w, FL, k, P.open_conductance * opening, w[FL.supply + k])


@inlined
def set_supply(w, P, FL, R, supply):
    """Set the supply pressure [Pa, absolute] of every injector."""
    if supply != w[R.supply]:
        w[R.supply] = supply
        for k in range(FL.n_inj):
            throttle(w, FL, k, w[FL.pin_conductance + k], supply)


@inlined
def throttle(w, FL, k, conductance, supply):
    """Give an injector a new conductance and supply pressure, and its plenum the rate that goes with them."""
    plenum = w[FL.plenum_old + k]
    before, _ = pin_flow(plenum, w[FL.supply + k], w[FL.pin_conductance + k], FL.law, FL.nozzle, w)
    w[FL.pin_conductance + k] = conductance
    w[FL.supply + k] = supply
    after, _ = pin_flow(plenum, supply, conductance, FL.law, FL.nozzle, w)
    w[FL.plenum_rate + k] += (after - before) / w[FL.capacity + k]
