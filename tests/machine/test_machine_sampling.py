"""Sampling rate of a machine: derived from its highest speed, the same motion at any rate, too slow a one refused."""

import numpy as np
import pytest

from refusals import refused
from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.experiments import prbs, steady
from rotorsim.machine import load_machine
from rotorsim.plant import Plant

COARSE = {"grid.n_theta": 16, "grid.n_z": 8}


def test_a_rate_comes_from_the_highest_speed_or_from_the_file():
    rig, turbo = load_machine("dtu_gas_bearing"), load_machine("grooved_turbo_rotor")
    assert rig.sampling_time == 2e-4 and turbo.sampling_time == 2e-5  # 200 krpm: 12 samples a turn and more
    assert turbo.with_({"solver.sampling_rate": 100e3, "solver.time_step": 1e-5}).sampling_time == pytest.approx(1e-5)
    slower = turbo.with_({"drive.highest_speed": 60_000 * np.pi / 30, "solver.time_step": 1e-5})
    assert slower.sampling_time * 60_000 / 60 <= 1 / 12


@pytest.mark.parametrize(
    ("name", "grid"),
    [("plain_rotor", {}), pytest.param("dtu_gas_bearing", COARSE, marks=pytest.mark.slow)],
    ids=["no film", "film"],
)
def test_a_run_is_the_same_at_twice_the_rate(name, grid):
    """Steady running with unbalance: the steps are the same, only every second sample is kept at the slower rate."""
    motions = []
    for rate in (5e3, 10e3):
        machine = load_machine(name).with_(grid | {"solver.sampling_rate": rate, "solver.time_step": 1e-4})
        motions.append(Plant(machine).simulate(0.1, 400.0, 0.5e6 if grid else 0.0)["disc"].values[:: round(rate / 5e3)])
    assert np.ptp(motions[0]) > 1e-6
    np.testing.assert_allclose(motions[1], motions[0], atol=1e-12)


@pytest.mark.slow
def test_a_prbs_keeps_its_clock_at_any_rate():
    shortest = []
    for rate in (5e3, 20e3):
        machine = load_machine("dtu_gas_bearing").with_(
            COARSE | {"solver.sampling_rate": rate, "solver.time_step": 5e-5}
        )
        record = prbs(Plant(machine), 300.0, 0.5e6, duration=2.0)
        assert record.sizes["time"] == pytest.approx(record["time"].values[-1] * rate + 1)
        changes = np.flatnonzero(np.diff(record["reference"].values[:, 0]))
        held = np.diff(record["time"].values[changes])
        assert np.allclose(held / held.min(), np.round(held / held.min()), atol=1e-6)
        shortest.append(held.min())
    assert shortest[0] == pytest.approx(shortest[1], rel=1e-6)


def test_sampling_too_slow_for_the_speed_is_refused_with_the_rate_it_needs():
    machine = load_machine("plain_rotor")
    with refused(DataError, "speed", pytest.approx(100000 * np.pi / 30)):
        steady(Plant(machine), 100_000 * np.pi / 30, 0.0, duration=0.01)
    with pytest.raises(MachineFileError, match="time_step"):
        machine.with_({"solver.sampling_rate": 7e3, "solver.time_step": 0.9e-4})


@pytest.mark.parametrize(("rate", "step"), [(20e3, 2e-5), (7e3, 0.9e-4), (30e3, 3e-5), (20e3, 1.1e-6), (1e3, 0.9)])
def test_the_time_step_that_a_refusal_names_is_accepted(rate, step):
    """A third of 50 us has no nine digits that divide it."""
    machine = load_machine("plain_rotor").with_({"solver.sampling_rate": rate, "solver.time_step": 1 / rate})
    with pytest.raises(MachineFileError) as caught:
        machine.replace("solver.time_step", f"{step!r} s")
    named = caught.value.problems[0].split("'")[-2]
    assert machine.replace("solver.time_step", named).time_step <= max(step, 0.5 / rate)
