"""Archive contents besides description and binaries: documentation, data, reference, terminals, icon.

Equations in the documentation become MathML, which browsers draw without scripts.
"""

import html
import json
import re
import sys
from html import escape
from importlib.metadata import version as version_of
from itertools import pairwise
from pathlib import Path
from string import Template
from xml.etree.ElementTree import Element, SubElement

from latex2mathml.converter import convert

from fmu.archive import ROWS, number, text
from fmu.importer import Reference, table
from fmu.linear_units import LawUnit, LinearUnit
from fmu.model import PlantUnit, Unit, identifier, software, state_layout
from fmu.variables import UnitVariable, fmi_name
from rotorsim.base.quantity import UNLIMITED
from rotorsim.base.units import MPA, TO_RPM, show

REFERENCE_FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
PAIRS = {
    "Disc": ("disc.x", "disc.y", "disc.force_x", "disc.force_y"),
    "Injection": ("injection.pressure", "injection.line_pressure", "injection.mass_flow"),
    "Actuators": ("piezo.ref_x", "piezo.ref_y"),
    "Sensors": ("meas.disc_x", "meas.disc_y", "meas.angle", "meas.speed", "meas.pressure"),
    "Drive": ("shaft.speed_ref", "drive.on", "shaft.speed", "shaft.angle"),
}
"""Terminals and the variables in them."""
FILM = (
    r"\partial_y(p h^3\,\partial_y p) + \partial_z(p h^3\,\partial_z p) = \quad "
    r"6\mu U\,\partial_y(p h) + 12\mu\,\partial_t(p h) - 12\mu R T\,\dot m''"
)
LINEAR = (
    r"\dot x = A(q)\,x + B(q)\,u, \quad y = C(q)\,x + D(q)\,u, "
    r"\quad q = (\mathtt{shaft.speed\_ref}, \mathtt{injection.pressure})"
)
HELD = (
    "<li>What follows a held input at once (line pressure, its transducer, pins without actuators) has the input of "
    "sample k in row k of a simulation in Python already, and here after step k.</li>"
)
"""Rows of what a pressure or a pin gives at once, as HTML."""
LAW = (
    r"v = C x + D\,(y - y_c) + b \\ u = \mathrm{clip}(f v) \\ "
    r"\dot x = A x + B\,(y - y_c) + W\,(\mathrm{clip}(v) - v)"
)
GAP = re.compile(r"\\q?quad(?![a-zA-Z])")
"""Space between the parts of an equation, at which a line may end."""
SYMBOL = re.compile(r"\\[A-Za-z]+(?:_\w)?")
"""Symbol of LaTeX within a sentence."""
DIRECTIVE = ".. math::"


def contents(model: Unit, version: int, reference: Reference | None, targets: list[str], cpu: str) -> dict[str, bytes]:
    """Files by their names in the archive; `reference` is None where no binary runs on the exporting computer."""
    templates = Path(__file__).parent / "templates"
    icons = "terminalsAndIcons"
    if isinstance(model, PlantUnit):
        own = {"resources/machine.toml": model.plant.machine.text, "documentation/index.html": page(model)}
    elif isinstance(model, LawUnit):
        law = json.dumps(model.law.to_dict())
        own = {"resources/law.json": law + "\n", "documentation/index.html": law_page(model)}
    else:
        assert isinstance(model, LinearUnit)
        lpv = json.dumps(model.lpv.to_dict(), indent=1)
        own = {"resources/lpv.json": lpv + "\n", "documentation/index.html": linear_page(model)}
    found = own | {
        "resources/model.json": json.dumps(data(model, targets, cpu), indent=1, sort_keys=True) + "\n",
        "documentation/licenses/license.txt": licence(),
        f"resources/{identifier(model)}.a2l": addresses(model),
        f"{icons}/icon.svg": (templates / "icon.svg").read_text(encoding="utf-8"),
        "terminalsAndIcons/terminalsAndIcons.xml": text(terminals(model)),
    }
    if reference is not None:
        found |= {
            f"{REFERENCE_FOLDER}/fmi-ls-manifest.xml": text(manifest()),
            f"{REFERENCE_FOLDER}/experiments.xml": text(experiments(reference)),
            f"{REFERENCE_FOLDER}/in.csv": table(reference.inputs, reference.step),
            f"{REFERENCE_FOLDER}/out.csv": table(reference.outputs, reference.step),
        }
    png = (templates / "icon.png").read_bytes()
    if version == 2:
        for name in (f"{icons}/icon.svg", f"{icons}/terminalsAndIcons.xml"):
            del found[name]
    pictures = {"model.png" if version == 2 else f"{icons}/icon.png": png}
    return {name: body.encode() for name, body in found.items()} | pictures


def data(model: PlantUnit | LinearUnit | LawUnit, targets: list[str], cpu: str) -> dict[str, object]:
    """Origin of the unit; of a plant the start value of every parameter, in SI units."""
    facts: dict[str, object] = {
        "software": software(),
        "model_hash": model.hash,
        "targets": targets,
        "cpu": cpu,
        "start": {"speed": model.speed, "pressure": model.pressure},
    }
    if not isinstance(model, PlantUnit):
        return facts | {"model": model.name}
    return facts | {
        "numba": version_of("numba"),
        "llvmlite": version_of("llvmlite"),
        "machine_hash": model.plant.machine.hash,
        "corrections": model.plant.machine.solver.corrections,
        "over": [[one.path, one.values] for one in model.choices],
        "offers": {one.name: one.text for one in model.choices},
        "kernels": model.assembly.module.__name__,
        "parameters": {v.name: v.start for v in model.variables if v.causality == "parameter"},
    }


def _page(kind: str, model: Unit, name: str, description: str, values: dict[str, str]) -> str:
    """A page in the frame that all share; what stands in the values is HTML."""
    folder = Path(__file__).parent / "templates"
    known = {"name": html.escape(name), "description": html.escape(description), "software": html.escape(software())}
    known |= values | {
        "rows": ROWS,
        "hash": model.hash,
        "variables": "\n".join(_variable_row(v) for v in model.variables),
    }
    known["body"] = Template((folder / f"{kind}.html").read_text(encoding="utf-8")).substitute(known).strip()
    return Template((folder / "page.html").read_text(encoding="utf-8")).substitute(known)


def linear_page(model: LinearUnit) -> str:
    """documentation/index.html of a linear model."""
    low, high = model.lpv.low, model.lpv.high
    values = {
        "equations": block(LINEAR),
        "structure": html.escape(model.lpv.kind),
        "order": str(model.lpv.order),
        "time": f"sampled at {model.lpv.Ts:g} s" if model.lpv.Ts else "of continuous time",
        "speed": f"{low[0] * TO_RPM:.6g} to {high[0] * TO_RPM:.6g} rpm",
        "pressure": f"{low[1] / MPA:.6g} to {high[1] / MPA:.6g} MPa",
        "sample": f"{model.sample * 1e3:g} ms",
    }
    return _page("linear", model, model.name, model.description, values)


def law_page(model: LawUnit) -> str:
    """documentation/index.html of a law."""
    law = model.law
    values = {
        "equations": block(LAW),
        "order": str(law.order),
        "speed": ", ".join(f"{w * TO_RPM:.6g}" for w in law.speeds),
        "pressure": ", ".join(f"{p / MPA:.6g}" for p in law.pressures),
        "limit": f"{law.limit:g} V",
        "sample": f"{model.sample * 1e3:g} ms",
        "refresh": f"{law.refresh * model.sample * 1e3:g} ms",
        "average": f"{law.average:g} s",
        "fade": f"{law.fade:g} s",
    }
    return _page("law", model, model.name, model.description, values)


def page(model: PlantUnit) -> str:
    """documentation/index.html of a plant."""
    machine = model.plant.machine
    film = machine.film
    fed, pressure = bool(model.assembly.film.n_inj), f"{model.pressure / MPA:.6g} MPa"
    grid = f"{machine.grid.n_theta} x {machine.grid.n_z}" if film else "none"
    effects = []
    for name, entries in machine.effects.items():
        words = (sys.modules[type(entries[0]).__module__].__doc__ or type(entries[0]).__doc__ or "").strip()
        effects.append(f"<h3>{html.escape(name)}</h3>\n{prose(words)}")
    values = {
        "equations": block(FILM),
        "grid": grid,
        "clearance": show(film.clearance, "m") if film else "no gas film",
        "floor": show(machine.solver.minimum_film, "m"),
        "time_step": show(machine.solver.time_step, "s"),
        "start": f"shaft.speed_ref ({model.speed * TO_RPM:.6g} rpm)" + (f" and injection.pressure ({pressure})" * fed),
        "injectors": "; injectors: pin seat, plenum, orifice" * fed,
        "held": HELD * fed,
        "effects": "\n".join(effects),
    }
    return _page("plant", model, machine.name, machine.description, values)


def _variable_row(v: UnitVariable) -> str:
    unit = "" if v.unit == "1" else fmi_name(v.unit)
    low = "" if v.low <= -UNLIMITED else f"{v.low:.6g}"
    high = "" if v.high >= UNLIMITED else f"{v.high:.6g}"
    start = "" if v.start is None else f"{v.start:.9g}"
    cells = (v.name, v.causality, v.variability, unit, start, low, high, v.doc)
    return "<tr>" + "".join(f"<td>{html.escape(c)}</td>" for c in cells) + "</tr>"


def licence() -> str:
    """The licence's text."""
    for folder in (Path(__file__).parents[1], Path(__file__).parent):
        file = folder / "LICENSE"
        if file.is_file():
            return file.read_text(encoding="utf-8")
    return "MIT\n"


def terminals(model: Unit) -> Element:
    """terminalsAndIcons.xml of FMI 3.0."""
    root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    graphic = SubElement(root, "GraphicalRepresentation")
    corners = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}
    SubElement(graphic, "CoordinateSystem", corners, suggestedScalingFactorTo_mm="0.1")
    SubElement(graphic, "Icon", corners)
    known = {v.name for v in model.variables}
    below = SubElement(root, "Terminals")
    for name, members in PAIRS.items():
        present = [m for m in members if m in known]
        if present:
            terminal = SubElement(below, "Terminal", name=name, matchingRule="bus")
            for member in present:
                SubElement(
                    terminal, "TerminalMemberVariable", variableName=member, memberName=member.split(".", 1)[1],
                    variableKind="signal",
                )  # fmt: skip
    return root


A2L = Template("""ASAP2_VERSION 1 71
/begin PROJECT $name "Addresses are offsets from the pointer fmi3Instance; model $hash"
/begin MODULE $name ""
/begin RECORD_LAYOUT NUMBER FNC_VALUES 1 FLOAT64_IEEE COLUMN_DIR DIRECT /end RECORD_LAYOUT
$rows
/end MODULE
/end PROJECT
""")


def addresses(model: Unit) -> str:
    """Inputs, outputs and tunable parameters for calibration tools (ASAM MCD-2 MC), each at its offset in an instance.

    All are float64, integers and booleans too. A parameter written there acts from the next step on, without the checks
    that setting it through FMI makes.
    """
    fields = state_layout(model, "parameters")[0].fields
    assert fields is not None
    first = {"input": fields["inputs"][1], "output": fields["outputs"][1], "parameter": fields["parameters"][1]}
    rows = []
    for v in model.variables:
        if v.store not in first or v.shape or (v.store == "parameter" and not v.tunable):
            continue
        place = f"0x{first[v.store] + 8 * v.index:X}"
        doc, ends = json.dumps(v.doc, ensure_ascii=True), f"{max(v.low, -1e30)!r} {min(v.high, 1e30)!r}"
        unit = "" if v.unit == "1" else f' PHYS_UNIT "{fmi_name(v.unit)}"'
        if v.store == "output":
            kind, row = "MEASUREMENT", f"FLOAT64_IEEE NO_COMPU_METHOD 0 0 {ends} ECU_ADDRESS {place}{unit}"
        else:
            kind, row = "CHARACTERISTIC", f"VALUE {place} NUMBER 0 NO_COMPU_METHOD {ends}{unit}"
        rows.append(f"/begin {kind} {v.name} {doc} {row} /end {kind}")
    return A2L.substitute(name=identifier(model), hash=model.hash, rows="\n".join(rows))


def manifest() -> Element:
    """fmi-ls-manifest.xml of the layered standard for references."""
    return Element(
        "fmiReferences",
        {
            "xmlns:fmi-ls": "http://fmi-standard.org/fmi-ls-manifest",
            "fmi-ls:fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
            "fmi-ls:fmi-ls-version": "1.0.0",
            "fmi-ls:fmi-ls-description": "Reference inputs and outputs of this unit.",
        },
    )


def experiments(reference: Reference) -> Element:
    """The one experiment: stimuli and references as CSV."""
    root = Element(
        "Experiments", name="reference", description="Run-up with steps of pressure and reference and a hit."
    )
    stop = reference.step * len(next(iter(reference.inputs.values())))
    one = SubElement(
        root, "Experiment", name="reference", startTime="0", stopTime=number(round(stop, 9)),
        stepSize=number(reference.step), tolerance="1e-9",
    )  # fmt: skip
    SubElement(one, "Stimuli", source="in.csv", type="text/csv")
    SubElement(one, "References", source="out.csv", type="text/csv")
    return root


def inline(latex: str) -> str:
    """An equation within a line."""
    return str(convert(latex))


def block(latex: str) -> str:
    """An equation of its own: a row for each of its lines, wrapped between its parts where the page is narrow."""
    whole = "begin{" in latex
    lines = [[latex]] if whole else [_parts(line.replace("&", "")) for line in latex.split(r"\\")]
    rows = ("".join(f"<span>{convert(part, display='block')}</span>" for part in parts) for parts in lines)
    return f'<div class="math">{"".join(f"<div>{row}</div>" for row in rows if row)}</div>'


def prose(docstring: str) -> str:
    """A docstring as HTML: paragraphs, and equations of the directive `math`."""
    return "\n".join(map(_paragraph, re.split(r"\n[ \t]*\n", docstring.strip())))


def _paragraph(text: str) -> str:
    before, directive, latex = text.partition(DIRECTIVE)
    head = f"<p>{_sentence(before)}</p>" if before.strip() else ""
    return head + (block(" ".join(latex.split())) if directive else "")


def _sentence(text: str) -> str:
    """Plain text, in which symbols of LaTeX are drawn."""
    words = " ".join(text.split())
    ends = [0, *(end for at in SYMBOL.finditer(words) for end in at.span()), len(words)]
    pieces = [words[a:b] for a, b in pairwise(ends)]
    return "".join(inline(piece) if k % 2 else escape(piece) for k, piece in enumerate(pieces))


def _parts(line: str) -> list[str]:
    """Parts of an equation between wide spaces that no bracket encloses."""
    parts, begin = [], 0
    for gap in GAP.finditer(line):
        before = line[: gap.start()]
        if before.count("{") == before.count("}") and before.count(r"\left") == before.count(r"\right"):
            parts.append(line[begin : gap.start()])
            begin = gap.end()
    return [part.strip() for part in [*parts, line[begin:]] if part.strip()]
