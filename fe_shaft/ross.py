"""Conversion of rotors from and to the open-source code ROSS, without importing it.

Both codes have x, y, alpha, beta at a node with the same signs; axial and torsional coordinates, links between bearings
and whatever else has no counterpart here is left out. Tables of ROSS stand over speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from fe_shaft.bearing import BearingElement
from fe_shaft.checks import ShaftError
from fe_shaft.masses import DiskElement, PointMass
from fe_shaft.shaft import Material, ShaftElement

_COEFFICIENTS = ("kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy")
_SWITCHES = ("shear_effects", "rotary_inertia", "gyroscopic")


Parts = tuple[list[ShaftElement], list[DiskElement], list[BearingElement], list[PointMass]]


class OwnRotor(Protocol):
    """What is read of a rotor of `fe_shaft`."""

    @property
    def shaft_elements(self) -> Sequence[ShaftElement]: ...
    @property
    def disk_elements(self) -> Sequence[DiskElement]: ...
    @property
    def bearing_elements(self) -> Sequence[BearingElement]: ...
    @property
    def point_mass_elements(self) -> Sequence[PointMass]: ...


def from_ross(rotor: Any) -> Parts:
    """Shaft, discs, bearings and point masses of a ROSS rotor, from which `fe_shaft.Rotor` is made.

    Raises
    ------
    ShaftError
        If the object lacks an attribute that a ROSS rotor has.
    """
    try:
        shaft = [_shaft(element) for element in rotor.shaft_elements]
        discs = [DiskElement(int(d.n), float(d.m), float(d.Id), float(d.Ip)) for d in rotor.disk_elements]
        bearings = [_bearing(bearing) for bearing in rotor.bearing_elements]
        points = [PointMass(int(p.n), mx=float(p.mx), my=float(p.my)) for p in rotor.point_mass_elements]
    except AttributeError as error:
        raise ShaftError(f"from_ross: {error}; give a rotor of ROSS.") from error
    return shaft, discs, bearings, points


def to_ross(rotor: OwnRotor, module: Any) -> Any:
    """A rotor of ROSS like `rotor`; `module` is `import ross`.

    Raises
    ------
    ShaftError
        If the rotor has what ROSS cannot represent: held nodes, internal coordinates, turning damping, whirl tables.
    """
    _check_representable(rotor)
    shaft = [
        module.ShaftElement(
            L=e.L, idl=e.idl, odl=e.odl, idr=e.idr, odr=e.odr, material=_material(e.material, module),
            n=n, alpha=e.alpha, beta=e.beta, **{name: getattr(e, name) for name in _SWITCHES},
        )
        for n, e in enumerate(rotor.shaft_elements)
    ]  # fmt: skip
    discs = [module.DiskElement(n=d.n, m=d.m, Id=d.Id, Ip=d.Ip) for d in rotor.disk_elements]
    bearings = [
        module.BearingElement(n=b.n, n_link=b.n_link, **_table(b), **({} if b.constant else {"frequency": b.frequency}))
        for b in rotor.bearing_elements
    ]
    points = [module.PointMass(n=p.n, mx=p.mx, my=p.my) for p in rotor.point_mass_elements]
    return module.Rotor(shaft, discs, bearings, **({"point_mass_elements": points} if points else {}))


def _table(bearing: BearingElement) -> dict[str, Any]:
    ones = np.ones(1 if bearing.frequency is None else len(np.asarray(bearing.frequency)))
    values = {name: getattr(bearing, name) * ones for name in _COEFFICIENTS}
    return values if not bearing.constant else {name: float(value[0]) for name, value in values.items()}


def _material(material: Material, module: Any) -> Any:
    plain = "".join(c if c.isalnum() else "_" for c in material.name)
    return module.Material(name=plain, rho=material.rho, E=material.E, G_s=material.G_s)


def _check_representable(rotor: Any) -> None:
    unsayable = {
        "held nodes": bool(rotor.clamped or rotor.pinned),
        "internal coordinates": any(e.internal for e in rotor.shaft_elements),
        "damping in the turning frame": any(e.eta_v or e.eta_h for e in rotor.shaft_elements),
        "axial force or torque": any(e.axial_force or e.torque for e in rotor.shaft_elements),
        "tables over whirl frequency": any(b.whirl_frequency is not None for b in rotor.bearing_elements),
    }
    for what, there in unsayable.items():
        if there:
            raise ShaftError(f"to_ross: the rotor has {what}, which ROSS has not; leave it out.")


def _shaft(element: Any) -> ShaftElement:
    m = element.material
    name = getattr(m, "name", "material")
    material = Material(name, rho=float(m.rho), E=float(m.E), G_s=float(m.G_s))
    more: dict[str, Any] = {key: float(getattr(element, key, 0.0)) for key in ("alpha", "beta")}
    more |= {key: bool(getattr(element, key)) for key in _SWITCHES}
    return ShaftElement(
        float(element.L), float(element.idl), float(element.odl), float(element.idr), float(element.odr), material,
        int(element.n), **more,
    )  # fmt: skip


def _bearing(bearing: Any) -> BearingElement:
    frequency = getattr(bearing, "frequency", None)
    many = frequency is not None and np.size(frequency) > 1
    values = {name: _values(getattr(bearing, name), many) for name in _COEFFICIENTS}
    link = getattr(bearing, "n_link", None)
    return BearingElement(
        n=int(bearing.n), frequency=np.asarray(frequency) if many else None, n_link=None if link is None else int(link),
        **values,
    )  # fmt: skip


def _values(value: Any, many: bool) -> Any:
    value = np.atleast_1d(np.asarray(getattr(value, "coefficient", value), dtype=float))
    return value if many else float(value[0])
