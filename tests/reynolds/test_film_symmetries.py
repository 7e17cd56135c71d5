"""Symmetries of the film: half and full bearing, rotation, mirror."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from reynolds import GasBearing, Injector

few = settings(max_examples=10, derandomize=True)
radii = st.floats(0.0, 0.5)
angles = st.floats(0.0, 2 * np.pi)
speeds = st.floats(-1000.0, 1000.0)


def two_injectors(turn=0.0, mirror=1.0):
    """A bearing without symmetry of its own: injectors at 90 and 20 deg with different pins."""
    places = ((np.pi / 2, 20e-6), (np.pi / 9, 25e-6))
    injectors = tuple(Injector(mirror * angle + turn, pin=pin) for angle, pin in places)
    return GasBearing(0.02, 0.04, 25e-6, injectors=injectors, n_theta=36, n_z=8)


def position(radius, angle):
    return 25e-6 * radius * np.array([np.cos(angle), np.sin(angle)])


@few
@given(radius=radii, angle=angles, speed=speeds, turns=st.integers(1, 3))
def test_turning_injectors_and_journal_by_right_angles_turns_the_force(radius, angle, speed, turns):
    """The grid turns into itself: 1e-9 N of some 20 N is the tolerance of the steady solution."""
    turn = turns * np.pi / 2
    Q = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    here = two_injectors().steady(position(radius, angle), speed, 4e5)
    there = two_injectors(turn).steady(Q @ position(radius, angle), speed, 4e5)
    assert there.force == pytest.approx(Q @ here.force, abs=1e-8)
    assert there.mass_flow == pytest.approx(here.mass_flow, rel=1e-9)


@few
@given(radius=radii, angle=angles, speed=speeds)
def test_reversing_the_speed_mirrors_the_force(radius, angle, speed):
    """Mirrored at the x axis, everything with it."""
    M = np.diag([1.0, -1.0])
    here = two_injectors().steady(position(radius, angle), speed, 4e5)
    there = two_injectors(mirror=-1.0).steady(M @ position(radius, angle), -speed, 4e5)
    assert there.force == pytest.approx(M @ here.force, abs=1e-8)
    assert there.friction_torque == pytest.approx(-here.friction_torque, rel=1e-9, abs=1e-12)


@few
@given(radius=radii, angle=angles, speed=speeds)
def test_half_bearing_is_the_full_bearing(injected, radius, angle, speed):
    """The same equations, half of them written once: 1e-12 of the pressures is rounding."""
    half, full = (injected(32, 8, symmetric=s).steady(position(radius, angle), speed, 4e5) for s in (True, False))
    assert half.pressure == pytest.approx(full.pressure, rel=1e-12)
    assert half.force == pytest.approx(full.force, rel=1e-12, abs=1e-10)
    assert half.mass_flow == pytest.approx(full.mass_flow, rel=1e-12)
    assert half.edge_flow == pytest.approx(full.edge_flow, rel=1e-12)


def test_half_bearing_has_the_coefficients_and_the_motion_of_the_full_bearing(injected):
    """As above, 1e-9 after a linear solve and fifty steps."""
    films = [injected(32, 8, symmetric=s) for s in (True, False)]
    half, full = (f.coefficients((5e-6, 3e-6), 400.0, [0.0, 700.0], 4e5) for f in films)
    np.testing.assert_allclose(half.K, full.K, rtol=1e-9)
    np.testing.assert_allclose(half.C, full.C, rtol=1e-6)

    def path(t):
        return 5e-6 * np.cos(400 * t * t), 3e-6 * np.sin(900 * t * t)

    half, full = (f.march(path, 5e-3, 1e-4, 400.0, 4e5) for f in films)
    assert half.force == pytest.approx(full.force, rel=1e-8, abs=1e-8)


def test_force_is_the_sum_over_the_pressures_returned(injected):
    """F = -Int (p - pa) (cos, sin) dA over the interval means, to rounding; so plots and forces cannot
    disagree.
    """
    film = injected(32, 8)
    steady = film.steady((5e-6, 3e-6), 400.0, 4e5)
    area = 0.02 * (2 * np.pi / 32) * (0.04 / 8)
    excess = (steady.pressure - 101325.0).sum(axis=1) * area
    assert steady.force == pytest.approx([-excess @ np.cos(steady.theta), -excess @ np.sin(steady.theta)], rel=1e-12)


def test_injectors_off_the_midplane_need_the_full_bearing_and_balance(injected):
    """Two rows at +-z make a symmetric bearing again: the flows of both rows agree to 1e-9."""
    pairs = tuple(Injector(a, offset=z) for a in (0.0, 2.0) for z in (-0.01, 0.01))
    film = GasBearing(0.02, 0.04, 25e-6, injectors=pairs, n_theta=32, n_z=16)
    assert not film.model.grid.half
    steady = film.steady((3e-6, 4e-6), 400.0, 4e5)
    assert steady.mass_flow[0::2] == pytest.approx(steady.mass_flow[1::2], rel=1e-9)
    assert steady.pressure == pytest.approx(steady.pressure[:, ::-1], rel=1e-9)
    assert steady.edge_flow == pytest.approx(steady.mass_flow.sum(), rel=1e-12)
