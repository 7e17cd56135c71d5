"""Warnings of linear analyses: beyond the tables of bearings, above the onset of whirl, extremes at an end."""

import gc
import json
import sys
import weakref
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from scipy.special import wofz

from fe_shaft.spectrum import modes_in as everything_in
from rotorsim.analysis import campbell, map_machine, mode_shapes, unbalance_response
from rotorsim.analysis.campbell import default_speeds, highest_speed, top_speed
from rotorsim.analysis.shaft_motion import TOO_FAST, largest_response, passed_too_fast, peak_of, unbalances_of
from rotorsim.analysis.whirl_onset import onset_beyond, stability_limit
from rotorsim.cli import main
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from rotorsim.plant.validity import linear_warnings
from rotorsim.signals.record_blocks import open_record

RPM = np.pi / 30


@pytest.fixture(scope="module")
def pump():
    return Plant("pump_on_tables")


def ends(plant):
    """Lowest and highest speed [rad/s] of the tables."""
    tables = [b.speeds for b in plant.machine.bearings if hasattr(b, "speeds")]
    return max(t[0] for t in tables), min(t[-1] for t in tables)


def sentences(found):
    return str(found.attrs.get("warnings", "")).splitlines()


def test_speeds_beyond_the_tables_are_said_and_those_within_are_not(pump):
    low, high = ends(pump)
    within = [low * 1.001 + 0.1, high * 0.999]
    assert not any("table" in one for one in sentences(unbalance_response(pump, within)))
    found = sentences(unbalance_response(pump, [within[0], 1.2 * high]))
    assert sum(f"{1.2 * high / RPM:.0f} rpm, and the table of the bearing" in one for one in found) == 2
    assert all(f"ends at {high / RPM:.0f} rpm" in one for one in found if "table" in one)
    assert any("ends at" in one for one in sentences(campbell(pump, [within[0], 1.2 * high], modes=2)))
    if low > 0:
        found = sentences(unbalance_response(pump, [0.5 * low, high]))
        assert any("begins at" in one for one in found)


def test_without_unbalance_nothing_moves():
    found = unbalance_response(Plant("plain_rotor"), [100.0, 300.0], unbalances=[])
    assert (found["major"] == 0).all() and (found["zeta_least"] > 0).all()


def test_a_response_keeps_no_model_of_a_speed_that_it_has_left(monkeypatch):
    """Two of them at most: the one before is there until the next is, and its modes begin the next search."""
    alive, linearise = list[weakref.ref](), Plant.linearise

    def watched(self, *at):
        gc.collect()
        assert sum(one() is not None for one in alive) <= 2
        model = linearise(self, *at)
        alive.append(weakref.ref(model))
        return model

    monkeypatch.setattr(Plant, "linearise", watched)
    unbalance_response(Plant("dtu_gas_bearing"), np.linspace(100.0, 500.0, 6), 0.5e6)
    assert len(alive) == 6


def test_speeds_of_the_other_sense_are_beyond_a_table_too(pump):
    _, high = ends(pump)
    forward, backward = (linear_warnings(pump, [sign * 1.2 * high]) for sign in (1, -1))
    assert forward == backward and forward


def unstable():
    """A rotor with internal friction, whose whirl begins where the damping of its bearings is used up."""
    machine = load_machine("plain_rotor")
    return Plant(machine.replace("effects.internal_damping.time", "0.2 ms"))


def test_speeds_at_which_a_mode_grows_are_said_and_are_no_peak():
    plant = unstable()
    speeds = np.linspace(50.0, 2500.0, 40)
    found = unbalance_response(plant, speeds)
    zeta = found["zeta_least"].values
    assert zeta.min() < 0 < zeta.max()
    onset = speeds[np.flatnonzero(zeta < 0)[0]]
    last = speeds[np.flatnonzero(zeta < 0)[0] - 1]
    text = f"a mode grows from between {last / RPM:.0f} and {onset / RPM:.0f} rpm on"
    assert any(one.startswith(text) for one in sentences(found))
    peak = peak_of(found, "measuring plane")
    assert peak["rpm"] * RPM < onset
    calm = speeds[zeta > 0]
    assert not any("grows" in one for one in sentences(unbalance_response(plant, calm)))


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_growth_lies_between_the_last_steady_and_the_first_growing_speed_of_each_sense(pump, sense):
    rpm = np.array([100.0, 200.0, 300.0, 400.0, 500.0])
    zeta = np.array([0.1, np.nan, -0.1, -0.2, 0.1])
    order = np.argsort(sense * rpm)
    (text,) = (one for one in linear_warnings(pump, (sense * rpm * RPM)[order], zeta[order])["warnings"].splitlines()
               if "grows" in one)  # fmt: skip
    a, b, c, d = (f"{sense * one:.0f}" for one in (100, 300, 400, 500))
    assert f"from between {a} and {b} rpm on up to between {c} and {d} rpm" in text


def test_a_machine_without_feed_has_no_pressure():
    plant = Plant("plain_rotor")
    found = unbalance_response(plant, [100.0], 0.5e6), campbell(plant, [100.0, 110.0], 0.5e6, modes=1)
    found += (mode_shapes(plant, 100.0, 0.5e6),)
    assert [one.attrs["pressure"] for one in found] == [0.0] * 3


def test_speeds_that_the_film_does_not_carry_are_said(pump):
    rpm, carried = np.array([100.0, 200.0, 300.0, 400.0]), [False, False, True, False]
    found = linear_warnings(pump, rpm * RPM, np.full(4, 0.1), carried=carried)["warnings"]
    assert "the film does not carry at 100 to 200 rpm, 400 rpm (3 of 4 speeds)" in found
    assert "carry" not in linear_warnings(pump, rpm * RPM, np.full(4, 0.1)).get("warnings", "")


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_peak_next_to_a_growing_mode_lies_at_the_last_steady_speed(sense):
    speeds = np.sort(sense * np.linspace(50.0, 2500.0, 40))
    found = unbalance_response(unstable(), speeds)
    size, grows = found["major"].copy(), found["zeta_least"].values < 0
    steady = np.flatnonzero(~grows)
    size[:] = 1e-6
    size[steady[-1] if sense > 0 else steady[0]] = 2e-6
    assert peak_of(found.assign(major=size), "measuring plane")["at_end"] == "last steady"


def test_a_peak_at_an_end_of_the_speeds_is_told_from_one_inside():
    plant = Plant("plain_rotor")
    wide = unbalance_response(plant, np.linspace(20.0, 600.0, 60))
    inside = peak_of(wide, "measuring plane")
    assert inside["at_end"] == ""
    critical = inside["rpm"] * RPM
    below = peak_of(unbalance_response(plant, np.linspace(0.3, 0.9, 10) * critical), "measuring plane")
    above = peak_of(unbalance_response(plant, np.linspace(1.1, 1.5, 10) * critical), "measuring plane")
    assert (below["at_end"], above["at_end"]) == ("end", "start")


def test_the_command_says_it_in_json_on_the_terminal_and_on_the_page(tmp_path, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["response", "pump_on_tables", "--speeds", "500 rpm:20000 rpm:5", "--out", str(tmp_path / "r"), "--json"])
    shown = capsys.readouterr()
    assert not ended.value.code
    warnings = json.loads(shown.out)["warnings"]
    assert any("the table of the bearing" in one for one in warnings)
    assert all(f"warning: {one}" in shown.err for one in warnings)
    header, *rows = (tmp_path / "r" / "response.csv").read_text(encoding="utf-8").splitlines()
    assert header.endswith(",zeta_least [1]") and len(rows) == 5
    page = (tmp_path / "r" / "report.html").read_text(encoding="utf-8")
    assert "Warning: 20000 rpm, and the table of the bearing" in page


@pytest.mark.parametrize("coupling", ["40 MN/m", "60 MN/m"])
def test_a_rotor_that_a_bearing_pushes_away_is_neither_stable_nor_safe(coupling, capsys, tmp_path):
    """A stiffness matrix k, c; c, k has the value k - c < 0: growth without oscillation, however fast."""
    machine = load_machine("plain_rotor")
    for bearing in (0, 1):
        for path in ("kxy", "kyx"):
            machine = machine.replace(f"bearings.{bearing}.{path}", coupling)
    plant, speeds = Plant(machine), np.array([100.0, 200.0])
    poles = np.linalg.eigvals(plant.linearise(100.0).A)
    assert ((np.abs(poles.imag) < 1e-9 * np.abs(poles)) & (poles.real > 1)).any()
    assert map_machine(plant, speeds, [0.0], workers=1)["safe"].values.tolist() == [[0, 0]]
    onset, frequency, looked = stability_limit(plant, 0.0, 200.0)
    assert (onset, frequency, looked) == (0.0, 0.0, 1.0)
    assert np.isnan(largest_response(plant, 0.0, 200.0, unbalances_of(machine, 200.0))[0])
    machine.save(tmp_path / "away.toml")
    with pytest.raises(SystemExit) as ended:
        main(["campbell", str(tmp_path / "away.toml"), "--speeds", "900 rpm:2000 rpm:3", "--json", "--out",
              str(tmp_path / "out")])  # fmt: skip
    assert ended.value.code == 0
    assert "without oscillation" in json.loads(capsys.readouterr().out)["warnings"][0]


@pytest.mark.parametrize("mass", ["3 kg", "5 kg"])
def test_the_largest_response_is_the_height_of_a_peak_however_sharp(mass):
    """Damping ratio .002: the peak is 11 rpm wide, a step of the scan 250 rpm."""
    machine = load_machine("plain_rotor").replace("discs.0.mass", mass)
    plant = Plant(machine)
    size, speed = largest_response(plant, 0.0, 6000 * RPM, unbalances_of(machine, 6000 * RPM))
    fine = unbalance_response(plant, speed + RPM * np.linspace(-8, 8, 161))["major"].sel(place="measuring plane").values
    assert size == pytest.approx(fine.max(), rel=1e-4) and fine[[0, -1]].max() < 0.7 * size


SLOW = pytest.mark.slow
SHIPPED = {"bently_rk4": 4900, "dtu_gas_bearing": 20e3, "dtu_first_assembly": 20e3, "plain_rotor": 8000,
           "pump_on_tables": 5000, "rigid_rotor_self_acting": 25e3, "foil_turbo_rotor": 30e3,
           "aerostatic_spindle": 75e3, "grooved_turbo_rotor": 200e3}  # fmt: skip
"""Highest default speed [rpm]: stated by the drive, the last of the tables, or three times the first frequency."""


@pytest.mark.parametrize("name", SHIPPED)
def test_the_default_speeds_reach_the_speed_that_a_machine_is_made_for(name):
    plant = Plant(name)
    speeds = default_speeds(plant, 10)
    assert speeds[0] == 0 and len(speeds) == 11 and speeds[-1] == pytest.approx(SHIPPED[name] * RPM, rel=1e-9)
    assert highest_speed(plant) >= (plant.machine.drive.highest_speed or 0)


@pytest.mark.parametrize("name", [*list(SHIPPED)[:6], *(pytest.param(name, marks=SLOW) for name in list(SHIPPED)[6:])])
def test_the_default_speeds_reach_the_onset_and_a_sentence_points_to_it_from_below(name):
    """The other side is the search of the onset from rest."""
    plant = Plant(name)
    pressure = 0.5e6 if plant.machine.fed else 0.0
    onset = stability_limit(plant, pressure, highest_speed(plant))[0]
    assert np.isnan(onset) or onset < top_speed(plant)
    stated = onset_beyond(plant, 0.6 * np.nan_to_num(onset, nan=top_speed(plant)), [pressure])
    if np.isfinite(onset):
        assert float(stated.split(" rpm")[0].split()[-1]) == pytest.approx(onset / RPM, rel=2e-4)
    else:
        assert stated == ""
    assert onset_beyond(plant, top_speed(plant), [pressure]) == ""


def test_a_shaft_that_turns_the_other_way_has_the_onset_of_its_mirror_image():
    plant = unstable()
    onset, frequency, _ = stability_limit(plant, 0.0, top_speed(plant), 1e-4)
    stated = [onset_beyond(plant, sign * 0.6 * onset, [0.0]) for sign in (1, -1)]
    assert [float(one.split(" rpm")[0].split()[-1]) for one in stated] == pytest.approx(
        [onset / RPM, -onset / RPM], rel=2e-4
    )
    assert [float(one.split(" Hz")[0].split()[-1]) for one in stated] == pytest.approx(
        [frequency / (2 * np.pi)] * 2, rel=1e-3
    )
    assert [onset_beyond(plant, sign * top_speed(plant), [0.0]) for sign in (1, -1)] == ["", ""]


@pytest.mark.parametrize("command", ["response", "campbell"])
def test_speeds_of_both_senses_point_to_the_onset_in_the_sense_of_the_fastest(command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    given = ["--set", "effects.internal_damping.time=0.2 ms", "--speeds", "-800 rpm:100 rpm:4", "--json", "--no-report"]
    with pytest.raises(SystemExit) as ended:
        main([command, "plain_rotor", *given])
    assert not ended.value.code
    above = json.loads(capsys.readouterr().out)["above_asked"]
    assert float(above.split(" rpm")[0].split()[-1]) < -800


@pytest.mark.parametrize("sign", [1, -1])
def test_an_onset_that_is_not_looked_for_is_said(sign, monkeypatch):
    plant, searched = unstable(), sys.modules["rotorsim.analysis.whirl_onset"]
    onset = stability_limit(plant, 0.0, top_speed(plant), 1e-4)[0]
    low, modes_in = 0.5 * onset, everything_in
    monkeypatch.setattr("fe_shaft.follower.modes_in", lambda *given: replace(modes_in(*given), missing=np.nan))
    monkeypatch.setattr(searched, "modes_in", lambda *given: replace(modes_in(*given), missing=np.nan))
    assert "a mode may be missing" in onset_beyond(plant, sign * low, [0.0])
    monkeypatch.setattr(searched, "top_speed", lambda _: 0.8 * onset)
    stated = onset_beyond(plant, sign * low, [0.0])
    assert stated.startswith(f"not looked at above {sign * low / RPM:.0f} rpm")


def passage(beta):
    """Largest amplitude of a mode over its steady one, swept with an acceleration beta (zeta omega)^2; Lewis (1932)."""
    late, root = np.linspace(-2 / beta - 3, 3 / beta + 20, 100_001), np.sqrt(-0.5j * beta)
    return np.abs(np.sqrt(np.pi) / (2 * root) * wofz(1j * (1 + 1j * beta * late) / (2 * root))).max()


def test_a_ramp_is_too_fast_where_the_closed_form_falls_five_per_cent_short():
    assert passage(0.01) == pytest.approx(1.0, abs=1e-4) and passage(TOO_FAST) == pytest.approx(0.95, abs=0.005)
    plant = Plant("plain_rotor")
    found = campbell(plant, np.linspace(0.0, 400.0, 5))
    first = found["critical_order"].values == 1
    limits = TOO_FAST * (found["critical_zeta"].values[first] * found["critical_speed"].values[first]) ** 2
    for rate, fast in ((0.99 * limits.min(), False), (1.01 * limits.min(), True)):
        time = np.linspace(0.0, 300.0 / rate, 20_001)
        stated = passed_too_fast(plant, xr.Dataset({"speed": ("time", 50.0 + rate * time)}, {"time": time}), 0.0)
        assert bool(stated) == fast and (not fast or f"{limits.min() / RPM:.3g} rpm/s" in stated)
        below = xr.Dataset({"speed": ("time", 0.3 * (50.0 + rate * time))}, {"time": time})
        assert passed_too_fast(plant, below, 0.0) == ""


def test_a_ramp_that_is_too_fast_is_said_in_the_record_and_by_python(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    given = ["--start", "2500 rpm", "--stop", "2800 rpm", "--rate", "30 krpm/s", "--out", "out", "--json"]
    with pytest.raises(SystemExit) as ended:
        main(["runup", "plain_rotor", *given, "--no-report"])
    assert not ended.value.code
    stated = json.loads(capsys.readouterr().out)["passed_too_fast"]
    with open_record(tmp_path / "out" / "runup.nc") as record:
        assert record.attrs["passed_too_fast"] == stated
        assert stated.startswith("2647 rpm") and passed_too_fast(Plant("plain_rotor"), record) == stated
