"""Harmonics of the shaft's speed that keep a controller's references from following the orbit."""

import numpy as np
import pytest
import xarray as xr

import rotorsim as rs
from refusals import refused
from rotorsim.base.errors import ControllerError, DataError
from rotorsim.experiments import ProportionalLaw, WithHarmonics, controlled, harmonics_of, without_orbit
from rotorsim.plant import Plant

SPEED, P = 600.0, 0.6e6


@pytest.fixture(scope="module")
def plant():
    return Plant("dtu_gas_bearing", n_theta=16, n_z=4, dt=2e-4)


def weak(plant):
    """A law on the displacement from the equilibrium."""
    centre = plant.equilibrium(SPEED, P).disc
    return ProportionalLaw(1e5, 0.9e5, centre=(float(centre[0]), float(centre[1])))


def test_harmonics_of_a_made_record_are_found_among_higher_ones():
    t = np.arange(10000) * 2e-4
    a = np.array([[0.5 - 0.2j, 0.1j], [-0.3, 0.05 + 0.4j], [0.2, 0.2j]])
    u = 0.7 + sum((row * np.exp(1j * k * SPEED * t)[:, None]).real for k, row in enumerate(a, 1))
    record = xr.Dataset({"reference": (("time", "axis"), u)}, coords={"time": t + 3.0})
    np.testing.assert_allclose(harmonics_of(record, SPEED, 2), a[:2], atol=1e-9)


def test_added_harmonics_have_the_amplitude_and_the_phase_that_was_given():
    law = WithHarmonics(ProportionalLaw(), SPEED, [[0.5 - 0.2j, 0.1j], [0.0, 0.3]])
    law.check_sampling(2e-4)
    u = np.array([law.step(np.zeros(2), SPEED, P) for _ in range(20000)])
    record = xr.Dataset({"reference": (("time", "axis"), u)}, coords={"time": np.arange(20000) * 2e-4})
    np.testing.assert_allclose(harmonics_of(record, SPEED, 2), law.amplitudes, atol=1e-9)
    assert np.all(u[0] == 0) and np.abs(u[:50]).max() < 0.05  # they come in
    law.reset()
    np.testing.assert_array_equal(law.step(np.zeros(2), SPEED, P), u[0])


def test_references_no_longer_follow_the_orbit_and_the_disc_does(plant):
    law = weak(plant)
    calm = without_orbit(plant, law, SPEED, P)
    before, after = (controlled(plant, one, SPEED, P, 3.0, seed=5) for one in (law, calm))
    moved, left = (np.abs(harmonics_of(one, SPEED, 2)).max() for one in (before, after))
    assert moved > 0.1 and left < 0.1 * moved  # noise of another seed
    assert np.ptp(after["disc"].values[5000:], axis=0).min() > 1e-6
    assert after.attrs["controller"] == "ProportionalLaw" and after.attrs["harmonic_1_x"] > 0
    assert after.attrs["gain_x"] == 1e5


def test_a_record_of_it_is_a_closed_loop_and_repeats_bit_by_bit(plant):
    calm = WithHarmonics(weak(plant), SPEED, [[0.1, 0.1j]])
    dither = rs.experiments.Prbs(amplitude=0.3, duration=0.5)
    one, two = (controlled(plant, calm, SPEED, P, 0.5, excitations=[dither]) for _ in range(2))
    np.testing.assert_array_equal(one["reference"].values, two["reference"].values)
    assert set(np.unique(np.abs(one["reference_external"].values))) <= {0.0, 0.3}


@pytest.mark.slow
def test_a_slow_shaft_takes_longer_trials(plant):
    """Thirty revolutions at 511 rpm are no whole number of samples."""
    calm = without_orbit(plant, ProportionalLaw(1e5, 1e5), 53.5, P, harmonics=1)
    assert 0 < np.abs(calm.amplitudes).max() < 5


def test_where_nothing_follows_an_orbit_nothing_is_added(plant):
    forces = {f"effects.coupling.force_{k}x": 0.0 for k in (2, 3)}
    errors = {f"effects.runout.{name}": 0.0 for name in ("amplitude_1x", "amplitude_2x", "amplitude_3x", "roughness")}
    round_one = Plant(plant.machine.with_({"effects.unbalance.me": 0.0} | forces | errors))
    assert not without_orbit(round_one, ProportionalLaw(1e5, 1e5), SPEED, P).amplitudes.any()


@pytest.mark.slow
def test_a_function_is_a_law_too(plant):
    centre = plant.equilibrium(SPEED, P).disc
    calm = without_orbit(plant, lambda measured, speed, pressure: 1e5 * (measured - centre), SPEED, P, harmonics=1)
    record = controlled(plant, calm, SPEED, P, 3.0, seed=5)
    assert np.abs(harmonics_of(record, SPEED, 1)).max() < 0.05 and record.attrs["controller"] == "function"


class Listening(ProportionalLaw):
    """A law that keeps the references that acted, as it hears of them."""

    heard = ()

    def applied(self, reference):
        self.heard = (*self.heard, np.array(reference))


def test_the_law_hears_of_what_acts_but_for_the_harmonics(plant):
    law = Listening(1e5, 1e5)
    record = controlled(plant, WithHarmonics(law, SPEED, [[0.4, 0.3j]]), SPEED, P, 0.6)
    t = 2e-4 * np.arange(2999)
    added = (np.minimum(t / 0.3, 1.0) * np.exp(1j * SPEED * t))[:, None] * np.array([0.4, 0.3j])
    np.testing.assert_allclose(np.array(law.heard)[1:] + added.real, record["reference"].values[1:], atol=1e-12)


class Wrong:
    """A controller without a step."""


def test_what_makes_no_sense_is_refused_in_a_sentence(plant):
    law = ProportionalLaw()
    for slow in (0.0, -300.0, np.nan, 1.0):
        with refused(DataError, "speed", slow):
            without_orbit(plant, law, slow, P)
    wrong = [{"harmonics": one} for one in (0, 9, "2", True, 1.5)]
    for more in (*wrong, {"trial": 0.0}, {"trial": np.nan}, {"trial": np.inf}, {"trial": 50.0}):
        with refused(DataError, "harmonics" if "harmonics" in more else "trial", next(iter(more.values()))):
            without_orbit(plant, law, SPEED, P, **more)
    for wrong in ([0.1, 0.2], [[np.nan, 0.0]], [[0.1, 0.2, 0.3]], "abc", None):
        with refused(DataError, "amplitudes", wrong):
            WithHarmonics(law, SPEED, wrong)
    with pytest.raises(ControllerError, match="has no such method"):
        WithHarmonics(Wrong(), SPEED, [[0.1, 0.2]])
    with pytest.raises(ControllerError, match="the plant samples every"):
        WithHarmonics(ProportionalLaw(low_pass=100.0, Ts=1e-3), SPEED, [[0.1, 0.2]]).check_sampling(2e-4)


def test_a_law_at_its_range_is_refused_with_what_is_left(plant):
    """So high a gain swings from one end of the range to the other."""
    with refused(DataError, "controller", lambda share: 0 < share <= 1):
        without_orbit(plant, ProportionalLaw(2e6, 2e6), SPEED, P)


class Fickle(ProportionalLaw):
    """A law that is another one in every run."""

    def reset(self):
        super().reset()
        self.gain_x = -self.gain_x


@pytest.mark.slow
def test_harmonics_that_stay_are_refused_with_what_is_left(plant):
    with refused(DataError, "controller", lambda left: left > 0):
        without_orbit(plant, Fickle(2e4, 2e4, centre=tuple(plant.equilibrium(SPEED, P).disc)), SPEED, P)
