"""Parameter record of the kernels: every number of a machine in SI units, each name next to its value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from reynolds.grid import Layout
from reynolds.injector import Injector as Nozzle
from reynolds.workspace import FILM_DTYPE, FilmModel
from rotorsim.effects import Effect, numeric_fields
from rotorsim.effects.base import WHERE
from rotorsim.machine.gas_film import Injector
from rotorsim.machine.schema import Machine
from rotorsim.plant.mesh import Mesh

WITHOUT_FILM = 1e-11
"""Motion [m] left in forces that depend on it where there is no film to compare with."""


def make_parameters(
    machine: Machine, mesh: Mesh, films: Sequence[FilmModel], film: Layout, effects: list[tuple[str, Effect]]
) -> np.recarray:
    """Record array of one row; effects are records of their own inside it, numbers of injectors are arrays."""
    numbers, nozzles = machine_numbers(machine, mesh, films), _nozzles(machine, films, film.n_inj)
    # effects first: then no record is the beginning of another's, which numba would take for a subtype of it
    types: list[Any] = [(record, [(f, "f8") for f in numeric_fields(type(e))]) for record, e in effects]
    count = max(len(films), 1)
    types += [(name, "f8") for name in numbers] + [(f"film_{k}", FILM_DTYPE) for k in range(count)]
    types += [("nominal_stiffness", "f8", (count,))] + [(name, "f8", values.shape) for name, values in nozzles.items()]
    record = np.zeros(1, np.dtype([t for t in types if t[1]])).view(np.recarray)
    for name, value in (numbers | nozzles).items():
        record[name] = value
    for k, model in enumerate(films):
        record[f"film_{k}"] = model.record()
        record["nominal_stiffness"][0, k] = machine.films[k].nominal_stiffness
    for name, effect in effects:
        for field, value in effect_numbers(effect, machine, mesh).items():
            record[name][field] = value
    return record


def machine_numbers(machine: Machine, mesh: Mesh, films: Sequence[FilmModel]) -> dict[str, float]:
    """Numbers that a machine has once: solver, actuators (zero where no pin is driven by one), drive."""
    solver, drive, piezos = machine.solver, machine.drive, machine.actuators if machine.injectors else None
    return {
        "tolerance": solver.tolerance,
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


def nozzle_numbers(machine: Machine, nozzle: Nozzle, pin: Injector | None) -> dict[str, float]:
    """Numbers of an injector or orifice of a film; those of the pin are zero without one."""
    gas, common, piezos = machine.gas, machine.injection, machine.actuators
    along_x, along_y = (0.0, 0.0) if pin is None else pin.signs
    travel = 0.0 if pin is None or common is None else common.pin_per_volt
    driven = pin is not None and piezos is not None

    def lag(name: str) -> float:
        own = getattr(pin, name, None)
        return getattr(piezos, name) if own is None else own

    return {
        "capacity": nozzle.plenum_volume / (nozzle.polytropic_exponent * gas.R * gas.temperature),
        "pinned": float(pin is not None),
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
    names = nozzle_numbers(machine, Nozzle(0.0), None)
    found = {name: np.zeros(max(max(len(films), 1) * most, 1)) for name in names}
    for f, model in enumerate(films):
        pins = machine.injectors if f == machine.pinned_film else ()
        for k, nozzle in enumerate(model.injectors):
            numbers = nozzle_numbers(machine, nozzle, pins[k] if k < len(pins) else None)
            for name, value in numbers.items():
                found[name][f * most + k] = value
    return found


def effect_numbers(effect: Effect, machine: Machine, mesh: Mesh) -> dict[str, float]:
    """Parameters of an effect that its kernel sees, and the numbers that follow from machine and rotor."""
    found = {field.name: getattr(effect, field.name) for field in fields(effect) if field.name not in WHERE}
    found |= effect.derived(machine)
    if "residual" in effect.extra:
        found["residual"] = mesh.residual_compliance(mesh.place(effect))
    return found
