"""Thrust films against closed forms: plain and pressurised ring, squeeze film, spiral grooves; orders."""

from dataclasses import replace
from math import log, pi, sqrt

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq
from scipy.special import iv, kv

from refusals import refused
from reynolds import FilmError, GasThrustBearing, RingFeed, SpiralGrooves
from reynolds.injector import nozzle_flux

MU, PA, RT = 1.85e-5, 101325.0, 287.05 * 293.15
INNER, OUTER, GAP = 0.01, 0.03, 20e-6
GROOVES = SpiralGrooves(15e-6, 0.6, 0.3, 3e-3)
SIZES = (16, 32, 64, 128)
RING = GasThrustBearing(INNER, OUTER)
SPIRAL = GasThrustBearing(5e-3, 12e-3, GROOVES)
CLOSED = replace(SPIRAL, inner_edge="closed", hub_radius=0.0)
NARROW, SPEED = 8e-6, 6000.0


def pumping(gap, grooves):
    """Pressure over 3 mu Omega r^2 [1/m2] that spirals without flow build up: Muijderman's g_1 over gap^2."""
    H, gamma = gap / (gap + grooves.depth), (1 - grooves.share) / grooves.share
    cot = 1 / np.tan(grooves.angle)
    above = gamma * H**2 * cot * (1 - H) * (1 - H**3)
    return above / ((1 + gamma * H**3) * (gamma + H**3) + H**3 * cot**2 * (1 + gamma) ** 2) / gap**2


def conductance(gap, grooves):
    """Mean h^3 [m3] along the radius, of channels in series across the grooves and side by side along them."""
    g, a = gap + grooves.depth, grooves.share
    along, across = a * g**3 + (1 - a) * gap**3, 1 / (a / g**3 + (1 - a) / gap**3)
    return along * np.sin(grooves.angle) ** 2 + across * np.cos(grooves.angle) ** 2


def closed_load(gap, speed=SPEED):
    """Load [N] of spirals that pump to a closed, ungrooved middle: the pressure is a parabola of the radius there."""
    rise = 3 * MU * speed * pumping(gap, GROOVES)
    edge, outer = (CLOSED.inner_radius + GROOVES.land) ** 2, CLOSED.outer_radius**2
    return pi * rise * (outer - edge) * (edge + 0.5 * (outer - edge))


def squeeze(omega, inner=INNER, outer=OUTER, gap=GAP):
    """Dynamic stiffness [N/m] of a plain ring in Bessel functions, ambient pressure at both edges."""
    k = np.sqrt(12j * MU * omega / (PA * gap**2))
    a, b = np.linalg.solve([[iv(0, k * inner), kv(0, k * inner)], [iv(0, k * outer), kv(0, k * outer)]], [1, 1])
    left = a * (outer * iv(1, k * outer) - inner * iv(1, k * inner))
    left -= b * (outer * kv(1, k * outer) - inner * kv(1, k * inner))
    return 2 * pi * PA / gap * (0.5 * (outer**2 - inner**2) - left / k)


def test_p_squared_is_linear_in_the_logarithm_of_the_radius_of_a_pressurised_ring():
    film = replace(RING, inner_edge="fed").steady(GAP, supply_pressure=0.5e6)
    edge = 0.5e6 + PA
    square = lambda r: edge**2 + (PA**2 - edge**2) * np.log(r / INNER) / log(OUTER / INNER)  # noqa: E731
    assert film.pressure == pytest.approx(np.sqrt(square(film.r)), rel=1e-12)
    exact = 2 * pi * quad(lambda r: (sqrt(square(r)) - PA) * r, INNER, OUTER)[0]
    assert film.load == pytest.approx(exact, rel=1e-3)
    flow = pi * GAP**3 * (edge**2 - PA**2) / (12 * MU * RT * log(OUTER / INNER))
    assert film.flow == pytest.approx(flow, rel=1e-10) and film.inner_flow == pytest.approx(flow, rel=1e-10)


def test_the_recess_of_a_fed_ring_carries_down_to_its_hub():
    fed = replace(RING, inner_edge="fed")
    more = replace(fed, hub_radius=4e-3).steady(GAP, 0, 0.5e6).load - fed.steady(GAP, 0, 0.5e6).load
    assert more == pytest.approx(0.5e6 * pi * (INNER**2 - 4e-3**2), rel=1e-9)


def test_orifices_and_ring_pass_the_same_flow():
    """The pressure at the inner edge is where isentropic orifices and laminar ring meet; here these are choked."""
    feed = RingFeed(8, 0.2e-3)
    film = replace(RING, inner_edge="fed", feed=feed).steady(GAP, 0.0, 0.5e6)
    choked = feed.open_area * (0.5e6 + PA) * float(nozzle_flux(np.array(0.3), 1.4, 287.05, 293.15))
    ring = pi * GAP**3 * (film.pressure[0] ** 2 - PA**2) / (12 * MU * RT * log(OUTER / INNER))
    assert film.flow == pytest.approx(ring, rel=1e-9)
    wide = replace(RING, inner_edge="fed", feed=feed).steady(3 * GAP, 0.0, 0.5e6)
    assert wide.pressure[0] < 0.528 * (0.5e6 + PA) and wide.flow == pytest.approx(choked, rel=1e-9)


def test_viscous_torque_of_a_plain_ring():
    exact = pi * MU * 500.0 * (OUTER**4 - INNER**4) / (2 * GAP)
    assert RING.steady(GAP, 500.0).friction_torque == pytest.approx(exact, rel=1e-12)
    assert RING.steady(GAP, -500.0).friction_torque == pytest.approx(-exact, rel=1e-12)


def test_slip_lets_flow_through_and_takes_drag_away():
    """6 lambda h^2 more flow and 2 lambda more gap for the drag where the pressure is that of the mean free path."""
    path = 0.068e-6
    slipping = replace(RING, inner_edge="fed", mean_free_path=path)
    flow, plain = (one.steady(GAP, 0.0, 10.0).flow for one in (slipping, replace(slipping, mean_free_path=0.0)))
    assert flow / plain - 1 == pytest.approx(6 * path / GAP, rel=1e-3)
    drag = slipping.steady(GAP, 500.0).friction_torque / RING.steady(GAP, 500.0).friction_torque
    assert drag == pytest.approx(GAP / (GAP + 2 * path), rel=1e-9)


def test_squeeze_film_of_a_ring_in_the_incompressible_limit():
    """C = 3 pi mu / (2 h^3) (ro^4 - ri^4 - (ro^2 - ri^2)^2 / ln(ro / ri)): Reynolds' equation integrated twice."""
    a, b = INNER**2, OUTER**2
    exact = 3 * pi * MU / (2 * GAP**3) * (b**2 - a**2 - (b - a) ** 2 / log(OUTER / INNER))
    K, C = RING.coefficients(GAP, frequency=[1.0])
    assert C[0] == pytest.approx(exact, rel=1e-3) and abs(K[0]) < 1e-3 * exact


@pytest.mark.parametrize("omega", [10.0, 1e3, 1e4, 1e5])
def test_squeeze_film_of_a_gas_at_any_squeeze_number(omega):
    """The equation about ambient pressure is Helmholtz's; squeeze numbers from 0.05 to 500."""
    exact = squeeze(omega)
    assert RING.dynamic_stiffness(GAP, s=1j * omega)[0] == pytest.approx(exact, rel=1e-3)


def test_a_fast_squeeze_film_is_a_closed_spring():
    """p h stays as it is: K = pa A / h, less a layer at the edges that thins with the root of the frequency."""
    spring = PA * pi * (OUTER**2 - INNER**2) / GAP
    fine = replace(RING, n_radial=2048)
    lacking = [1 - fine.dynamic_stiffness(GAP, s=1j * omega)[0].real / spring for omega in (1e6, 4e6)]
    assert 0 < lacking[1] < 0.02 and lacking[0] / lacking[1] == pytest.approx(2.0, rel=0.05)


def test_spirals_without_flow_build_up_muijdermans_pressure():
    film = CLOSED.steady(NARROW, SPEED)
    rise = 3 * MU * SPEED * pumping(NARROW, GROOVES) * (CLOSED.outer_radius**2 - 8e-3**2)
    assert film.pressure[0] - PA == pytest.approx(rise, rel=1e-10) and abs(film.flow) < 1e-18
    assert film.load == pytest.approx(closed_load(NARROW), rel=1e-3)
    step = 1e-9
    slope = (closed_load(NARROW - step) - closed_load(NARROW + step)) / (2 * step)
    assert CLOSED.coefficients(NARROW, SPEED)[0][0] == pytest.approx(slope, rel=1e-3)


def test_spirals_with_flow_through_their_land_in_the_incompressible_limit():
    """Pumping and flow add up over the grooves, the land lets the flow through: two pressures at its edge, one flow."""
    pressure = 1e9
    film = replace(SPIRAL, ambient_pressure=pressure).steady(NARROW, SPEED)
    r = (SPIRAL.inner_radius, SPIRAL.inner_radius + GROOVES.land, SPIRAL.outer_radius)
    rise = 3 * MU * SPEED * pumping(NARROW, GROOVES) * (r[2] ** 2 - r[1] ** 2)
    grooves = 6 * MU / pi * log(r[2] / r[1]) / conductance(NARROW, GROOVES)
    volume = rise / (grooves + 6 * MU / pi * log(r[1] / r[0]) / NARROW**3)
    at_land = float(np.interp(r[1], film.r, film.pressure)) - pressure
    assert at_land == pytest.approx(rise - grooves * volume, rel=1e-3)
    assert -film.flow * RT / pressure == pytest.approx(volume, rel=1e-3)


def test_spirals_that_pump_a_gas_through_agree_with_a_solver_of_ordinary_equations():
    """d(p^2)/dr at one mass flow, integrated from edge to edge; the flow is that which meets the ambient pressure."""
    k, C, edge = pumping(NARROW, GROOVES), conductance(NARROW, GROOVES), SPIRAL.inner_radius + GROOVES.land

    def pressure(flow):
        def slope(r, y):  # y: p^2 and the load from here outwards
            grooved = r > edge
            pumped = 12 * MU * SPEED * k * r * np.sqrt(y[0]) if grooved else 0.0
            lost = 24 * MU * RT * flow / (2 * pi * r * (C if grooved else NARROW**3))
            return [-pumped - lost, 2 * pi * r * (np.sqrt(y[0]) - PA)]

        inner = solve_ivp(slope, (SPIRAL.inner_radius, edge), [PA**2, 0.0], rtol=1e-11, atol=1e-12)
        return solve_ivp(slope, (edge * (1 + 1e-12), SPIRAL.outer_radius), inner.y[:, -1], rtol=1e-11, atol=1e-12)

    flow = brentq(lambda flow: pressure(flow).y[0, -1] - PA**2, -1e-4, 0.0, xtol=1e-16)
    film = SPIRAL.steady(NARROW, SPEED)
    assert film.flow == pytest.approx(flow, rel=1e-3)
    assert film.load == pytest.approx(pressure(flow).y[1, -1], rel=1e-3)


def test_torque_of_spirals_without_flow_is_that_of_a_pair_of_channels():
    """Ridge and groove side by side: the pressure rises in one and falls in the other so that both pass one flow."""
    film = replace(CLOSED, grooves=replace(GROOVES, land=0.0))
    p = film.steady(NARROW, SPEED)
    slope = np.gradient(p.pressure, p.r, edge_order=2)
    a, angle = GROOVES.share, GROOVES.angle
    total = []
    for r, rise in zip(p.r, slope, strict=True):
        along, across = SPEED * r * np.cos(angle), SPEED * r * np.sin(angle)
        h = np.array([NARROW + GROOVES.depth, NARROW])
        # unknown: gradients across in groove and ridge; equal flow, and the mean gradient
        rows = np.array([[-(h[0] ** 3), h[1] ** 3], [a, 1 - a]])
        right = np.array([12 * MU * across / 2 * (h[1] - h[0]), rise * np.cos(angle)])
        own = np.linalg.solve(rows, right)
        shear_across = MU * across / h + own * h / 2
        shear_along = MU * along / h - rise * np.sin(angle) * h / 2
        share = np.array([a, 1 - a])
        total.append(share @ (shear_along * np.cos(angle) + shear_across * np.sin(angle)) * 2 * pi * r**2)
    exact = np.trapezoid(total, p.r)
    assert p.friction_torque == pytest.approx(exact, rel=1e-3)


def fitted(errors):
    return -float(np.polyfit(np.log(SIZES), np.log(np.abs(errors)), 1)[0])


def test_loads_stiffness_and_damping_converge_with_the_square_of_the_step():
    spirals = [replace(CLOSED, n_radial=n) for n in SIZES]
    assert fitted([one.steady(NARROW, SPEED).load / closed_load(NARROW) - 1 for one in spirals]) > 1.8
    rings = [replace(RING, n_radial=n).dynamic_stiffness(GAP, s=1e4j)[0] / squeeze(1e4) - 1 for n in SIZES]
    assert fitted(rings) > 1.8
    flows = [replace(SPIRAL, n_radial=n) for n in (*SIZES, 2048)]
    values = np.array([
        (one.steady(NARROW, SPEED).load, one.steady(NARROW, SPEED).flow,
         *(part[0] for part in one.coefficients(NARROW, SPEED, 2e4)))
        for one in flows
    ])  # fmt: skip
    assert [fitted(column) > 1.8 for column in (values[:-1] / values[-1] - 1).T] == [True] * 4


def test_stiffness_and_damping_are_those_of_the_film_itself():
    """Static stiffness against differences of the load, of every edge and with slip."""
    feed = RingFeed(8, 0.2e-3)
    for film in (
        SPIRAL, CLOSED, replace(SPIRAL, grooves=replace(GROOVES, pumps="outwards"), mean_free_path=68e-9),
        replace(RING, inner_edge="fed", feed=feed, hub_radius=5e-3),
    ):  # fmt: skip
        step, (K, C) = 1e-10, film.coefficients(NARROW, SPEED, [0.0], 0.4e6)
        near, far = (film.steady(NARROW + way * step, SPEED, 0.4e6).load for way in (-1, 1))
        assert K[0] == pytest.approx((near - far) / (2 * step), rel=1e-6) and C[0] > 0


def test_a_turn_the_other_way_is_the_mirror_image():
    back = replace(SPIRAL, grooves=replace(GROOVES, pumps="outwards", land=0.0))
    forth = replace(SPIRAL, grooves=replace(GROOVES, land=0.0))
    assert back.steady(NARROW, -SPEED).load == pytest.approx(forth.steady(NARROW, SPEED).load, rel=1e-12)
    assert back.steady(NARROW, -SPEED).friction_torque == pytest.approx(
        -forth.steady(NARROW, SPEED).friction_torque, rel=1e-12
    )


def test_spirals_lose_their_damping_at_speed():
    """Malanoski & Pan: what the grooves pump into the land lags behind the gap, and the axial motion excites itself."""
    C = [SPIRAL.coefficients(NARROW, speed, 7e3)[1][0] for speed in (2e3, 2e4)]
    assert C[0] > 0 > C[1]


@pytest.mark.parametrize(
    ("change", "argument", "value"),
    [({"inner_radius": 0.03}, "inner_radius", 0.03), ({"inner_radius": 0.0}, "inner_radius", 0.0),
     ({"hub_radius": 0.02}, "hub_radius", 0.02), ({"grooves": replace(GROOVES, land=0.02)}, "land", 0.02)],
)  # fmt: skip
def test_rings_that_cannot_be_are_refused(change, argument, value):
    with refused(FilmError, argument, value):
        replace(RING, **change)


def test_faces_that_touch_are_refused():
    with refused(FilmError, "gap", 0.0):
        RING.steady(0.0)
