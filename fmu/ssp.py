"""Plant and law as one system: an .ssp file (System Structure and Parameterization 1.0) of two units and their wires.

What the law gives reaches the plant one communication step after what it measured, so a master that exchanges all
values at once, every sample, runs the loop that the law was designed for.
"""

from __future__ import annotations

import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, register_namespace

import numpy as np

from fmu.archive import write_archive
from fmu.description import text
from fmu.export import export
from fmu.importer import ImportedUnit
from fmu.law_unit import INPUTS, OUTPUTS, LawUnit
from fmu.model import PlantUnit, Unit, software
from fmu.targets import Target
from fmu.units import exponents, fmi_name
from fmu.variables import Variable
from rotorsim.errors import DataError
from rotorsim.sampling import SAMPLE

SSD, SSC = (f"http://ssp-standard.org/SSP1/SystemStructure{name}" for name in ("Description", "Common"))
PARTS = ("plant", "law")
WIRES = tuple(("plant", "law", name) for name in INPUTS) + tuple(("law", "plant", name) for name in OUTPUTS)
"""From, to, name on both ends."""
DRIVEN = ("shaft.speed_ref", "injection.pressure", "disc.force_x", "disc.force_y")
SHOWN = ("disc.x", "disc.y", *OUTPUTS)


def export_system(
    plant: PlantUnit, law: LawUnit, out: Path, version: int, targets: Sequence[Target], cpu: str = "portable"
) -> Path:
    """Export both units and write the .ssp file; raises DataError where it cannot be written or periods differ."""
    if not out.parent.is_dir() or out.is_dir():
        raise DataError(f"{out}: is no place for a file; give a name in a folder that is there")
    check_periods(law)
    units: dict[str, Unit] = {"plant": plant, "law": law}
    with tempfile.TemporaryDirectory() as folder:
        made = {
            name: export(unit, Path(folder) / f"{name}.fmu", (version,), targets, cpu)[version].read_bytes()
            for name, unit in units.items()
        }
    return write_system(plant, law, made, out)


def check_periods(law: LawUnit) -> None:
    """Raise DataError unless the law runs at the plant's period."""
    if abs(law.sample / SAMPLE - 1) > 1e-9:
        raise DataError(f"{law.name}: Ts = {law.sample:g} s, and the plant samples every {SAMPLE:g} s; design it so")


def write_system(plant: PlantUnit, law: LawUnit, units: Mapping[str, bytes], out: Path) -> Path:
    """Write the .ssp file of two exported units, 'plant' and 'law'."""
    files = {f"resources/{name}.fmu": data for name, data in units.items()}
    write_archive(out, files | {"SystemStructure.ssd": text(structure(plant, law)).encode()})
    return out


def structure(plant: PlantUnit, law: LawUnit) -> Element:
    """SystemStructure.ssd."""
    register_namespace("ssd", SSD)
    register_namespace("ssc", SSC)
    title = f"{plant.plant.machine.name} with {law.name}"
    root = Element(_ssd("SystemStructureDescription"), version="1.0", name=title, generationTool=software())
    system = SubElement(root, _ssd("System"), name="loop", description=f"{plant.description} {law.description}")
    known = {v.name: v for v in plant.variables}
    driven = [name for name in DRIVEN if name in known]
    outside = SubElement(system, _ssd("Connectors"))
    for name in driven:
        _connector(outside, known[name], "input")
    for name in SHOWN[:2]:
        _connector(outside, known[name], "output")
    parts = SubElement(system, _ssd("Elements"))
    own: Mapping[str, Sequence[Variable]] = {
        "plant": [v for v in plant.variables if v.name in (*driven, *OUTPUTS, *INPUTS, *SHOWN[:2])],
        "law": [v for v in law.variables if v.name in INPUTS + OUTPUTS],
    }
    for name in PARTS:
        kind = {"name": name, "implementation": "CoSimulation", "type": "application/x-fmu-sharedlibrary"}
        part = SubElement(parts, _ssd("Component"), kind, source=f"resources/{name}.fmu")
        below = SubElement(part, _ssd("Connectors"))
        for v in own[name]:
            _connector(below, v, v.causality)
    wires = SubElement(system, _ssd("Connections"))
    for start, end, name in WIRES:
        SubElement(wires, _ssd("Connection"), startElement=start, startConnector=name, endElement=end,
                   endConnector=name)  # fmt: skip
    for name in driven:
        SubElement(wires, _ssd("Connection"), startConnector=name, endElement="plant", endConnector=name)
    for name in SHOWN[:2]:
        SubElement(wires, _ssd("Connection"), startElement="plant", startConnector=name, endConnector=name)
    _units(root, {v.unit for group in own.values() for v in group})
    SubElement(root, _ssd("DefaultExperiment"), startTime="0", stopTime="1")
    return root


def _ssd(name: str) -> str:
    return f"{{{SSD}}}{name}"


def _connector(below: Element, v: Variable, kind: str) -> None:
    one = SubElement(below, _ssd("Connector"), name=v.name, kind=kind, description=v.doc)
    SubElement(one, f"{{{SSC}}}Real", {} if v.unit == "1" else {"unit": fmi_name(v.unit)})


def _units(root: Element, used: set[str]) -> None:
    below = SubElement(root, _ssd("Units"))
    for unit in sorted(used - {"1"}):
        one = SubElement(below, f"{{{SSC}}}Unit", name=fmi_name(unit))
        SubElement(one, f"{{{SSC}}}BaseUnit", {name: str(n) for name, n in exponents(unit).items()})


class System:
    """The two units of an .ssp file, stepped by a master that exchanges all values at once."""

    def __init__(self, path: Path) -> None:
        try:
            with zipfile.ZipFile(path) as archive:
                files = {name: archive.read(f"resources/{name}.fmu") for name in PARTS}
        except (OSError, KeyError, zipfile.BadZipFile) as error:
            raise DataError(f"{path}: is no system of rotorsim; write one with 'rotorsim fmu system'") from error
        self.units, self.folder = {}, tempfile.TemporaryDirectory()
        for name, data in files.items():
            file = Path(self.folder.name) / f"{name}.fmu"
            file.write_bytes(data)
            self.units[name] = ImportedUnit(file)

    def __enter__(self) -> System:
        return self

    def __exit__(self, *_: object) -> None:
        for unit in self.units.values():
            unit.__exit__(None, None, None)
        self.folder.cleanup()

    def run(self, inputs: Mapping[str, np.ndarray], outputs: Sequence[str] = SHOWN) -> np.ndarray:
        """Outputs (n + 1, outputs) of the plant or the law every sample, for plant inputs (n,) by name."""
        both = {name: unit.instance(name) for name, unit in self.units.items()}
        for instance in both.values():
            instance.initialise({name: float(v[0]) for name, v in inputs.items() if name in instance.unit.variables})
        owner = {name: "law" if name in OUTPUTS else "plant" for name in outputs}
        rows, n = [], len(next(iter(inputs.values())))
        for k in range(n + 1):
            for start, end, name in WIRES:
                both[end].set({name: both[start].get([name])[0]})
            rows.append([both[owner[name]].get([name])[0] for name in outputs])
            if k < n:
                both["plant"].set({name: float(values[k]) for name, values in inputs.items()})
                for instance in both.values():
                    instance.step(k * SAMPLE, SAMPLE)
        for instance in both.values():
            instance.close()
        return np.array(rows)
