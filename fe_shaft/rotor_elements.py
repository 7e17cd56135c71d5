"""Elements of a rotor, in order along the shaft and checked: every one of them on a node of the shaft or a pedestal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fe_shaft.bearing import BearingElement
from fe_shaft.checks import ShaftError
from fe_shaft.masses import DiskElement, PointMass
from fe_shaft.shaft import ShaftElement


@dataclass(frozen=True)
class RotorElements:
    """Shaft elements, discs, bearings and point masses of a rotor, and the nodes that are held.

    The fields are those of `fe_shaft.Rotor`.

    Raises
    ------
    ShaftError
        If elements are missing or numbered twice, if something lies outside the shaft, if two bearings share a node
        or a pedestal has no mass.
    """

    shaft_elements: Sequence[ShaftElement]
    disk_elements: Sequence[DiskElement] = ()
    bearing_elements: Sequence[BearingElement] = ()
    point_mass_elements: Sequence[PointMass] = ()
    clamped: Sequence[int] = ()
    pinned: Sequence[int] = ()

    def __post_init__(self) -> None:
        """Put the elements in order and check that everything sits on the shaft."""
        object.__setattr__(self, "shaft_elements", _numbered(tuple(self.shaft_elements)))
        for name in ("disk_elements", "bearing_elements", "point_mass_elements", "clamped", "pinned"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        _check(self)

    @property
    def n_nodes(self) -> int:
        """Number of nodes of the shaft: one more than there are elements."""
        return len(self.shaft_elements) + 1

    @property
    def nodes_pos(self) -> NDArray[np.float64]:
        """Positions of the shaft's nodes along z (n_nodes,) [m]; node 0 at 0."""
        return np.concatenate([[0.0], np.cumsum([element.L for element in self.shaft_elements])])

    @property
    def mass(self) -> float:
        """Mass of shaft, discs and the point masses on the shaft [kg]."""
        shaft = sum(element.mass for element in self.shaft_elements)
        points = sum(point.my for point in self.point_mass_elements if point.n < self.n_nodes)
        return float(shaft + points + sum(disk.m for disk in self.disk_elements))


def _numbered(shaft: tuple[ShaftElement, ...]) -> tuple[ShaftElement, ...]:
    """The elements in order of their numbers; without numbers, in the order given."""
    if not shaft:
        raise ShaftError("rotor: the shaft has no elements; give at least one ShaftElement.")
    numbers = [element.n for element in shaft]
    if all(n is None for n in numbers):
        return tuple(replace(element, n=n) for n, element in enumerate(shaft))
    given = sorted(n for n in numbers if n is not None)
    if given != list(range(len(shaft))):
        raise ShaftError(
            f"rotor: the shaft elements are numbered {numbers}, but {len(shaft)} elements need each of the "
            f"numbers 0 to {len(shaft) - 1} once; correct them, or leave all of them out to number by order."
        )
    return tuple(sorted(shaft, key=lambda element: element.n or 0))


def _check(rotor: RotorElements) -> None:
    """Raise ShaftError if something does not sit where it can."""
    last = rotor.n_nodes - 1
    links = [b.n_link for b in rotor.bearing_elements if b.n_link is not None and b.n_link > last]
    _check_nodes("disc", (disk.n for disk in rotor.disk_elements), last)
    _check_nodes("bearing", (b.n for b in rotor.bearing_elements), last, links)
    _check_nodes("point mass", (point.n for point in rotor.point_mass_elements), last, links)
    _check_nodes("clamp", rotor.clamped, last)
    _check_nodes("pin", rotor.pinned, last)
    _check_one_bearing_a_node(rotor.bearing_elements)
    for node in links:
        if not any(p.n == node and min(p.mx, p.my) > 0 for p in rotor.point_mass_elements):
            raise ShaftError(f"rotor: the pedestal at node {node} has no mass; add PointMass({node}, m).")


def _check_nodes(what: str, nodes: Iterable[int], last: int, more: Sequence[int] = ()) -> None:
    for node in nodes:
        if not 0 <= node <= last and node not in more:
            raise ShaftError(f"rotor: {what} at node {node}, but the shaft has nodes 0 to {last}; move the {what}.")


def _check_one_bearing_a_node(bearings: Sequence[BearingElement]) -> None:
    nodes = [bearing.n for bearing in bearings]
    for node in nodes:
        if nodes.count(node) > 1:
            raise ShaftError(f"rotor: {nodes.count(node)} bearings at node {node}; add their coefficients in one.")
