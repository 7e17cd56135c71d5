"""Code generation for effect ports: one function per port, one static call per effect.

In a call, {kernel}, {foundation}, {warmed}, {braking} and {p} are the effect's kernels and parameter record, {shape}
the offset of its (2, n) rows, {slot} of its place among the motion forces, {state} of its own states, {old} and {new}
of its states in actuator k, {dof} of its modal coordinates, {journal} the number of its film. A function with an
argument `f`, the number of a film, skips the effects of other films.
"""

from __future__ import annotations

from dataclasses import dataclass

from rotorsim.effects import Effect


@dataclass(frozen=True)
class Function:
    """A function of the composed module: signature, first lines, lines per effect of `port`, last line."""

    port: str
    signature: str
    call: tuple[str, ...]
    begin: tuple[str, ...] = ()
    end: str = ""
    steady: bool | None = None
    """Takes only effects that are steady, or only those that are not."""
    kernel: str = "kernel"
    """Which of an effect's kernels it calls; it takes only effects that have one."""

    def takes(self, effect: Effect) -> bool:
        """Whether the function calls an effect."""
        suits = effect.port == self.port and self.steady in (None, effect.steady)
        return suits and getattr(type(effect), self.kernel) is not None

    def write(self, calls: list[dict[str, object]]) -> str:
        """Source of the function for the effects whose names and offsets are in `calls`."""
        lines = [*self.begin, *(line for names in calls for line in self._of(names))]
        lines += [self.end] if self.end else []
        return "\n".join(["@inlined", f"def {self.signature}:", *(f"    {line}" for line in lines or ["pass"])])

    def _of(self, names: dict[str, object]) -> list[str]:
        """Lines for one effect."""
        lines = [line.format(**names) for line in self.call]
        if "(f, " not in self.signature or names["film"] is None:
            return lines
        return [f"if f == {names['film']}:", *(f"    {line}" for line in lines)]


FUNCTIONS = (
    Function(
        "force",
        "add_forces(w, P, t, angle, speed, acceleration)",
        ("fx, fy = {kernel}(t, angle, speed, acceleration, {p})", "add_force(w, ROTOR, {shape}, fx, fy, ROTOR.f)"),
    ),
    Function(
        "force",
        "steady_forces(w, P, speed)",
        ("fx, fy = {kernel}(0.0, 0.0, speed, 0.0, {p})", "add_force(w, ROTOR, {shape}, fx, fy, ROTOR.f)"),
        steady=True,
    ),
    Function(
        "force",
        "first_forces(w, P, speed)",
        ("fx, fy = {kernel}(0.0, 0.0, speed, 0.0, {p})", "add_force(w, ROTOR, {shape}, fx, fy, ROTOR.a_old)"),
        steady=False,
    ),
    Function(
        "contact",
        "contact_forces(f, clearance, reach, nx, ny, curvature, vx, vy, surface_speed, P)",
        (
            "a, b, c, d, e, g = {kernel}(clearance, reach, nx, ny, curvature, vx, vy, surface_speed, {p})",
            "fx, fy, kxx, kxy, kyx, kyy = fx + a, fy + b, kxx + c, kxy + d, kyx + e, kyy + g",
        ),
        ("fx, fy, kxx, kxy, kyx, kyy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0",),
        "return fx, fy, kxx, kxy, kyx, kyy",
    ),
    Function("motion", "form_motion(w, adt)", ("form_compliance(w, ROTOR, {shape}, {slot}, adt)",)),
    Function("motion", "guess_motion(w, tau)", ("guess(w, ROTOR, {shape}, {slot}, tau)",)),
    Function(
        "motion",
        "add_motion(w, P, t, angle, speed, adt)",
        (
            "x, y = w[{slot}], w[{slot} + 1]",
            "vx, vy = velocity(w, {slot}, x, y, adt)",
            "w[{slot} + 4], w[{slot} + 5] = {kernel}(t, angle, speed, x, y, vx, vy, {p})",
            "add_force(w, ROTOR, {shape}, w[{slot} + 4], w[{slot} + 5], ROTOR.f)",
        ),
    ),
    Function(
        "motion",
        "missed_motion(w, P, t, angle, speed, adt)",
        (
            "x, y = project(w, ROTOR, {shape}, ROTOR.q)",
            "vx, vy = velocity(w, {slot}, x, y, adt)",
            "fx, fy = {kernel}(t, angle, speed, x, y, vx, vy, {p})",
            "worst = max(worst, miss(w, {slot}, fx, fy))",
        ),
        ("worst = 0.0",),
        "return worst",
    ),
    Function(
        "motion",
        "motion_torque(w, P, t, angle, speed, adt)",
        (
            "x, y = project(w, ROTOR, {shape}, ROTOR.q)",
            "vx, vy = velocity(w, {slot}, x, y, adt)",
            "torque += {braking}(t, angle, speed, x, y, vx, vy, {p})",
        ),
        ("torque = 0.0",),
        "return torque",
        kernel="braking",
    ),
    Function(
        "motion",
        "correct_motion(w, P, t, angle, speed, adt)",
        (
            "x, y = w[{slot}], w[{slot} + 1]",
            "vx, vy = velocity(w, {slot}, x + NUDGE, y, adt)",
            "ax, ay = {kernel}(t, angle, speed, x + NUDGE, y, vx, vy, {p})",
            "vx, vy = velocity(w, {slot}, x, y + NUDGE, adt)",
            "bx, by = {kernel}(t, angle, speed, x, y + NUDGE, vx, vy, {p})",
            "x, y = project(w, ROTOR, {shape}, ROTOR.q)",
            "correct_guess(w, {slot}, x, y, ax, ay, bx, by)",
        ),
    ),
    Function(
        "motion",
        "motion_tangent(w, P, speed)",
        (
            "x, y = project(w, ROTOR, {shape}, ROTOR.q)",
            "fx, fy = {kernel}(0.0, 0.0, speed, x, y, 0.0, 0.0, {p})",
            "ax, ay = {kernel}(0.0, 0.0, speed, x + NUDGE, y, 0.0, 0.0, {p})",
            "bx, by = {kernel}(0.0, 0.0, speed, x - NUDGE, y, 0.0, 0.0, {p})",
            "cx, cy = {kernel}(0.0, 0.0, speed, x, y + NUDGE, 0.0, 0.0, {p})",
            "dx, dy = {kernel}(0.0, 0.0, speed, x, y - NUDGE, 0.0, 0.0, {p})",
            "add_tangent(w, ROTOR, {shape}, x, y, fx, fy, ax - bx, ay - by, cx - dx, cy - dy)",
        ),
        steady=True,
    ),
    Function(
        "film",
        "film_shape(f, t, angle, speed, theta, P)",
        ("a, b = {kernel}(t, angle, speed, theta, {p})", "height, slope = height + a, slope + b"),
        ("height, slope = 0.0, 0.0",),
        "return height, slope",
    ),
    Function(
        "gas",
        "gas_state(f, t, speed, path, P)",
        ("a, b = {kernel}(t, speed, {p})", "factor, path = factor * a, path + b"),
        ("factor = 1.0",),
        "return factor, path",
    ),
    Function("heat", "warm(f, w, P, rate, power, flow)", ("{kernel}(w, RIG.heat + 3 * f, rate, power, flow, {p})",)),
    Function(
        "heat",
        "warmed_film(f, w, P)",
        ("height, factor = {warmed}(w, RIG.heat + 3 * f, {p})",),
        ("height, factor = 0.0, 1.0",),
        "return height, factor",
        kernel="warmed",
    ),
    Function(
        "injector",
        "inject(f, t, k, opening, supply, P)",
        ("opening, supply = {kernel}(t, k, opening, supply, {p})",),
        end="return opening, supply",
    ),
    Function("plenum", "plenum_factor(f, k, P)", ("factor *= {kernel}(k, {p})",), ("factor = 1.0",), "return factor"),
    Function(
        "supply",
        "supply_line(w, P, h, supply, flow)",
        ("start, end = {kernel}(w, {state}, h, supply, flow, {p})",),
        ("start, end = supply, supply",),
        "return start, end",
    ),
    Function(
        "actuator",
        "stroke(w, P, k, volt, h)",
        ("s = {kernel}(w, {old}, {new}, h, volt, s, {p})",),
        ("s = P.sensitivity * volt",),
        "return s",
    ),
    Function("sensor", "sense(w, P)", ("{kernel}(w, RIG.reading, {state}, w[RIG.seed], w[RIG.tick], {p})",)),
    Function(
        "torque",
        "shaft_torque(t, angle, speed, P)",
        ("torque += {kernel}(t, angle, speed, {p})",),
        ("torque = 0.0",),
        "return torque",
    ),
    Function(
        "force",
        "foundation(t, P)",
        (
            "a, b, c, d, e, f = {foundation}(t, {p})",
            "x, y, vx, vy, ax, ay = x + a, y + b, vx + c, vy + d, ax + e, ay + f",
        ),
        ("x, y, vx, vy, ax, ay = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0",),
        "return x, y, vx, vy, ax, ay",
        kernel="foundation",
    ),
    Function(
        "support",
        "build_supports(w, P)",
        ("omega, zeta, gain = {kernel}({p})", "build_support(w, ROTOR, {journal}, {dof}, omega, zeta, gain)"),
    ),
    Function("rotating", "rotating_damping(P)", ("time += {kernel}({p})",), ("time = 0.0",), "return time"),
)
