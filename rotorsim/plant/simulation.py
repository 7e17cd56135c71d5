r"""Equilibrium and simulation of an assembled plant: calls of the kernels, exceptions for their status codes.

A simulation takes inputs and gives samples; its state is saved and restored bit for bit.

The room of a journal is how far its centre can move in each direction until the gap closes.

.. math:: r(\phi) = \min_\theta \frac{s(\theta)}{\cos(\theta - \phi)}, \qquad \cos(\theta - \phi) > 0

s is the distance of the sleeve from its centre as `reynolds.film.closest_places` has it, the smallest in a turn of the
shaft. A foil is taken as it is without pressure. The film's thickness is as in Hamrock (2004).

Cites: hamrock_2004.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from reynolds import kernels
from reynolds.grid import CONVERGENCE, fill
from reynolds.newton import FACTORISATIONS, ITERATIONS, OVERRUNS
from reynolds.workspace import at_cache_line, interval_pressure
from rotorsim.base.display import Card, Shown, several
from rotorsim.base.errors import ConvergenceError, DataError, MachineFileError, NoLiftOffError
from rotorsim.base.units import MPA, TO_RPM, TO_UM
from rotorsim.effects import Effect, numeric_fields
from rotorsim.machine.schema import Machine
from rotorsim.plant.assemble import Assembly, make_films, put_rows
from rotorsim.plant.kernels.equilibrium_kernel import BEYOND_STROKE, NO_LIFT_OFF, RESTLESS, SETTLED
from rotorsim.plant.kernels.layout import AT, COLUMNS, FILM_COLUMNS, FORCE, HEAT_COLUMNS, REFERENCE, SUPPLY

SLOW, NEAR = 1e-6, 1e-9
"""Velocity [m/s] and displacement [m] of difference quotients."""


@dataclass(frozen=True, repr=False)
class Equilibrium(Shown):
    """Equilibrium of a machine: disc (2,) [m], h_min [m] of all films, flows (injectors,) [kg/s] of all films.

    journal (2,) [m], film force (2,) [N] and eccentricity ratio are those of the first film; `journals` (films, 2),
    `forces` (films, 2) and `eccentricity_ratios` (films,) those of all; `temperature_rises` (films, 3) [K] those of
    gas, journal and sleeve, 0 without the effect `heat_balance`.
    """

    disc: np.ndarray
    journal: np.ndarray
    eccentricity_ratio: float
    force: np.ndarray
    mass_flow: np.ndarray
    h_min: float
    journals: np.ndarray
    forces: np.ndarray
    eccentricity_ratios: np.ndarray
    temperature_rises: np.ndarray

    def card(self) -> Card:
        """Disc, and of films the least thickness, eccentricity ratios, forces and flow."""
        rows = []
        if len(self.journals):
            rows = [
                ("least film", f"{self.h_min * TO_UM:.4g} um"),
                ("eccentricity ratio", several(self.eccentricity_ratios, ".3g")),
                ("film force", f"{several(np.hypot(*self.forces.T))} N"),
            ]
        if self.temperature_rises.any():
            rows.append(("gas warmer by", f"{several(self.temperature_rises[:, 0], '.3g')} K"))
        if len(self.mass_flow):
            rows.append(("flow", f"{1e6 * self.mass_flow.sum():.4g} mg/s"))
        return Card(f"Equilibrium: disc at {self.disc[0] * TO_UM:.2f}, {self.disc[1] * TO_UM:.2f} um", rows)


def matrix(a: Assembly, offset: int, w: np.ndarray) -> np.ndarray:
    """A modal matrix (n, n) out of a workspace."""
    n = a.rotor.n
    return np.array(w[offset : offset + n * n].reshape(n, n).T)


def rows(a: Assembly, offset: int, w: np.ndarray) -> np.ndarray:
    """Rows (2, n) out of a workspace: displacement = rows @ q, modal force = force @ rows."""
    return np.array(w[offset : offset + 2 * a.rotor.n].reshape(2, a.rotor.n))


def stiffness(a: Assembly, w: np.ndarray, speed: float) -> np.ndarray:
    """Modal stiffness (n, n) at rest where w stands: with the tangent of forces that depend on the motion.

    That of a force with a memory is the one against a motion that begins: the stiffness of a spring that sticks.
    """
    w = w.copy()
    a.module.static_terms(w, a.parameters, speed, True)
    K, q = matrix(a, a.rotor.KT, w), w[a.rotor.q : a.rotor.q + a.rotor.n]
    for call in a.calls:
        if call.effect.port == "motion" and call.effect.states:
            kernel, shape, p = type(call.effect).kernel, rows(a, call.shape, w), getattr(a.P, call.record)
            force = partial(getattr(kernel, "py_func", kernel), w, a.rig.states + call.state, 0.0)
            after = [[force(*moved, 0.0, 0.0, speed, *(shape @ q + moved), 0.0, 0.0, p) for moved in (step, -step)]
                     for step in NEAR * np.eye(2)]  # fmt: skip
            K -= shape.T @ (np.subtract(*np.moveaxis(np.array(after), 1, 0)).T / (2 * NEAR)) @ shape
    return K


def damping(a: Assembly, w: np.ndarray, speed: float) -> np.ndarray:
    """Modal damping (n, n), gyroscopic terms included."""
    C = matrix(a, a.rotor.C, w) + speed * matrix(a, a.rotor.G, w) + motion_damping(a, w, speed)
    C = C + table_damping(a, w, speed) if a.rotor.n_tables else C
    return C + turning_time(a) * matrix(a, a.rotor.KS, w) if a.rotor.turning else C


def table_damping(a: Assembly, w: np.ndarray, speed: float) -> np.ndarray:
    """Modal damping (n, n) of the tables at `speed`, as `add_tables` of the kernels has it."""
    R, n = a.rotor, a.rotor.n
    shapes = w[R.table_rows : R.table_rows + 2 * n * R.n_tables].reshape(-1, 2, n)
    values = w[R.table_values : R.table_values + 8 * R.n_tables * R.n_points].reshape(R.n_tables, R.n_points, 2, 2, 2)
    speeds = w[R.table_speeds : R.table_speeds + R.n_points]
    k = min(max(int(np.searchsorted(speeds, abs(speed))), 1), R.n_points - 1)
    share = min(max((abs(speed) - speeds[k - 1]) / (speeds[k] - speeds[k - 1]), 0.0), 1.0)
    C = values[:, k - 1, 1] + share * (values[:, k, 1] - values[:, k - 1, 1])
    if speed < 0:
        C = C * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return np.asarray((shapes.transpose(0, 2, 1) @ C @ shapes).sum(axis=0))


def motion_damping(a: Assembly, w: np.ndarray, speed: float) -> np.ndarray:
    """Modal damping (n, n) of forces that depend on the velocity, at rest where w stands: steady ones and those with a
    memory, against a motion that begins.
    """
    total = np.zeros((a.rotor.n, a.rotor.n))
    q = w[a.rotor.q : a.rotor.q + a.rotor.n]
    for call in a.calls:
        if call.effect.port == "motion" and (call.effect.steady or call.effect.states):
            kernel = type(call.effect).kernel
            memory = (w, a.rig.states + call.state, 0.0, 0.0, 0.0) if call.effect.states else ()
            at = (0.0, 0.0, speed, *(rows(a, call.shape, w) @ q))
            force = partial(getattr(kernel, "py_func", kernel), *memory, *at)
            steps = ((SLOW, 0.0), (0.0, SLOW))
            p = getattr(a.P, call.record)
            slope = [np.subtract(force(*v, p), force(*np.negative(v), p)) / (2 * SLOW) for v in steps]
            shape = rows(a, call.shape, w)
            total -= shape.T @ np.stack(slope, axis=1) @ shape
    return total


def turning_time(a: Assembly) -> float:
    """Damping time [s] of the turning shaft, all effects together."""
    times = (call for call in a.calls if call.effect.port == "rotating")
    return sum(getattr(k := type(c.effect).kernel, "py_func", k)(getattr(a.P, c.record)) for c in times)


def settle(a: Assembly, speed: float, pressure: float, near: np.ndarray | None = None) -> np.ndarray:
    """Workspace with the machine at rest in equilibrium at `speed` [rad/s] and gauge pressure [Pa].

    `near`, an equilibrium of the same assembly, is where the films begin; it saves the march from ambient pressure.
    Raises NoLiftOffError where the film does not carry the rotor, MachineFileError where an actuator cannot hold its
    pin at the bias, ConvergenceError if the iteration with effects does not converge, DataError for a pressure below
    vacuum.
    """
    w = at_cache_line(a.w.size)
    point = a.ix, a.parameters, float(speed), a.machine.gas.absolute(pressure)
    if near is not None:
        # twice: the last correction of the first time is as large as the films' tolerance lets it be
        closer = at_cache_line(a.w.size)
        if all(a.module.settle(to, begun, *point, True) == SETTLED for to, begun in ((closer, near), (w, closer))):
            return w
    status = a.module.settle(w, a.w, *point, False)
    if status == BEYOND_STROKE:
        raise MachineFileError(
            f"injection.pin_bias: '{max(a.P.pin_bias) * TO_UM:.4g} um' is beyond the stroke of the actuators between "
            f"{a.P.volt_low:g} V and {a.P.volt_high:g} V; change it or actuators.sensitivity"
        )
    if status == NO_LIFT_OFF:
        loads = np.hypot(*w[a.rotor.static_rhs :][: 2 * len(a.films)].reshape(-1, 2).T)
        remedy = "raise the injection pressure" if a.film.n_inj else "start at a higher speed"
        if not a.film.n_inj and speed == 0:
            remedy += "; from rest it starts on its sleeve, which needs [effects.contact] with a stiffness"
        fed = f"{pressure / MPA:.3g} MPa gauge and " if a.machine.fed else ""
        raise NoLiftOffError(
            f"no lift-off: at {fed}{speed * TO_RPM:.0f} rpm the film does not carry "
            f"the {sum(loads):.1f} N on it; {_remedy(a.machine, loads) or remedy}"
        )
    if status == RESTLESS:
        names = coupled_effects(a)
        raise ConvergenceError(
            f"equilibrium: the iteration did not converge at {pressure / MPA:.3g} MPa gauge and "
            f"{speed * TO_RPM:.0f} rpm with {', '.join(f'[effects.{name}]' for name in names)}; "
            f"make {'it' if len(names) == 1 else 'one of them'} weaker or leave it out",
            effects=names,
        )
    return w


def rest_on_sleeves(a: Assembly, speed: float, pressure: float) -> np.ndarray | None:
    """Workspace with a shaft at standstill on its sleeves; None where it turns, is fed or its sleeves carry nothing.

    A film without speed and supply has ambient pressure everywhere, so contact carries what bearings do not.
    """
    carrying = any(getattr(e, "stiffness", 0.0) > 0 for e in a.machine.effects.get("contact", ()))
    if speed != 0 or (pressure != 0 and a.machine.fed) or not a.films or not carrying:
        return None
    w = at_cache_line(a.w.size)
    rested = a.module.stand(w, a.w, a.parameters, a.machine.gas.absolute(0.0))
    return w if rested else None


def coupled_effects(a: Assembly) -> tuple[str, ...]:
    """Names of the effects that an equilibrium is repeated for: of supply, heat, and steady forces of the motion.

    Those at their neutral values, which do nothing, are not among them.
    """
    effects = [call.effect for call in a.calls]
    coupled = [e for e in effects if e.port in ("supply", "heat") or (e.port == "motion" and e.steady)]
    return tuple(dict.fromkeys(effect.name for effect in coupled if effect != type(effect)()))


def describe(a: Assembly, w: np.ndarray) -> Equilibrium:
    """Read an equilibrium out of a workspace that `settle` returned."""
    L, R = a.film, a.rotor
    disc = rows(a, R.disc, w) @ w[R.q : R.q + R.n]
    if not a.films:
        nothing, none = np.full(2, np.nan), np.zeros((0, 2))
        return Equilibrium(
            disc, nothing, np.nan, nothing, np.zeros(0), np.nan, none, none, np.zeros(0), np.zeros((0, 3))
        )
    parts = [a.film_part(w, k) for k in range(len(a.films))]
    journals = np.array([v[L.journal : L.journal + 2] for v in parts])
    forces = np.array([v[L.force : L.force + 2] for v in parts])
    flows = [v[L.film_flow : L.film_flow + len(f.injectors)] for v, f in zip(parts, a.films, strict=True)]
    ratios = np.hypot(*journals.T) / [f.clearance for f in a.films]
    gap = float(a.module.narrowest(w, a.parameters))
    first = journals[0], float(ratios[0]), forces[0]
    rises = w[a.rig.heat : a.rig.heat + 3 * len(a.films)].reshape(-1, 3).copy()
    return Equilibrium(disc, *first, np.concatenate(flows), gap, journals, forces, ratios, rises)


def _remedy(machine: Machine, loads: np.ndarray) -> str:
    """Remedy for the form of a sleeve that its load [N] alone closes; empty if none is."""
    for film, load in zip(machine.films, loads, strict=True):
        for form in film.sleeve.forms.values():
            if remedy := form.remedy(float(load), film.clearance, film.diameter * film.length):
                return remedy
    return ""


FINITE = ("supply pressure", "reference x", "reference y", "disc force x", "disc force y")
"""Inputs after the first, the speed, where NaN means that the drive is off."""


@dataclass(repr=False)
class Simulation(Shown):
    """State of a machine in time: `w`, and whether it coasts. `save` copies both, `restore` takes them back."""

    assembly: Assembly
    w: np.ndarray
    on_orbit: bool = False
    """Whether it began on the synchronous orbit."""
    torques: bool = False
    """Whether samples have the torque of friction behind their other columns."""
    coasts: bool = False
    """Whether the drive was off in the last sample."""

    @classmethod
    def at_equilibrium(cls, assembly: Assembly, speed: float, pressure: float, seed: int = 0) -> Simulation:
        """Start at the static equilibrium for a speed [rad/s] and gauge pressure [Pa]; `seed` makes the noise."""
        w = rest_on_sleeves(assembly, speed, pressure)
        w = settle(assembly, speed, pressure) if w is None else w
        w[assembly.rig.seed] = seed
        return cls(assembly, w)

    def card(self) -> Card:
        """Machine, time and speed."""
        rows = [
            ("speed", f"{self.w[self.assembly.rotor.speed] * TO_RPM:.4g} rpm"),
            ("samples", f"{self.samples}"),
            ("seed", f"{self.w[self.assembly.rig.seed]:.0f}"),
        ]
        return Card(f"Simulation of {self.assembly.machine.name} at t = {self.time:.4f} s", rows)

    @property
    def samples(self) -> int:
        """Samples done since the start."""
        return int(self.w[self.assembly.rig.tick])

    @property
    def time(self) -> float:
        """Time [s] since the start."""
        return self.samples * self.assembly.sampling_time

    @property
    def columns(self) -> int:
        """Columns of the sample table."""
        return self.assembly.columns + int(self.torques)

    def strike_at(self, position: float) -> None:
        """Let the external force act at a position [m] along the shaft in place of the disc.

        Raises DataError for a position beyond the shaft.
        """
        mesh, rotor = self.assembly.mesh, self.assembly.rotor
        first, last = mesh.nodes[0], mesh.nodes[-1]
        if not first <= position <= last:
            raise DataError(
                f"position = {1e3 * position:.6g} mm: is not on the shaft; give {1e3 * first:.6g} to "
                f"{1e3 * last:.6g} mm",
                argument="position",
            )
        put_rows(self.w, rotor.struck, mesh.shape_between(position), rotor.n)

    def shake_base(self) -> None:
        """Take the external force as an acceleration [m/s^2] of the base: on all masses, against it."""
        put_rows(self.w, self.assembly.rotor.struck, -self.assembly.mesh.shaken_mass, self.assembly.rotor.n)

    def advance(self, inputs: np.ndarray) -> np.ndarray:
        """Advance by one sample per row of inputs; returns the state BEFORE each as (n, columns).

        inputs (n, 6): speed at the sample's end [rad/s] (NaN: the drive is off), supply pressure [Pa, gauge], reference
        x, y [V], disc force x, y [N]. Raises DataError for inputs that are not finite, and ConvergenceError with
        the time, and with the samples done in its `where["table"]`, if a step cannot be solved at any size.
        """
        a = self.assembly
        rows = np.array(inputs, float)
        _check_inputs(a, rows)
        if not a.machine.fed:
            rows[:, SUPPLY] = 0.0  # no injector feels a supply: the record has the ambient's
        rows[:, SUPPLY] += a.machine.gas.ambient_pressure
        out = np.zeros((len(rows), self.columns))
        done = a.module.run(self.w, a.ix, a.parameters, rows, out, a.steps_per_sample)
        if done > 0:
            self.coasts = bool(np.isnan(rows[done - 1, 0]))
        if done < len(rows):
            speed = self.w[a.rotor.speed] * TO_RPM
            raise ConvergenceError(
                f"plant: no solution of the step at t = {self.time:.4f} s, {speed:.0f} rpm; "
                "take a smaller solver.time_step or a finer grid",
                table=out[:done],
            )
        return out

    def save(self) -> np.ndarray:
        """Everything about the state: `w`, and behind it 1 where the drive is off."""
        return np.append(self.w, self.coasts)

    def restore(self, saved: np.ndarray) -> None:
        """Take back a saved state, or a `w` of a shaft that is driven."""
        self.w[:] = saved[: self.w.size]
        self.coasts = bool(saved[self.w.size :].any())

    def film_pressure(self, number: int = 0) -> np.ndarray:
        """Pressure (n_theta, n_z) [Pa, absolute] of a film now."""
        a = self.assembly
        return interval_pressure(a.films[number], a.film, a.film_part(self.w, number))

    def film_snapshot(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Angles (n_theta) [rad], places (n_z) [m] and pressures (n_theta, n_z) [Pa, absolute] of the film now.

        Of several films places (films, n_z) and pressures (films, n_theta, n_z).
        """
        films = self.assembly.films
        places = np.array([film.grid.z for film in films])
        pressures = np.array([self.film_pressure(k) for k in range(len(films))])
        if len(films) == 1:
            places, pressures = places[0], pressures[0]
        return films[0].grid.theta, places, pressures

    @property
    def counters(self) -> dict[str, float]:
        """Newton iterations, factorisations, parts of steps and steps that their bound cut short, so far."""
        a = self.assembly
        parts = [a.film_part(self.w, k)[a.film.convergence :][:CONVERGENCE] for k in range(max(len(a.films), 1))]
        counts = np.sum(parts, axis=0)
        return {
            "iterations": float(counts[ITERATIONS]),
            "factorisations": float(counts[FACTORISATIONS]),
            "substeps": float(self.w[self.assembly.rotor.substeps]),
            "overruns": float(counts[OVERRUNS]),
        }


def _check_inputs(a: Assembly, rows: np.ndarray) -> None:
    if not np.isfinite(rows[:, 1:]).all():
        row, column = np.argwhere(~np.isfinite(rows[:, 1:]))[0]
        raise DataError(f"{FINITE[column]}: {rows[row, column + 1]} in row {row}; give finite numbers")
    actuators = a.machine.actuators
    if actuators is None or not len(rows):
        return
    largest = float(np.abs(rows[:, REFERENCE]).max())
    if largest > actuators.reference_limit * (1 + 1e-12):
        raise DataError(
            f"reference: reaches {largest:g} V, the actuators take {actuators.reference_limit:g} V; "
            "make it smaller or change actuators.reference_limit"
        )


def split_columns(a: Assembly, table: np.ndarray, inputs: np.ndarray) -> dict[str, Any]:
    """Variables of the record schema from a sample table and the inputs that were held during each sample."""

    def pair(name: str) -> np.ndarray:
        return np.ascontiguousarray(table[:, AT[f"{name}_x"] : AT[f"{name}_y"] + 1])

    values: dict[str, Any] = {name: pair(name) for name in ("disc", "disc_measured")}
    values |= {name: table[:, AT[name]] for name in ("angle", "angle_measured", "speed", "speed_measured")}
    values |= {"disc_force": inputs[:, FORCE]}
    if table.shape[1] > a.columns:
        values["friction_torque"] = table[:, a.columns]
        table = table[:, : a.columns]
    pins = len(COLUMNS) + a.rig.n_pin
    read = len(COLUMNS) + a.rig.n_pin_columns
    probes = read + a.rig.n_probe
    if a.rig.n_probe:
        values["probe_measured"] = table[:, read:probes]
    if a.films:
        values |= {name: pair(name) for name in ("journal", "film_force")}
        scalars = ("pressure", "pressure_measured", "h_min", "mass_flow", "contact")
        values |= {name: table[:, AT[name]] for name in scalars}
    if a.rig.n_pin:
        values["reference"] = inputs[:, REFERENCE]
        values["pin"] = table[:, len(COLUMNS) : pins]
    if a.rig.n_pin_sensor:
        values["pin_measured"] = table[:, pins:read]
    if a.rig.n_heat:
        values["temperature_rise"] = table[:, a.columns - HEAT_COLUMNS * len(a.films) : a.columns]
        table = table[:, : a.columns - HEAT_COLUMNS * len(a.films)]
    if len(a.films) > 1:
        values |= of_each_film(table[:, probes:])
    return values


def of_each_film(table: np.ndarray) -> dict[str, Any]:
    """Journals and forces (time, film, axis), thicknesses and flows (time, film) of the columns of several films."""
    films = table.reshape(len(table), -1, FILM_COLUMNS)
    names = ("journals", "film_forces", "film_thickness", "film_flow")
    parts = (films[:, :, :2], films[:, :, 2:4], films[:, :, 4], films[:, :, 5])
    return {name: np.ascontiguousarray(part) for name, part in zip(names, parts, strict=True)}


TURNED = np.linspace(0, 2 * np.pi, 24, endpoint=False)
"""Angles [rad] of the shaft at which lobes that turn are looked at."""


def journal_room(machine: Machine, number: int, directions: np.ndarray, speed: float = 0.0) -> np.ndarray:
    """Room (n,) [m] of a journal in `directions` (n,) [rad] from x towards y; `number`: its film, speed [rad/s]."""
    model = make_films(machine)[number]
    layout, w, _ = model.build()
    constants = model.record()
    effects = [e for es in machine.effects.values() for e in es if e.port == "film"]
    effects = [e for e in effects if machine.film_number(e) in (None, number)]
    form = model.clearance + model.sleeve.height(model.grid.theta, model.clearance)
    rooms = []
    for turned in TURNED if effects else TURNED[:1]:
        if effects:
            constants.uneven = 1.0
            heights = [_height(effects, machine, model.grid.length, turned, speed, at) for at in model.grid.theta]
            line = form + np.array(heights)
            fill(w, layout.clearance, layout, np.repeat(line[:, None], layout.n_rows, axis=1), line)
        rooms.append([kernels.room(w, constants[0], layout, np.cos(at), np.sin(at)) for at in directions])
    return np.min(rooms, axis=0)


def _height(effects: list[Effect], machine: Machine, length: float, turned: float, speed: float, theta: float) -> float:
    """Addition of the effects to the gap [m] at an angle, at the end of the film where that is less."""
    height, slope = 0.0, 0.0
    for effect in effects:
        kernel = type(effect).kernel
        more = getattr(kernel, "py_func", kernel)(0.0, turned, speed, theta, _parameters(effect, machine))
        height, slope = height + more[0], slope + more[1]
    return height - abs(slope) * length / 2


def _parameters(effect: Effect, machine: Machine) -> Any:
    values = {name: getattr(effect, name) for name in numeric_fields(type(effect)) if name not in effect.extra}
    return SimpleNamespace(**values, **effect.derived(machine))
