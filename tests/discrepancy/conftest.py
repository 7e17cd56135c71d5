"""Plain rotor with few candidate effects and its records with hidden effects, for fast whole diagnoses."""

from dataclasses import replace

import numpy as np
import pytest

from rotorsim.discrepancy.calibration import GRID, CompiledModels
from rotorsim.discrepancy.experiments import campaign
from rotorsim.discrepancy.hidden_machine import HiddenTruth, draw, record_of
from rotorsim.discrepancy.twin import Twin
from rotorsim.machine import load_machine

NOISE, FINE = 1e-7, 5e-5
"""Scatter of the readings [m] and step of the records [s]."""
EFFECTS = ("coupling", "runout", "shaft_bow")
KEPT = ("fit_1", "fit_2", "fit_3", "fit_5", "fit_2_repeat", "held_out_1", "held_out_2", "untouched_2", "untouched_4")


@pytest.fixture(scope="session")
def machine():
    """The plain rotor."""
    return load_machine("plain_rotor")


@pytest.fixture(scope="session")
def models(machine):
    """Twins with few candidates."""
    return CompiledModels.of(machine, EFFECTS)


@pytest.fixture(scope="session")
def truth_plant(machine):
    """The finer plant that records come from: the kernels of the workshop, a quarter of its step."""
    return Twin(machine, GRID, FINE, only=tuple(sorted(EFFECTS)))


@pytest.fixture(scope="session")
def recorded(machine, truth_plant):
    """Records with effects hidden, and the truth."""

    def record(effects=(), seed=0, sizes=(3.0, 6.0), disturb=None) -> tuple[list, HiddenTruth]:
        truth = draw(truth_plant, effects, seed, sizes)
        plan = [replace(p, experiment=replace(p.experiment, hits=1)) for p in campaign(machine) if p.name in KEPT]
        records = [record_of(truth_plant, p, truth.point, seed, disturb) for p in plan]
        for i, r in enumerate(records):
            noise = np.random.default_rng([seed, i]).normal(0, NOISE, r.disc_measured.shape)
            r["disc_measured"] = r.disc_measured.copy(data=r.disc_measured.values + noise)
        return records, truth

    return record


@pytest.fixture
def rng():
    """Random numbers that are the same in every run."""
    return np.random.default_rng(5)
