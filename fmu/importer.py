"""A .fmu file read back: its summary, an instance in FMPy whose variables go by their names, and its reference run.

The reference is a run of inputs and outputs stored in the unit, which `check` compares with the Python plant.
"""

from __future__ import annotations

import csv
import ctypes
import io
import math
import os
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any
from xml.etree import ElementTree

import numpy as np

from fmu.archive import ROWS, temporary_error
from fmu.linear_units import LawUnit
from fmu.model import PlantUnit, Unit
from fmu.sources import oldest_library
from fmu.variables import UnitVariable
from rotorsim.base.errors import DataError
from rotorsim.base.input_files import parse_json, read_archive, unpack

Log = Callable[[str], None]
CASTS: dict[str, Callable[[float], Any]] = {"Boolean": bool, "Integer": int, "Int32": int}
DAMAGED = (ElementTree.ParseError, KeyError, IndexError, ValueError, TypeError, AttributeError)
"""Exceptions from reading another program's file, or a damaged one."""


def fmpy() -> Any:
    """The importer; raises DataError that names what to install."""
    try:
        import fmpy as importer
    except ImportError as error:
        raise DataError("fmpy: is not installed; install it with pip install fmpy") from error
    return importer


class ImportedUnit:
    """A .fmu file unpacked; a context manager that removes it. An instance runs the machine code that is in it."""

    def __init__(self, path: str | Path) -> None:
        importer = fmpy()
        self.path, self.folder = path, ""
        try:
            files = read_archive(Path(path))
            xml(files["modelDescription.xml"])
            self.folder = tempfile.mkdtemp()
            unpack(files, Path(self.folder))
            self.description = importer.read_model_description(self.folder, validate=False)
            _check_identifier(self.description)
        except Exception as error:  # what FMPy makes of a file that is none, from KeyError to BadZipFile
            shutil.rmtree(self.folder, ignore_errors=True)
            if isinstance(error, OSError) and error.filename != str(path):
                raise temporary_error(error) from error
            raise DataError(
                f"{path}: is not an FMU that FMPy can read ({str(error)[:200]}); export it again"
            ) from error
        self.is_3 = self.description.fmiVersion.startswith("3")
        self.variables = {v.name: v for v in self.description.modelVariables}

    def __enter__(self) -> ImportedUnit:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)

    def names(self, causality: str) -> list[str]:
        """Scalar variables of a causality."""
        return [n for n, v in self.variables.items() if v.causality == causality and not v.dimensions]

    def instance(self, name: str = "unit", log: Log | None = None, **options: bool) -> Instance:
        """A new instance, not yet initialised."""
        return Instance(self, name, log, options)


def _check_identifier(description: Any) -> None:
    """Raise ValueError for a name of the library that is more than a name: FMPy would look for it anywhere."""
    name = str(description.coSimulation.modelIdentifier)
    if re.fullmatch(r"[A-Za-z_]\w*", name, re.ASCII) is None:
        raise ValueError(f"its modelIdentifier is {name[:60]!r}, not a name as in C")


def fmi2_callbacks(log: Log) -> Any:
    """Callbacks of one FMI 2.0 instance, messages to `log`.

    FMPy's own are shared by all instances, and `fmpy.simulate_fmu` leaves a freed logger in them.
    """
    from fmpy import fmi2

    def logger(environment: Any, name: bytes, status: int, category: bytes, message: bytes) -> None:
        log(message.decode())

    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(logger)
    callbacks.allocateMemory = fmi2.defaultCallbacks.allocateMemory
    callbacks.freeMemory = fmi2.defaultCallbacks.freeMemory
    return callbacks


class Instance:
    """One instance of a unit for co-simulation, or (`kind` "Model") for model exchange; `messages` collects its log."""

    def __init__(
        self, unit: ImportedUnit, name: str, log: Log | None, options: dict[str, bool], kind: str = "Slave"
    ) -> None:
        self.unit, self.messages = unit, []  # type: ImportedUnit, list[str]
        self.log = log or self.messages.append
        d = unit.description
        common = {
            "guid": d.guid, "unzipDirectory": unit.folder, "modelIdentifier": d.coSimulation.modelIdentifier,
            "instanceName": name,
        }  # fmt: skip
        clocks = [v.valueReference for v in unit.variables.values() if v.type == "Clock"]
        self.clocks = clocks if kind == "Slave" else []
        here = os.getcwd()
        try:
            self._load(common, ({"eventModeUsed": True} if self.clocks else {}) | options, kind)
        except Exception as error:  # FMPy has no class of its own for this
            os.chdir(here)  # it goes to the library's folder, and stays there after a failure
            why = self.messages[-1] if self.messages else str(error)
            raise DataError(f"{unit.path}: cannot be loaded here ({why[:200]}); export it for this computer") from error

    def _load(self, common: dict[str, Any], options: dict[str, bool], kind: str) -> None:
        if self.unit.is_3:
            from fmpy import fmi3

            self.slave: Any = getattr(fmi3, f"FMU3{kind}")(**common)
            self.slave.instantiate(loggingOn=True, logMessage=self._log3, **options)
        else:
            from fmpy import fmi2

            self.slave = getattr(fmi2, f"FMU2{kind}")(**common)
            self.slave.instantiate(callbacks=fmi2_callbacks(self.log), loggingOn=True)

    def _log3(self, environment: Any, status: int, category: bytes, message: bytes) -> None:
        self.log(message.decode())

    def initialise(
        self, values: Mapping[str, float] | None = None, start: float = 0.0, stop: float | None = None
    ) -> None:
        """Set values, then initialise at a start time [s]; `stop` [s] is the end of the run, None for an open one."""
        if not self.unit.is_3:
            self.slave.setupExperiment(startTime=start, stopTime=stop)
        self.set(values or {})
        if self.unit.is_3:
            self.slave.enterInitializationMode(startTime=start, stopTime=stop)
        else:
            self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()

    def set(self, values: Mapping[str, float]) -> None:
        """Set variables of any type by name; raises DataError for an integer that is not whole."""
        for name, value in values.items():
            v = self.unit.variables[name]
            cast = CASTS.get(v.type, float)
            if cast is int and not float(value).is_integer():
                raise DataError(f"{name} = {value:g}: is not whole, as it has to be; give an integer", argument=name)
            getattr(self.slave, f"set{v.type}")([v.valueReference], [cast(value)])

    def get(self, names: Sequence[str]) -> np.ndarray:
        """Values of variables of any type by name."""
        found = np.empty(len(names))
        for k, name in enumerate(names):
            v = self.unit.variables[name]
            found[k] = getattr(self.slave, f"get{v.type}")([v.valueReference])[0]
        return found

    def step(self, now: float, length: float) -> Any:
        """One communication step; FMI 3.0 answers (event, terminate, early return, time reached).

        A clock ticks at the start of each of the unit's own steps in it.
        """
        if not self.clocks:
            return self.slave.doStep(currentCommunicationPoint=now, communicationStepSize=length)
        own = float(self.unit.description.coSimulation.fixedInternalStepSize)
        ticks = round(length / own) if own <= length and math.isfinite(length) else 1
        for k in range(ticks):
            self.slave.setClock(self.clocks, [True] * len(self.clocks))
            self.slave.updateDiscreteStates()
            self.slave.enterStepMode()
            try:
                answer = self.slave.doStep(
                    now + k * own, length if ticks == 1 or abs(length / own - ticks) > 1e-6 else own
                )
            finally:
                self.slave.enterEventMode()
        return answer

    def film_pressure(self) -> np.ndarray:
        """Film pressure (n_theta, n_z); FMI 3.0 only."""
        v = self.unit.variables["film.pressure"]
        shape = [int(d.start) for d in v.dimensions]
        return np.array(self.slave.getFloat64([v.valueReference], nValues=int(np.prod(shape)))).reshape(shape)

    def save(self) -> bytes:
        """The state as bytes."""
        s = self.slave
        state = s.getFMUState() if self.unit.is_3 else s.getFMUstate()
        data = bytes(s.serializeFMUState(state) if self.unit.is_3 else s.serializeFMUstate(state))
        (s.freeFMUState if self.unit.is_3 else s.freeFMUstate)(state)
        return data

    def restore(self, data: bytes) -> None:
        """Take back a state saved as bytes."""
        s = self.slave
        if self.unit.is_3:
            state = s.deserializeFMUState(data)
            s.setFMUState(state)
            s.freeFMUState(state)
        else:
            buffer = ctypes.create_string_buffer(data, len(data))
            state = s.deSerializeFMUstate(buffer.raw)
            s.setFMUstate(state)
            s.freeFMUstate(state)

    def run(self, inputs: Mapping[str, np.ndarray], step: float, outputs: Sequence[str], first: int = 0) -> np.ndarray:
        """Outputs (n + 1, outputs), before the first and after every step, for input rows (n,) by name."""
        rows = [self.get(outputs)]
        reals = [n for n in inputs if self.unit.variables[n].type in ("Real", "Float64")]
        others = [n for n in inputs if n not in reals]
        references = [self.unit.variables[n].valueReference for n in reals]
        table = np.stack([inputs[n] for n in reals], axis=1)
        set_reals = getattr(self.slave, "setFloat64" if self.unit.is_3 else "setReal")
        for k, row in enumerate(table):
            set_reals(references, row.tolist())
            if others and (k == 0 or any(inputs[n][k] != inputs[n][k - 1] for n in others)):
                self.set({n: inputs[n][k] for n in others})
            self.step((first + k) * step, step)
            rows.append(self.get(outputs))
        return np.array(rows)

    def close(self) -> None:
        """Terminate and free."""
        self.slave.terminate()
        self.slave.freeInstance()


@contextmanager
def opened(path: Path) -> Iterator[Mapping[str, bytes]]:
    """The files of a unit by name; what it should have and has not raises DataError."""
    try:
        yield read_archive(path)
    except DAMAGED as error:
        raise DataError(
            f"{path}: is not an FMU of rotorsim, or is damaged ({error}); export one with 'rotorsim fmu export'"
        ) from error


def info(path: Path) -> dict[str, Any]:
    """Facts about a unit that this software exported; raises DataError for anything else."""
    if not path.is_file():
        raise DataError(f"{path}: is not there; give a .fmu file")
    with opened(path) as files:
        return _facts(files) | {"size": f"{path.stat().st_size / 1000:.0f} kB"}


def xml(content: bytes) -> ElementTree.Element:
    """Root of an XML file of a unit; raises ValueError for one that defines entities, which may stand for anything."""
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content or b"\0" in content:
        raise ValueError("an XML file with entities of its own, which no unit needs")
    return ElementTree.fromstring(content)


def _facts(files: Mapping[str, bytes]) -> dict[str, Any]:
    root = xml(files["modelDescription.xml"])
    data = parse_json(files["resources/model.json"])
    listed = root.find("ModelVariables")
    if listed is None:
        raise KeyError("it has no ModelVariables")
    causalities = [v.get("causality", "local") for v in listed]
    offers = [f"{name} {values}" for name, values in data.get("offers", {}).items()]
    asked = [oldest_library(content) for name, content in files.items() if name.endswith(".so")]
    glibc = max((v for v in asked if v), key=lambda v: tuple(map(int, v.split("."))), default=None)
    return {
        "FMI version": root.get("fmiVersion"),
        "name": root.get("modelName"),
        "model": root.get("description", "").removesuffix(ROWS).strip(),
        "software": data["software"],
        "machine hash": data.get("machine_hash", "none: no plant"),
        "model hash": data["model_hash"],
        "targets": ", ".join(data["targets"]),
        "processor": data["cpu"],
        "inputs": causalities.count("input"),
        "outputs": causalities.count("output"),
        "parameters": causalities.count("parameter"),
        **({"offers": "; ".join(offers)} if offers else {}),
        "reference": "yes" if any(n.endswith("/out.csv") for n in files) else "no",
        "sources": "yes" if any(n.startswith("sources/") for n in files) else "no",
        **({"work a step": f"{data['corrections']} corrections at most"} if data.get("corrections") else {}),
        **({"needs": f"glibc {glibc} or later"} if glibc else {}),
    }


def machine_text(path: Path) -> str:
    """The machine file that a unit carries."""
    with opened(path) as files:
        return files["resources/machine.toml"].decode()


def holds(path: Path) -> str:
    """Kind of unit: 'plant', 'lpv' (an identified model) or 'law'."""
    with opened(path) as files:
        return next((kind for kind in ("lpv", "law") if f"resources/{kind}.json" in files), "plant")


def start(path: Path) -> tuple[float, float]:
    """Speed [rad/s] and gauge pressure [Pa] at which the unit starts."""
    with opened(path) as files:
        values = parse_json(files["resources/model.json"])["start"]
        return float(values["speed"]), float(values["pressure"])


def offered(path: Path) -> dict[str, list[float]]:
    """Values that a plant's unit offers, by paths of its machine."""
    with opened(path) as files:
        found = parse_json(files["resources/model.json"]).get("over", [])
        return {str(path): [float(x) for x in values] for path, values in found}


def stored(path: Path, name: str) -> tuple[list[str], list[list[float]]]:
    """Header and rows of a table of the unit's reference; empty where it has none."""
    with opened(path) as files:
        inside = [n for n in files if n.endswith(f"/{name}")]
        lines = files[inside[0]].decode().splitlines() if inside else [""]
        return lines[0].split(",") if lines[0] else [], [[float(x) for x in line.split(",")] for line in lines[1:]]


SAMPLES = 5
"""Samples in a step of the stored run."""
LENGTH = 300
"""Steps of the stored run."""
FORCE, VOLTS, PRESSURE_STEP, ACCELERATION = 20.0, 0.5, 0.02e6, 50.0
"""Force on the disc [N], at most; reference [V], step of the pressure [Pa], acceleration of the shaft [rad/s^2]."""
LIGHT = 6.0
"""Force on the disc [m/s^2] over the mass of the rotor, at most."""


@dataclass(frozen=True)
class Reference:
    """Input rows (n, inputs) and outputs (n + 1, outputs) every `step` [s], under the names of the variables."""

    step: float
    inputs: dict[str, np.ndarray]
    outputs: dict[str, np.ndarray]


def input_variables(model: Unit) -> list[UnitVariable]:
    """Inputs that a run is made of."""
    return [v for v in model.variables if v.store == "input"]


def reference_inputs(model: Unit, n: int, step: float) -> dict[str, np.ndarray]:
    """A run-up with a pressure step, a step of the reference and a hit on the disc, all within n steps."""
    if isinstance(model, LawUnit):
        return model.stimuli(n, step)
    rows = {v.name: np.full(n, float(v.start or 0.0)) for v in input_variables(model)}
    k = np.arange(n)
    rows["shaft.speed_ref"] += ACCELERATION * step * (k + 1)
    if "injection.pressure" in rows:
        rows["injection.pressure"][n // 3 :] += PRESSURE_STEP
    if "piezo.ref_x" in rows:
        rows["piezo.ref_x"][n // 2 :] = VOLTS
        rows["piezo.ref_y"][2 * n // 3 :] = -VOLTS
    if "disc.force_x" in rows:
        hit = min(FORCE, LIGHT * model.plant.machine.mass) if isinstance(model, PlantUnit) else FORCE
        rows["disc.force_x"][3 * n // 4 : 3 * n // 4 + 1] = hit
    return {v.name: np.clip(rows[v.name], v.low, v.high) for v in input_variables(model)}


def make_reference(model: Unit, path: Path) -> Reference:
    """Run the unit at `path`, which has a binary for this computer."""
    step = SAMPLES * model.sample
    inputs = reference_inputs(model, LENGTH, step)
    with ImportedUnit(path) as unit:
        names = unit.names("output")
        instance = unit.instance("reference")
        try:
            instance.initialise()
            rows = instance.run(inputs, step, names)
        except Exception as error:  # FMPy has several
            raise DataError("; ".join(instance.messages) or str(error)) from error
        instance.close()
    return Reference(step, inputs, dict(zip(names, rows.T, strict=True)))


def table(columns: dict[str, np.ndarray], step: float) -> str:
    """CSV with time first; numbers read back to the last bit."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["time", *columns])
    for k, row in enumerate(zip(*columns.values(), strict=True)):
        writer.writerow([repr(round(k * step, 9)), *(repr(float(x)) for x in row)])
    return stream.getvalue()
