"""Plant and control law as one system: an .ssp file (SSP 1.0 or 2.0) of two connected units.

What the law gives reaches the plant one communication step after what it measured, so a master that exchanges all
values at once, every sample, runs the loop that the law was designed for.

A system of SSP 1.0 has no connectors of its own: libcosim and ecos refuse a connection to one, and FMPy sets those that
nobody drives to zero, which is a supply at 0 Pa. Inputs that no wire reaches start at the values of a parameter set,
and a master sets them at the plant. The annotation of the Open Simulation Platform names the step, without which
libcosim refuses a system. One of SSP 2.0 has connectors, and its start values and their names in the plant are files.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, register_namespace

import numpy as np

from fmu.archive import check_place, number, text, workspace, write_archive
from fmu.export import Platform, export
from fmu.importer import ImportedUnit
from fmu.linear_units import ANGLE, INPUTS, OUTPUTS, LawUnit
from fmu.model import PlantUnit, Unit, software
from fmu.variables import UnitVariable, exponents, fmi_name
from rotorsim.base.errors import DataError
from rotorsim.base.input_files import ArchiveError, read_archive

SPACES = {
    "ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
    "ssv": "http://ssp-standard.org/SSP1/SystemStructureParameterValues",
    "ssm": "http://ssp-standard.org/SSP1/SystemStructureParameterMapping",
    "osp": "http://opensimulationplatform.com/SSP/OSPAnnotations",
}
PARTS = ("plant", "law")
DRIVEN = ("shaft.speed_ref", "injection.pressure", "disc.force_x", "disc.force_y")
START = {
    "shaft.speed_ref": "speed",
    "injection.pressure": "pressure",
    "disc.force_x": "force_x",
    "disc.force_y": "force_y",
}
"""Names of the start values in a parameter set of its own."""
VALUES, MAPPING = "resources/start.ssv", "resources/start.ssm"
SHOWN = ("disc.x", "disc.y", *OUTPUTS)


def export_system(
    plant: PlantUnit,
    law: LawUnit,
    out: Path,
    version: int,
    targets: Sequence[Platform],
    cpu: str = "portable",
    announce: Callable[[str], None] | None = None,
    standard: int = 1,
) -> Path:
    """Export both units and write the .ssp file; raises DataError where it cannot be written or periods differ."""
    check_place(out)
    check_periods(plant, law)
    units: dict[str, Unit] = {"plant": plant, "law": law}
    with workspace() as folder:
        made = {
            name: export(unit, folder / f"{name}.fmu", (version,), targets, cpu, announce)[version].read_bytes()
            for name, unit in units.items()
        }
    return write_system(plant, law, made, out, standard)


def wires(turning: bool) -> list[tuple[str, str, str]]:
    """Connections: from, to, name on both ends; the shaft angle too where the law takes it."""
    measured = (*INPUTS, ANGLE) if turning else INPUTS
    return [("plant", "law", name) for name in measured] + [("law", "plant", name) for name in OUTPUTS]


def check_periods(plant: PlantUnit, law: LawUnit) -> None:
    """Raise DataError unless the law runs at the plant's period."""
    if abs(law.sample / plant.sample - 1) > 1e-9:
        raise DataError(
            f"{law.name}: Ts = {law.sample:g} s, and the plant samples every {plant.sample:g} s; design it so"
        )


def write_system(plant: PlantUnit, law: LawUnit, units: Mapping[str, bytes], out: Path, standard: int = 1) -> Path:
    """Write the .ssp file, SSP 1.0 or 2.0, of two exported units, 'plant' and 'law'."""
    files = {f"resources/{name}.fmu": data for name, data in units.items()}
    files["SystemStructure.ssd"] = text(structure(plant, law, standard)).encode()
    if standard == 2:
        driven = [v for v in plant.variables if v.name in DRIVEN]
        files |= {VALUES: text(parameter_set(driven)).encode(), MAPPING: text(mapping(driven)).encode()}
    write_archive(out, files)
    return out


def parameter_set(driven: Sequence[UnitVariable]) -> Element:
    """start.ssv: start values under names of their own."""
    root = Element(_name("ssv:ParameterSet"), version="2.0", name="start")
    below = _below(root, "ssv:Parameters")
    for v in driven:
        one = _below(below, "ssv:Parameter", name=START[v.name], description=v.doc)
        _below(one, "ssv:Real", value=number(v.start or 0.0), **_unit(v))
    units = _below(root, "ssv:Units")
    _units(units, {v.unit for v in driven})
    return root


def mapping(driven: Sequence[UnitVariable]) -> Element:
    """start.ssm: the plant's variable of each start value."""
    root = Element(_name("ssm:ParameterMapping"), version="2.0")
    for v in driven:
        _below(root, "ssm:MappingEntry", source=START[v.name], target=v.name)
    return root


def structure(plant: PlantUnit, law: LawUnit, standard: int = 1) -> Element:
    """SystemStructure.ssd."""
    for prefix, space in SPACES.items():
        register_namespace(prefix, space)
    title = f"{plant.plant.machine.name} with {law.name}"
    version = f"{standard}.0"
    root = Element(_name("ssd:SystemStructureDescription"), version=version, name=title, generationTool=software())
    system = _below(root, "ssd:System", name="loop", description=f"{plant.description} {law.description}")
    shown = [v for v in plant.variables if v.name in (*OUTPUTS, *law.inputs, *SHOWN[:2])]
    driven = [v for v in plant.variables if v.name in DRIVEN]
    outer = [*driven, *(v for v in shown if v.causality == "output")] if standard == 2 else []
    if outer:
        _connectors(system, outer)
    parts = _below(system, "ssd:Elements")
    _component(parts, "plant", [*shown, *(driven if outer else ())], driven, standard)
    _component(parts, "law", [v for v in law.variables if v.name in law.inputs + OUTPUTS], [], standard)
    below = _below(system, "ssd:Connections")
    for v in outer:
        into = v.causality == "input"
        inner, own = ("end", "start") if into else ("start", "end")
        ends = {f"{inner}Element": "plant", f"{inner}Connector": v.name, f"{own}Connector": v.name}
        _below(below, "ssd:Connection", **ends)
    for start, end, name in wires(ANGLE in law.inputs):
        _below(below, "ssd:Connection", startElement=start, startConnector=name, endElement=end, endConnector=name)
    used = {v.unit for v in (*shown, *driven, *law.variables) if v.store != "time"}
    _units(_below(root, "ssd:Units"), used)
    one = _below(root, "ssd:DefaultExperiment", startTime="0", stopTime="1")
    note = _below(_below(one, "ssd:Annotations"), "ssc:Annotation", type="com.opensimulationplatform")
    _below(_below(note, "osp:Algorithm"), "osp:FixedStepAlgorithm", baseStepSize=number(plant.sample))
    return root


def _name(name: str) -> str:
    prefix, local = name.split(":")
    return f"{{{SPACES[prefix]}}}{local}"


def _below(parent: Element, tag: str, /, **attributes: str) -> Element:
    return SubElement(parent, _name(tag), attributes)


def _units(below: Element, used: set[str]) -> None:
    for unit in sorted(used - {"1"}):
        entry = _below(below, "ssc:Unit", name=fmi_name(unit))
        _below(entry, "ssc:BaseUnit", **{name: str(n) for name, n in exponents(unit).items()})


def _connectors(part: Element, wired: Sequence[UnitVariable]) -> None:
    below = _below(part, "ssd:Connectors")
    for v in wired:
        one = _below(below, "ssd:Connector", name=v.name, kind=v.causality, description=v.doc)
        _below(one, "ssc:Real", **_unit(v))


def _component(
    parts: Element, name: str, wired: Sequence[UnitVariable], driven: Sequence[UnitVariable], standard: int
) -> None:
    """A unit with its connectors, and start values of inputs that no wire of a unit reaches."""
    kind = {"implementation": "CoSimulation", "type": "application/x-fmu-sharedlibrary"}
    part = _below(parts, "ssd:Component", name=name, source=f"resources/{name}.fmu", **kind)
    _connectors(part, wired)
    if driven and standard == 2:
        binding = _below(_below(part, "ssd:ParameterBindings"), "ssd:ParameterBinding", source=VALUES)
        _below(binding, "ssd:ParameterMapping", source=MAPPING)
    elif driven:
        binding = _below(_below(part, "ssd:ParameterBindings"), "ssd:ParameterBinding")
        values = _below(_below(binding, "ssd:ParameterValues"), "ssv:ParameterSet", version="1.0", name="start")
        below = _below(values, "ssv:Parameters")
        for v in driven:
            one = _below(below, "ssv:Parameter", name=v.name, description=v.doc)
            _below(one, "ssv:Real", value=number(v.start or 0.0), **_unit(v))


def _unit(v: UnitVariable) -> dict[str, str]:
    return {} if v.unit == "1" else {"unit": fmi_name(v.unit)}


class CoupledUnits:
    """The two units of an .ssp file, stepped by a master that exchanges all values at once."""

    def __init__(self, path: Path) -> None:
        try:
            inside = read_archive(path)
            files = {name: inside[f"resources/{name}.fmu"] for name in PARTS}
        except (OSError, KeyError, ArchiveError) as error:
            raise DataError(f"{path}: is not a system of rotorsim; write one with 'rotorsim fmu system'") from error
        self.units = {}
        with workspace() as folder:
            for name, data in files.items():
                (folder / f"{name}.fmu").write_bytes(data)
                self.units[name] = ImportedUnit(folder / f"{name}.fmu")

    def __enter__(self) -> CoupledUnits:
        return self

    def __exit__(self, *_: object) -> None:
        for unit in self.units.values():
            unit.__exit__(None, None, None)

    def run(self, inputs: Mapping[str, np.ndarray], outputs: Sequence[str] = SHOWN) -> np.ndarray:
        """Outputs (n + 1, outputs) of the plant or the law every sample, for plant inputs (n,) by name."""
        both = {name: unit.instance(name) for name, unit in self.units.items()}
        for instance in both.values():
            instance.initialise({name: float(v[0]) for name, v in inputs.items() if name in instance.unit.variables})
        owner = {name: "law" if name in OUTPUTS else "plant" for name in outputs}
        step = float(self.units["plant"].description.defaultExperiment.stepSize)
        rows, n = [], len(next(iter(inputs.values())))
        for k in range(n + 1):
            for start, end, name in wires(ANGLE in self.units["law"].variables):
                both[end].set({name: both[start].get([name])[0]})
            rows.append([both[owner[name]].get([name])[0] for name in outputs])
            if k < n:
                both["plant"].set({name: float(values[k]) for name, values in inputs.items()})
                for instance in both.values():
                    instance.step(k * step, step)
        for instance in both.values():
            instance.close()
        return np.array(rows)
