"""Machines and input rows shared by the tests of the plant; what lets no test depend on shell, speed or processors.

The studies, which are not installed, are on the path.
"""

import os
import signal
import sys
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from rotorsim.base.processes import THREADS

for _name in THREADS:  # a process each is at work on every processor: more threads would wait for each other
    os.environ.setdefault(_name, "1")

import numpy as np
import pytest
import tomlkit
from hypothesis import HealthCheck, settings

from rotorsim.effects import FILM_PORTS, REGISTRY
from rotorsim.machine import load_machine, machine_text
from rotorsim.machine.file_text import with_values
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant
from shared import shared

settings.register_profile("any speed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any speed")
sys.path.append(str(Path(__file__).parents[1]))
SILENT = {
    "effects.unbalance.me": "0 g*mm",
    "effects.coupling.force_2x": "0 N",
    "effects.coupling.force_3x": "0 N",
    "actuators.mode": "ideal",
    "effects.noise.sigma": "0 um",
    "effects.quantisation.step": "0 um",
    "effects.runout.amplitude_1x": "0 um",
    "effects.runout.amplitude_2x": "0 um",
    "effects.runout.amplitude_3x": "0 um",
    "effects.runout.roughness": "0 um",
    "effects.encoder.counts": 0,
    "effects.pressure_transducer.sigma": "0 Pa",
}


@pytest.fixture(scope="session", autouse=True)
def _ctrl_c_is_received():
    """Tests and what they start receive SIGINT: a shell makes what it starts in the background ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def change(machine: Machine, values: Mapping[str, Any]) -> Machine:
    """The machine with other values, as `replace` sets them one after the other; the file is read once."""
    return Machine.from_text(with_values(machine.text, values)) if values else machine


def build_rig(values: Mapping[str, Any] | None = None, n_z: int = 8, dt: float = 2e-4, n_theta: int = 32) -> Plant:
    """The shipped rig without unbalance and coupling forces, with ideal pins and sensors, then with `values`."""
    numerics = {"grid.n_theta": n_theta, "grid.n_z": n_z, "solver.time_step": f"{float(dt)!r} s"}
    return Plant(change(load_machine("dtu_gas_bearing"), SILENT | dict(values or {}) | numerics))


def held_inputs(samples: int, speed: float, pressure: float) -> np.ndarray:
    """Input rows (samples, 6) of constant speed [rad/s] and gauge pressure [Pa], no reference, no disc force."""
    rows = np.zeros((samples, 6))
    rows[:, 0], rows[:, 1] = speed, pressure
    return rows


changed = shared(change)
rig = shared(build_rig)
held = shared(held_inputs)


@lru_cache
def neutral_machine(name: str) -> Machine:
    """A shipped machine with its weight and every registered effect it can have at neutral values, in two planes.

    Behind the others stand those that come last in a chain: lost motion of the pins, the converters.
    """
    text = tomlkit.parse(machine_text(name))
    del text["effects"]
    film = Machine.from_text(tomlkit.dumps(text)).film
    fitting = {n for n, effect in REGISTRY.items() if film is not None or effect.port not in FILM_PORTS}
    last = [n for n in ("dead_zone", "quantisation", "encoder") if n in fitting]
    tables: dict[str, Any] = {n: {} for n in [*sorted(fitting - set(last)), *last]}
    tables["gravity"] = {"acceleration": "9.81 m/s^2"}
    tables["unbalance"] = [{}, {"position": "150 mm"}]
    text["effects"] = tables
    return Machine.from_text(tomlkit.dumps(text))


def build_neutral(values: Mapping[str, Any] | None = None, name: str = "dtu_gas_bearing", **numerics: Any) -> Plant:
    """`neutral_machine` with `values`, which switch single effects on without compiling anew; pins are ideal."""
    machine = neutral_machine(name)
    if machine.actuators is not None:
        machine = change(machine, {"actuators.mode": "ideal", "drive.dry_drag": "0 N*m"})
    return Plant(change(machine, values or {}), **({"n_theta": 32, "n_z": 8, "dt": 2e-4} | numerics))


neutral = shared(build_neutral)


@pytest.fixture(scope="module")
def browser():
    """Chromium without a window."""
    playwright = pytest.importorskip("playwright.sync_api")
    from clicker import CHROMIUM, FLAGS

    with playwright.sync_playwright() as engine:
        browser = engine.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()
