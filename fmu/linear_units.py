r"""Units of linear systems: an identified LPV model, continuous or sampled, and a control law.

.. math:: \dot x = A(q) x + B(q) u, \quad y = C(q) x + D(q) u, \quad q = (\Omega, p)

Every element of [A B; C D] is a sum of products of at most two parameters theta (the structures of
`identification.local.greybox` are affine in each parameter alone), and theta is polynomial in q. So the matrices, and
their derivatives by q, are exact in the unit. A scheduled controller is the same with a period Ts: whatever has `terms`
and surfaces can be exported this way. Its C files are a table of the terms.

A control law is a co-simulation unit: measured signals in, reference voltages out one sample later. A continuous model
is one for model exchange too.

Cites: astrom_1997.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from fmu.law_code import LawCode
from fmu.model import Unit, fingerprint, numbers
from fmu.variables import UnitVariable
from identification.local.blackbox import FullStateSpace
from identification.local.greybox import STRUCTURES
from identification.lpv_model import LpvModel
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.control import Law
from rotorsim.control.guard import SENTENCES

INPUTS = ("meas.disc_x", "meas.disc_y", "meas.speed", "meas.pressure")
ANGLE = "meas.angle"
"""Input of a law with a runout table."""
OUTPUTS = ("piezo.ref_x", "piezo.ref_y")
ALARM = "law.alarm"
CLOCK = "law.clock"
"""Periodic clock of a law that has one."""
CODES = "; ".join(f"{code:g}: {sentence}" for code, sentence in SENTENCES.items())


@dataclass(frozen=True, eq=False)
class LawUnit(Unit):
    """A law to be exported; `speed` [rad/s] and gauge `pressure` [Pa] are the start values of its inputs.

    A `clocked` one answers at the ticks of a periodic clock (FMI 3.0), any other at the end of a step.
    """

    law: Law
    speed: float = 0.0
    pressure: float = 0.3e6
    chosen_name: str = ""
    clocked: bool = False
    core = ("law.c", "control_law.c")
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
        """Sizes of the law's tables and the numbers of its guard; a law without FMI has the same."""
        code = LawCode(self.law)
        return {
            "N_INPUTS": len(self.inputs), "N_OUT": len(OUTPUTS) + 1, "N_W": "(sizeof(law_memory) / sizeof(double))",
            "GUARDED": 1, "CLOCKED": int(self.clocked), "LAW_TESTED": 0, **code.sizes(), **code.constants(),
        }  # fmt: skip

    def arrays(self) -> dict[str, Iterable[str]]:
        """Memory before the first sample, and the law's tables."""
        return {"Run initial_runs[N_RUNS]": ["{N_W, 0.0}"], **LawCode(self.law).arrays()}


def law_variables(unit: LawUnit) -> Iterator[UnitVariable]:
    """Inputs as the plant's unit calls its outputs, outputs as it calls its inputs."""
    yield UnitVariable("time", "time", "Simulation time.", "s")
    rows = (
        ("Measured disc x.", "m", 0.0), ("Measured disc y.", "m", 0.0), ("Measured speed.", "rad/s", unit.speed),
        ("Measured gauge pressure.", "Pa", unit.pressure), ("Measured shaft angle.", "rad", 0.0),
    )  # fmt: skip
    clock = CLOCK if unit.clocked else ""
    for k, (name, (doc, of, start)) in enumerate(zip(unit.inputs, rows, strict=False)):
        yield UnitVariable(name, "input", doc, of, k, start=start, clock=clock)
    for k, name in enumerate(OUTPUTS):
        yield UnitVariable(name, "output", f"Reference along {'xy'[k]}.", "V", k, clock=clock)
    doc = f"Alarm: 0 as long as the law acts fully. {CODES}."
    yield UnitVariable(ALARM, "output", doc, index=len(OUTPUTS), kind="integer", clock=clock)
    if clock:
        yield UnitVariable(clock, "ticks", "Clock of the law: its inputs are read at a tick.", kind="clock")


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


Matrices = Callable[[np.ndarray], tuple[np.ndarray, ...]]


@dataclass(frozen=True, eq=False)
class LinearUnit(Unit):
    """An LPV model to be exported under a name; it starts at rest at `speed` [rad/s] and gauge `pressure` [Pa]."""

    lpv: LpvModel
    name: str
    speed: float
    pressure: float
    chosen_name: str = ""
    core = ("linear.c",)

    @property
    def unit_name(self) -> str:
        """Name of the unit."""
        return self.chosen_name or f"{self.name}_model"

    @property
    def description(self) -> str:
        """One sentence."""
        return f"{self.name}: identified model of order {self.order}, displacement from the operating point's."

    @property
    def continuous(self) -> bool:
        """Whether it can be used for model exchange."""
        return self.lpv.Ts == 0.0

    @property
    def extrapolates(self) -> bool:
        """Whether it starts outside the range it was identified in."""
        start = np.array([self.speed, self.pressure])
        slack = 1e-6 * (np.abs(self.lpv.high) + np.abs(self.lpv.low))
        return bool(np.any(start < self.lpv.low - slack) or np.any(start > self.lpv.high + slack))

    @property
    def sample(self) -> float:
        """Time [s] of which communication steps are multiples."""
        return self.lpv.Ts or RIG_SAMPLE

    @cached_property
    def order(self) -> int:
        """Number of states."""
        return len(self.matrices(np.zeros(len(self.lpv.coefficients)))[0])

    @property
    def matrices(self) -> Matrices:
        """A, B, C, D from parameters."""
        if self.lpv.kind == "blackbox":
            return FullStateSpace(self.lpv.states, 2, 2).sampled
        return STRUCTURES[self.lpv.kind].matrices

    @cached_property
    def terms(self) -> list[tuple[int, int, int, int, float]]:
        """Row, column, i, j, factor: [A B; C D] is the sum of factor theta_i theta_j, with theta_-1 = 1."""
        return list(find_terms(self.matrices, len(self.lpv.coefficients), self.lpv.kind != "blackbox"))

    @cached_property
    def sizes(self) -> np.ndarray:
        """Typical size (n,) of the states: the most that a reference of 1 V moves them, at any frequency."""
        theta = self.lpv.theta(self.speed, self.pressure)
        A, B = self.matrices(theta)[:2]
        omega = np.logspace(0, 4, 400)[:, None, None]
        s = 1j * omega if self.continuous else np.exp(1j * omega * self.sample)
        found = np.abs(np.linalg.solve(s * np.eye(len(A)) - A, np.broadcast_to(B, (400, *B.shape)))).max(axis=(0, 2))
        return np.where(found > 0, found, 1.0)

    @cached_property
    def variables(self) -> tuple[UnitVariable, ...]:
        """The table of variables."""
        return tuple(linear_variables(self))

    @cached_property
    def hash(self) -> str:
        """Fingerprint of the model."""
        return fingerprint(repr(self.lpv.to_dict()), self.name, repr(self.variables))

    def defines(self) -> dict[str, object]:
        """Sizes of states, parameters, surfaces and terms."""
        basis = self.lpv.basis
        return {
            "CONTINUOUS": int(self.continuous),
            "N_INPUTS": 4,
            "N_OUT": 2,
            "N_W": self.order,
            "N_STATES": self.order,
            "N_THETA": len(self.lpv.coefficients),
            "N_BASIS": len(basis.exponents),
            "N_TERMS": len(self.terms),
            "MIDDLE": numbers(basis.middle),
            "HALF_RANGE": numbers(basis.half),
            "NOMINALS": numbers(self.sizes),
        }

    def arrays(self) -> dict[str, Iterable[str]]:
        """Terms of the matrices and the surfaces of their parameters."""
        return {
            "Run initial_runs[N_RUNS]": [f"{{{self.order}, 0.0}}"],
            "Term terms[N_TERMS]": (f"{{{r}, {c}, {i}, {j}, {x.hex()}}}" for r, c, i, j, x in self.terms),
            "double surfaces[N_THETA][N_BASIS]": map(numbers, self.lpv.coefficients),
            "int32_t exponents[N_BASIS][2]": (f"{{{i}, {j}}}" for i, j in self.lpv.basis.exponents),
        }


def find_terms(matrices: Matrices, q: int, products: bool) -> Iterator[tuple[int, int, int, int, float]]:
    """Terms of [A B; C D] from its values where one or two of the q parameters are 1 and the others 0."""

    def block(*ones: int) -> np.ndarray:
        theta = np.zeros(q)
        theta[list(ones)] = 1.0
        A, B, C, D = matrices(theta)
        return np.block([[A, B], [C, D]])

    zero, alone = block(), [block(i) for i in range(q)]
    found = [(-1, -1, zero)] + [(i, -1, one - zero) for i, one in enumerate(alone)]
    if products:
        found += [(i, j, block(i, j) - alone[i] - alone[j] + zero) for i, j in combinations(range(q), 2)]
    for i, j, values in found:
        for line, column in np.argwhere(values):
            yield int(line), int(column), i, j, float(values[line, column])


def linear_variables(unit: LinearUnit) -> Iterator[UnitVariable]:
    """Inputs as the plant's unit calls them, outputs, states and their derivatives."""
    (w0, p0), (w1, p1) = unit.lpv.low, unit.lpv.high
    slack = unit.lpv.slack
    yield UnitVariable("time", "time", "Simulation time.", "s")
    for k, axis in enumerate("xy"):
        yield UnitVariable(f"piezo.ref_{axis}", "input", f"Reference along {axis}.", "V", k, start=0.0)
    doc = f"Operating point; identified from {w0:.6g} to {w1:.6g} rad/s."
    text = "is outside those the model was identified at, {}; it extrapolates, and this input is in {}"
    speeds = (w0 - slack[0], w1 + slack[0])
    beyond = text.format(f"{w0:.6g} to {w1:.6g} rad/s", "rad/s")
    yield UnitVariable("shaft.speed_ref", "input", doc, "rad/s", 2, start=unit.speed, checked=speeds, beyond=beyond)
    doc = f"Operating point, gauge; identified from {p0:.6g} to {p1:.6g} Pa."
    pressures = (p0 - slack[1], p1 + slack[1])
    beyond = text.format(f"{p0:.6g} to {p1:.6g} Pa", "Pa, gauge")
    yield UnitVariable(
        "injection.pressure", "input", doc, "Pa", 3, start=unit.pressure, checked=pressures, beyond=beyond
    )
    for k, axis in enumerate("xy"):
        doc = f"Displacement at the disc along {axis}, from the operating point's."
        yield UnitVariable(f"disc.{axis}", "output", doc, "m", k)
    for k in range(unit.order):
        yield UnitVariable(f"x[{k + 1}]", "state", f"State {k + 1}.", index=k, start=0.0, typical=float(unit.sizes[k]))
    for k in range(unit.order if unit.continuous else 0):
        yield UnitVariable(f"der(x[{k + 1}])", "derivative", f"Derivative of state {k + 1}.", index=k)
