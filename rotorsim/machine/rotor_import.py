"""Machines of rotors that other programs describe, and bearing tables of theirs.

An assembled rotor becomes a machine, and so a model of the open code ROSS does.

Each span of the shaft becomes a section, its further layers rings around it, and each part sits where its node is, so
that the mesh of the machine is that of the model. What a machine file has no field for is refused with its name where
it moves the modes, and named in a warning where it only damps them.

A table of a bearing is a CSV file whose headings name coefficient and unit, such as 'kxx [MN/m]' or 'speed (rpm)'.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

import fe_shaft
from fe_shaft.shaft import COEFFICIENTS, SOFT, SWITCHES
from rotorsim.base.errors import MachineFileError
from rotorsim.base.foreign_systems import Leftovers
from rotorsim.base.units import parse
from rotorsim.machine.bearings import Point, TableBearing
from rotorsim.machine.file_text import read_text
from rotorsim.machine.schema import Machine
from rotorsim.machine.tables import checked_part

if TYPE_CHECKING:
    from fe_shaft.assembly import AssembledRotor
    from fe_shaft.shaft import BearingElement, Material, ShaftElement


def from_ross(rotor: Any, name: str = "") -> Machine:
    """The machine of a model of ROSS: a rotor, or the path of a file that ROSS saved.

    Raises
    ------
    ShaftError
        For what `fe_shaft.Rotor` has no counterpart of.
    MachineFileError
        For what a machine has no field for.

    Warns
    -----
    NotCarried
        Once for each property that is left out.

    Examples
    --------
    >>> import rotorsim as rs
    >>> machine = rs.machine.from_ross("compressor.toml")  # doctest: +SKIP
    """
    own = name or (Path(rotor).stem if isinstance(rotor, (str, Path)) else "rotor")
    return machine_of(fe_shaft.Rotor.from_ross(rotor), own)


def machine_of(rotor: AssembledRotor, name: str) -> Machine:
    """The machine whose mesh is `rotor`; raises MachineFileError as `from_ross`."""
    left = Leftovers("machine")
    if faults := list(_unsayable(rotor)):
        raise MachineFileError("\n".join(f"rotor: {fault}" for fault in faults))
    common = Counter(_constants(element.material) for element in rotor.shaft_elements).most_common(1)[0][0]
    longest = max(layers[0].L for layers in rotor.spans)
    nodes = rotor.nodes_pos
    shaft = {
        "material": _material(*common),
        "max_element_length": longest * 1.001,
        "sections": [
            _piece(layers[0], common) | {"axial_force": force or None}
            for layers in rotor.spans
            for force in [sum(one.axial_force for one in layers)]
        ],
        "layers": [
            _layer(one, layers[0], common) | {"position": z}
            for z, layers in zip(nodes, rotor.spans, strict=False)
            for one in layers[1:]
        ],
    }
    for element in rotor.shaft_elements:
        for damping in ("alpha", "beta", "eta_v", "eta_h"):
            if getattr(element, damping):
                left.add(f"shaft element {element.n}", f"{damping} is not carried over; give shaft.damping_ratio")
    tables = {
        "name": name,
        "description": "",
        "shaft": shaft,
        "discs": [
            {"position": nodes[d.n] + d.offset, "mass": d.m, "polar_inertia": d.Ip, "diametral_inertia": d.Id}
            | ({"seat": nodes[d.n]} if d.offset else {})
            for d in rotor.disk_elements
        ],
        "point_masses": [
            {"position": nodes[p.n], "mass": p.mx} for p in rotor.point_mass_elements if p.n < rotor.n_nodes and p.mx
        ],
        "bearings": [_bearing(rotor, one) for one in rotor.bearing_elements if one.n < rotor.n_nodes],
    }
    left.warn()
    return Machine.from_text(cast(Machine, checked_part(Machine, _bare(tables), "")).text)


SPEEDS = {"frequency": "speed"}
"""Names of a machine file for those of an element."""
_HEADING = re.compile(r"\s*(?P<name>[A-Za-z]+)\s*[\[(,/]?\s*(?P<unit>[^\])]*?)\s*[\])]?\s*")
_UNITS = {"speed": "rad/s"} | {name: "N/m" if name[0] == "k" else "N*s/m" for name in COEFFICIENTS}


def bearing_points(path: str | Path) -> tuple[Point, ...]:
    """Points of a table bearing from a CSV file; columns are found by heading, in any order and unit.

    Delimiters are commas, semicolons (then decimals may be commas) or tabs; 'rpm' and 'Hz' are speeds too.

    Raises
    ------
    MachineFileError
        With one line per problem: heading, line and column, value.

    Examples
    --------
    >>> import rotorsim as rs
    >>> points = rs.machine.bearing_points("bearing.csv")  # doctest: +SKIP
    """
    return points_of(read_text(Path(path), "a CSV file"), str(path))


def points_of(text: str, path: str) -> tuple[Point, ...]:
    """Points of a table bearing from the text of a CSV file; `path` names it in sentences."""
    numbered = enumerate(text.splitlines(), 1)
    kept = [(k, line) for k, line in numbered if line.strip() and not line.lstrip().startswith("#")]
    numbers, lines = [k for k, _ in kept], [line for _, line in kept]
    delimiter = max("\t;,", key=lambda sign: lines[0].count(sign)) if lines else ","
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=delimiter)]
    problems: list[str] = []
    columns = _columns(rows[0] if rows else [], problems)
    points: list[dict[str, float]] = []
    for number, row in zip(numbers[1:], rows[1:], strict=False):
        values = {}
        for k, (name, unit) in columns.items():
            cell = row[k] if k < len(row) else ""
            try:
                values[name] = parse(f"{cell.replace(',', '.') if delimiter != ',' else cell} {unit}", _UNITS[name])
            except ValueError as error:
                problems.append(f"line {number}, column '{rows[0][k]}': {error}")
        if points and values.get("speed", np.inf) <= points[-1].get("speed", -np.inf):
            problems.append(f"line {number}: the speed does not rise; order the lines by speed")
        points.append(values)
    if not problems and len(points) < 2:
        problems.append(f"{len(points)} rows; a table needs two speeds or more")
    if problems:
        raise MachineFileError("\n".join(f"{path}: {one}" for one in problems), argument="path", value=path)
    return tuple(
        cast(Point, checked_part(Point, values, f"{path}: line {k}"))
        for k, values in zip(numbers[1:], points, strict=True)
    )


def with_points(machine: Machine, bearing: int, points: Sequence[Point]) -> Machine:
    """The machine with a table in place of the coefficients of a bearing, whose place, name and housing stay.

    Raises MachineFileError for a bearing that is not there or is a gas film.
    """
    if not 0 <= bearing < len(machine.bearings) or machine.bearings[bearing].coefficients is None:
        known = [i for i, one in enumerate(machine.bearings) if one.coefficients is not None]
        raise MachineFileError(
            f"bearings.{bearing}: is no bearing with coefficients; write one of {known}",
            argument="bearing",
            value=bearing,
        )
    old = machine.bearings[bearing]
    kept = {name: getattr(old, name) for name in ("name", "position", "support", "mxx", "myy")}
    table = checked_part(TableBearing, {"kind": "table", "points": tuple(points), **kept}, f"bearings.{bearing}")
    return machine.with_({f"bearings.{bearing}": table})


def _columns(headings: list[str], problems: list[str]) -> dict[int, tuple[str, str]]:
    """Name and unit of the columns that are read, by number."""
    found: dict[int, tuple[str, str]] = {}
    for k, heading in enumerate(headings):
        match = _HEADING.fullmatch(heading)
        name = match["name"].lower() if match else ""
        if name not in _UNITS:
            problems.append(f"column '{heading}' is none of {', '.join(_UNITS)}; rename or remove it")
        elif match and not match["unit"]:
            problems.append(f"column '{heading}' has no unit; write e.g. '{name} [{_UNITS[name]}]'")
        elif name in (known for known, _ in found.values()):
            problems.append(f"column '{heading}' is there twice; keep one")
        elif match:
            found[k] = name, match["unit"]
    if not problems:
        for name in ("speed", "kxx"):
            if name not in (known for known, _ in found.values()):
                problems.append(f"no column '{name}'; add it, e.g. '{name} [{_UNITS[name]}]'")
    return found


def _bare(value: Any) -> Any:
    """Tables without the fields that are not given, and with numbers of twelve digits."""
    if isinstance(value, dict):
        return {key: _bare(one) for key, one in value.items() if one is not None}
    if isinstance(value, list):
        return [_bare(one) for one in value]
    return float(f"{value:.12g}") if isinstance(value, (float, np.floating)) else value


def _unsayable(rotor: AssembledRotor) -> Iterator[str]:
    """Properties of a rotor that a machine has no field for and that move its modes."""
    if rotor.clamped or rotor.pinned:
        yield "held nodes have no counterpart; give bearings there"
    for e in rotor.shaft_elements:
        if e.torque:
            yield f"shaft element {e.n}: torque = {e.torque:g} N m has no counterpart; leave it out"
        for switch in SWITCHES:
            if not getattr(e, switch):
                yield f"shaft element {e.n}: {switch} = False has no counterpart; a machine's shaft has it"
    for p in rotor.point_mass_elements:
        if p.mx != p.my:
            yield f"point mass at node {p.n}: {p.mx:g} kg in x and {p.my:g} kg in y; give it one mass"
    for b in rotor.bearing_elements:
        yield from _unsayable_link(rotor, b)


def _unsayable_link(rotor: AssembledRotor, bearing: BearingElement) -> Iterator[str]:
    """A housing of which a machine has no like."""
    under = [b for b in rotor.bearing_elements if bearing.n_link is not None and b.n == bearing.n_link]
    if bearing.n_link is not None and bearing.n_link < rotor.n_nodes:
        yield f"bearing at node {bearing.n}: it stands on node {bearing.n_link} of the shaft; give it a housing"
    for one in under:
        K, C = one.stiffness, one.damping
        if not one.constant or K[0, 1] or K[1, 0] or C[0, 1] or C[1, 0] or one.n_link is not None or one.mxx or one.myy:
            yield f"housing at node {one.n}: it is more than a spring and a damper in x and in y; simplify it"


Constants = tuple[float, float, float]
"""Density [kg/m3], Young's modulus [Pa] and Poisson's ratio [1]."""


def _constants(material: Material) -> Constants:
    return material.rho, material.E, material.Poisson


def _material(rho: float, E: float, Poisson: float) -> dict[str, float]:
    return {"density": rho, "youngs_modulus": E, "poisson_ratio": Poisson}


def _piece(element: ShaftElement, common: Constants) -> dict[str, Any]:
    """Fields of a section or layer."""
    cone = {"outer_diameter_right": element.odr, "inner_diameter_right": element.idr} if element.tapered else {}
    material = _constants(element.material)
    own = {} if material == common else {"material": _material(*material)}
    return {"length": element.L, "outer_diameter": element.odl, "inner_diameter": element.idl, **cone, **own}


def _layer(element: ShaftElement, inner: ShaftElement, common: Constants) -> dict[str, Any]:
    """Fields of a layer but its place; one with next to no stiffness against its section carries mass alone."""
    E = inner.material.E
    if element.stiff and element.material.E > SOFT * E:
        return _piece(element, common)
    rho, _, Poisson = _constants(element.material)
    own = {} if (rho, E, Poisson) == common else {"material": _material(rho, E, Poisson)}
    return _piece(element, _constants(element.material)) | own | {"carries": "mass"}


def _bearing(rotor: AssembledRotor, bearing: BearingElement) -> dict[str, Any]:
    common: dict[str, Any] = {"position": rotor.nodes_pos[bearing.n]}
    common |= {name: getattr(bearing, name) or None for name in ("mxx", "myy")}
    if bearing.n_link is not None:
        common["support"] = _support(rotor, bearing.n_link)
    values = {name: np.atleast_1d(getattr(bearing, name)) for name in COEFFICIENTS}
    if bearing.constant:
        return {"kind": "linear", **common, **{name: value[0] for name, value in values.items()}}
    places = list(product(*bearing.axes))
    shape = tuple(map(len, bearing.axes))
    columns = {name: np.broadcast_to(value, shape).ravel() for name, value in values.items()}
    names = [n for n in ("frequency", "whirl_frequency") if getattr(bearing, n) is not None]
    points = [
        {"speed": 0.0} | {SPEEDS.get(n, n): v for n, v in zip(names, place, strict=True)}
        | {name: column[k] for name, column in columns.items()}
        for k, place in enumerate(places)
    ]  # fmt: skip
    return {"kind": "table", **common, "points": points}


def _support(rotor: AssembledRotor, node: int) -> dict[str, Any]:
    """The housing at a node behind the shaft."""
    mass = sum(p.mx for p in rotor.point_mass_elements if p.n == node)
    under = next(b for b in rotor.bearing_elements if b.n == node)
    (kxx, _), (_, kyy) = under.stiffness
    (cxx, _), (_, cyy) = under.damping
    return {"mass": mass, "kxx": kxx, "kyy": kyy, "cxx": cxx, "cyy": cyy}
