"""modelDescription.xml of FMI 2.0 and 3.0 from the table of variables."""

from __future__ import annotations

from collections.abc import Callable
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from fmu.limits import UNLIMITED
from fmu.model import IDENTIFIER, UnitModel, software
from fmu.units import fmi_name, unit_definitions
from fmu.variables import Variable
from rotorsim.machine.numerics import SAMPLE

STOP_TIME = 1.0
CATEGORIES = {"logStatusError": "Sentences about what is refused.", "logEvents": "Touchdown and its end."}


def text(root: Element) -> str:
    """An element as a file."""
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"


def number(value: float) -> str:
    """A number that reads back to the last bit."""
    return repr(float(value))


def description2(model: UnitModel) -> Element:
    """modelDescription of FMI 2.0."""
    root = _root(model, "2.0", "guid", "variableNamingConvention")
    SubElement(
        root, "CoSimulation", modelIdentifier=IDENTIFIER, canHandleVariableCommunicationStepSize="true",
        canGetAndSetFMUstate="true", canSerializeFMUstate="true", canNotUseMemoryManagementFunctions="true",
    )  # fmt: skip
    root.append(unit_definitions(v.unit for v in model.variables if v.kind == "real"))
    _categories(root)
    _experiment(root)
    listed = SubElement(root, "ModelVariables")
    places = {}
    for reference, v in enumerate(model.variables):
        # arrays are not in FMI 2.0; time may be, but FMI Library takes it for a fault
        if v.store in ("pressure", "time"):
            continue
        places[v.name] = len(listed) + 1
        _scalar(listed, reference, v)
    structure = SubElement(root, "ModelStructure")
    for group in ("Outputs", "InitialUnknowns"):
        below = SubElement(structure, group)
        for v in model.variables:
            if v.store == "output":
                unknown = SubElement(below, "Unknown", index=str(places[v.name]))
                if group == "Outputs":
                    unknown.set("dependencies", "")
    return root


def _scalar(listed: Element, reference: int, v: Variable) -> None:
    attributes = {"name": v.name, "valueReference": str(reference), "description": v.doc}
    attributes |= {"causality": v.causality, "variability": v.variability}
    initial = _initial(v)
    if initial:
        attributes["initial"] = initial
    scalar = SubElement(listed, "ScalarVariable", attributes)
    SubElement(scalar, {"real": "Real", "integer": "Integer", "boolean": "Boolean"}[v.kind], _value_attributes(v))


def _initial(v: Variable) -> str | None:
    if v.causality in ("parameter", "local"):
        return "exact"
    return "calculated" if v.causality == "output" else None


def description3(model: UnitModel) -> Element:
    """modelDescription of FMI 3.0."""
    root = _root(model, "3.0", "instantiationToken", "variableNamingConvention")
    SubElement(
        root, "CoSimulation", modelIdentifier=IDENTIFIER, canHandleVariableCommunicationStepSize="true",
        canGetAndSetFMUState="true", canSerializeFMUState="true", hasEventMode="true",
        fixedInternalStepSize=number(SAMPLE),
    )  # fmt: skip
    root.append(unit_definitions(v.unit for v in model.variables if v.kind == "real"))
    _categories(root)
    _experiment(root)
    listed = SubElement(root, "ModelVariables")
    names = {"real": "Float64", "integer": "Int32", "boolean": "Boolean"}
    for reference, v in enumerate(model.variables):
        attributes = {"name": v.name, "valueReference": str(reference), "description": v.doc}
        attributes |= {"causality": v.causality, "variability": v.variability}
        initial = _initial(v)
        if initial:
            attributes["initial"] = initial
        entry = SubElement(listed, names[v.kind], attributes | _value_attributes(v))
        for length in v.shape:
            SubElement(entry, "Dimension", start=str(length))
    structure = SubElement(root, "ModelStructure")
    outputs = [str(k) for k, v in enumerate(model.variables) if v.causality == "output"]
    for output in outputs:
        SubElement(structure, "Output", valueReference=output, dependencies="")
    for output in outputs:
        SubElement(structure, "InitialUnknown", valueReference=output)
    return root


DESCRIPTIONS: dict[int, Callable[[UnitModel], Element]] = {2: description2, 3: description3}


def _root(model: UnitModel, fmi: str, token: str, naming: str) -> Element:
    machine = model.plant.machine
    return Element(
        "fmiModelDescription",
        {
            "fmiVersion": fmi,
            "modelName": IDENTIFIER,
            token: model.token,
            "description": machine.description or f"{machine.name}: rotor on gas bearings.",
            "version": model.hash[:16],
            "generationTool": software(),
            naming: "structured",
        },
    )


def _categories(root: Element) -> None:
    below = SubElement(root, "LogCategories")
    for name, doc in CATEGORIES.items():
        SubElement(below, "Category", name=name, description=doc)


def _experiment(root: Element) -> None:
    SubElement(root, "DefaultExperiment", startTime="0", stopTime=number(STOP_TIME), stepSize=number(SAMPLE))


def _value_attributes(v: Variable) -> dict[str, str]:
    found: dict[str, str] = {}
    if v.kind == "real":
        if v.unit != "1":
            found["unit"] = fmi_name(v.unit)
            if v.display:
                found["displayUnit"] = v.display
        found |= {} if v.nominal is None else {"nominal": number(v.nominal)}
    if v.kind != "boolean":
        found |= {} if v.low <= -UNLIMITED else {"min": _plain(v, v.low)}
        found |= {} if v.high >= UNLIMITED else {"max": _plain(v, v.high)}
    if v.start is not None:
        found["start"] = ("true" if v.start else "false") if v.kind == "boolean" else _plain(v, v.start)
    return found


def _plain(v: Variable, value: float) -> str:
    return str(int(value)) if v.kind == "integer" else number(value)
