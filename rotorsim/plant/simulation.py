"""Simulation state: inputs in, samples out; saved and restored bit for bit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from reynolds.newton import FACTORISATIONS, ITERATIONS
from reynolds.workspace import interval_pressure
from rotorsim.base.display import Card, Shown
from rotorsim.base.errors import ConvergenceError, DataError
from rotorsim.base.units import TO_RPM
from rotorsim.plant.assemble import Assembly, put_rows
from rotorsim.plant.equilibrium import settle
from rotorsim.plant.kernels.layout import AT, COLUMNS, FILM_COLUMNS, FORCE, HEAT_COLUMNS, REFERENCE, SUPPLY

FINITE = ("supply pressure", "reference x", "reference y", "disc force x", "disc force y")
"""Inputs after the first, the speed, where NaN means that the drive is off."""


@dataclass(repr=False)
class Simulation(Shown):
    """State of a machine in time. `w` holds everything: copy it to save, write it back to restore."""

    assembly: Assembly
    w: np.ndarray

    @classmethod
    def at_equilibrium(cls, assembly: Assembly, speed: float, pressure: float, seed: int = 0) -> Simulation:
        """Start at the static equilibrium for a speed [rad/s] and gauge pressure [Pa]; `seed` makes the noise."""
        w = settle(assembly, speed, pressure)
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
        return self.assembly.columns

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

    def advance(self, inputs: np.ndarray) -> np.ndarray:
        """Advance by one sample per row of inputs; returns the state BEFORE each as (n, columns).

        inputs (n, 6): speed at the sample's end [rad/s] (NaN: the drive is off), supply pressure [Pa, gauge], reference
        x, y [V], disc force x, y [N]. Raises DataError for inputs that are not finite, and ConvergenceError with
        the time, and with the samples done in its `where["table"]`, if a step cannot be solved at any size.
        """
        a = self.assembly
        rows = np.array(inputs, float)
        _check_inputs(a, rows)
        rows[:, SUPPLY] += a.machine.gas.ambient_pressure
        out = np.zeros((len(rows), self.columns))
        done = a.module.run(self.w, a.ix, a.parameters, rows, out, a.steps_per_sample)
        if done < len(rows):
            speed = self.w[a.rotor.speed] * TO_RPM
            raise ConvergenceError(
                f"plant: no solution of the step at t = {self.time:.4f} s, {speed:.0f} rpm; "
                "take a smaller solver.time_step or a finer grid",
                table=out[:done],
            )
        return out

    def save(self) -> np.ndarray:
        """Everything about the state."""
        return self.w.copy()

    def restore(self, saved: np.ndarray) -> None:
        """Take back a saved state."""
        self.w[:] = saved

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
        """Newton iterations, factorisations and parts of steps so far."""
        a = self.assembly
        parts = [a.film_part(self.w, k)[a.film.convergence :][:8] for k in range(max(len(a.films), 1))]
        counts = np.sum(parts, axis=0)
        return {
            "iterations": float(counts[ITERATIONS]),
            "factorisations": float(counts[FACTORISATIONS]),
            "substeps": float(self.w[self.assembly.rotor.substeps]),
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
