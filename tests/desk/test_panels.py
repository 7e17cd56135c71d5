"""Panels: their numbers are those of Python and of the scripts that the page shows; an answer is plain data."""

import csv
import shlex
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import orjson
import pytest
import xarray as xr

import rotorsim as rs
from rotorsim.analysis.campbell import top_speed
from rotorsim.analysis.design_review import MISSED
from rotorsim.base.errors import DataError, MachineFileError, NoLiftOffError
from rotorsim.cli import main
from rotorsim.desk import open_design
from rotorsim.desk.panels import (
    CLEARANCES,
    LARGE,
    MOST_VALUES,
    PANELS,
    DesignCase,
    DeskPoint,
    RememberingPlant,
    answer,
    as_commands,
    as_python,
    in_order,
    point_of,
)
from rotorsim.desk.server import answer_of, make_desk
from rotorsim.machine import machine_text
from rotorsim.plant.mesh import Mesh
from rotorsim.report.design import answered, tables
from rotorsim.report.linear import criticals, peaks
from rotorsim.report.page import cells

LINEAR = ("plain_rotor", "bently_rk4", "pump_on_tables")


@pytest.fixture(scope="module", params=LINEAR)
def case(request):
    return DesignCase(rs.load_machine(request.param))


def test_every_panel_is_plain_data_whose_curves_have_a_value_at_each_place(case):
    for name in PANELS:
        found = orjson.loads(orjson.dumps(answer(case, name)))
        assert found["notes"] and all(isinstance(cell, str) for row in found.get("rows", []) for cell in row)
        for one in found.get("curves", []):
            assert len(one["x"]) == len(one["y"]) > 1


def test_the_script_in_python_gives_the_tables_of_the_panels(case):
    space = {}
    exec(as_python(case, case.machine.name), space)
    assert answer(case, "campbell")["rows"] == [cells(row) for row in criticals(space["campbell"])]
    assert answer(case, "response")["rows"] == [cells(row) for row in peaks(space["response"])]
    shown = [row[1:3] for row in answer(case, "modes")["rows"]]
    modes = zip(space["modes"]["wn"].values / (2 * np.pi), space["modes"]["zeta"].values, strict=True)
    assert shown == [cells((float(f), float(z))) for f, z in modes][: len(shown)]
    loads = [row[1] for row in answer(case, "static")["rows"]]
    assert loads == [cells((float(load),))[0] for load in space["static"]["load"].values]
    random = space["scatter"]
    nominal = [cells((random.distribution(one.name)["nominal"],))[0] for one in random.quantities]
    assert [row[1] for row in answer(case, "scatter")["rows"]] == nominal != []
    known = dict(zip(space["slopes"]["check"].values.tolist(), space["slopes"]["reserve"].values, strict=True))
    moved = answer(case, "slopes")["rows"]
    assert [row[1] for row in moved] == [f"{100 * known[row[0]]:+.0f} %" for row in moved] != []
    found = {(row[0], row[2]) for row in answer(case, "limits")["rows"]}
    assert {(c.name, cells((answered(c),))[0]) for c in space["review"].checks} == found


def test_the_commands_state_the_speeds_of_the_panels(case):
    text = as_commands(case, "my.toml")
    assert f"'0 rpm:{case.top!r} rpm:21'" in text
    speeds = (
        text.partition("--speeds '")[2].partition("rotorsim response")[2].partition("--speeds '")[2].partition("'")[0]
    )
    assert [float(one.removesuffix(" rpm")) for one in speeds.split(",")] == case.response_speeds


def test_the_nearest_limit_comes_first_and_a_reserve_is_negative_where_the_rule_is_not_met(case):
    rows = answer(case, "limits")["rows"]
    known = [float(row[3].removesuffix(" %")) for row in rows if row[3] != "-"]
    assert known == sorted(known) and known
    for row in rows:
        if row[3] != "-" and "looked" not in row[4]:
            assert ("not met" in row[4]) == (float(row[3].removesuffix(" %")) < 0), row


def test_static_loads_carry_the_weight_and_a_uniform_beam_sags_as_its_closed_form():
    machine = rs.load_machine("plain_rotor").replace("discs.0.mass", "1e-9 kg")
    machine = machine.replace("discs.0.polar_inertia", "0 kg*m^2").replace("discs.0.diametral_inertia", "0 kg*m^2")
    machine = machine.replace("shaft.sections.0.length", "600 mm").replace("shaft.sections.0.outer_diameter", "10 mm")
    found = rs.analysis.static_deflection(rs.Plant(machine))
    w, L, E, inertia = 7850 * np.pi / 4 * 0.01**2 * 9.80665, 0.6, 210e9, np.pi / 64 * 0.01**4
    assert found["load"].values == pytest.approx([w * L / 2] * 2, rel=1e-6)
    on_springs = w * L / 2 / 10e6
    middle = float(found["sag"].max())
    assert middle == pytest.approx(5 * w * L**4 / (384 * E * inertia) + on_springs, rel=2e-3)


def test_a_machine_that_falls_is_answered_with_its_sentence():
    from rotorsim.machine.file_text import without

    text = without(machine_text("plain_rotor"), "bearings.1")
    for name in ("campbell", "limits"):
        assert "bearings" in answer_of(text, DeskPoint(), name)["error"]


def test_a_requirement_that_is_not_met_and_has_no_number_comes_first():
    case = DesignCase(rs.load_machine("plain_rotor"))
    one = replace(case.review.checks[-1], verdict=MISSED, found=None, name="not carried")
    lacking = SimpleNamespace(checks=(*case.review.checks, one), high=case.review.high)
    assert PANELS["limits"](SimpleNamespace(review=lacking))["rows"][0][0] == "not carried"


def test_scripts_have_every_digit_of_the_supply():
    case = DesignCase(rs.load_machine("dtu_gas_bearing"), DeskPoint(top=5000.0, speed=0.0, supply=0.1234567))
    case.__dict__["response_speeds"] = [100.0]
    assert f"RPM, {0.1234567e6!r})" in as_python(case, "my.toml")
    assert "--pressure '0.1234567 MPa'" in as_commands(case, "my.toml")


def test_an_operating_point_takes_numbers_and_what_is_empty_is_the_machines_own():
    assert point_of({"top": "5000", "speed": "", "supply": None, "more": 3}) == DeskPoint(top=5000.0)
    assert point_of({"speed": "0", "supply": 0}) == DeskPoint(speed=0.0, supply=0.0)


@pytest.mark.parametrize(
    ("name", "value"),
    [("supply", "-1"), ("supply", -0.1), ("speed", "fast"), ("top", "0"), ("top", float("inf")), ("speed", True),
     ("top", "1e400"), ("supply", "nan"), ("speed", [1]), ("top", "1_0"), ("tolerance", "20.1"), ("top", 1.1e7)],
)  # fmt: skip
def test_an_operating_point_refuses_what_is_no_number_from_zero_on(name, value):
    with pytest.raises(DataError) as error:
        point_of({name: value})
    assert (error.value.argument, error.value.value) == (name, value)


def test_bearings_and_discs_are_changed_before_sections_and_the_note_states_how_many_of_all(tmp_path):
    design = open_design("plain_rotor", tmp_path)
    while len(design.machine.shaft.sections) < 30:
        design.split("shaft.sections.0")
    case = DesignCase(design.machine)
    assert len(case.values) == MOST_VALUES < sum(map(len, case.stated.values()))
    assert set(case.stated["bearings"] + case.stated["discs"]) < set(case.values)
    sections = MOST_VALUES - len(case.stated["bearings"]) - len(case.stated["discs"])
    case.__dict__["slopes"] = xr.Dataset(
        {"reserve": ("check", [1.0]), "slope": (("check", "path"), np.zeros((1, MOST_VALUES)))}, {"check": ["one"]}
    )
    case.__dict__["scatter"] = SimpleNamespace(quantities=())
    for name in ("slopes", "scatter"):
        assert f"{sections} of 30 of shaft sections" in answer(case, name)["notes"][0]


SAMPLE = ("dtu_gas_bearing", "rigid_rotor_self_acting", "pump_on_tables")


@pytest.mark.slow
@pytest.mark.parametrize("name", SAMPLE)
def test_panels_of_films_and_of_the_undamped_map_have_pythons_numbers(name):
    case = DesignCase(rs.load_machine(name))
    review = rs.analysis.design_review(rs.Plant(name), pressure=case.pressure)
    found, undamped = answer(case, "films"), answer(case, "map")
    assert found["rows"] == [cells(row) for row in tables(review)["films"].rows]
    decrements = np.array(found["curves"][0]["y"], float)  # None where none is known
    np.testing.assert_allclose(decrements, review.decrements.values, rtol=1e-6)
    drawn = [one["y"] for one in undamped["curves"] if one["colour"] >= 0]
    np.testing.assert_allclose(drawn, review.undamped["wn"].values * 30 / np.pi, rtol=1e-6)


def test_the_panel_over_the_clearance_has_the_onsets_of_a_search_with_that_clearance_alone():
    case = DesignCase(rs.load_machine("rigid_rotor_self_acting"), DeskPoint(top=6000.0))
    found = answer(case, "clearance")
    assert len(found["rows"]) == 7 and case.swept == {"bearings.*.clearance": CLEARANCES}
    first = case.machine.replace("bearings.*.clearance", f"{0.6 * 12!r} um")
    onset = rs.analysis.whirl_onset(rs.Plant(first), [0.0], 12000 * np.pi / 30)["onset_speed"].item() * 30 / np.pi
    assert found["rows"][0][1] == cells((onset,))[0]
    best = max(found["rows"], key=lambda row: float(row[1]))
    assert float(best[1]) > 1.05 * float(found["rows"][3][1])
    assert f"at {float(best[0]):g} um" in found["notes"][0]


def clearances_of(top, **changed):
    """Rows and first note of the panel on a coarse grid, and heights of the triangles."""
    machine = rs.load_machine("rigid_rotor_self_acting").replace("grid.n_theta", 16).replace("grid.n_z", 8)
    found = answer(DesignCase(machine, DeskPoint(top=top)), "clearance")
    return found["rows"], found["notes"][0], found["curves"][1]["y"]


def test_films_answer_the_response_at_some_of_its_speeds_first():
    machine = rs.load_machine("rigid_rotor_self_acting").replace("grid.n_theta", 16).replace("grid.n_z", 8)
    case = DesignCase(machine, DeskPoint(top=4702.0))
    first, whole = answer(case, "first response"), answer(case, "response")
    assert first["first"] and "first" not in whole and first["title"] == whole["title"]
    assert len(first["curves"][0]["x"]) == 8 and not first["rows"] and "8 of 40" in first["notes"][0]
    for some, every in zip(first["curves"], whole["curves"], strict=True):
        places = [every["x"].index(speed) for speed in some["x"]]
        assert some["y"] == [every["y"][k] for k in places] != []


def test_what_is_answered_in_part_first_comes_before_the_other_panels_of_films_alone():
    names = ["clearance", "campbell", "response"]
    assert in_order(names, True, ["response"]) == ["first response", "campbell", "response", "clearance"]
    assert in_order(["campbell"], True, ["response"]) == ["campbell"]
    assert in_order(["response", "campbell"], False) == ["response", "campbell"]


def test_what_is_answered_in_part_first_of_a_panel_off_view_stays_behind_those_on_view():
    names = ["campbell", "modes", "response", "clearance"]
    assert in_order(names, True, ["campbell"]) == ["campbell", "modes", "first response", "response", "clearance"]


def test_a_clearance_that_is_stable_up_to_the_speed_searched_is_above_every_onset():
    rows, note, beyond = clearances_of(4702.0)
    onsets = [row[1] for row in rows]
    assert onsets[:3] == ["stable up to 9404 rpm"] * 3
    known = [float(one) for one in onsets[3:]]
    assert known == sorted(known, reverse=True) and known[0] < 9404
    assert note.startswith("At 7.2 um, 8.8 um, 10.4 um no mode grows up to 9404 rpm")
    assert "above every onset" in note and "faster was not searched" in note
    assert beyond == [9404.0] * 3 + [None] * 4


def test_a_clearance_whose_film_does_not_carry_is_not_taken_for_a_stable_one():
    rows, note, beyond = clearances_of(60.0)
    assert [row[1] for row in rows] == ["stable up to 120 rpm"] * 2 + ["does not carry"] * 5
    assert {row[2] for row in rows} == {"does not carry"}
    assert "At 10.4 um, 12 um, 13.6 um, 15.2 um, 16.8 um the film does not carry" in note
    assert beyond[:2] == [120.0] * 2 and set(beyond[2:]) == {None}


@pytest.mark.slow
def test_the_script_and_the_commands_of_a_film_machine_give_the_rows_of_the_panels(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    machine = rs.load_machine("rigid_rotor_self_acting").replace("grid.n_theta", 16).replace("grid.n_z", 8)
    (tmp_path / "my.toml").write_bytes(machine.text.encode())
    case, space = DesignCase(machine, DeskPoint(top=4702.0)), {}
    exec(as_python(case, "my.toml"), space)
    assert answer(case, "campbell")["rows"] == [cells(row) for row in criticals(space["campbell"])]
    assert answer(case, "response")["rows"] == [cells(row) for row in peaks(space["response"])]
    assert answer(case, "films")["rows"] == [cells(row) for row in tables(space["review"])["films"].rows] != []
    found = {(row[0], row[2]) for row in answer(case, "limits")["rows"]}
    assert {(c.name, cells((answered(c),))[0]) for c in space["review"].checks} == found
    rows = [[cell if cell[0].isdigit() else "-" for cell in row] for row in answer(case, "clearance")["rows"]]
    assert rows == [cells(row) for row in space["clearances"].table()[1]]
    line = as_commands(case, "my.toml").splitlines()[-1]
    with pytest.raises(SystemExit) as ended:
        main([*shlex.split(line)[1:], "--workers", "1", "--no-report", "--out", "swept"])
    assert not ended.value.code
    with open(tmp_path / "swept" / "sweep.csv", newline="") as file:
        table = list(csv.reader(file))[1:]
    assert rows == [cells(tuple(float(cell) if cell else None for cell in row)) for row in table]


def test_a_shaft_too_large_to_be_answered_at_once_is_stated(tmp_path):
    desk = make_desk("plain_rotor", tmp_path)
    assert desk.state()["large"] == ""
    desk.act("set", {"path": "shaft.max_element_length", "text": "1 mm"})
    states = 8 * len(Mesh(desk.design.machine).nodes)
    assert states > LARGE and f"{states} states" in desk.state()["large"]


def test_clearances_that_differ_are_those_of_the_first_film_alone():
    machine = rs.load_machine("rigid_rotor_self_acting").replace("bearings.1.clearance", "13 um")
    assert DesignCase(machine).swept == {"bearings.0.clearance": CLEARANCES}
    assert DesignCase(rs.load_machine("plain_rotor")).swept == {}


def test_slopes_of_the_permissible_unbalance_are_those_of_its_closed_form():
    """U / (g m) with the mass m of shaft, as its diameter squared, and disc: slopes add up to it."""
    plant = rs.Plant("plain_rotor")
    found = rs.analysis.reserve_slopes(plant, ["discs.0.mass", "shaft.sections.0.outer_diameter"])
    one = found.sel(check="Unbalance of the machine file, all planes, G 2.5")
    disc, shaft = one["slope"].values
    used = 1 - float(one["reserve"])
    assert disc + shaft / 2 == pytest.approx(used, rel=3e-3)
    assert disc / used == pytest.approx(plant.machine.discs[0].mass / plant.machine.mass, rel=3e-3)


def test_slopes_are_at_the_operating_speed_of_the_machine_where_that_of_a_changed_one_is_rounded_otherwise():
    """Permissible unbalance of a machine below the edge of a digit of its top speed, by the closed form of its mass."""
    path = "shaft.sections.0.outer_diameter"
    plant = rs.Plant(rs.load_machine("plain_rotor").replace(path, "20.079 mm"))
    changed = rs.Plant(plant.machine.replace(path, f"{20.079 * 1.001!r} mm"))
    assert top_speed(changed) > 1.01 * top_speed(plant)
    found = rs.analysis.reserve_slopes(plant, [path])
    one = found.sel(check="Unbalance of the machine file, all planes, G 2.5")
    mass = plant.machine.mass
    shaft = 2 * (mass - plant.machine.discs[0].mass) / mass
    assert float(one["slope"][0]) == pytest.approx(shaft * (1 - float(one["reserve"])), rel=3e-3)


def test_slopes_over_the_operating_speed_itself_are_those_of_its_closed_form():
    """The part of the permissible unbalance that is used grows as the speed."""
    machine = rs.load_machine("plain_rotor").replace("drive.highest_speed", "3000 rpm")
    found = rs.analysis.reserve_slopes(rs.Plant(machine), ["drive.highest_speed"])
    one = found.sel(check="Unbalance of the machine file, all planes, G 2.5")
    assert float(one["slope"][0]) == pytest.approx(float(one["reserve"]) - 1, rel=1e-6)


@pytest.mark.parametrize("path", ["bearings.0.kind", "name", "discs.7.mass", "bearings.0.position",
                                  "effects.gravity.direction"])  # fmt: skip
def test_slopes_refuse_what_is_no_number_above_zero(path):
    with pytest.raises(MachineFileError) as error:
        rs.analysis.reserve_slopes(rs.Plant("plain_rotor"), [path])
    assert (error.value.argument, error.value.value) == ("paths", path)


def test_a_mode_shape_does_not_show_from_what_its_mode_was_found():
    machine = rs.load_machine("rigid_rotor_self_acting").replace("grid.n_theta", 24).replace("grid.n_z", 8)
    before, speed = RememberingPlant(machine), 900.0
    rs.analysis.campbell(before, [0.5 * speed, speed])
    shapes = [rs.analysis.mode_shapes(plant, speed, 0.0)["shape_re"].values for plant in (before, rs.Plant(machine))]
    assert np.abs(shapes[0] - shapes[1]).max() < 1e-13


@pytest.mark.parametrize(("carried", "not_carried"), [
    ((60.0, 40.0, 33.0, 55.0), (36.0, 34.0, 30.0)), ((-60.0, -40.0, -35.0, -55.0), (-34.0, -33.0)),
])  # fmt: skip
def test_a_film_lifts_off_at_the_same_speeds_whatever_was_asked_before(carried, not_carried):
    """One that carries goes on to below its lift-off; and near that it lifts off at one speed, not at a higher one."""
    machine = rs.load_machine("foil_turbo_rotor").replace("grid.n_theta", 24).replace("grid.n_z", 8)
    before, new = RememberingPlant(machine), rs.Plant(machine)
    for speed in carried:
        assert before.linearise(speed).wn[0] == pytest.approx(new.linearise(speed).wn[0], rel=1e-9)
    for speed in not_carried:
        for plant in (before, new):
            with pytest.raises(NoLiftOffError):
                plant.linearise(speed)
