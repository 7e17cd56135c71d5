"""Simulation of one case, a pure function of machine, experiment and seed, and atomic storage of its record.

The record's bytes depend on the case alone: no time, no host, nothing of the other cases is in it. Its attribute
`campaign_row` holds the summary, so that a record whose row was lost in a crash need not be simulated again. A case
without physics, for benchmarks and tests of workers and store, sleeps and draws a few numbers from the seed.
"""

from __future__ import annotations

import json
import os
import time
from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from threadpoolctl import threadpool_limits

from identification import make_record
from rotorsim.analysis.sweep_definition import ANALYSES
from rotorsim.base.cache import in_cache
from rotorsim.base.errors import ConvergenceError, RotorsimError
from rotorsim.base.files import Lock, WriteError, write_error
from rotorsim.base.hdf5 import check_hdf5
from rotorsim.base.input_files import parse_json
from rotorsim.campaign.axes import is_analysis
from rotorsim.campaign.plan import Case, with_changes
from rotorsim.campaign.records import write_record
from rotorsim.campaign.store import StorageError, part_path, record_path
from rotorsim.campaign.summaries import summarise
from rotorsim.experiments import EXPERIMENTS, Experiment
from rotorsim.experiments.recording import snapshot_variables
from rotorsim.experiments.running import begin, record, stream
from rotorsim.machine import Machine
from rotorsim.plant import Plant
from rotorsim.plant.compose import is_compiled
from rotorsim.plant.locations import probe_coordinates
from rotorsim.signals.record_blocks import open_record

if TYPE_CHECKING:
    import xarray as xr

LONGEST = 300.0
"""Simulated time [s] up to which a record is held in memory, some 0.3 GB; longer ones pass through a file."""
PLANTS = 4
"""Number of plants that a process keeps ready."""
STUB_SAMPLES = 5


class MemoryRecording:
    """Growing record in memory."""

    def __init__(self, probes: dict[str, Any] | None = None, bearings: Sequence[str] = ()) -> None:
        self.samples, self._probes, self._bearings = 0, probes, tuple(bearings)
        self._blocks: list[dict[str, np.ndarray]] = []
        self._snapshots: list[tuple[float, float, np.ndarray]] = []
        self._grid: tuple[np.ndarray, np.ndarray] | None = None
        self._attrs: dict[str, Any] = {}

    def write(self, time: np.ndarray, values: dict[str, np.ndarray]) -> None:
        """Append samples."""
        self._blocks.append({"time": time, **values})
        self.samples += len(time)

    def snapshot(self, time: float, speed: float, theta: np.ndarray, z: np.ndarray, pressure: np.ndarray) -> None:
        """Keep the film pressure of one instant, as `Simulation.film_snapshot` gives it."""
        self._grid = theta, z
        self._snapshots.append((time, speed, pressure.copy()))

    def note(self, **attrs: Any) -> None:
        """Add attributes."""
        self._attrs |= attrs

    def dataset(self) -> xr.Dataset:
        """The record, as `Recording` would have written it."""
        names = self._blocks[0]
        values = {name: np.concatenate([block[name] for block in self._blocks]) for name in names}
        record = make_record(values.pop("time"), values, self._attrs, self._probes, self._bearings)
        if self._grid is None:
            return record
        times, speeds, pressures = (np.array(part) for part in zip(*self._snapshots, strict=True))
        kept = zip(
            snapshot_variables(self._grid[1].ndim > 1).items(), (*self._grid, pressures, times, speeds), strict=True
        )
        made = {name: (dims, values, {"units": u, "long_name": text}) for (name, (dims, u, text)), values in kept}
        coordinates = {name: made.pop(name) for name in list(made)[:2]}
        return record.assign(made).assign_coords(coordinates)


_plants: OrderedDict[Any, Plant] = OrderedDict()
_loaded: set[str] = set()


def plant_of(case: Case, text: str) -> Plant:
    """Plant of a case, from a cache of the last few."""
    known = (case.machine, case.set, case.changes)
    if known not in _plants:
        machine = Machine.from_text(text)
        for path, value in case.set:
            machine = machine.replace(path, value)
        _plants[known] = Plant(with_changes(machine, case.changes))
        if len(_plants) > PLANTS:
            _plants.popitem(last=False)
    _plants.move_to_end(known)
    return _plants[known]


def experiment_of(case: Case, plant: Plant) -> Experiment:
    """Experiment of a case, at the sampling time of its plant."""
    return EXPERIMENTS[case.kind](**dict(case.parameters), Ts=plant.machine.sampling_time)


def prepare(case: Case, text: str) -> None:
    """Load plant and kernels, once per process and machine; kernels not in the cache are compiled.

    A second process that needs the same code waits for the first to have compiled it.
    """
    plant = plant_of(case, text)
    module = plant.assembly.module
    loaded = f"{module.__name__} {is_analysis(case.kind)}"
    if loaded in _loaded:
        return
    with ExitStack() as stack:
        if not is_compiled(module, ("settle" if is_analysis(case.kind) else "run",)):
            stack.enter_context(Lock(in_cache("plants") / f"{module.run.__module__}.lock", wait=True))
        stack.enter_context(suppress(RotorsimError))  # the case itself will meet it again, and report it
        if is_analysis(case.kind):
            _loaded.add(loaded)
            plant.equilibrium()
            return
        experiment = experiment_of(case, plant)
        begin(plant, experiment, case.seed).advance(experiment.rows(0, 1))
        _loaded.add(loaded)


def solve(folder: Path, case: Case, text: str, summary: Sequence[str]) -> dict[str, Any]:
    """Run a case and keep its record in the store `folder`; returns its summary and the record's size in bytes.

    `text` is the base machine's, `summary` names post-processings of `rotorsim.campaign.summaries`. Raises StorageError
    if the record cannot be written, another RotorsimError if there is no result: no lift-off, no convergence,
    parameters that do not fit.
    """
    if is_analysis(case.kind):
        with threadpool_limits(1):
            return {"summary": ANALYSES[case.kind](**dict(case.parameters)).run(plant_of(case, text)), "bytes": 0}
    path = record_path(folder, case.key)
    if case.keep != () and path.exists():
        found = adopt(path, case.key)
        if found is not None:
            return found
    plant = plant_of(case, text)
    experiment = experiment_of(case, plant)
    with simulated(folder, plant, experiment, case) as data:
        row = summarise(summary, plant, experiment, data)
        if case.keep == ():
            return {"summary": row, "bytes": 0}
        attrs = plant.provenance(case.seed) | experiment.attrs() | dict(data.attrs)
        attrs |= {"campaign_key": case.key, "campaign_row": json.dumps(row)}
        attrs |= {"changes": case.changes} if case.changes else {}
        attrs.pop("date", None)  # a case is the same file whenever it runs; the store has the time
        return {"summary": row, "bytes": publish(folder, case, data, attrs)}


def adopt(path: Path, key: str) -> dict[str, Any] | None:
    """Summary and size of an existing record; None if it is incomplete."""
    if check_hdf5(path) is not None:
        return None
    with suppress(OSError, KeyError, ValueError), h5py.File(path, "r") as file:
        if file.attrs["campaign_key"] == key:
            return {"summary": parse_json(file.attrs["campaign_row"]), "bytes": path.stat().st_size, "adopted": True}
    return None


@contextmanager
def simulated(folder: Path, plant: Plant, experiment: Experiment, case: Case) -> Iterator[xr.Dataset]:
    """Complete record of a run, in memory or, if it is long, in a temporary file."""
    if experiment.samples * experiment.Ts <= LONGEST:
        sink = MemoryRecording(probe_coordinates(plant.machine), plant.machine.film_names)
        _complete(stream(begin(plant, experiment, case.seed), experiment, sink).ended)
        yield sink.dataset()
        return
    scratch = part_path(folder, f"{case.key}.whole")
    try:
        with storing(folder):
            outcome = record(plant, experiment, scratch, case.seed)
            if outcome.error is not None:
                raise outcome.error
        _complete(outcome.ended)
        with open_record(scratch) as data:
            yield data
    finally:
        scratch.unlink(missing_ok=True)


def _complete(ended: str) -> None:
    if ended != "complete":
        raise ConvergenceError(ended)


def publish(folder: Path, case: Case, data: xr.Dataset, attrs: Mapping[str, Any]) -> int:
    """Write the selected variables of a record and move the file to its place; returns its size [bytes]."""
    part, path = part_path(folder, case.key), record_path(folder, case.key)
    try:
        with storing(folder):
            write_record(part, data, attrs, case.keep)
            size = part.stat().st_size
            path.parent.mkdir(exist_ok=True)
            os.replace(part, path)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
    return size


@contextmanager
def storing(folder: Path) -> Iterator[None]:
    """Convert disk errors to StorageError, apart from faults of the case."""
    try:
        yield
    except OSError as error:
        cause = error if isinstance(error, WriteError) else write_error(folder, error)
        raise StorageError(
            f"{folder}: a record cannot be written: {cause.reason}; solve that and run the same command again",
            argument="folder",
            value=folder,
        ) from error


def prepare_stub(case: Case, text: str) -> None:
    """Do nothing: libraries are loaded with this module, and nothing is compiled."""


def solve_stub(folder: Path, case: Case, text: str, summary: Sequence[str]) -> dict[str, Any]:
    """Run a dummy case; interface of `rotorsim.campaign.simulate_case.solve`."""
    path = record_path(folder, case.key)
    found = adopt(path, case.key) if case.keep != () and path.exists() else None
    if found is not None:
        return found
    time.sleep(float(dict(case.parameters).get("duration", 0.0)))
    disc = np.random.default_rng(case.seed).normal(size=(STUB_SAMPLES, 2))
    row = {"numbers.disc.rms_um.x": float(disc[:, 0].std())}
    if case.keep == ():
        return {"summary": row, "bytes": 0}
    attrs = {"campaign_key": case.key, "campaign_row": json.dumps(row), "seed": case.seed}
    record = make_record(np.arange(STUB_SAMPLES) * 2e-4, {"disc": disc})
    return {"summary": row, "bytes": publish(folder, case, record, attrs)}


PHYSICS = {"rotorsim": (prepare, solve), "stub": (prepare_stub, solve_stub)}
"""Functions that prepare and solve cases, by the name that `Settings.physics` gives."""
