"""Compiled nozzle function: isentropic, choked, odd, linear near equilibrium, exact derivatives."""

import numpy as np
import pytest

from film_closed_forms import choked_flux
from reynolds.injector import critical_ratio, nozzle, nozzle_coefficients, nozzle_flux, nozzle_table

AIR = (1.4, 287.05, 293.15)
UP = 6e5


@pytest.fixture(scope="module")
def table():
    """Constants of the nozzle as a loop over injectors keeps them."""
    return nozzle_table(nozzle_coefficients(*AIR), 0)


@pytest.mark.parametrize("kappa", [1.4, 5 / 3, 1.3])
def test_nozzle_is_isentropic_between_choking_and_its_linear_part(kappa):
    """The polynomial is fitted to round-off: 1e-11 leaves room for the ill-conditioned end near r = 1."""
    table = nozzle_table(nozzle_coefficients(kappa, *AIR[1:]), 0)
    ratios = np.linspace(critical_ratio(kappa) * 1.0001, 0.9949, 400)
    flux = [nozzle(UP, r * UP, table)[0] for r in ratios]
    assert flux == pytest.approx(UP * nozzle_flux(ratios, kappa, *AIR[1:]), rel=1e-11)


@pytest.mark.parametrize("ratio", [0.0, 0.1, 0.4, 0.528])
def test_choked_nozzle_passes_what_the_textbook_states(table, ratio):
    """G = 0.0404 P / sqrt(T) kg/(s m^2) for air, whatever the back pressure below .5283 P."""
    flux, d_up, d_down = nozzle(UP, ratio * UP, table)
    assert flux == pytest.approx(choked_flux(UP, 293.15), rel=1e-12)
    assert flux == pytest.approx(0.0404 * UP / np.sqrt(293.15), rel=5e-4)  # .0404 has three digits
    assert (d_up, d_down) == pytest.approx((flux / UP, 0.0), rel=1e-12)


def test_air_chokes_at_its_critical_pressure_ratio():
    assert critical_ratio(1.4) == pytest.approx(0.5283, abs=5e-5)


@pytest.mark.parametrize("ratio", [0.3, 0.7, 0.97, 0.998])
def test_backflow_is_the_flow_of_the_turned_nozzle(table, ratio):
    """Odd, derivatives included, to the last bit."""
    flux, d_up, d_down = nozzle(UP, ratio * UP, table)
    assert nozzle(ratio * UP, UP, table) == (-flux, -d_down, -d_up)


def test_nozzle_is_linear_where_its_root_would_be_singular(table):
    """Above r = .995, through 0 at r = 1, and without a jump where the parts meet."""
    slopes = [nozzle(UP, r * UP, table)[0] / (1 - r) for r in (0.9951, 0.997, 0.999, 0.99999)]
    assert slopes == pytest.approx([slopes[0]] * 4, rel=1e-9)  # 1 - r cancels seven digits at worst
    assert nozzle(UP, UP, table)[0] == 0.0
    below, above = (nozzle(UP, (0.995 + d) * UP, table)[0] for d in (-1e-12, 1e-12))
    assert above == pytest.approx(below, rel=1e-9)


@pytest.mark.parametrize("ratio", [0.2, 0.6, 0.9, 0.99, 0.997, 1.002, 1.2, 2.5])
def test_nozzle_has_true_derivatives(table, ratio):
    """Central differences of 1e-6 of the pressure: truncation is largest near the root, 1e-8 at r = .99."""
    down, step = ratio * UP, 1e-6 * UP
    _, d_up, d_down = nozzle(UP, down, table)
    scale = nozzle(UP, 0.2 * UP, table)[1]
    over_up = (nozzle(UP + step, down, table)[0] - nozzle(UP - step, down, table)[0]) / (2 * step)
    over_down = (nozzle(UP, down + step, table)[0] - nozzle(UP, down - step, table)[0]) / (2 * step)
    assert (d_up, d_down) == pytest.approx((over_up, over_down), rel=1e-6, abs=1e-9 * scale)
