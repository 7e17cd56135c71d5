"""Diagnosis of a plain rotor from run-up vectors: order tracking, and a hidden effect found."""

import numpy as np
import pytest

from identification import make_vectors
from rotorsim.base.errors import DataError
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.discrepancy import diagnose
from rotorsim.discrepancy.calibration import contributions, setting
from rotorsim.discrepancy.data_vector import repeat_scatter
from rotorsim.discrepancy.hidden_machine import draw
from rotorsim.discrepancy.run_ups import RATE, make_sweeps, order_vectors, ramp, rate_notes, track
from rotorsim.discrepancy.twin import Twin
from rotorsim.machine import load_machine
from rotorsim.plant.kernels.layout import READ
from rotorsim.plant.simulation import AT, Simulation, settle

SPEEDS = 2 * np.pi * np.arange(8.0, 38.0, 1.0)


def simulated(twin, sweep, values):
    """Vectors (1, 2, 1 + orders x rows) [m] that a twin makes of a table's speeds."""
    own = setting(twin, contributions(values, sweep.speed, sweep.pressure, sweep.changes))
    return sweep.lines(twin.run(own, sweep.rows, sweep.pressure)[:, :2])


def table(amplitude, phase, **attrs):
    return make_vectors(SPEEDS, amplitude, phase, (1, 2, 3), attrs)


def test_orders_of_a_run_up_are_tracked_with_their_phase():
    speed = ramp(SPEEDS, RATE, 0.0)[:, 0]
    before = np.concatenate([speed[:1], speed[:-1]])
    angle = 0.3 + np.concatenate([[0.0], np.cumsum((before[1:] + before[:-1]) / 2)]) * RIG_SAMPLE
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


def test_the_floor_of_vectors_is_the_scatter_of_neighbouring_rows_and_not_the_misfit(rng):
    """A smooth misfit of 20 um, 0.1 um of scatter: second differences of noise have six times its square."""
    shape = (len(SPEEDS), 3, 2)
    noise = 1e-7 * (rng.normal(size=shape) + 1j * rng.normal(size=shape))
    bump = 20e-6 * np.exp(-(((SPEEDS - 150) / 120) ** 2))[:, None, None] + noise
    trials = make_sweeps(table(np.abs(bump), -np.angle(bump), rate=10.0), "t", False)[:1]
    scatter, _, _, known = repeat_scatter(trials, [t.spectra for t in trials])
    assert not known
    assert 0.3e-7 < np.median(scatter[0, :, 1:]) < 3e-7


def test_a_stated_accuracy_makes_the_floor_known():
    shape = (len(SPEEDS), 3, 2)
    trials = make_sweeps(table(np.ones(shape) * 1e-6, np.zeros(shape), accuracy=5e-7), "t", False)[:1]
    scatter, _, _, known = repeat_scatter(trials, [t.spectra for t in trials])
    assert known
    np.testing.assert_array_equal(scatter[0, :, 1:5], 5e-7)


@pytest.mark.parametrize(("name", "value"), [("accuracy", -1.0), ("accuracy", "good"), ("rate", 0.0), ("rate", "fast")])
def test_an_accuracy_or_rate_that_is_none_is_refused(name, value):
    shape = (len(SPEEDS), 3, 2)
    with pytest.raises(DataError, match=f"{name} is"):
        make_sweeps(table(np.ones(shape) * 1e-6, np.zeros(shape), **{name: value}), "t", False)


def test_a_ramp_rate_that_is_assumed_is_noted():
    shape = (len(SPEEDS), 3, 2)
    empty = np.zeros(shape)
    assert "120 rpm/s is assumed" in rate_notes([("t", table(empty, empty))])[0]
    assert not rate_notes([("t", table(empty, empty, rate=24.0))])


@pytest.mark.slow
def test_run_up_vectors_without_a_stated_accuracy_are_never_free_of_disagreement(machine, truth_plant):
    parts = make_sweeps(table(np.zeros((len(SPEEDS), 3, 2)), np.zeros((len(SPEEDS), 3, 2)), rate=40.0), "t", False)
    vectors = np.zeros((len(SPEEDS), 3, 2), complex)
    for part in parts:
        lines = simulated(truth_plant, part, {})[0, :, 1:].reshape(2, 3, -1)
        vectors[np.isin(SPEEDS, part.speeds)] = lines.transpose(2, 1, 0)
    given = table(np.abs(vectors), -np.angle(vectors), rate=40.0)
    found = diagnose(machine, [given], effects=["coupling"])
    assert found.status == "unknown" and any("how exact" in note for note in found.notes)
    assert any("neighbouring rows" in note for note in found.notes)
    stated = diagnose(machine, [given.assign_attrs(accuracy=1e-7)], effects=["coupling"])
    assert stated.status == "no_disagreement"


@pytest.mark.slow
def test_a_hidden_force_is_found_in_vectors_alone(machine, truth_plant, rng):
    truth = draw(truth_plant, ["coupling.force_2x"], 8, (3.0, 6.0))
    empty = np.zeros((len(SPEEDS), 3, 2))
    fast = 2 * np.pi * 6.0
    parts = make_sweeps(table(empty, empty, rate=fast), "t", False)
    vectors = np.zeros((len(SPEEDS), 3, 2), complex)
    for part in parts:
        own = np.isin(SPEEDS, part.speeds)
        lines = simulated(truth_plant, part, truth.point.values)[0, :, 1:].reshape(2, 3, -1)
        vectors[own] = lines.transpose(2, 1, 0)
    vectors += 2e-9 * (rng.normal(size=vectors.shape) + 1j * rng.normal(size=vectors.shape))
    given = table(np.abs(vectors), -np.angle(vectors), rate=fast)
    found = diagnose(machine, [given], effects=["coupling", "runout", "shaft_bow"])
    assert found.status in ("named", "tie")
    assert "coupling.force_2x" in [f.form for f in found.effects]


def test_vectors_of_the_twin_belong_to_the_angle_of_its_shaft():
    """A ramp of 5 s: angles of steps in place of the plant's straight ramps lag by 1e-4 s times the speed gained."""
    twin = Twin(load_machine("plain_rotor"))
    rows = np.zeros((25_000, 6))
    rows[:, 0] = 50 + 40.0 * RIG_SAMPLE * np.arange(1, len(rows) + 1)
    a = twin.set({})
    run = Simulation(a, settle(a, rows[0, 0], 0.0)).advance(rows)
    angle, disc = np.unwrap(run[:, AT["angle"]]), run[:, READ : READ + 2]
    speeds = np.array([100.0, 180.0, 240.0])
    found = track(disc, rows[:, 0], float(angle[0]), speeds, (1,))[0, :, 1:]
    for k, speed in enumerate(speeds):
        centre = int(np.searchsorted(run[:, AT["speed"]], speed))
        half = int(8 * np.pi / speed / RIG_SAMPLE)
        own = slice(centre - half, centre + half)
        assert found[:, k] == pytest.approx(order_vectors(angle[own], disc[own], (1,), False)[0], rel=1e-6)
