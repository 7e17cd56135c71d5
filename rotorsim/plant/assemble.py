"""Assembly of a machine for the kernels: layouts, workspace, index array, parameter record, composed module.

The parameter record has every number of a machine in SI units, each name next to its value.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, cast

import numpy as np

from reynolds.addressed_calls import ADDRESS, WIDTH
from reynolds.grid import FilmGrid, Layout, make_layout
from reynolds.injector import Injector as Nozzle
from reynolds.jit import calls_addresses
from reynolds.workspace import FILM_DTYPE, FilmGas, FilmModel, build_films
from rotorsim.base.errors import MachineFileError
from rotorsim.effects import FILM_PORTS, PORTS, Effect, numeric_fields
from rotorsim.effects.base import WHERE
from rotorsim.machine.gas_film import PinnedInjector
from rotorsim.machine.schema import Machine
from rotorsim.plant.calls import CALLS, Call, fill_addresses, first_rows, kernels_alone, rows_of, used
from rotorsim.plant.compose import KernelModule, compose, film_entries, is_compiled, is_kept
from rotorsim.plant.kernels.layout import (
    COLUMNS,
    LIVE,
    RigLayout,
    RotorLayout,
    film_columns,
    make_rig_layout,
    make_rotor_layout,
)
from rotorsim.plant.locations import probe_rows
from rotorsim.plant.mesh import Mesh

SUBSTEP = 5e-5
"""Longest substep of the actuators [s]."""


@dataclass(frozen=True)
class Assembly:
    """Everything a run needs; `w` is the workspace before any state is put into it."""

    machine: Machine
    mesh: Mesh
    films: tuple[FilmModel, ...]
    film: Layout
    rotor: RotorLayout
    rig: RigLayout
    calls: tuple[Call, ...]
    w: np.ndarray
    ix: np.ndarray
    record: np.recarray
    module: KernelModule

    @property
    def film_model(self) -> FilmModel | None:
        """The first film, None for a machine without."""
        return self.films[0] if self.films else None

    @property
    def columns(self) -> int:
        """Columns of the sample table: those of all machines, pins and probes, each of several films."""
        own = self.rig.n_pin_columns + self.rig.n_probe
        return len(COLUMNS) + own + film_columns(len(self.films), self.rig.n_heat > 0)

    def film_part(self, w: np.ndarray, number: int) -> np.ndarray:
        """View of a film's part of a workspace, laid out as `film`."""
        return w[number * self.film.size : (number + 1) * self.film.size]

    def film_indices(self, number: int) -> np.ndarray:
        """View of a film's part of the index array."""
        return self.ix[number * self.film.n_integers : (number + 1) * self.film.n_integers]

    def film_constants(self, number: int) -> Any:
        """Record of a film's constants."""
        return getattr(self.P, f"film_{number}")

    @property
    def P(self) -> Any:
        """The parameter record (one row of `record`)."""
        return self.record[0]

    @cached_property
    def parameters(self) -> Any:
        """The parameter record as the kernels take it.

        It ends where the calls of effects begin, so that it is of one type whatever the effects are; kernels find these
        behind it. Their machine code is there from now on.
        """
        if not calls_addresses():
            return self.P
        fill_addresses(self.record, self.calls)
        names = self.record.dtype.names or ()
        own = np.dtype([(name, self.record.dtype[name]) for name in names[: names.index(CALLS)]])
        return np.recarray((1,), own, buf=self.record.data)[0]

    def with_numbers(self, record: np.recarray, w: np.ndarray) -> Assembly:
        """The same machine with the numbers of a copy of its `record`, after `parameters`, and another workspace.

        The copy holds the addresses of machine code, which are not looked up again.
        """
        other, own, flat = replace(self, record=record, w=w), self.parameters, cast(Any, record.view(np.uint8))
        if own.dtype != record.dtype:
            assert record[CALLS][0][self._asked, ADDRESS].all(), "a row of calls without an address"
            other.__dict__.update(parameters=np.recarray((1,), own.dtype, buf=flat)[0], _asked=self._asked)
        return other

    @cached_property
    def _asked(self) -> list[bool]:
        """Which rows of calls hold the address of a kernel."""
        return [function.asks for function, _ in used(self.calls)]

    @property
    def numbers(self) -> np.ndarray:
        """The parameter record as doubles, without what only this process knows."""
        record = self.record.copy()
        record[CALLS] = 0
        return record.view("f8").ravel()

    @property
    def steps_per_sample(self) -> int:
        """Time steps in one sample."""
        return round(self.sampling_time / self.machine.time_step)

    @cached_property
    def sampling_time(self) -> float:
        """Time [s] between two samples of the machine."""
        return self.machine.sampling_time

    def compile_note(self, *kernels: str) -> str:
        """Sentence on what is compiled before kernels ('settle', 'run') first run; empty if nothing is."""
        film = self.film_model is not None and not is_compiled(self.module, film_entries(len(self.films)))
        rotor = not is_compiled(self.module, kernels)
        effects = {record for record, kernel in kernels_alone(self.calls) if not is_kept(kernel)}
        parts = ["film"] * film + ["rotor"] * rotor + [f"{len(effects)} effects"] * bool(effects)
        return f"compiling {self.machine.name} ({', '.join(parts)}); later runs find it in the cache" if parts else ""


def assemble(machine: Machine, other_bearings: bool = False) -> Assembly:
    """Lay out and fill everything for a machine, and compose its kernels; `other_bearings` is that of `Mesh`."""
    mesh = Mesh(machine, other_bearings)
    films = make_films(machine)
    film, w, ix = _build(films) if films else _no_film()
    effects = [
        (f"{name}_{i}", e)
        for name, es in machine.effects.items()
        for i, e in enumerate(es)
        if films or e.port not in FILM_PORTS
    ]
    effects.sort(key=lambda one: not one[1].begins_chain)
    ports = {port: sum(e.port == port for _, e in effects) for port in PORTS}
    rotor = make_rotor_layout(
        mesh.reduced.Phi.shape[1], film, len(films), ports["support"], ports["rotating"] > 0,
        (len(mesh.tables.values), len(mesh.tables.speeds)), len(machine.supported),
    )  # fmt: skip
    rig = _rig(machine, rotor, film.n_inj * len(films), ports, [e for _, e in effects])
    calls = _number(machine, effects, rotor, rig)
    w = np.concatenate([w, np.zeros(rig.size - w.size)])
    _fill_rotor(w, rotor, mesh, calls)
    _fill_tables(w, rotor, mesh)
    rows = probe_rows(mesh)
    w[rig.probe : rig.probe + rows.size] = rows.ravel()
    record = make_parameters(machine, mesh, films, film, rotor, rig, calls)
    module = compose(film, rotor, rig, calls)
    return Assembly(machine, mesh, films, film, rotor, rig, calls, w, ix, record, module)


def _number(
    machine: Machine, effects: list[tuple[str, Effect]], rotor: RotorLayout, rig: RigLayout
) -> tuple[Call, ...]:
    """Give every effect its place among those of its port, its shape rows, its states and its film."""
    seen: dict[str, int] = {}
    states = {"actuator": 0, "": 0}
    calls = []
    for k, (record, e) in enumerate(effects):
        kind = e.port if e.port == "actuator" else ""
        at = rig.shapes + 2 * rotor.n * k
        calls.append(Call(e, record, at, states[kind], seen.get(e.port, 0), machine.film_number(e)))
        seen[e.port] = seen.get(e.port, 0) + 1
        states[kind] += states_of(e, machine)
    return tuple(calls)


def states_of(effect: Effect, machine: Machine) -> int:
    """Number of an effect's own states: those of each pin, where it acts on references."""
    return effect.states * len(machine.injectors) if effect.port == "reference" else effect.states


def _rig(machine: Machine, rotor: RotorLayout, n_inj: int, ports: dict[str, int], effects: list[Effect]) -> RigLayout:
    driven = int(bool(machine.injectors) and machine.actuators is not None and machine.actuators.mode != "ideal")
    stroke_states = sum(e.states for e in effects if e.port == "actuator")
    states = sum(states_of(e, machine) for e in effects if e.port != "actuator")
    substeps = math.ceil(machine.sampling_time / SUBSTEP - 1e-9)
    return make_rig_layout(
        rotor.size, rotor.n_films, n_inj, len(machine.injectors), driven, substeps, ports,
        stroke_states, states, len(machine.probes), rotor.n_machine,
        sum(e.port == "contact" or type(e).braking is not None for e in effects), 2 * rotor.n * len(effects),
    )  # fmt: skip


def make_films(machine: Machine) -> tuple[FilmModel, ...]:
    """The films of a machine as `reynolds` takes them, all with one kind of grid."""
    gas = machine.gas
    air = FilmGas(gas.mu, gas.ambient_pressure, gas.temperature, gas.R, gas.kappa)
    fed = [_injectors(machine, number) for number in range(len(machine.films))]
    symmetric = all(e.symmetric for es in machine.effects.values() for e in es)
    symmetric = symmetric and all(film.sleeve.symmetric for film in machine.films)
    half = machine.grid.symmetry == "auto" and symmetric and all(i.offset == 0 for one in fed for i in one)
    return tuple(
        FilmModel(
            FilmGrid(film.diameter / 2, film.length, machine.grid.n_theta, machine.grid.n_z, half), film.clearance, air,
            injectors, machine.solver.minimum_film, film.sleeve,
        )
        for film, injectors in zip(machine.films, fed, strict=True)
    )  # fmt: skip


def _injectors(machine: Machine, number: int) -> tuple[Nozzle, ...]:
    """Injectors of a film: those with pins, if they feed it, then its own orifices."""
    common = machine.injection
    pins = () if common is None or number != machine.pinned_film else map(common.nozzle, machine.injectors)
    return (*pins, *(one for row in machine.films[number].orifices for one in row.nozzles))


def _build(films: tuple[FilmModel, ...]) -> tuple[Layout, np.ndarray, np.ndarray]:
    try:
        return build_films(films)
    except ValueError as error:
        raise MachineFileError(str(error)) from error


def _no_film() -> tuple[Layout, np.ndarray, np.ndarray]:
    layout = make_layout(FilmGrid(0.02, 0.04, 8, 4), [], [])
    return layout, np.zeros(layout.size), np.zeros(8, np.int64)


def _fill_rotor(w: np.ndarray, rotor: RotorLayout, mesh: Mesh, calls: tuple[Call, ...]) -> None:
    """Write matrices and rows; those of the effects' resonances stay zero here."""
    reduced, n = mesh.reduced, rotor.n
    named = [(rotor.K, reduced.K), (rotor.C, reduced.C), (rotor.G, reduced.G)]
    if rotor.turning:
        named += [(rotor.KS, mesh.shaft_stiffness), (rotor.N, mesh.circulation)]
    for offset, matrix in named:
        padded = np.zeros((n, n))
        padded[: rotor.n_machine, : rotor.n_machine] = matrix.T
        w[offset : offset + n**2] = padded.ravel()
    rows = [(at, mesh.shape(mesh.probe)) for at in (rotor.disc, rotor.struck)] + [
        (c.shape, mesh.influence(c.effect)) for c in calls
    ]
    rows += [(rotor.journal + 2 * n * k, mesh.between(i)) for k, i in enumerate(mesh.machine.film_bearings)]
    for offset, shape in rows:
        put_rows(w, offset, shape, n)


def put_rows(w: np.ndarray, offset: int, shape: np.ndarray, n: int) -> None:
    """Write rows (2, m) as (2, n), with zeros behind the m coordinates."""
    w[offset : offset + 2 * n] = np.pad(shape, ((0, 0), (0, n - shape.shape[1]))).ravel()


def _fill_tables(w: np.ndarray, rotor: RotorLayout, mesh: Mesh) -> None:
    """Write the bearings that are tables, all at the same speeds."""
    tables = mesh.tables
    w[rotor.table_speeds : rotor.table_speeds + rotor.n_points] = tables.speeds
    for b, (number, values) in enumerate(tables.values.items()):
        put_rows(w, rotor.table_rows + 2 * rotor.n * b, mesh.between(number), rotor.n)
        at = rotor.table_values + values.size * b
        w[at : at + values.size] = values.ravel()


WITHOUT_FILM = 1e-11
"""Motion [m] left in forces that depend on it where there is no film to compare with."""


def make_parameters(
    machine: Machine, mesh: Mesh, films: Sequence[FilmModel], film: Layout, rotor: RotorLayout, rig: RigLayout,
    calls: Sequence[Call],
) -> np.recarray:  # fmt: skip
    """Record array of one row; effects are records of their own inside it, numbers of injectors are arrays.

    What a machine has without effects comes first, then the rows of the `calls`, then the effects.
    """
    numbers, nozzles = machine_numbers(machine, mesh, films), _nozzles(machine, films, film.n_inj)
    count, first = max(len(films), 1), first_rows(calls)
    types: list[Any] = [(name, "f8") for name in numbers] + [(f"film_{k}", FILM_DTYPE) for k in range(count)]
    types += [("nominal_stiffness", "f8", (count,))] + [(name, "f8", values.shape) for name, values in nozzles.items()]
    types += [(name, "i8") for name in LIVE] + [("first", "i8", (len(first),)), (CALLS, "i8", (first[-1], WIDTH))]
    types += [(c.record, [(f, "f8") for f in numeric_fields(type(c.effect))]) for c in calls]
    record = np.zeros(1, np.dtype([t for t in types if t[1]])).view(np.recarray)
    for name, value in (numbers | nozzles | {name: getattr(rig, name) for name in LIVE}).items():
        record[name] = value
    record["first"], record[CALLS] = first, rows_of(calls, rotor, rig, record.dtype)
    for k, model in enumerate(films):
        record[f"film_{k}"] = model.record()
        record["nominal_stiffness"][0, k] = machine.films[k].nominal_stiffness
    for call in calls:
        for field, value in effect_numbers(call.effect, machine, mesh).items():
            record[call.record][field] = value
    return record


def machine_numbers(machine: Machine, mesh: Mesh, films: Sequence[FilmModel]) -> dict[str, float]:
    """Numbers that a machine has once: solver, actuators (zero where no pin is driven by one), drive."""
    solver, drive, piezos = machine.solver, machine.drive, machine.actuators if machine.injectors else None
    return {
        "tolerance": solver.tolerance,
        "corrections": float(solver.corrections or 0),
        "motion_tolerance": solver.tolerance * min(f.clearance for f in films) if films else WITHOUT_FILM,
        "dt": machine.time_step,
        "sample": machine.sampling_time,
        "sensitivity": 0.0 if piezos is None else piezos.sensitivity,
        "transducer": 0.0 if piezos is None else piezos.sensor_sensitivity,
        "volt_low": 0.0 if piezos is None else piezos.lowest,
        "volt_high": 0.0 if piezos is None else piezos.highest,
        "controlled": float(piezos is not None and piezos.mode == "reference"),
        "pd_pole": 0.0 if piezos is None else piezos.pd_pole,
        "inertia": mesh.polar_inertia if drive.inertia is None else drive.inertia,
        "dry_drag": drive.dry_drag,
        "viscous_drag": drive.viscous_drag,
        "drive_time": drive.speed_recovery_time,
        "drive_torque": 0.0,
    }


def nozzle_numbers(machine: Machine, nozzle: Nozzle, pin: PinnedInjector | None, number: int) -> dict[str, float]:
    """Numbers of an injector or orifice of a film; those of the pin, its `number` from 1 too, are zero without one."""
    gas, common, piezos = machine.gas, machine.injection, machine.actuators
    along_x, along_y = (0.0, 0.0) if pin is None else pin.signs
    travel = 0.0 if pin is None or common is None else common.pin_per_volt
    driven = pin is not None and piezos is not None

    def lag(name: str) -> float:
        own = getattr(pin, name, None)
        return getattr(piezos, name) if own is None else own

    return {
        "capacity": nozzle.plenum_volume / (nozzle.polytropic_exponent * gas.R * gas.temperature),
        "pinned": float(number if pin is not None else 0),
        "seat_gap": 0.0 if pin is None else nozzle.seat_gap,
        "minimum_gap": 0.0 if pin is None else nozzle.minimum_gap,
        "open_conductance": nozzle.conductance(0.0),
        "loss_exponent": nozzle.loss_exponent,
        "pin_bias": 0.0 if pin is None else nozzle.pin,
        "pin_x": along_x * travel,
        "pin_y": along_y * travel,
        "sign_x": along_x,
        "sign_y": along_y,
        "pd_gain": pin.pd_gain or 0.0 if driven and pin is not None else 0.0,
        "pd_zero": pin.pd_zero or 0.0 if driven and pin is not None else 0.0,
        "amplifier_lag": lag("amplifier_lag") if driven else 0.0,
        "stack_lag": lag("stack_lag") if driven else 0.0,
    }


def _nozzles(machine: Machine, films: Sequence[FilmModel], most: int) -> dict[str, np.ndarray]:
    """Numbers of all injectors by name: film after film, each with room for `most`; zeros where a film has fewer."""
    names = nozzle_numbers(machine, Nozzle(0.0), None, 0)
    found = {name: np.zeros(max(max(len(films), 1) * most, 1)) for name in names}
    for f, model in enumerate(films):
        pins = machine.injectors if f == machine.pinned_film else ()
        for k, nozzle in enumerate(model.injectors):
            numbers = nozzle_numbers(machine, nozzle, pins[k] if k < len(pins) else None, k + 1)
            for name, value in numbers.items():
                found[name][f * most + k] = value
    return found


def effect_numbers(effect: Effect, machine: Machine, mesh: Mesh) -> dict[str, float]:
    """Parameters of an effect that its kernel sees, and the numbers that follow from machine and rotor."""
    found = {field.name: getattr(effect, field.name) for field in fields(effect) if field.name not in WHERE}
    found |= effect.derived(machine)
    if "residual" in effect.extra:
        found["residual"] = mesh.residual_compliance(effect)
    return found
