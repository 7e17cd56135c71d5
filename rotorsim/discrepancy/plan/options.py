"""Experiments that a rig can do next: operating points and amplitudes, with the rig time that each costs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from rotorsim.base.constants import MPA, RIG_SAMPLE, TO_RPM
from rotorsim.base.errors import DataError
from rotorsim.base.units import show
from rotorsim.discrepancy.blind_test.design import HIGH, LOW, PERIOD, PERIODS, SPACING
from rotorsim.discrepancy.data.spectra import Trial, block_lines
from rotorsim.experiments import Impact, Multisine
from rotorsim.machine import Machine

ALLOWED = ("speed", "pressure", "amplitude", "slow-roll")
"""What may differ from the records there are."""
SPEEDS = (0.0, 20.0, 50.0, 80.0, 110.0)
"""Shaft speeds [Hz] that a plan tries."""
SLOW_ROLL = 5.0
"""Shaft speed [Hz] of a slow roll."""
PRESSURES = (0.3, 0.5, 0.7)
"""Injection pressures [MPa] that a plan tries."""
AMPLITUDES = (0.25, 1.0, 2.0)
"""Amplitudes that a plan tries, relative to 1 V or a hit of 20 N."""
HIT, WIDTH, LEAD, APART = 20.0, 2e-3, 0.4, 1.0
"""A hit of the hammer [N, s], the time before the first and between hits [s]."""
SET_UP = 2.0
"""Minutes in which a rig comes to a new operating point."""


@dataclass(frozen=True)
class Option:
    """An experiment: kind as the command names it, speed [rad/s], pressure [Pa, gauge], amplitude [V or N], minutes."""

    kind: str
    speed: float
    pressure: float
    amplitude: float
    minutes: float

    @property
    def name(self) -> str:
        """As text."""
        unit = "V" if self.kind == "multisine" else "N"
        where = f"{self.speed * TO_RPM:.0f} rpm" + (f", {self.pressure / MPA:.2g} MPa" if self.pressure else "")
        return f"{self.kind} of {self.amplitude:g} {unit} at {where}"

    def experiment(self) -> Multisine | Impact:
        """What is run."""
        if self.kind == "multisine":
            return Multisine(
                self.speed, self.pressure, self.amplitude, LOW, HIGH, PERIOD, PERIODS, SPACING, sequence=99
            )
        return Impact(self.speed, self.pressure, self.amplitude, WIDTH, 0.6, 2, APART, LEAD)

    def trial(self) -> Trial:
        """Inputs of the run without measured data."""
        one = self.experiment()
        rows = one.rows(0, one.samples)
        length, blocks = round(PERIOD / RIG_SAMPLE), 2 if self.kind == "multisine" else 1
        start, count = len(rows) - blocks * length, int(300 * PERIOD) + 1
        empty = block_lines(np.zeros((len(rows), 2)), start, length, blocks, count)
        return Trial(
            "next", "fit", rows, self.pressure, 0.0, start, length, blocks, empty, np.zeros(count, bool)
        )  # fmt: skip

    def table(self) -> dict[str, Any]:
        """Parameters of the experiment as a plan of a campaign has them."""
        values = {"kind": self.kind, "speed": f"{self.speed * TO_RPM:.6g} rpm"}
        if self.pressure:
            values["pressure"] = show(self.pressure, "Pa")
        if self.kind == "multisine":
            more = {"amplitude": f"{self.amplitude:g} V", "low": show(LOW, "Hz"), "high": show(HIGH, "Hz"),
                    "period": show(PERIOD, "s"), "periods": PERIODS, "spacing": SPACING, "sequence": 99}  # fmt: skip
        else:
            more = {"peak": f"{self.amplitude:g} N", "width": "2 ms", "angle": "0.6 rad", "hits": 2,
                    "spacing": f"{APART:g} s", "lead": f"{LEAD:g} s"}  # fmt: skip
        return values | more


def check_allowed(names: Iterable[str]) -> tuple[str, ...]:
    """The names of what may change; raises DataError for one that is none."""
    asked = tuple(dict.fromkeys(names))
    for unknown in (name for name in asked if name not in ALLOWED):
        raise DataError(f"--allow: '{unknown}' is nothing that a plan can change; choose among {', '.join(ALLOWED)}")
    return asked or ALLOWED


def options(machine: Machine, trials: Sequence[Trial], allow: Iterable[str]) -> tuple[Option, ...]:
    """Experiments with what may change; what may not is as in the records."""
    allowed = check_allowed(allow)
    driven, fed = bool(machine.injectors) and machine.actuators is not None, machine.fed
    there = {(round(t.speed, 2), t.pressure) for t in trials}  # speeds of records that differ by nothing are one
    speeds = sorted({s for s, _ in there} | set(_hertz(machine) if "speed" in allowed else ()))
    speeds = sorted({*speeds, round(2 * np.pi * SLOW_ROLL, 2)} if "slow-roll" in allowed else speeds)
    pressures = [p * MPA for p in PRESSURES] if "pressure" in allowed and fed else sorted({p for _, p in there})
    sizes = AMPLITUDES if "amplitude" in allowed else (1.0,)
    points = list(product(speeds, pressures)) if {"speed", "pressure", "slow-roll"} & set(allowed) else sorted(there)
    base = Option("multisine" if driven else "impact", 0.0, 0.0, 1.0 if driven else HIT, 0.0)
    found = []
    for (speed, pressure), size in product(points, sizes):
        one = replace(base, speed=speed, pressure=pressure, amplitude=base.amplitude * size)
        run = one.experiment()
        found.append(replace(one, minutes=SET_UP + run.samples * run.Ts / 60))
    return tuple(found)


def _hertz(machine: Machine) -> list[float]:
    """Shaft speeds [rad/s] that a plan tries, up to the machine's highest."""
    highest = machine.drive.highest_speed or np.inf
    return [round(2 * np.pi * s, 2) for s in SPEEDS if 2 * np.pi * s <= highest]
