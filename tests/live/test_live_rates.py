"""The live rig follows the machine's sampling rate: ramp, hammer, spectrum, recording and pace at 50 kHz."""

import numpy as np
import pytest

import identification as idn
from coarse_rig import coarse
from rotorsim.live.frame import HIGHEST, SPECTRUM, Geometry, make_frame
from rotorsim.live.pacer import Pacer
from rotorsim.live.recorder import Recorder
from rotorsim.live.rig.laws import read_laws
from rotorsim.live.rig.rig import Rig
from rotorsim.machine import load_machine

RATE = 50e3


@pytest.fixture(scope="module")
def turbo():
    machine = load_machine("grooved_turbo_rotor").with_({"grid.n_theta": 16, "grid.n_z": 8})
    rig = Rig(machine, read_laws([], machine))
    rig.set("speed", 12000.0)
    rig.reset()
    return rig


def test_a_ramp_and_a_hit_are_those_of_the_clock(turbo):
    assert pytest.approx(1 / RATE) == turbo.Ts
    turbo.set("speed", 12010.0)
    turbo.set("acceleration", 1000.0)
    turbo.advance(250)  # 5 ms
    assert turbo.speed == pytest.approx(12005.0, rel=1e-9)
    turbo.set("impulse", 1e-4)
    turbo.strike(0)
    rows = turbo.advance(50)
    assert rows[:, -2].sum() / RATE == pytest.approx(1e-4, rel=1e-9)


def test_a_spectrum_has_its_lines_where_the_shaft_turns(turbo):
    turbo.set("speed", 12566.370614359172)  # 2 kHz
    turbo.reset()
    for _ in range(SPECTRUM // 50 + 20):
        turbo.advance(50)
    geometry = Geometry.of(turbo.machine, np.zeros(0), np.zeros(0))
    frame = make_frame(turbo.history.last(10**9), None, geometry, 1.0, turbo.rest)
    step = geometry.as_dict()["highest"] / HIGHEST
    assert step == RATE / SPECTRUM == 10.0 and not frame["orders"]
    assert np.argmax(frame["spectrum"][20:]) + 20 == 200


def test_a_recording_has_the_machine_s_clock(turbo, tmp_path):
    recorder = Recorder(turbo, tmp_path / "live.nc")
    recorder.write(turbo.advance(500))
    assert recorder.seconds == pytest.approx(0.01)
    recorder.close()
    assert idn.sampling_time(idn.read(tmp_path / "live.nc")) == pytest.approx(1 / RATE)


def test_the_pace_counts_samples_of_the_machine(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("rotorsim.live.pacer.time.monotonic", lambda: now[0])
    pacer = Pacer(1 / RATE)
    now[0] = 0.01
    pacer.count(500)
    assert pacer.factor == pytest.approx(1.0)
    assert Rig(coarse(), read_laws([])).Ts == 2e-4
