"""Archives of units: reproducible zip files and their model descriptions (modelDescription.xml) of FMI 2.0 and 3.0.

Descriptions are generated from the table of variables; paths are checked before minutes of compilation.
"""

import os
import tempfile
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from fmu.model import Unit, identifier, software
from fmu.variables import UnitVariable, fmi_name, unit_definitions
from rotorsim.base.errors import DataError
from rotorsim.base.files import WriteError, write_bytes
from rotorsim.base.interrupt import undoing
from rotorsim.base.quantity import UNLIMITED

DATE = (1980, 1, 1, 0, 0, 0)


def write_archive(path: Path, files: Mapping[str, bytes]) -> None:
    """Write all files in the order of their names; the archive is complete or untouched."""
    content = BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as z:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            z.writestr(entry, files[name])
    write_bytes(path, content.getvalue())


def check_place(path: Path) -> None:
    """Refuse at the start what could not be written at the end; raises DataError."""
    if path.is_dir():
        raise DataError(f"{path}: is a folder; give a file name, e.g. {path / ('rotor' + (path.suffix or '.fmu'))}")
    if not path.parent.is_dir():
        raise DataError(f"{path}: the folder is not there; make it, or choose another --out")
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise DataError(f"{path}: the folder is not writable; choose another --out") from error


@contextmanager
def workspace() -> Iterator[Path]:
    """Temporary folder, removed at the end; raises DataError where the disk for temporary files takes no more."""
    try:
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder, undoing():
            yield Path(folder)
    except OSError as error:
        if isinstance(error, WriteError):
            raise  # of a file elsewhere, with its own sentence
        raise temporary_error(error) from error


def temporary_error(error: OSError) -> DataError:
    """A sentence about temporary files that cannot be written."""
    reason = os.strerror(error.errno).lower() if error.errno else str(error)
    where = f"{tempfile.gettempdir()}: temporary files cannot be written: {reason}"
    return DataError(f"{where}; free some space or set TMPDIR to another folder")


STOP_TIME = 1.0
ROWS = "What is read after communication step k (counted from 0) is row k + 1 of a simulation in Python."
"""Place at which a reader of the XML expects it, because row k there is the state before sample k."""
OUTPUTS = ("output", "pressure")
GROUPS = {"Outputs": ("output",), "Derivatives": ("derivative",), "InitialUnknowns": ("output", "derivative")}
CATEGORIES = {
    "logStatusError": "Sentences about what is refused, and where the physics end.",
    "logStatusWarning": "Sentences, once in a run, about inputs beyond the range in which the model was checked.",
    "logEvents": "Touchdown and its end.",
}


def text(root: Element) -> str:
    """An element as a file."""
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"


def number(value: float) -> str:
    """A number that reads back to the last bit."""
    return repr(float(value))


def description2(model: Unit) -> Element:
    """modelDescription of FMI 2.0."""
    root = _root(model, "2.0", "guid")
    common = {"modelIdentifier": identifier(model), "canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true"}
    common["canNotUseMemoryManagementFunctions"] = "true"
    if model.continuous:
        common["providesDirectionalDerivative"] = "true"
        SubElement(root, "ModelExchange", common)
    SubElement(root, "CoSimulation", common, canHandleVariableCommunicationStepSize="true")
    listed = _common(root, model)
    places = {}
    for reference, v in enumerate(model.variables):
        # arrays are not in FMI 2.0; time may be, but FMI Library takes it for a fault
        if v.store in ("pressure", "time"):
            continue
        places[v.name] = len(listed) + 1
        scalar = SubElement(listed, "ScalarVariable", _attributes(reference, v))
        values = _value_attributes(v) | ({"derivative": str(places[v.derivative_of])} if v.derivative_of else {})
        SubElement(scalar, {"real": "Real", "integer": "Integer", "boolean": "Boolean"}[v.kind], values)
    structure = SubElement(root, "ModelStructure")
    for group, stores in GROUPS.items():
        below = [str(places[v.name]) for v in model.variables if v.store in stores]
        if below:
            entry = SubElement(structure, group)
            for index in below:
                known = {"dependencies": ""} if group == "Outputs" and not model.continuous else {}
                SubElement(entry, "Unknown", known, index=index)
    return root


def _attributes(reference: int, v: UnitVariable) -> dict[str, str]:
    """Attributes of a variable that both standards have."""
    found = {"name": v.name, "valueReference": str(reference), "description": v.doc}
    found |= {"causality": v.causality, "variability": v.variability}
    if v.store == "derivative" or v.causality == "output":
        return found | {"initial": "calculated"}
    return found | ({"initial": "exact"} if v.causality in ("parameter", "local") else {})


def description3(model: Unit) -> Element:
    """modelDescription of FMI 3.0."""
    root = _root(model, "3.0", "instantiationToken")
    common = {"modelIdentifier": identifier(model), "canGetAndSetFMUState": "true", "canSerializeFMUState": "true"}
    if model.continuous:
        common["providesDirectionalDerivatives"] = "true"
        SubElement(root, "ModelExchange", common, needsCompletedIntegratorStep="true")
    SubElement(
        root, "CoSimulation", common, canHandleVariableCommunicationStepSize="true", hasEventMode="true",
        fixedInternalStepSize=number(model.sample), providesIntermediateUpdate="true",
        canReturnEarlyAfterIntermediateUpdate="true",
        **({"mightReturnEarlyFromDoStep": "true"} if any(v.name == "film.touchdown" for v in model.variables) else {}),
    )  # fmt: skip
    listed = _common(root, model)
    names = {"real": "Float64", "integer": "Int32", "boolean": "Boolean", "clock": "Clock"}
    references = {v.name: k for k, v in enumerate(model.variables)}
    for reference, v in enumerate(model.variables):
        derivative = {"derivative": str(references[v.derivative_of])} if v.derivative_of else {}
        own = derivative | _value_attributes(v) | _times(model, v, references)
        entry = SubElement(listed, names[v.kind], _attributes(reference, v) | own)
        for length in v.shape:
            SubElement(entry, "Dimension", start=str(length))
    structure = SubElement(root, "ModelStructure")
    for element, stores in (("Output", OUTPUTS), ("ContinuousStateDerivative", ("derivative",))):
        for k, v in enumerate(model.variables):
            if v.store in stores:
                known = {"dependencies": ""} if element == "Output" and not (model.continuous or v.clock) else {}
                SubElement(structure, element, known, valueReference=str(k))
    for k, v in enumerate(model.variables):
        if v.store in (*OUTPUTS, "derivative") and not v.clock:
            SubElement(structure, "InitialUnknown", valueReference=str(k))
    return root


def _times(model: Unit, v: UnitVariable, references: Mapping[str, int]) -> dict[str, str]:
    """Attributes of FMI 3.0 that state when a variable changes, or can be read."""
    if v.kind == "clock":
        return {"intervalVariability": "constant", "intervalDecimal": number(model.sample)}
    if v.clock:
        return {"clocks": str(references[v.clock])}
    return {"intermediateUpdate": "true"} if v.store in OUTPUTS else {}


DESCRIPTIONS: dict[int, Callable[[Unit], Element]] = {2: description2, 3: description3}


def _root(model: Unit, fmi: str, token: str) -> Element:
    return Element(
        "fmiModelDescription",
        {
            "fmiVersion": fmi,
            "modelName": model.unit_name,
            token: model.token,
            "description": f"{model.description.rstrip('. ')}. {ROWS}",
            "version": model.hash[:16],
            "generationTool": software(),
            "variableNamingConvention": "structured",
        },
    )


def _common(root: Element, model: Unit) -> Element:
    """Units, categories of messages and default experiment below the root; the element for the variables."""
    root.append(unit_definitions(v.unit for v in model.variables if v.kind == "real"))
    below = SubElement(root, "LogCategories")
    for name, doc in CATEGORIES.items():
        SubElement(below, "Category", name=name, description=doc)
    SubElement(root, "DefaultExperiment", startTime="0", stopTime=number(STOP_TIME), stepSize=number(model.sample))
    return SubElement(root, "ModelVariables")


def _value_attributes(v: UnitVariable) -> dict[str, str]:
    found: dict[str, str] = {}
    if v.kind == "real":
        if v.unit != "1":
            found["unit"] = fmi_name(v.unit)
            if v.display:
                found["displayUnit"] = v.display
        found |= {} if v.nominal is None else {"nominal": number(v.nominal)}
    if v.kind not in ("boolean", "clock"):
        found |= {} if v.low <= -UNLIMITED else {"min": _plain(v, v.low)}
        found |= {} if v.high >= UNLIMITED else {"max": _plain(v, v.high)}
    if v.start is not None:
        found["start"] = ("true" if v.start else "false") if v.kind == "boolean" else _plain(v, v.start)
    return found


def _plain(v: UnitVariable, value: float) -> str:
    return str(int(value)) if v.kind == "integer" else number(value)
