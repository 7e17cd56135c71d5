"""Variables of a plant unit in one table, the source of C header, model descriptions, units, docs and checks.

A variable's value reference is its place in the table. The first is time; names are dotted, parameters of effects are
called as in the machine file (``effects.unbalance.me``).

Limits of inputs come from the machine, those of an effect's parameters from the effect's own checks. An input is
refused beyond the limits at which a run in Python is refused or ends, and warned of once beyond the range in which the
machine's model was checked. Bounds of parameters come from the parameter; `Effect.problems` narrows them (an injector
that does not exist, heat that closes the gap); a parameter that would change what was fixed at export (the symmetry of
the film's grid, derived numbers) is locked to its value.

SI units are written as exponents of the base units, display units with their factors.
"""

import ast
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from fmu.turned import FACTORS, Choice, Turned
from identification.records.schema import warm_bodies
from rotorsim.base.errors import DataError
from rotorsim.base.quantity import UNLIMITED, Quantity, quantities, quantity_of
from rotorsim.base.units import TABLE, TO_RPM, dimension
from rotorsim.effects import Effect
from rotorsim.effects.base import WHERE
from rotorsim.machine.gas_film import Actuators, Gas, PinnedInjector
from rotorsim.machine.limits import speed_limit
from rotorsim.machine.part import Part
from rotorsim.machine.rotor import Drive, reading_unit
from rotorsim.machine.schema import Machine
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.kernels.layout import COLUMNS, FILM_COLUMNS
from rotorsim.plant.validity import known_speed

NOMINAL = {"m": 1e-5, "N": 10.0, "rad/s": 600.0, "rad": 1.0, "Pa": 1e5, "V": 1.0, "kg/s": 1e-4, "N*m": 1e-2}
ROW = ("shaft.speed_ref", "injection.pressure", "piezo.ref_x", "piezo.ref_y", "disc.force_x", "disc.force_y")
"""Inputs in the order of a row of `rotorsim.plant.kernels.entry.run`."""
MOST_SEED = 2**31 - 1
BEFORE_START = ("support", "rotating", "plenum", "amplifier")
"""Ports whose effects are built in when the unit is initialised."""


@dataclass(frozen=True)
class UnitVariable:
    """A variable: `store` is where its value lies ('input', 'output', 'parameter', ...), `index` its place there.

    A value outside `low` to `high` is refused, for the reason `why`; one outside `checked` is warned of once, with the
    sentence `beyond`. One with a `clock` changes at that clock's ticks alone.
    """

    name: str
    store: str
    doc: str
    unit: str = "1"
    index: int = 0
    kind: str = "real"
    start: float | None = None
    low: float = -UNLIMITED
    high: float = UNLIMITED
    tunable: bool = False
    shape: tuple[int, ...] = ()
    typical: float | None = None
    why: str = ""
    checked: tuple[float, float] = (-UNLIMITED, UNLIMITED)
    beyond: str = ""
    clock: str = ""

    @property
    def causality(self) -> str:
        """FMI's causality."""
        known = {"time": "independent", "input": "input", "pressure": "output", "output": "output", "ticks": "input"}
        known |= dict.fromkeys(("constant", "state", "derivative"), "local")
        return known.get(self.store, "parameter")

    @property
    def derivative_of(self) -> str:
        """The state of which it is the derivative."""
        return self.name.removeprefix("der(").removesuffix(")") if self.store == "derivative" else ""

    @property
    def variability(self) -> str:
        """FMI's variability."""
        if self.store == "constant":
            return "constant"
        if self.causality == "parameter":
            return "tunable" if self.tunable else "fixed"
        return "continuous" if self.kind == "real" and not self.clock else "discrete"

    @property
    def nominal(self) -> float | None:
        """A typical size in SI units."""
        if self.typical is not None:
            return self.typical
        return NOMINAL.get(self.unit) if self.kind == "real" and self.causality in ("input", "output") else None

    @property
    def display(self) -> str | None:
        """Display unit."""
        if self.kind != "real" or self.store == "time":
            return None
        return display_unit(self.unit, self.start or self.nominal or 0.0)


def plant_variables(
    a: Assembly, speed: float, pressure: float, turned: Sequence[Turned] = ()
) -> tuple[UnitVariable, ...]:
    """All variables of a plant that starts at a speed [rad/s] and gauge pressure [Pa]; what of it is `turned`."""
    found = [UnitVariable("time", "time", "Simulation time.", "s")]
    found += [*_inputs(a, speed, pressure), *_outputs(a), *_machine_parameters(a)]
    for k, one in enumerate(turned):
        parameter = _parameter(one.name, one.quantity, k, one.value, False, (one.low, one.high))
        least, most = min(FACTORS) * one.value, max(FACTORS) * one.value
        beyond = f"is beyond {least:.4g} to {most:.4g}, in which the export compared it with assembled machines"
        found.append(replace(parameter, store="turned", checked=(least, most), beyond=beyond))
    found += _effect_parameters(a)
    found.append(
        UnitVariable(
            "noise.seed", "seed", "Makes the machine's noise and nothing else.", kind="integer", start=0.0, low=0.0,
            high=MOST_SEED,
        )
    )  # fmt: skip
    known = {v.name for v in found}
    return (*found, *(v for v in _constants(a) if v.name not in known))


def with_choices(
    found: Sequence[UnitVariable], choices: Sequence[Choice], others: Sequence[Sequence[UnitVariable]]
) -> tuple[UnitVariable, ...]:
    """The variables of a plant with what is chosen from lists, and limits that hold for the machines of all choices.

    `others` are the variables of these machines. Raises DataError for a start beyond the limits of one of them.
    """
    tables = [{v.name: v for v in table} for table in others]
    known = {v.name: _narrowest(v, [table[v.name] for table in tables if v.name in table]) for v in found}
    first = sum(v.store == "turned" for v in found)
    for k, one in enumerate(choices, first):
        bounds = min(one.values), max(one.values)
        v = _parameter(one.name, one.quantity, k, one.values[0], False, bounds)
        known[one.name] = replace(v, store="turned", doc=f"{v.doc} One of {one.text}.")
    for v in known.values():
        if v.store == "input" and v.start is not None and not v.low <= v.start <= v.high:
            raise DataError(f"over: a machine takes {v.name} up to {v.high:g} {v.unit} and starts at {v.start:g}")
    return tuple(known.values())


def _narrowest(v: UnitVariable, others: Sequence[UnitVariable]) -> UnitVariable:
    """A variable within the limits of all."""
    for one in others:
        low, high = max(v.low, one.low), min(v.high, one.high)
        checked = max(v.checked[0], one.checked[0]), min(v.checked[1], one.checked[1])
        why = one.why if high < v.high or low > v.low else v.why
        beyond = one.beyond if checked != v.checked else v.beyond
        v = replace(v, low=low, high=high, checked=checked, why=why, beyond=beyond)
    return v


def _inputs(a: Assembly, speed: float, pressure: float) -> Iterator[UnitVariable]:
    rows = [("shaft.speed_ref", "rad/s", speed, "Speed reached at the end of the coming step; at rest at the start.")]
    if a.film.n_inj:
        rows.append(("injection.pressure", "Pa", pressure, "Gauge pressure of the supply, held over a step."))
    if a.rig.n_pin:
        which = {"reference": "of the pins' PD loops", "voltage": "of the amplifiers"}.get(_mode(a), "of the pins")
        for axis in "xy":
            rows.append((f"piezo.ref_{axis}", "V", 0.0, f"Reference {which} along {axis}; positive pushes its pin in."))
    for axis in "xy":
        rows.append(
            (f"disc.force_{axis}", "N", 0.0, f"Force on the shaft where displacement is measured, along {axis}.")
        )
    for k, (name, unit, start, doc) in enumerate(rows):
        yield UnitVariable(name, "input", doc, unit, k, start=start, **input_limits(a.machine, name))
    doc = "Whether the drive holds the speed; off, the shaft coasts."
    yield UnitVariable("drive.on", "input", doc, index=len(rows), kind="boolean", start=1.0, low=0.0, high=1.0)


def _mode(a: Assembly) -> str:
    return a.machine.actuators.mode if a.machine.actuators else "ideal"


def _outputs(a: Assembly) -> Iterator[UnitVariable]:
    n, fed, has_film = a.rig.n_pin, a.film.n_inj, bool(a.films)
    extra, own = a.columns - len(COLUMNS), len(COLUMNS)
    at = {name: k for k, name in enumerate(COLUMNS)}
    rows: list[tuple[str, str, int, str]] = []
    rows += [(f"disc.{x}", "m", at[f"disc_{x}"], f"Displacement at the disc along {x}.") for x in "xy"]
    if has_film:
        rows += [(f"bearing.{x}", "m", at[f"journal_{x}"], f"Displacement of the journal along {x}.") for x in "xy"]
    rows.append(("shaft.angle", "rad", at["angle"], "Angle of the shaft, not wrapped."))
    rows.append(("shaft.speed", "rad/s", at["speed"], "Speed of the shaft."))
    if has_film:
        rows += [(f"film.force_{x}", "N", at[f"film_force_{x}"], f"Film force on the journal along {x}.") for x in "xy"]
        rows.append(("film.h_min", "m", at["h_min"], "Smallest film thickness."))
        rows.append(("film.friction_torque", "N*m", own + extra, "Torque of the film against the rotation."))
    rows += _each_film(a)
    if fed:
        rows.append(("injection.line_pressure", "Pa", at["pressure"], "Gauge pressure behind the supply line."))
        rows.append(("injection.mass_flow", "kg/s", at["mass_flow"], "Mass flow into the film."))
    rows += [
        (f"piezo.position_{k + 1}", "m", own + k, f"Travel of pin {k + 1}; more closes its seat.") for k in range(n)
    ]
    for i, x in enumerate("xy" if n else ""):
        rows.append(
            (f"piezo.diff_{x}", "m", own + extra + 1 + i, f"Sum of the pins' travel with the signs of ref_{x}.")
        )
    rows += [
        (f"meas.disc_{x}", "m", at[f"disc_measured_{x}"], f"What the displacement sensor {x} reads.") for x in "xy"
    ]
    for k in range(n if a.rig.n_pin_sensor else 0):
        rows.append((f"meas.pin_{k + 1}", "m", own + n + k, f"Travel of pin {k + 1} as its sensor reads it."))
    for k, probe in enumerate(a.machine.probes):
        seen, place = probe.quantity.replace("_", " "), own + a.rig.n_pin_columns + k
        rows.append((f"meas.probe_{probe.name}", reading_unit(probe), place, f"Reading of a probe: {seen}."))
    rows.append(("meas.angle", "rad", at["angle_measured"], "Shaft angle as the encoder reads it."))
    rows.append(("meas.speed", "rad/s", at["speed_measured"], "Speed as estimated from the encoder."))
    if fed:
        rows.append(("meas.pressure", "Pa", at["pressure_measured"], "Injection pressure as its transducer reads it."))
    for name, unit, column, doc in rows:
        yield UnitVariable(name, "output", doc, unit, column)
    if a.machine.solver.corrections:
        yield from _work(own + extra + 3)
    if has_film:
        doc = "Whether the journal touched its sleeve during the last step."
        yield UnitVariable("film.touchdown", "output", doc, index=at["contact"], kind="boolean")
        shape = (a.film.n_theta, a.machine.grid.n_z)
        yield UnitVariable("film.pressure", "pressure", "Absolute film pressure over theta and z.", "Pa", shape=shape)


def _work(first: int) -> Iterator[UnitVariable]:
    """Outputs about steps of bounded work, from a place on."""
    doc = "Largest error that a step of the last sample left, in pressure / ambient + journal / clearance; "
    doc += "0: no stage was cut short; errors near contact are not in it."
    yield UnitVariable("solver.error_left", "output", doc, index=first)
    for k, (name, doc) in enumerate(
        {
            "corrections": "Corrections of the last sample, a factorisation counted as ten.",
            "overruns": "Steps since the start that their bound has cut short.",
        }.items(),
        first + 1,
    ):
        yield UnitVariable(f"solver.{name}", "output", doc, index=k, kind="integer")


def _each_film(a: Assembly) -> Iterator[tuple[str, str, int, str]]:
    """Outputs of each of several films that those of the first and of all do not hold, and the temperatures."""
    column = len(COLUMNS) + a.rig.n_pin_columns + a.rig.n_probe
    for k, name in enumerate(a.machine.film_names if len(a.films) > 1 else (), 1):
        for i, axis in enumerate("xy" if k > 1 else ""):
            yield f"bearing_{k}.{axis}", "m", column + i, f"Displacement of the journal in '{name}' along {axis}."
        for i, axis in enumerate("xy" if k > 1 else ""):
            yield f"film_{k}.force_{axis}", "N", column + 2 + i, f"Film force on the journal in '{name}' along {axis}."
        yield f"film_{k}.h_min", "m", column + 4, f"Smallest film thickness in '{name}'."
        yield f"film_{k}.mass_flow", "kg/s", column + 5, f"Mass flow into the film in '{name}'."
        column += FILM_COLUMNS
    if a.rig.n_heat:
        for body in warm_bodies(a.machine.film_names if len(a.films) > 1 else ()):
            name = f"temperature_rise.{body}".replace(" ", ".")
            yield name, "K", column, f"Rise of the temperature of the {body} above the gas temperature."
            column += 1


def place(a: Assembly, *path: str, item: int = 0) -> int:
    """Place of a number in the parameter record, counted in doubles."""
    kind, offset = a.record.dtype, 0
    for name in path:
        assert kind.fields is not None
        kind, start = kind.fields[name][:2]
        offset += start
    return offset // 8 + item


def _parameter(
    name: str, known: Quantity, index: int, value: float, tunable: bool, bounds: tuple[float, float] | None = None
) -> UnitVariable:
    """Parameter declared by a `Quantity`, within its limits or narrower `bounds`."""
    low, high = bounds or known.bounds
    kind = "integer" if known.multiple else "real"
    return UnitVariable(
        name, "parameter", known.doc, known.unit, index, kind, start=value, low=low, high=high, tunable=tunable
    )


def _declared(part: type[Part], field: str) -> Quantity:
    found = quantity_of(part.model_fields[field])
    assert found is not None
    return found


def _machine_parameters(a: Assembly) -> Iterator[UnitVariable]:
    P = a.P
    if len(a.films) == 1:
        known = _declared(Gas, "viscosity")
        yield _parameter("gas.viscosity", known, place(a, "film_0", "mu"), float(P.film_0.mu), a.rig.n_gas > 0)
    for field, name in (
        ("inertia", "inertia"),
        ("dry_drag", "dry_drag"),
        ("viscous_drag", "viscous_drag"),
        ("speed_recovery_time", "drive_time"),
    ):
        yield _parameter(
            f"drive.{field}", _declared(Drive, field), place(a, name), float(getattr(P, name)), field != "inertia"
        )
    first = a.machine.pinned_film
    if _mode(a) == "ideal" or first is None:
        return
    for field, name in (("sensitivity", "sensitivity"), ("sensor_sensitivity", "transducer"), ("pd_pole", "pd_pole")):
        yield _parameter(
            f"actuators.{field}", _declared(Actuators, field), place(a, name), float(getattr(P, name)), False
        )
    own = ("amplifier_lag", "stack_lag") + (("pd_gain", "pd_zero") if _mode(a) == "reference" else ())
    for k in range(a.rig.n_pin):
        for name in own:
            item = first * a.film.n_inj + k
            known, value = _declared(PinnedInjector, name), float(getattr(P, name)[item])
            known = replace(known, doc=known.doc.split(";")[0] + ".")
            yield _parameter(f"injectors[{k + 1}].{name}", known, place(a, name, item=item), value, False)


def _paths(a: Assembly) -> Iterator[tuple[str, str, Effect]]:
    """Name of the table in the machine file (several of a kind count from 1), name in the record and effect."""
    for name, effects in a.machine.effects.items():
        for i, effect in enumerate(effects):
            record = f"{name}_{i}"
            if any(call.record == record for call in a.calls):
                yield f"effects.{name}" if len(effects) == 1 else f"effects.{name}[{i + 1}]", record, effect


def _effect_parameters(a: Assembly) -> Iterator[UnitVariable]:
    for path, record, effect in _paths(a):
        for name, known in quantities(effect).items():
            if name not in WHERE:
                index, value = place(a, record, name), float(getattr(effect, name))
                bounds = limits(a.machine, effect, name, a.film.half == 1)
                yield _parameter(f"{path}.{name}", known, index, value, effect.port not in BEFORE_START, bounds)


def _constants(a: Assembly) -> Iterator[UnitVariable]:
    gas = a.machine.gas
    rows = [("gas.ambient_pressure", "Pa", gas.ambient_pressure, "Absolute ambient pressure.")]
    for k, film in enumerate(a.machine.films, 1):
        part = "bearing" if k == 1 else f"bearing_{k}"
        rows += [
            (f"{part}.clearance", "m", film.clearance, "Radial clearance."),
            (f"{part}.diameter", "m", film.diameter, "Diameter of the journal."),
            (f"{part}.length", "m", film.length, "Axial length of the film."),
        ]
    rows.append(("probe.position", "m", a.mesh.probe, "Where displacement is measured along the shaft."))
    for probe in a.machine.probes:
        rows.append((f"probes.{probe.name}.angle", "rad", probe.angle, "Its direction, from x towards y."))
        if probe.position is not None:
            rows.append((f"probes.{probe.name}.position", "m", probe.position, "Where it stands along the shaft."))
    for path, _, effect in _paths(a):
        if hasattr(effect, "position"):
            rows.append((f"{path}.position", "m", a.mesh.place(effect), "Where the effect acts along the shaft."))
        if getattr(effect, "bearing", None) is not None:
            rows.append((f"{path}.bearing", "1", effect.bearing, "Index of the bearing that the effect is about."))  # type: ignore[attr-defined]
    for name, unit, value, doc in rows:
        yield UnitVariable(name, "constant", doc, unit, start=float(value))


HALVINGS = 60
MOST_WHOLE = 4096
SLACK = 1.001
"""Factor on the ends of the checked range within which there is no warning, as in `Checked.holds`."""


def input_limits(machine: Machine, name: str) -> dict[str, Any]:
    """Limits of an input, as fields of a variable: refused beyond `low` and `high`, warned of beyond `checked`."""
    if name == "shaft.speed_ref":
        return _speed_limits(machine)
    if name == "injection.pressure":
        return _pressure_limits(machine)
    if name.startswith("piezo.ref") and machine.actuators is not None:
        limit = machine.actuators.reference_limit
        return {"low": -limit, "high": limit, "why": "the actuators take actuators.reference_limit"}
    return {}


def _speed_limits(machine: Machine) -> dict[str, Any]:
    limit, why = speed_limit(machine)
    found: dict[str, Any] = {"low": -limit, "high": limit, "why": why}
    known = known_speed(machine)
    if known is not None:
        end, reason = known
        text = f"is beyond {end:.6g} rad/s ({end * TO_RPM:.6g} rpm), {reason}; this input is in rad/s"
        found |= {"checked": (-SLACK * end, SLACK * end), "beyond": text}
    return found


def _pressure_limits(machine: Machine) -> dict[str, Any]:
    found: dict[str, Any] = {"low": 1.0 - machine.gas.ambient_pressure, "why": "less is a vacuum"}
    checked = machine.checked
    if checked is not None:
        high = UNLIMITED if checked.highest_pressure is None else SLACK * checked.highest_pressure
        text = f"is outside the checked pressures ({checked.pressures}, {checked.against}); this input is in Pa, gauge"
        found |= {"checked": (checked.lowest_pressure / SLACK, high), "beyond": text}
    return found


def limits(machine: Machine, effect: Effect, name: str, half: bool) -> tuple[float, float]:
    """Limits of a parameter; `half`: the film is computed on one half."""
    quantity, value = quantities(effect)[name], float(getattr(effect, name))
    low, high = quantity.bounds
    if _locked(machine, effect, name, _another(value, low, high), half):
        return value, value
    whole = bool(quantity.multiple)
    return _reach(machine, effect, name, value, low, whole), _reach(machine, effect, name, value, high, whole)


def _another(value: float, low: float, high: float) -> float:
    """A permitted value other than the present one."""
    return min(value + 1e-3 * (high - value), value + 1.0) if high > value else value - min(1e-3 * (value - low), 1.0)


def _locked(machine: Machine, effect: Effect, name: str, other: float, half: bool) -> bool:
    changed: Any = replace(effect, **{name: other})
    if half and changed.symmetric != effect.symmetric:
        return True
    return bool(changed.derived(machine) != effect.derived(machine))


def _refused(machine: Machine, effect: Effect, name: str, value: float) -> bool:
    changed: Any = replace(effect, **{name: value})
    return name in changed.problems(machine)


def _reach(machine: Machine, effect: Effect, name: str, good: float, bound: float, whole: bool) -> float:
    """The bound, or the last value towards it that the effect takes."""
    if abs(bound) >= UNLIMITED or not _refused(machine, effect, name, bound):
        return bound
    if whole:
        step = 1.0 if bound > good else -1.0
        for _ in range(MOST_WHOLE):
            if abs(good + step - bound) > abs(good - bound) or _refused(machine, effect, name, good + step):
                break
            good += step
        return good
    bad = bound
    for _ in range(HALVINGS):
        middle = 0.5 * (good + bad)
        good, bad = (good, middle) if _refused(machine, effect, name, middle) else (middle, bad)
    return good


DERIVED = {
    "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "Hz": {"s": -1},
}
BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


def exponents(unit: str) -> dict[str, int]:
    """Exponents of the base units, e.g. of 'N*m': kg 1, m 2, s -2."""
    found = _walk(ast.parse(unit.replace("^", "**"), mode="eval").body)
    return {name: found[name] for name in BASE if found[name]}


def _walk(node: ast.AST) -> Counter[str]:
    if isinstance(node, ast.Name):
        return Counter(DERIVED.get(node.id, {node.id: 1}))
    if isinstance(node, ast.BinOp):
        left = _walk(node.left)
        if isinstance(node.op, ast.Pow) and isinstance(node.right, ast.Constant):
            power = int(str(node.right.value))
            return Counter({name: n * power for name, n in left.items()})
        sign = 1 if isinstance(node.op, ast.Mult) else -1
        for name, n in _walk(node.right).items():
            left[name] += sign * n
        return left
    return Counter()


def fmi_name(unit: str) -> str:
    """'N*m' as 'N.m', 'm/s^2' as 'm/s2'."""
    return unit.replace("*", ".").replace("^", "")


def display_unit(unit: str, typical: float) -> str | None:
    """Display unit for a value of this size, None where that is the SI unit."""
    if unit not in TABLE:
        return None
    kind = dimension(unit)
    fitting = [u for u in kind.people if u in kind.factors and abs(typical) >= 0.1 * float(kind.factors[u])]
    best = (fitting or list(kind.people))[-1 if fitting else 0]
    return fmi_name(best) if best != unit and best in kind.factors else None


def unit_definitions(units: Iterable[str]) -> Element:
    """The element UnitDefinitions for all units used."""
    root = Element("UnitDefinitions")
    for unit in sorted(set(units) - {"1", ""}):
        entry = SubElement(root, "Unit", name=fmi_name(unit))
        SubElement(entry, "BaseUnit", {name: str(n) for name, n in exponents(unit).items()})
        kind = dimension(unit)
        for shown in kind.people:
            if shown != unit and shown in kind.factors:
                SubElement(entry, "DisplayUnit", name=fmi_name(shown), factor=repr(1 / float(kind.factors[shown])))
    return root
