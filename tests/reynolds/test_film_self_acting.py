"""Steady self-acting films against a spectral solution, short and long bearing theory, Petroff friction."""

import numpy as np
import pytest

from film_closed_forms import ocvirk_force, sommerfeld_force
from reynolds import GasBearing

R, C, MU, PA = 0.02, 25e-6, 1.85e-5, 101325.0
SPEED, EPS = 1000.0, 0.5

# Compressible finite bearing by a Fourier x Chebyshev solution, to all digits given.
# (L/D, bearing number, eccentricity): W / (pa L D), attitude angle [deg], p_max / pa
SPECTRAL = {
    (1.0, 1.0, 0.2): (0.0740152, 72.21060, 1.078716),
    (1.0, 1.0, 0.4): (0.1625767, 65.34923, 1.215593),
    (1.0, 1.0, 0.6): (0.3019636, 51.34144, 1.539850),
    (1.0, 1.0, 0.8): (0.67744, 29.906, 2.6324),
    (1.0, 5.0, 0.6): (0.96336, 22.1124, 2.6671),
    (1.0, 0.6, 0.4): (0.1011832, 74.00484, 1.129176),
    (1.0, 0.4476, 0.5): (0.1042520, 73.72361, 1.150220),
    (0.5, 2.0, 0.5): (0.1583537, 63.23081, 1.260554),
}


def self_acting(plain, case, n_theta, n_z):
    """Load parameter, attitude angle [deg] and highest pressure ratio; the journal is displaced along x."""
    ratio, number, eps = case
    speed = number * PA * C**2 / (6 * MU * R**2)
    film = plain(n_theta, n_z, length=2 * R * ratio).steady((eps * C, 0.0), speed)
    load = np.hypot(*film.force) / (PA * (2 * R) ** 2 * ratio)
    angle = np.degrees(np.arctan2(film.force[1], -film.force[0]))
    return np.array([load, angle, film.p_max / PA])


@pytest.mark.parametrize("case", SPECTRAL)
def test_film_extrapolates_to_the_spectral_solution(plain, case):
    """Richardson's extrapolation from 64 x 16 and 128 x 32 leaves terms of fourth order: 2.5e-5 of the load
    and 0.002 deg at worst. The grids themselves are 1 % and 0.25 % off. The
    highest node misses the peak by up to half a step, which is not smooth in the grid: 1e-3 bounds it at 128
    x 32.
    """
    coarse, fine = self_acting(plain, case, 64, 16), self_acting(plain, case, 128, 32)
    load, angle, highest = SPECTRAL[case]
    limit = (4 * fine - coarse) / 3
    assert limit[0] == pytest.approx(load, rel=5e-5)
    assert limit[1] == pytest.approx(angle, abs=0.003)
    assert coarse[0] == pytest.approx(load, rel=1e-2)
    assert fine[0] == pytest.approx(load, rel=2.5e-3)
    assert fine[2] == pytest.approx(highest, rel=1e-3)


def incompressible(ratio, n_theta, n_z):
    """Steady film at 1e9 Pa ambient, where the density changes by 1e-4."""
    film = GasBearing(R, 2 * R * ratio, C, ambient_pressure=1e9, n_theta=n_theta, n_z=n_z)
    return film.steady((EPS * C, 0.0), SPEED)


def test_short_incompressible_film_tends_to_ocvirk(order):
    """Grid error out by extrapolation from 64 x 16 and 128 x 32, what is left is the length: (L/D)^2, .26 %
    at .05.
    """
    ratios = (0.1, 0.05, 0.025)
    rests = []
    for ratio in ratios:
        coarse, fine = (incompressible(ratio, *n).force[1] for n in ((64, 16), (128, 32)))
        rests.append((4 * fine - coarse) / 3 / ocvirk_force(R, 2 * R * ratio, C, EPS, SPEED, MU) - 1)
    assert order([1 / r for r in ratios], rests) == pytest.approx(2.0, abs=0.1)
    # one more extrapolation, in the length; two of second order leave terms of fourth order, 1e-4
    assert (4 * rests[2] - rests[1]) / 3 == pytest.approx(0.0, abs=1e-4)


def test_short_film_on_one_grid_is_as_far_from_ocvirk_as_its_parabola_and_its_length_state():
    """-.62 % at L/D = .05, 256 x 16: -1/16^2 from the trapezoidal sum over a parabola, -.23 % from the
    length.
    """
    force = incompressible(0.05, 256, 16).force
    assert force[1] / ocvirk_force(R, 0.05 * 2 * R, C, EPS, SPEED, MU) == pytest.approx(1 - 0.0062, abs=1e-4)


def test_long_incompressible_film_tends_to_sommerfeld(order):
    """The ends take a constant force away, 2.4 % at L/D = 40, and as much on any length with the same step in
    z: the difference between L/D 80 and 40 has no end. What remains is of second order in theta; 1e-5 is
    compressibility.
    """
    unit = sommerfeld_force(R, 40 * 2 * R, C, EPS, SPEED, MU)
    sizes = (32, 64, 128)
    rests = [(incompressible(80, n, 64).force[1] - incompressible(40, n, 32).force[1]) / unit - 1 for n in sizes]
    assert order(sizes, rests) == pytest.approx(2.0, abs=0.1)
    assert (4 * rests[2] - rests[1]) / 3 == pytest.approx(0.0, abs=1e-5)


def test_incompressible_full_film_pushes_at_right_angles_to_the_displacement():
    """Its pressure is odd about the line of centres; a density change of order 1e-4 leaves as much."""
    force = incompressible(1.0, 64, 16).force
    assert abs(force[0]) < 1e-3 * force[1]


@pytest.mark.parametrize("symmetric", [True, False])
def test_friction_of_the_concentric_film_is_petroffs(plain, symmetric):
    """2 pi mu Omega R^3 L / c (Petroff 1883): constant shear, summed exactly; 1e-12 is rounding."""
    film = plain(32, 8, symmetric=symmetric)
    for speed in (500.0, -500.0):
        expected = 2 * np.pi * MU * speed * R**3 * film.length / C
        assert film.steady((0.0, 0.0), speed).friction_torque == pytest.approx(expected, rel=1e-12)


def test_friction_of_the_long_film_grows_with_eccentricity_as_sommerfeld_states(order):
    """M = 4 pi mu Omega R^3 L (1 + 2 eps^2) / (c (2 + eps^2) sqrt(1 - eps^2)); Hamrock (2004), ch. 10.

    Ends cancel and orders hold as for the force above.
    """
    shape = (1 + 2 * EPS**2) / ((2 + EPS**2) * np.sqrt(1 - EPS**2))
    unit = 4 * np.pi * MU * SPEED * R**3 * 40 * 2 * R / C * shape
    sizes = (32, 64, 128)
    rests = [
        (incompressible(80, n, 64).friction_torque - incompressible(40, n, 32).friction_torque) / unit - 1
        for n in sizes
    ]
    assert order(sizes, rests) == pytest.approx(2.0, abs=0.1)
    assert (4 * rests[2] - rests[1]) / 3 == pytest.approx(0.0, abs=1e-5)
