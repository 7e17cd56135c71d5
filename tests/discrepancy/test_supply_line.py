"""Supply line in the machine file: regulator pressure from the gauge reading behind the line."""

import numpy as np
import pytest

from rotorsim.analysis.supply import regulator_pressure
from rotorsim.discrepancy.calibration import ParameterPoint
from rotorsim.discrepancy.comparison import TwinComparison
from rotorsim.discrepancy.records import make_trial
from rotorsim.discrepancy.twin import Twin
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from rotorsim.study.identification_vs_physics import physics

SPEED, SUPPLY = 300.0, 0.6e6
DROOP = 1e9
"""Pressure lost per flow [Pa s/kg]: 0.09 MPa of the 87 mg/s that the rig takes."""


@pytest.fixture(scope="module")
def machine():
    """The rig with ideal pins behind a supply line that droops."""
    rig = load_machine("dtu_gas_bearing").replace("actuators.mode", "ideal")
    return rig.replace("effects.supply_droop.droop", f"{DROOP} Pa*s/kg")


@pytest.fixture(scope="module")
def plant(machine):
    return Plant(machine, n_theta=32, n_z=8, dt=2e-4)


@pytest.fixture(scope="module")
def record(plant):
    """One second at the regulator's 0.6 MPa; what a rig would measure."""
    found = plant.simulate(1.0, SPEED, SUPPLY)
    return found[["disc_measured", "angle_measured", "speed_measured", "pressure_measured"]]


def test_the_supply_is_found_again_behind_its_line(plant):
    """The reading at the injectors of the machine gives back the supply at which it was made."""
    flow = plant.equilibrium(SPEED, SUPPLY).mass_flow.sum()
    reading = SUPPLY - DROOP * flow
    assert reading < 0.9 * SUPPLY
    assert regulator_pressure(plant.assembly, SPEED, reading) == pytest.approx(SUPPLY, rel=1e-7)


def test_without_a_line_the_supply_is_the_reading():
    plant = Plant("dtu_gas_bearing", n_theta=32, n_z=8, dt=2e-4)
    assert regulator_pressure(plant.assembly, SPEED, 0.4e6) == 0.4e6


@pytest.mark.slow
def test_a_record_of_a_machine_with_a_droop_agrees_with_its_file(machine, record):
    """Mean, 1X and the rest within the noise of 0.33 um; counted twice the line costs 20 % of the response."""
    twin, trial = Twin(machine, (32, 8), 2e-4, only=("supply_droop",)), make_trial(record)
    assert trial.pressure < 0.9 * SUPPLY
    comparison = TwinComparison(twin, [trial])
    off = np.abs(comparison.measured - comparison.predict(ParameterPoint())).max()
    assert off < 0.1e-6
    lost = twin.run({"supply_droop.0.droop": 2 * DROOP}, trial.used, trial.pressure, trial.angle)[:, 4].mean()
    assert lost < 0.9 * trial.pressure  # a candidate takes from what the gauge reads


def test_physics_next_to_an_identified_model_stands_at_the_pressure_of_its_record(machine, plant):
    """The model of a record is compared with the plant in which the injectors have the pressure of the record."""
    flow = plant.equilibrium(SPEED, SUPPLY).mass_flow.sum()
    at_the_supply = plant.linearise(SPEED, SUPPLY)
    assert physics(plant, SPEED, SUPPLY - DROOP * flow).wn == pytest.approx(at_the_supply.wn[:2], rel=1e-6)
