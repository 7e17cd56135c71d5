"""Runout table of a law: fit of a slow roll, what a running law takes off, ages, refusals."""

import json
import os
from dataclasses import replace
from datetime import UTC, date, datetime

import numpy as np
import pytest

import identification as idn
from rotorsim.base.errors import OtherMachine
from rotorsim.control import Law, LawError, RunoutTable, check_runout, load_law, runout_table
from rotorsim.experiments import Steady
from rotorsim.experiments.laws import WithHarmonics
from rotorsim.experiments.running import record as run_record, run
from rotorsim.machine import load_machine
from rotorsim.plant import Plant

TS = 2e-4
GAIN = 1e5
"""Output of the law of these tests [V/m]."""


def surface(angle):
    """Readings (n, 2) [m] of a surface with orders 1, 2 and 9."""
    a = np.asarray(angle)[:, None] - np.array([0.0, np.pi / 2])
    return 2e-6 * np.cos(a + 0.3) + 5e-7 * np.cos(2 * a - 1) + 2e-7 * np.cos(9 * a)


def slow_roll(turns=3.0, rpm=100.0, seed=0, noise=0.0, offset=0.0):
    """Record of a shaft at rest at (3, -8) um whose zero of the angle is `offset` [rad] late."""
    time = TS * np.arange(round(turns * 60 / rpm / TS) + 1)
    angle = rpm * np.pi / 30 * time
    y = np.array([3e-6, -8e-6]) + surface(angle) + noise * np.random.default_rng(seed).normal(size=(len(time), 2))
    return idn.from_arrays(time, np.zeros((len(time), 2)), y, angle=angle - offset, speed=rpm * np.pi / 30)


def gain_law(**settings):
    """u = GAIN y, without fade and centre."""
    D = GAIN * np.eye(2)[None, None]
    empty = {"A": np.zeros((1, 1, 0, 0)), "B": np.zeros((1, 1, 0, 2)), "C": np.zeros((1, 1, 2, 0))}
    return Law("gain", **empty, D=D, W=np.zeros((1, 1, 0, 2)), speeds=[0.0], pressures=[0.0], **settings)


def test_a_table_is_the_surface_without_the_position():
    """Closed form at its points; between them straight lines, (9 pi/360)^2/2 of the amplitude of order 9 at most."""
    table = runout_table(slow_roll())
    angle = np.arange(720) * np.pi / 360
    np.testing.assert_allclose(table.values, surface(angle), atol=1e-12)
    np.testing.assert_allclose(table.at(angle + 0.004), surface(angle + 0.004), atol=2e-9)
    assert table.turns == pytest.approx(3) and table.speed == pytest.approx(100 * np.pi / 30)


def test_the_noise_of_the_sensors_is_averaged_over_the_samples():
    """Least squares: 72 of 9000 independent numbers, so .089 of the noise is left."""
    noisy = runout_table(slow_roll(noise=3.3e-7)).values - runout_table(slow_roll()).values
    assert np.std(noisy) == pytest.approx(3.3e-7 * np.sqrt(72 / 9000), rel=0.25)


def test_a_running_law_answers_the_motion_alone_whatever_the_angle():
    law, rng = gain_law(runout=runout_table(slow_roll())), np.random.default_rng(1)
    for angle in rng.uniform(-40, 4000, 200):
        motion = 1e-6 * rng.normal(size=2)
        seen = motion + law.runout.at(angle)[0]
        np.testing.assert_allclose(law.step(seen, 300.0, 5e5, angle), GAIN * motion, atol=1e-9)


def test_a_law_without_a_table_has_the_bits_that_it_had():
    law, again = gain_law(), gain_law(runout=RunoutTable(np.zeros((8, 2))))
    seen = np.random.default_rng(2).normal(size=(50, 2)) * 1e-6
    a, b = ([one.step(y, 1.0, 0.0, 0.1 * k) for k, y in enumerate(seen)] for one in (law, again))
    np.testing.assert_array_equal(a, b)


def test_it_is_kept_in_both_kinds_of_file(tmp_path):
    law = gain_law(runout=replace(runout_table(slow_roll()), taken="2026-11-20"))
    for name in ("law.json", "law.mat"):
        law.save(tmp_path / name)
        again = load_law(tmp_path / name)
        np.testing.assert_array_equal(again.runout.values, law.runout.values)
        assert again.hash == law.hash != gain_law().hash and again.runout.taken == "2026-11-20"


@pytest.mark.parametrize("name", ["law.json", "law.mat"])
@pytest.mark.parametrize(
    "damage",
    [
        {"values": [[0.0, 0.0]] * 4},
        {"values": [[None, 0.0]] * 9},
        {"values": "x"},
        {"speed": "fast"},
        {"turns": float("nan")},
        {"turns": None},
        {"taken": "yesterday"},
        {"other": 1},
    ],
)
def test_a_damaged_table_in_a_file_is_refused_with_the_file(tmp_path, monkeypatch, name, damage):
    table = runout_table(slow_roll())
    whole = table.to_dict()
    monkeypatch.setattr(RunoutTable, "to_dict", lambda _: whole | damage)
    gain_law(runout=table).save(tmp_path / name)
    with pytest.raises(LawError, match=rf"{name}: runout: .*") as caught:
        load_law(tmp_path / name)
    assert "\n" not in str(caught.value) and "argument" not in str(caught.value)


def test_its_age_is_shown():
    table = runout_table(slow_roll(), taken="2026-11-20")
    assert gain_law(runout=table).attrs()["law_runout"] == table.origin
    assert table.age(date(2026, 11, 26)) == 6 and "2026-11-20" in str(gain_law(runout=table).card())
    assert runout_table(slow_roll()).age() is None


@pytest.mark.parametrize(
    ("stated", "taken"), [("2026-11-20T23:59:58+00:00", "2026-11-20"), ("2026-11-20", "2026-11-20"), ("20.11.2026", "")]
)
def test_its_date_is_that_of_the_record_where_that_can_be_read(stated, taken):
    assert runout_table(slow_roll().assign_attrs(date=stated)).taken == taken
    assert runout_table(slow_roll().assign_attrs(date=stated), taken="2026-01-02").taken == "2026-01-02"


def test_a_run_states_its_date_in_utc(tmp_path):
    """In memory, streamed to a file, and by `simulate`; a record of yesterday copied today stays one of yesterday."""
    plant, before = Plant("plain_rotor"), datetime.now(UTC).replace(microsecond=0)
    roll = Steady(speed=10.0, pressure=0.0, duration=1.3)
    run_record(plant, roll, tmp_path / "roll.nc")
    made = [run(plant, roll), plant.simulate(0.01, 10.0), idn.read(tmp_path / "roll.nc")]
    for record in made:
        assert before <= datetime.fromisoformat(record.attrs["date"]) <= datetime.now(UTC)
    os.utime(tmp_path / "roll.nc", (0, 0))
    assert runout_table(idn.read(tmp_path / "roll.nc")).taken == made[2].attrs["date"][:10]


def test_a_moved_zero_of_the_angle_is_named_and_another_surface_too():
    table = runout_table(slow_roll())
    sound = check_runout(table, slow_roll(seed=3, noise=3e-7))
    moved = check_runout(table, slow_roll(offset=np.radians(40.0)))
    assert sound.left < sound.bound and sound.left == pytest.approx(3e-7 * np.sqrt(72 / 9000), rel=0.25)
    assert moved.left > moved.bound and np.degrees(moved.turn) == pytest.approx(-40.0, abs=0.5)
    assert moved.turned_left < 0.02 * moved.reading
    angle = np.arange(720) * np.pi / 360
    worn = table.values + np.outer(2.5e-6 * np.cos(3 * angle), [1.0, 1.0])
    other = check_runout(replace(table, values=-worn), slow_roll())
    assert other.left > other.bound and other.turned_left > other.bound
    assert "zero of the shaft angle" in moved.text and "zero of the shaft angle" not in other.text


def speeding_up():
    """A slow roll that ends in a second at 1900 rpm; its mean speed is below the limit."""
    slow = slow_roll(turns=20.0)
    angle = slow["angle"].values.copy()
    angle[-5000:] = angle[-5001] + 200.0 * TS * np.arange(1, 5001)
    return slow.assign_coords(angle=("time", angle)) if "angle" in slow.coords else slow.assign(angle=("time", angle))


def wrapped():
    slow = slow_roll()
    return slow.assign(angle=("time", np.mod(slow["angle"].values, 2 * np.pi)))


@pytest.mark.parametrize(
    ("record", "argument"),
    [
        (slow_roll(turns=1.5), "turns"),
        (slow_roll(turns=40, rpm=1200), "speed"),
        (speeding_up(), "speed"),
        (wrapped(), "angle"),
    ],
    ids=["turns", "speed", "ramp", "wrapped"],
)
def test_too_few_turns_a_shaft_at_speed_and_an_angle_that_jumps_are_refused(record, argument):
    with pytest.raises(LawError) as error:
        runout_table(record)
    assert error.value.argument == argument


def test_a_record_without_angle_is_refused():
    with pytest.raises(LawError):
        runout_table(slow_roll().drop_vars(["angle"]))


@pytest.mark.parametrize("values", [np.zeros((720, 3)), np.zeros((4, 2)), np.full((720, 2), np.nan)])
def test_a_table_of_another_shape_is_refused(values):
    with pytest.raises(LawError) as error:
        RunoutTable(values)
    assert error.value.argument == "values"


def test_a_law_with_a_table_asks_for_the_angle_and_holds_where_it_is_lost():
    law = gain_law(runout=runout_table(slow_roll()))
    with pytest.raises(LawError) as error:
        law.step((0.0, 0.0), 1.0, 0.0)
    assert error.value.argument == "angle"
    before = law.step((1e-5, 0.0), 1.0, 0.0, 0.5)
    for lost in (np.nan, np.inf, 6e19):
        np.testing.assert_array_equal(law.step((2e-5, 0.0), 1.0, 0.0, lost), before)
        assert law.alarm_code == 13


def test_a_lost_angle_forgives_no_lost_speed():
    """Both come from one encoder: a speed of 0 after a sample without angle is still a leap from 300 rad/s."""
    from rotorsim.control import Plausibility

    limits = Plausibility(speed_jump=50.0)
    law, codes = gain_law(runout=runout_table(slow_roll()), plausibility=limits), []
    for k in range(60):
        speed, angle = (300.0, 0.06 * k) if k < 50 else (0.0, np.nan if k == 50 else 3.0)
        law.step((1e-6, 0.0), speed, 0.0, angle)
        codes.append(law.alarm_code)
    assert codes[49:52] == [0, 13, 6] and set(codes[51:]) == {6}


def test_a_damaged_file_is_no_law_without_states(tmp_path):
    data = gain_law().to_dict() | {"B": [[[[1.0, 2.0]]]]}
    (tmp_path / "law.json").write_text(json.dumps(data))
    with pytest.raises(LawError):
        load_law(tmp_path / "law.json")


def test_a_sensor_that_hangs_is_found_although_the_runout_below_it_moves():
    from rotorsim.control import Plausibility

    law, rng = gain_law(runout=runout_table(slow_roll()), plausibility=Plausibility()), np.random.default_rng(5)
    for k in range(300):
        law.step(1e-6 + 1e-7 * rng.normal(size=2), 100.0, 0.0, 0.01 * k)
    for k in range(150):
        law.step((1e-6, 1e-6), 100.0, 0.0, 3.0 + 0.01 * k)
    assert law.alarm_code == 5


def test_the_table_of_another_machine_warns():
    law = gain_law(runout=replace(runout_table(slow_roll()), machine="other_rig"))
    with pytest.warns(OtherMachine, match="other_rig"):
        law.check_machine("dtu_gas_bearing")


def test_python_and_the_compiled_loop_take_the_same_off_on_the_plant():
    """Both give the same bits, and the references lose the runout: a gain answers the motion alone."""
    from rotorsim.verify.runs import run_rows, steady_rows

    machine = load_machine("dtu_gas_bearing").with_({"grid.n_theta": 16, "grid.n_z": 8})
    plant = Plant(machine)
    slow = plant.simulate(2.4, speed=10.472, pressure=0.5e6)
    law = replace(gain_law(), D=0.02 * GAIN * np.eye(2)[None, None], runout=runout_table(slow))
    assert law.runout.machine == machine.name
    record = plant.simulate(0.1, speed=300.0, pressure=0.5e6, controller=law)
    run = run_rows(plant, law, steady_rows(300.0, 0.5e6, 0.1))
    np.testing.assert_array_equal(record["reference"].values, run.reference)
    read, true, angle = (record[name].values for name in ("disc_measured", "disc", "angle_measured"))
    left = read - law.runout.at(angle)
    asked = 0.02 * GAIN * left[:-1]
    np.testing.assert_allclose(record["reference"].values[1:], asked, atol=1e-9)  # one sample later
    assert np.std(left - true) < 0.5 * np.std(read - true)
    harmonics = WithHarmonics(law, 300.0, np.zeros((1, 2)))
    again = plant.simulate(0.1, speed=300.0, pressure=0.5e6, controller=harmonics)
    np.testing.assert_array_equal(again["reference"].values, record["reference"].values)


def test_the_live_check_reads_the_motion_that_a_law_answers():
    """Runout alone is no motion to a law whose table takes it off."""
    from rotorsim.live.laws import motion
    from rotorsim.plant.kernels.layout import ANGLE_READ, AT, COLUMNS, DISC_READ

    table, n = runout_table(slow_roll()), 5000
    angle = 300.0 * TS * np.arange(n)
    rows = np.zeros((n, len(COLUMNS) + 6))
    rows[:, AT["speed"]], rows[:, AT["angle"]], rows[:, ANGLE_READ] = 300.0, angle, angle
    rows[:, DISC_READ] = table.at(angle)
    seen, left = motion(rows, TS).measured, motion(rows, TS, runout=table).measured
    assert np.abs(seen).max() > 1.5 and np.abs(left).max() < 1e-9


@pytest.mark.parametrize(
    "given", ["slow", 3.0, np.zeros((8, 2)), slow_roll()], ids=["text", "number", "array", "record"]
)
def test_a_law_takes_a_table_alone(given):
    with pytest.raises(LawError) as error:
        gain_law(runout=given)
    assert error.value.argument == "runout"


def test_a_path_is_no_slow_roll():
    with pytest.raises(LawError) as error:
        runout_table("slow.nc")
    assert error.value.argument == "slow_roll"
