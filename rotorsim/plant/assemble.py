"""Machine -> what the kernels take: layouts, a filled workspace, index array, parameter record, composed module."""

from __future__ import annotations

from dataclasses import dataclass, fields
from types import ModuleType
from typing import Any

import numpy as np

from reynolds.grid import Grid, Layout, make_layout
from reynolds.injector import Injector
from reynolds.workspace import FILM_DTYPE, FilmModel, Gas
from rotorsim.effects import Effect, numeric_fields
from rotorsim.errors import MachineFileError
from rotorsim.machine.numerics import SAMPLE
from rotorsim.machine.schema import Machine
from rotorsim.plant.compose import Call, compose
from rotorsim.plant.mesh import Mesh
from rotorsim.plant.rotor import RotorLayout, make_rotor_layout


@dataclass(frozen=True)
class Assembly:
    """Everything a run needs; `w` is the workspace before any state is put into it."""

    machine: Machine
    mesh: Mesh
    film_model: FilmModel | None
    film: Layout
    rotor: RotorLayout
    calls: tuple[Call, ...]
    w: np.ndarray
    ix: np.ndarray
    record: np.recarray
    module: ModuleType

    @property
    def P(self) -> Any:
        """The parameter record (one row of `record`)."""
        return self.record[0]

    @property
    def steps_per_sample(self) -> int:
        """Time steps in one sample of 5 kHz."""
        return round(SAMPLE / self.machine.solver.time_step)


def assemble(machine: Machine) -> Assembly:
    """Lay out and fill everything for a machine, and compose its kernels."""
    mesh = Mesh(machine)
    film_model = make_film(machine)
    film, w, ix = _no_film() if film_model is None else _build(film_model)
    effects = [(f"{name}_{i}", e) for name, es in machine.effects.items() for i, e in enumerate(es)]
    effects = [(record, e) for record, e in effects if e.port != "contact" or film_model is not None]
    contacts = sum(e.port == "contact" for _, e in effects)
    n = mesh.reduced.Phi.shape[1]
    rotor = make_rotor_layout(n, film.size, film.n_inj, len(effects), film_model is not None, contacts)
    calls = tuple(Call(e, record, rotor.shapes + 2 * n * k) for k, (record, e) in enumerate(effects))
    w = np.concatenate([w, np.zeros(rotor.size - film.size)])
    _fill_rotor(w, rotor, mesh, calls)
    record = _record(machine, film_model, film, effects)
    return Assembly(machine, mesh, film_model, film, rotor, calls, w, ix, record, compose(film, rotor, calls))


def make_film(machine: Machine) -> FilmModel | None:
    """The film part of a machine as `reynolds` takes it."""
    film, gas, common = machine.film, machine.gas, machine.injection
    if film is None:
        return None
    injectors = () if common is None else tuple(
        Injector(
            angle=i.angle, offset=i.offset, law=common.law, pin=common.pin_bias, seat_gap=common.seat_gap,
            minimum_gap=common.minimum_gap, pin_diameter=common.pin_diameter,
            pin_discharge=common.pin_discharge or 0.0, orifice_diameter=common.orifice_diameter,
            curtain_discharge=common.curtain_discharge, plenum_volume=common.plenum_volume,
            polytropic_exponent=common.polytropic_exponent, loss_factor=common.loss_factor or 0.0,
            loss_exponent=common.loss_exponent,
        )
        for i in machine.injectors
    )  # fmt: skip
    half = all(i.offset == 0 for i in injectors)
    grid = Grid(film.diameter / 2, film.length, machine.grid.n_theta, machine.grid.n_z, half)
    air = Gas(gas.viscosity, gas.ambient_pressure, gas.temperature, gas.gas_constant, gas.heat_capacity_ratio)
    return FilmModel(grid, film.clearance, air, injectors, machine.solver.minimum_film)


def _build(model: FilmModel) -> tuple[Layout, np.ndarray, np.ndarray]:
    try:
        return model.build()
    except ValueError as error:
        raise MachineFileError(f"injectors: {error}; move it inwards or refine the grid") from error


def _no_film() -> tuple[Layout, np.ndarray, np.ndarray]:
    layout = make_layout(Grid(0.02, 0.04, 8, 4), 0, [], [])
    return layout, np.zeros(layout.size), np.zeros(8, np.int64)


def _fill_rotor(w: np.ndarray, rotor: RotorLayout, mesh: Mesh, calls: tuple[Call, ...]) -> None:
    reduced = mesh.reduced
    for offset, matrix in ((rotor.K, reduced.K), (rotor.C, reduced.C), (rotor.G, reduced.G)):
        w[offset : offset + rotor.n**2] = matrix.T.ravel()
    film = mesh.machine.film
    if film is not None:
        w[rotor.journal : rotor.journal + 2 * rotor.n] = mesh.shape(film.position).ravel()
    w[rotor.disc : rotor.disc + 2 * rotor.n] = mesh.shape(mesh.probe).ravel()
    for call in calls:
        w[call.shape : call.shape + 2 * rotor.n] = influence(mesh, call.effect).ravel()


def influence(mesh: Mesh, effect: Effect) -> np.ndarray:
    """Rows (2, 2n) through which an effect acts on the modes: a node's, or the whole mass's."""
    return mesh.reduced.body() if effect.influence == "mass" else mesh.shape(mesh.place(effect))


def _record(machine: Machine, film_model: FilmModel | None, film: Layout, effects: list[tuple[str, Effect]]) -> Any:
    n = max(film.n_inj, 1)
    scalars = ("tolerance", "dt", "sample", "seat_gap", "minimum_gap", "open_conductance", "loss_exponent")
    # effects first: then no record is the beginning of another's, which numba would take for a subtype of it
    types: list[Any] = [(record, [(f, "f8") for f in numeric_fields(type(e))]) for record, e in effects]
    types += [(name, "f8") for name in scalars] + [("film", FILM_DTYPE)]
    types += [(name, "f8", (n,)) for name in ("pin_bias", "pin_x", "pin_y")]
    record = np.zeros(1, np.dtype(types)).view(np.recarray)
    row = record[0]
    row.tolerance, row.dt, row.sample = machine.solver.tolerance, machine.solver.time_step, SAMPLE
    if film_model is not None:
        record["film"] = film_model.record()
        _fill_pins(row, machine, film_model)
    for name, effect in effects:
        for field in fields(effect):
            if field.name != "position":
                record[name][field.name] = getattr(effect, field.name)
    return record


def _fill_pins(row: Any, machine: Machine, film_model: FilmModel) -> None:
    common = machine.injection
    if common is None or not film_model.injectors:
        return
    first = film_model.injectors[0]
    row.seat_gap, row.minimum_gap, row.loss_exponent = first.seat_gap, first.minimum_gap, first.loss_exponent
    row.open_conductance = first.conductance(0.0)
    for k, injector in enumerate(machine.injectors):
        sign = {"+": 1.0, "-": -1.0}.get(injector.reference[0], 0.0) * common.pin_per_volt
        row.pin_bias[k] = common.pin_bias
        row.pin_x[k] = sign if injector.reference.endswith("x") else 0.0
        row.pin_y[k] = sign if injector.reference.endswith("y") else 0.0
