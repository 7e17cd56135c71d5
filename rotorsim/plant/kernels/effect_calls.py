"""Calls of a machine's effects, a function for each use of a port, and the machine's sizes.

The kernels of this folder import FILM, ROTOR, RIG and these functions, which an editor therefore finds here. As they
stand they belong to a small machine without effects, which is how the kernels are read, checked and debugged. In the
module that `rotorsim.plant.compose` writes for a machine they are replaced: a size by its number, and a function by the
same with the lines of its decorator, once for every effect of the port, before it returns.

In these lines {kernel}, {keep}, {onset}, {between}, {foundation}, {warmed}, {braking}, {reading_noise} and {p} are the
effect's kernels and parameter record, {shape} the offset of its (2, n) rows, {slot} of its place among the motion
forces, {state} of its own states, {old} and {new} of its states in actuator k, {dof} of its modal coordinates,
{journal} the number of its film. A function whose first argument is `f`, the number of a film, skips those of other
films.

The module has such a function in one of two forms: with a loop over the rows of the parameter record, each of which has
the address of an effect's kernel (`write_loop`), or with the lines of every effect, whose kernels are merged
(`write_lines`), where code leaves this process.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from reynolds.addressed_calls import SHAPE
from reynolds.grid import FilmGrid, make_layout
from reynolds.jit import inlined
from rotorsim.effects import PORTS, Effect
from rotorsim.plant.kernels.layout import make_rig_layout, make_rotor_layout

FILM = make_layout(FilmGrid(0.02, 0.04, 8, 4), [], [])
ROTOR = make_rotor_layout(4, FILM, 1)
RIG = make_rig_layout(ROTOR.size, 1, 0, 0, 0, 1, dict.fromkeys(PORTS, 0), 0, 0)


KERNELS = ("kernel", "keep", "onset", "between", "foundation", "warmed", "braking", "reading_noise")
"""Kernels that an effect can have."""
NUMBERS = ("shape", "slot", "state", "own", "dof", "journal", "film")
"""Numbers by which calls of effects differ, in the order of the columns of their rows."""
OF_MEMORY = 5
"""First arguments of a force of the port `motion` that only a kernel with states takes."""


@dataclass(frozen=True)
class PortFunction:
    """A function of this file and the lines that each effect of a port adds to it."""

    function: Callable[..., Any]
    port: str
    lines: tuple[str, ...]
    steady: bool | None = None
    """Takes only effects that are steady, or only those that are not."""
    kernel: str = "kernel"
    """Kernel of an effect that it calls; it takes only effects that have one."""

    def takes(self, effect: Effect) -> bool:
        """Whether the function calls an effect."""
        suits = effect.port == self.port and self.steady in (None, effect.steady)
        return suits and getattr(type(effect), self.kernel) is not None

    def skipped(self, effect: type[Effect]) -> int:
        """Number of first arguments in the lines that the effect's kernel does not take."""
        return OF_MEMORY if self.asks and self.kernel == "kernel" and self.port == "motion" and not effect.states else 0

    def write_lines(self, effects: Sequence[tuple[str, dict[str, int], int]]) -> str:
        """Source of the function with the lines of each effect: its name in the record, its numbers, what it skips."""
        return self._write([line for one in effects for line in self._lines_of(*one)])

    def write_loop(self, number: int) -> str:
        """Source of the function, the one of this number in `FUNCTIONS`, with a loop over its rows of the record."""
        entries = {name: f"entry(P, call, {column})" for column, name in enumerate(NUMBERS, SHAPE)}
        lines = [self._asking(line) for line in self._filled("asked", entries)]
        if self._of_a_film:
            other = f"{entries['film']} == 0 or {entries['film']} == f + 1"
            lines = [f"if {other}:", *(f"    {line}" for line in lines)]
        head = f"for call in range(P.first[{number}], P.first[{number + 1}]):"
        return self._write([head, *(f"    {line}" for line in "\n".join(lines).splitlines())])

    def write_alone(self, effect: type[Effect]) -> str:
        """Source of a module with `effect`, the kernel of one effect as the loop calls it."""
        kernel = getattr(effect, self.kernel)
        call, results = self.call
        given = [*(f"a{k}" for k in range(len(call.args) - 1)), "p"]
        answers = [f"x{k}" for k in range(results)]
        lines = [
            "from reynolds.jit import addressed, merged",
            f"from {kernel.__module__} import {kernel.__name__} as kernel",
            "kernel = merged(kernel)",
            "@addressed",
            f"def effect({', '.join(given)}):",
            f"    {', '.join(answers)}{' = ' if answers else ''}kernel({', '.join(given[self.skipped(effect) :])})",
            *([f"    return {', '.join(f'float({x})' for x in answers)}"] if answers else []),
        ]
        return "\n".join(lines) + "\n"

    @cached_property
    def kinds(self) -> str:
        """Kinds of what the kernel takes before its record, by `kind_of`."""
        return "".join(map(kind_of, self.call[0].args[:-1]))

    @cached_property
    def call(self) -> tuple[ast.Call, int]:
        """The first call of the kernel in the lines, and how many numbers it gives."""
        for line in self._filled("asked", dict.fromkeys(NUMBERS, "RIG.place")):
            statement = ast.parse(line).body[0]
            for node in ast.walk(statement):
                if isinstance(node, ast.Call) and ast.unparse(node.func) == f"asked_{self.kernel}":
                    return node, results_of(statement)
        raise LookupError(f"{self.function.__name__}: calls no kernel")

    @property
    def asks(self) -> bool:
        """Whether the lines call a kernel."""
        return any(f"{{{self.kernel}}}(" in line for line in self.lines)

    def _filled(self, record: str, numbers: Mapping[str, object]) -> list[str]:
        """The lines with an effect's name in the record and its numbers."""
        names = {kind: f"{record}_{kind}" for kind in KERNELS} | {"p": f"P.{record}"} | dict(numbers)
        own = f"k * RIG.n_stroke_states + {numbers['own']}"
        return [line.format(**names, old=f"RIG.old + {own}", new=f"RIG.new + {own}") for line in self.lines]

    def _lines_of(self, record: str, numbers: dict[str, int], skipped: int) -> list[str]:
        """Lines for one effect."""
        lines = self._filled(record, numbers)
        lines = [_without(line, f"{record}_{self.kernel}", skipped) for line in lines] if skipped else lines
        if not self._of_a_film or numbers["film"] == 0:
            return lines
        return [f"if f + 1 == {numbers['film']}:", *(f"    {line}" for line in lines)]

    def _asking(self, line: str) -> str:
        """A line with calls of addresses."""
        [statement] = ast.parse(line).body
        sample = [SAMPLES[kind] for kind in self.kinds] if self.asks else []
        return ast.unparse(Answers(f"asked_{self.kernel}", results_of(statement), sample).visit(statement))

    @property
    def _of_a_film(self) -> bool:
        return next(iter(inspect.signature(self.function).parameters)) == "f"

    def _write(self, lines: Sequence[str]) -> str:
        """Source of the function with lines before it returns."""
        tree = ast.parse(textwrap.dedent(inspect.getsource(self.function)))
        [definition] = tree.body
        assert isinstance(definition, ast.FunctionDef)
        definition.decorator_list = [ast.Name("inlined")]
        returns = definition.body[-1:] if isinstance(definition.body[-1], ast.Return) else []
        kept = definition.body[: len(definition.body) - len(returns)]
        definition.body = [*kept, *ast.parse("\n".join(lines)).body, *returns]
        return ast.unparse(ast.fix_missing_locations(tree))


SAMPLES = {"w": "w", "i": "0", "d": "0.0"}
"""An argument of each kind of `kind_of`, by which the compiler compares the call with the function."""


def _without(line: str, kernel: str, skipped: int) -> str:
    """A line with calls of a kernel that does not take the first arguments."""
    tree = ast.parse(line)
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == kernel:
            del node.args[:skipped]
    return ast.unparse(tree)


def results_of(statement: ast.stmt) -> int:
    """Numbers that a statement takes of an effect's kernel which it calls."""
    if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Tuple):
        return len(statement.targets[0].elts)
    return 0 if isinstance(statement, ast.Expr) else 1


def kind_of(argument: ast.expr) -> str:
    """Kind of an argument of an effect's kernel: w, the workspace, i, an integer, or d, a number.

    The compiler refuses a call whose argument is of another.
    """
    if isinstance(argument, ast.Name):
        return {"w": "w", "k": "i"}.get(argument.id, "d")
    if isinstance(argument, ast.BinOp):
        return max(kind_of(argument.left), kind_of(argument.right))
    return "i" if isinstance(argument, ast.Attribute) and ast.unparse(argument).startswith("RIG.") else "d"


class Answers(ast.NodeTransformer):
    """Replaces calls of an effect's kernel by calls of the address in its row."""

    def __init__(self, kernel: str, results: int, sample: Sequence[str]) -> None:
        self.kernel, self.results = kernel, results
        self.sample = ast.Tuple([ast.parse(one, mode="eval").body for one in sample])

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """A call of the kernel by its address."""
        self.generic_visit(node)
        if not (isinstance(node.func, ast.Name) and node.func.id == self.kernel):
            return node
        given = [ast.Name("P"), ast.Name("call"), self.sample, ast.Tuple(node.args[:-1])]
        return ast.Call(ast.Name(f"answer_{self.results}"), given, [])


FUNCTIONS: list[PortFunction] = []
"""Functions that call effects, in the order of this file."""


def port(name: str, *lines: str, steady: bool | None = None, kernel: str = "kernel") -> Callable[..., Any]:
    """Declare the lines that a function has for each effect of a port; see `PortFunction`."""

    def declare(function: Callable[..., Any]) -> Callable[..., Any]:
        FUNCTIONS.append(PortFunction(function, name, lines, steady, kernel))
        return inlined(function)

    return declare


@inlined
def film_constants(P, f):
    """Record of the constants of film f."""
    return P.film_0


def write_film_constants(n_films: int) -> str:
    """Source of `film_constants` for a number of films."""
    lines = [line for f in range(1, n_films) for line in (f"    if f == {f}:", f"        return P.film_{f}")]
    return "\n".join(["@inlined", "def film_constants(P, f):", *lines, "    return P.film_0"])


@port(
    "force",
    "fx, fy = {kernel}(t, angle, speed, acceleration, {p})",
    "add_force(w, ROTOR, {shape}, fx, fy, ROTOR.f)",
)
def add_forces(w, P, t, angle, speed, acceleration):
    """Add the modal forces of all force effects at a time."""


@port(
    "force",
    "fx, fy = {onset}(w[ROTOR.time], w[ROTOR.angle], w[ROTOR.speed], w[ROTOR.acceleration], {p})",
    "add_force(w, ROTOR, {shape}, fx, fy, ROTOR.a_old)",
    kernel="onset",
)
def begin_forces(w, P):
    """Add the modal forces that begin at the start of a sample to the acceleration there."""


@port("random_force", "{kernel}(w, {state}, w[RIG.seed], w[RIG.tick], speed, {p})")
def draw_forces(w, P, speed):
    """Move all random forces on by a sample."""


@port(
    "random_force",
    "fx, fy = {between}(w, {state}, share, {p})",
    "add_force(w, ROTOR, {shape}, fx, fy, ROTOR.f)",
    kernel="between",
)
def add_random_forces(w, P, share):
    """Add the modal forces of all random forces after a share of the sample."""


@port(
    "force",
    "fx, fy = {kernel}(0.0, 0.0, speed, 0.0, {p})",
    "add_force(w, ROTOR, {shape}, fx, fy, ROTOR.f)",
    steady=True,
)
def steady_forces(w, P, speed):
    """Add the modal forces of force effects that are steady."""


@port(
    "force",
    "fx, fy = {kernel}(0.0, 0.0, speed, 0.0, {p})",
    "add_force(w, ROTOR, {shape}, fx, fy, ROTOR.a_old)",
    steady=False,
)
def first_forces(w, P, speed):
    """Add the modal forces of force effects that are not steady, at angle 0, to the acceleration at the start."""


@port(
    "contact",
    "a, b, c, d, e, g = {kernel}(clearance, reach, nx, ny, curvature, vx, vy, surface_speed, {p})",
    "fx, fy, kxx, kxy, kyx, kyy = fx + a, fy + b, kxx + c, kxy + d, kyx + e, kyy + g",
)
def contact_forces(f, clearance, reach, nx, ny, curvature, vx, vy, surface_speed, P):
    """Sum of all contact effects of film f at a place: force on the journal and its negative derivative."""
    fx, fy, kxx, kxy, kyx, kyy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return fx, fy, kxx, kxy, kyx, kyy


MOVED = (
    "w, {state}, t - w[ROTOR.time], x - w[{slot} + 10], y - w[{slot} + 11], t, angle, speed, x, y, vx, vy, {p}"
)  # fmt: skip
"""Arguments of a force that depends on the motion; the first, `OF_MEMORY` of them, have the step's start."""
RESTING = "w, {state}, 0.0, 0.0, 0.0, 0.0, 0.0, speed"
"""First arguments of such a force at rest."""


@port("motion", "form_compliance(w, ROTOR, {shape}, {slot}, adt)")
def form_motion(w, P, adt):
    """Form the compliance of the shaft where forces depend on its motion."""


@port("motion", "guess(w, ROTOR, {shape}, {slot}, tau)")
def guess_motion(w, P, tau):
    """Guess the motion after tau [s] where forces depend on it."""


@port(
    "motion",
    "x, y = w[{slot}], w[{slot} + 1]",
    "vx, vy = velocity(w, {slot}, x, y, adt)",
    f"w[{{slot}} + 4], w[{{slot}} + 5] = {{kernel}}({MOVED})",
    "add_force(w, ROTOR, {shape}, w[{slot} + 4], w[{slot} + 5], ROTOR.f)",
)
def add_motion(w, P, t, angle, speed, adt):
    """Add the modal forces that go with the guessed motion."""


@port(
    "motion",
    "x, y = project(w, ROTOR, {shape}, ROTOR.q)",
    "vx, vy = velocity(w, {slot}, x, y, adt)",
    f"fx, fy = {{kernel}}({MOVED})",
    "worst = max(worst, miss(w, {slot}, fx, fy))",
)
def missed_motion(w, P, t, angle, speed, adt):
    """Largest displacement [m] by which the solved motion differs from the guessed one that gave the forces."""
    worst = 0.0
    return worst


@port(
    "motion",
    "x, y = project(w, ROTOR, {shape}, ROTOR.q)",
    "vx, vy = velocity(w, {slot}, x, y, adt)",
    f"{{keep}}({MOVED})",
    kernel="keep",
)
def keep_motion(w, P, t, angle, speed, adt):
    """Move the states of motion-dependent forces on to the end of a step, at the solved motion."""


@port(
    "motion",
    "x, y = project(w, ROTOR, {shape}, ROTOR.q)",
    "vx, vy = velocity(w, {slot}, x, y, adt)",
    "torque += {braking}(t, angle, speed, x, y, vx, vy, {p})",
    kernel="braking",
)
def motion_torque(w, P, t, angle, speed, adt):
    """Torque [N m] about its axis that motion-dependent forces exert on the shaft at the solved motion."""
    torque = 0.0
    return torque


@port(
    "motion",
    "x, y = w[{slot}] + NUDGE, w[{slot} + 1]",
    "vx, vy = velocity(w, {slot}, x, y, adt)",
    f"ax, ay = {{kernel}}({MOVED})",
    "x, y = w[{slot}], w[{slot} + 1] + NUDGE",
    "vx, vy = velocity(w, {slot}, x, y, adt)",
    f"bx, by = {{kernel}}({MOVED})",
    "x, y = project(w, ROTOR, {shape}, ROTOR.q)",
    "correct_guess(w, {slot}, x, y, ax, ay, bx, by)",
)
def correct_motion(w, P, t, angle, speed, adt):
    """Correct the guesses by the solved motion."""


@port(
    "motion",
    "x, y = project(w, ROTOR, {shape}, ROTOR.q)",
    f"fx, fy = {{kernel}}({RESTING}, x, y, 0.0, 0.0, {{p}})",
    f"ax, ay = {{kernel}}({RESTING}, x + NUDGE, y, 0.0, 0.0, {{p}})",
    f"bx, by = {{kernel}}({RESTING}, x - NUDGE, y, 0.0, 0.0, {{p}})",
    f"cx, cy = {{kernel}}({RESTING}, x, y + NUDGE, 0.0, 0.0, {{p}})",
    f"dx, dy = {{kernel}}({RESTING}, x, y - NUDGE, 0.0, 0.0, {{p}})",
    "add_tangent(w, ROTOR, {shape}, x, y, fx, fy, ax - bx, ay - by, cx - dx, cy - dy)",
    steady=True,
)
def motion_tangent(w, P, speed):
    """Add steady motion-dependent forces at rest and their tangent."""


@port("film", "a, b = {kernel}(t, angle, speed, theta, {p})", "height, slope = height + a, slope + b")
def film_shape(f, t, angle, speed, theta, P):
    """Increase of the gap of film f at theta [rad] in its middle [m], and per length along the shaft [1]."""
    height, slope = 0.0, 0.0
    return height, slope


@port("gas", "a, b = {kernel}(t, speed, {p})", "factor, path = factor * a, path + b")
def gas_state(f, t, speed, path, P):
    """Factor on the viscosity of film f, and its mean free path [m] at ambient pressure, `path` without effects."""
    factor = 1.0
    return factor, path


@port("heat", "{kernel}(w, RIG.heat + 3 * f, rate, power, flow, {p})")
def warm(f, w, P, rate, power, flow):
    """Advance the temperatures of film f by a sample."""


@port("heat", "height, factor = {warmed}(w, RIG.heat + 3 * f, {p})", kernel="warmed")
def warmed_film(f, w, P):
    """Increase of the gap of film f [m] by its temperatures, and the factor on its viscosity."""
    height, factor = 0.0, 1.0
    return height, factor


@port("injector", "opening, supply = {kernel}(t, k, opening, supply, {p})")
def inject(f, t, k, opening, supply, P):
    """Opening and supply pressure of injector k of film f."""
    return opening, supply


@port("plenum", "factor *= {kernel}(k, {p})")
def plenum_factor(f, k, P):
    """Factor on the volume of plenum k of film f."""
    factor = 1.0
    return factor


@port("supply", "start, end = {kernel}(w, {state}, h, supply, flow, {p})")
def supply_line(w, P, h, supply, flow):
    """Pressure behind the supply line at start and end of a sample."""
    start, end = supply, supply
    return start, end


@port("reference", "x, y = {kernel}(w, {state}, P.pinned[k], w[RIG.tick], x, y, {p})")
def references_of(w, P, k, x, y):
    """References [V] along x and y that pin k gets."""
    return x, y


@port("amplifier", "factor *= {kernel}(P.pinned[k], {p})")
def amplifier_factor(P, k):
    """Factor on the time constant of the amplifier of pin k."""
    factor = 1.0
    return factor


@port("actuator", "s = {kernel}(w, {old}, {new}, h, volt, s, {p})")
def stroke(w, P, k, volt, h):
    """Stroke [m] of stack k at `volt`, after a substep h."""
    s = P.sensitivity * volt
    return s


@port("sensor", "{kernel}(w, RIG.reading, {state}, w[RIG.seed], w[RIG.tick], {p})")
def sense(w, P):
    """Turn the true values in w[reading] into readings."""


@port("pin_sensor", "seen = {kernel}(P.pinned[k], h, before, start, end, seen, {p})")
def see_pin(w, P, k, h, before, start, end):
    """Signal [m] of the sensor of pin k after h [s] in which the pin went straight from `start` to `end` [m]."""
    seen = end
    return seen


@port("pin_sensor", "noise += {reading_noise}(P.pinned[k], w[RIG.seed], w[RIG.tick], {p})", kernel="reading_noise")
def pin_reading_noise(w, P, k):
    """Noise [m] of the reading of pin k."""
    noise = 0.0
    return noise


@port("drive", "speed = {kernel}(w, {state}, w[RIG.seed], w[RIG.tick], speed, {p})")
def driven_speed(w, P, speed):
    """Speed [rad/s] that the drive reaches at the end of the sample where `speed` is set."""
    return speed


@port("torque", "torque += {kernel}(t, angle, speed, {p})")
def shaft_torque(t, angle, speed, P):
    """Torque [N m] on the shaft besides the drive's."""
    torque = 0.0
    return torque


@port(
    "force",
    "a, b, c, d, e, f = {foundation}(t, {p})",
    "x, y, vx, vy, ax, ay = x + a, y + b, vx + c, vy + d, ax + e, ay + f",
    kernel="foundation",
)
def foundation(t, P):
    """Displacement [m], velocity [m/s] and acceleration [m/s^2] of the foundation along x and y."""
    x, y, vx, vy, ax, ay = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return x, y, vx, vy, ax, ay


@port("support", "omega, zeta, gain = {kernel}({p})", "build_support(w, ROTOR, {journal}, {dof}, omega, zeta, gain)")
def build_supports(w, P):
    """Write the resonances under the sleeves of films into the modal matrices."""


@port("rotating", "time += {kernel}({p})")
def rotating_damping(P):
    """Damping time [s] of the turning shaft."""
    time = 0.0
    return time
