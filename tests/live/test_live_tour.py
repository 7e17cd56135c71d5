"""Scenes and tour of the live rig, and the controls of each machine."""

import re

import numpy as np
import pytest

from coarse_rig import RPM, coarse, make_rig, ran, shown
from rotorsim.analysis.shaft_motion import unbalance_response, unbalances_of
from rotorsim.analysis.whirl_onset import whirl_onset
from rotorsim.base.errors import DataError
from rotorsim.live.folder import RigFolder, stops
from rotorsim.live.laws import read_laws
from rotorsim.live.rig import Rig
from rotorsim.live.runner import Runner
from rotorsim.live.settings import RigSettings, equip
from rotorsim.machine import Machine, load_machine, machine_text

ACTUATORS = ("actuators", "effects.hysteresis", "effects.creep")


NUMERICS = {"grid.n_theta": 16, "grid.n_z": 8, "solver.time_step": "0.2 ms", "shaft.max_element_length": "80 mm"}


def without(text, *tables):
    """A machine file without some of its tables."""
    kept, skip = [], False
    for line in text.splitlines():
        if found := re.match(r"\[+([\w.]+)\]+", line):
            skip = found[1] in tables
        kept += [] if skip else [line]
    return "\n".join(kept)


def other(kind):
    """A plain rotor; the rig with ideal pins; the rig as a plain journal bearing."""
    if kind == "plain":
        return load_machine("plain_rotor")
    text = without(
        machine_text("dtu_gas_bearing"),
        *ACTUATORS,
        *(("injectors", "injection", "effects.pin_sensor") if kind == "film" else ()),
    )
    machine = Machine.from_text(text)
    for path, value in NUMERICS.items():
        machine = machine.replace(path, value)
    return machine


def test_scenes_of_the_desk_come_back_and_those_of_another_machine_do_not(tmp_path):
    runner = Runner(make_rig())
    rig_folder = RigFolder(runner, coarse(), tmp_path)
    runner.rig.set("speed", 2000 * RPM)
    runner.rig.set("rub.friction", 0.3)
    rig_folder.save_scene("mine")
    runner.rig.set("rub.friction", 0.1)
    rig_folder.load_scene("mine")
    runner._obey()
    assert runner.rig.in_force()["rub.friction"] == 0.3 and runner.rig.speed == pytest.approx(2000 * RPM)
    other = RigFolder(runner, coarse().replace("name", "other"), tmp_path)
    with pytest.raises(DataError, match="belongs to another machine"):
        other.load_scene("mine")
    for name in ("../evil", "", "a" * 100, "x/y"):
        with pytest.raises(DataError, match="cannot name a file"):
            rig_folder.save_scene(name)
    assert rig_folder.scenes() == ["mine"]
    runner.close()


def test_every_scene_of_the_tour_can_be_set_and_the_law_comes_on(tmp_path):
    runner = Runner(make_rig())
    rig_folder = RigFolder(runner, coarse(), tmp_path)
    assert len(rig_folder.tour) == 5
    for stop in rig_folder.tour:
        rig_folder.visit(stop)
        runner._obey()
        runner._part(50)
        shown(runner)
        messages = [text for _, text in runner.rig.messages]
        assert all("hinf is on" in text for text in messages), (stop.title, messages)
        assert runner.rig.settings.positions["controller"] == stop.values["controller"]
    runner.close()


@pytest.mark.parametrize(
    ("kind", "laws", "absent", "stops"),
    [
        ("plain", ("off",), {"pressure", "reference_x", "hysteresis.weight", "contact.stiffness"}, 3),
        pytest.param(
            *("pins", ("off", "P", "hinf"), {"hysteresis.weight", "creep.gain", "dead_zone.width"}, 3),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *("film", ("off",), {"pressure", "reference_x", "weak_injector.share", "plenum_volume.change"}, 3),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_rig_has_the_controls_scenes_and_laws_of_its_machine(tmp_path, kind, laws, absent, stops):
    machine = other(kind)
    runner = Runner(Rig(machine, read_laws([], machine)))
    rig, rig_folder = runner.rig, RigFolder(runner, machine, tmp_path)
    assert rig.settings.switches["controller"] == laws
    keys = set(rig.settings.everything())
    assert not keys & absent and {"unbalance.me", "speed", "impulse"} <= keys
    assert len(rig_folder.tour) == stops
    for stop in rig_folder.tour:
        rig_folder.visit(stop)
        runner._obey()
        ran(runner, 100)
        assert not rig.stopped and not any("is not a setting" in text for _, text in rig.messages)
    assert runner.geometry.as_dict()["safety"] == (0.0 if kind == "plain" else 20.0)
    runner.close()


def test_a_rotor_without_film_has_no_controls_of_one():
    settings = RigSettings(equip(load_machine("plain_rotor")), ("off",))
    assert "pressure" not in settings.operating and "slip.mean_free_path" not in settings.sliders
    assert "unbalance.me" in settings.sliders


def numbers(text):
    """Numbers of a text."""
    return [float(word) for word in re.findall(r"(?<![\w.])\d+(?:\.\d+)?(?!\w)", text)]


def stop_of(machine, title):
    """A scene of the tour of a machine."""
    rig = Rig(machine, read_laws([], machine))
    return {stop.title: stop for stop in stops(machine, rig.plant, abs(rig.speed), rig.pressure)}[title], rig.plant


def largest_near(plant, pressure, speed):
    """Speed [rad/s] of the largest response to unbalance within 10 % of another, on a fine grid of its own."""
    found = unbalance_response(plant, np.linspace(0.9, 1.1, 61) * speed, pressure, unbalances_of(plant.machine, speed))
    return float(found["speed"][int(found["major"].values[:, 0].argmax())])


@pytest.mark.parametrize("change", [{}, pytest.param({"discs.0.mass": "2.2 kg"}, marks=pytest.mark.slow)])
def test_the_critical_speed_of_a_text_is_that_of_the_machine(change):
    machine = coarse()
    for path, value in change.items():
        machine = machine.replace(path, value)
    stop, plant = stop_of(machine, "Critical speed")
    to, peak = numbers(stop.text)[:2]
    assert to == pytest.approx(stop.values["speed"] / RPM, abs=1)
    assert peak * RPM == pytest.approx(largest_near(plant, stop.values["pressure"], peak * RPM), rel=0.01)
    assert stop.begin < peak * RPM < stop.values["speed"]


def test_the_onset_of_whirl_and_the_damping_of_a_text_are_those_of_the_machine():
    stop, plant = stop_of(coarse(), "Whirl onset")
    onset, ratio = numbers(stop.text)[:2]
    found = whirl_onset(plant, [stop.values["pressure"]])
    assert onset * RPM == pytest.approx(float(found["onset_speed"][0]), rel=1e-3)
    assert ratio == pytest.approx(float(found["onset_ratio"][0]), abs=0.006)
    assert stop.begin < onset * RPM < stop.values["speed"]
    stop, plant = stop_of(coarse(), "Controller on")
    speed, *zetas = numbers(stop.text)
    model = plant.linearise(speed * RPM, stop.values["pressure"])
    assert zetas == [round(float(model.zeta[model.mode_of_axis(k)]), 2) for k in range(2)]


def test_a_machine_without_a_resonance_in_its_range_has_no_scene_of_one():
    machine = load_machine("plain_rotor").replace("drive.highest_speed", "500 rpm")
    rig = Rig(machine, read_laws([], machine))
    titles = [stop.title for stop in stops(machine, rig.plant, 0.0, 0.0)]
    assert titles == ["A hit"]
