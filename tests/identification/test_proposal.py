"""Proposed mappings: names, stated units and values are guessed, every guess is marked, the text is a mapping."""

import tomllib

import numpy as np
import pytest

import identification as idn
from identification.records.columns import Column, DataTable, split_name

T = np.arange(2000) / 5000
W = 100 * np.pi


def proposed(**columns):
    table = DataTable("CSV", tuple(Column(name.replace("__", " "), values) for name, values in columns.items()))
    return idn.propose(table, "run.csv")


@pytest.mark.parametrize("name", ["Wellenwinkel [rad]", "Winkel [deg]", "Shaft angle", "Angle de rotation [rad]",
                                  "Ángulo del eje [deg]", "Angolo [rad]"])  # fmt: skip
def test_an_angle_of_the_shaft_is_one_that_turns_as_fast_as_the_speed(name):
    """A run-up from 20 to 40 Hz; an angle that turns half as fast, or a phase that stays, is none."""
    speed = 2 * np.pi * (20 + 50 * T)
    turned = 2 * np.pi * (20 * T + 25 * T**2)
    unit = 180 / np.pi if "deg" in name else 1.0
    plain, stated = split_name(name)

    def found(angle):
        columns = (Column("Zeit", T, "s"), Column("Drehzahl", speed * 30 / np.pi, "rpm"), Column(plain, angle, stated))
        return tomllib.loads(idn.propose(DataTable("CSV", columns), "run.csv")[0])["channels"]

    for angle in (turned, np.mod(turned, 2 * np.pi)):
        assert found(unit * angle)["angle"] == {"column": plain, "unit": stated or "rad"}
    for other in (0.5 * turned, 0.3 + 0 * T):
        assert "angle" not in found(unit * other)


@pytest.fixture
def lab(tmp_path):
    columns = {
        "Time [ms]": T * 1e3, "DE 45R": -9.8 + 0.2 * np.cos(W * T), "DE 45L": -10.2 + 0.2 * np.sin(W * T),
        "Keyphasor": np.where((W * T) % (2 * np.pi) < 0.3, -8, -1), "Supply pressure": np.full(2000, 3.1),
        "U1": np.sin(W * T), "spare": T * 0,
    }  # fmt: skip
    np.savetxt(tmp_path / "a.csv", np.column_stack(list(columns.values())), "%.7g", ",", header=",".join(columns),
               comments="")  # fmt: skip
    return tmp_path / "a.csv"


def test_a_laboratorys_file_is_read_with_what_is_proposed(lab, tmp_path):
    text, incomplete = idn.propose(idn.columns(lab), "a.csv")
    (tmp_path / "a.toml").write_text(text)
    assert incomplete == 2 and '# not known: column 7, "spare", from 0 to 0' in text
    record = idn.read(lab, tmp_path / "a.toml")
    assert float(record["speed"].median()) == pytest.approx(W, rel=1e-3)
    assert float(record["pressure"][0]) == pytest.approx(3.1e5)
    width = np.ptp(record["disc_measured"].sel(axis="x").values)
    assert width == pytest.approx(2 * 25.4e-6, rel=0.01)
    tables = tomllib.loads(text)
    assert tables["probes"]["DE_45R"]["angle"] == "45 deg" and tables["probes"]["DE_45L"]["angle"] == "135 deg"
    assert tables["probes"]["DE_45L"]["gap"] == "-10.2 V" and "reference" not in tables["channels"]
    for line in ('unit = "V"    # from the values, as a gap voltage', 'unit = "ms"    # from the file',
                 'unit = "bar"    # from the values', "# the other axis is not known:"):  # fmt: skip
        assert line in text


@pytest.mark.parametrize(
    ("name", "kind", "unit"),
    [("time ms", "time", "ms"), ("t_ms", "time", "ms"), ("Time_s", "time", "s"), ("zeit us", "time", "us"),
     ("speed rpm", "speed", "rpm"), ("speed_rad_s", "speed", "rad/s"), ("n_rpm", "speed", "rpm"),
     ("omega rad/s", "speed", "rad/s"), ("speed_Hz", "speed", "Hz"), ("p_MPa", "pressure", "MPa"),
     ("p_kPa", "pressure", "kPa"), ("supply kPa", "pressure", "kPa")],
)  # fmt: skip
def test_a_unit_may_end_the_name_without_brackets(name, kind, unit):
    text, incomplete = proposed(**{name: T * 1e3})
    tables = tomllib.loads(text)
    assert incomplete == 0 and (tables | tables.get("channels", {}))[kind] == {"column": name, "unit": unit}
    assert f'unit = "{unit}"    # from the name' in text


@pytest.mark.parametrize(("one", "two"), [("drive x mV", "drive y mV"), ("refX_mV", "refY_mV")])
def test_millivolts_of_a_name_are_no_volts(one, two):
    text, incomplete = proposed(**{one: T * 1e3, two: T * 1e3})
    assert incomplete == 0
    assert [e["unit"] for e in tomllib.loads(text)["channels"]["reference"].values()] == ["mV", "mV"]
    assert text.count('unit = "mV"    # from the name') == 2


@pytest.mark.parametrize(("scale", "unit"), [(1, "s"), (1e3, "ms"), (1e6, "us")])
def test_the_unit_of_a_time_is_guessed_by_its_step(scale, unit):
    assert tomllib.loads(proposed(t=T * scale)[0])["time"]["unit"] == unit


def test_entries_that_are_comments_are_not_counted_as_complete():
    names = ("time s", "drive A mV", "drive B mV", "probe A um", "probe B um", "shaft rpm", "supply bar")
    text, incomplete = proposed(**dict.fromkeys(names, T))
    assert incomplete == 2 and text.count("# [channels.reference.x]") == 2
    assert set(tomllib.loads(text)["channels"]["probe_measured"]) == {"probe_A_um", "probe_B_um"}


@pytest.mark.parametrize("size", [0.03, 0.4, 5.0])
def test_a_unit_that_several_rigs_could_mean_is_not_guessed(size):
    text, incomplete = proposed(t=T, X=size * np.cos(W * T), Y=size * np.sin(W * T))
    assert incomplete == 2 and "disc_measured" not in text and "its unit is not stated" in text


@pytest.mark.parametrize(("factor", "unit"), [(60.0, "rpm"), (1.0, "Hz"), (2 * np.pi, "rad/s")])
@pytest.mark.parametrize("name", ["speed", "N1"])
def test_a_speed_is_known_by_the_pulses_that_it_goes_with(factor, unit, name):
    t = np.arange(20_000) / 10_000
    f = 20 + 15 * t
    turn = 2 * np.pi * np.cumsum(f) / 10_000
    text, _ = proposed(t=t, **{name: factor * f}, trigger=np.where(turn % (2 * np.pi) < 0.4, 5.0, 0.0))
    tables = tomllib.loads(text)
    assert tables["channels"]["speed"] == {"column": name, "unit": unit}
    assert tables["keyphasor"] == {"column": "trigger", "unit": "V", "edge": "rising"}


def test_pulses_of_a_turn_follow_from_the_speed():
    t = np.arange(20_000) / 10_000
    teeth = np.where((20 * 2 * np.pi * 30 * t) % (2 * np.pi) < 3, 5.0, 0.0)
    text, _ = proposed(t=t, tacho=teeth, rpm=np.full(t.size, 1800.0))
    assert tomllib.loads(text)["keyphasor"]["pulses"] == 20


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_a_name_that_its_values_refuse_is_left_out_with_the_reason(noise):
    rng = np.random.default_rng(0)
    wild = rng.standard_normal(2000)
    text, incomplete = proposed(t=T, tacho=wild, supply__pressure=wild, shaft__speed=wild, load__N=1000 + noise * wild)
    assert incomplete == 4 and set(tomllib.loads(text)) == {"time"}
    assert "no even pulses" in text and "too fast for a pressure" in text


@pytest.mark.parametrize("axis", ["x", "y"])
def test_the_direction_of_a_hammer_is_that_of_the_answer(axis):
    t = np.arange(10_000) / 10_000
    blow = np.where((t > 0.3) & (t < 0.302), 150.0, 0.0)
    ring = np.where(t > 0.3, 40 * np.exp(-30 * (t - 0.3)) * np.sin(900 * (t - 0.3)), 0.0)
    x, y = (ring, 0.1 * ring) if axis == "x" else (0.1 * ring, ring)
    base = 3 * np.random.default_rng(0).standard_normal((2, t.size))
    text, incomplete = proposed(t=t, hammer__N=blow, X__um=x + base[0], Y__um=y + base[1])
    hammer = tomllib.loads(text)["hammer"]
    assert incomplete == 0 and hammer["angle"] == {"x": "0 deg", "y": "90 deg"}[axis]


def test_probes_of_two_planes_are_not_taken_for_one():
    motion = {f"{name}__um": 30 * np.cos(W * T + k) for k, name in enumerate(("DE_X", "DE_Y", "NDE_X", "NDE_Y"))}
    text, incomplete = proposed(t=T, **motion)
    channels = tomllib.loads(text)["channels"]
    assert incomplete == 0 and channels["disc_measured"]["x"]["column"] == "DE_X um"
    assert set(channels["probe_measured"]) == {"NDE_X_um", "NDE_Y_um"}


def test_columns_of_one_name_go_by_their_numbers():
    table = DataTable("CSV", tuple(Column(name, v, "um") for name, v in (("X", T * 1e3), ("CH", T), ("CH", 2 * T))))
    entries = tomllib.loads(idn.propose(table, "a")[0])["channels"]["probe_measured"]
    assert [entry["column"] for entry in entries.values()][-2:] == [2, 3]


@pytest.mark.parametrize("unit", ["um", "mm", "mil", "m"])
@pytest.mark.parametrize("gap", [" ", "_"])
def test_a_unit_ends_the_names_of_both_axes(gap, unit):
    text, incomplete = proposed(**{f"x{gap}{unit}": T * 1e3, f"Y{gap}{unit}": T * 1e3})
    disc = tomllib.loads(text)["channels"]["disc_measured"]
    assert incomplete == 0
    assert disc == {n.lower(): {"column": f"{n}{gap}{unit}", "unit": unit} for n in "xY"}


def test_external_references_are_proposed_by_axis():
    text, incomplete = proposed(reference_external_x=T, reference_external_y=T)
    assert incomplete == 0 and set(tomllib.loads(text)["channels"]["reference_external"]) == {"x", "y"}


def test_vectors_are_proposed_by_order_and_axis():
    speed = np.linspace(500, 3000, 50)
    x = {"X_1X_amp_mil": speed / 1e4, "X_1X_phase_deg": speed / 10}
    y = {"Y__1X__Amplitude": speed / 10, "Y__1X__Phase": speed / 9}
    text, incomplete = proposed(rpm=speed, **x, **y)
    tables = tomllib.loads(text)
    assert incomplete == 0 and tables["speed"] == {"column": "rpm", "unit": "rpm"}
    assert tables["vectors"]["1X"]["x"]["amplitude"] == {"column": "X_1X_amp_mil", "unit": "mil"}
    assert tables["vectors"]["1X"]["y"]["phase"] == {"column": "Y 1X Phase", "unit": "deg"}
    assert "a lag, else add sign = -1" in text and "0-pk unless" in text


def test_what_is_missing_is_a_comment():
    text, incomplete = proposed(X=T * 1e3, Y=T * 1e3)
    assert incomplete == 0 and set(tomllib.loads(text)) == {"channels"}
    for line in ("# No time was found", "# No speed, angle or keyphasor was found", '# pressure = "? MPa"'):
        assert line in text
    text, incomplete = proposed(foo=T, bar=T)
    assert incomplete == 2 and tomllib.loads(text) == {}


def test_names_of_any_kind_give_toml():
    odd = {'a "b" \\ x': T, "x\x7f": T, "\u2028y": T, "": T, "probe probe": T * np.nan, "time": T, "time ": T}
    table = DataTable("CSV", tuple(Column(name, values) for name, values in odd.items()))
    tomllib.loads(idn.propose(table, "a\nb.csv")[0])


@pytest.mark.parametrize(
    ("heading", "kind"),
    [
        ("acc [m/s²]", "channels"), ("acc [G]", "channels"), ("speed [rev/min]", "channels"),
        ("Disp X [Volts]", "probes"),
        ("Supply pressure (PSI)", "channels"), ("Time [Seconds]", "time"),
    ],
)  # fmt: skip
def test_a_unit_that_is_read_is_proposed_as_it_is_spelled(tmp_path, heading, kind):
    (tmp_path / "a.csv").write_text(f"{heading},spare\n" + "".join(f"{k},0\n" for k in range(50)), encoding="utf-8")
    text, _ = idn.propose(idn.columns(tmp_path / "a.csv"), "a.csv")
    assert kind in tomllib.loads(text) and 'unit = "?"' not in text
    assert f'unit = "{heading.split(" ")[-1][1:-1]}"' in text


@pytest.mark.parametrize(
    ("heading", "name", "unit"),
    [("t / s", "t", "s"), ("x/µm", "x", "µm"), ("n / min⁻¹", "n", "min⁻¹"), ("CH1 in V", "CH1", "V"),
     ("in s", "in s", "s"), ("Once/rev", "Once/rev", None), ("Data1/Time", "Data1/Time", None),
     ("rad/s", "rad/s", None),
     ("T_oil (°C)", "T_oil", "°C")],
)  # fmt: skip
def test_headings_have_their_unit_in_brackets_behind_a_stroke_or_in_words(heading, name, unit):
    assert split_name(heading) == (name, unit)


@pytest.mark.parametrize("name", ["Probe +45°", "Probe -45°", "P 45deg", "X probe 135 deg"])
def test_an_angle_without_a_side_is_not_taken_for_one_from_x(name):
    column = Column(name, 30 * np.cos(W * T), "um")
    other = Column("other [um]", 30 * np.sin(W * T), "um")
    text, _ = idn.propose(DataTable("CSV", (Column("t", T, "s"), column, other)), "a")
    assert "45" not in str([entry.get("angle") for entry in tomllib.loads(text).get("probes", {}).values()])


def test_oil_sound_and_bearing_forces_are_no_channels():
    quiet = 3.0 + 1e-3 * np.sin(W * T)
    text, incomplete = proposed(t=T, oil__pressure__bar=quiet, sound__pressure__Pa=quiet, bearing__force__X__N=quiet,
                                motor__current__A=quiet, shaft__torque__Nm=quiet)  # fmt: skip
    assert incomplete == 5 and set(tomllib.loads(text)) == {"time"}
