"""The live rig follows the machine's sampling rate: ramp, hammer, spectrum, recording and pace at 50 kHz."""

import numpy as np
import pytest

import identification as idn
from coarse_rig import coarse
from rotorsim.live.frame import HIGHEST, SPECTRUM, Geometry, make_frame
from rotorsim.live.laws import read_laws
from rotorsim.live.records import Recorder, Replay
from rotorsim.live.rig import Rig
from rotorsim.live.runner import Pacer
from rotorsim.machine import load_machine

RATE = 50e3


@pytest.fixture(scope="module")
def fast():
    machine = load_machine("plain_rotor").with_({"solver.sampling_rate": RATE, "solver.time_step": 1 / RATE})
    rig = Rig(machine, read_laws([], machine))
    rig.set("speed", 300.0)
    rig.reset()
    return rig


@pytest.fixture(scope="module")
def turbo():
    machine = load_machine("grooved_turbo_rotor").with_({"grid.n_theta": 16, "grid.n_z": 8})
    rig = Rig(machine, read_laws([], machine))
    rig.set("speed", 12000.0)
    rig.reset()
    return rig


def test_a_ramp_and_a_hit_are_those_of_the_clock(fast):
    assert pytest.approx(1 / RATE) == fast.Ts
    fast.set("speed", 310.0)
    fast.set("acceleration", 1000.0)
    fast.advance(250)  # 5 ms
    assert fast.speed == pytest.approx(305.0, rel=1e-9)
    fast.set("impulse", 1e-4)
    fast.strike(0)
    rows = fast.advance(50)
    assert rows[:, -2].sum() / RATE == pytest.approx(1e-4, rel=1e-9)


def test_a_spectrum_has_its_lines_where_the_shaft_turns(fast):
    fast.set("speed", 1884.9555921538758)  # 300 Hz, far above the mode at 45 Hz
    fast.reset()
    for _ in range(SPECTRUM // 50 + 20):
        fast.advance(50)
    geometry = Geometry.of(fast.machine, np.zeros(0), np.zeros(0))
    frame = make_frame(fast.history.last(10**9), None, geometry, 1.0, fast.rest)
    step = geometry.as_dict()["highest"] / HIGHEST
    assert step == RATE / SPECTRUM == 10.0 and not frame["orders"]
    assert np.argmax(frame["spectrum"][10:]) + 10 == 30


def test_a_recording_has_the_machine_s_clock(fast, tmp_path):
    recorder = Recorder(fast, tmp_path / "live.nc")
    recorder.write(fast.advance(500))
    assert recorder.seconds == pytest.approx(0.01)
    recorder.close()
    assert idn.sampling_time(idn.read(tmp_path / "live.nc")) == pytest.approx(1 / RATE)


def test_the_pace_counts_samples_of_the_machine(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("rotorsim.live.runner.time.monotonic", lambda: now[0])
    pacer = Pacer(1 / RATE)
    now[0] = 0.01
    pacer.count(500)
    assert pacer.factor == pytest.approx(1.0)
    assert Rig(coarse(), read_laws([])).Ts == 2e-4


@pytest.mark.slow
def test_of_two_films_the_one_that_is_chosen_is_drawn_and_replayed(turbo, tmp_path):
    grid = turbo.assembly.film_model.grid
    geometry = Geometry.of(turbo.machine, grid.theta, np.array([film.grid.z for film in turbo.assembly.films]))
    assert [film["name"] for film in geometry.as_dict()["films"]] == ["front", "rear"]
    recorder = Recorder(turbo, tmp_path / "two.nc")
    for _ in range(12):
        recorder.write(turbo.advance(50))
    recorder.close()
    replay = Replay(tmp_path / "two.nc")
    replay.advance(600)
    for number, name in enumerate(("front", "rear")):
        turbo.set("bearing", name)
        assert turbo.shown == number
        rows, pressure = turbo.history.last(600), turbo.simulation.film_pressure(number)
        frame = make_frame(rows, pressure, geometry, 1.0, turbo.rest, number)
        assert frame["shown"] == number and frame["orbit"]["journal"] == replay.frame(number)["orbit"]["journal"]
    assert frame["orbit"]["journal"] != replay.frame(0)["orbit"]["journal"]
    assert replay.frame(1)["film"] != replay.frame(0)["film"]
