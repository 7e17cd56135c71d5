r"""A rotor: shaft elements in a row, discs and bearings on their nodes.

.. math:: M \ddot q + (C + \Omega G) \dot q + K q = f, \qquad M = M' > 0, \quad G = -G'

q holds x, y, alpha, beta of node 0, then of node 1, and so on (frame and signs: elements.py).
K and C take the bearings' own matrices, which need not be symmetric.

Source: Friswell et al. (2010), chapter 5.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fe_shaft import elements, modal, response
from fe_shaft.shaft import BearingElement, DiskElement, ShaftElement

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Rotor:
    """Rotor with four degrees of freedom a node: x, y [m], alpha, beta [rad].

    Parameters
    ----------
    shaft_elements : sequence of ShaftElement
        From left to right, or numbered by their `n`.
    disk_elements : sequence of DiskElement
    bearing_elements : sequence of BearingElement

    Raises
    ------
    ValueError
        If elements are missing or numbered twice, if a disc or bearing lies outside the shaft, or if two
        bearings share a node.
    """

    shaft_elements: Sequence[ShaftElement]
    disk_elements: Sequence[DiskElement] = ()
    bearing_elements: Sequence[BearingElement] = ()

    number_dof: ClassVar[int] = 4

    def __post_init__(self) -> None:
        """Put the elements in order and check that everything sits on the shaft."""
        object.__setattr__(self, "shaft_elements", _numbered(tuple(self.shaft_elements)))
        object.__setattr__(self, "disk_elements", tuple(self.disk_elements))
        object.__setattr__(self, "bearing_elements", tuple(self.bearing_elements))
        last = len(self.shaft_elements)
        _check_nodes("disc", (disk.n for disk in self.disk_elements), last)
        _check_nodes("bearing", (bearing.n for bearing in self.bearing_elements), last)
        _check_one_bearing_a_node(self.bearing_elements)

    @property
    def n_nodes(self) -> int:
        """Number of nodes: one more than there are elements."""
        return len(self.shaft_elements) + 1

    @property
    def ndof(self) -> int:
        """Number of degrees of freedom."""
        return self.number_dof * self.n_nodes

    @property
    def nodes_pos(self) -> Matrix:
        """Positions of the nodes along z (n_nodes,) [m]; node 0 at 0."""
        return np.concatenate([[0.0], np.cumsum([element.L for element in self.shaft_elements])])

    @property
    def mass(self) -> float:
        """Mass of shaft and discs [kg]."""
        shaft = sum(element.mass for element in self.shaft_elements)
        return float(shaft + sum(disk.m for disk in self.disk_elements))

    def M(self) -> Matrix:
        """Mass matrix (ndof, ndof) [kg, kg m, kg m2]."""
        return self._mass.copy()

    def K(self, speed: float = 0.0) -> Matrix:
        """Stiffness matrix (ndof, ndof) [N/m, N, N m]; the same at every `speed` [rad/s]."""
        K = self._shaft_stiffness.copy()
        for bearing in self.bearing_elements:
            K[self._block(bearing.n, 2)] += bearing.stiffness
        return K

    def C(self, speed: float = 0.0) -> Matrix:
        """Damping matrix (ndof, ndof) [N s/m] of the bearings; the same at every `speed` [rad/s]."""
        C = np.zeros((self.ndof, self.ndof))
        for bearing in self.bearing_elements:
            C[self._block(bearing.n, 2)] += bearing.damping
        return C

    def G(self) -> Matrix:
        """Gyroscopic matrix (ndof, ndof) [kg m2 and lower], to be multiplied by the speed [rad/s]."""
        return self._gyroscopic.copy()

    def run_modal(self, speed: float) -> modal.ModalResult:
        """Natural frequencies, damping and whirl at `speed` [rad/s]; see modal.run_modal."""
        return modal.run_modal(self, speed)

    def run_campbell(self, speeds: ArrayLike) -> modal.CampbellResult:
        """Natural frequencies over `speeds` [rad/s]; see modal.run_campbell."""
        return modal.run_campbell(self, speeds)

    def run_static(self) -> response.StaticResult:
        """Sag under gravity and the bearings' reactions; see response.run_static."""
        return response.run_static(self)

    def run_unbalance_response(
        self, node: int | Sequence[int], magnitude: ArrayLike, phase: ArrayLike, frequency: ArrayLike
    ) -> response.UnbalanceResult:
        """Whirl forced by unbalance; see response.run_unbalance_response."""
        return response.run_unbalance_response(self, node, magnitude, phase, frequency)

    @cached_property
    def _mass(self) -> Matrix:
        M = self._assemble(elements.mass_matrix)
        for disk in self.disk_elements:
            M[self._block(disk.n, 4)] += elements.disk_mass_matrix(disk)
        return M

    @cached_property
    def _shaft_stiffness(self) -> Matrix:
        return self._assemble(elements.stiffness_matrix)

    @cached_property
    def _gyroscopic(self) -> Matrix:
        G = self._assemble(elements.gyroscopic_matrix)
        for disk in self.disk_elements:
            G[self._block(disk.n, 4)] += elements.disk_gyroscopic_matrix(disk)
        return G

    def _assemble(self, matrix: Callable[[ShaftElement], Matrix]) -> Matrix:
        full = np.zeros((self.ndof, self.ndof))
        for node, element in enumerate(self.shaft_elements):
            full[self._block(node, 8)] += matrix(element)
        return full

    def _block(self, node: int, size: int) -> tuple[slice, slice]:
        place = slice(self.number_dof * node, self.number_dof * node + size)
        return place, place


def _numbered(shaft: tuple[ShaftElement, ...]) -> tuple[ShaftElement, ...]:
    """The elements in order of their numbers; without numbers, in the order given."""
    if not shaft:
        raise ValueError("rotor: the shaft has no elements; give at least one ShaftElement.")
    numbers = [element.n for element in shaft]
    if all(n is None for n in numbers):
        return tuple(replace(element, n=n) for n, element in enumerate(shaft))
    given = sorted(n for n in numbers if n is not None)
    if given != list(range(len(shaft))):
        raise ValueError(
            f"rotor: the shaft elements are numbered {numbers}, but {len(shaft)} elements need each of the "
            f"numbers 0 to {len(shaft) - 1} once; correct them, or leave all of them out to number by order."
        )
    return tuple(sorted(shaft, key=lambda element: element.n or 0))


def _check_nodes(what: str, nodes: Iterable[int], last: int) -> None:
    for node in nodes:
        if not 0 <= node <= last:
            raise ValueError(f"rotor: {what} at node {node}, but the shaft has nodes 0 to {last}; move the {what}.")


def _check_one_bearing_a_node(bearings: Sequence[BearingElement]) -> None:
    nodes = [bearing.n for bearing in bearings]
    for node in nodes:
        if nodes.count(node) > 1:
            raise ValueError(f"rotor: {nodes.count(node)} bearings at node {node}; add their coefficients in one.")
