"""Periodic initial motion of a record: omitted for an unstable rotor, even where numbers overflow."""

import numpy as np
import pytest

from rotorsim.discrepancy.hidden_machine import unshaken
from rotorsim.discrepancy.twin import Twin, in_motion
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from rotorsim.plant.equilibrium import settle

pytestmark = pytest.mark.numerical


@pytest.mark.parametrize("coupling", ["100 MN/m"])
def test_a_rotor_that_whirls_away_begins_at_rest(coupling):
    """Cross coupling grows by e^(100 t) and faster: beyond the range of numbers within a turn at 2 rad/s."""
    machine = load_machine("plain_rotor")
    for k in range(2):
        machine = machine.replace(f"bearings.{k}.kxy", coupling).replace(f"bearings.{k}.kyx", f"-{coupling}")
    a = Plant(machine).assembly
    w = settle(a, 2.0, 0.0)
    np.testing.assert_array_equal(in_motion(a, w.copy(), 2.0, 0.0), w)


def test_a_machine_that_is_shaken_at_random_has_no_period_and_the_twin_of_a_diagnosis_is_not_shaken():
    """Its records are whole runs from the motion without the random forces; simulated means leave these out."""
    machine = load_machine("plain_rotor").replace("effects.broadband_force", [{"density": "1e-3 N^2/Hz"}, {}])
    machine = machine.replace("effects.speed_wander.sd", 0.01)
    hidden, plain = Twin(machine, scatter=True), Twin(load_machine("plain_rotor"), scatter=True)
    assert unshaken(hidden, {}) == {"broadband_force.0.density": 0.0, "speed_wander.0.sd": 0.0}
    assert unshaken(hidden, {"speed_wander.0.sd": 0.0}) == {"broadband_force.0.density": 0.0}
    assert unshaken(plain, {}) == {}
    assert not {"broadband_force", "speed_wander"} & {*Twin(machine).equipped[0].effects, *Twin(machine).slots}


def test_the_motion_found_repeats_from_turn_to_turn(machine, truth_plant):
    """At 40 Hz a turn is 125 samples; a start at rest would beat for a minute (damping ratio 0.002 at 44 Hz)."""
    rows = np.zeros((1000, 6))
    rows[:, 0] = 2 * np.pi * 40
    y = truth_plant.run({}, rows, 0.0, turning=True)[:, :2]
    np.testing.assert_allclose(y[-125:], y[:125], atol=1e-3 * np.ptp(y))
    assert np.ptp(y[:125], axis=0) == pytest.approx(np.ptp(y[:125, 0]), rel=0.01)  # a circle
