"""Stiffness and damping of a film against tilt of the journal: closed form, differences of the steady film."""

from dataclasses import replace

import numpy as np
import pytest

from refusals import refused
from reynolds import FilmError, GasBearing, Injector
from reynolds.grid import cells
from reynolds.sleeve import Foil, Grooves, Lobes, Sleeve, Steps

R, L, C, MU, PA = 0.02, 0.04, 25e-6, 1.85e-5, 101325.0
JOURNAL, SPEED = (9e-6, -4e-6), 3000.0
ORIFICES = tuple(
    Injector(angle, 0.005, orifice_diameter=1e-3, open_area=3e-8, curtain_discharge=0.8)
    for angle in np.arange(4) * np.pi / 2
)


def exact(speed, nu):
    """Moment over tilt [N m/rad] of a circular forward whirl at nu times the speed in a plain film, eps -> 0.

    The linearised equation is l^2 Q - Q'' = -k H with H odd along the axis; its solution is a hyperbolic sine.
    """
    k = 1j * 6 * MU * speed * R**2 / (PA * C**2) * (2 * nu - 1)
    root, a = np.sqrt(1 + k), L / 2
    kappa = root / R
    return np.pi * PA * R / C * k / root**2 * (L**3 / 12 - L * (a / np.tanh(kappa * a) / kappa - 1 / kappa**2))


def stiffness(bearing, speed, nu):
    found = bearing.tilt_coefficients((0.0, 0.0), speed, nu * speed)
    Z = found.K[0] + 1j * nu * speed * found.C[0]
    assert Z[0, 0] == pytest.approx(Z[1, 1], rel=1e-9) and Z[0, 1] == pytest.approx(-Z[1, 0], rel=1e-9)
    return Z[0, 0] - 1j * Z[0, 1]


@pytest.mark.parametrize(("speed", "nu"), [(628.3, 0.42), (6283.0, 0.3), (20000.0, 0.0)])
def test_a_plain_film_tends_to_the_closed_form_with_the_square_of_the_step(speed, nu):
    sizes = (16, 32, 64)
    errors = [
        abs(stiffness(GasBearing(R, L, C, n_theta=n, n_z=n // 2), speed, nu) / exact(speed, nu) - 1) for n in sizes
    ]
    assert -np.polyfit(np.log(sizes), np.log(errors), 1)[0] > 1.8
    assert errors[-1] < 0.02


def test_a_short_film_has_a_sixtieth_of_its_force_over_the_square_of_its_length():
    """Parabolas and cubics along the axis: moment over tilt is L^2 / 60 of force over displacement."""
    short = GasBearing(R, 0.004, C, ambient_pressure=1e8, n_theta=64, n_z=64)
    K = [part.K[0, 0, 1] for part in (short.tilt_coefficients((0, 0), SPEED), short.coefficients((0, 0), SPEED))]
    assert K[0] / K[1] == pytest.approx(0.004**2 / 60, rel=5e-3)


FILMS = {
    "plain": GasBearing(R, L, C, n_theta=32, n_z=8, symmetric=False),
    "slip and lobes": GasBearing(
        R, L, C, n_theta=32, n_z=8, symmetric=False, mean_free_path=1e-6, sleeve=Sleeve(lobes=Lobes(3, 0.4))
    ),
    "herringbone": GasBearing(
        R, L, C, n_theta=32, n_z=8, symmetric=False,
        sleeve=Sleeve(grooves=Grooves(20e-6, 0.4, 0.45, 0.01, on="journal")),
    ),
    "foil": GasBearing(R, L, C, n_theta=32, n_z=8, symmetric=False, sleeve=Sleeve(foil=Foil(2e10, 0.3))),
    "strips": GasBearing(
        R, L, C, n_theta=32, n_z=8, symmetric=False, sleeve=Sleeve(foil=Foil(2e10, 0.3, bumps="strips"))
    ),
    "orifices": GasBearing(R, L, C, n_theta=32, n_z=8, symmetric=False, injectors=ORIFICES),
    "foil with orifices": GasBearing(
        R, L, C, n_theta=32, n_z=8, symmetric=False, injectors=ORIFICES, sleeve=Sleeve(foil=Foil(5e10, 0.3))
    ),
    "strips with orifices": GasBearing(
        R, L, C, n_theta=32, n_z=8, symmetric=False, injectors=ORIFICES,
        sleeve=Sleeve(foil=Foil(5e10, 0.3, bumps="strips")),
    ),
}  # fmt: skip


def moment(film, tilt):
    """Moment (2,) [N m] about the film's middle with the journal tilted by (dX/dz, dY/dz)."""
    tilted, grid = replace(film), film.model.grid
    layout, w, _ = tilted._built
    at = cells(layout)
    z = grid.dz * np.arange(layout.n_rows + 2) - L / 2
    for line in range(-1, layout.n_theta + 1):  # lines, and the ghosts of the last and the first
        begin = layout.clearance + layout.first + line * layout.stride - 1
        theta = grid.theta[line % layout.n_theta]
        w[begin : begin + z.size] -= z * (tilt[0] * np.cos(theta) + tilt[1] * np.sin(theta))
    steady, _, _ = tilted._solve(JOURNAL, SPEED, 0.2e6 if film.injectors else 0.0, None)
    p = steady[layout.p + at] - PA
    return np.array([(z[1:-1] * p * steady[force + at]).sum() for force in (layout.force_x, layout.force_y)])


@pytest.mark.parametrize("name", FILMS)
def test_static_stiffness_is_the_derivative_of_the_moment(name):
    film, step = FILMS[name], 2e-6
    K = film.tilt_coefficients(JOURNAL, SPEED, 0.0, 0.2e6 if film.injectors else 0.0).K[0]
    for axis, way in enumerate(np.eye(2)):
        slope = (moment(film, -step * way) - moment(film, step * way)) / (2 * step)
        np.testing.assert_allclose(K[:, axis], slope, atol=2e-5 * np.abs(K).max())


@pytest.mark.parametrize("name", ["plain", "slip and lobes", "herringbone", "foil", "strips", "injectors", "fed foil"])
def test_a_half_film_has_the_moment_of_the_whole(name):
    """A part that is odd in z leaves the midplane, injectors there and strips alone."""
    midplane = tuple(Injector(angle) for angle in np.arange(4) * np.pi / 2)
    film = FILMS[{"injectors": "plain", "fed foil": "foil"}.get(name, name)]
    film = replace(film, injectors=midplane) if name in ("injectors", "fed foil") else film
    for omega in (0.0, 2000.0):
        whole, half = (
            replace(film, symmetric=way).tilt_coefficients(JOURNAL, SPEED, omega, 0.2e6 if film.injectors else 0.0)
            for way in (False, True)
        )
        np.testing.assert_allclose(half.K, whole.K, atol=1e-6 * np.abs(whole.K).max())
        np.testing.assert_allclose(half.C, whole.C, atol=1e-6 * np.abs(whole.C).max())


def test_pockets_and_jumps_are_refused():
    for sleeve in (Sleeve(steps=(Steps(3, 5e-6, 0.5),)), Sleeve(lobes=Lobes(3, 0.5, 0.8))):
        with refused(FilmError, "sleeve", lambda value: True):
            GasBearing(R, L, C, n_theta=32, n_z=8, sleeve=sleeve).tilt_coefficients()
