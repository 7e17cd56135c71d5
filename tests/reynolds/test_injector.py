"""Injectors: both pin laws, order of magnitude of the unthrottled flow, sub-grid pressure correction."""

import numpy as np
import pytest

from film_closed_forms import choked_flux, hagen_poiseuille_flow
from reynolds import Injector
from reynolds.grid import FilmGrid
from reynolds.injector import footprint, subgrid_correction

JOURNAL, SPEED, SUPPLY, PA = (2e-6, -6e-6), 314.159, 5e5, 101325.0


def test_choked_pins_pass_the_flow_of_their_seat(injected):
    """At .5 MPa gauge plena are below .5283 of the supply: Cd pi d g G(P_s); 1e-11 is the nozzle's
    polynomial.
    """
    steady = injected().steady(JOURNAL, SPEED, SUPPLY)
    seat = 0.1244 * np.pi * 2e-3 * (40.2e-6 - 22.5e-6)
    assert steady.plenum.max() < 0.5283 * (SUPPLY + PA)
    assert steady.mass_flow == pytest.approx(np.full(4, seat * choked_flux(SUPPLY + PA, 293.15)), rel=1e-11)


def test_loss_factor_pins_pass_flow_by_the_difference_of_squares(injected):
    """l_f (P_s^2 - P_k^2) at the plena found, to rounding; 1.5e-16 makes 2e-5 kg/s, as much as the choked
    pins.
    """
    law = {"law": "loss_factor", "loss_factor": 1.5e-16}
    steady = injected(law=law).steady(JOURNAL, SPEED, SUPPLY)
    factor = Injector(0.0, **law).conductance(22.5e-6)
    assert steady.mass_flow == pytest.approx(factor * ((SUPPLY + PA) ** 2 - steady.plenum**2), rel=1e-10)
    assert steady.mass_flow == pytest.approx(np.full(4, 2e-5), rel=0.15)
    assert np.ptp(steady.mass_flow) > 1e-6  # a laminar pin feels its plenum


def test_unthrottled_pipe_would_pass_about_a_hundred_thousand_times_the_calibrated_flow(injected):
    """r = 1 mm, l = 10 mm from 6 to 4 bar in laminar flow: 1.3e5 times, the reason for the pins."""
    pipe = hagen_poiseuille_flow(1e-3, 10e-3, 6e5, 4e5)
    calibrated = injected().steady(JOURNAL, SPEED, SUPPLY).mass_flow.mean()
    assert 1e4 < pipe / calibrated < 1e6


def test_longer_pin_closes_its_seat_down_to_the_leak():
    injector = Injector(0.0)
    gaps = [injector.conductance(y) for y in (0.0, 20e-6, 40e-6, 45e-6)]
    assert gaps == sorted(gaps, reverse=True)
    assert gaps[-1] == pytest.approx(0.1244 * np.pi * 2e-3 * 0.5e-6, rel=1e-12)


def test_plenum_without_supply_vents_to_ambient(injected):
    """No pressure anywhere, no flow: 1e-9 of ambient and of the calibrated flow of 2e-5 kg/s."""
    steady = injected().steady((0.0, 0.0), 0.0, 0.0)
    assert steady.plenum == pytest.approx(np.full(4, PA), rel=1e-9)
    assert steady.mass_flow == pytest.approx(np.zeros(4), abs=2e-14)


@pytest.mark.parametrize(("n_theta", "n_z"), [(8, 4), (12, 4), (16, 8), (32, 8), (32, 16), (48, 12)])
def test_sub_grid_correction_is_peacemans_well_radius(n_theta, n_z):
    """Peaceman (1983): a block's pressure is the well's at r_eq = .14 sqrt(dy^2 + dz^2); the mean over the
    disc lies 1/4 (in units of Q / 2 pi T) above its rim. .14 has two digits and the formula holds for
    distances beyond the cell: .01 on values from 1.2 to -.3, 2 % of the large ones.
    """
    grid = FilmGrid(0.02, 0.04, n_theta, n_z)
    beta = subgrid_correction(grid, Injector(0.0), {(0, n_z // 2): 1.0})
    peaceman = np.log(0.14 * np.hypot(grid.dy, grid.dz) / 1e-3) + 0.25
    assert 2 * np.pi * beta == pytest.approx(peaceman, rel=0.02, abs=0.003)


@pytest.mark.parametrize(("half", "total"), [(True, 0.5), (False, 1.0)])
@pytest.mark.parametrize("angle", [0.0, 0.07, np.pi])
@pytest.mark.parametrize("grid_size", [(32, 8), (64, 16), (256, 64)])
def test_footprint_spreads_the_whole_flow_and_reads_a_mean(grid_size, angle, half, total):
    """Sources sum to 1 (a half bearing holds its own half), readings to 1; 1e-12 is rounding."""
    spread = footprint(FilmGrid(0.02, 0.04, *grid_size, half), Injector(angle))
    assert sum(v for _, _, v in spread.source) == pytest.approx(total, rel=1e-12)
    assert sum(v for _, _, v in spread.reader) == pytest.approx(1.0, rel=1e-12)
    assert sum(v for _, _, v in spread.plain) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("grid_size", [(64, 16), (128, 32)])
def test_footprint_reads_a_linear_field_near_the_middle_of_the_disc(grid_size):
    """The disc is shared between whole cells: its centre moves by less than half a step, with corrections or
    not.
    """
    grid = FilmGrid(0.02, 0.04, *grid_size, half=False)
    at, offset = 40.3 * grid.dtheta, 0.0021
    readers = footprint(grid, Injector(at, offset)).reader
    theta = sum(v * grid.theta[i] for i, _, v in readers)
    z = sum(v * grid.row_z[j] for _, j, v in readers)
    assert abs(theta - at) < 0.5 * grid.dtheta
    assert abs(z - offset) < 0.5 * grid.dz
