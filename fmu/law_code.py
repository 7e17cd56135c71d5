r"""C of a control law: the tables of its unit, and two files without FMI for a microcontroller.

`fmu/c/control_law.c` and its header are the one text of both. For a microcontroller its branches are resolved, the
tables stand in it and names begin with the law's, so that an engineer reads the law and nothing else. In float64 it has
the bits of `rotorsim.control.law_kernel`; the error of float32 is measured at the export with the law's equation,

.. math:: v = C x + D (y - y_c) + b, \quad x^+ = A x + B (y - y_c) + W (sat(v) - v),

in both precisions at points of its table. All memory is one struct, and nothing is allocated or called by itself.

Cites: astrom_1997.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.base.units import MPA, TO_RPM
from rotorsim.control import Law, guard
from rotorsim.control.law_kernel import TURN

CONSTANTS = {
    "HOLD": guard.HOLD, "FADE_OUT": guard.FADE, "QUICK": guard.QUICK, "SLOW": guard.SLOW, "LEAST": guard.LEAST,
    "FARTHEST": guard.FARTHEST, "WOUND": guard.WOUND, "TURN": TURN, "GLITCH": guard.GLITCH,
    "ACCEPTED": guard.ACCEPTED, "OFTEN": guard.OFTEN, "FORGOTTEN": guard.FORGOTTEN, "ARMED": guard.ARMED,
    "PAUSE_FIRST": guard.PAUSE, "PAUSE_MOST": guard.MOST, "PAUSE_SETTLED": guard.SETTLED, "NU": guard.NU,
    "DOUBT": guard.DOUBT, "MISSED": guard.MISSED, "LATELY": guard.LATELY, "REFRESHED": guard.REFRESHED,
}  # fmt: skip
"""Numbers of the guard, of the runout and of the checks; see `rotorsim.control.guard`."""
NEEDED = {
    "LAW_CHECKED": ("GLITCH", "ACCEPTED", "OFTEN", "FORGOTTEN", "ARMED", "PAUSE_FIRST", "PAUSE_MOST", "PAUSE_SETTLED"),
    "LAW_PREDICTED": ("NU", "DOUBT", "MISSED", "LATELY", "REFRESHED"),
    "LAW_ANGLES": ("WOUND", "TURN", "FLOOR"),
}
"""Constants that only some laws need, by the size that is positive then."""
ALARMS = {
    "OK": guard.OK, "SENSOR": guard.SENSOR, "POINT": guard.POINT, "OVERFLOW": guard.OVERFLOW, "JUMP": guard.JUMP,
    "STUCK": guard.STUCK, "POINT_FAR": guard.POINT_FAR, "OUT_OF_RANGE": guard.RANGE, "CONNECTION": guard.CONNECTION,
    "UNSTEADY": guard.UNSTEADY, "ANGLE": guard.ANGLE,
}  # fmt: skip
LONGEST_COUNT = 2**24
"""Samples beyond which a count in float32 stands still."""
TESTS, EVERY = 16, 128
"""Outputs of the self test, and samples from one to the next."""
RUN = 1000
"""Samples of a run that the error of float32 is measured in."""
PRECISIONS = {"float64": np.float64, "float32": np.float32}


@dataclass(frozen=True)
class LawCode:
    """C of a law in a precision; a law without states gets one that stays zero, which changes no bit."""

    law: Law
    precision: str = "float64"

    def __post_init__(self) -> None:
        if self.precision not in PRECISIONS:
            raise DataError(
                f"precision: '{self.precision}' is not known; choose float64 or float32",
                argument="precision",
                value=self.precision,
            )
        s = self.law.settings
        if self.precision == "float32" and s.start + s.average + s.fade >= LONGEST_COUNT:
            raise DataError(
                f"precision: the law comes in over {s.start + s.average + s.fade:.0f} samples, and float32 counts to "
                f"{LONGEST_COUNT}; choose float64",
                argument="precision",
                value=self.precision,
            )

    @property
    def states(self) -> int:
        """Number of states in C."""
        return max(self.law.order, 1)

    def number(self, value: float) -> str:
        """A literal that reads back to the last bit of the precision."""
        if self.precision == "float64":
            return repr(float(value))
        limit = float(np.finfo(np.float32).max)
        return f"{float(str(np.float32(min(max(value, -limit), limit))))!r}f"

    def nested(self, values: np.ndarray, indent: str = "") -> str:
        """An initialiser, a line for each row of a matrix."""
        if values.ndim == 1:
            return "{" + ", ".join(map(self.number, values)) + "}"
        return "{" + f",\n{indent} ".join(self.nested(row, f"{indent} ") for row in values) + "}"

    def sizes(self) -> dict[str, object]:
        """Sizes of memory and tables, which the header needs."""
        L = self.law.layout
        return {
            "LAW_REAL": "double" if self.precision == "float64" else "float", "LAW_STATES": self.states,
            "LAW_SPEEDS": L.speeds, "LAW_PRESSURES": L.pressures, "LAW_CHECKED": int(L.checks >= 0),
            "LAW_PREDICTED": L.pn, "LAW_MODEL_SPEEDS": L.pspeeds, "LAW_MODEL_PRESSURES": L.ppressures,
            "LAW_WAYS": guard.WAYS, "LAW_ANGLES": L.angles, "LAW_FADES": int(self.law.settings.fade > 0),
            **{f"LAW_{name}": int(code) for name, code in ALARMS.items()},
        }  # fmt: skip

    def constants(self) -> dict[str, object]:
        """Settings of the law and numbers of its guard; whole numbers as such."""
        s, (x, y), sizes = self.law.settings, self.law.centre or (0.0, 0.0), self.sizes()
        left_out = {name for size, names in NEEDED.items() if not sizes[size] for name in names}
        settings = {"REFRESH": s.refresh, "START": s.start, "AVERAGE": s.average, "FADE_IN": s.fade}
        known = {name: value for name, value in CONSTANTS.items() if name not in left_out}
        found: dict[str, object] = {name: self._constant(value) for name, value in (settings | known).items()}
        functions = {"ABS": self._function("fabs"), "FLOOR": self._function("floor")}
        reals = {"LIMIT": s.limit, "BIAS_X": s.bias_x, "BIAS_Y": s.bias_y, "CENTRE_X": x, "CENTRE_Y": y}
        found |= {name: self.number(value) for name, value in reals.items()}
        return found | {name: text for name, text in functions.items() if name not in left_out}

    def _constant(self, value: float) -> str:
        return str(int(value)) if value == int(value) and abs(value) < LONGEST_COUNT else self.number(value)

    def _function(self, name: str) -> str:
        return name if self.precision == "float64" else f"{name}f"

    def arrays(self) -> dict[str, Iterable[str]]:
        """Items of the tables by their declarations."""
        law, L = self.law, self.law.layout
        found: dict[str, Iterable[str]] = {
            "law_matrices law_table[LAW_SPEEDS][LAW_PRESSURES]": self._over(
                {name: padded(name, getattr(law, name)) for name in "ABCDW"}, law.speeds, law.pressures
            ),
            "law_real law_speeds[LAW_SPEEDS]": self._line(law.speeds),
            "law_real law_pressures[LAW_PRESSURES]": self._line(law.pressures),
        }
        if law.plausibility is not None:
            v = law.plausibility.limits
            ends = {"jump": v[0], "range": v[1], "stuck": v[2], "speed": v[3:6], "pressure": v[6:9], "evidence": v[9]}
            ends |= {"model_speed": v[10:12], "model_pressure": v[12:14]}
            found["law_limits limits"] = self._members(ends)
        if L.pn:
            assert law.plausibility is not None and law.plausibility.predictors is not None
            p = law.plausibility.predictors
            s, q = len(p.speeds), len(p.pressures)
            parts = {name: np.asarray(getattr(p, name)) for name in "ABC"} | {"L": p.gain, "S": p.weights}
            parts = {name: values.reshape(s, q, *values.shape[2:]) for name, values in parts.items()}
            name = "law_predictor predictor_table[LAW_MODEL_SPEEDS][LAW_MODEL_PRESSURES]"
            found[name] = self._over(parts, p.speeds, p.pressures)
            found["law_real model_speeds[LAW_MODEL_SPEEDS]"] = self._line(p.speeds)
            found["law_real model_pressures[LAW_MODEL_PRESSURES]"] = self._line(p.pressures)
        if law.runout is not None:
            found["law_real runout[LAW_ANGLES][2]"] = map(self.nested, law.runout.values)
        return found

    def _line(self, values: np.ndarray) -> list[str]:
        return [", ".join(map(self.number, values))]

    def _over(self, parts: dict[str, np.ndarray], speeds: np.ndarray, pressures: np.ndarray) -> Iterator[str]:
        """Structs over speeds and pressures: parts (speeds, pressures, ...) by the names of the members."""
        for i, speed in enumerate(speeds):
            point = [
                f"{{ /* {speed * TO_RPM:.6g} rpm, {pressure / MPA:.6g} MPa */\n        "
                + ",\n        ".join(self._members({name: values[i, j] for name, values in parts.items()}))
                + "}"
                for j, pressure in enumerate(pressures)
            ]
            yield "{" + ",\n     ".join(point) + "}"

    def _members(self, parts: dict[str, Any]) -> list[str]:
        return [
            f".{name} = " + (self.nested(value, " " * 13) if np.ndim(value) else self.number(value))
            for name, value in parts.items()
        ]


EMPTY = {"A": (1, 1), "B": (1, 2), "C": (2, 1), "W": (1, 2)}
"""Shapes of a state that stays zero."""


def padded(name: str, values: np.ndarray) -> np.ndarray:
    """Matrices (s, p, ...) of a law, those of one without states with a state of zeros."""
    return values if values.size or name == "D" else np.zeros((*values.shape[:2], *EMPTY[name]))


def write_law(law: Law, name: str, file: str, precision: str = "float64") -> tuple[str, str]:
    """Header FILE.h and source FILE.c of a law, C99 without FMI, whose names begin with `name`.

    Raises DataError for a precision that the law cannot have.
    """
    code = LawCode(law, precision)
    sizes = code.sizes()
    known = sizes | {"LAW_TESTED": 1}
    folder = Path(__file__).parent / "c"
    head = resolved((folder / "control_law.h").read_text(encoding="utf-8"), known)
    body = resolved((folder / "control_law.c").read_text(encoding="utf-8"), known)
    alarms = {key: value for key, value in sizes.items() if key.removeprefix("LAW_") in ALARMS}
    hidden = (*alarms, "LAW_REAL", "LAW_CHECKED", "LAW_FADES")
    if not sizes["LAW_PREDICTED"]:
        hidden = (*hidden, "LAW_WAYS", "LAW_MODEL_SPEEDS", "LAW_MODEL_PRESSURES")
    used = {key: value for key, value in sizes.items() if key not in hidden and value}
    public = [*_defines(used), "", "/* Alarms. */", *(_alarm(key, value) for key, value in alarms.items())]
    head = head.replace('#include "tables.h"', "\n".join(public)).replace("LAW_REAL", str(sizes["LAW_REAL"]))
    tables = (f"static const {key} = {{\n    " + ",\n    ".join(items) + "\n};" for key, items in code.arrays().items())
    inside = [*_defines(code.constants()), "", *tables, "", *_test(code)]
    body = re.sub(r"(extern const .*\n)+", "\n".join(inside) + "\n", body, count=1)
    about = _about(code, name)
    both = f"{about}{head}", f"/* The law in {file}.h. */\n{body}".replace('"control_law.h"', f'"{file}.h"')
    return _renamed(both[0], name), _renamed(both[1], name)


def resolved(text: str, known: dict[str, object]) -> str:
    """C without its branches `#if NAME ... #else ... #endif` on known numbers; others stay."""
    lines, kept = [], [True]
    branch: list[bool] = []
    for line in text.splitlines():
        word, _, rest = line.partition(" ")
        if word in ("#if", "#ifdef", "#ifndef"):
            branch.append(word == "#if" and rest in known)
            kept.append(kept[-1] and (bool(known[rest]) if branch[-1] else True))
            if branch[-1]:
                continue
        elif word in ("#else", "#endif") and branch[-1]:
            value = kept.pop()
            if word == "#else":
                kept.append(kept[-1] and not value)
            else:
                branch.pop()
            continue
        elif word == "#endif":
            branch.pop()
            if kept.pop():
                lines.append(line)
            continue
        if kept[-1]:
            lines.append(line)
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)) + "\n"


def _renamed(text: str, name: str) -> str:
    """C whose names begin with that of the law, so that two laws fit into one program."""
    text = re.sub(r"\bLAW_(?=[A-Z])", f"{name.upper()}_", text)
    return re.sub(r"\blaw_(?=[a-z])", f"{name}_", text)


def _defines(values: dict[str, object]) -> list[str]:
    return [f"#define {name} {value}" for name, value in values.items()]


def _alarm(name: str, code: object) -> str:
    sentence = guard.SENTENCES.get(float(str(code)), "the law acts fully" if code == 0 else "")
    text = "sensors are reversed or swapped, one code each" if name == "LAW_CONNECTION" else sentence.split(":")[0]
    return f"#define {name} {code} /* {text} */"


def _about(code: LawCode, name: str) -> str:
    law = code.law
    size = 8 if code.precision == "float64" else 4
    numbers = law.table.size + law.axes.size
    exact = "the same bits as rotorsim in Python, compiled without contraction or extended precision"
    if code.precision == "float32":
        worst, rms = float_error(law)
        exact = (
            f"the references differ from float64's by {worst:.2g} V at most and {rms:.2g} V rms over {RUN} samples\n"
            "   of a swing of 5 um with 0.3 um of noise, at the corners of the table and in its middle"
        )
    angle = "taken off over the shaft angle; give the angle within a few turns" if law.runout else "none"
    points = f"{law.speeds.size} speeds x {law.pressures.size} pressures"
    return f"""/* {name}: control law {law.name} of {law.order} states, {points}.

   x+ = A x + B (y - centre) + W (sat(v) - v), v = C x + D (y - centre) + bias, reference = sat(share v)

   Call law_step once every {law.Ts * 1e3:g} ms; the reference, within {law.limit:g} V, acts from the next sample on.
   Runout of the sensors: {angle}.
   {code.precision}: {exact}.
   Compile with -std=c99 -ffp-contract=off, without -ffast-math; call law_self_test once on the target.
   Memory: law_memory and some {numbers * size / 1000:.1f} kB of constant tables; no allocation, no recursion. */
"""


def sequence(n: int) -> np.ndarray:
    """Numbers (n, 2) from -32768 to 32767 of the self test's generator."""
    state, rows = 1, np.empty(2 * n)
    for k in range(2 * n):
        state = (state * 1664525 + 1013904223) & 0xFFFFFFFF
        rows[k] = (state >> 16) - 32768
    return rows.reshape(n, 2)


def _test(code: LawCode) -> list[str]:
    """Constants of the self test: noise with NaN, speed and pressure rising; inputs are exact in float32."""
    law, limits = code.law, code.law.plausibility
    s = law.settings
    every = EVERY + int(s.start + s.average + s.fade) // TESTS
    n = every * TESTS
    jump = min(np.inf if limits is None else min(limits.jump, limits.range), 2e-5)
    scale = 2.0 ** np.floor(np.log2(jump / 2**17))
    speed, speed_step = _ramp(law.speeds, n)
    pressure, pressure_step = _ramp(law.pressures, n)
    angle_step, running, rows = 2.0**-6, law.with_(), []
    for k, pair in enumerate(scale * sequence(n)):
        if k % every == every - 8:
            pair[k // every % 2] = np.nan
        at = speed + speed_step * k, pressure + pressure_step * k
        out = running.step(pair, *at, angle_step * k)
        if k % every == every - 1:
            rows.append(out)
    wide = 1e-6 * law.limit if code.precision == "float64" else max(1e-4 * law.limit, 20 * float_error(law)[0])
    values = {
        "TEST_SAMPLES": n, "TEST_EVERY": every, "TEST_EXACT": int(code.precision == "float64"),
        "TEST_SCALE": code.number(scale), "TEST_SPEED": code.number(speed), "TEST_SPEED_STEP": code.number(speed_step),
        "TEST_PRESSURE": code.number(pressure), "TEST_PRESSURE_STEP": code.number(pressure_step),
        "TEST_ANGLE_STEP": code.number(angle_step), "TEST_ERROR": code.number(wide),
        "NOT_FINITE": "0xF0 /* exponent bits in the second byte of a number */"
        if code.precision == "float64" else "0x80 /* exponent bits in the second byte of a number */",
    }  # fmt: skip
    table = ",\n    ".join(code.nested(row) for row in rows)
    return [*_defines(values), f"static const law_real test_references[{TESTS}][2] = {{\n    {table}\n}};"]


def _ramp(axis: np.ndarray, n: int) -> tuple[float, float]:
    """Start, a whole number, and step, a power of two, of a rise over most of an axis in n samples."""
    span = float(axis[-1] - axis[0])
    return float(np.ceil(axis[0])), 2.0 ** max(np.floor(np.log2(span / n)), -10) if span > 0 else 0.0


def float_error(law: Law) -> tuple[float, float]:
    """Largest and rms difference [V] of the law's equation in float32 from float64, over points of its table.

    Raises DataError where float32 does not follow: a difference of a tenth of the limit.
    """
    rng, t = np.random.default_rng(0), law.Ts * np.arange(RUN)
    y = 5e-6 * np.column_stack([np.sin(750 * t), np.cos(750 * t)]) + 3e-7 * rng.normal(size=(RUN, 2))
    ends = [sorted({0, len(axis) // 2, len(axis) - 1}) for axis in (law.speeds, law.pressures)]
    with np.errstate(all="ignore"):  # a law that is unstable while it saturates overflows
        differences = [
            np.abs(_equation(law, i, j, y, np.float32) - _equation(law, i, j, y, np.float64))
            for i in ends[0] for j in ends[1]
        ]  # fmt: skip
    worst = float(np.max(differences))
    if not worst < 0.1 * law.limit:
        raise DataError(
            f"precision: in float32 the reference is off by up to {worst:.2g} V; choose float64",
            argument="precision",
            value="float32",
        )
    return worst, float(np.sqrt(np.mean(np.square(differences))))


def _equation(law: Law, i: int, j: int, y: np.ndarray, kind: Any) -> np.ndarray:
    """References (n, 2) [V] of the law's equation at a point of its table, computed in a precision."""
    A, B, C, D, W = (kind(getattr(law, name)[i, j]) for name in "ABCDW")
    x, out, limit, bias = np.zeros(law.order, kind), np.empty(y.shape), kind(law.limit), kind(law.bias)
    for k, now in enumerate(kind(y)):
        v = C @ x + D @ now + bias
        out[k] = np.clip(v, -limit, limit)
        x = A @ x + B @ now + W @ (kind(out[k]) - v)
    return out
