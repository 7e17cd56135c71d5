r"""Rotor: a row of shaft elements with discs, point masses and bearings on its nodes.

.. math:: M \ddot q + (C + \Omega G) \dot q + K q = f, \qquad M = M' > 0, \quad G = -G'

q holds x, y, alpha, beta of node 0, then of node 1, and so on (frame and signs: elements.py); then the four internal
coordinates of every element that has them; then x, y of every pedestal, whose nodes are numbered after the shaft's.
K and C take the bearings' own matrices, which need not be symmetric, and with material damping the circulatory terms.

Source: Friswell et al. (2010), chapter 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fe_shaft import assembly, campbell, critical, modal, response, ross, stability, static, transient, ucs
from fe_shaft.bearing import BearingElement
from fe_shaft.masses import DiskElement, PointMass
from fe_shaft.shaft import ShaftElement

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
    point_mass_elements : sequence of PointMass
        On the shaft, or on a pedestal that a bearing names as its `n_link`.
    clamped : sequence of int
        Nodes that neither move nor tilt.
    pinned : sequence of int
        Nodes that tilt but do not move.

    Raises
    ------
    ValueError
        If elements are missing or numbered twice, if something lies outside the shaft, if two bearings share a node
        or a pedestal has no mass.
    """

    shaft_elements: Sequence[ShaftElement]
    disk_elements: Sequence[DiskElement] = ()
    bearing_elements: Sequence[BearingElement] = ()
    point_mass_elements: Sequence[PointMass] = ()
    clamped: Sequence[int] = ()
    pinned: Sequence[int] = ()

    number_dof: ClassVar[int] = 4

    def __post_init__(self) -> None:
        """Put the elements in order and check that everything sits on the shaft."""
        object.__setattr__(self, "shaft_elements", _numbered(tuple(self.shaft_elements)))
        for name in ("disk_elements", "bearing_elements", "point_mass_elements", "clamped", "pinned"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        assembly.check(self)

    @property
    def n_nodes(self) -> int:
        """Number of nodes of the shaft: one more than there are elements."""
        return len(self.shaft_elements) + 1

    @cached_property
    def layout(self) -> assembly.DofLayout:
        """Where the degrees of freedom are."""
        return assembly.lay_out(self)

    @property
    def ndof(self) -> int:
        """Number of degrees of freedom, held ones included."""
        return self.layout.ndof

    @property
    def free(self) -> NDArray[np.intp]:
        """Numbers (n_free,) of the degrees of freedom that nothing holds."""
        return self.layout.free

    @property
    def nodes_pos(self) -> Matrix:
        """Positions of the shaft's nodes along z (n_nodes,) [m]; node 0 at 0."""
        return np.concatenate([[0.0], np.cumsum([element.L for element in self.shaft_elements])])

    @property
    def mass(self) -> float:
        """Mass of shaft, discs and the point masses on the shaft [kg]."""
        shaft = sum(element.mass for element in self.shaft_elements)
        points = sum(point.my for point in self.point_mass_elements if point.n < self.n_nodes)
        return float(shaft + points + sum(disk.m for disk in self.disk_elements))

    def M(self) -> Matrix:
        """Mass matrix (ndof, ndof) [kg, kg m, kg m2]."""
        return self.parts.M.copy()

    def K(self, speed: float = 0.0, whirl: float | None = None) -> Matrix:
        """Stiffness matrix (ndof, ndof) [N/m, N, N m] at `speed` and `whirl` frequency [rad/s], else synchronous."""
        return assembly.stiffness(self, speed, whirl)

    def C(self, speed: float = 0.0, whirl: float | None = None) -> Matrix:
        """Damping matrix (ndof, ndof) [N s/m, N s, N m s] at `speed` and `whirl` frequency [rad/s]."""
        return assembly.damping(self, speed, whirl)

    def G(self) -> Matrix:
        """Gyroscopic matrix (ndof, ndof) [kg m2 and lower], to be multiplied by the speed [rad/s]."""
        return self.parts.G.copy()

    @cached_property
    def parts(self) -> assembly.Parts:
        """The assembled matrices of shaft and masses; not to be written into."""
        return assembly.assemble(self)

    def run_static(self, gravity: float | None = None, force: ArrayLike | None = None) -> static.StaticResult:
        """Sag under gravity and given forces and the bearings' reactions; see static.run_static."""
        return static.run_static(self, static.GRAVITY if gravity is None else gravity, force)

    def run_modal(self, speed: float) -> modal.ModalResult:
        """Natural frequencies, damping and whirl at `speed` [rad/s]; see modal.run_modal."""
        return modal.run_modal(self, speed)

    def run_campbell(self, speeds: ArrayLike, frequencies: int | None = 6) -> campbell.CampbellResult:
        """The lowest natural frequencies over `speeds` [rad/s]; see campbell.run_campbell."""
        return campbell.run_campbell(self, speeds, frequencies)

    def run_critical_speed(self, limit: float | None = None, count: int = 6) -> critical.CriticalSpeedResult:
        """Speeds that equal a natural frequency; see critical.run_critical_speed."""
        return critical.run_critical_speed(self, limit, count)

    def run_ucs(
        self, stiffness_range: tuple[float, float] = (1e6, 1e11), num: int = 30, num_modes: int = 4, **more: Any
    ) -> ucs.UcsResult:
        """Undamped critical speeds over the bearings' stiffness [N/m]; see ucs.run_ucs."""
        return ucs.run_ucs(self, stiffness_range, num, num_modes, **more)

    def run_stability(self, speeds: ArrayLike) -> stability.StabilityResult:
        """Least logarithmic decrement over `speeds` [rad/s] and the onset of instability; see stability.py."""
        return stability.run_stability(self, speeds)

    def run_unbalance_response(
        self, node: int | Sequence[int], magnitude: ArrayLike, phase: ArrayLike, frequency: ArrayLike
    ) -> response.ForcedResult:
        """Whirl forced by unbalance; see response.run_unbalance_response."""
        return response.run_unbalance_response(self, node, magnitude, phase, frequency)

    def run_freq_response(
        self,
        frequency: ArrayLike,
        speed: float | None = None,
        inputs: Sequence[int] | None = None,
        outputs: Sequence[int] | None = None,
    ) -> response.FrequencyResponse:
        """Receptance over `frequency` [rad/s]; see response.run_freq_response."""
        return response.run_freq_response(self, frequency, speed, inputs, outputs)

    def run_time_response(
        self,
        speed: float,
        F: ArrayLike | None,
        t: ArrayLike,
        initial: ArrayLike | None = None,
        unbalance: Sequence[transient.Unbalance] = (),
        gravity: float = 0.0,
    ) -> transient.TimeResult:
        """Motion under forces `F` (n_t, ndof) [N, N m] at times `t` [s]; see transient.run_time_response."""
        return transient.run_time_response(self, speed, F, t, initial, unbalance, gravity)

    @classmethod
    def from_ross(cls, rotor: Any) -> Rotor:
        """The same rotor from an object of the open code ROSS, by reading its attributes; see ross.py."""
        return cls(*ross.from_ross(rotor))

    def to_ross(self, module: Any) -> Any:
        """This rotor as an object of the open code ROSS; `module` is `import ross`; see ross.py."""
        return ross.to_ross(self, module)


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
