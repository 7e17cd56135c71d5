"""Execution of an experiment on a plant, in memory or streamed to a file with identical bits.

Both take blocks of samples from the same iterator, so a record of hours needs the memory of one block. A feedback loop
acts one sample later, and its total reference is limited to the actuators' range.

A run ends at a limit of its machine; its record states which checked range of the film model it exceeds.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from identification import make_record
from rotorsim.base.display import track
from rotorsim.base.errors import ControllerError, ConvergenceError, DataError, LimitError
from rotorsim.base.files import WriteError
from rotorsim.base.interrupt import Interrupt, asked
from rotorsim.base.units import RIG_SAMPLE, TO_RPM
from rotorsim.experiments.experiment import Experiment, ask_speeds, check_seed, fastest, reference_range
from rotorsim.experiments.recording import FEWEST, Recording
from rotorsim.machine.checks import SAME_PLACE
from rotorsim.machine.limits import at_speed, check_speed, first_passed, limits_of
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.controller import alarms_of, as_controller, ask, call
from rotorsim.plant.kernels.layout import COLUMNS, HEAT_COLUMNS
from rotorsim.plant.locations import probe_coordinates, probe_rows
from rotorsim.plant.plant import BLOCK, LONGEST as LONGEST_IN_MEMORY, Plant, as_plant, dated
from rotorsim.plant.simulation import Simulation, describe, split_columns
from rotorsim.plant.validity import beyond, choked_share

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.machine import Machine
    from rotorsim.plant.controller import Controller

BEYOND = "beyond_checked_range"
"""Attribute of a record whose run exceeds the range in which the model was checked."""
FAST = "passed_too_fast"
"""Attribute of a record whose run passes a critical speed too fast for the steady response."""
SPEED = COLUMNS.index("speed")


def passed(a: Assembly, table: np.ndarray) -> tuple[int, str] | None:
    """First sample of a sample table beyond a limit, and the sentence; None if there is none."""
    warm = HEAT_COLUMNS * len(a.films) if a.rig.n_heat else 0
    return first_passed(a.machine, table[:, SPEED], table[:, a.columns - warm : a.columns] if warm else None)


def choked(simulation: Simulation) -> str:
    """Why a run ends where a simulation stands: too many feed holes are choked; empty if they are not."""
    a = simulation.assembly
    limit = limits_of(a.machine).choked_feeds
    for k, name in enumerate(a.machine.film_names if limit is not None else ()):
        share = choked_share(simulation, k)
        if limit is not None and share > limit:
            what = f"{100 * share:.0f} % of the feed holes of {name} are choked where they enter the film"
            what += f", above limits.choked_feeds {100 * limit:g} %"
            return at_speed(float(simulation.w[a.rotor.speed]), what)
    return ""


def cut(record: xr.Dataset, a: Assembly) -> xr.Dataset:
    """A record up to where its run passed a limit of the machine; raises LimitError if it began beyond one.

    With the attributes `ended` and, where the run exceeds it, about the range in which the model was checked.
    """
    rises = (
        record["temperature_rise"].values.reshape(record.sizes["time"], -1) if "temperature_rise" in record else None
    )
    found = first_passed(a.machine, record["speed"].values, rises)
    if found is not None:
        if found[0] < FEWEST:
            raise LimitError(f"the run {found[1]}; begin lower or raise it", argument="limits", value=found[1])
        record = record.isel(time=slice(found[0]))
    pressures = record["pressure"].values if "pressure" in record else 0.0
    ended = {"ended": "complete" if found is None else found[1]}
    return record.assign_attrs(ended | beyond_attrs(a, record["speed"].values, pressures))


def check_begin(simulation: Simulation) -> None:
    """Raise LimitError if a run would begin beyond a limit."""
    a = simulation.assembly
    row = np.zeros((1, a.columns))
    row[0, SPEED] = simulation.w[a.rotor.speed]
    if a.rig.n_heat:
        warm = HEAT_COLUMNS * len(a.films)
        row[0, a.columns - warm :] = simulation.w[a.rig.heat : a.rig.heat + warm]
    found = passed(a, row)
    sentence = found[1] if found else choked(simulation)
    if sentence:
        what = sentence.partition(": ")[2]
        speed = float(simulation.w[a.rotor.speed]) * TO_RPM
        raise LimitError(
            f"the run would begin beyond a limit, at {speed:.0f} rpm: {what}; begin lower or raise it",
            argument="limits",
            value=sentence,
        )


def extremes(speeds: np.ndarray, more: np.ndarray) -> np.ndarray:
    """Lowest and highest size (2,) of speeds and of more of them; empty while there are none."""
    size = np.abs(np.concatenate([speeds, more]))
    return np.array([size.min(), size.max()]) if size.size else size


def beyond_attrs(a: Assembly, speeds: np.ndarray, pressures: np.ndarray | float) -> dict[str, Any]:
    """Attribute about the range that a run with these speeds [rad/s] and gauge pressures [Pa] exceeds, if it does."""
    tabled = any(bearing.speeds.size for bearing in a.machine.bearings)
    if not speeds.size or (not a.films and not tabled and a.machine.checked is None):
        return {}
    slowest, fastest = extremes(np.zeros(0), speeds)
    ends = sorted({float(np.min(pressures)), float(np.max(pressures))})
    found = [text for pressure in ends for text in beyond(a, float(slowest), float(fastest), pressure)]
    return {BEYOND: "\n".join(dict.fromkeys(found))} if found else {}


def sentences(attrs: Mapping[str, Any]) -> list[str]:
    """Sentences about the range that a record's run exceeds."""
    return str(attrs.get(BEYOND, "")).splitlines()


def warnings_of(record: xr.Dataset) -> dict[str, Any]:
    """Part of a summary: the sentences on the checked range, and that on a critical speed passed too fast, if any."""
    found: dict[str, Any] = {BEYOND: sentences(record.attrs), FAST: str(record.attrs.get(FAST, ""))}
    return {name: value for name, value in found.items() if value}


SNAPSHOTS = 6
"""Film pressures kept of a streamed run, evenly spaced over it."""
PIECE = 250
"""Samples between two looks for Ctrl-C, on the finest grids seconds of computing, and for choked feed holes."""
Values = dict[str, np.ndarray]
Failure = ConvergenceError | ControllerError | LimitError


@dataclass(frozen=True)
class Outcome:
    """Outcome of a streamed run: samples kept of those asked for, why it ended, numbers of the solver.

    `error` is the disk's, where that ended the record; `Ts` [s] the sampling time.
    """

    samples: int
    asked: int
    ended: str
    counters: dict[str, float]
    error: WriteError | None = None
    Ts: float = RIG_SAMPLE

    @property
    def complete(self) -> bool:
        """Whether everything asked for was simulated."""
        return self.ended == "complete"


def run(
    plant: Plant | Machine | str | Path,
    experiment: Experiment,
    seed: int = 0,
    progress: bool = False,
    block: int = BLOCK,
) -> xr.Dataset:
    """Run an experiment and return its record.

    Parameters
    ----------
    plant : Plant, machine or name
        The machine.
    experiment : Experiment
        What to do with it.
    seed : int
        Of the plant's noise; what an experiment draws has its own `sequence`.
    progress : bool
        Show a bar on a terminal.
    block : int
        Samples computed at a time; the record does not depend on it.

    Returns
    -------
    Dataset
        Record of the schema (identification.records.schema) with the experiment's parameters as attributes.

    Raises
    ------
    DataError, NoLiftOffError, ConvergenceError, ControllerError
    LimitError
        If it begins beyond a limit of the machine; where one is reached later, the record ends there with the
        sentence in its attribute `ended`.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.run(plant, rs.experiments.Steady(speed=300.0, pressure=0.5e6, duration=0.1)).sizes["time"]
    500
    """
    plant = as_plant(plant)
    experiment = as_experiment(experiment, plant)
    if experiment.samples * experiment.Ts > LONGEST_IN_MEMORY:
        raise DataError(
            f"{experiment.name}: {experiment.samples * experiment.Ts:g} s are more than the {LONGEST_IN_MEMORY:g} s "
            "that are returned in memory; make it shorter or record it to a file",
            argument="duration",
            value=experiment.samples * experiment.Ts,
        )
    simulation = begin(plant, experiment, seed)
    blocks, ended = [], "complete"
    try:
        for part in track(march(simulation, experiment, block), experiment.samples, experiment.Ts, progress):
            blocks.append(part)
    except LimitError as error:
        ended = str(error)
    values = {name: np.concatenate([part[name] for _, part in blocks]) for name in blocks[0][1]}
    time = np.concatenate([time for time, _ in blocks])
    if len(time) < FEWEST:
        raise LimitError(f"{experiment.name}: {ended}; too little was simulated to keep")
    attrs = plant.provenance(seed) | _attrs(plant, experiment) | {"ended": ended}
    attrs |= end_attrs(simulation, experiment, values["speed"])
    return make_record(time, values, attrs, probe_coordinates(plant.machine), plant.machine.film_names)


def record(
    plant: Plant | Machine | str | Path,
    experiment: Experiment,
    path: str | Path,
    seed: int = 0,
    progress: bool = False,
    block: int = BLOCK,
) -> Outcome:
    """Run as `run` and stream to the NetCDF file `path`, with film pressures at `SNAPSHOTS` instants.

    An interruption (Ctrl-C), a limit of the machine, a step without solution or a disk that takes no more ends the run
    and keeps what was simulated, the last as far as it fits. Raises WriteError if nothing could be kept.

    Examples
    --------
    >>> import rotorsim as rs
    >>> outcome = rs.record(plant, rs.experiments.Steady(speed=300.0, pressure=0.5e6, duration=0.1), "long.nc")
    >>> outcome.ended
    'complete'
    """
    plant, path = as_plant(plant), Path(path)
    experiment = as_experiment(experiment, plant)
    attrs = plant.provenance(check_seed(seed)) | _attrs(plant, experiment) | {"ended": "unfinished"}
    simulation = begin(plant, experiment, seed)
    coordinates = probe_coordinates(plant.machine), plant.machine.film_names
    with Interrupt(), Recording(path, attrs, *coordinates) as file:
        outcome = stream(simulation, experiment, file, progress, block)
    if file.stopped is None:
        return outcome
    return replace(outcome, samples=file.samples, ended=file.stopped.reason, error=file.stopped)


def as_experiment(given: Experiment, plant: Plant) -> Experiment:
    """The experiment at a plant's sampling time; raises DataError for a name, a class or anything else."""
    if isinstance(given, Experiment):
        return given.sampled(plant.machine.sampling_time)
    raise DataError(
        f"experiment: {given if isinstance(given, type) else repr(given)[:60]} is not one; give e.g. "
        "rs.experiments.Impact(peak=20.0), or call rs.experiments.impact(plant, peak=20.0)"
    )


class Sink(Protocol):
    """Destination of a run's samples: a growing file or memory."""

    samples: int

    def write(self, time: np.ndarray, values: Values) -> None:
        """Append samples."""

    def snapshot(self, time: float, speed: float, theta: np.ndarray, z: np.ndarray, pressure: np.ndarray) -> None:
        """Keep the film pressure of one instant, as `Simulation.film_snapshot` gives it."""

    def note(self, **attrs: Any) -> None:
        """Add attributes."""


def stream(
    simulation: Simulation, experiment: Experiment, file: Sink, progress: bool = False, block: int = BLOCK
) -> Outcome:
    """Run from where the experiment begins as `record` does, into anything that takes samples."""
    wanted, ended, speeds = experiment.samples, "complete", np.zeros(0)
    marks = set(np.linspace(0, wanted, SNAPSHOTS)[:-1].astype(int) // block)
    _snapshot(file, simulation)
    blocks = enumerate(track(march(simulation, experiment, block), wanted, experiment.Ts, progress), start=1)
    try:
        for number, (time, values) in blocks:
            speeds = extremes(speeds, values["speed"])
            file.write(time, values)
            if asked() and file.samples < wanted:
                raise KeyboardInterrupt
            if number in marks:
                _snapshot(file, simulation)
    except KeyboardInterrupt:
        ended = "interrupted"
    except ControllerError as error:
        file.note(ended=str(error))
        raise
    except (ConvergenceError, LimitError, WriteError) as error:
        ended = error.reason if isinstance(error, WriteError) else str(error)
    if file.samples:
        _snapshot(file, simulation)
    file.note(ended=ended, **end_attrs(simulation, experiment, speeds))
    return Outcome(file.samples, wanted, ended, simulation.counters, Ts=experiment.Ts)


def end_attrs(simulation: Simulation, experiment: Experiment, speeds: np.ndarray) -> dict[str, Any]:
    """Attributes of a record that follow from the run: the solver's, bounds that were passed, a controller's alarms."""
    found = simulation.counters | beyond_attrs(simulation.assembly, speeds, experiment.initial()[1])
    if getattr(experiment, "begin", "rest") == "orbit":
        found["began_on_orbit"] = int(simulation.on_orbit)
    controller = getattr(experiment, "controller", None)
    return found if controller is None else found | alarms_of(controller)


def _attrs(plant: Plant, experiment: Experiment) -> dict[str, Any]:
    """Date of a run and attributes of its experiment; without a place of the force that is the disc's and a pressure
    that no bearing is fed with."""
    found = dated() | experiment.attrs()
    if not plant.machine.fed:
        found.pop("pressure", None)
    if abs(found.get("force_position", np.nan) - plant.assembly.mesh.probe) < SAME_PLACE:
        del found["force_position"]
    return found


def begun(plant: Plant, experiment: Experiment, point: tuple[float, float], seed: int) -> Simulation:
    """The plant at a speed [rad/s] and gauge pressure [Pa], in the motion with which the experiment begins."""
    return plant.start(*point, seed=check_seed(seed), begin=getattr(experiment, "begin", "rest"))


def begin(plant: Plant, experiment: Experiment, seed: int) -> Simulation:
    """The plant in the motion with which the experiment begins."""
    if experiment.drives_reference and not plant.machine.injectors:
        raise DataError(
            f"{experiment.name}: {plant.machine.name} has no gas film whose actuators a reference could move; "
            "take impact, steady or runup",
            argument="machine",
            value=plant.machine.name,
        )
    if experiment.samples < FEWEST:
        raise DataError(
            f"{experiment.name}: lasts a single sample of {experiment.Ts * 1e3:g} ms; make it at least twice as long"
        )
    ask_speeds(plant.machine, experiment)
    check_speed(plant.machine, fastest(experiment))
    speed, pressure = experiment.initial()
    simulation = begun(plant, experiment, (speed, pressure), seed)
    if (position := getattr(experiment, "position", None)) is not None:
        simulation.strike_at(position)
    if experiment.shakes:
        check_shaken(plant.machine)
        simulation.shake_base()
    simulation.torques = self_acting(plant.machine)
    check_begin(simulation)
    if (controller := getattr(experiment, "controller", None)) is not None:
        call(controller, "check_machine", plant.machine.name)
    return simulation


def self_acting(machine: Machine) -> bool:
    """Whether films without a supply carry a shaft that has sleeves to rest on: friction is what is asked for then."""
    return bool(machine.films) and not machine.fed and "contact" in machine.effects


def check_shaken(machine: Machine) -> None:
    """Refuse a pedestal of an effect, whose mass the base would shake too."""
    if any(getattr(one, "mass_ratio", 0) for one in machine.effects.get("pedestal", ())):
        raise DataError(
            "shock: [effects.pedestal] does not feel the base; write a `support` of the bearing in its place",
            argument="machine",
            value=machine.name,
        )


def march(simulation: Simulation, experiment: Experiment, block: int = BLOCK) -> Iterator[tuple[np.ndarray, Values]]:
    """Blocks of time (n,) [s] and variables of the schema; an error of solver, controller or limit comes last."""
    loop, controller = None, getattr(experiment, "controller", None)
    if controller is not None:
        given = as_controller(controller, lambda: describe(simulation.assembly, simulation.w).disc, experiment.Ts)
        loop = FeedbackLoop(given, experiment.Ts)
    for first in range(0, experiment.samples, block):
        rows = experiment.rows(first, min(block, experiment.samples - first))
        before = simulation.save()
        table, used, failure = _advance(simulation, loop, rows)
        time, values = _values(simulation, first, table, used, None if loop is None else rows)
        if experiment.shakes:
            values |= _of_base(simulation.assembly, experiment, time, values)
        last = None if failure else experiment.end(values["speed"])
        limit = passed(simulation.assembly, table)
        if limit is not None and (last is None or limit[0] < last):
            last, failure = limit[0], LimitError(limit[1])
        if last is not None:
            simulation.restore(before)
            simulation.advance(used[:last])
            time, values = time[:last], {name: value[:last] for name, value in values.items()}
        if len(time) or not first:
            yield time, values
        if failure:
            raise failure
        if last is not None:
            return


def _advance(
    simulation: Simulation, loop: FeedbackLoop | None, rows: np.ndarray
) -> tuple[np.ndarray, np.ndarray, Failure | None]:
    """Sample table, rows applied and what went wrong, up to there or up to a Ctrl-C that was noted."""
    parts: list[tuple[np.ndarray, np.ndarray]] = []
    failure: Failure | None = None
    cuts = range(PIECE - simulation.samples % PIECE, len(rows), PIECE)  # whatever the block
    for piece in np.split(rows, cuts):
        try:
            parts.append((simulation.advance(piece), piece) if loop is None else loop.advance(simulation, piece))
        except (ConvergenceError, ControllerError) as error:
            parts.append((error.where["table"], error.where.get("rows", piece)))
            failure = error
        if failure is None and simulation.samples % PIECE == 0 and (sentence := choked(simulation)):
            failure = LimitError(sentence)
        if failure or asked():
            break
    tables, used = zip(*parts, strict=True)
    return np.concatenate(tables), np.concatenate(used), failure


def _values(
    simulation: Simulation, first: int, table: np.ndarray, used: np.ndarray, external: np.ndarray | None
) -> tuple[np.ndarray, Values]:
    n = len(table)
    values: dict[str, Any] = split_columns(simulation.assembly, table, used[:n])
    if external is not None:
        values["reference_external"] = external[:n, 2:4]
    return (first + np.arange(n)) * simulation.assembly.sampling_time, values


def _of_base(a: Assembly, experiment: Experiment, time: np.ndarray, values: Values) -> Values:
    """The base's acceleration, no force on the disc, and readings of probes with the motion of the base."""
    found = {"base_acceleration": values["disc_force"], "disc_force": np.zeros_like(values["disc_force"])}
    if a.machine.probes:
        factors = probe_rows(a.mesh)[:, -6:]
        motion = np.hstack([*experiment.base_motion(time), values["disc_force"]])
        found["probe_measured"] = values["probe_measured"] + motion @ factors.T
    return found


def _snapshot(file: Sink, simulation: Simulation) -> None:
    if simulation.assembly.film_model is None:
        return
    speed = float(simulation.w[simulation.assembly.rotor.speed])
    file.snapshot(simulation.time, speed, *simulation.film_snapshot())


class FeedbackLoop:
    """The running loop: what the controller saw in a sample acts in the next one, added to the external reference."""

    def __init__(self, controller: Controller, Ts: float) -> None:
        self.controller = controller
        self.output = np.zeros(2)
        call(controller, "check_sampling", Ts)
        call(controller, "reset")

    def advance(self, simulation: Simulation, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sample table and the input rows really applied, for rows whose reference is the external one.

        A ConvergenceError or ControllerError carries both, up to the failure, in `where["table"]` and `where["rows"]`.
        """
        used = rows.copy()
        tables: list[np.ndarray] = []
        limit = reference_range(simulation.assembly.machine)
        for k in range(len(rows)):
            used[k, 2:4] = np.clip(rows[k, 2:4] + self.output, -limit, limit)
            try:
                tables.append(simulation.advance(used[k : k + 1]))
            except ConvergenceError as error:
                done = np.concatenate([*tables, error.where["table"]])
                raise ConvergenceError(str(error), table=done, rows=used[:k]) from error
            try:
                self.output = self._ask(simulation, tables[-1], used[k])
            except ControllerError as error:
                raise ControllerError(str(error), table=np.concatenate(tables), rows=used[: k + 1]) from error
        return np.concatenate(tables), used

    def _ask(self, simulation: Simulation, table: np.ndarray, row: np.ndarray) -> np.ndarray:
        seen: dict[str, Any] = split_columns(simulation.assembly, table, row[None])
        speed = seen.get("speed_measured", seen["speed"])[0]
        pressure = seen.get("pressure_measured", seen.get("pressure", row[1:2]))[0]
        angle = seen.get("angle_measured", seen["angle"])[0]
        time = (simulation.samples - 1) * simulation.assembly.sampling_time
        return ask(self.controller, seen["disc_measured"][0], float(speed), float(pressure), angle, time, row[2:4])
