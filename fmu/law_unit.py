"""Control law as a co-simulation unit: measured signals in, reference voltages out one sample later."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fmu.model import Unit, fingerprint, numbers, runs
from fmu.variables import UnitVariable
from rotorsim.control import Law, guard
from rotorsim.control.guard import SENTENCES
from rotorsim.control.law_kernel import FIRST_BLOCK, TURN

INPUTS = ("meas.disc_x", "meas.disc_y", "meas.speed", "meas.pressure")
ANGLE = "meas.angle"
"""Input of a law with a runout table."""
OUTPUTS = ("piezo.ref_x", "piezo.ref_y")
ALARM = "law.alarm"
CODES = "; ".join(f"{code:g}: {sentence}" for code, sentence in SENTENCES.items())
FAULTS = ("SENSOR", "POINT", "OVERFLOW", "JUMP", "STUCK", "POINT_FAR", "RANGE", "CONNECTION", "UNSTEADY", "ANGLE")
LAYOUT = ("B", "C", "D", "W", "x", "new", "centre", "sums", "done", "guard", "checks", "seen", "pn", "pspeeds",
          "ppressures", "pB", "pC", "pL", "pS", "psize", "pblock", "px", "pnew", "evidence",
          "runout", "angles")  # fmt: skip
"""Offsets of a law's layout that its C file uses."""
KEPT = ("OUT", "BEGIN", "BAD", "BACK", "SPAN", "ALARM", "LAST", "LOST", "STEP")
SEEN = ("SEEN", "GOOD", "SAME", "CHANGED", "AT", "COUNT", "FRESH", "AWAY", "REST", "REASON", "LENGTH", "SINCE",
        "RETURNS", "KNOWN", "OTHER", "HELD")  # fmt: skip
"""Offsets in the memories of the guard and of its checks of plausibility."""
CONSTANTS = ("HOLD", "QUICK", "SLOW", "LEAST", "FARTHEST", "NU", "DOUBT", "MISSED", "LATELY", "WAYS", "GLITCH",
             "ACCEPTED", "OFTEN", "FORGOTTEN", "ARMED", "REFRESHED",
             "WOUND")  # fmt: skip
PAUSES = {"PAUSE_FIRST": guard.PAUSE, "PAUSE_MOST": guard.MOST, "PAUSE_SETTLED": guard.SETTLED}


@dataclass(frozen=True, eq=False)
class LawUnit(Unit):
    """A law to be exported; `speed` [rad/s] and gauge `pressure` [Pa] are the start values of its inputs."""

    law: Law
    speed: float = 0.0
    pressure: float = 0.3e6
    chosen_name: str = ""
    core = "law.c"
    continuous = False

    @property
    def name(self) -> str:
        """The law's name."""
        return self.law.name

    @property
    def unit_name(self) -> str:
        """Name of the unit."""
        return self.chosen_name or f"{self.name}_law"

    @property
    def description(self) -> str:
        """One sentence."""
        scheduled = ", scheduled over speed and pressure" if self.law.scheduled else ""
        return f"{self.name}: control law of {self.law.order} states{scheduled}."

    @property
    def sample(self) -> float:
        """Time [s] of which communication steps are multiples."""
        return self.law.Ts

    @cached_property
    def variables(self) -> tuple[UnitVariable, ...]:
        """The table of variables."""
        return tuple(law_variables(self))

    @cached_property
    def hash(self) -> str:
        """Fingerprint of the law and its variables."""
        return fingerprint(self.law.hash, self.name, repr(self.variables))

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return INPUTS if self.law.runout is None else (*INPUTS, ANGLE)

    def stimuli(self, n: int, step: float) -> dict[str, np.ndarray]:
        """Inputs (n,) for a run of n steps [s]: a decaying swing of the disc while speed and pressure rise."""
        t = step * np.arange(n)
        end = max(t[-1], step)
        swing = 5e-6 * np.exp(-20 * t) * np.sin(750 * t)
        seen = {
            INPUTS[0]: 1e-5 + swing,
            INPUTS[1]: -8e-6 + 0.5 * np.roll(swing, 3),
            INPUTS[2]: self.speed + 300.0 * t / end,
            INPUTS[3]: self.pressure + 2e5 * t / end,
            ANGLE: self.speed * t + 150.0 * t * t / end,
        }
        return {name: seen[name] for name in self.inputs}

    def defines(self) -> dict[str, object]:
        """Sizes and offsets of the law's table and memory, and the numbers of its guard."""
        law, L = self.law, self.law.layout
        return {
            "N_INPUTS": len(self.inputs), "N_OUT": len(OUTPUTS) + 1, "N_W": L.size, "N_RUNS": len(runs(rested(law))),
            "N_TABLE": law.table.size, "N_AXES": law.axes.size, "N_SPEEDS": L.speeds, "N_PRESSURES": L.pressures,
            "ORDER": L.n, "BLOCK": L.block, "SETTINGS": numbers(np.array(law.settings)), "GUARDED": 1,
            "FADE_OUT": guard.FADE, "FIRST_BLOCK": FIRST_BLOCK, **PAUSES, "TURN": TURN.hex(),
            **{f"L_{name.upper()}": getattr(L, name) for name in LAYOUT},
            **{f"FAULT_{name}": getattr(guard, name) for name in FAULTS},
            **{f"G_{name}": getattr(guard, name) for name in KEPT},
            **{f"M_{name}": getattr(guard, name) for name in SEEN},
            **{name: getattr(guard, name) for name in vars(guard) if name in CONSTANTS or name.startswith("T_")},
        }  # fmt: skip

    def arrays(self) -> dict[str, Iterable[str]]:
        """Memory at rest, table and axes."""
        return {
            "Run initial_runs[N_RUNS]": (f"{{{n}, {x.hex()}}}" for n, x in runs(rested(self.law))),
            "double law_table[N_TABLE]": (float(x).hex() for x in self.law.table),
            "double law_axes[N_AXES]": (float(x).hex() for x in self.law.axes),
        }


def law_variables(unit: LawUnit) -> Iterator[UnitVariable]:
    """Inputs as the plant's unit calls its outputs, outputs as it calls its inputs."""
    yield UnitVariable("time", "time", "Simulation time.", "s")
    rows = (
        ("Measured disc x.", "m", 0.0), ("Measured disc y.", "m", 0.0), ("Measured speed.", "rad/s", unit.speed),
        ("Measured gauge pressure.", "Pa", unit.pressure), ("Measured shaft angle.", "rad", 0.0),
    )  # fmt: skip
    for k, (name, (doc, of, start)) in enumerate(zip(unit.inputs, rows, strict=False)):
        yield UnitVariable(name, "input", doc, of, k, start=start)
    for k, name in enumerate(OUTPUTS):
        yield UnitVariable(name, "output", f"Reference along {'xy'[k]}.", "V", k)
    doc = f"Alarm: 0 as long as the law acts fully. {CODES}."
    yield UnitVariable(ALARM, "output", doc, index=len(OUTPUTS), kind="integer")


def rested(law: Law) -> np.ndarray:
    """The memory (size,) of a law that has seen nothing yet."""
    at_rest = law.with_()
    return at_rest.memory


def answered(law: Law, inputs: dict[str, np.ndarray], per: int = 1) -> np.ndarray:
    """References (n + 1, 2) [V] of the law in Python for inputs held over `per` samples each; the first is zero."""
    law = law.with_()
    rows = [np.zeros(2)]
    names = INPUTS if law.runout is None else (*INPUTS, ANGLE)
    for x, y, *point in zip(*(inputs[name] for name in names), strict=True):
        for _ in range(per):
            reference = law.step((x, y), *point)
        rows.append(reference)
    return np.array(rows)
