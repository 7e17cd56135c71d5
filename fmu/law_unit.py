"""Control law as a co-simulation unit: measured signals in, reference voltages out one sample later."""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fmu.linear_model import numbers
from fmu.model import wrapper_text
from fmu.tables import MAGIC, array, row, runs
from fmu.variables import UnitVariable
from rotorsim.control import Law, guard
from rotorsim.control.guard import FADE, FARTHEST, HOLD, SENTENCES
from rotorsim.control.law_kernel import FIRST_BLOCK

INPUTS = ("meas.disc_x", "meas.disc_y", "meas.speed", "meas.pressure")
OUTPUTS = ("piezo.ref_x", "piezo.ref_y")
ALARM = "law.alarm"
CODES = "; ".join(f"{code:g}: {sentence}" for code, sentence in SENTENCES.items())


@dataclass(frozen=True, eq=False)
class LawUnit:
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
        parts = [self.law.hash, self.name, repr(self.variables), wrapper_text()]
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:32]

    @property
    def token(self) -> str:
        """Instantiation token of FMI 3.0, GUID of FMI 2.0."""
        return f"{{{uuid.UUID(self.hash)}}}"

    def stimuli(self, n: int, step: float) -> dict[str, np.ndarray]:
        """Inputs (n,) for a run of n steps [s]: a decaying swing of the disc while speed and pressure rise."""
        t = step * np.arange(n)
        end = max(t[-1], step)
        swing = 5e-6 * np.exp(-20 * t) * np.sin(750 * t)
        return {
            INPUTS[0]: 1e-5 + swing,
            INPUTS[1]: -8e-6 + 0.5 * np.roll(swing, 3),
            INPUTS[2]: self.speed + 300.0 * t / end,
            INPUTS[3]: self.pressure + 2e5 * t / end,
        }


def law_variables(unit: LawUnit) -> Iterator[UnitVariable]:
    """Inputs as the plant's unit calls its outputs, outputs as it calls its inputs."""
    yield UnitVariable("time", "time", "Simulation time.", "s")
    starts = (0.0, 0.0, unit.speed, unit.pressure)
    words = ("Measured disc x.", "Measured disc y.", "Measured speed.", "Measured gauge pressure.")
    for k, (name, doc, start) in enumerate(zip(INPUTS, words, starts, strict=True)):
        yield UnitVariable(name, "input", doc, ("m", "m", "rad/s", "Pa")[k], k, start=start)
    for k, name in enumerate(OUTPUTS):
        yield UnitVariable(name, "output", f"Reference along {'xy'[k]}.", "V", k)
    doc = f"Alarm: 0 as long as the law acts fully. {CODES}."
    yield UnitVariable(ALARM, "output", doc, index=len(OUTPUTS), kind="integer")


def header(unit: LawUnit) -> str:
    """Text of tables.h."""
    law, L = unit.law, unit.law.layout
    defines = {
        "MAGIC": f'"{MAGIC}"', "MODEL_HASH": f'"{unit.hash}"', "TOKEN": f'"{unit.token}"',
        "SAMPLE": unit.sample.hex(), "CONTINUOUS": 0, "N_STATES": 0, "N_VARIABLES": len(unit.variables),
        "N_INPUTS": len(INPUTS), "N_OUT": len(OUTPUTS) + 1, "N_P": 1, "N_W": L.size, "N_IX": 1,
        "N_RUNS": len(runs(rested(law))), "N_PRESSURE": 0, "N_TABLE": law.table.size, "N_SPEEDS": L.speeds,
        "N_PRESSURES": L.pressures, "ORDER": L.n, "BLOCK": L.block, "SETTINGS": numbers(np.array(law.settings)),
    }  # fmt: skip
    defines |= {f"L_{name.upper()}": getattr(L, name) for name in ("B", "C", "D", "W", "x", "new", "centre", "sums")}
    defines |= {
        "N_AXES": law.axes.size,
        "L_DONE": L.done,
        "L_GUARD": L.guard,
        "GUARDED": 1,
        "HOLD": HOLD,
        "FADE_OUT": FADE,
        "QUICK": guard.QUICK,
        "SLOW": guard.SLOW,
        "LEAST": guard.LEAST,
        "FARTHEST": FARTHEST,
    }
    defines |= {f"FAULT_{name}": getattr(guard, name) for name in FAULTS}
    kept = ("OUT", "BEGIN", "BAD", "BACK", "SPAN", "ALARM", "LAST", "LOST", "STEP")
    defines |= {f"G_{name}": getattr(guard, name) for name in kept}
    defines |= _plausibility(law)
    lines = [f"#define {name} {value}" for name, value in defines.items()]
    return "\n".join(["/* Written by the exporter. */", "#ifndef TABLES_H", "#define TABLES_H", *lines, "#endif", ""])


FAULTS = ("SENSOR", "POINT", "OVERFLOW", "JUMP", "STUCK", "POINT_FAR", "RANGE", "CONNECTION", "UNSTEADY")
LAYOUT = ("checks", "seen", "pn", "pspeeds", "ppressures", "pB", "pC", "pL", "pS", "psize", "pblock", "px", "pnew")
KEPT = (
    "SEEN",
    "GOOD",
    "SAME",
    "CHANGED",
    "AT",
    "COUNT",
    "FRESH",
    "AWAY",
    "REST",
    "REASON",
    "LENGTH",
    "SINCE",
    "RETURNS",
    "KNOWN",
    "OTHER",
    "HELD",
)
CONSTANTS = (
    "NU",
    "DOUBT",
    "MISSED",
    "LATELY",
    "WAYS",
    "GLITCH",
    "ACCEPTED",
    "OFTEN",
    "FORGOTTEN",
    "ARMED",
    "REFRESHED",
)


def _plausibility(law: Law) -> dict[str, object]:
    """Definitions of plausibility.h; none of them is used without limits."""
    defines: dict[str, object] = {f"L_{name.upper()}": getattr(law.layout, name) for name in (*LAYOUT, "evidence")}
    defines |= {f"M_{name}": getattr(guard, name) for name in KEPT}
    defines |= {name: getattr(guard, name) for name in CONSTANTS}
    defines |= {name: getattr(guard, name) for name in vars(guard) if name.startswith("T_")}
    pauses = (guard.PAUSE, guard.MOST, guard.SETTLED)
    defines |= dict(zip(("PAUSE_FIRST", "PAUSE_MOST", "PAUSE_SETTLED"), pauses, strict=True))
    return defines | {"FIRST_BLOCK": FIRST_BLOCK}


def source(unit: LawUnit) -> str:
    """Text of tables.c."""
    law = unit.law
    return "\n".join(
        [
            "/* Written by the exporter. */",
            '#include "unit.h"',
            array("const Variable variables[N_VARIABLES]", (row(v) for v in unit.variables)),
            array("const Run initial_runs[N_RUNS]", (f"{{{n}, {x.hex()}}}" for n, x in runs(rested(law)))),
            array("const double initial_parameters[N_P]", ["0.0"]),
            array("const int64_t indices[N_IX]", ["0"]),
            array("const int32_t pressure_nodes[N_PRESSURE + 1][2]", ["{0, 0}"]),
            array("const double law_table[N_TABLE]", (float(x).hex() for x in law.table)),
            array("const double law_axes[N_AXES]", (float(x).hex() for x in law.axes)),
            "",
        ]
    )


def rested(law: Law) -> np.ndarray:
    """The memory (size,) of a law that has seen nothing yet."""
    at_rest = law.with_()
    return at_rest.memory


def answered(law: Law, inputs: dict[str, np.ndarray], per: int = 1) -> np.ndarray:
    """References (n + 1, 2) [V] of the law in Python for inputs held over `per` samples each; the first is zero."""
    law = law.with_()
    rows = [np.zeros(2)]
    for x, y, speed, pressure in zip(*(inputs[name] for name in INPUTS), strict=True):
        for _ in range(per):
            reference = law.step((x, y), speed, pressure)
        rows.append(reference)
    return np.array(rows)
