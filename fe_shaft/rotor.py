r"""Rotor: a row of shaft elements with discs, point masses and bearings on its nodes.

.. math:: M \ddot q + (C + \Omega G) \dot q + K q = f, \qquad M = M' > 0, \quad G = -G'

q holds x, y, alpha, beta of node 0, then of node 1, and so on (frame and signs: elements.py); then the four internal
coordinates of every element that has them; then x, y of every pedestal, whose nodes are numbered after the shaft's.
K and C take the bearings' own matrices, which need not be symmetric, and with material damping the circulatory terms.

Source: Friswell et al. (2010), chapter 5.

Rotors of the open-source code ROSS are converted from and to, without importing it. Both codes have x, y, alpha, beta
at a node with the same signs. Up to version 2, tables of ROSS stand over `frequency`, the speed of the shaft; from
version 3 over `speed` and whirl `frequency`. What has a counterpart is carried: damping alpha M + beta K of the whole
rotor goes to each element. What changes the lateral motion and has none is refused
with its name; everything else that a rotor of ROSS holds is named in a warning.

Cites: friswell_2010.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from inspect import signature
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from fe_shaft import campbell, critical, modal, response, transient
from fe_shaft.assembly import AssembledRotor
from fe_shaft.shaft import (
    COEFFICIENTS,
    SOFT,
    SWITCHES,
    BearingElement,
    DiskElement,
    Material,
    PointMass,
    ShaftElement,
    ShaftError,
)
from rotorsim.base.foreign_systems import Foreign, Leftovers
from rotorsim.base.input_files import parse_json, parse_toml

_MASSES, _CROSS_MASSES = ("mxx", "myy"), ("mxy", "myx")
_AXIAL = ("kzz", "czz", "mzz")
_DRAWN = {"color", "tag", "scale_factor", "dof_global_index", "type", "n_l", "n_r", "df"}
"""Attributes for drawing and numbering, which every element of ROSS has."""
_DERIVED = {
    "shaft": _DRAWN | {"o_d", "i_d", "A", "A_l", "A_r", "Ie", "Ie_l", "Ie_r", "Im", "volume", "m", "gama", "delta",
                       "a1", "a2", "b1", "b2", "beam_cg", "axial_cg_pos", "slenderness_ratio", "kappa", "phi", "n"},
    "material": {"Poisson", "color", "specific_heat", "thermal_conductivity"},
    "bearing": _DRAWN | {f"{name}_interpolated" for name in (*COEFFICIENTS, *_MASSES, *_CROSS_MASSES, *_AXIAL)},
    "rotor": _DRAWN | {
        "elements", "parameters", "number_dof", "ndof", "nodes", "nodes_pos", "nodes_i_d", "nodes_o_d", "link_nodes",
        "center_line_pos", "shaft_elements_length", "L", "m", "m_disks", "m_shaft", "CG", "Ip", "It", "M0", "K0", "C0",
        "G0", "Ksdt0", "df_disks", "df_bearings", "df_shaft", "df_point_mass", "df_seals", "df_motor", "w_shaft",
        "disk_forces_nodal", "bearing_forces_nodal", "disk_forces_tag", "bearing_forces_tag",
    },
}  # fmt: skip
"""Attributes of ROSS that follow from those that are read, or have no part in vibration, by kind of object."""
_REFUSED = {
    "modal_damping_ratio": "give alpha and beta, or the elements' own damping",
    "motor_element": "remove the motor",
    "rotors": "convert each rotor of a train by itself",
    "shafts": "convert each shaft of a coaxial rotor by itself",
}
"""Attributes of a rotor that change its lateral motion and have no counterpart, with the way out."""


Parts = tuple[list[ShaftElement], list[DiskElement], list[BearingElement], list[PointMass]]


def parts_from_ross(rotor: Any) -> Parts:
    """Shaft, discs, bearings and point masses of a ROSS rotor, from which `fe_shaft.Rotor` is made.

    Raises
    ------
    ShaftError
        If the object lacks an attribute that a ROSS rotor has, or holds what changes its lateral motion and has no
        counterpart: modal damping, bearing masses that couple x with y or change, couplings, motors, several shafts.

    Warns
    -----
    NotCarried
        Once for each other attribute that is not carried over.
    """
    left, whole = Leftovers("from_ross"), Foreign(rotor, "rotor")
    try:
        for name, way_out in _REFUSED.items():
            if (found := whole.read(name, None)) is not None:
                raise ShaftError(f"from_ross: rotor.{name} = {_short(found)} has no counterpart; {way_out}.")
        whole.read("default_damping_ratio", 0.0)  # of the modes beyond those of modal_damping_ratio
        shaft = [_shaft(one, left) for one in whole.read("shaft_elements")]
        discs = [_disc(one, left) for one in whole.read("disk_elements")]
        bearings = _bearings(whole.read("bearing_elements"), left)
        points = [_point(one, left) for one in whole.read("point_mass_elements")]
        alpha, beta = (float(whole.read(name, 0.0) or 0.0) for name in ("alpha", "beta"))
    except AttributeError as error:
        raise ShaftError(f"from_ross: {error}; give a rotor of ROSS.") from error
    if alpha or beta:  # as in ROSS, they replace the damping of single elements
        if any((e.alpha, e.beta) not in ((0, 0), (alpha, beta)) for e in shaft):
            left.add("rotor", f"alpha = {alpha:g} 1/s, beta = {beta:g} s replace the elements' own damping, as in ROSS")
        shaft = [replace(e, alpha=alpha, beta=beta) for e in shaft]
        discs, points = [replace(d, alpha=alpha) for d in discs], [replace(p, alpha=alpha) for p in points]
    _compare_damping(shaft, left)
    left.unread(whole, _DERIVED["rotor"])
    left.warn()
    return shaft, discs, bearings, points


_SAVED = {
    "shaft_elements": ("ShaftElement",), "disk_elements": ("DiskElement",), "point_mass_elements": ("PointMass",),
    "bearing_elements": ("BearingElement", "SealElement"),
}  # fmt: skip
"""Beginnings of a table's name in a file of ROSS, by the list of a rotor that holds such elements."""


def is_saved_rotor(path: Path) -> bool:
    """Whether a file is one that ROSS saved."""
    with suppress(OSError, UnicodeDecodeError, ValueError):
        return any("ShaftElement" in name for name in _tables(path))
    return False


def saved_rotor(path: str | Path) -> Any:
    """A rotor with the attributes that a file of ROSS holds; raises ShaftError for another file."""
    try:
        tables = dict(_tables(Path(path)))
    except OSError as error:
        raise ShaftError(f"from_ross: {path}: cannot be read ({error.strerror}); check the path.") from error
    except ValueError as error:
        raise ShaftError(
            f"from_ross: {path}: not a file of ROSS ({error}); give a .toml or .json that it saved."
        ) from error
    release = str(tables.pop("ross_version", "2")).split(".")[0]
    if not release.isdecimal():
        raise ShaftError(f"from_ross: {path}: ross_version is '{release}', not a number; save the rotor again.")
    found: dict[str, list[Any]] = {name: [] for name in _SAVED}
    own = _as_table(tables.pop("parameters", {}), f"{path}: parameters")
    for title, table in tables.items():
        if title.startswith("_"):  # a remark
            continue
        kind = next((name for name, starts in _SAVED.items() if title.split("_")[0].endswith(starts)), None)
        if kind is None:
            raise ShaftError(f"from_ross: {path}: '{title}' has no counterpart; remove it from the rotor.")
        found[kind].append(_saved_element(kind, table, int(release), f"{path}: {title}"))
    return SimpleNamespace(**own, **found)


def _tables(path: Path) -> dict[str, Any]:
    """Tables of a file; raises ValueError for one that is neither TOML nor JSON, or holds no tables."""
    text = path.read_text(encoding="utf-8-sig")
    tables = parse_json(text) if path.suffix.lower() == ".json" else parse_toml(text)
    if not isinstance(tables, dict) or not any("ShaftElement" in name for name in tables):
        raise ValueError("it holds no ShaftElement")
    return tables


def _saved_element(kind: str, table: Any, version: int, place: str) -> Any:
    values = dict(_as_table(table, place))
    if "material" in values:
        values["material"] = SimpleNamespace(**_as_table(values["material"], f"{place}.material"))
    if kind == "bearing_elements" and version > 2:
        values = {"speed": None, "frequency": None} | values
    return SimpleNamespace(**values)


def _as_table(value: Any, place: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ShaftError(f"from_ross: {place}: {value!r} is not a table; save the rotor again.")
    return value


def as_ross_rotor(rotor: AssembledRotor, module: Any) -> Any:
    """A rotor of ROSS like `rotor`; `module` is `import ross`.

    Raises ShaftError if the rotor has what ROSS cannot represent: held nodes, internal coordinates, turning damping,
    discs on arms, damped masses, and before version 3 tables over the whirl frequency.
    """
    two_axes = "speed" in signature(module.BearingElement).parameters
    _check_representable(rotor, two_axes)

    def material(one: Material, stiff: bool) -> Any:
        plain = "".join(c if c.isalnum() else "_" for c in one.name)
        soft = 1.0 if stiff else 1e-3 * SOFT
        return module.Material(name=plain + ("" if stiff else "_mass"), rho=one.rho, E=soft * one.E, G_s=soft * one.G_s)

    shaft = [
        module.ShaftElement(
            L=e.L, idl=e.idl, odl=e.odl, idr=e.idr, odr=e.odr, material=material(e.material, e.stiff), n=e.n,
            axial_force=e.axial_force, torque=e.torque, alpha=e.alpha, beta=e.beta,
            **{name: getattr(e, name) for name in SWITCHES},
        )
        for e in rotor.shaft_elements
    ]  # fmt: skip
    discs = [module.DiskElement(n=d.n, m=d.m, Id=d.Id, Ip=d.Ip) for d in rotor.disk_elements]
    bearings = [
        module.BearingElement(n=b.n, n_link=b.n_link, **_table(b), **_axes(b, two_axes)) for b in rotor.bearing_elements
    ]
    points = [module.PointMass(n=p.n, mx=p.mx, my=p.my) for p in rotor.point_mass_elements]
    return module.Rotor(shaft, discs, bearings, **({"point_mass_elements": points} if points else {}))


def _axes(bearing: BearingElement, two: bool) -> dict[str, Any]:
    """Axes of a table as the arguments of ROSS; with one axis alone, `frequency` is the speed."""
    if not two:
        return {} if bearing.constant else {"frequency": bearing.frequency}
    axes = {"speed": bearing.frequency, "frequency": bearing.whirl_frequency}
    return {name: axis for name, axis in axes.items() if axis is not None}


def _table(bearing: BearingElement) -> dict[str, Any]:
    ones = np.ones([len(axis) for axis in bearing.axes] or 1)
    values = {name: getattr(bearing, name) * ones for name in COEFFICIENTS}
    values |= {name: getattr(bearing, name) * ones for name in _MASSES if getattr(bearing, name)}
    return values if not bearing.constant else {name: float(value[0]) for name, value in values.items()}


def _check_representable(rotor: Any, two_axes: bool) -> None:
    unsayable = {
        "held nodes": bool(rotor.clamped or rotor.pinned),
        "internal coordinates": any(e.internal for e in rotor.shaft_elements),
        "damping in the turning frame": any(e.eta_v or e.eta_h for e in rotor.shaft_elements),
        "discs on arms": any(d.offset for d in rotor.disk_elements),
        "damped masses": any(m.alpha for m in (*rotor.disk_elements, *rotor.point_mass_elements)),
        "tables over whirl frequency": not two_axes and any(
            b.whirl_frequency is not None for b in rotor.bearing_elements
        ),
    }  # fmt: skip
    for what, there in unsayable.items():
        if there:
            raise ShaftError(f"to_ross: the rotor has {what}, which ROSS has not; leave it out.")


def _shaft(element: Any, left: Leftovers) -> ShaftElement:
    one = Foreign(element, f"shaft element {getattr(element, 'n', '?')}")
    if not hasattr(element, "material"):
        raise ShaftError(
            f"from_ross: {one.what} is a {type(element).__name__} without material; replace it by a shaft."
        )
    stuff = Foreign(one.read("material"), f"material {getattr(element.material, 'name', '?')}")
    material = Material(stuff.read("name", "material"), *(float(stuff.read(name)) for name in ("rho", "E", "G_s")))
    more: dict[str, Any] = {key: float(one.read(key, 0.0) or 0.0) for key in ("alpha", "beta", "axial_force", "torque")}
    more |= {key: bool(one.read(key)) for key in SWITCHES}
    if (method := one.read("shear_method_calc", "cowper")) not in ("cowper", None) and more["shear_effects"]:
        left.add(one.what, f"the shear coefficient is Cowper's, not that of shear_method_calc = {method!r}")
    more |= {name: float(one.read(name)) for name in ("L", "idl", "odl", "idr", "odr")}
    found = ShaftElement(material=material, n=int(one.read("n")), **more)
    left.unread(one, _DERIVED["shaft"])
    left.unread(stuff, _DERIVED["material"])
    return found


def _compare_damping(shaft: Sequence[ShaftElement], left: Leftovers) -> None:
    """Name the shaft elements whose beta ROSS multiplies with more than their elastic stiffness."""
    for e in shaft:
        if e.beta and (e.axial_force or e.torque):
            left.add(
                f"shaft element {e.n}",
                "beta damps the elastic stiffness alone, while ROSS damps that of axial force and torque too",
            )


def _disc(element: Any, left: Leftovers) -> DiskElement:
    one = Foreign(element, f"disc at node {getattr(element, 'n', '?')}")
    found = DiskElement(int(one.read("n")), *(float(one.read(name)) for name in ("m", "Id", "Ip")))
    left.unread(one, _DRAWN)
    return found


def _point(element: Any, left: Leftovers) -> PointMass:
    one = Foreign(element, f"point mass at node {getattr(element, 'n', '?')}")
    found = PointMass(int(one.read("n")), mx=float(one.read("mx")), my=float(one.read("my")))
    if one.read("mz", 0.0) not in (0.0, getattr(element, "m", None)):
        left.add(one.what, f"mz = {one.value.mz:g} kg moves along the shaft alone and is left out")
    left.unread(one, _DRAWN | {"m"})
    return found


def _bearings(elements: Sequence[Any], left: Leftovers) -> list[BearingElement]:
    bearings = []
    for element in elements:
        one = Foreign(element, f"bearing at node {getattr(element, 'n', '?')}")
        bearings.append(_bearing(one, left))
        for name in _AXIAL:
            if np.any(axial := _values(one.read(name, 0.0))):
                left.add(one.what, f"{name} = {_short(axial)} acts along the shaft alone and is left out")
        left.unread(one, _DERIVED["bearing"])
    return bearings


def _bearing(one: Foreign, left: Leftovers) -> BearingElement:
    axes = _ross_axes(one)
    many = {name: axis for name, axis in axes.items() if axis is not None and axis.size > 1}
    sizes = tuple(axis.size for axis in many.values())
    values = {name: _values(one.read(name)) for name in COEFFICIENTS}
    shaped: dict[str, Any] = {
        name: value.reshape(sizes) if sizes else float(value.flat[0]) for name, value in values.items()
    }
    how = one.read("interpolation", "spline")
    if many and max(sizes) > 2 and how != "linear":
        left.add(one.what, f"its table is linear between its entries here ({how} in ROSS) and ends with the last one")
    elif many:
        left.add(one.what, "its table ends with the last entry here, while ROSS extrapolates it")
    link = one.read("n_link", None)
    return BearingElement(
        n=int(one.read("n")), n_link=None if link is None else int(link), **shaped, **many, **_masses(one)
    )


def _ross_axes(one: Foreign) -> dict[str, Any]:
    """Axes of a bearing's table [rad/s]: `speed` and whirl `frequency` from version 3 on, before it one `frequency`."""
    axes = [one.read(name, None) for name in ("speed", "frequency")]
    speed, frequency = (None if axis is None else np.atleast_1d(np.asarray(axis, float)) for axis in axes)
    if not hasattr(one.value, "speed"):
        speed, frequency = frequency, None
    return {"frequency": speed, "whirl_frequency": frequency}


def _masses(one: Foreign) -> dict[str, Any]:
    """Mass terms of a bearing; raises ShaftError if they couple x with y or change over the table."""
    masses = {name: _values(one.read(name, 0.0)) for name in (*_MASSES, *_CROSS_MASSES)}
    there = {name: value for name, value in masses.items() if np.any(value)}
    for name, value in there.items():
        fault = ""
        if name in _CROSS_MASSES:
            fault = "couples x with y"
        elif np.ptp(value):
            fault = "changes over its table"
        if fault:
            raise ShaftError(
                f"from_ross: {one.what}: {name} = {_short(value)} kg {fault}, which has no counterpart; remove it or "
                "give a PointMass."
            )
    return {name: float(masses[name].flat[0]) for name in _MASSES}


def _values(value: Any) -> Any:
    """A coefficient of ROSS, of any version, as an array."""
    return np.atleast_1d(np.asarray(getattr(value, "coefficient", value), dtype=float))


def _short(value: Any) -> str:
    numbers = np.ravel(np.asarray(value, dtype=object))
    text = ", ".join(f"{one:g}" if isinstance(one, (int, float)) else type(one).__name__ for one in numbers[:3])
    return text + (", ..." if numbers.size > 3 else "")


class Rotor(AssembledRotor):
    """Rotor with four degrees of freedom a node: x, y [m], alpha, beta [rad].

    Parameters
    ----------
    shaft_elements : sequence of ShaftElement
        From left to right, or numbered by their `n`.
    disk_elements : sequence of DiskElement
    bearing_elements : sequence of BearingElement
    point_mass_elements : sequence of PointMass
        On the shaft, or on a pedestal that a bearing names as its `n_link`.
    clamped : sequence of int
        Nodes that neither move nor tilt.
    pinned : sequence of int
        Nodes that tilt but do not move.

    Raises
    ------
    ShaftError
        If elements are missing or numbered twice, if something lies outside the shaft, if two bearings share a node
        or a pedestal has no mass.

    Examples
    --------
    >>> import fe_shaft
    >>> shaft = [fe_shaft.ShaftElement(0.25, 0.0, 0.05) for _ in range(6)]
    >>> rotor = fe_shaft.Rotor(shaft, bearing_elements=[fe_shaft.BearingElement(n, 1e6, 100.0) for n in (0, 6)])
    >>> rotor.ndof
    28
    """

    run_static = response.run_static
    run_modal = modal.run_modal
    run_campbell = campbell.run_campbell
    run_critical_speed = critical.run_critical_speed
    run_ucs = critical.run_ucs
    run_stability = critical.run_stability
    run_unbalance_response = response.run_unbalance_response
    run_freq_response = response.run_freq_response
    run_time_response = transient.run_time_response
    to_ross = as_ross_rotor

    @classmethod
    def from_ross(cls, rotor: Any) -> Rotor:
        """The same rotor from an object of the open code ROSS, by reading its attributes; see `parts_from_ross`.

        A path is that of a file that ROSS saved (.toml or .json); it is read without ROSS.
        """
        return cls(*parts_from_ross(saved_rotor(rotor) if isinstance(rotor, (str, Path)) else rotor))
