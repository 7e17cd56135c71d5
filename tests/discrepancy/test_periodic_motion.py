"""Periodic initial motion of a record: omitted for an unstable rotor, even where numbers overflow."""

import numpy as np
import pytest

from rotorsim.discrepancy.twin.periodic_motion import in_motion
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
