"""The live rig without clock and page: settings act on the plant, nothing ends it, what is recorded plays again."""

import json
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
import xarray as xr

import identification as idn
from rotorsim.errors import DataError, MachineFileError
from rotorsim.live.desk import Desk
from rotorsim.live.effects import equip
from rotorsim.live.eigenvalue import modes_at
from rotorsim.live.frame import AT
from rotorsim.live.laws import read_laws
from rotorsim.live.replay import Replay
from rotorsim.live.rig import SCATTER, Rig
from rotorsim.live.ringdown import WAIT, read_ringdown
from rotorsim.live.runner import Runner
from rotorsim.live.settings import Settings
from rotorsim.live.tour import stops
from rotorsim.machine import load_machine
from rotorsim.machine.numerics import SAMPLE
from rotorsim.plant import Plant

RPM = np.pi / 30


@lru_cache
def coarse():
    machine = load_machine("dtu_gas_bearing").replace("grid.n_theta", 16).replace("grid.n_z", 8)
    return machine.replace("solver.time_step", "0.2 ms").replace("shaft.max_element_length", "80 mm")


def make_rig(**settings):
    rig = Rig(coarse(), read_laws([]))
    for key, value in settings.items():
        rig.set(key, value)
    rig.reset()
    return rig


def fresh(changes=()):
    """Rows of a plant that was built with these values from the start: 0.1 s at 3 krpm and 0.3 MPa."""
    machine = equip(coarse())
    for path, value in changes:
        machine = machine.replace(path, value)
    inputs = np.zeros((500, 6))
    inputs[:, 0], inputs[:, 1] = 3000 * RPM, 0.3e6
    return Plant(machine).start(3000 * RPM, 0.3e6).advance(inputs)


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("unbalance.me", 12e-6, "12 g*mm"),
        ("clearance_growth.growth", -2e-6, "-2 um"),
        ("plenum_volume.change", 1.5, 1.5),
        ("pedestal.mass_ratio", 0.3, 0.3),
        ("viscosity.rise", 20.0, "20 K"),
        ("journal_tilt.x", 1e-4, "1e-4 rad"),
        ("noise.sigma", 1e-6, "1 um"),
    ],
)
def test_a_slider_does_what_the_machine_file_would_do_bit_for_bit(key, value, text):
    rig = make_rig(speed=3000 * RPM)
    rig.set(key, value)
    rig.reset()
    rows = np.concatenate([rig.advance(200), rig.advance(300)])
    assert rows[:, :-6].tobytes() == fresh([(f"effects.{key}", text)]).tobytes()


def test_a_slider_that_is_put_back_leaves_every_bit_as_it_was():
    rig = make_rig(speed=3000 * RPM)
    for key, value in (("pedestal.mass_ratio", 0.5), ("plenum_volume.change", 3.0), ("rub.stiffness", 1e6)):
        rig.set(key, value)
        rig.set(key, 0.0)
    rig.reset()
    assert rig.advance(500)[:, :-6].tobytes() == fresh().tobytes()


def test_every_number_of_every_effect_reaches_the_parameter_record():
    rig = make_rig()
    for key, control in rig.settings.sliders.items():
        before, said = rig.in_force()[key], rig.sentences
        value = control.value(0.05)
        rig.set(key, value)
        taken = rig.in_force()[key]
        assert taken == rig.settings.numbers[key] or rig.sentences > said
        rig.set(key, before)
        assert rig.in_force()[key] == before


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("pressure", 9e6, "pressure: 9 MPa is beyond 0 MPa to 1 MPa, set to 1 MPa"),
        ("speed", "fast", "speed: 'fast' is not a number"),
        ("speed", float("nan"), "is not a number"),
        ("warp", 1.0, "'warp': is no setting of this rig"),
        ("pace", "9x", "pace: '9x' is none of its positions"),
        ("controller", "unknown", "controller: 'unknown' is none of its positions; they are off, P"),
        ("journal_tilt.x", 2e-3, "the film is closed|closes|gap|clearance"),
        ("weak_injector.injector", 60.0, "injector: 60 is beyond 1 to 4, set to 4"),
    ],
)
def test_what_cannot_be_set_is_said_and_the_plant_runs_on(key, value, sentence):
    import re

    rig = make_rig()
    rig.set(key, value)
    assert re.search(sentence, rig.said[-1][1]), rig.said[-1]
    assert len(rig.advance(20)) == 20


def test_a_torque_accelerates_the_rotor_by_newtons_law():
    rig = make_rig(drive="torque", torque=2.0, pressure=0.6e6)
    rig.advance(2500)
    asked = (2.0 - rig.drag) / float(rig.assembly.P.inertia) * 0.5
    assert rig.speed == pytest.approx(asked, rel=0.02)
    rig.set("drive", "coast")
    before = rig.speed
    rig.advance(500)
    assert 0 < rig.speed < before


def test_the_sense_turns_the_rotor_backward():
    rig = make_rig(speed=1000 * RPM, sense="backward")
    assert rig.speed == pytest.approx(-1000 * RPM)
    assert len(rig.advance(100)) == 100


def test_without_air_the_journal_touches_and_the_lamp_lights_and_air_lifts_it_again():
    rig = make_rig()
    rig.set("pressure", 0.0)
    for _ in range(50):
        rig.advance(50)
    assert rig.history.last(100)[:, AT["contact"]].max() == 1.0
    rig.set("pressure", 0.6e6)
    for _ in range(100):
        rig.advance(50)
    assert not rig.stopped and rig.history.last(100)[:, AT["contact"]].max() == 0.0


def test_a_step_without_solution_stops_the_plant_and_a_reset_brings_it_back():
    rig = make_rig()
    rig.set("impulse", 0.2)
    rig.settings.numbers["impulse"] = 1e7
    rig.strike(1)
    for _ in range(20):
        rig.advance(50)
    assert rig.stopped and "reset" in rig.said[-1][1]
    assert len(rig.advance(50)) == 0
    rig.reset()
    assert not rig.stopped and len(rig.advance(50)) == 50


def test_noise_off_silences_the_sensors_and_keeps_the_setting():
    rig = make_rig(noise="off")
    assert all(rig.in_force()[key] == 0.0 for key in SCATTER)
    rig.set("noise", "on")
    assert rig.in_force()["noise.sigma"] == rig.settings.numbers["noise.sigma"] > 0


def test_the_controller_acts_and_is_switched_off_again():
    rig = make_rig(speed=3000 * RPM, pressure=0.5e6, controller="P")
    rig.strike(0)
    assert np.abs(rig.advance(500)[:, -4]).max() > 0.05
    rig.set("controller", "off")
    assert np.abs(rig.advance(50)[:, -4:-2]).max() == 0.0


def test_the_damping_of_a_hit_agrees_with_the_eigenvalue():
    rig = make_rig(noise="off", pressure=0.3e6)
    for key in ("unbalance.me", "coupling.second", "coupling.third", "runout.first", "runout.second"):
        rig.set(key, 0.0)
    rig.reset()
    rig.set("impulse", 0.002)
    rig.strike(1)
    rows = rig.advance(WAIT)
    reading, modes = read_ringdown(rows, 1), modes_at(rig.assembly, 0.0, 0.3e6)
    assert reading.zeta == pytest.approx(modes.zeta[1], rel=0.15)
    assert reading.frequency == pytest.approx(modes.frequency[1], rel=0.03)


def test_a_record_is_of_the_schema_and_replays_the_frames_of_the_run(tmp_path):
    runner = Runner(make_rig(speed=3000 * RPM))
    runner.record(tmp_path / "r.nc")
    runner._obey()
    shown = []
    for k in range(60):
        if k == 20:
            runner.set("unbalance.me", 2e-5)
            runner.strike(0)
            runner._obey()
        runner._part(50)
        frame = runner.frame()
        shown.append({name: frame[name] for name in ("orbit", "trace", "spectrum", "now", "centre")})
    last = runner.rig.history.last(3000).copy()
    runner.close()
    record = idn.read(tmp_path / "r.nc")
    idn.validate(record)
    changes = json.loads(record.attrs["changes"])
    assert ["unbalance.me", 2e-5] in [change[1:] for change in changes]
    replay = Replay(tmp_path / "r.nc")
    commands = [-6, -5]  # of speed and pressure: what came of them is recorded
    assert np.delete(replay.rows, commands, axis=1).tobytes() == np.delete(last, commands, axis=1).tobytes()
    for k in range(60):
        replay.advance(50)
        frame = replay.frame()
        assert {name: frame[name] for name in shown[k]} == shown[k]
        if replay.at % 250 == 0:
            assert len(frame["film"]) == 16 * 8


def test_a_replayed_film_is_the_one_that_was_shown(tmp_path):
    runner = Runner(make_rig(speed=3000 * RPM))
    runner.record(tmp_path / "r.nc")
    runner._obey()
    for _ in range(10):
        runner._part(50)
    shown = runner.frame()["film"]
    runner.close()
    replay = Replay(tmp_path / "r.nc")
    replay.advance(500)
    assert replay.frame()["film"] == shown


def test_a_record_without_a_machine_cannot_be_replayed(tmp_path):
    time = np.arange(100) * SAMPLE
    record = idn.from_arrays(time, np.zeros((100, 2)), np.zeros((100, 2)))
    record.to_netcdf(tmp_path / "r.nc", engine="h5netcdf")
    with pytest.raises(DataError, match="carries no machine"):
        Replay(tmp_path / "r.nc")


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
        with pytest.raises(DataError, match="is no name for a file"):
            desk.save_scene(name)
    assert desk.scenes() == ["mine"]
    runner.close()


@pytest.mark.parametrize("turned", [False, True])
def test_values_that_fit_only_together_are_set_in_any_order(turned):
    values = {"gravity.acceleration": 0.0, "crack.loss": 0.0}
    rig = make_rig(**{"crack.loss": 1e6})
    rig.put_all(dict(sorted(values.items(), reverse=turned)))
    assert not rig.said
    assert (rig.in_force()["gravity.acceleration"], rig.in_force()["crack.loss"]) == (0.0, 0.0)


def test_values_that_a_machine_file_refuses_together_are_refused_here():
    rig = make_rig(**{"crack.loss": 1e6})
    rig.put_all({"gravity.acceleration": 0.0, "rub.friction": 0.2})
    assert len(rig.said) == 1
    assert rig.said[0][1].startswith("crack: the weight opens and closes a crack, but there is none")
    assert (rig.in_force()["gravity.acceleration"], rig.in_force()["rub.friction"]) == (9.81, 0.2)
    assert len(rig.advance(20)) == 20


def test_a_film_on_another_grid_is_not_drawn_and_that_is_said(tmp_path):
    runner = Runner(make_rig(speed=3000 * RPM))
    runner.record(tmp_path / "r.nc")
    runner._obey()
    runner._part(500)
    runner.close()
    replay = Replay(tmp_path / "r.nc")
    replay.advance(500)
    assert replay.frame()["film"] is not None
    other = Runner(make_rig())
    other.geometry = replace(other.geometry, theta=other.geometry.theta[::2])
    other.play(replay)
    other._obey()
    assert "its film is on another grid" in other.rig.said[-1][1]
    assert other.replay is replay and "film" not in other.frame()
    other.close()


def test_every_scene_of_the_tour_can_be_set_without_a_word():
    runner = Runner(make_rig())
    desk = Desk(runner, coarse(), "unused")
    assert len(stops(coarse())) == 5
    for stop in stops(coarse()):
        desk.visit(stop)
        runner._obey()
        runner._part(50)
        assert not runner.rig.said, (stop.title, runner.rig.said)
    runner.close()


def test_a_rotor_without_film_has_no_controls_of_one():
    settings = Settings(equip(load_machine("plain_rotor")), ("off",))
    assert "pressure" not in settings.operating and "slip.mean_free_path" not in settings.sliders
    assert "unbalance.me" in settings.sliders


def test_a_machine_file_with_an_error_names_the_field(tmp_path):
    with pytest.raises(MachineFileError, match=r"effects\.unbalance\.me"):
        coarse().replace("effects.unbalance.me", "20 g")


def test_records_are_datasets_that_xarray_opens(tmp_path):
    runner = Runner(make_rig())
    runner.record(tmp_path / "r.nc")
    runner._obey()
    runner._part(50)
    runner.close()
    with xr.open_dataset(tmp_path / "r.nc", engine="h5netcdf") as record:
        assert record.sizes["time"] == 50 and record["disc"].attrs["units"] == "m"
