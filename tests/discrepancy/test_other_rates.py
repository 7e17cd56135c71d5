"""Diagnosis of a machine that is sampled at another rate than 5 kHz: its twin has that of the records."""

from dataclasses import replace

import numpy as np
import pytest

from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.discrepancy.records import check_turns, make_trial, make_trials
from rotorsim.discrepancy.twin import Twin
from rotorsim.experiments import steady
from rotorsim.machine import load_machine
from rotorsim.plant import Plant

SPEED = 300.0


@pytest.fixture(scope="module")
def record():
    return steady(Plant("plain_rotor"), SPEED, 0.0, duration=2.0)


@pytest.mark.slow
def test_the_twin_of_a_fast_machine_runs_at_the_rate_of_the_records(record):
    plain = load_machine("plain_rotor")
    fast = plain.with_({"solver.sampling_rate": 20e3, "solver.time_step": 5e-5})
    twin, own = Twin(fast, (32, 8)), Twin(plain, (32, 8))
    assert twin.equipped[0].sampling_time == 2e-4 and own.equipped[0].solver.sampling_rate is None
    assert twin.equipped[0].time_step == pytest.approx(1e-4) and own.equipped[0].time_step == 2e-4
    trial = make_trials(fast, [("steady", record)], "fit")[0]
    rows = trial.used[:4000]
    both = [t.run({}, rows, 0.0, trial.angle, turning=True) for t in (twin, own)]
    swing = np.ptp(both[1][-1000:, :2], axis=0)
    assert np.abs(both[0] - both[1])[:, :2].max() < 0.02 * swing.max()


def test_records_at_the_machine_s_own_rate_are_refused_with_the_way_out():
    fast = load_machine("plain_rotor").with_({"solver.sampling_rate": 20e3, "solver.time_step": 5e-5})
    with refused(DataError, "Ts", pytest.approx(5e-5)):
        make_trial(steady(Plant(fast), SPEED, 0.0, duration=1.0))


def test_a_shaft_too_fast_for_the_rate_of_a_diagnosis_is_refused(record):
    trial = make_trial(record)
    rows = trial.rows.copy()
    rows[:, 0] = 10000.0
    quick = replace(trial, rows=rows)
    with refused(DataError, "speed", 10000.0):
        check_turns(quick)
