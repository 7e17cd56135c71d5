"""Vectors of a run-up over time: known orders come out, the sweep is found, and what is not a sweep is refused."""

import numpy as np
import pytest

from identification import make_record, read, save
from rotorsim.base.errors import DataError
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.cli import main
from rotorsim.discrepancy import runup_vectors
from rotorsim.discrepancy.run_ups import LEAST_TURNS, WINDOW, make_sweeps, order_vectors

RATE = 40.0


def sweep(falling=False, rate=5000.0, held=1.0, **attrs):
    """A second at 100 rad/s, five of 40 rad/s2, one at 300; 1X of 2 um, lag 0.5, 2X of 1 um along y."""
    t = np.arange(int((5 + 2 * held) * rate)) / rate
    speed = 100 + RATE * np.clip(t - held, 0, 5)
    speed = speed[::-1] if falling else speed
    angle = 0.3 + np.concatenate([[0.0], np.cumsum(speed)[:-1] / rate])
    disc = 1e-6 * np.column_stack([2 * np.cos(angle - 0.5), 2 * np.sin(angle - 0.5) + np.cos(2 * angle + 1)])
    disc += [1e-5, -3e-6]
    pressure = np.full(t.size, 3e5)
    return make_record(t, {"disc_measured": disc, "angle": angle, "pressure": pressure}, {"record": "a", **attrs})


@pytest.mark.parametrize("falling", [False, True])
@pytest.mark.parametrize("turns", [1, 8])
def test_orders_of_a_sweep_come_out_with_its_rate(falling, turns):
    table = runup_vectors(sweep(falling), turns, (1, 2))
    assert table.attrs["rate"] == pytest.approx(RATE, rel=0.02)
    assert table.attrs["turns"] == turns and table.attrs["pressure"] == 3e5
    speeds = table["speed"].values
    assert (np.diff(speeds) < 0).all() == falling and 99.9 < speeds.min() < 110 and 290 < speeds.max() <= 300.5
    one = table["amplitude"].values * np.exp(-1j * table["phase"].values)
    np.testing.assert_allclose(one[:, 0, 0], 2e-6 * np.exp(-0.5j), atol=2e-9)
    np.testing.assert_allclose(one[:, 0, 1], -2e-6j * np.exp(-0.5j), atol=2e-9)
    np.testing.assert_allclose(one[:, 1, 1], 1e-6 * np.exp(1j), atol=2e-9)


@pytest.mark.parametrize(("factor", "fits"), [(1.0, True), (1.05, True), (1 / 60, False), (2.0, False)])
def test_a_speed_that_is_not_that_of_the_angle_is_refused(factor, fits):
    """A speed channel next to the angle: the same, 5 % off in its mean, in Hz under the name rpm, and twice as fast."""
    record = sweep()
    record = record.assign(speed_measured=("time", factor * np.gradient(record["angle"].values, record["time"].values)))
    if fits:
        assert runup_vectors(record).sizes["speed"] > 3
    else:
        with pytest.raises(DataError) as error:
            runup_vectors(record)
        assert error.value.argument == "speed" and ("Hz taken for rpm" in str(error.value)) == (factor < 1)


def test_a_slow_sweep_keeps_its_rows_and_a_rest_before_it_is_left_out():
    """Each single revolution gains 0.03 % at the top; two seconds of rest have no row."""
    t = np.arange(22 * 2000) / 2000
    speed = np.where(t < 2, 0.0, 60 + 12 * (t - 2))
    angle = np.cumsum(speed) / 2000
    disc = 1e-6 * np.column_stack([np.cos(angle), np.sin(angle)])
    table = runup_vectors(make_record(t, {"disc_measured": disc, "angle": angle}), 1, (1,))
    turns = angle[-1] / (2 * np.pi)
    assert len(table["speed"]) > turns - 3 and table["speed"].values[0] == pytest.approx(60.5, abs=1)
    assert table.attrs["rate"] == pytest.approx(12, rel=0.05)


@pytest.mark.parametrize("begin", [0.0, 1.0, 2.5, 4.0])
@pytest.mark.parametrize(("turns", "most"), [(1, 0.15), (2, 0.04), (4, 0.004), (8, 0.001)])
def test_an_order_that_passes_its_resonance_does_not_count_as_its_neighbour(turns, most, begin):
    """1X that follows 1 / (1 + i n u), u from -1 to 1 in n turns: amplitude and phase of a resonance half a turn wide.

    2X of it, which is not there, is up to that share of 1X, whatever the angle at which the window begins; without a
    window up to 4 % in eight turns, 23 % in two. A single one is left as it is.
    """
    u = np.linspace(-1, 1, 4000, endpoint=False)
    angle = begin + np.pi * turns * (u + 1)
    passing = (np.exp(1j * angle) / (1 + 1j * turns * u)).real[:, None]
    one, two, _ = np.abs(order_vectors(angle, passing, (1, 2, 3), turns >= LEAST_TURNS))[:, 0]
    assert two < most * one


def test_a_window_of_one_turn_is_not_weighted_because_1x_takes_up_the_noise():
    """Gain of white noise over sqrt(4 / n), that of an order in many turns, by the responses to single samples."""

    def gain(turns, hann):
        angle = np.linspace(0, 2 * np.pi * turns, 300, endpoint=False)
        return np.linalg.norm(order_vectors(angle, np.eye(300), (1, 2, 3), hann)[0]) * np.sqrt(300 / 4)

    assert gain(1, True) > 2.3 * gain(1, False) and gain(LEAST_TURNS, True) < 1.25 * gain(LEAST_TURNS, False)
    assert gain(64, False) == pytest.approx(1.0, rel=0.01)
    assert gain(64, True) == pytest.approx(np.sqrt(1.5), rel=0.01)  # the noise bandwidth of Hann's


@pytest.mark.parametrize(("turns", "hann"), [(1, False), (2, True), (8, True)])
def test_the_twin_follows_a_table_as_it_was_made(turns, hann):
    """A table of another instrument does not state a window: its samples weigh the same, whatever its turns are."""
    table = runup_vectors(sweep(), turns)
    made, other = make_sweeps(table, "a", True)[0], make_sweeps(table.drop_attrs().assign_attrs(
        {key: value for key, value in table.attrs.items() if key != WINDOW}), "a", True)[0]  # fmt: skip
    assert (made.hann, other.hann) == (hann, False) and (made.inputs != other.inputs) == hann
    turned = made.angle + np.concatenate([[0.0], np.cumsum(made.rows[:-1, 0])]) * RIG_SAMPLE
    passing = np.column_stack([np.cos(turned), np.sin(turned)]) * np.abs(np.sin(made.rows[:, :1]))
    assert np.allclose(made.lines(passing), other.lines(passing), rtol=1e-6, atol=1e-9) != hann


def test_up_and_down_gives_the_longer_sweep_and_says_so():
    up = sweep()
    down = sweep(falling=True).isel(time=slice(5000, None))
    angle = np.concatenate(
        [up["angle"].values, up["angle"].values[-1] + down["angle"].values - down["angle"].values[0]]
    )
    disc = 1e-6 * np.column_stack([np.cos(angle), np.sin(angle)])
    t = np.arange(angle.size) / 5000
    table = runup_vectors(make_record(t, {"disc_measured": disc, "angle": angle}), 4, (1,))
    steps = np.diff(table["speed"].values)
    assert (np.all(steps > 0) or np.all(steps < 0)) and np.ptp(table["speed"].values) > 190
    assert "windows do not continue the sweep" in table.attrs["notes"][-1]
    np.testing.assert_allclose(table["amplitude"].values[:, 0, 0], 1e-6, rtol=1e-3)


def test_a_shaft_that_turns_the_other_way_is_mirrored_and_noted():
    record = sweep()
    record["angle"] = -record["angle"]
    record["disc_measured"] = record["disc_measured"] * [1, -1]
    back, forward = runup_vectors(record, 4), runup_vectors(sweep(), 4)
    np.testing.assert_allclose(back["phase"].values[:, :2], forward["phase"].values[:, :2], atol=0.02)
    assert "turns from y to x" in back.attrs["notes"][0]


def test_one_probe_and_known_changes_go_with_the_vectors():
    record = sweep(changes="{}")
    reading = record["disc_measured"].values @ [np.cos(0.7), np.sin(0.7)]
    probe = {"probe": ["A"], "probe_quantity": ["relative_displacement"], "probe_position": [0.12],
             "probe_angle": [0.7], "probe_gain": [1.0], "probe_unit": ["m"]}  # fmt: skip
    values = {"probe_measured": reading[:, None], "angle": record["angle"].values}
    one = make_record(record["time"].values, values, dict(record.attrs), probes=probe)
    table = runup_vectors(one, 4, (1, 2))
    assert table["axis"].values.tolist() == ["x"]
    assert table.attrs["probe_angle"] == 0.7 and table.attrs["disc_position"] == 0.12 and table.attrs["changes"] == "{}"
    vectors = table["amplitude"].values * np.exp(-1j * table["phase"].values)
    np.testing.assert_allclose(vectors[:, 0, 0], 2e-6 * np.exp(-1.2j), atol=2e-9)


def test_the_table_is_what_a_diagnosis_takes():
    parts = make_sweeps(runup_vectors(sweep(), 4), "a", True)
    assert all(part.turns == 4 for part in parts) and sum(len(part.speeds) for part in parts) > 30


@pytest.mark.parametrize(
    ("record", "options", "sentence"),
    [
        (sweep().drop_vars("angle"), {}, "a: has no angle of the shaft; map a keyphasor"),
        (sweep().drop_vars("disc_measured"), {}, "a: has no disc_measured"),
        (sweep().isel(time=slice(0, 4000)), {"turns": 1}, "a: the speed does not rise or fall over 3 windows"),
        (sweep(rate=1000.0), {"orders": (1, 9)}, "fewer than 4 samples in a period of 9X"),
        (sweep(), {"turns": 0}, "a: turns is 0"),
    ],
)
def test_a_record_that_is_not_a_sweep_is_refused(record, options, sentence):
    with pytest.raises(DataError, match=sentence):
        runup_vectors(record, **options)


def test_the_command_writes_a_table(tmp_path, capsys):
    save(sweep(), tmp_path / "run.nc")
    assert main_of("data", "vectors", str(tmp_path / "run.nc"), str(tmp_path / "v.nc"), "--turns", "4") == 0
    assert "rpm/s" in capsys.readouterr().out
    attrs = read(tmp_path / "v.nc").attrs
    assert (attrs["turns"], attrs[WINDOW]) == (4.0, "hann")
    assert main_of("data", "vectors", str(tmp_path / "v.nc"), str(tmp_path / "w.nc")) == 2


def main_of(*arguments):
    """Exit code of a command."""
    with pytest.raises(SystemExit) as end:
        main(list(arguments))
    return end.value.code
