"""Assembly of a machine for the kernels: layouts, workspace, index array, parameter record, composed module."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from reynolds.grid import FilmGrid, Layout, make_layout
from reynolds.injector import Injector
from reynolds.workspace import FilmGas, FilmModel, build_films
from rotorsim.base.errors import MachineFileError
from rotorsim.effects import FILM_PORTS, PORTS, Effect
from rotorsim.machine.schema import Machine
from rotorsim.plant.compose import Call, KernelModule, compose, film_entries, is_compiled
from rotorsim.plant.kernels.columns import COLUMNS, film_columns
from rotorsim.plant.kernels.modal_rotor import RotorLayout, make_rotor_layout
from rotorsim.plant.kernels.rig_layout import RigLayout, make_rig_layout
from rotorsim.plant.mesh import Mesh
from rotorsim.plant.parameters import make_parameters
from rotorsim.plant.probes import probe_rows

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
        """Columns of the sample table: those of all machines, pins, probes, each of several films."""
        return len(COLUMNS) + self.rig.n_pin + self.rig.n_probe + film_columns(len(self.films), self.rig.n_heat > 0)

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

    @property
    def steps_per_sample(self) -> int:
        """Time steps in one sample."""
        return round(self.sampling_time / self.machine.time_step)

    @cached_property
    def sampling_time(self) -> float:
        """Time [s] between two samples of the machine."""
        return self.machine.sampling_time

    def compile_note(self, *kernels: str) -> str:
        """Sentence on what is compiled before kernels ('settle', 'run') first run and how long; empty if nothing is."""
        if is_compiled(self.module, kernels):
            return ""
        parts, seconds = [], 3.0 + 0.15 * len(self.calls)
        if self.film_model is not None:
            entries = film_entries(len(self.films))
            solver = is_compiled(sys.modules[self.module.newton.__module__], entries)
            parts, seconds = [] if solver else ["film"], seconds + (5.0 if solver else 9.0)
        parts += ["rotor", f"{len(self.calls)} effects"]
        return f"compiling {self.machine.name} ({', '.join(parts)}): about {seconds:.0f} s, once"


def assemble(machine: Machine) -> Assembly:
    """Lay out and fill everything for a machine, and compose its kernels."""
    mesh = Mesh(machine)
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
        mesh.reduced.Phi.shape[1], film, len(effects), len(films), ports["contact"], ports["support"],
        ports["rotating"] > 0, (len(mesh.tables.values), len(mesh.tables.speeds)), len(machine.supported),
    )  # fmt: skip
    calls = _number(machine, effects, rotor)
    rig = _rig(machine, rotor, film.n_inj * len(films), ports, calls)
    w = np.concatenate([w, np.zeros(rig.size - w.size)])
    _fill_rotor(w, rotor, mesh, calls)
    _fill_tables(w, rotor, mesh)
    rows = probe_rows(mesh)
    w[rig.probe : rig.probe + rows.size] = rows.ravel()
    record = make_parameters(machine, mesh, films, film, effects)
    module = compose(film, rotor, rig, calls)
    return Assembly(machine, mesh, films, film, rotor, rig, calls, w, ix, record, module)


def _number(machine: Machine, effects: list[tuple[str, Effect]], rotor: RotorLayout) -> tuple[Call, ...]:
    """Give every effect its place among those of its port, its shape rows, its states and its film."""
    seen: dict[str, int] = {}
    states = {"actuator": 0, "": 0}
    calls = []
    for k, (record, e) in enumerate(effects):
        kind = e.port if e.port == "actuator" else ""
        at = rotor.shapes + 2 * rotor.n * k
        calls.append(Call(e, record, at, states[kind], seen.get(e.port, 0), machine.film_number(e)))
        seen[e.port] = seen.get(e.port, 0) + 1
        states[kind] += e.states
    return tuple(calls)


def _rig(machine: Machine, rotor: RotorLayout, n_inj: int, ports: dict[str, int], calls: tuple[Call, ...]) -> RigLayout:
    driven = int(bool(machine.injectors) and machine.actuators is not None and machine.actuators.mode != "ideal")
    stroke_states = sum(c.effect.states for c in calls if c.effect.port == "actuator")
    states = sum(c.effect.states for c in calls if c.effect.port != "actuator")
    substeps = math.ceil(machine.sampling_time / SUBSTEP - 1e-9)
    return make_rig_layout(
        rotor.size, rotor.n_films, n_inj, len(machine.injectors), driven, substeps, ports,
        stroke_states, states, len(machine.probes), rotor.n_machine,
        sum(c.effect.port == "contact" or type(c.effect).braking is not None for c in calls),
    )  # fmt: skip


def make_films(machine: Machine) -> tuple[FilmModel, ...]:
    """The films of a machine as `reynolds` takes them, all with one kind of grid."""
    gas = machine.gas
    air = FilmGas(gas.mu, gas.ambient_pressure, gas.temperature, gas.R, gas.kappa)
    fed = [_injectors(machine, number) for number in range(len(machine.films))]
    symmetric = all(e.symmetric for es in machine.effects.values() for e in es)
    symmetric = symmetric and all(film.sleeve.symmetric for film in machine.films)
    half = machine.grid.symmetry == "auto" and symmetric and all(i.offset == 0 for one in fed for i in one)
    rarefied = any(e.port == "gas" for es in machine.effects.values() for e in es)
    return tuple(
        FilmModel(
            FilmGrid(film.diameter / 2, film.length, machine.grid.n_theta, machine.grid.n_z, half), film.clearance, air,
            injectors, machine.solver.minimum_film, rarefied, film.sleeve,
        )
        for film, injectors in zip(machine.films, fed, strict=True)
    )  # fmt: skip


def _injectors(machine: Machine, number: int) -> tuple[Injector, ...]:
    """Injectors of a film: those with pins, if they feed it, then its own orifices."""
    common = machine.injection
    pins = () if common is None or number != machine.pinned_film else map(common.nozzle, machine.injectors)
    return (*pins, *(one for row in machine.films[number].orifices for one in row.nozzles))


def _build(films: tuple[FilmModel, ...]) -> tuple[Layout, np.ndarray, np.ndarray]:
    try:
        return build_films(films)
    except ValueError as error:
        raise MachineFileError(f"injectors: {error}; move it inwards or refine the grid") from error


def _no_film() -> tuple[Layout, np.ndarray, np.ndarray]:
    layout = make_layout(FilmGrid(0.02, 0.04, 8, 4), 0, [], [])
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
    rows = [(rotor.disc, mesh.shape(mesh.probe))] + [(c.shape, mesh.influence(c.effect)) for c in calls]
    rows += [(rotor.journal + 2 * n * k, mesh.between(i)) for k, i in enumerate(mesh.machine.film_bearings)]
    for offset, shape in rows:
        _put_rows(w, offset, shape, n)


def _put_rows(w: np.ndarray, offset: int, shape: np.ndarray, n: int) -> None:
    """Write rows (2, m) as (2, n), with zeros behind the m coordinates."""
    w[offset : offset + 2 * n] = np.pad(shape, ((0, 0), (0, n - shape.shape[1]))).ravel()


def _fill_tables(w: np.ndarray, rotor: RotorLayout, mesh: Mesh) -> None:
    """Write the bearings that are tables, all at the same speeds."""
    tables = mesh.tables
    w[rotor.table_speeds : rotor.table_speeds + rotor.n_points] = tables.speeds
    for b, (number, values) in enumerate(tables.values.items()):
        _put_rows(w, rotor.table_rows + 2 * rotor.n * b, mesh.between(number), rotor.n)
        at = rotor.table_values + values.size * b
        w[at : at + values.size] = values.ravel()
