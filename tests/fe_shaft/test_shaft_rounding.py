"""Rounding in shaft analyses: undamped rotors not unstable, rigid-body modes not oscillating, units irrelevant."""

import numpy as np
import pytest

from fe_shaft import BearingElement, DiskElement, Rotor, ShaftElement, modal
from fe_shaft.campbell import run_campbell
from fe_shaft.critical import run_critical_speed, run_stability, run_ucs
from fe_shaft.shaft import ShaftError
from refusals import refused

pytestmark = pytest.mark.numerical
SPEEDS = np.linspace(0, 5000, 6)


def rotor(n, bearings=(), length=1.0, diameter=0.05):
    """`n` equal elements with a disc in the middle."""
    shaft = [ShaftElement(length / n, 0.0, diameter) for _ in range(n)]
    return Rotor(shaft, [DiskElement(n // 2, 10.0, 0.05, 0.1)], list(bearings))


def on_ends(n, k, c=0.0):
    return rotor(n, [BearingElement(0, k, c), BearingElement(n, k, c)])


@pytest.mark.parametrize(
    ("n", "k"), [(4, 1e3), *(pytest.param(*case, marks=pytest.mark.slow) for case in ((10, 1e3), (30, 1e3), (10, 1e6)))]
)
def test_an_undamped_rotor_is_neither_damped_nor_unstable(n, k):
    """Fine elements on soft bearings: of ten elements the largest eigenvalue is 1e5 times the lowest."""
    found = run_stability(on_ends(n, k), SPEEDS)
    assert np.isnan(found.onset)
    assert np.abs(found.log_dec).max() < 1e-12
    assert np.nanmax(np.abs(run_campbell(on_ends(n, k), SPEEDS[:3]).damping_ratio)) < 1e-12


def test_the_onset_of_a_fine_shaft_in_soft_bearings_is_that_of_a_coarse_one():
    """Cross coupling of k c, as of a plain bearing: onset where it exceeds c wn."""

    def onset(n):
        bearings = [BearingElement(at, 1e3, 1e-3, kxy=0.01, kyx=-0.01) for at in (0, n)]
        return run_stability(rotor(n, bearings), np.array([0.0, 1.0, 2.0])).onset_frequency

    assert onset(20) == pytest.approx(onset(2), rel=1e-4)


@pytest.mark.parametrize(("n", "length", "diameter"), [(6, 5.0, 0.05), (7, 0.5, 0.2), (30, 0.5, 0.2)])
def test_a_free_shaft_at_rest_has_only_its_bending_modes(n, length, diameter):
    free = rotor(n, length=length, diameter=diameter)
    rng = np.random.default_rng(n)
    M, D, K = modal.free_matrices(free, 0.0)
    for _ in range(10):  # other coordinates, other rounding
        turn = rng.permutation(len(M))
        values, _ = modal.oscillations(*(X[np.ix_(turn, turn)] for X in (M, D, K)))
        assert np.abs(values).min() == pytest.approx(
            modal.run_modal(rotor(4, (), length, diameter), 0.0).wn[0], rel=0.1
        )


@pytest.mark.parametrize("bearings", [[], [BearingElement(2, 1e3, 0.0)]])
def test_a_shaft_that_is_free_to_move_keeps_its_critical_speeds(bearings):
    """The bending mode of a free shaft, 1140 rad/s at rest, meets the speed there; a soft bearing hardly moves it."""
    found = run_critical_speed(rotor(8, bearings), limit=3000.0)
    forward = found.wn[found.whirl == "forward"]
    assert np.any(np.abs(forward / 1148 - 1) < 0.01)


@pytest.mark.parametrize("n", [4, 20])
def test_critical_speeds_over_stiffness_want_bearings_at_two_nodes(n):
    one = rotor(n, [BearingElement(n // 3, 1e6, 0.0)])
    with refused(ShaftError, "bearings"):
        run_ucs(one, num=2)


@pytest.mark.parametrize("seed", range(4))
def test_units_do_not_affect_what_oscillates(seed):
    """Coordinates in units of 1e-6 to 1e6: the same modes, damping to rounding."""
    rng = np.random.default_rng(seed)
    system = modal.free_matrices(on_ends(6, 1e4, 2.0), 300.0)
    unit = 10.0 ** rng.uniform(-6, 6, len(system[0]))
    here, _ = modal.oscillations(*system)
    there, _ = modal.oscillations(*(X * unit * unit[:, None] for X in system))
    np.testing.assert_allclose(there[:4], here[:4], rtol=1e-8)


def test_a_bearing_stiffness_below_zero_diverges_where_it_passes_zero():
    """A stiff shaft of mass m on two springs k < 0 falls away at the rate s of m s^2 + 2 c s + 2 k = 0.

    A free shaft, whose double zeros are split by rounding, does not.
    """
    c, speeds = 50.0, np.array([0.0, 100.0, 200.0])
    k = 1e5 - 1.1e3 * speeds
    shaft = rotor(4, [BearingElement(at, k, c, frequency=speeds) for at in (0, 4)], diameter=0.2)
    found = run_stability(shaft, speeds)
    assert found.onset == pytest.approx(1e5 / 1.1e3, rel=1e-5) and found.onset_frequency == 0
    assert np.isfinite(found.log_dec[0]) and np.all(found.log_dec[1:] == -np.inf)
    m = shaft.M()[::4, ::4].sum()
    rate = -c / m + np.sqrt((c / m) ** 2 - 2 * k[-1] / m)
    tilts = shaft.run_modal(200.0).divergence
    assert tilts >= rate * (1 - 1e-3)
    alone = run_stability(rotor(4, [BearingElement(2, -1e4, c)], diameter=0.2), speeds)
    assert alone.onset == 0.0
    assert np.isnan(run_stability(rotor(7, length=0.5, diameter=0.2), speeds).onset)
