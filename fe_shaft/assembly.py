r"""Elements of a rotor in order along the shaft, its matrices M, C, G, K, and their reduction to a few modes.

Every element sits on a node of the shaft or on a pedestal; degrees of freedom are numbered by `DofLayout`.

A time simulation with a gas film takes a few modes per plane: those of the undamped rotor at rest, held at the gas
bearings by extra isotropic springs of about the films' stiffness k, so that the few kept modes already bend as the
supported shaft does; the springs are then taken out again:

.. math:: (K_p + k\, e e')\,\phi_i = \omega_i^2 M_p \phi_i, \quad
          \phi_i' M_p \phi_j = \delta_{ij}, \quad q = \Phi \eta

.. math:: \ddot\eta + \left(\Phi' C \Phi + \mathrm{diag}(2\zeta\omega_i) + \Omega\,\Phi' G \Phi\right)\dot\eta
          + \Phi' K \Phi\, \eta = \Phi' f

with K_p, M_p the blocks of plane p, (x, beta) or (y, alpha). Pedestals (point masses that carry a bearing) are part of
the rotor and of its modes.  What couples the planes (gyroscopics,
cross-coupled bearings) stays in the reduced matrices.

Source: modes with a loaded interface after Benfield & Hruda, AIAA J. 9 (1971) 1255.
Assumes: modal damping zeta of the shaft; modes at rest span the whirl at speed.

Cites: benfield_1971.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import groupby, pairwise
from math import isclose
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigh

from fe_shaft import elements
from fe_shaft.shaft import BearingElement, DiskElement, PointMass, ShaftElement, ShaftError

Matrix = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DofLayout:
    """Places of the degrees of freedom.

    `internal` maps the place of an element to the first of its internal ones, `pedestals` a node behind the shaft to
    its x; `axes` (ndof,) is 0, 1, 2, 3 for x, y, alpha, beta and likewise for internal ones; `free` are those nothing
    holds.
    """

    n_nodes: int
    internal: dict[int, int]
    pedestals: dict[int, int]
    axes: NDArray[np.intp]
    free: NDArray[np.intp]

    @property
    def ndof(self) -> int:
        """Number of degrees of freedom."""
        return len(self.axes)

    def place(self, node: int) -> int:
        """First degree of freedom of a node or pedestal."""
        return self.pedestals[node] if node in self.pedestals else 4 * node

    def element(self, place: int, node: int) -> NDArray[np.intp]:
        """Degrees of freedom (8,) or (12,) of a shaft element by its place in the list and its left node."""
        own = np.arange(4 * node, 4 * node + 8)
        first = self.internal.get(place)
        return own if first is None else np.concatenate([own, np.arange(first, first + 4)])

    def labels(self) -> list[str]:
        """Names such as '3.x'; 'e3.x' of an internal one of element 3, and 'p21.x' of a pedestal."""
        names = [f"{n}.{axis}" for n in range(self.n_nodes) for axis in ("x", "y", "alpha", "beta")]
        names += [f"e{n}.{axis}" for n in self.internal for axis in ("x", "y", "alpha", "beta")]
        return names + [f"p{n}.{axis}" for n in self.pedestals for axis in ("x", "y")]


@dataclass(frozen=True, eq=False)
class Parts:
    """Assembled matrices (ndof, ndof) of shaft and masses, and what the bearings add where they are constant.

    M holds the bearings' masses too, `M_bearings` them alone: they move with the shaft and have no weight.
    """

    M: Matrix
    G: Matrix
    K: Matrix
    C: Matrix
    N: Matrix
    """Part of the stiffness proportional to Omega."""
    H: Matrix
    """Stiffness times loss factor of hysteretic material."""
    N_h: Matrix
    """Circulatory stiffness of hysteretic material that the shaft overtakes."""
    K_bearings: Matrix
    C_bearings: Matrix
    M_bearings: Matrix


@dataclass(frozen=True)
class AssembledRotor:
    """Rotor with its matrices; the fields are those of `fe_shaft.Rotor`.

    Four degrees of freedom a node: x, y [m], alpha, beta [rad].
    """

    number_dof: ClassVar[int] = 4
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
        """Number of nodes of the shaft: one more than there are spans."""
        return len(self.spans) + 1

    @cached_property
    def spans(self) -> tuple[tuple[ShaftElement, ...], ...]:
        """Elements of each span from left to right, its layers."""
        return tuple(tuple(layers) for _, layers in groupby(self.shaft_elements, key=lambda element: element.n))

    @property
    def nodes_pos(self) -> NDArray[np.float64]:
        """Positions of the shaft's nodes along z (n_nodes,) [m]; node 0 at 0."""
        return np.concatenate([[0.0], np.cumsum([layers[0].L for layers in self.spans])])

    @property
    def mass(self) -> float:
        """Mass of shaft, discs and the point masses on the shaft [kg]."""
        shaft = sum(element.mass for element in self.shaft_elements)
        points = sum(point.my for point in self.point_mass_elements if point.n < self.n_nodes)
        return float(shaft + points + sum(disk.m for disk in self.disk_elements))

    @cached_property
    def layout(self) -> DofLayout:
        """Places of the degrees of freedom."""
        return lay_out(self)

    @property
    def ndof(self) -> int:
        """Number of degrees of freedom, held ones included."""
        return self.layout.ndof

    @property
    def free(self) -> NDArray[np.intp]:
        """Numbers (n_free,) of the degrees of freedom that nothing holds."""
        return self.layout.free

    @property
    def hysteretic(self) -> bool:
        """Whether the shaft has hysteretic damping."""
        return any(element.eta_h for element in self.shaft_elements)

    @property
    def by_whirl(self) -> bool:
        """Whether stiffness or damping depend on the frequency of whirl, not on the speed alone."""
        return self.hysteretic or any(bearing.whirl_frequency is not None for bearing in self.bearing_elements)

    def M(self) -> Matrix:
        """Mass matrix (ndof, ndof) [kg, kg m, kg m2]."""
        return self.parts.M.copy()

    def K(self, speed: float = 0.0, whirl: float | None = None) -> Matrix:
        """Stiffness matrix (ndof, ndof) [N/m, N, N m] at `speed` and `whirl` frequency [rad/s], else synchronous."""
        K = self.parts.K + self.parts.K_bearings + speed * self.parts.N
        if self.hysteretic:
            K = K + hysteretic_shares(speed, whirl)[0] * self.parts.N_h
        for bearing in self.bearing_elements:
            if not bearing.constant:
                _add(self.layout, K, bearing, bearing.stiffness_at(speed, whirl))
        return K

    def C(self, speed: float = 0.0, whirl: float | None = None) -> Matrix:
        """Damping matrix (ndof, ndof) [N s/m, N s, N m s] at `speed` and `whirl` frequency [rad/s]."""
        C = self.parts.C + self.parts.C_bearings
        if self.hysteretic:
            C = C + hysteretic_shares(speed, whirl)[1] * self.parts.H
        for bearing in self.bearing_elements:
            if not bearing.constant:
                _add(self.layout, C, bearing, bearing.damping_at(speed, whirl))
        return C

    def G(self) -> Matrix:
        """Gyroscopic matrix (ndof, ndof) [kg m2 and lower], to be multiplied by the speed [rad/s]."""
        return self.parts.G.copy()

    @cached_property
    def parts(self) -> Parts:
        """The assembled matrices of shaft and masses; not to be written into."""
        return assemble(self, self.layout)


def hysteretic_shares(speed: float, whirl: float | None) -> tuple[float, float]:
    """Share [1] of the circulatory stiffness N_h and time [s] of H at a speed and frequency [rad/s], else synchronous.

    A motion at the frequency is a forward and a backward whirl, each strained at its frequency against the shaft.
    """
    omega = abs(speed) if whirl is None else whirl
    forward, backward = np.sign(omega - speed), np.sign(-omega - speed)
    return -(forward + backward) / 2, (forward - backward) / (2 * omega) if omega else 0.0


def _numbered(shaft: tuple[ShaftElement, ...]) -> tuple[ShaftElement, ...]:
    """The elements in order of their numbers, layers of a span side by side; without numbers, in the order given."""
    if not shaft:
        raise ShaftError("rotor: the shaft has no elements; give at least one ShaftElement.")
    numbers = [element.n for element in shaft]
    if all(n is None for n in numbers):
        return tuple(replace(element, n=n) for n, element in enumerate(shaft))
    given = {n for n in numbers if n is not None}
    if None in numbers or given != set(range(len(given))):
        raise ShaftError(
            f"rotor: the shaft elements are numbered {numbers}, but spans are numbered from 0 without a gap; correct "
            "them, or leave all of them out to number by order."
        )
    ordered = sorted(shaft, key=lambda element: (element.n or 0, element.idl))
    for inner, outer in pairwise(ordered):
        if inner.n == outer.n:
            _check_layers(inner, outer)
    return tuple(sorted(shaft, key=lambda element: element.n or 0))


def _check_layers(inner: ShaftElement, outer: ShaftElement) -> None:
    """Raise ShaftError unless two layers of a span are as long as each other and one lies around the other."""
    where = f"rotor: layers of span {inner.n}"
    if not isclose(inner.L, outer.L, rel_tol=1e-9):
        raise ShaftError(f"{where} are {inner.L:g} m and {outer.L:g} m long; make them equal.")
    for inside, outside in ((inner.odl, outer.idl), (inner.odr, outer.idr)):
        if outside < inside * (1 - 1e-9):
            raise ShaftError(f"{where} overlap: a bore of {outside:g} m around {inside:g} m; correct one.")


def _check(rotor: AssembledRotor) -> None:
    """Raise ShaftError if something does not sit where it can."""
    last = rotor.n_nodes - 1
    links = [b.n_link for b in rotor.bearing_elements if b.n_link is not None and b.n_link > last]
    _check_nodes("disc", (disk.n for disk in rotor.disk_elements), last)
    _check_nodes("bearing", (b.n for b in rotor.bearing_elements), last, links)
    _check_nodes("point mass", (point.n for point in rotor.point_mass_elements), last, links)
    _check_nodes("clamp", rotor.clamped, last)
    _check_nodes("pin", rotor.pinned, last)
    nodes = [bearing.n for bearing in rotor.bearing_elements]
    for node in nodes:
        if nodes.count(node) > 1:
            raise ShaftError(f"rotor: {nodes.count(node)} bearings at node {node}; add their coefficients in one.")
    for node in links:
        if not any(p.n == node and min(p.mx, p.my) > 0 for p in rotor.point_mass_elements):
            raise ShaftError(f"rotor: the pedestal at node {node} has no mass; add PointMass({node}, m).")


def _check_nodes(what: str, nodes: Iterable[int], last: int, more: Sequence[int] = ()) -> None:
    for node in nodes:
        if not 0 <= node <= last and node not in more:
            raise ShaftError(f"rotor: {what} at node {node}, but the shaft has nodes 0 to {last}; move the {what}.")


def lay_out(rotor: AssembledRotor) -> DofLayout:
    """Give every degree of freedom its place."""
    last = rotor.n_nodes
    inside = [n for n, element in enumerate(rotor.shaft_elements) if element.internal]
    base = 4 * last
    internal = {n: base + 4 * k for k, n in enumerate(inside)}
    base += 4 * len(inside)
    links = {b.n_link for b in rotor.bearing_elements if b.n_link is not None and b.n_link >= last}
    pedestals = {n: base + 2 * k for k, n in enumerate(sorted(links))}
    axes = np.concatenate([np.tile(np.arange(4), last + len(inside)), np.tile(np.arange(2), len(pedestals))])
    held = [4 * n + axis for n in rotor.clamped for axis in range(4)] + [
        4 * n + a for n in rotor.pinned for a in (0, 1)
    ]
    return DofLayout(last, internal, pedestals, axes, np.setdiff1d(np.arange(len(axes)), held))


def assemble(rotor: AssembledRotor, layout: DofLayout) -> Parts:
    """The matrices that do not change with speed."""

    bare = _of_shaft(tuple(rotor.shaft_elements))
    M, G, K, C, N, H, N_h = (np.pad(own, (0, layout.ndof - len(own))) for own in bare)
    for disk in rotor.disk_elements:
        place = slice(4 * disk.n, 4 * disk.n + 4)
        M[place, place] += elements.disk_mass_matrix(disk)
        G[place, place] += elements.disk_gyroscopic_matrix(disk)
    for point in rotor.point_mass_elements:
        first = layout.place(point.n)
        M[first, first] += point.mx
        M[first + 1, first + 1] += point.my
    M_b = np.zeros_like(M)
    for bearing in rotor.bearing_elements:
        if bearing.mxx or bearing.myy:
            _add(layout, M_b, bearing, np.diag([bearing.mxx, bearing.myy]))
    if M_b.any():
        M += M_b
    damped = _mass_damping(rotor, layout)
    C = C if damped is None else C + damped
    constant = [b for b in rotor.bearing_elements if b.constant]
    K_b, C_b = np.zeros_like(M), np.zeros_like(M)
    for bearing in constant:
        _add(layout, K_b, bearing, bearing.stiffness)
        _add(layout, C_b, bearing, bearing.damping)
    return Parts(M, G, K, C, N, H, N_h, K_b, C_b, M_b)


@lru_cache(maxsize=4)
def _of_shaft(shaft: tuple[ShaftElement, ...]) -> list[Matrix]:
    """M, G, K, C, N, H, N_h of the shaft's own degrees of freedom, which come first in every layout.

    Rotors of one shaft, on other bearings or with other discs, share them; they are not to be written into.
    """
    alone = AssembledRotor(shaft)
    layout, every = alone.layout, [np.zeros((alone.ndof, alone.ndof)) for _ in range(7)]
    parts: Sequence[tuple[Callable[[ShaftElement], Matrix], bool]] = (
        (elements.mass_matrix, True), (elements.gyroscopic_matrix, True), (_stiffness, True),
        (_material_damping, any(e.alpha or e.beta or e.eta_v for e in shaft)),
        (_viscous_circulation, any(e.eta_v for e in shaft)),
        (_hysteretic_loss, alone.hysteretic), (_hysteretic_circulation, alone.hysteretic),
    )  # fmt: skip
    for full, (matrix, used) in zip(every, parts, strict=True):
        for number, element in enumerate(shaft if used else ()):
            assert element.n is not None
            dofs = layout.element(number, element.n)
            full[np.ix_(dofs, dofs)] += matrix(element)
        full.flags.writeable = False
    return every


def _mass_damping(rotor: AssembledRotor, layout: DofLayout) -> Matrix | None:
    """Damping alpha M (ndof, ndof) of discs and point masses; None where none has any."""
    if not any([*(disk.alpha for disk in rotor.disk_elements), *(p.alpha for p in rotor.point_mass_elements)]):
        return None
    C = np.zeros((layout.ndof, layout.ndof))
    for disk in rotor.disk_elements:
        place = slice(4 * disk.n, 4 * disk.n + 4)
        C[place, place] += disk.alpha * elements.disk_mass_matrix(disk)
    for point in rotor.point_mass_elements:
        first = layout.place(point.n)
        C[first, first] += point.alpha * point.mx
        C[first + 1, first + 1] += point.alpha * point.my
    return C


def _add(layout: DofLayout, matrix: Matrix, bearing: BearingElement, block: Matrix) -> None:
    own = layout.place(bearing.n)
    here = slice(own, own + 2)
    matrix[here, here] += block
    if bearing.n_link is not None:
        other = layout.place(bearing.n_link)
        there = slice(other, other + 2)
        matrix[there, there] += block
        matrix[here, there] -= block
        matrix[there, here] -= block


def _stiffness(element: ShaftElement) -> Matrix:
    K = elements.stiffness_matrix(element)
    if element.torque:
        K = K + element.torque * elements.torque_matrix(element)
    return K


def _viscous_circulation(element: ShaftElement) -> Matrix:
    return element.eta_v * elements.circulatory_matrix(element)


def _hysteretic_loss(element: ShaftElement) -> Matrix:
    return element.eta_h * elements.elastic_matrix(element)


def _hysteretic_circulation(element: ShaftElement) -> Matrix:
    return element.eta_h * elements.circulatory_matrix(element)


def _material_damping(element: ShaftElement) -> Matrix:
    stiff = (element.beta + element.eta_v) * elements.elastic_matrix(element)
    return element.alpha * elements.mass_matrix(element) + stiff


RIGID = {
    "x": (1.0, 0.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0, 0.0),
    "tilt about y": (0.0, 0.0, 0.0, 1.0),
    "tilt about x": (0.0, 0.0, 1.0, 0.0),
}
"""Rigid motions of a shaft: x, y, alpha and beta of a node at its origin."""


def rigid_motions(rotor: AssembledRotor) -> NDArray[np.float64]:
    """The four motions (ndof, 4) of the rigid shaft, pedestals and internal coordinates at rest; tilts over length."""
    z = rotor.nodes_pos / rotor.nodes_pos[-1]
    motions = np.zeros((rotor.ndof, 4))
    for column, motion in enumerate(RIGID.values()):
        nodes = np.tile(motion, (rotor.n_nodes, 1))
        if column >= 2:
            nodes[:, 2:] /= rotor.nodes_pos[-1]
            nodes[:, 0], nodes[:, 1] = motion[3] * z, -motion[2] * z
        motions[: 4 * rotor.n_nodes, column] = nodes.ravel()
    return motions


def loose_motions(rotor: AssembledRotor) -> list[str]:
    """Names of the rigid-body motions, two shifts and two tilts, that the supports do not resist."""
    if rotor.clamped:
        return []
    motions = rigid_motions(rotor)
    resist = motions.T @ (rotor.K() - rotor.parts.K) @ motions
    for node in rotor.pinned:
        rows = motions[4 * node : 4 * node + 2]
        resist += np.abs(rotor.parts.K).max() * rows.T @ rows
    missing = 4 - int(np.linalg.matrix_rank(resist))
    values, vectors = np.linalg.eigh((resist + resist.T) / 2)
    size = np.abs(vectors) * np.array([1.0, 1.0, 1.001, 1.001])[:, None]  # to turn about a bearing at an end is a tilt
    loose = [list(RIGID)[int(size[:, i].argmax())] for i in np.argsort(np.abs(values))]
    return sorted(set(loose[:missing]))


@dataclass(frozen=True, eq=False)
class ReducedRotor:
    """Rotor in modal coordinates eta (2n,): n of the x plane, then n of the y plane; the mass matrix is I.

    Attributes
    ----------
    Phi : ndarray (ndof, 2n)
        Mass-normalised modes [kg^-1/2 and kg^-1/2/m].
    K : ndarray (2n, 2n)
        Stiffness without the nominal spring [1/s2].
    C : ndarray (2n, 2n)
        Damping of the bearings and of the modes [1/s].
    G : ndarray (2n, 2n)
        Gyroscopic matrix [1], to be multiplied by the speed [rad/s].
    frequencies : ndarray (2n,)
        Natural frequencies with the nominal spring [rad/s].
    participation : ndarray (2, 2n)
        Rows Phi' M 1_x and Phi' M 1_y [kg^1/2] of shaft and discs, without pedestals.
    modal_damping : ndarray (2n, 2n)
        What the shaft's damping ratio has in C [1/s].
    """

    Phi: Matrix
    K: Matrix
    C: Matrix
    G: Matrix
    frequencies: Matrix
    participation: Matrix
    modal_damping: Matrix

    def shape(self, position_node: int) -> Matrix:
        """Modes at a node (2, 2n) [kg^-1/2]: (x, y) = shape @ eta, and shape.T @ force is the modal force."""
        if not 0 <= 4 * position_node < len(self.Phi):
            raise ShaftError(f"reduced rotor: node {position_node} is not among 0 to {len(self.Phi) // 4 - 1}.")
        return self.Phi[4 * position_node : 4 * position_node + 2]

    def body(self) -> Matrix:
        """Participation of the modes in x and y (2, 2n) [kg^1/2]; gravity g along -y acts as -g * row 1."""
        return self.participation


def modal_reduction(
    rotor: AssembledRotor, springs: Mapping[int, float], n_modes: int, damping_ratio: ArrayLike,
    loads: Matrix | None = None,
) -> ReducedRotor:  # fmt: skip
    """Reduce `rotor` to `n_modes` modes of each plane.

    Parameters
    ----------
    rotor : AssembledRotor
        Its linear bearings and pedestals stay part of it.
    springs : mapping of int to float
        Nominal stiffness [N/m] of every gas bearing by its node; empty for a rotor on its linear bearings alone. Where
        the rotor has a bearing on a pedestal at that node, it acts between the two.
    n_modes : int
        Modes kept in each plane.
    damping_ratio : float or array (k,)
        Modal damping of the shaft [1]: of all modes, or of the first ones of each plane and, as the last, of the rest.
    loads : ndarray (ndof, k), optional
        Loads whose static deflections, k more shapes of each plane, are exact in the reduced rotor.

    Raises
    ------
    ShaftError
        If a node is not on the shaft, the planes have not `n_modes` modes, or the shaft has damping in the turning
        frame, which the reduced matrices at rest do not show.

    Examples
    --------
    >>> import fe_shaft
    >>> fe_shaft.modal_reduction(rotor, {6: 4e6}, n_modes=4, damping_ratio=0.01).K.shape
    (8, 8)
    """
    _check_reduction(rotor, springs, n_modes)
    M, K, C, G = rotor.M(), rotor.K(), rotor.C(), rotor.G()
    held = add_springs(K, rotor, springs)
    planes = [_plane_modes(M, held, rotor.layout.axes, dofs, n_modes, loads) for dofs in ((0, 3), (1, 2))]
    omega, Phi = (np.concatenate(parts, axis=-1) for parts in zip(*planes, strict=True))
    ratios = np.atleast_1d(damping_ratio)
    ratio = ratios[np.minimum(np.arange(len(omega) // 2), len(ratios) - 1)]
    modal_damping = np.diag(2 * np.tile(ratio, 2) * omega)
    if rotor.layout.pedestals and ratio.any():
        modal_damping = _shaft_damping(rotor, springs, n_modes, damping_ratio, M, Phi)
    shifts = rigid_motions(rotor)[:, :2].T
    C, G = Phi.T @ C @ Phi + modal_damping, Phi.T @ G @ Phi
    return ReducedRotor(Phi, Phi.T @ K @ Phi, C, G, omega, shifts @ (M - rotor.parts.M_bearings) @ Phi, modal_damping)


def _shaft_damping(
    rotor: AssembledRotor, springs: Mapping[int, float], n_modes: int, damping_ratio: ArrayLike, M: Matrix, Phi: Matrix
) -> Matrix:
    """Modal damping of the shaft on pedestals at rest, in the modes Phi: pedestals have dampers of their own."""
    n = 4 * rotor.n_nodes
    held = [replace(b, n_link=None) for b in rotor.bearing_elements if b.n < rotor.n_nodes]
    masses = [m for m in rotor.point_mass_elements if m.n < rotor.n_nodes]
    shaft = replace(rotor, bearing_elements=held, point_mass_elements=masses)
    own = modal_reduction(shaft, springs, min(n_modes, 2 * rotor.n_nodes), damping_ratio)
    P = own.Phi[:n].T @ M[:n, :n] @ Phi[:n]
    return P.T @ own.modal_damping @ P


def add_springs(K: Matrix, rotor: AssembledRotor, springs: Mapping[int, float]) -> Matrix:
    """A stiffness matrix (ndof, ndof) of `rotor` with isotropic springs [N/m] at nodes, against their pedestals."""
    total = K.copy()
    links = {b.n: b.n_link for b in rotor.bearing_elements}
    for node, stiffness in springs.items():
        own, link = 4 * node, links.get(node)
        block = stiffness * np.eye(2)
        total[own : own + 2, own : own + 2] += block
        if link is not None:
            other = rotor.layout.place(link)
            total[other : other + 2, other : other + 2] += block
            total[own : own + 2, other : other + 2] -= block
            total[other : other + 2, own : own + 2] -= block
    return total


def _plane_modes(
    M: Matrix, K: Matrix, axes: NDArray[np.intp], dofs: tuple[int, int], n_modes: int, loads: Matrix | None
) -> tuple[Matrix, Matrix]:
    """Frequencies (n,) [rad/s] and mass-normalised modes (ndof, n) of one plane, those of the loads included."""
    plane = np.flatnonzero(np.isin(axes, dofs))
    block = np.ix_(plane, plane)
    squares, vectors = eigh(K[block], M[block], subset_by_index=(0, n_modes - 1))
    if loads is not None:
        deflections = np.linalg.lstsq(K[block], loads[plane], rcond=None)[0]
        root = np.linalg.cholesky(M[block]).T
        basis = np.linalg.solve(root, np.linalg.qr(root @ np.hstack([vectors, deflections]))[0])
        squares, turned = eigh(basis.T @ K[block] @ basis)
        vectors = basis @ turned
    Phi = np.zeros((len(M), len(squares)))
    Phi[plane] = vectors
    return np.sqrt(np.clip(squares, 0, None)), Phi * _signs(Phi[axes == dofs[0]])


def _signs(deflection: Matrix) -> Matrix:
    """Make the first node that moves at least half as far as the farthest one move in the positive direction.

    The farthest node itself would not do: rounding chooses it in an antisymmetric mode.
    """
    size = np.abs(deflection)
    first = (size >= 0.5 * size.max(axis=0)).argmax(axis=0)
    return np.where(deflection[first, np.arange(deflection.shape[1])] < 0, -1.0, 1.0)


def _check_reduction(rotor: AssembledRotor, nodes: Iterable[int], n_modes: int) -> None:
    turning = next((name for name in ("eta_v", "eta_h") if any(getattr(e, name) for e in rotor.shaft_elements)), None)
    if turning:
        raise ShaftError(
            f"reduction: the shaft has {turning}, turning damping, which reduced matrices lack; leave it out."
        )
    for node in nodes:
        if not 0 <= node < rotor.n_nodes:
            last = rotor.n_nodes - 1
            raise ShaftError(f"reduction: node {node}, but the shaft has nodes 0 to {last}; choose another.")
    most = 2 * rotor.n_nodes + len(rotor.layout.pedestals)
    if not 1 <= n_modes <= most:
        raise ShaftError(
            f"reduction: {n_modes} modes a plane, but {rotor.n_nodes} nodes have 1 to {most}; "
            "keep fewer or use more elements."
        )
