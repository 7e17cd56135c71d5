"""Diagnosis of a plain rotor from run-up vectors: order tracking, and a hidden effect found."""

import numpy as np
import pytest

from identification import make_vectors
from rotorsim.base.errors import DataError
from rotorsim.discrepancy import diagnose
from rotorsim.discrepancy.blind_test.hide import draw
from rotorsim.discrepancy.runup_diagnosis import RATE, make_sweeps, ramp, simulated, track

SPEEDS = 2 * np.pi * np.arange(8.0, 38.0, 1.0)


def table(amplitude, phase, **attrs):
    return make_vectors(SPEEDS, amplitude, phase, (1, 2, 3), attrs)


def test_orders_of_a_run_up_are_tracked_with_their_phase():
    speed = ramp(SPEEDS, RATE, 0.0)[:, 0]
    angle = 0.3 + np.concatenate([[0.0], np.cumsum(speed)[:-1] * 2e-4])
    y = 1e-6 * np.column_stack([2 * np.cos(angle - 0.5), 3 * np.cos(2 * angle + 1.0)])
    found = track(y, speed, 0.3, SPEEDS, (1, 2))
    n = len(SPEEDS)
    np.testing.assert_allclose(found[0, 0, 1 : 1 + n], 2e-6 * np.exp(-0.5j), rtol=1e-6)
    np.testing.assert_allclose(found[0, 1, 1 + n :], 3e-6 * np.exp(1j), rtol=1e-6)


def test_every_row_of_a_table_belongs_to_one_role():
    shape = (len(SPEEDS), 3, 2)
    parts = make_sweeps(table(np.ones(shape) * 1e-6, np.zeros(shape)), "t", False)
    assert [p.role for p in parts] == ["fit", "held_out", "untouched"]
    assert sorted(np.concatenate([p.speeds for p in parts])) == pytest.approx(SPEEDS)


def test_vectors_of_a_gas_bearing_need_a_pressure():
    shape = (len(SPEEDS), 3, 2)
    with pytest.raises(DataError, match="need its pressure"):
        make_sweeps(table(np.ones(shape), np.zeros(shape)), "t", True)


@pytest.mark.slow
def test_a_hidden_force_is_found_in_vectors_alone(machine, truth_plant, rng):
    truth = draw(truth_plant, ["coupling.force_2x"], 8, (3.0, 6.0))
    empty = np.zeros((len(SPEEDS), 3, 2))
    fast = 2 * np.pi * 6.0
    parts = make_sweeps(table(empty, empty, rate=fast), "t", False)
    vectors = np.zeros((len(SPEEDS), 3, 2), complex)
    for part in parts:
        own = np.isin(SPEEDS, part.speeds)
        lines = simulated(truth_plant, part, truth.point)[0, :, 1:].reshape(2, 3, -1)
        vectors[own] = lines.transpose(2, 1, 0)
    vectors += 2e-9 * (rng.normal(size=vectors.shape) + 1j * rng.normal(size=vectors.shape))
    given = table(np.abs(vectors), -np.angle(vectors), rate=fast)
    found = diagnose(machine, [given], effects=["coupling", "runout", "shaft_bow"])
    assert found.status in ("named", "tie")
    assert "coupling.force_2x" in [f.form for f in found.effects]
