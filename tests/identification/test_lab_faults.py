"""Records with faults: gaps, missing values, dead, missing and clipped probes, several planes, gap voltages."""

import numpy as np
import pytest

import identification as idn
from identification.records.columns import clipped, dead
from rotorsim.base.errors import ReadError, SchemaError

RATE = 5000
T = np.arange(4 * RATE) / RATE
X, Y = 10e-6 * np.cos(100 * np.pi * T), 6e-6 * np.sin(100 * np.pi * T)
KEY = np.where((100 * np.pi * T) % (2 * np.pi) < 0.2, -8.0, -1.0)
VOLTS = 0.2 / 25.4e-6
ANGLES = {"A": 45, "B": 135, "C": 90}


def seen(angle):
    """Volts of a probe of 200 mV/mil at an angle [deg]."""
    return VOLTS * (X * np.cos(np.deg2rad(angle)) + Y * np.sin(np.deg2rad(angle)))


def entry(name, **more):
    return {"column": name, "unit": "V", "sensitivity": "200 mV/mil", "angle": f"{ANGLES[name]} deg"} | more


MAPPING = {
    "time": {"column": "t", "unit": "s"},
    "keyphasor": {"column": "key", "unit": "V"},
    "probes": {name: entry(name) for name in ANGLES},
}


@pytest.fixture
def lab(tmp_path):
    """Write a lab's file, some columns changed; give a change as None to leave the column out."""

    def make(name="lab.csv", **change):
        columns = {"t": T, "key": KEY} | {name: seen(angle) for name, angle in ANGLES.items()} | change
        columns = {k: v for k, v in columns.items() if v is not None}
        header = ",".join(columns)
        np.savetxt(tmp_path / name, np.column_stack(list(columns.values())), "%.9g", ",", header=header, comments="")
        return tmp_path / name

    return make


@pytest.mark.parametrize(
    ("column", "reason"),
    [
        (np.full_like(T, -12.0), "B is dead (constant at -12 V)"),
        (np.full_like(T, np.nan), "B is dead (all NaN or infinite V)"),
        (np.where(np.arange(T.size) % 7 < 3, 1e-3, 2e-3), "B is dead (never leaves 3 values from 0.001 to 0.002 V)"),
        (None, "B is missing (no column 'B'; the file has 't', 'key', 'A', 'C')"),
    ],
)
def test_a_dead_or_missing_probe_is_named_and_the_others_give_the_motion(lab, column, reason):
    record = idn.read(lab(B=column), MAPPING)
    assert idn.notes_of(record) == [f"probe {reason}, and was left out"]
    np.testing.assert_allclose(record["disc_measured"].sel(axis="x"), X, atol=1e-10)
    np.testing.assert_allclose(record["disc_measured"].sel(axis="y"), Y, atol=1e-10)


def test_a_single_probe_is_a_reading_along_its_angle(lab):
    record = idn.read(lab(), MAPPING | {"probes": {"A": entry("A", position="150 mm")}})
    np.testing.assert_allclose(record["probe_measured"].sel(probe="A"), seen(45) / VOLTS, atol=1e-10)
    assert "disc_measured" not in record and float(record["probe_position"][0]) == 0.15
    assert float(record["probe_angle"][0]) == pytest.approx(np.pi / 4)
    assert "probe A alone does not see both x and y" in idn.notes_of(record)[0]
    assert any("A alone" in text for text in idn.examine(record).warnings)


def test_without_a_living_probe_there_is_no_record(lab):
    file = lab(A=np.zeros_like(T), B=np.zeros_like(T), C=None)
    with pytest.raises(ReadError, match=r"probes: .*A is dead"):
        idn.read(file, MAPPING)


def test_clipped_probes_are_refused_with_their_limit(lab):
    limit = 0.06
    record = idn.load(lab(A=np.clip(seen(45), -limit, limit)), MAPPING)
    assert record.attrs["clipped"][0].startswith("A: rests at -0.06 V for")
    with pytest.raises(SchemaError, match=r"A: .* -0\.06 V"):
        idn.read(lab(A=np.clip(seen(45), -limit, limit)), MAPPING)


@pytest.mark.parametrize("codes", [3, 10, 100, 1000])
def test_coarse_converters_are_neither_clipped_nor_dead(codes):
    # so many codes of a converter for the amplitude of a sine, as a small motion in a wide range
    signal = np.round(codes * np.sin(2 * np.pi * 50.1 * np.arange(51200) / 51200 + 0.1)) * 1e-3
    assert clipped(signal) == () and dead(signal) == ""
    assert len(clipped(np.clip(signal, -0.8e-3 * codes, 1.0))) == (1 if codes > 3 else 0)


def test_gaps_and_missing_values_are_cut_out_and_said(lab, tmp_path):
    b = seen(135)
    b[2000:2010] = np.nan
    late = np.where(T > 3, T + 0.5, T)
    with pytest.raises(SchemaError):
        idn.read(lab(t=late, B=b), MAPPING)
    pieces = idn.whole_stretches(idn.load(lab(t=late, B=b), MAPPING))
    assert [piece.sizes["time"] for piece in pieces] == [2000, 12991, 4999]
    best = idn.longest(pieces)
    (note,) = idn.notes_of(best)
    assert note.startswith("cut: samples 2011 to 15001 of 20000, 0.402 s to 3 s; ")
    assert "10 samples without a value in disc_measured" in note and "1 gaps in time, the first after 3 s" in note
    idn.save(idn.validate(best), tmp_path / "best.nc")
    assert idn.notes_of(idn.read(tmp_path / "best.nc")) == [note]
    np.testing.assert_allclose(best["disc_measured"].sel(axis="x"), X[2010:15001], atol=1e-10)


def test_a_channel_without_any_value_is_left_out_of_the_cut(lab):
    record = idn.load(lab(spare=np.full_like(T, np.nan)), MAPPING | {
        "channels": {"pressure": {"column": "spare", "unit": "Pa"}}})  # fmt: skip
    (piece,) = idn.whole_stretches(record)
    assert "pressure" not in piece and "pressure has no value and was left out" in idn.notes_of(piece)[0]
    with pytest.raises(SchemaError, match="9 s"):
        idn.whole_stretches(record, 9.0)


def test_a_keyphasor_with_a_drop_out_gives_the_angle_of_each_stretch(lab):
    key = KEY.copy()
    key[10000:10050] = np.nan
    pieces = idn.whole_stretches(idn.load(lab(key=key), MAPPING))
    assert [piece.sizes["time"] for piece in pieces] == [10000, 9950]
    turns = (pieces[1]["angle"].values - 100 * np.pi * T[10050:]) / (2 * np.pi)
    assert np.ptp(turns) < 0.02 and abs(turns.mean() - round(turns.mean())) < 0.02


def test_the_disc_is_the_plane_that_is_chosen_and_others_are_readings(lab):
    near = {"A": entry("A", position="150 mm"), "B": entry("B", position="150 mm")}
    far = {"C": entry("C", position="520 mm")}
    record = idn.read(lab(), MAPPING | {"probes": near | far, "disc": {"position": "150 mm"}})
    np.testing.assert_allclose(record["disc_measured"].sel(axis="y"), Y, atol=1e-10)
    assert record["probe"].values.tolist() == ["C"] and float(record["probe_position"][0]) == 0.52
    with pytest.raises(ReadError, match=r"A 150 mm, B 150 mm, C 520 mm"):
        idn.read(lab(), MAPPING | {"probes": near | far})
    with pytest.raises(ReadError, match=r"disc.position: .*300 mm"):
        idn.read(lab(), MAPPING | {"probes": near | far, "disc": {"position": "300 mm"}})


def test_the_gap_voltage_of_a_dc_coupled_probe_is_taken_off(lab):
    raised = {name: seen(ANGLES[name]) - 10.0 for name in "AB"}
    probes = {name: entry(name, coupling="DC", gap="-10.05 V") for name in "AB"}
    record = idn.read(lab(**raised), MAPPING | {"probes": probes})
    # 0.05 V on both are 6.35 um along each
    np.testing.assert_allclose(record["disc_measured"].sel(axis="y"), Y + 6.35e-6 * np.sqrt(2), atol=1e-8)
    probes = {name: entry(name, coupling="DC", gap="mean") for name in "AB"}
    record = idn.read(lab(**raised), MAPPING | {"probes": probes})
    np.testing.assert_allclose(record["disc_measured"].sel(axis="x"), X, atol=1e-8)
    probes = {name: entry(name, coupling="AC") for name in "AB"}
    assert idn.notes_of(idn.read(lab(), MAPPING | {"probes": probes})) == ["AC-coupled, without a mean position: A, B"]


@pytest.mark.parametrize(
    ("probe", "shown"),
    [
        ({"coupling": "ac"}, "probes.A.coupling: 'ac'"),
        ({"coupling": "AC", "gap": "-10 V"}, "probes.A.gap: .*AC"),
        ({"gap": -10}, "probes.A.gap: -10"),
        ({"gap": "10 mil"}, "probes.A.gap: unit 'mil'"),
        ({"position": "150"}, "probes.A.position: '150'"),
        ({"unit": "um", "sensitivity": None, "gap": "-10 V"}, "probes.A.gap"),
    ],
)
def test_wrong_entries_of_a_probe_are_named(lab, probe, shown):
    table = {key: value for key, value in (entry("A") | probe).items() if value is not None}
    with pytest.raises(ReadError, match=shown):
        idn.read(lab(), MAPPING | {"probes": {"A": table, "B": entry("B")}})


def test_a_file_that_mixes_units_is_refused_where_the_mapping_states_none(tmp_path):
    rows = "\n".join(f"{t:.4f},{x * 1e6:.6f},{y / 25.4e-6:.6f}" for t, x, y in zip(T[:99], X, Y, strict=False))
    (tmp_path / "a.csv").write_text(f"t [s],X [um],Y [mil]\n{rows}\n")
    probes = {"A": {"column": "X", "angle": "0 deg"}, "B": {"column": "Y", "angle": "90 deg"}}
    with pytest.raises(ReadError, match=r"probes.A in um, probes.B in mil"):
        idn.read(tmp_path / "a.csv", {"time": {"column": "t"}, "probes": probes})
    stated = {name: part | {"unit": unit} for (name, part), unit in zip(probes.items(), ("um", "mil"), strict=True)}
    record = idn.read(tmp_path / "a.csv", {"time": {"column": "t"}, "probes": stated})
    np.testing.assert_allclose(record["disc_measured"].sel(axis="y"), Y[:99], atol=1e-10)


@pytest.mark.parametrize(
    ("unit", "sensitivity", "si", "value"),
    [
        ("mV", "100 mV/g", "m/s^2", 0.0980665),
        ("V", "4 mV/(mm/s)", "m/s", 0.25),
        ("V", "200 mV/mil", "m", 127e-6),
        ("g", None, "m/s^2", 9.80665),
        ("in/s", None, "m/s", 0.0254),
        ("mils", None, "m", 25.4e-6),
    ],
)
def test_readings_of_accelerometers_and_velocity_sensors(tmp_path, unit, sensitivity, si, value):
    (tmp_path / "a.csv").write_text("t,a\n0,1\n0.1,2\n0.2,1\n")
    column = {"column": "a", "unit": unit} | ({"sensitivity": sensitivity} if sensitivity else {})
    mapping = {"time": {"column": "t", "unit": "s"}, "channels": {"probe_measured": {"a": column}}}
    record = idn.read(tmp_path / "a.csv", mapping)
    assert record["probe_unit"].values.tolist() == [si]
    assert record["probe_measured"].values[0, 0] == pytest.approx(value)


def test_a_rig_with_accelerometers_and_a_tachometer_is_read(tmp_path):
    t = np.arange(50_000) / 50_000
    pulses = np.where((60 * np.pi * t) % (2 * np.pi) < 0.3, 4.0, 0.1)
    waves = [0.1 * np.sin(60 * np.pi * t + k) for k in range(7)]
    np.savetxt(tmp_path / "12.288.csv", np.column_stack([pulses, *waves]), "%.6g", ",")
    channels = {f"a{i}": {"column": i, "unit": "V", "sensitivity": "100 mV/g"} for i in range(2, 8)}
    mapping = {
        "time": {"sample_rate": "50 kHz"},
        "keyphasor": {"column": 1, "unit": "V", "edge": "rising"},
        "channels": {"probe_measured": channels},
    }
    record = idn.resample(idn.read(tmp_path / "12.288.csv", mapping), 5000.0)
    assert record["probe_unit"].values.tolist() == ["m/s^2"] * 6
    assert float(record["speed"].median()) == pytest.approx(60 * np.pi, rel=1e-3)
    a = record["probe_measured"].sel(probe="a2").values[100:-100]
    assert np.abs(a).max() == pytest.approx(9.80665, rel=0.01)


WAVEFORM = """Machine Name:,Rotor kit
Point Name:,DE Horizontal
Probe Angle:,45 Right
Variable:,Waveform
Sample Speed:,1800 rpm
X-Axis Value,Y-Axis Value
ms,mil
0,0.1
0.5,0.2
1.0,0.15
"""
TREND = """Machine Name:;Rotor kit;;
Point Name: DE X;;;
Speed Units:;rpm;;
Speed (rpm);1X Amp (mil pp);1X Phase (deg)
600;1,5;30
900;2,5;40
1200;4,0;60
"""


def test_exports_of_a_vibration_monitor_are_read(tmp_path):
    (tmp_path / "wave.csv").write_text(WAVEFORM)
    table = idn.columns(tmp_path / "wave.csv")
    assert [(c.name, c.unit) for c in table.columns] == [("X-Axis Value", "ms"), ("Y-Axis Value", "mil")]
    probe = {"column": "Y-Axis Value", "angle": "45 deg"}
    mapping = {"time": {"column": "X-Axis Value"}, "probes": {"DE": probe}, "constants": {"speed": "1800 rpm"}}
    record = idn.read(tmp_path / "wave.csv", mapping)
    assert record["probe_measured"].values[:, 0] == pytest.approx(np.array([0.1, 0.2, 0.15]) * 25.4e-6)
    (tmp_path / "trend.csv").write_text(TREND)
    table = idn.columns(tmp_path / "trend.csv")
    assert [(c.name, c.unit) for c in table.columns] == [("Speed", "rpm"), ("1X Amp", "mil pp"), ("1X Phase", "deg")]
    assert table.columns[1].values.tolist() == [1.5, 2.5, 4.0]
