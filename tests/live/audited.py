"""Live rig with an additional address /audit that serves the plant's own values for comparison.

They are computed by other ways than the page's: from a history of every sample, by scipy's spectrum, by a plant that is
built anew from the machine as it is set.
"""

import os
import sys
import threading
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import periodogram

from rotorsim.base.errors import RotorsimError
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.control.sampled_loop import closed_poles
from rotorsim.control.systems import System, held, late, series
from rotorsim.live.folder import RigFolder
from rotorsim.live.laws import law_of, pins, read_laws, running
from rotorsim.live.rig import Rig
from rotorsim.live.runner import Runner
from rotorsim.live.serving import application, serve
from rotorsim.live.settings import OFF
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from rotorsim.plant.kernels.layout import AT, READ

KEPT = 60_000
"""Samples of a run that are kept: 12 s."""
RUNS = 20
"""Runs, from reset to reset, that are kept: a page on a busy computer may be several resets behind."""
UNLINEAR = {"crack.loss": 0.0, "supply_droop.droop": 0.0, "rub.stiffness": 0.0, "ball_bearing.clearance": 0.0}
"""Effects whose force the linear model holds or has not, with the value at which they are absent."""


class Audited(Rig):
    """A rig that keeps its samples, run by run."""

    def __init__(self, *arguments: Any) -> None:
        self.runs: deque[list[Any]] = deque(maxlen=RUNS)
        self.guard = threading.Lock()
        super().__init__(*arguments)

    def reset(self) -> bool:
        with self.guard:
            self.runs.append([0, deque()])
        return super().reset()

    def advance(self, samples: int) -> np.ndarray:
        rows = super().advance(samples)
        if len(rows):
            with self.guard:
                run = self.runs[-1]
                run[0] += len(rows)
                run[1].append(rows)
                while len(run[1]) * len(run[1][0]) > KEPT:
                    run[1].popleft()
        return rows

    def rows_until(self, sample: int) -> list[np.ndarray]:
        """Rows that end at a sample, of every run that has it; a plant that stopped has begun one more than it has."""
        found = []
        with self.guard:
            for end, parts in self.runs:
                if sample <= end + 1 and parts:
                    rows = np.concatenate(list(parts))
                    stop = len(rows) - max(end - sample, 0)
                    if stop > 0:
                        found.append(rows[:stop])
        return found


def values(rows: np.ndarray) -> dict[str, Any]:
    """Plain values of the last row, and of the last second."""
    last = rows[-1]
    disc = rows[-5000:, READ : READ + 2] * 1e6
    turn = max(1000, int(np.ceil(2 * np.pi / max(abs(last[AT["speed"]]) * RIG_SAMPLE, 1e-9))))
    names = {"speed": 30 / np.pi, "pressure": 1e-6, "h_min": 1e6, "mass_flow": 1e3, "disc_x": 1e6, "disc_y": 1e6}
    found: dict[str, Any] = {name: float(last[AT[name]]) * scale for name, scale in names.items()}
    found["disc"] = [found["disc_x"], found["disc_y"]]
    swing = np.ptp(rows[-turn:, :2], axis=0) * 0.5e6
    found["swing"] = swing.tolist() if turn <= len(rows) else None
    if len(rows) >= 5000:
        power = periodogram(disc, 1 / RIG_SAMPLE, "hann", detrend="constant", scaling="spectrum", axis=0)[1]
        found["spectrum"] = np.sqrt(2 * power[1:501].max(axis=1)).tolist()
    return found


def poles(rig: Rig, speed: float, pressure: float) -> list[list[float]]:
    """Frequencies [Hz] and damping ratios of the plant with the law that is on."""
    name = str(rig.settings.positions["controller"])
    plant = Plant(rig.machine)
    found = plant.linearise(speed, pressure)
    if name == OFF:
        s = found.eigenvalues
    else:
        rotor = System(found.A, found.B[:, :2], found.C * 1e6, np.zeros((2, 2)))
        G = late(held(series(pins(plant.assembly), rotor), RIG_SAMPLE))
        z = closed_poles(G, law_of(running(rig.laws[name], (0.0, 0.0)), speed, pressure, rig.Ts)).astype(complex)
        z = z[np.abs(z) > 1e-9]
        s = np.log(z) / RIG_SAMPLE
        s = s[(s.imag > 1) & (np.abs(s) < 3000)]
    return [[float(abs(v)) / (2 * np.pi), float(-v.real / abs(v))] for v in s]


def linear(rig: Rig) -> bool:
    """Whether the linear model has every force of the plant."""
    return all(rig.settings.numbers.get(key, at) == at for key, at in UNLINEAR.items()) and not any(
        rig.settings.numbers.get(f"reference_{axis}", 0.0) for axis in "xy"
    )


def audit(runner: Runner, sample: int, epoch: int, speed: float, pressure: float, shown: bool) -> dict[str, Any]:
    """Own values for a frame, those of an epoch only while it is the rig's; `shown`: the frame has eigenvalues, at this
    speed [rad/s] and pressure [Pa]."""
    rig = runner.rig
    found: dict[str, Any] = {"rows": [values(rows) for rows in rig.rows_until(sample)]}
    reading = runner.reading
    if rig.epoch == epoch:
        own: dict[str, Any] = {"linear": linear(rig), "speed": reading[1]}
        own["modes"] = _open(rig, speed, pressure) if shown else []
        own["ring"] = poles(rig, reading[1], rig.pressure) if not reading[2].why else []
        if rig.epoch == epoch:
            found["own"] = own
    found["epoch"] = rig.epoch
    found["faults"] = [message for _, message in rig.messages if "fault of the program" in message] + [rig.stopped] * (
        "fault of the program" in rig.stopped
    )
    return found


def _open(rig: Rig, speed: float, pressure: float) -> list[list[float]]:
    plant = Plant(rig.machine).linearise(speed, pressure)
    return [[float(plant.wn[k]) / (2 * np.pi), float(plant.zeta[k])] for k in map(plant.mode_of_axis, (0, 1))]


def main(name: str, folder: str, port: str) -> None:
    """Serve a machine until Ctrl-C."""
    machine = load_machine(name)
    if machine.film is not None:
        for path, value in {"grid.n_theta": 16, "grid.n_z": 8, "solver.time_step": "0.2 ms"}.items():
            machine = machine.replace(path, value)
    machine = machine.replace("shaft.max_element_length", "80 mm")
    runner = Runner(Audited(machine, read_laws([], machine)))
    rig_folder = RigFolder(runner, machine, Path(folder))
    app = application(rig_folder)

    @app.get("/audit")
    def give(sample: int, epoch: int, speed: float, pressure: float, shown: bool) -> dict[str, Any]:
        try:
            return audit(runner, sample, epoch, speed, pressure, shown)
        except (RotorsimError, RuntimeError, ValueError, np.linalg.LinAlgError) as error:  # it is counted
            return {"error": f"{type(error).__name__}: {error}"[:80]}

    app.router.routes.insert(0, app.router.routes.pop())
    runner.start()
    try:
        serve(app, int(port), lambda address, _: print(address, flush=True), False, True)
    finally:
        runner.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
    sys.stderr.flush()
    os._exit(0)  # as the command: the interpreter's own end takes seconds with compiled code
