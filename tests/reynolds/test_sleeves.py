"""Sleeves with lobes, steps, grooves and foil: closed forms, an independent solver, orders, coefficients."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from refusals import refused
from reynolds import FilmError, GasBearing, Injector
from reynolds.grid import cells
from reynolds.sleeve import Foil, Grooves, Lobes, Sleeve, Steps
from rotorsim.machine.gas_film import Orifices

R, L, C, MU, PA = 0.02, 0.04, 20e-6, 1.85e-5, 101325.0
SPEED, JOURNAL = 2000.0, (4e-6, -3e-6)
FOIL = Foil(5e9)
HERRINGBONE = Grooves(20e-6, 0.5, 0.5)
FORMS = {
    "lobes": Sleeve(lobes=Lobes(4, 0.5)),
    "steps": Sleeve(steps=(Steps(4, 10e-6, np.pi / 4, 0.02),)),
    "grooves": Sleeve(grooves=Grooves(20e-6, 0.5, 0.5, land=0.01)),
    "grooved journal": Sleeve(grooves=Grooves(20e-6, 0.5, 0.5, on="journal")),
    "spiral": Sleeve(grooves=Grooves(20e-6, 0.5, 0.5, pattern="spiral")),
    "foil": Sleeve(foil=FOIL),
    "foil with loss": Sleeve(foil=Foil(5e9, 0.3)),
    "strips": Sleeve(foil=Foil(5e9, bumps="strips")),
    "strips with loss": Sleeve(foil=Foil(5e9, 0.3, bumps="strips")),
    "strips and lobes that jump": Sleeve(lobes=Lobes(3, 0.5, 0.8), foil=Foil(5e9, 0.3, bumps="strips")),
}


def bearing(sleeve=None, n_theta=32, n_z=16, **changes):
    given = {"radius": R, "length": L, "clearance": C, "n_theta": n_theta, "n_z": n_z, "sleeve": sleeve or Sleeve()}
    return GasBearing(**(given | changes))


def force(sleeve, n_theta=32, journal=JOURNAL, speed=SPEED, **changes):
    return bearing(sleeve, n_theta, n_theta // 2, **changes).steady(journal, speed).force


@pytest.mark.parametrize("name", FORMS)
def test_stiffness_is_that_of_differences_of_the_steady_force(name):
    one = bearing(FORMS[name])
    K = one.coefficients(JOURNAL, SPEED).K[0]
    step, moved = 2e-9, np.zeros((2, 2))
    for axis, e in enumerate(np.eye(2) * step):
        ahead, behind = (one.steady(JOURNAL + sign * e, SPEED).force for sign in (1, -1))
        moved[:, axis] = -(ahead - behind) / (2 * step)
    np.testing.assert_allclose(K, moved, atol=1e-6 * np.abs(K).max())


@pytest.mark.parametrize(
    "name", ["steps", "spiral", "grooved journal", "foil", "foil with loss", "strips", "strips with loss"]
)
def test_the_dynamic_stiffness_is_that_of_a_small_vibration(name):
    """The film marched in time through a vibration of 20 nm along x at 300 Hz answers as K + i omega C."""
    one, omega, amplitude, steps = bearing(FORMS[name], 16, 8), 2 * np.pi * 300, 20e-9, 80
    answer = one.coefficients(JOURNAL, SPEED, omega)
    period = 2 * np.pi / omega
    march = one.march(
        lambda t: (JOURNAL[0] + amplitude * np.sin(omega * t), JOURNAL[1]), 4 * period, period / steps, SPEED,
        tolerance=1e-12,
    )  # fmt: skip
    phase = np.exp(-1j * omega * march.time[-steps:])
    Z = -(march.force[-steps:] * phase[:, None]).sum(axis=0) * 2 / steps / amplitude * 1j
    expected = answer.K[0, :, 0] + 1j * omega * answer.C[0, :, 0]
    np.testing.assert_allclose(Z, expected, atol=2e-3 * np.abs(expected).max())
    assert march.mass_defect < 1e-9


HOLES = tuple(
    Injector(angle, orifice_diameter=0.3e-3, open_area=5e-8, curtain_discharge=0.8, plenum_volume=1e-11)
    for angle in np.arange(8) * np.pi / 4
)
SUPPLY = 0.3e6
FED = {
    "foil": Sleeve(foil=Foil(2e10)),
    "foil with loss": Sleeve(foil=Foil(2e10, 0.3)),
    "strips": Sleeve(foil=Foil(1e10, bumps="strips")),
    "strips with loss": Sleeve(foil=Foil(1e10, 0.3, bumps="strips")),
    "grooves": Sleeve(grooves=Grooves(10e-6, 0.5, 0.5, land=0.014)),
    "grooved journal": Sleeve(grooves=Grooves(10e-6, 0.5, 0.5, land=0.014, on="journal")),
}
"""Foils with orifices in them, which the film of 20 um bends by some 8 um, and grooves next to a fed land."""


@pytest.mark.parametrize("bumps", ["points", "strips"])
def test_a_fed_foil_tends_to_the_fed_sleeve_with_its_compliance(bumps):
    """Force and flow differ by a share that is inverse to the stiffness: 1e-4 at 1e14 N/m^3."""
    plain = bearing(injectors=HOLES).steady(JOURNAL, SPEED, SUPPLY)
    off = []
    for stiffness in (1e13, 1e14, 1e15):
        foil = bearing(Sleeve(foil=Foil(stiffness, bumps=bumps)), injectors=HOLES).steady(JOURNAL, SPEED, SUPPLY)
        force = np.linalg.norm(foil.force - plain.force) / np.linalg.norm(plain.force)
        off.append((force, foil.mass_flow.sum() / plain.mass_flow.sum() - 1))
    for more, less in pairwise(np.array(off)):
        np.testing.assert_allclose(more / less, 10.0, rtol=2e-2)
    assert max(off[1]) < 1.2e-4


def test_a_foil_fed_by_the_orifices_of_a_machine_file_has_the_flow_and_force_of_the_bearings_page():
    """8 orifices of .3 mm with every default, 0.3 MPa (gauge), strips of 10 GN/m^3: 138.5 mg/s, 25 N."""
    row = Orifices(count=8, diameter="0.3 mm")
    foil = Sleeve(foil=Foil(1e10, bumps="strips"))
    film = bearing(foil, injectors=row.nozzles).steady(JOURNAL, SPEED, SUPPLY)
    assert film.mass_flow.sum() == pytest.approx(138.5e-6, rel=1e-3)
    assert np.linalg.norm(film.force) == pytest.approx(25.3, rel=0.01)


@pytest.mark.parametrize("name", FED)
def test_what_feeds_a_film_leaves_at_its_edges_and_its_stiffness_is_that_of_the_steady_force(name):
    """The curtain of an orifice in a foil grows as the pressure bends it, by a tenth of the flow and more."""
    one = bearing(FED[name], injectors=HOLES)
    film = one.steady(JOURNAL, SPEED, SUPPLY)
    assert film.edge_flow == pytest.approx(film.mass_flow.sum(), rel=1e-10)
    plain = bearing(injectors=HOLES).steady(JOURNAL, SPEED, SUPPLY).mass_flow.sum()
    assert film.mass_flow.sum() > (1.1 if FED[name].foil else 1.0) * plain
    K = one.coefficients(JOURNAL, SPEED, supply_pressure=SUPPLY).K[0]
    step, moved = 5e-9, np.zeros((2, 2))
    for axis, e in enumerate(np.eye(2) * step):
        ahead, behind = (one.steady(JOURNAL + sign * e, SPEED, SUPPLY).force for sign in (1, -1))
        moved[:, axis] = -(ahead - behind) / (2 * step)
    np.testing.assert_allclose(K, moved, atol=1e-6 * np.abs(K).max())


@pytest.mark.parametrize("name", ["foil with loss", "strips with loss", "grooves", "grooved journal"])
def test_a_fed_film_answers_a_small_vibration_as_its_dynamic_stiffness_and_keeps_its_mass(name):
    one, omega, amplitude, steps = bearing(FED[name], 16, 8, injectors=HOLES), 2 * np.pi * 300, 20e-9, 80
    answer, period = one.coefficients(JOURNAL, SPEED, omega, SUPPLY), 2 * np.pi / omega
    march = one.march(
        lambda t: (JOURNAL[0] + amplitude * np.sin(omega * t), JOURNAL[1]), 4 * period, period / steps, SPEED, SUPPLY,
        tolerance=1e-12,
    )  # fmt: skip
    phase = np.exp(-1j * omega * march.time[-steps:])
    Z = -(march.force[-steps:] * phase[:, None]).sum(axis=0) * 2 / steps / amplitude * 1j
    expected = answer.K[0, :, 0] + 1j * omega * answer.C[0, :, 0]
    np.testing.assert_allclose(Z, expected, atol=1e-3 * np.abs(expected).max())
    assert march.mass_defect < 1e-12


def test_a_film_with_grooves_and_a_fed_land_converges_in_the_second_order_to_that_of_vanishing_grooves():
    """The fed plain film, within the 6e-4 by which the two schemes differ on 32 lines."""
    films = [bearing(FED["grooves"], n, n // 2, injectors=HOLES).steady(JOURNAL, SPEED, SUPPLY) for n in (32, 64, 128)]
    coarse, fine = (np.linalg.norm(b.force - a.force) for a, b in pairwise(films))
    assert np.log2(coarse / fine) > 1.8
    plain = bearing(injectors=HOLES).steady(JOURNAL, SPEED, SUPPLY)
    shallow = [
        bearing(Sleeve(grooves=Grooves(depth, 0.5, 0.5, land=0.014)), injectors=HOLES).steady(JOURNAL, SPEED, SUPPLY)
        for depth in (1e-9, 1e-8)
    ]
    near = np.linalg.norm(shallow[0].force - plain.force) / np.linalg.norm(plain.force)
    assert near < 6e-4
    assert shallow[0].mass_flow.sum() == pytest.approx(plain.mass_flow.sum(), rel=1e-4)
    assert np.linalg.norm(shallow[1].force - shallow[0].force) < 2e-3 * np.linalg.norm(plain.force)


@pytest.mark.parametrize("name", ["lobes", "steps", "grooves", "foil", "strips"])
def test_the_force_converges_in_the_second_order(name):
    forces = [force(FORMS[name], n) for n in (16, 32, 64)]
    coarse, fine = (np.linalg.norm(b - a) for a, b in pairwise(forces))
    assert np.log2(coarse / fine) > 1.8


def test_the_plain_film_is_the_limit_of_a_stiff_foil():
    plain = force(Sleeve())
    np.testing.assert_allclose(force(Sleeve(foil=Foil(1e16))), plain, atol=1e-6 * np.linalg.norm(plain))


def along(one, journal):
    """Mean pressures (n,) [Pa] over the ambient one along the lines, their angles and the steady film."""
    film = one.steady(journal, SPEED)
    return film.pressure.mean(axis=1) - PA, film.theta, film


def test_stiff_strips_push_as_the_plain_film_where_it_presses_and_do_not_pull():
    mean, theta, _ = along(bearing(), JOURNAL)
    assert mean.min() < -0.05 * mean.max()
    area = 2 * np.pi * R * L / theta.size
    expected = [-(np.maximum(mean, 0) * way(theta)).sum() * area for way in (np.cos, np.sin)]
    found = force(Sleeve(foil=Foil(1e16, bumps="strips")))
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.linalg.norm(expected))


def test_strips_carry_what_the_journal_feels_and_are_never_bent_inwards():
    """k w, the force on the bumps per area, integrates to the force on the journal; the gap has the same w >= 0."""
    sleeve = FORMS["strips"]
    mean, theta, film = along(bearing(sleeve, n_theta=64), JOURNAL)
    bend = np.maximum(mean, 0) / sleeve.foil.stiffness
    area = 2 * np.pi * R * L / theta.size
    carried = [-sleeve.foil.stiffness * (bend * way(theta)).sum() * area for way in (np.cos, np.sin)]
    np.testing.assert_allclose(film.force, carried, rtol=1e-9)
    gap = C + bend - JOURNAL[0] * np.cos(theta) - JOURNAL[1] * np.sin(theta)
    assert (mean < 0).any()
    assert film.h_min <= gap.min()
    assert film.h_min == pytest.approx(gap.min(), rel=1e-3)


TEST_BEARING = {"radius": 19.05e-3, "length": 38.1e-3, "clearance": 31.8e-6}
TEST_SPEED = 30000 * np.pi / 30


def test_strips_carry_the_load_of_the_published_test_bearing_beyond_the_clearance():
    """134 N at 30,000 rpm (Ruscitto, McCormick & Gray 1978), with the stiffness that Heshmat et al. (1983) state."""
    sleeve = Sleeve(foil=Foil(4.61e9, 0.2, bumps="strips"))
    journal = (7.7e-6, -53.6e-6)
    films = [bearing(sleeve, n, n // 3, **TEST_BEARING).steady(journal, TEST_SPEED) for n in (48, 96, 192)]
    assert np.hypot(*journal) > 1.6 * TEST_BEARING["clearance"]
    assert np.linalg.norm(films[-1].force) == pytest.approx(134.0, rel=0.02)
    assert 6e-6 < films[-1].h_min < 7e-6
    coarse, fine = (np.linalg.norm(b.force - a.force) for a, b in pairwise(films))
    assert np.log2(coarse / fine) > 1.8
    thicknesses = [film.h_min for film in films]
    coarse, fine = (abs(b - a) for a, b in pairwise(thicknesses))
    assert np.log2(coarse / fine) > 1.8


def test_three_lobes_on_strips_carry_it_too_where_they_meet_alike():
    """Lobes of `foil_turbo_rotor`, 9.54 um at the shims. If they jumped, at 0.8 of an arc, the film ended at 40 N: the
    pressure falls to ambient towards the end of the lower lobe, no bump is pressed there, and the journal meets it.
    """
    smallest = []
    for offset, journal in ((0.5, (5.8e-6, -31.2e-6)), (0.8, (4.2e-6, -10.4e-6))):
        sleeve = Sleeve(lobes=Lobes(3, 0.7, offset, -np.pi / 2), foil=Foil(4.61e9, 0.3, bumps="strips"))
        film = bearing(sleeve, 60, 16, **{**TEST_BEARING, "clearance": 9.54e-6}).steady(journal, TEST_SPEED)
        smallest.append((np.hypot(*film.force), film.h_min))
    assert smallest[0][0] == pytest.approx(134.0, rel=0.03) and 6e-6 < smallest[0][1] < 7e-6
    assert smallest[1][0] < 45.0 and smallest[1][1] < 0.5e-6


def test_a_foil_bent_at_points_touches_at_its_ends_where_the_clearance_is_used_up():
    with pytest.raises(FilmError):
        bearing(Sleeve(foil=Foil(4.61e9)), **TEST_BEARING).steady((0.0, -32e-6), TEST_SPEED)


POCKETS = Steps(3, 5e-6, 0.5)


@pytest.mark.parametrize(
    ("shaped", "same"),
    [
        (Sleeve(lobes=Lobes(3, 0.0, 0.8)), Sleeve()),
        (Sleeve(grooves=Grooves(0.0, 0.5, 0.5)), Sleeve()),
        (Sleeve(grooves=Grooves(5e-6, 0.0, 0.5)), Sleeve()),
        (Sleeve(steps=(Steps(3, 0.0, 0.43),)), Sleeve()),
        (Sleeve(steps=(Steps(5, 0.0, 0.43, 0.01, 0.2), POCKETS)), Sleeve(steps=(POCKETS,))),
    ],
)
def test_a_form_that_leaves_the_gap_as_it_is_is_bitwise_absent(shaped, same):
    np.testing.assert_array_equal(force(shaped), force(same))


@pytest.mark.parametrize(
    ("parts", "whole"),
    [
        # two halves of one pocket, and a pocket within another one
        ((Steps(3, 5e-6, 0.35, None, -0.175), Steps(3, 5e-6, 0.35, None, 0.175)), Steps(3, 5e-6, 0.7)),
        ((Steps(2, 5e-6, 0.61), Steps(2, 5e-6, 0.61, 0.02)), Steps(2, 5e-6, 0.61)),
    ],
)
def test_no_edge_lies_between_pieces_of_equal_depth(parts, whole):
    np.testing.assert_allclose(force(Sleeve(steps=parts)), force(Sleeve(steps=(whole,))), rtol=1e-12)


def test_edges_of_two_rows_at_the_same_place_are_one():
    """A pocket that begins where another of another depth ends, to rounding, wherever both are turned to."""
    forces = []
    for angle in np.linspace(0.0, 2 * np.pi / 32, 9):
        rows = Steps(4, 20e-6, 0.39, 0.03, angle), Steps(4, 8e-6, 0.3, 0.03, 0.345 + angle)
        c, s = np.cos(angle), np.sin(angle)
        x, y = force(Sleeve(steps=rows), journal=(c * JOURNAL[0] - s * JOURNAL[1], s * JOURNAL[0] + c * JOURNAL[1]))
        forces.append((c * x + s * y, c * y - s * x))
    assert np.ptp(forces, axis=0).max() < 0.03 * np.linalg.norm(forces[0])


def test_half_of_a_symmetric_film_is_as_good_as_all_of_it():
    for name in ("steps", "grooves", "foil", "strips"):
        whole, half = force(FORMS[name], symmetric=False), force(FORMS[name])
        np.testing.assert_allclose(whole, half, rtol=1e-9)


def test_a_full_pocket_is_a_wider_clearance():
    deep = force(Sleeve(steps=(Steps(1, 5e-6, 7.0),)))
    np.testing.assert_allclose(deep, force(Sleeve(), clearance=C + 5e-6), rtol=3e-5)


def test_lobes_turn_with_their_first_angle():
    """A sleeve turned by a quarter is the one that is not, with all else turned by a quarter."""
    x, y = force(Sleeve(lobes=Lobes(3, 0.5)))
    turned = force(Sleeve(lobes=Lobes(3, 0.5, first_angle=np.pi / 2)), journal=(-JOURNAL[1], JOURNAL[0]))
    np.testing.assert_allclose(turned, (-y, x), rtol=1e-9)


@pytest.mark.parametrize("on", ["sleeve", "journal"])
def test_a_concentric_herringbone_pumps_to_the_pressure_of_the_closed_form(on):
    """Without flow along z dp/dz = 6 mu U sin(b) cos(b) (S - T) / K_zz on the grooves, 0 on the land; Vohr & Chow."""
    depth, share, angle, land = 20e-6, 0.4, 0.45, 0.01
    one = bearing(Sleeve(grooves=Grooves(depth, share, angle, land, on=on)))
    p = one.steady((0.0, 0.0), SPEED)
    h, g = C, C + depth
    A = share * g**3 + (1 - share) * h**3
    B = 1 / (share / g**3 + (1 - share) / h**3)
    S, T = share * g + (1 - share) * h, B * (share / g**2 + (1 - share) / h**2)
    across = A * np.sin(angle) ** 2 + B * np.cos(angle) ** 2
    slope = 6 * MU * SPEED * R * np.sin(angle) * np.cos(angle) * (S - T) / across
    assert p.p_max == pytest.approx(PA + slope * (L - land) / 2, rel=1e-9)
    assert np.abs(p.force).max() < 1e-9


def test_the_deflection_of_the_foil_balances_the_pressure():
    one = bearing(Sleeve(foil=FOIL))
    layout, _, _ = one._built
    w, _, _ = one._solve(np.array(JOURNAL), SPEED, 0.0, None)
    at = cells(layout)
    rigid = C - JOURNAL[0] * w[layout.cos + at] - JOURNAL[1] * w[layout.sin + at]
    push = FOIL.stiffness * (w[layout.h + at] - rigid)
    np.testing.assert_allclose(push, w[layout.p + at] - PA, atol=1e-9 * np.abs(w[layout.p + at] - PA).max())


def chebyshev(n):
    """Points on 1 ... -1 and the matrix of derivatives (Trefethen 2000)."""
    x = np.cos(np.pi * np.arange(n + 1) / n)
    c = np.r_[2.0, np.ones(n - 1), 2.0] * (-1.0) ** np.arange(n + 1)
    X = x[:, None] - x
    D = np.outer(c, 1 / c) / (X + np.eye(n + 1))
    return x, D - np.diag(D.sum(axis=1))


def spectral_force(foil=None, grooves=None, n=24, m=10, journal=JOURNAL, speed=SPEED):
    """Force by an independent solver: Fourier times Chebyshev collocation of p on half the film, by Newton's method."""
    theta = 2 * np.pi * np.arange(n) / n
    column = np.r_[0.0, 0.5 * (-1.0) ** np.arange(1, n) / np.tan(np.arange(1, n) * np.pi / n)]
    Dy = column[(np.arange(n)[:, None] - np.arange(n)) % n] / R
    x, D = chebyshev(m)
    Dz = D * 4 / L  # z = L/2 (1 + x) / 2: the edge first, the midplane last
    rigid = C - journal[0] * np.cos(theta)[:, None] - journal[1] * np.sin(theta)[:, None] + 0 * x

    def residual(flat, speed):
        U = speed * R
        p = np.hstack([np.ones((n, 1)), flat.reshape(n, m)]) * PA
        h = rigid if foil is None else rigid + (p - PA) / foil.stiffness
        qy, qz = Dy @ p**2, p**2 @ Dz.T
        if grooves is None:
            along = U / 2 * p * h - h**3 / (24 * MU) * qy
            axial = -(h**3) / (24 * MU) * qz
        else:
            a, s, c = grooves.share, -np.sin(grooves.angle), np.cos(grooves.angle)
            g = h + grooves.depth
            A, B = a * g**3 + (1 - a) * h**3, 1 / (a / g**3 + (1 - a) / h**3)
            S, T = a * g + (1 - a) * h, B * (a / g**2 + (1 - a) / h**2)
            cross = (A - B) * s * c
            along = U / 2 * p * (c**2 * S + s**2 * T) - ((A * c**2 + B * s**2) * qy + cross * qz) / (24 * MU)
            axial = U / 2 * p * s * c * (S - T) - (cross * qy + (A * s**2 + B * c**2) * qz) / (24 * MU)
        balance = Dy @ along + axial @ Dz.T
        balance[:, -1] = axial[:, -1] / L  # no flow through the midplane
        return balance[:, 1:].ravel() / (PA * C * speed)

    flat = np.ones(n * m)
    for share in (0.2, 0.5, 1.0):  # at a high speed Newton's method needs to begin near the solution
        flat = fsolve(residual, flat, (share * speed,), xtol=1e-12)
    assert np.abs(residual(flat, speed)).max() < 1e-8
    p = np.hstack([np.zeros((n, 1)), flat.reshape(n, m) - 1]) * PA
    weights = np.linalg.solve(
        np.vander(x, m + 1, increasing=True).T, [(1 - (-1.0) ** (k + 1)) / (k + 1) for k in range(m + 1)]
    )
    line = p @ weights * L / 2
    return -2 * np.pi / n * R * np.array([line @ np.cos(theta), line @ np.sin(theta)])


@pytest.mark.parametrize(("name", "given"), [("foil", {"foil": FOIL}), ("grooves", {"grooves": HERRINGBONE})])
def test_the_force_is_that_of_an_independent_spectral_solver(name, given):
    coarse, fine = (force(Sleeve(**given), n) for n in (32, 64))
    extrapolated = fine + (fine - coarse) / 3
    np.testing.assert_allclose(extrapolated, spectral_force(**given), atol=1e-3 * np.linalg.norm(fine))


def herringbone_stiffness(grooves, speed, omega):
    """K + i omega C (2, 2) of a concentric herringbone in its sleeve, by narrow-groove theory alone.

    The pressure rises along a line to the land; about it the harmonics exp(+-i theta) of the pressure are ordinary
    equations along half the film, whose coefficients are differences of the fluxes of Vohr & Chow.
    """
    U = speed * R

    def fluxes(p, qy, qz, h, grooved):
        a, s, c = (grooves.share, -np.sin(grooves.angle), np.cos(grooves.angle)) if grooved else (0.0, 0.0, 1.0)
        g = h + grooves.depth
        A, B = a * g**3 + (1 - a) * h**3, 1 / (a / g**3 + (1 - a) / h**3)
        S, T = a * g + (1 - a) * h, B * (a / g**2 + (1 - a) / h**2)
        cross = (A - B) * s * c
        along = U / 2 * p * (c**2 * S + s**2 * T) - ((A * c**2 + B * s**2) * qy + cross * qz) / (24 * MU)
        return np.array([along, U / 2 * p * s * c * (S - T) - (cross * qy + (A * s**2 + B * c**2) * qz) / (24 * MU)])

    pumped, resistance = fluxes(1.0, 0.0, 0.0, C, True)[1], fluxes(0.0, 0.0, -1.0, C, True)[1]
    rise = pumped / (2 * resistance)  # dp/dz on the grooves, without flow

    def mean(m):
        """Integral of the harmonic exp(i m theta) of p over half the film for H = -1."""

        def slope(z, y, gap):
            grooved = z > grooves.land / 2
            p = PA + rise * (max(z, grooves.land / 2) - L / 2)
            at = np.array([p, 0.0, 2 * p * rise if grooved else 0.0, C])
            by = np.array([(fluxes(*(at + d), grooved) - fluxes(*(at - d), grooved)) / (2 * d.max())
                           for d in np.diag(1e-6 * np.array([p, 1e9, 1e9, C]))])  # fmt: skip
            qy = 1j * m / R * 2 * p * y[0]
            qz = (y[1] - by[0, 1] * y[0] - by[1, 1] * qy - by[3, 1] * gap) / by[2, 1]
            along = by[0, 0] * y[0] + by[1, 0] * qy + by[2, 0] * qz + by[3, 0] * gap
            held = (C + grooves.share * grooves.depth * grooved) * y[0] + p * gap
            dp = (qz - 2 * (rise if grooved else 0.0) * y[0]) / (2 * p)
            return [dp, -1j * m / R * along - 1j * omega * held, y[0]]

        def to_edge(start, gap):
            for a, b in ((0.0, grooves.land / 2), (grooves.land / 2 * (1 + 1e-12), L / 2)):
                start = solve_ivp(slope, (a, b), start, args=(gap,), rtol=1e-9, atol=1e-12).y[:, -1]
            return start

        own, forced = to_edge(np.array([1.0, 0, 0], complex), 0.0), to_edge(np.zeros(3, complex), -1.0)
        return forced[2] - forced[0] / own[0] * own[2]

    plus, minus = mean(1), mean(-1)
    direct, cross = np.pi * R * (plus + minus), 1j * np.pi * R * (plus - minus)
    return np.array([[direct, -cross], [cross, direct]])


@pytest.mark.parametrize(("grooves", "omega"), [(HERRINGBONE, 0.0), (FORMS["grooves"].grooves, 2000.0)])
def test_stiffness_and_damping_of_a_herringbone_tend_to_narrow_groove_theory(grooves, omega):
    sizes, exact = (32, 64, 128), herringbone_stiffness(grooves, SPEED, omega)
    errors = []
    for n in sizes:
        found = bearing(Sleeve(grooves=grooves), n, n // 2).coefficients((0.0, 0.0), SPEED, omega)
        errors.append(np.abs(found.K[0] + 1j * omega * found.C[0] - exact).max() / np.abs(exact).max())
    assert -np.polyfit(np.log(sizes), np.log(errors), 1)[0] > 1.8 and errors[-1] < 2e-3


@pytest.mark.parametrize("number", [10.0, 25.0])
@pytest.mark.parametrize("given", [{}, {"foil": FOIL}, {"grooves": HERRINGBONE}], ids=lambda g: next(iter(g), "plain"))
def test_fast_films_agree_with_the_independent_solver(given, number):
    """Up to the bearing number that `rotorsim.plant.validity` names as checked, at half the clearance; 64 x 32
    lines are .2 to .6 % off and extrapolation from 32 and 64 leaves .15 % at most.
    """
    from rotorsim.plant.validity import BOUNDS

    assert number <= BOUNDS["bearing"].limit <= 25.0
    given_to_both = {"journal": (0.5 * C, 0.0), "speed": number * PA * C**2 / (6 * MU * R**2)}
    coarse, fine = (force(Sleeve(**given), n, **given_to_both) for n in (32, 64))
    exact = spectral_force(**given, **given_to_both)
    assert np.linalg.norm(fine - exact) < 6e-3 * np.linalg.norm(exact)
    assert np.linalg.norm(fine + (fine - coarse) / 3 - exact) < 2e-3 * np.linalg.norm(exact)


def test_forms_that_do_not_fit_are_refused():
    with pytest.raises(FilmError, match="lobes: count must be at least 1"):
        Lobes(0, 0.5)
    for form, offset in (("grooves", 4.9e-3), ("grooved journal", 0.0), ("spiral", 0.0)):
        with refused(FilmError, "injectors"):
            bearing(FORMS[form], injectors=(replace(HOLES[0], offset=offset),)).steady()
    assert bearing(FORMS["grooves"], injectors=(replace(HOLES[0], offset=4.8e-3),)).steady().mass_flow.shape == (1,)
    with pytest.raises(FilmError, match="a spiral is not symmetric"):
        bearing(FORMS["spiral"], symmetric=True).steady()
