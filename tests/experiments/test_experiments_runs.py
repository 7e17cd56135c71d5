"""Experiments on a plant: streamed and in memory, block sizes, open and closed loop."""

import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

import rotorsim as rs
from identification import validate
from refusals import refused
from rotorsim import experiments as ex
from rotorsim.base.errors import ControllerError, ConvergenceError, DataError
from rotorsim.experiments.summary import summarise_experiment

RPM = np.pi / 30
P = 0.6e6
SHORT = [
    ex.Runup(0.0, 30.0, 100.0, P),
    ex.Coastdown(100.0, 99.99, None, P, longest=0.5),
    ex.Coastdown(100.0, 80.0, 100.0, P),
    ex.Steady(100.0, P, 0.3),
    ex.SlowRoll(200.0, P, 3),
    ex.Staircase(0.0, P, "both", 1.0, 0.5, 0.03),
    ex.Prbs(100.0, P, 0.5, 0.3, 0.1),
    ex.Chirp(100.0, P, 0.5, 10.0, 200.0, 0.3),
    ex.Multisine(100.0, P, 0.5, 10.0, 200.0, 0.1, 3),
    ex.Impact(100.0, P, 5.0, hits=2, spacing=0.1),
    ex.Shock(100.0, P, 20.0, lead=0.02, rest=0.1),
    ex.Controlled(
        100.0, P, 0.2, 0.1, 0.0, ex.ProportionalLaw(), (ex.Prbs(amplitude=0.2, bias=0.0), ex.Impact(lead=0.05))
    ),
]


@pytest.fixture(scope="module")
def plant():
    return rs.Plant("dtu_gas_bearing", n_theta=16, n_z=4, dt=2e-4)


@pytest.fixture(scope="module")
def rotor():
    return rs.Plant("plain_rotor", dt=2e-4)


def assert_same_bits(a, b):
    names = set(a.data_vars) - {"film_pressure", "snapshot_time", "snapshot_speed"}
    assert names == set(b.data_vars) - {"film_pressure", "snapshot_time", "snapshot_speed"}
    for name in names | {"time"}:
        assert np.array_equal(a[name].values, b[name].values), name


@pytest.mark.parametrize("experiment", SHORT, ids=lambda e: e.name)
def test_streamed_in_memory_and_in_blocks_of_any_size_the_bits_are_the_same(plant, experiment, tmp_path):
    memory = ex.run(plant, experiment, seed=4)
    outcome = ex.record(plant, experiment, tmp_path / "run.nc", seed=4, block=333)
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as streamed:
        assert_same_bits(validate(memory), validate(streamed))
        assert streamed.attrs["ended"] == "complete" and streamed.sizes["snapshot"] > 1
        for name, value in experiment.attrs().items():
            assert memory.attrs[name] == value and streamed.attrs[name] == value
    assert outcome.complete and outcome.samples == memory.sizes["time"]


def test_a_coast_down_ends_with_the_first_sample_at_or_below_its_stop(plant):
    made = rs.experiments.coastdown(plant, 100.0, 99.9, pressure=P)
    speed = made["speed"].values
    assert speed[-1] <= 99.9 < speed[-2] and np.all(np.diff(speed) < 0)


def test_a_declared_coast_down_is_a_ramp(plant):
    made = rs.experiments.coastdown(plant, 100.0, 90.0, rate=50.0, pressure=P)
    assert made["speed"].values == pytest.approx(np.linspace(100, 90, 1001)[:-1])


def test_functions_and_parameter_tables_agree(plant):
    by_name = rs.experiments.prbs(plant, 100.0, P, amplitude=0.5, duration=0.3, bias=0.1, seed=9)
    assert_same_bits(by_name, ex.run(plant, ex.Prbs(100.0, P, 0.5, 0.3, 0.1), 9))


def test_a_run_up_takes_a_pressure_that_changes(plant):
    made = rs.experiments.runup(plant, 0.0, 20.0, 100.0, pressure=lambda t: 0.5e6 + 1e5 * t)
    assert made["pressure"].values[-1] > 0.51e6 and made.attrs["stop_speed"] == 20.0


def test_the_force_of_a_hit_is_in_the_record_and_moves_the_disc(rotor):
    """Just after a short hit J on a modal mass m the disc moves at J/m; m of mid-span is disc and half the shaft."""
    made = rs.experiments.impact(rotor, peak=10.0, width=4e-4, lead=0.02, spacing=0.1)
    assert made["disc_force"].values[:, 0].sum() * 2e-4 == pytest.approx(2 * 10 * 4e-4 / np.pi)
    x = made["disc"].values[:, 0]
    assert np.ptp(x[:100]) < 1e-9 < 1e-6 < np.ptp(x[100:])


class Counts:
    """Gives 0.01, 0.02, 0.03 ... V and keeps what it saw."""

    def __init__(self):
        self.seen = []

    def reset(self):
        self.seen.clear()

    def step(self, measured, speed, pressure):
        self.seen.append((*measured, speed, pressure))
        return 0.01 * len(self.seen), -0.01 * len(self.seen)


def test_a_controller_acts_exactly_one_sample_after_what_it_saw(plant):
    law = Counts()
    for _ in range(2):  # the second time it was reset
        made = rs.experiments.controlled(plant, law, 100.0, P, duration=0.02, bias=(0.5, 0.0))
    reference = made["reference"].values
    assert reference[:, 0] == pytest.approx(0.5 + 0.01 * np.arange(100))
    assert reference[:, 1] == pytest.approx(-0.01 * np.arange(100))
    assert np.all(made["reference_external"].values == [0.5, 0.0])
    seen = np.array(law.seen)
    assert len(seen) == 100
    assert np.array_equal(seen[:, :2], made["disc_measured"].values)
    assert seen[:, 3] == pytest.approx(P, rel=0.05)


def test_the_closed_loop_is_that_of_the_plant(plant):
    centre = tuple(plant.equilibrium(100.0, P).disc)
    ours = rs.experiments.controlled(plant, ex.ProportionalLaw(1e5, 1e5, centre=centre), 100.0, P, duration=0.1)
    theirs = plant.simulate(0.1, 100.0, P, controller=ex.ProportionalLaw(1e5, 1e5, centre=centre))
    assert np.array_equal(ours["disc"].values, theirs["disc"].values)


class Strong:
    def step(self, measured, speed, pressure):
        return 3.0, -9.0


def test_the_total_reference_stops_at_the_range_of_the_actuators(plant):
    made = rs.experiments.controlled(plant, Strong(), 0.0, P, duration=0.01, bias=(4.0, 0.0))
    assert np.all(made["reference"].values[1:] == [5.0, -5.0])


def test_the_total_reference_stops_at_the_range_of_weaker_actuators():
    weak = rs.Plant(
        rs.load_machine("dtu_gas_bearing").replace("actuators.reference_limit", "2 V"), n_theta=16, n_z=4, dt=2e-4
    )
    made = rs.experiments.controlled(weak, Strong(), 0.0, P, duration=0.01)
    assert np.all(made["reference"].values[1:] == [2.0, -2.0])
    assert summarise_experiment(made)["saturated_samples"] == made.sizes["time"] - 1


def test_the_thesis_law_damps_a_hit_and_its_opposite_does_not():
    """Thesis section C.5: positive feedback; 12 ms after the hit less than a third of the swing is left."""
    machine = rs.load_machine("dtu_gas_bearing").replace("effects.noise.sigma", "0 um")
    for part in ("amplitude_1x", "amplitude_2x", "amplitude_3x", "roughness"):
        machine = machine.replace(f"effects.runout.{part}", "0 um")
    plant = rs.Plant(machine, n_theta=16, n_z=4, dt=2e-4)
    centre = tuple(plant.equilibrium(0.0, P).disc)

    def swing(gain):
        law = ex.ProportionalLaw(gain, 0.88 * gain, centre=centre)
        made = rs.experiments.controlled(plant, law, 0.0, P, 0.2, excitations=[ex.Impact(peak=3.0, angle=np.pi / 4)])
        return np.ptp(made["disc"].values[560:620], axis=0)

    assert np.all(swing(0.25e6) < swing(0.0) / 3)
    assert np.all(swing(-0.25e6) > 2 * swing(0.0))


class Fails(ex.Steady):
    """Steady running with a force beyond all numbers after 700 samples."""

    def rows(self, first, count):
        rows = self.held(count)
        rows[first + np.arange(count) >= 700, 4] = 1e300
        return rows


def test_a_step_without_solution_keeps_what_was_simulated(plant, tmp_path):
    with pytest.raises(ConvergenceError):
        ex.run(plant, Fails(0.0, P, 0.5))
    outcome = ex.record(plant, Fails(0.0, P, 0.5), tmp_path / "run.nc", block=500)
    assert not outcome.complete and outcome.samples == 700 and "no solution of the step" in outcome.ended
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as kept:
        assert np.array_equal(kept["disc"].values, ex.run(plant, ex.Steady(0.0, P, 0.14))["disc"].values)


def test_static_gains_are_those_of_the_linear_model_where_steps_are_small(plant):
    """At +-0.2 V the curvature of the characteristic is below 2 %, and without friction there is no hysteresis."""
    model = plant.linearise(0.0, P).static_gain
    found = ex.static_gain_map(rs.experiments.staircase(plant, 0.0, P, "both", 0.2, 0.1, 0.3), variable="disc")
    assert found["gain"].sel(output=["x", "y"], input=["x", "y"]).values == pytest.approx(model, rel=0.02, abs=1e-8)
    assert found["hysteresis"].max() < 1e-8


def test_static_gains_of_a_turning_shaft_have_cross_terms_of_opposite_sign(plant):
    """Means over whole revolutions leave no unbalance response in them: 3 % of the linear model's."""
    model = plant.linearise(3000 * RPM, P).static_gain
    made = rs.experiments.staircase(plant, 3000 * RPM, P, "both", 0.2, 0.1, 0.3)
    found = ex.static_gain_map(made, variable="disc")["gain"].values
    assert found == pytest.approx(model, rel=0.03, abs=1e-8)
    assert found[0, 1] * found[1, 0] < 0


def test_hysteresis_and_deviation_of_a_made_up_characteristic_are_found():
    """Play of 1 um and a cubic part, on x alone."""
    from identification import make_record

    levels = ex.Staircase(hold=0.01).levels()
    way = np.sign(np.diff(levels[:, 0], prepend=-1))
    x = 3e-6 * levels[:, 0] - 0.5e-6 * way
    reference, disc = (np.repeat(v, 50, axis=0) for v in (levels, np.column_stack([x, np.full(len(x), -2e-5)])))
    found = ex.static_gain_map(make_record(np.arange(len(disc)) * 2e-4, {"reference": reference, "disc": disc}))
    assert found["hysteresis"].sel(input="x").values == pytest.approx([1e-6, 0.0], abs=1e-15)
    assert found["gain"].sel(input="x").values == pytest.approx([3e-6, 0.0], rel=0.05, abs=1e-15)
    assert found["offset"].sel(input="x", output="y") == pytest.approx(-2e-5)


def test_the_rig_at_rest_is_linear_as_figure_c5_shows():
    """Thesis section C.3.1 at 0.6 MPa, 0 rpm: within 0.95 um of linear; gains of Table E.2 2.37 to 3.27 um/V."""
    made = rs.experiments.staircase(rs.Plant("dtu_gas_bearing"), 0.0, P, "both", amplitude=2.0, step=0.5)
    found = ex.static_gain_map(made)
    gains = np.diag(found["gain"].values)
    assert np.all((gains > 2.3e-6) & (gains < 3.4e-6))
    assert found["deviation_max"].max() < 1e-6


def test_arrays_are_excitations_too(plant):
    reference = 0.1 * np.random.default_rng(0).standard_normal((50, 2))
    force = np.full((50, 2), 2.0)
    made = rs.experiments.controlled(plant, Counts(), 0.0, P, 0.02, reference=reference, disc_force=force)
    assert np.array_equal(made["reference_external"].values, np.vstack([reference, np.zeros((50, 2))]))
    assert made["disc_force"].values[:50].min() == 2.0 and not made["disc_force"].values[50:].any()
    alone = ex.run(plant, ex.Given(0.0, P, reference, force))
    theirs = plant.simulate(0.01, 0.0, P, reference, force)
    assert np.array_equal(alone["disc"].values, theirs["disc"].values)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="the peak of the memory is asked for in the way of Unix")
def test_a_streamed_run_of_two_minutes_takes_the_memory_of_a_short_one(tmp_path):
    """The record of 120 s is 140 MB in memory; the peak may grow by 40 MB."""
    code = """
import resource, sys
from pathlib import Path
import rotorsim as rs
from rotorsim.experiments import Multisine, Prbs, record
plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=4, dt=2e-4)
peaks = []
for seconds in (5, 120):
    record(plant, Prbs(0.0, 6e5, 0.5, seconds), Path(sys.argv[1]) / f"prbs{seconds}.nc")
    record(plant, Multisine(0.0, 6e5, 0.5, periods=seconds), Path(sys.argv[1]) / f"sines{seconds}.nc")
    peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
print(peaks[1] - peaks[0])
"""
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=True)
    assert float(done.stdout) < 40e3


def test_a_controller_that_fails_leaves_what_was_simulated_with_the_sentence(plant, tmp_path):
    class Breaks(Counts):
        def step(self, measured, speed, pressure):
            return super().step(measured, speed, pressure) if len(self.seen) < 700 else (np.nan, 0.0)

    with refused(ControllerError, "controller", lambda given: np.isnan(given[0])):
        ex.record(plant, ex.Controlled(0.0, P, 1.0, controller=Breaks()), tmp_path / "run.nc", block=100)
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as kept:
        assert kept.sizes["time"] == 701 and kept.attrs["ended"].startswith("controller Breaks: gave")


@pytest.mark.parametrize("wrong", ["impact", ex.Impact, {"peak": 20.0}])
def test_what_is_no_experiment_is_refused_with_what_one_is(wrong, tmp_path):
    sentence = r"experiment: .* is not one; give e\.g\. rs\.experiments\.Impact\(peak=20\.0\)"
    with pytest.raises(DataError, match=sentence):
        rs.run("plain_rotor", wrong)
    with pytest.raises(DataError, match=sentence):
        rs.record("plain_rotor", wrong, tmp_path / "run.nc")


def test_a_machine_that_nothing_feeds_has_the_ambient_pressure_in_its_records():
    """Whatever is asked, no injector feels it: the motion has the bits of a run without a supply."""
    rotor = rs.Plant("rigid_rotor_self_acting", n_theta=24, n_z=8)
    runs = [ex.run(rotor, ex.Runup(800.0, 801.0, 100.0, pressure)) for pressure in (0.3e6, 0.0)]
    runs.append(rotor.simulate(0.01, speed=800.0, pressure=0.5e6))
    assert not any(one["pressure"].values.any() or one["pressure_measured"].values.any() for one in runs)
    assert np.array_equal(runs[0]["disc"].values, runs[1]["disc"].values)
    assert all("pressure" not in one.attrs for one in runs)
