"""Convergence of the steady film for every journal position."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

twenty = settings(max_examples=20, derandomize=True)
angles = st.floats(0.0, 2 * np.pi)
speeds = st.floats(0.0, 2000.0)
supplies = st.floats(0.0, 7e5)


def solve(film, radius, angle, speed, supply):
    """Steady film that balances its mass; radius in clearances, angle [rad]."""
    steady = film.steady(radius * 25e-6 * np.array([np.cos(angle), np.sin(angle)]), speed, supply)
    assert steady.converged
    assert np.isfinite(steady.force).all() and steady.pressure.min() > 0
    # 1e-9 of a calibrated flow, or of the flow that there is
    assert steady.edge_flow == pytest.approx(steady.mass_flow.sum(), rel=1e-9, abs=1e-13)
    return steady


@twenty
@given(radius=st.floats(0.0, 0.95), angle=angles, speed=speeds)
def test_plain_film_is_found_for_every_journal_position(plain, radius, angle, speed):
    steady = plain(32, 16).steady(radius * 25e-6 * np.array([np.cos(angle), np.sin(angle)]), speed)
    assert steady.converged and steady.pressure.min() > 0
    assert steady.h_min == pytest.approx(25e-6 * (1 - radius), rel=1e-9)


@twenty
@given(radius=st.floats(0.0, 0.6), angle=angles, speed=speeds, supply=supplies)
def test_injected_film_is_found_for_moderate_journal_positions(injected, radius, angle, speed, supply):
    solve(injected(32, 16), radius, angle, speed, supply)


# Radius [clearances], angle [deg], speed [rad/s], supply [Pa gauge]
FAR_OUT = [(0.807, 189.0, 620.0, 0.0), (0.928, 180.0, 850.0, 4.3e5), (0.95, 15.0, 33.0, 5.7e5)]


@pytest.mark.parametrize("state", FAR_OUT)
def test_injected_film_is_found_for_far_out_journal_positions(injected, state):
    radius, angle, speed, supply = state
    solve(injected(32, 16), radius, np.radians(angle), speed, supply)
