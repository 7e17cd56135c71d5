"""Parameter record of the kernels: every number of a machine, in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from reynolds.grid import Layout
from reynolds.workspace import FILM_DTYPE, FilmModel
from rotorsim.effects import Effect, numeric_fields
from rotorsim.effects.base import WHERE
from rotorsim.machine.schema import Machine
from rotorsim.plant.mesh import Mesh

SCALARS = (
    "tolerance", "motion_tolerance", "dt", "sample", "sensitivity",
    "transducer", "volt_low", "volt_high", "controlled", "pd_pole", "inertia", "dry_drag", "viscous_drag", "drive_time",
    "drive_torque",
)  # fmt: skip
PER_INJECTOR = (
    "capacity", "pinned", "seat_gap", "minimum_gap", "open_conductance", "loss_exponent", "pin_bias", "pin_x", "pin_y",
    "sign_x", "sign_y", "pd_gain", "pd_zero", "amplifier_lag", "stack_lag",
)  # fmt: skip
WITHOUT_FILM = 1e-11
"""Motion [m] left in forces that depend on it where there is no film to compare with."""


def make_parameters(
    machine: Machine, mesh: Mesh, films: Sequence[FilmModel], film: Layout, effects: list[tuple[str, Effect]]
) -> np.recarray:
    """Record array of one row; effects are records of their own inside it."""
    # effects first: then no record is the beginning of another's, which numba would take for a subtype of it
    types: list[Any] = [(record, [(f, "f8") for f in numeric_fields(type(e))]) for record, e in effects]
    count = max(len(films), 1)
    types += [(name, "f8") for name in SCALARS] + [(f"film_{k}", FILM_DTYPE) for k in range(count)]
    types += [("nominal_stiffness", "f8", (count,))]
    types += [(name, "f8", (max(count * film.n_inj, 1),)) for name in PER_INJECTOR]
    record = np.zeros(1, np.dtype([t for t in types if t[1]])).view(np.recarray)
    row = record[0]
    row.tolerance, row.dt, row.sample = machine.solver.tolerance, machine.time_step, machine.sampling_time
    row.motion_tolerance = machine.solver.tolerance * min(f.clearance for f in films) if films else WITHOUT_FILM
    _fill_drive(row, machine, mesh)
    for k, model in enumerate(films):
        record[f"film_{k}"] = model.record()
        row.nominal_stiffness[k] = machine.films[k].nominal_stiffness
        _fill_injectors(row, machine, model, k * film.n_inj)
    if machine.injectors:
        assert machine.pinned_film is not None
        _fill_pins(row, machine, machine.pinned_film * film.n_inj)
    for name, effect in effects:
        _fill_effect(record[name], effect, machine)
        if "residual" in effect.extra:
            record[name]["residual"] = mesh.residual_compliance(mesh.place(effect))
    return record


def _fill_effect(record: Any, effect: Effect, machine: Machine) -> None:
    for field in fields(effect):
        if field.name not in WHERE:
            record[field.name] = getattr(effect, field.name)
    for name, value in effect.derived(machine).items():
        record[name] = value


def _fill_drive(row: Any, machine: Machine, mesh: Mesh) -> None:
    drive = machine.drive
    row.inertia = mesh.polar_inertia if drive.inertia is None else drive.inertia
    row.dry_drag, row.viscous_drag, row.drive_time = drive.dry_drag, drive.viscous_drag, drive.speed_recovery_time


def _fill_injectors(row: Any, machine: Machine, model: FilmModel, first: int) -> None:
    """What all injectors of a film have; their numbers begin with `first`."""
    gas = machine.gas
    for k, injector in enumerate(model.injectors, first):
        volume = injector.plenum_volume / (injector.polytropic_exponent * gas.R * gas.temperature)
        row.capacity[k], row.loss_exponent[k] = volume, injector.loss_exponent
        row.open_conductance[k] = injector.conductance(0.0)


def _fill_pins(row: Any, machine: Machine, first: int) -> None:
    """Pins and what drives them."""
    common = machine.injection
    assert common is not None
    for k, injector in enumerate(machine.injectors, first):
        sign = {"+": 1.0, "-": -1.0}.get(injector.reference[0], 0.0)
        row.pinned[k], row.seat_gap[k], row.minimum_gap[k] = 1.0, common.seat_gap, common.minimum_gap
        row.pin_bias[k] = common.pin_bias
        row.sign_x[k] = sign if injector.reference.endswith("x") else 0.0
        row.sign_y[k] = sign if injector.reference.endswith("y") else 0.0
        row.pin_x[k] = row.sign_x[k] * common.pin_per_volt
        row.pin_y[k] = row.sign_y[k] * common.pin_per_volt
    _fill_actuators(row, machine, first)


def _fill_actuators(row: Any, machine: Machine, first: int) -> None:
    actuators = machine.actuators
    if actuators is None:
        return
    row.sensitivity, row.transducer = actuators.sensitivity, actuators.sensor_sensitivity
    row.controlled = float(actuators.mode == "reference")
    row.volt_low, row.volt_high, row.pd_pole = actuators.lowest, actuators.highest, actuators.pd_pole
    for k, injector in enumerate(machine.injectors, first):
        row.pd_gain[k], row.pd_zero[k] = injector.pd_gain or 0.0, injector.pd_zero or 0.0
        for name in ("amplifier_lag", "stack_lag"):
            own = getattr(injector, name)
            getattr(row, name)[k] = getattr(actuators, name) if own is None else own
