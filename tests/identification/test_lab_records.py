"""Records as laboratories make them: keyphasor pulses, probes at 45 degrees, high sampling rates."""

import sys
from dataclasses import replace

import numpy as np
import pytest

import identification as idn
from identification.records.assemble import assemble
from identification.records.columns import Column, DataTable
from identification.records.mapping import load_mapping
from identification.records.sensors import Keyphasor, pulse_times, shaft_angle
from rotorsim.base.errors import ReadError, SchemaError

RATE = 51200.0


def lab(seconds=4.0, start=40.0, end=60.0, rate=RATE):
    """Time, true angle, and a keyphasor's volts: a notch of 8 degrees, -8 V with noise, over a ramp of speed [Hz]."""
    t = np.arange(int(seconds * rate)) / rate
    angle = 2 * np.pi * (start * t + 0.5 * (end - start) / seconds * t**2) + 0.3
    notch = (angle % (2 * np.pi)) < np.deg2rad(8)
    volts = np.where(notch, -8.0, -1.0) + 0.1 * np.random.default_rng(1).standard_normal(t.size)
    return t, angle, volts


def test_the_angle_follows_a_ramp_to_a_tenth_of_a_degree():
    t, angle, volts = lab()
    found, speed = shaft_angle(t, volts, Keyphasor())
    inside = slice(2000, -2000)
    away = found - angle
    away -= 2 * np.pi * np.round(np.median(away) / (2 * np.pi))
    # the angle is 0 where the notch begins, within a sample
    assert np.abs(np.rad2deg(away[inside])).max() < 0.5
    true = 2 * np.pi * (40 + 5 * t)
    assert np.abs(speed / true - 1)[inside].max() < 0.01


def test_the_angle_is_missing_where_no_pulse_is_near():
    """Pulses of 1 to 3 s at 50 turns a second show the angle for 1.5 turns more on both sides."""
    t, _, volts = lab(start=50, end=50)
    found, speed = shaft_angle(t, np.where((t > 1) & (t < 3), volts, -1.0), Keyphasor())
    shown = np.isfinite(found)
    assert t[shown][0] == pytest.approx(1 - 1.5 / 50, abs=1 / 50) and t[shown][-1] == pytest.approx(3.03, abs=1 / 50)
    assert np.array_equal(shown, np.isfinite(speed)) and np.all(np.diff(shown.astype(int)) ** 2 <= 1)


def test_the_edge_the_level_and_pulses_of_a_turn():
    t, _, volts = lab(start=50, end=50)
    falling = pulse_times(t, volts, Keyphasor())
    rising = pulse_times(t, volts, Keyphasor(edge="rising"))
    assert np.median(rising[:99] - falling[:99]) == pytest.approx(8 / 360 / 50, abs=3e-5)
    _, speed = shaft_angle(t, volts, Keyphasor(pulses=4))
    assert np.median(speed) == pytest.approx(2 * np.pi * 50 / 4, rel=1e-3)
    np.testing.assert_allclose(pulse_times(t, volts, Keyphasor(level=-4.0)), falling, atol=1.1 / RATE)


@pytest.mark.parametrize(
    ("change", "shown"),
    [
        (lambda v: np.zeros_like(v), "level"),
        (lambda v: np.where(np.arange(v.size) < v.size // 100, v, -1.0), "[0-3] pulses.* 4"),
        (lambda v: np.where(np.abs(np.arange(v.size) / RATE - 2) < 0.015, -1.0, v), "near [12]"),
    ],
)
def test_a_keyphasor_that_cannot_be_followed_is_refused(change, shown):
    t, _, volts = lab(start=50, end=50)
    with pytest.raises(ReadError, match=shown):
        shaft_angle(t, change(volts), Keyphasor())


MAPPING = {
    "time": {"sample_rate": "51.2 kHz"},
    "keyphasor": {"column": "key", "unit": "V"},
    "probes": {
        "A": {"column": "A", "unit": "V", "sensitivity": "200 mV/mil", "angle": "45 deg"},
        "B": {"column": "B", "unit": "V", "sensitivity": "200 mV/mil", "angle": "135 deg"},
    },
    "constants": {"pressure": "0.3 MPa"},
}


def written(path, seconds=4.0):
    """A file of a lab: 51.2 kHz, two probes at 45 degrees in V of 200 mV/mil, a keyphasor."""
    t, angle, volts = lab(seconds, 50, 50)
    x, y = 10e-6 * np.cos(angle), 6e-6 * np.sin(angle)
    a, b = (x + y) / np.sqrt(2), (y - x) / np.sqrt(2)
    scale = 0.2 / 25.4e-6
    table = np.column_stack([a * scale, b * scale, volts])
    np.savetxt(path, table, delimiter=",", header="A,B,key", comments="", fmt="%.7g")
    return t, x, y


def test_probes_at_45_degrees_in_mils_with_a_keyphasor_become_a_record(tmp_path):
    _, x, y = written(tmp_path / "lab.csv")
    record = idn.read(tmp_path / "lab.csv", MAPPING)
    np.testing.assert_allclose(record["disc_measured"].sel(axis="x"), x, atol=1e-10)
    np.testing.assert_allclose(record["disc_measured"].sel(axis="y"), y, atol=1e-10)
    assert float(record["speed"].median()) == pytest.approx(2 * np.pi * 50, rel=1e-4)
    low = idn.resample(record, 5000.0)
    assert low.sizes["time"] == 20000 and "51200 Hz to 5000 Hz" in low.attrs["resampled"]
    inner = slice(200, -200)
    exact = 10e-6 * np.cos(2 * np.pi * 50 * low["time"].values + 0.3)
    assert np.abs(low["disc_measured"].sel(axis="x").values - exact)[inner].max() < 2e-8
    idn.save(low, tmp_path / "low.nc")
    assert idn.read(tmp_path / "low.nc").sizes["time"] == 20000


def test_what_lies_above_half_the_new_rate_does_not_fold_back():
    t = np.arange(51200) / RATE
    tone = np.sin(2 * np.pi * 3200 * t)
    record = idn.make_record(t, {"disc": np.column_stack([tone, tone])})
    assert np.abs(idn.resample(record, 5000.0)["disc"].values[100:-100]).max() < 0.01


@pytest.mark.slow
def test_a_minute_at_51_kHz_takes_no_step_of_python_a_sample():
    """Some calls a pulse, of which there are a thousandth as many."""
    t = np.arange(int(60 * RATE)) / RATE
    xy = np.random.default_rng(0).standard_normal((t.size, 2))
    _, _, volts = lab(1.0, 50, 50)
    record = idn.make_record(t, {"disc": xy, "disc_measured": xy})
    calls = []
    sys.setprofile(lambda frame, event, what: calls.append(1) if event.endswith("call") else None)
    try:
        shaft_angle(t, np.tile(volts, 60), Keyphasor())
        idn.resample(record, 5000.0)
    finally:
        sys.setprofile(None)
    assert len(calls) < t.size / 50


@pytest.mark.parametrize(
    ("change", "shown"),
    [
        ({"keyphasor": {"A": {"column": "key"}, "B": {"column": "A"}}}, r"keyphasor: 2 .*\(A, B\)"),
        ({"keyphasor": [{"column": "key"}, {"column": "A"}]}, "keyphasor: 2"),
        ({"probes": MAPPING["probes"] | {"B": MAPPING["probes"]["A"]}}, "probes A, B: .* x and y"),
        ({"probes": {"A": {"column": "A", "unit": "um"}}}, "probes.A.angle"),
        ({"keyphasor": {"column": "key", "unit": "V", "edge": "up"}}, "keyphasor.edge"),
        ({"keyphasor": {"column": "key", "unit": "V", "pulses": 0}}, "keyphasor.pulses"),
        ({"keyphasor": {"column": "A", "unit": "V", "Level": "1 V"}}, "keyphasor: .*'Level'"),
        ({"channels": {"angle": {"column": "A", "unit": "rad"}}}, r"\[channels.angle\]"),
        ({"channels": {"disc_measured": {"x": {"column": "A", "unit": "V"}}}}, r"\[channels.disc_measured\]"),
    ],
)
def test_wrong_entries_are_named(tmp_path, change, shown):
    written(tmp_path / "lab.csv", 0.2)
    with pytest.raises(ReadError, match=shown):
        idn.read(tmp_path / "lab.csv", MAPPING | change)


def test_rates_that_cannot_be_are_refused():
    t = np.arange(1000) / 5000
    record = idn.make_record(t, {"disc": np.zeros((1000, 2))})
    with pytest.raises(SchemaError, match="Hz"):
        idn.resample(record, 10000.0)
    turning = record.assign(speed=("time", np.full(1000, 400 * np.pi), {"units": "rad/s"}))
    assert idn.resample(turning, 2500.0, 3).sizes["time"] == 500
    with pytest.raises(SchemaError, match=r"1000 Hz .*3X.* 600 Hz.* 1500 Hz"):
        idn.resample(turning, 1000.0, 3)
    with pytest.raises(SchemaError, match="no speed"):
        idn.resample(record, 1000.0, 3)
    with pytest.raises(SchemaError, match=r"Hz and .* Hz"):
        idn.resample(record, 1234.5678901)


def test_inputs_are_averaged_over_the_interval_in_which_they_are_held():
    t = np.arange(10240) / RATE
    own = np.arange(1000) / 5000
    drive = np.column_stack([np.sin(2 * np.pi * 250 * own), np.cos(2 * np.pi * 100 * own)])
    steps = drive[np.minimum((t * 5000 + 1e-6).astype(int), 999)]
    lab = idn.make_record(t, {"reference": steps}, {"source_format": "CSV"})
    low = idn.resample(lab, 5000.0)["reference"].values
    assert low.shape == (999, 2)  # the last interval is not whole
    waves = [np.exp(-2j * np.pi * f * own[:980]) for f in (250, 100)]
    for column, (wave, f) in enumerate(zip(waves, (250, 100), strict=True)):
        ratio = (low[:980, column] @ wave) / (drive[:980, column] @ wave)
        assert abs(ratio) == pytest.approx(1, abs=2e-3) and abs(np.angle(ratio)) / (2 * np.pi * f) < 1e-6
    own_record = idn.make_record(own, {"reference": drive})
    half = idn.resample(own_record, 2500.0)["reference"].values
    np.testing.assert_allclose(half, 0.5 * (drive[::2] + drive[1::2]), atol=1e-12)
    np.testing.assert_allclose(idn.resample(own_record, 5000.0)["reference"].values, drive, atol=1e-12)


def struck(**more):
    """Tables of a mapping and of a record struck once along 60 deg at 320 mm."""
    time = np.arange(1000) / 5000
    force = np.where((time > 0.05) & (time < 0.053), 120.0, 0.0)
    columns = (("t", time, "s"), ("a", np.cos(300 * time) * 1e-6, "m"), ("b", np.sin(300 * time) * 1e-6, "m"),
               ("F", force, "N"))  # fmt: skip
    table = DataTable("CSV", tuple(Column(name, values, unit) for name, values, unit in columns))
    mapping = {
        "time": {"column": "t"},
        "probes": {"A": {"column": "a", "angle": "0 deg"}, "B": {"column": "b", "angle": "90 deg"}},
    } | more  # fmt: skip
    return table, force, load_mapping(mapping)


def test_a_hammer_strikes_along_any_direction_and_at_any_plane():
    entry = {"column": "F", "angle": "60 deg", "position": "320 mm", "sign": -1}
    table, force, mapping = struck(hammer=entry)
    record = assemble(table, mapping)
    parts = record["disc_force"].values
    assert parts == pytest.approx(-np.outer(force, [0.5, np.sqrt(0.75)])) and record.attrs["force_position"] == 0.32
    assert np.array_equal(assemble(*struck(hammer=entry | {"angle": "90 deg", "sign": 1})[::2])["disc_force"].values,
                          np.column_stack([0 * force, force]))  # fmt: skip


@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_force_along_one_axis_needs_no_column_of_the_other(axis):
    table, force, mapping = struck(channels={"disc_force": {axis: {"column": "F"}}})
    record = assemble(table, mapping)
    assert np.array_equal(record["disc_force"].sel(axis=axis).values, force)
    assert not record["disc_force"].sel(axis="y" if axis == "x" else "x").values.any()


@pytest.mark.parametrize(
    ("entry", "match"),
    [
        ({"column": "F"}, "hammer.angle: is missing"),
        ({"column": "F", "angle": 0}, "hammer.angle"),
        ({"column": "zero", "unit": "N", "angle": "0 deg"}, "hammer: the force is constant at 0 N, no blow"),
        ({"column": "t", "unit": "N", "angle": "0 deg", "place": 1}, "hammer"),
    ],
)
def test_a_hammer_without_direction_or_force_is_refused(entry, match):
    with pytest.raises(ReadError, match=match):
        table, _, mapping = struck(hammer=entry)
        assemble(replace(table, columns=(*table.columns, Column("zero", np.zeros(1000)))), mapping)


def test_a_hammer_and_a_force_of_the_disc_are_one():
    with pytest.raises(ReadError, match="the same force"):
        struck(hammer={"column": "F", "angle": "0 deg"}, channels={"disc_force": {"x": {"column": "F"}}})


def test_probes_at_one_angle_without_positions_are_of_planes_that_nobody_stated():
    table, _, _ = struck()
    probes = {name: {"column": column, "angle": angle} for name, column, angle in
              (("A", "a", "0 deg"), ("B", "b", "90 deg"), ("C", "a", "0 deg"), ("D", "b", "90 deg"))}  # fmt: skip
    with pytest.raises(ReadError, match="state position"):
        assemble(table, load_mapping({"time": {"column": "t"}, "probes": probes}))
    for name in probes:
        probes[name]["position"] = "100 mm" if name in "AB" else "300 mm"
    made = assemble(table, load_mapping({"time": {"column": "t"}, "probes": probes, "disc": {"position": "300 mm"}}))
    assert made["probe"].values.tolist() == ["A", "B"]


def test_a_run_up_of_a_lone_probe_is_fit_for_its_vectors():
    t, angle, _ = lab(seconds=2.0, rate=5000.0)
    probes = {"probe": ["A"], "probe_unit": ["m"]}
    motion, speed = 1e-5 * np.cos(angle)[:, None], 2 * np.pi * (40 + 10 * t)
    found = idn.examine(idn.make_record(t, {"probe_measured": motion, "angle": angle, "speed": speed}, probes=probes))
    assert found.usable and found.uses["run-up analysis"] == "" and "disc_measured" in found.uses["runout filter"]
    still = idn.examine(idn.make_record(t, {"probe_measured": motion}, probes=probes))
    assert not still.usable and "speed" in still.uses["run-up analysis"]
