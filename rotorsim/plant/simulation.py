"""A run in progress: state, inputs in, samples out; can be saved and taken back bit for bit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rotorsim.errors import ConvergenceError
from rotorsim.machine.numerics import SAMPLE
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.equilibrium import settle
from rotorsim.plant.samples import COLUMNS


@dataclass
class Simulation:
    """State of a machine in time. `w` holds everything: copy it to save, write it back to restore."""

    assembly: Assembly
    w: np.ndarray

    @classmethod
    def at_equilibrium(cls, assembly: Assembly, speed: float, pressure: float) -> Simulation:
        """Start at the static equilibrium for a speed [rad/s] and gauge pressure [Pa]."""
        return cls(assembly, settle(assembly, speed, pressure))

    @property
    def samples(self) -> int:
        """Samples done since the start."""
        return round(self.w[self.assembly.rotor.time] / SAMPLE)

    @property
    def columns(self) -> int:
        """Columns of the sample table."""
        return len(COLUMNS) + max(self.assembly.film.n_inj, 0)

    def advance(self, inputs: np.ndarray) -> np.ndarray:
        """Advance by one sample (0.2 ms) per row of inputs; returns the state BEFORE each as (n, columns).

        inputs (n, 6): speed at the sample's end [rad/s], supply pressure [Pa, gauge], reference x, y [V], disc force
        x, y [N]. Raises ConvergenceError with the time, and with the
        samples done in its `where["table"]`, if a step cannot be solved at any size.
        """
        a = self.assembly
        rows = np.array(inputs, float)
        rows[:, 1] += a.machine.gas.ambient_pressure
        out = np.empty((len(rows), self.columns))
        done = a.module.run(self.w, a.ix, a.P, rows, out, a.steps_per_sample)
        if done < len(rows):
            speed = self.w[a.rotor.speed] * 30 / np.pi
            raise ConvergenceError(
                f"plant: no solution of the step at t = {self.samples * SAMPLE:.4f} s, {speed:.0f} rpm; "
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

    def film_pressure(self) -> np.ndarray:
        """Film pressure (n_theta, n_z) [Pa, absolute] now."""
        from reynolds.bearing import interval_pressure

        model = self.assembly.film_model
        assert model is not None
        return interval_pressure(model, self.assembly.film, self.w)

    @property
    def counters(self) -> dict[str, float]:
        """Newton iterations, factorisations and parts of steps so far."""
        from reynolds.newton import FACTORISATIONS, ITERATIONS

        c = self.assembly.film.convergence
        return {
            "iterations": float(self.w[c + ITERATIONS]),
            "factorisations": float(self.w[c + FACTORISATIONS]),
            "substeps": float(self.w[self.assembly.rotor.substeps]),
        }


def split_columns(table: np.ndarray, inputs: np.ndarray, has_film: bool) -> dict[str, Any]:
    """Variables of the record schema from a sample table and the inputs that were held during each sample."""
    at = {name: i for i, name in enumerate(COLUMNS)}

    def pair(name: str) -> np.ndarray:
        return np.ascontiguousarray(table[:, at[f"{name}_x"] : at[f"{name}_y"] + 1])

    disc = pair("disc")
    values: dict[str, Any] = {"disc": disc, "disc_measured": disc, "angle": table[:, at["angle"]]}
    values |= {"speed": table[:, at["speed"]], "disc_force": inputs[:, 4:6]}
    if has_film:
        values |= {name: pair(name) for name in ("journal", "film_force")}
        values |= {name: table[:, at[name]] for name in ("pressure", "h_min", "mass_flow", "contact")}
        values |= {"pin": table[:, len(COLUMNS) :], "reference": inputs[:, 2:4]}
    return values
