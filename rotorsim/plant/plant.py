"""`Plant`: a machine ready for equilibrium, linearisation and time simulation."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from identification import make_record
from rotorsim.base.cache import installed
from rotorsim.base.display import Card, Shown, track
from rotorsim.base.errors import DataError
from rotorsim.base.quantity import whole_samples
from rotorsim.base.units import parse
from rotorsim.machine import load_machine
from rotorsim.machine.limits import check_speed
from rotorsim.machine.schema import Machine
from rotorsim.plant.assemble import Assembly, assemble
from rotorsim.plant.controller import (
    Controller,
    alarms_of,
    as_controller,
    ask,
    check_range,
    plant_system,
    prepare,
    provenance,
)
from rotorsim.plant.kernels.layout import (
    ANGLE_READ,
    COLUMNS,
    DISC_READ,
    FORCE,
    N_INPUTS,
    PRESSURE_READ,
    REFERENCE,
    SPEED,
    SPEED_READ,
    SUPPLY,
)
from rotorsim.plant.locations import probe_coordinates
from rotorsim.plant.simulation import Equilibrium, Simulation, describe, settle, split_columns
from rotorsim.plant.synchronous_orbit import start_on_orbit

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.plant.linearise import LinearPlant, RotorModels

Signal = float | ArrayLike | Callable[[float], Any]
LONGEST = 3600.0
"""Longest run [s] whose record is returned in memory."""
BLOCK = 5000
"""Samples computed at a time: one second."""


class Plant(Shown):
    """A machine ready to run: `Plant("dtu_gas_bearing")`, `Plant(machine, n_theta=64, n_z=16, dt=2e-4)`.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.Plant("dtu_gas_bearing").equilibrium(300.0, 0.5e6).h_min > 0
    True
    """

    def __init__(
        self,
        machine: Machine | str | Path,
        n_theta: int | None = None,
        n_z: int | None = None,
        dt: float | None = None,
    ) -> None:
        machine = machine if isinstance(machine, Machine) else load_machine(machine)
        changes = {
            "grid.n_theta": n_theta,
            "grid.n_z": n_z,
            "solver.time_step": None if dt is None else f"{float(dt)!r} s",
        }
        for path, value in changes.items():
            if value is not None:
                machine = machine.replace(path, value)
        self.machine = machine

    def card(self) -> Card:
        """Machine, grid and step."""
        m = self.machine
        rows = [("film", f"{m.grid.n_theta} x {m.grid.n_z}")] if m.film is not None else []
        rows += [("step", f"{m.time_step * 1e3:g} ms"), ("effects", ", ".join(m.effects) or "none")]
        return Card(f"Plant of {m.name}", rows)

    @cached_property
    def _stated(self) -> dict[str, str]:
        return {"machine": self.machine.text, "machine_hash": self.machine.hash}

    @cached_property
    def assembly(self) -> Assembly:
        """Layouts, workspace and kernels."""
        return assemble(self.machine)

    @cached_property
    def _over_speed(self) -> RotorModels | None:
        """Models over the speed of a rotor that is linear."""
        from rotorsim.plant.linearise import rotor_models  # brings sparse eigenvalues

        return rotor_models(self.assembly)

    def equilibrium(self, speed: float = 0.0, pressure: float = 0.0) -> Equilibrium:
        """Static equilibrium at a speed [rad/s] and gauge pressure [Pa]; raises NoLiftOffError where there is none.

        Examples
        --------
        >>> plant.equilibrium(300.0, 0.5e6).disc.shape
        (2,)
        """
        speed, pressure = point(speed, pressure)
        return describe(self.assembly, settle(self.assembly, speed, pressure))

    def linearise(self, speed: float = 0.0, pressure: float = 0.0, moment: bool = False) -> LinearPlant:
        """Linear model about the equilibrium at a speed [rad/s] and gauge pressure [Pa].

        With `moment` the films resist the tilt of their journals too, which runs in time leave out. Raises FilmError
        for films with pockets or lobes that jump then.

        Examples
        --------
        >>> plant.linearise(300.0, 0.5e6).wn.size > 0
        True
        """
        speed, pressure = point(speed, pressure)
        from rotorsim.plant.linearise import linearise  # brings sparse eigenvalues

        if self._over_speed is not None and speed >= 0 and self.machine.gas.absolute(pressure) >= 0:
            return self._over_speed.at(speed)
        return linearise(self.assembly, self._settled(speed, pressure), speed, moment)

    def _settled(self, speed: float, pressure: float) -> np.ndarray:
        """Workspace in equilibrium at a speed [rad/s] and gauge pressure [Pa]."""
        return settle(self.assembly, speed, pressure)

    def to_control(self, speed: float = 0.0, pressure: float = 0.0, seed: int = 0) -> Any:
        """The nonlinear plant as control.NonlinearIOSystem with a step of one sample, standing at the equilibrium.

        Parameters
        ----------
        speed, pressure : float
            Operating point [rad/s], [Pa, gauge] of `initial`, the states to start from.
        seed : int
            Of the machine's random effects: the sensors' noise, a broadband force, a wandering speed.

        Returns
        -------
        control.NonlinearIOSystem
            Inputs speed [rad/s], supply_pressure [Pa, gauge], reference_x, reference_y [V], disc_force_x,
            disc_force_y [N]; outputs disc_x, disc_y [m]. Each call runs the plant's own step. Give the package
            `system.initial` as the initial state: its own, zero, is refused.

        Examples
        --------
        >>> import control, numpy as np, rotorsim as rs
        >>> system = rs.Plant("dtu_gas_bearing").to_control(300.0, 0.5e6)
        >>> T = np.arange(10) * system.dt
        >>> U = np.tile([[300.0], [0.5e6], [0.5], [0.0], [0.0], [0.0]], len(T))
        >>> control.input_output_response(system, T, U, system.initial).outputs.shape
        (2, 10)
        """
        return plant_system(self.start(*point(speed, pressure), seed))

    def start(self, speed: float = 0.0, pressure: float = 0.0, seed: int = 0, begin: str = "rest") -> Simulation:
        """A simulation that stands at the equilibrium; `seed` (whole, 0 to 2^53 - 1) makes its noise.

        With `begin` "orbit" it moves on the synchronous orbit, if the machine keeps one; see `Simulation.on_orbit`.

        Examples
        --------
        >>> simulation = plant.start(300.0, 0.5e6)
        >>> rows, _ = plant.inputs(0.01, speed=300.0, pressure=0.5e6)
        >>> simulation.advance(rows).shape[0]
        50
        """
        if not 0 <= seed < 2**53 or seed != int(seed):
            raise DataError(f"seed = {seed}: give a whole number from 0 to 2^53 - 1")
        if begin == "orbit":
            return start_on_orbit(self.assembly, *point(speed, pressure), seed)
        return Simulation.at_equilibrium(self.assembly, *point(speed, pressure), seed)

    def simulate(
        self,
        duration: float,
        speed: Signal = 0.0,
        pressure: Signal = 0.0,
        reference: Signal | None = None,
        disc_force: Signal | None = None,
        controller: Controller | Any | None = None,
        seed: int = 0,
        initial: str | Simulation = "equilibrium",
        progress: bool = False,
    ) -> xr.Dataset:
        """Run for `duration` [s] and return the record (see identification.records.schema), sampled as the machine is.

        speed [rad/s] and pressure [Pa, gauge] are numbers, functions of time or arrays over the samples; reference
        [V] and disc_force [N] functions or arrays (n, 2). Between samples the speed is linear and everything else is
        held; a speed of NaN turns the drive off, so that the shaft coasts. A controller sees `disc_measured` of a
        sample and acts on the next; the record then names it, and `reference_external` is the reference without its
        part. It is an object with ``step(measured, speed, pressure)``, a function of these, or a sampled system of the
        package `control`, which is given the displacement from the equilibrium of the first sample. `initial` is
        "equilibrium" or a `Simulation` to continue; a controller's `reset()` is called in the first case only. `seed`
        makes what is random in the machine's effects, mostly the sensors' noise, and nothing else.
        Raises NoLiftOffError, ConvergenceError, DataError, ControllerError.
        """
        if not isinstance(initial, Simulation) and initial != "equilibrium":
            raise DataError(f"initial = {initial!r}: give 'equilibrium' or a Simulation to continue")
        inputs, start = self.inputs(duration, speed, pressure, reference, disc_force)
        if controller is not None:
            controller = as_controller(controller, lambda: self.equilibrium(*start).disc, self.machine.sampling_time)
            prepare(controller, self.machine, continued=isinstance(initial, Simulation))
        simulation = self.start(*start, seed=seed) if isinstance(initial, str) else initial
        begin = simulation.samples
        blocks = list(track(_run(simulation, inputs, controller), len(inputs), self.machine.sampling_time, progress))
        table = np.concatenate([t for t, _ in blocks])
        used = np.concatenate([u for _, u in blocks])
        time = (begin + np.arange(len(table))) * self.machine.sampling_time
        values = split_columns(self.assembly, table, used)
        attrs = self.provenance(seed) | dated()
        if controller is not None:
            attrs |= provenance(controller) | alarms_of(controller)
            values["reference_external"] = inputs[:, REFERENCE]
        return make_record(time, values, attrs, probe_coordinates(self.machine), self.machine.film_names)

    def inputs(
        self,
        duration: float,
        speed: Signal,
        pressure: Signal,
        reference: Signal | None = None,
        disc_force: Signal | None = None,
    ) -> tuple[np.ndarray, tuple[float, float]]:
        """Input rows (n, 6) for `Simulation.advance` and the (speed, pressure) of the first sample."""
        duration = _si("duration", duration, "s")
        Ts = self.machine.sampling_time
        n = round(duration / Ts) if np.isfinite(duration) else -1
        if n < 1:
            fault = "shorter than one sample" if n == 0 else "not a time"
            raise DataError(f"duration = {duration} s: {fault}; give at least {Ts:g} s")
        if duration > LONGEST:
            raise DataError(f"duration = {duration:g} s: at most {LONGEST:g} s fit into memory; run it in parts")
        try:
            whole_samples(duration, Ts)
        except ValueError as error:
            raise DataError(f"duration: {error}") from error
        rows = np.zeros((n, N_INPUTS))
        speed = _si("speed", speed, "rad/s") if isinstance(speed, str) else speed
        pressure = _si("pressure", pressure, "Pa") if isinstance(pressure, str) else pressure
        speeds = _scalars(speed, n + 1, Ts, "speed", True)
        check_speed(self.machine, float(np.nanmax(np.abs(speeds))))
        rows[:, SPEED] = speeds[1:]
        rows[:, SUPPLY] = _scalars(pressure, n, Ts, "pressure")
        self.machine.gas.absolute(float(rows[:, SUPPLY].min()))
        if reference is not None:
            rows[:, REFERENCE] = _pairs(reference, n, Ts, "reference")
        if disc_force is not None:
            rows[:, FORCE] = _pairs(disc_force, n, Ts, "disc_force")
        return rows, (float(speeds[0]), float(rows[0, SUPPLY]))

    def provenance(self, seed: int = 0) -> dict[str, Any]:
        """Attributes of a record: machine text and hash, seed, versions."""
        return {
            **self._stated,
            "seed": seed,
            "rotorsim_version": installed("rotorsim"),
            "numpy_version": installed("numpy"),
            "numba_version": installed("numba"),
            "sample_rate_hz": 1 / self.machine.sampling_time,
        }


def dated() -> dict[str, str]:
    """Attribute `date` of a record that begins now, in UTC: all that differs in two records of one seed."""
    return {"date": datetime.now(UTC).isoformat(timespec="seconds")}


def as_plant(plant: Plant | Machine | str | Path) -> Plant:
    """The plant, made of a machine, a shipped machine's name or a machine file where it is not one yet."""
    if isinstance(plant, Plant):
        return plant
    if isinstance(plant, (Machine, str, Path)):
        return Plant(plant)
    raise DataError(
        f"plant: a {type(plant).__name__} is not one; give a Plant, a machine or its name",
        argument="plant",
        value=plant,
    )


def point(speed: Any, pressure: Any) -> tuple[float, float]:
    """Speed [rad/s] and gauge pressure [Pa] of numbers or of texts with a unit."""
    return _si("speed", speed, "rad/s"), _si("pressure", pressure, "Pa")


def _si(name: str, value: Any, unit: str) -> float:
    """A number in `unit`, or the number of a text with a unit; raises DataError."""
    try:
        return float(value) if hasattr(value, "__float__") else parse(value, unit)
    except (TypeError, ValueError) as error:
        raise DataError(f"{name}: {error}") from error


def _run(
    simulation: Simulation, inputs: np.ndarray, controller: Controller | None
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Blocks of (sample table, inputs used)."""
    if controller is None:
        for i in range(0, len(inputs), BLOCK):
            yield simulation.advance(inputs[i : i + BLOCK]), inputs[i : i + BLOCK]
        return
    reference, actuators = np.zeros(2), simulation.assembly.machine.actuators
    for row in inputs:
        used = row.copy()
        used[REFERENCE] += reference
        if actuators is not None:
            check_range(controller, used[REFERENCE], actuators.reference_limit, simulation.time)
        table = simulation.advance(used[None])
        yield table, used[None]
        time = (simulation.samples - 1) * simulation.assembly.sampling_time
        seen = table[0, DISC_READ], table[0, SPEED_READ], table[0, PRESSURE_READ], table[0, ANGLE_READ]
        reference = ask(controller, *seen, time, used[REFERENCE])


def _scalars(signal: Signal, n: int, Ts: float, name: str, gaps: bool = False) -> np.ndarray:
    """Values (n,) of a signal at the samples; an array may be one shorter than n and then keeps its last value."""
    if callable(signal):
        values = np.array([float(signal(k * Ts)) for k in range(n)])
    else:
        values = np.asarray(signal, float)
        if values.ndim == 0:
            values = np.full(n, float(values))
        elif len(values) == n - 1:
            values = np.append(values, values[-1])
    if gaps and n and np.isfinite(values[0]):
        return np.where(np.isnan(values), np.nan, _checked(np.nan_to_num(values, posinf=np.inf), (n,), name))
    return _checked(values, (n,), name)


def _pairs(signal: Signal, n: int, Ts: float, name: str) -> np.ndarray:
    if callable(signal):
        return _checked(np.array([signal(k * Ts) for k in range(n)], float), (n, 2), name)
    values = np.asarray(signal, float)
    return _checked(np.broadcast_to(values, (n, 2)) if values.shape == (2,) else values, (n, 2), name)


def _checked(values: np.ndarray, shape: tuple[int, ...], name: str) -> np.ndarray:
    if values.shape != shape:
        raise DataError(f"{name}: shape {values.shape}, expected {shape} (one row per sample)")
    if not np.all(np.isfinite(values)):
        raise DataError(f"{name}: holds NaN or infinite values; check the signal")
    return values


def compile_text(text: str) -> float:
    """Compile what a run of the machine with this text calls; returns how long it took [s]."""
    start = time.monotonic()
    compile_kernels(Plant(Machine.from_text(text)))
    return time.monotonic() - start


def compile_kernels(plant: Plant) -> None:
    """Compile what a run of the plant calls, by an equilibrium, whatever its outcome, and a run of no samples.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.compile_kernels(plant)
    """
    a = plant.assembly
    w = a.w.copy()
    a.module.settle(w, a.w, a.ix, a.parameters, 0.0, a.machine.gas.ambient_pressure, False)
    a.module.run(w, a.ix, a.parameters, np.empty((0, N_INPUTS)), np.empty((0, len(COLUMNS))), a.steps_per_sample)
