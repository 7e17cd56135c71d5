"""Scenes and tour of the live rig, and the controls of each machine."""

import re

import pytest

from coarse_rig import RPM, coarse, make_rig, ran, shown
from rotorsim.base.errors import DataError
from rotorsim.live.desk import Desk
from rotorsim.live.rig.effects import equip
from rotorsim.live.rig.laws import read_laws
from rotorsim.live.rig.rig import Rig
from rotorsim.live.rig.settings import Settings
from rotorsim.live.runner import Runner
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
    text = without(machine_text("dtu_gas_bearing"), *ACTUATORS, *(("injectors", "injection") if kind == "film" else ()))
    machine = Machine.from_text(text)
    for path, value in NUMERICS.items():
        machine = machine.replace(path, value)
    return machine


def test_scenes_of_the_desk_come_back_and_those_of_another_machine_do_not(tmp_path):
    runner = Runner(make_rig())
    desk = Desk(runner, coarse(), tmp_path)
    runner.rig.set("speed", 2000 * RPM)
    runner.rig.set("rub.friction", 0.3)
    desk.save_scene("mine")
    runner.rig.set("rub.friction", 0.1)
    desk.load_scene("mine")
    runner._obey()
    assert runner.rig.in_force()["rub.friction"] == 0.3 and runner.rig.speed == pytest.approx(2000 * RPM)
    other = Desk(runner, coarse().replace("name", "other"), tmp_path)
    with pytest.raises(DataError, match="belongs to another machine"):
        other.load_scene("mine")
    for name in ("../evil", "", "a" * 100, "x/y"):
        with pytest.raises(DataError, match="cannot name a file"):
            desk.save_scene(name)
    assert desk.scenes() == ["mine"]
    runner.close()


def test_every_scene_of_the_tour_can_be_set_and_the_law_comes_on(tmp_path):
    runner = Runner(make_rig())
    desk = Desk(runner, coarse(), tmp_path)
    assert len(desk.tour) == 5
    for stop in desk.tour:
        desk.visit(stop)
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
        ("pins", ("off", "P", "hinf"), {"hysteresis.weight", "creep.gain", "dead_zone.width"}, 3),
        ("film", ("off",), {"pressure", "reference_x", "weak_injector.share", "plenum_volume.change"}, 3),
    ],
)
def test_a_rig_has_the_controls_scenes_and_laws_of_its_machine(tmp_path, kind, laws, absent, stops):
    machine = other(kind)
    runner = Runner(Rig(machine, read_laws([], machine)))
    rig, desk = runner.rig, Desk(runner, machine, tmp_path)
    assert rig.settings.switches["controller"] == laws
    keys = set(rig.settings.everything())
    assert not keys & absent and {"unbalance.me", "speed", "impulse"} <= keys
    assert len(desk.tour) == stops
    for stop in desk.tour:
        desk.visit(stop)
        runner._obey()
        ran(runner, 100)
        assert not rig.stopped and not any("is not a setting" in text for _, text in rig.messages)
    assert runner.geometry.as_dict()["safety"] == (0.0 if kind == "plain" else 20.0)
    runner.close()


def test_a_rotor_without_film_has_no_controls_of_one():
    settings = Settings(equip(load_machine("plain_rotor")), ("off",))
    assert "pressure" not in settings.operating and "slip.mean_free_path" not in settings.sliders
    assert "unbalance.me" in settings.sliders
