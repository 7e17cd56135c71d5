"""Parameter record of the kernels: every number of a machine, in SI units."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from reynolds.grid import Layout
from reynolds.workspace import FILM_DTYPE, FilmModel
from rotorsim.base.constants import SAMPLE
from rotorsim.effects import Effect, numeric_fields
from rotorsim.machine.schema import Machine
from rotorsim.plant.mesh import Mesh

SCALARS = (
    "tolerance", "dt", "sample", "seat_gap", "minimum_gap", "open_conductance", "loss_exponent", "sensitivity",
    "transducer", "volt_low", "volt_high", "controlled", "pd_pole", "inertia", "dry_drag", "viscous_drag", "drive_time",
    "nominal_stiffness",
)  # fmt: skip
PER_INJECTOR = (
    "capacity", "pin_bias", "pin_x", "pin_y", "sign_x", "sign_y", "pd_gain", "pd_zero", "amplifier_lag", "stack_lag",
)  # fmt: skip


def make_parameters(
    machine: Machine, mesh: Mesh, model: FilmModel | None, film: Layout, effects: list[tuple[str, Effect]]
) -> np.recarray:
    """Record array of one row; effects are records of their own inside it."""
    # effects first: then no record is the beginning of another's, which numba would take for a subtype of it
    types: list[Any] = [(record, [(f, "f8") for f in numeric_fields(type(e))]) for record, e in effects]
    types += [(name, "f8") for name in SCALARS] + [("film", FILM_DTYPE)]
    types += [(name, "f8", (max(film.n_inj, 1),)) for name in PER_INJECTOR]
    record = np.zeros(1, np.dtype([t for t in types if t[1]])).view(np.recarray)
    row = record[0]
    row.tolerance, row.dt, row.sample = machine.solver.tolerance, machine.solver.time_step, SAMPLE
    _fill_drive(row, machine, mesh)
    if model is not None:
        record["film"] = model.record()
        assert machine.film is not None
        row.nominal_stiffness = machine.film.nominal_stiffness
        if model.injectors:
            _fill_injectors(row, machine, model)
            _fill_actuators(row, machine)
    for name, effect in effects:
        _fill_effect(record[name], effect, machine)
        if "residual" in effect.extra:
            record[name]["residual"] = mesh.residual_compliance(mesh.place(effect))
    return record


def _fill_effect(record: Any, effect: Effect, machine: Machine) -> None:
    for field in fields(effect):
        if field.name != "position":
            record[field.name] = getattr(effect, field.name)
    for name, value in effect.derived(machine).items():
        record[name] = value


def _fill_drive(row: Any, machine: Machine, mesh: Mesh) -> None:
    drive = machine.drive
    row.inertia = mesh.polar_inertia if drive.inertia is None else drive.inertia
    row.dry_drag, row.viscous_drag, row.drive_time = drive.dry_drag, drive.viscous_drag, drive.speed_recovery_time


def _fill_injectors(row: Any, machine: Machine, model: FilmModel) -> None:
    common, gas = machine.injection, machine.gas
    assert common is not None
    first = model.injectors[0]
    row.seat_gap, row.minimum_gap, row.loss_exponent = first.seat_gap, first.minimum_gap, first.loss_exponent
    row.open_conductance = first.conductance(0.0)
    for k, injector in enumerate(machine.injectors):
        sign = {"+": 1.0, "-": -1.0}.get(injector.reference[0], 0.0)
        row.capacity[k] = common.plenum_volume / (common.polytropic_exponent * gas.gas_constant * gas.temperature)
        row.pin_bias[k] = common.pin_bias
        row.sign_x[k] = sign if injector.reference.endswith("x") else 0.0
        row.sign_y[k] = sign if injector.reference.endswith("y") else 0.0
        row.pin_x[k] = row.sign_x[k] * common.pin_per_volt
        row.pin_y[k] = row.sign_y[k] * common.pin_per_volt


def _fill_actuators(row: Any, machine: Machine) -> None:
    actuators = machine.actuators
    if actuators is None:
        return
    row.sensitivity, row.transducer = actuators.sensitivity, actuators.sensor_sensitivity
    row.controlled = float(actuators.mode == "reference")
    row.volt_low, row.volt_high, row.pd_pole = actuators.lowest, actuators.highest, actuators.pd_pole
    for k, injector in enumerate(machine.injectors):
        row.pd_gain[k], row.pd_zero[k] = injector.pd_gain or 0.0, injector.pd_zero or 0.0
        for name in ("amplifier_lag", "stack_lag"):
            own = getattr(injector, name)
            getattr(row, name)[k] = getattr(actuators, name) if own is None else own
