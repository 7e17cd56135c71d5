"""One implicit stage with prescribed right-hand side: slot flow and a manufactured solution."""

import numpy as np
import pytest

from film_closed_forms import slot_flow, slot_pressure
from reynolds import kernels
from reynolds.grid import cells

MU, PA, RT = 1.85e-5, 101325.0, 287.05 * 293.15


def solve_stage(film, stored, iadt, journal=(0.0, 0.0), surface_speed=0.0):
    """Nodal pressures for the stage  (p h - stored) iadt + div flux = 0  with the journal held in place."""
    layout, w, ix = film.model.build()
    w[layout.m_rhs + cells(layout)] = stored
    w[layout.journal_a : layout.journal_a + 4] = (1.0, 0.0, 0.0, 1.0)
    for place in (layout.journal, layout.journal_rhs):
        w[place : place + 2] = journal
    constants = film.model.record()[0]
    assert kernels.stage_solve(w, ix, constants, layout, surface_speed, iadt, 1e-12, True) > 0
    return w[layout.p + cells(layout)]


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("pressure", [1.2e5, 3e5, 8e5])
def test_film_fed_along_its_midplane_is_a_slot_to_either_side(plain, symmetric, pressure):
    """p^2 is linear in z, which central differences of p^2 reproduce; 1e-12 is rounding.

    The feed is the slots' flow: so its closed form is tested as well. iadt = 1e-12 1/s makes the storage
    nothing.
    """
    film = plain(16, 8, symmetric=symmetric)
    grid, iadt = film.model.grid, 1e-12
    flow = 2 * slot_flow(2 * np.pi * 0.02, 25e-6, 0.02, pressure, PA, MU, 287.05, 293.15)
    middle = np.isclose(grid.row_z, 0.0)
    source = np.where(middle, flow * RT / (grid.n_theta * grid.dy * grid.dz), 0.0)
    p = solve_stage(film, source / iadt, iadt)
    expected = [slot_pressure(abs(z), 0.02, pressure, PA) for z in grid.row_z]
    assert p == pytest.approx(np.broadcast_to(expected, p.shape), rel=1e-12)


def manufactured(film, journal, surface_speed):
    """Pressure and div flux at the nodes for a p^2 that varies in theta and z and is ambient at the edges."""
    grid = film.model.grid
    th, z = np.meshgrid(grid.theta, grid.row_z, indexing="ij")
    X, Y = journal
    h, h_th = 25e-6 - X * np.cos(th) - Y * np.sin(th), X * np.sin(th) - Y * np.cos(th)
    k, skew = np.pi / film.length, 0.0 if grid.half else 0.3
    across = np.cos(k * z) + skew * np.sin(2 * k * z)
    across_zz = -(k**2) * np.cos(k * z) - 4 * k**2 * skew * np.sin(2 * k * z)
    wave = 0.5 * np.exp(1j * (th - 0.7))
    around, around_th, around_thth = 1 + wave.real, -wave.imag, -wave.real
    q = PA**2 * (1 + 0.6 * around * across)
    q_th, q_thth = 0.6 * PA**2 * around_th * across, 0.6 * PA**2 * around_thth * across
    q_zz = 0.6 * PA**2 * around * across_zz
    p = np.sqrt(q)
    shear = surface_speed / 2 * (q_th / (2 * p) * h + p * h_th) / film.radius
    theta = (3 * h**2 * h_th * q_th + h**3 * q_thth) / (24 * MU * film.radius**2)
    return p, h, shear - theta - h**3 * q_zz / (24 * MU)


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("iadt", [1e-9, 1e4])
def test_manufactured_film_converges_at_second_order(plain, order, symmetric, iadt):
    """Steady and with storage, on half and on full bearings; 2.0 +- 0.1 in the largest and the rms error.

    At 12 m/s the cell number stays below 2 on every grid, so no upwind blend acts.
    """
    grids, journal, U = ((16, 8), (32, 16), (64, 32), (128, 64)), (10e-6, -5e-6), 12.0
    largest, rms = [], []
    for n in grids:
        film = plain(*n, symmetric=symmetric)
        p, h, divergence = manufactured(film, journal, U)
        error = (solve_stage(film, p * h + divergence / iadt, iadt, journal, U) - p) / PA
        largest.append(np.abs(error).max())
        rms.append(np.sqrt(np.mean(error**2)))
    assert order([n for n, _ in grids], largest) == pytest.approx(2.0, abs=0.1)
    assert order([n for n, _ in grids], rms) == pytest.approx(2.0, abs=0.1)
    assert largest[-1] < 2e-4
