"""Finite-element rotor of a machine and its modal reduction; one that buckles or hangs loose is refused."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

import fe_shaft
from fe_shaft import (
    BearingElement,
    DiskElement,
    Material,
    PointMass,
    ReducedRotor,
    ShaftElement,
    modal_reduction,
)
from fe_shaft.assembly import AssembledRotor, add_springs, loose_motions
from fe_shaft.elements import deflection
from fe_shaft.response import StaticResult, run_static
from fe_shaft.shaft import mirrored
from rotorsim.base.errors import MachineFileError
from rotorsim.effects import Effect
from rotorsim.effects.base import HOUSING, OFF_SHAFT
from rotorsim.machine.bearings import BearingPart, Support, TableBearing
from rotorsim.machine.rotor import ShaftPiece
from rotorsim.machine.schema import Machine
from rotorsim.machine.tables import SAME_PLACE

RIGID_MOTIONS = 4
"""Motions of a free shaft that bend nothing: two in each plane."""
SHEAR_STEP = 1e-4
"""Relative change of the shaft's compliance in shear for a derivative."""


@lru_cache(maxsize=64)
def _material(density: float, youngs_modulus: float, poisson_ratio: float) -> Material:
    return Material("shaft", density, youngs_modulus, Poisson=poisson_ratio)


@dataclass(frozen=True, eq=False)
class Tables:
    """Bearings that are tables: speeds (points,) [rad/s] at which any of them has a point.

    `values` are stiffness and damping (points, 2, 2, 2) [N/m, N s/m] there by index of the bearing.
    """

    speeds: np.ndarray
    values: dict[int, np.ndarray]
    last: float = 0.0
    """Last speed [rad/s] of any of them."""

    def at(self, number: int, speed: float) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness and damping (2, 2) of a bearing as runs and models have them at a speed [rad/s] of either sense."""
        columns = self.values[number].reshape(len(self.speeds), -1).T
        K, C = np.array([np.interp(abs(speed), self.speeds, one) for one in columns]).reshape(2, 2, 2)
        return (mirrored(K), mirrored(C)) if speed < 0 else (K, C)


@dataclass(frozen=True)
class Mesh:
    """Rotor of a machine: `nodes` are coordinates z [m]."""

    machine: Machine
    other_bearings: bool = False
    """Whether the reduced shaft bends as it should on bearings of other stiffness than those of the machine too."""

    @cached_property
    def nodes(self) -> np.ndarray:
        """Node coordinates: ends of sections and every part's position, then equal elements in between."""
        marks = np.unique(np.round(self._marks(), 9))
        marks = marks[np.concatenate([[True], np.diff(marks) > SAME_PLACE])]
        longest = self.machine.shaft.max_element_length
        pieces = [np.linspace(a, b, int(np.ceil((b - a) / longest - 1e-9)) + 1)[:-1] for a, b in pairwise(marks)]
        return np.concatenate([*pieces, marks[-1:]])

    def _marks(self) -> list[float]:
        machine = self.machine
        ends = list(machine.shaft.start + np.cumsum([0.0] + [s.length for s in machine.shaft.sections]))
        places = [d.seated for d in machine.discs] + [b.position for b in machine.bearings]
        places += [mass.position for mass in machine.point_masses]
        places += [z for layer in machine.shaft.layers for z in (layer.position, layer.end)]
        places += [self.seat(self.probe)[0]]
        places += [self.seat(self.place(e), self.on_disc(e))[0] for es in machine.effects.values() for e in es]
        return [*ends, *(min(max(z, ends[0]), ends[-1]) for z in places)]

    @property
    def probe(self) -> float:
        """Coordinate z [m] of the measured plane: the probe, else the first disc, else the middle of the shaft."""
        machine = self.machine
        if machine.probe is not None:
            return machine.probe.position
        if machine.discs:
            return machine.discs[0].position
        return 0.5 * (machine.shaft.start + machine.shaft.end)

    def place(self, effect: Effect) -> float:
        """Coordinate z [m] at which an effect acts."""
        position = getattr(effect, "position", None)
        if position is not None:
            return float(position)
        films, number = self.machine.films, self.machine.film_number(effect)
        if effect.place == "film" and films:
            return films[number or 0].position
        if effect.place == "start":
            return self.machine.shaft.start
        bearing = self.bearing_number(effect)
        if bearing is not None:
            return self.machine.bearings[bearing].position
        return self.machine.discs[0].position if self.machine.discs else self.probe

    def bearing_number(self, effect: Effect) -> int | None:
        """Index of the linear bearing in which an effect acts; None for an effect that acts elsewhere."""
        return self.machine.spring_number(effect) if effect.place == "bearing" else None

    def on_disc(self, effect: Effect) -> bool:
        """Whether an effect acts on a disc that has its centre of gravity there; films and bearings hold the shaft."""
        return effect.place == "disc"

    def seat(self, z: float, on_disc: bool = False) -> tuple[float, float]:
        """Coordinate on the shaft [m] that moves a place at z, and the rigid arm [m] between them.

        There is an arm to a disc's centre of gravity off its seat, for what acts `on_disc` and for all beyond the
        shaft's ends; elsewhere z is on the shaft itself, also where a disc reaches over it.
        """
        shaft = self.machine.shaft
        if on_disc or not shaft.start - SAME_PLACE <= z <= shaft.end + SAME_PLACE:
            for disc in self.machine.discs:
                if disc.arm and abs(disc.position - z) <= SAME_PLACE:
                    return disc.seated, disc.arm
        return z, 0.0

    def node(self, z: float) -> int:
        """Number of the node at z."""
        return int(np.abs(self.nodes - z).argmin())

    @cached_property
    def rotor(self) -> AssembledRotor:
        """The finite-element rotor on its bearings without a film, housings and tables included."""
        return self._rotor(tables=True, films=False)

    @cached_property
    def constant(self) -> AssembledRotor:
        """The rotor on what holds it at any speed: films and tables have no stiffness."""
        return self._rotor(tables=False, films=True)

    def _rotor(self, tables: bool, films: bool) -> AssembledRotor:
        bearings = []
        masses = [PointMass(self.node(one.position), m=one.mass) for one in self.machine.point_masses]
        for number, bearing in enumerate(self.machine.bearings):
            link = self._pedestals.get(number)
            if bearing.coefficients is None and not films:
                continue
            if tables and isinstance(bearing, TableBearing):
                bearings.append(self._bearing(bearing, *bearing.table, link))
            elif bearing.coefficients is not None and not bearing.speeds.size:
                bearings.append(self._bearing(bearing, *bearing.coefficients, {}, link))
            elif link is not None or any(bearing.masses):
                bearings.append(self._bearing(bearing, np.zeros((2, 2)), np.zeros((2, 2)), {}, link))
            if link is not None and bearing.support is not None:
                bearings.append(_ground(link, bearing.support))
                masses.append(PointMass(link, m=bearing.support.mass))
        return AssembledRotor(self._elements, self._discs(), bearings, masses)

    @cached_property
    def _pedestals(self) -> dict[int, int]:
        """Nodes behind those of the shaft, by index of the bearing whose housing moves."""
        return {number: len(self.nodes) + k for k, number in enumerate(self.machine.supported)}

    @cached_property
    def springs(self) -> dict[int, float]:
        """Isotropic springs [N/m] by node that stand for films and tables when modes are chosen, nowhere else."""
        return {self.node(b.position): b.spring for b in self.machine.bearings if b.spring is not None}

    def _discs(self) -> list[DiskElement]:
        return [
            DiskElement(self.node(d.seated), d.mass, d.diametral_inertia, d.polar_inertia, offset=d.arm)
            for d in self.machine.discs
        ]

    @cached_property
    def _elements(self) -> list[ShaftElement]:
        shaft = self.machine.shaft
        starts = shaft.start + np.cumsum([0.0, *(s.length for s in shaft.sections)])
        elements = []
        for n, (a, b) in enumerate(pairwise(self.nodes)):
            middle = 0.5 * (a + b)
            k = min(int(np.searchsorted(starts[1:], middle)), len(shaft.sections) - 1)
            section = shaft.sections[k]
            force = section.axial_force or 0.0
            elements.append(self._element(n, section, a - starts[k], b - starts[k], b - a, axial_force=force))
            for layer in shaft.layers:
                if layer.position < middle < layer.end:
                    stiff = layer.carries != "mass"
                    own = a - layer.position, b - layer.position
                    elements.append(self._element(n, layer, *own, b - a, stiff=stiff))
        return elements

    def _element(self, n: int, piece: ShaftPiece, a: float, b: float, L: float, **more: Any) -> ShaftElement:
        """Element n, of length L [m], of a piece between a and b [m] from its left end."""
        (idl, odl), (idr, odr) = piece.diameters(a), piece.diameters(b)
        own = piece.material or self.machine.shaft.material
        material = _material(own.density, own.youngs_modulus, own.poisson_ratio)
        return ShaftElement(L, idl, odl, idr, odr, material=material, n=n, **more)

    def _bearing(
        self, bearing: BearingPart, K: np.ndarray, C: np.ndarray, axes: dict[str, np.ndarray], link: int | None
    ) -> BearingElement:
        """A bearing with stiffness and damping (2, 2), or of each point of its axes (..., 2, 2)."""
        mxx, myy = bearing.masses
        return BearingElement(
            self.node(bearing.position), K[..., 0, 0], C[..., 0, 0], K[..., 1, 1], K[..., 0, 1], K[..., 1, 0],
            C[..., 1, 1], C[..., 0, 1], C[..., 1, 0], n_link=link, extrapolate="hold", mxx=mxx, myy=myy, **axes,
        )  # fmt: skip

    @cached_property
    def whirling(self) -> dict[int, TableBearing]:
        """Bearings whose tables are over the whirl frequency too, by index."""
        found = enumerate(self.machine.bearings)
        return {i: b for i, b in found if isinstance(b, TableBearing) and b.whirl.size}

    @cached_property
    def tables(self) -> Tables:
        """Bearings that are tables over the speed."""
        found = {i: b for i, b in enumerate(self.machine.bearings) if isinstance(b, TableBearing)}
        if not found:
            return Tables(np.zeros(0), {})
        speeds = np.unique(np.concatenate([b.speeds for b in found.values()]))
        return Tables(
            speeds,
            {i: np.array([b.at(speed) for speed in speeds]) for i, b in found.items()},
            max(b.reach[1] for b in found.values()),
        )

    @cached_property
    def resting(self) -> StaticResult:
        """Rest of shaft and discs under gravity on the bearings' nominal stiffness; housings stand still.

        Raises ShaftError where the bearings leave the shaft free to fall or tilt.
        """
        held = []
        for bearing in self.machine.bearings:
            K = bearing.coefficients
            own = bearing.spring or (0.5 * float(np.trace(K[0])) if K is not None else 0.0)
            held.append(BearingElement(self.node(bearing.position), own, 0.0))
        points = [p for p in self.constant.point_mass_elements if p.n < len(self.nodes)]
        return run_static(replace(self.constant, bearing_elements=held, point_mass_elements=points))

    def _loose(self) -> str:
        """Rigid-body motions that the bearings do not resist, as a text."""
        held = [b for b in self.constant.bearing_elements if b.n not in self.springs and b.n < len(self.nodes)]
        held = [replace(b, n_link=None) for b in held]
        held += [BearingElement(node, stiffness, 0.0) for node, stiffness in self.springs.items()]
        shaft = replace(self.constant, bearing_elements=held, point_mass_elements=())
        return ", ".join(loose_motions(shaft)) or "hardly held"

    @cached_property
    def reduced(self) -> ReducedRotor:
        """The modes the time simulation uses."""
        machine = self.machine
        modes = min(machine.solver.modes_per_plane, 2 * len(self.nodes)) + len(machine.supported)
        loads = self._bearing_loads if self.other_bearings else None
        if loads is not None:
            modes = min(modes, 2 * len(self.nodes) + len(machine.supported) - loads.shape[1])
        reduced = modal_reduction(self.constant, self.springs, modes, machine.shaft.damping_ratios, loads)
        own = reduced.frequencies.reshape(2, -1)[:, :modes]  # the deflections of the loads follow, and are no modes
        if own.min() < 1e-4 * own.max():
            pushed = min(section.axial_force or 0.0 for section in machine.shaft.sections)
            if pushed < 0:
                raise MachineFileError(
                    f"shaft.sections: an axial force of {pushed:g} N buckles the shaft; push less or hold it better",
                    argument="shaft.sections",
                    value=pushed,
                )
            raise MachineFileError(
                f"bearings: they leave the shaft free to fall or to tilt ({self._loose()}); add a bearing or stiffness"
            )
        return reduced

    @property
    def _bearing_loads(self) -> np.ndarray:
        """Loads (ndof, bearings) of 1 N along x and y between the shaft and the housing of each bearing."""
        loads = np.zeros((self.constant.ndof, len(self.machine.bearings)))
        for i, bearing in enumerate(self.machine.bearings):
            first = 4 * self.node(bearing.position)
            loads[first : first + 2, i] = 1.0
            if (link := self._pedestals.get(i)) is not None:
                first = self.constant.layout.place(link)
                loads[first : first + 2, i] = -1.0
        return loads

    def shape(self, z: float, on_disc: bool = False) -> np.ndarray:
        """Modes (2, 2n) at z [m], at the end of the rigid arm where `seat` has one."""
        seat, arm = self.seat(z, on_disc)
        node = self.node(seat)
        rows = self.reduced.shape(node)
        if arm:
            alpha, beta = self.reduced.Phi[4 * node + 2 : 4 * node + 4]
            rows = rows + arm * np.array([beta, -alpha])
        return rows

    def housing(self, bearing: int) -> np.ndarray:
        """Rows (2, 2n) of the displacement of a bearing's housing; zeros for one that stands still."""
        node = self._pedestals.get(bearing)
        if node is None:
            return np.zeros((2, self.reduced.Phi.shape[1]))
        first = self.constant.layout.place(node)
        return np.asarray(self.reduced.Phi[first : first + 2])

    def between(self, bearing: int) -> np.ndarray:
        """Rows (2, 2n) of the shaft's displacement against the housing of a bearing."""
        return self.shape(self.machine.bearings[bearing].position) - self.housing(bearing)

    def moving(self, what: str, z: float) -> np.ndarray:
        """Rows (2, 2n) of the displacement of what moves at z [m]: the shaft, or one of `OFF_SHAFT`.

        Raises MachineFileError where no bearing with a housing that moves stands there.
        """
        if what not in OFF_SHAFT:
            return self.shape_between(z)
        if (number := self.machine.housing_at(z)) is not None:
            return self.housing(number) if what == HOUSING else self.between(number)
        raise MachineFileError(
            f"effects: no housing moves {1e3 * z:.6g} mm along the shaft; give a bearing there a support",
            argument="position",
            value=z,
        )

    def influence(self, effect: Effect) -> np.ndarray:
        """Rows (2, 2n) through which an effect acts: a node's, a bearing's, a housing's, the whole mass's or a bow's.

        The weight of a housing is taken out by its alignment; a foundation that shakes, shakes it too.
        """
        if effect.influence == "bow":
            return self.bow
        if effect.influence == "mass":
            return self.reduced.body() if type(effect).foundation is None else self.shaken_mass
        if effect.influence in OFF_SHAFT:
            return self.moving(effect.influence, self.place(effect))
        number = self.bearing_number(effect)
        return self.shape_between(self.place(effect), self.on_disc(effect)) if number is None else self.between(number)

    @property
    def shaken_mass(self) -> np.ndarray:
        """Participation (2, 2n) in the modes [kg^1/2] of all that stands on the foundation: rotor and housings."""
        rows = np.array(self.reduced.body())
        for number in self.machine.supported:
            support = self.machine.bearings[number].support
            assert support is not None
            rows += support.mass * self.housing(number)
        return rows

    @property
    def shaft_modes(self) -> np.ndarray:
        """Modes (4 nodes, 2n) of the shaft alone."""
        return self.reduced.Phi[: 4 * len(self.nodes)]

    def slope(self, z: float) -> np.ndarray:
        """Tilts (2, 2n) dX/dz, dY/dz of the shaft's cross section at a node z [m] in every mode."""
        k = 4 * self.node(z)
        return np.stack([self.reduced.Phi[k + 3], -self.reduced.Phi[k + 2]])

    def shape_between(self, z: float, on_disc: bool = False) -> np.ndarray:
        """Modes (2, 2n) at any z [m], in the shapes of the element there; the mesh needs no node at z."""
        place = float(z), on_disc
        if place not in self._shapes:
            self._shapes[place] = self._shape_between(*place)
            self._shapes[place].flags.writeable = False
        return self._shapes[place]

    @cached_property
    def _shapes(self) -> dict[tuple[float, bool], np.ndarray]:
        """Modes by place, as they were asked for: analyses over the speed ask for the same ones at every speed."""
        return {}

    def _shape_between(self, z: float, on_disc: bool) -> np.ndarray:
        nodes = self.nodes
        if self.seat(z, on_disc)[1] or np.abs(nodes - z).min() <= SAME_PLACE:
            return self.shape(z, on_disc)
        k = int(np.searchsorted(nodes, z)) - 1
        rows = deflection(self.rotor.spans[k], z - float(nodes[k]))
        return np.asarray(rows @ self.reduced.Phi[4 * k : 4 * k + 8])

    def residual_compliance(self, effect: Effect) -> float:
        """Static compliance where an effect acts [m/N], mean of both planes, that the modes left out would add."""
        z, on_disc = self.place(effect), self.on_disc(effect)
        stiffness = add_springs(self.constant.K(), self.constant, self.springs)
        seat, arm = self.seat(z, on_disc)
        at = 4 * self.node(seat) + np.arange(4)
        rows = np.array([[1.0, 0.0, 0.0, arm], [0.0, 1.0, -arm, 0.0]])
        whole = np.diag(rows @ np.linalg.inv(stiffness)[np.ix_(at, at)] @ rows.T)
        reduced, shape = self.reduced, self.shape(z, on_disc)
        kept = shape @ np.linalg.solve(reduced.Phi.T @ stiffness @ reduced.Phi, shape.T)
        return float(np.mean(whole - np.diag(kept)))

    @cached_property
    def free_stiffness(self) -> np.ndarray:
        """Stiffness (ndof, ndof) of the shaft alone [N/m, N, N m]: without bearings."""
        return AssembledRotor(self._elements, self._discs(), []).K()

    @property
    def shaft_stiffness(self) -> np.ndarray:
        """Stiffness of the shaft alone in modal coordinates (2n, 2n) [1/s2]."""
        Phi = self.shaft_modes
        return np.asarray(Phi.T @ self.free_stiffness @ Phi)

    @cached_property
    def shear_softening(self) -> np.ndarray:
        """Derivative of `shaft_stiffness` by the relative change of the shaft's compliance in shear [1/s2].

        That of a solid section is proportional to 7 + 6 nu (Cowper), so that Poisson's ratio changes it.
        """

        def softer(element: ShaftElement) -> ShaftElement:
            m = element.material
            own = Material(m.name, m.rho, m.E, Poisson=m.Poisson + SHEAR_STEP * (7 / 6 + m.Poisson))
            return replace(element, material=own)

        changed = AssembledRotor([softer(element) for element in self._elements], self._discs(), []).K()
        Phi = self.shaft_modes
        return np.asarray(Phi.T @ (changed - self.free_stiffness) @ Phi) / SHEAR_STEP

    @property
    def shear_share(self) -> float:
        """Share of shear in the compliance of the shaft alone in its first bending mode; 0 where no mode bends."""
        values, modes = np.linalg.eigh(self.shaft_stiffness)
        if len(values) <= RIGID_MOTIONS:
            return 0.0
        own = modes[:, RIGID_MOTIONS]
        return float(-own @ self.shear_softening @ own / values[RIGID_MOTIONS])

    @property
    def shaft_damping(self) -> np.ndarray:
        """Damping of the shaft alone in modal coordinates (2n, 2n) [1/s]: that of its damping ratio."""
        return self.reduced.modal_damping

    @property
    def circulation(self) -> np.ndarray:
        """N (2n, 2n) [1/s2]: damping beta K_s in the turning frame adds Omega beta N to the stiffness."""
        Phi = self.shaft_modes
        turned = np.zeros_like(Phi)
        # e_z x (x, y) = (-y, x), and so the two rotations
        for a, b in ((0, 1), (2, 3)):
            turned[a::4], turned[b::4] = -Phi[b::4], Phi[a::4]
        return np.asarray(-Phi.T @ self.free_stiffness @ turned)

    @cached_property
    def bow(self) -> np.ndarray:
        """Modal force rows (2, 2n) of a shaft that is bent, unloaded, by a half wave of 1 m between its bearings."""
        places = sorted(b.position for b in self.machine.bearings)
        first, last = (places[0], places[-1]) if len(places) > 1 else (self.machine.shaft.start, self.machine.shaft.end)
        wave = np.pi * (self.nodes - first) / (last - first)
        slope = np.pi / (last - first) * np.cos(wave)
        bent = np.zeros((2, 4 * len(self.nodes)))
        # beta turns x' > 0 and alpha y' < 0
        bent[0, 0::4], bent[0, 3::4] = np.sin(wave), slope
        bent[1, 1::4], bent[1, 2::4] = np.sin(wave), -slope
        return np.asarray(bent @ self.free_stiffness @ self.shaft_modes)

    @property
    def polar_inertia(self) -> float:
        """Moment of inertia of shaft and discs about the axis [kg m2]."""
        return self.machine.shaft.polar_inertia + sum(d.polar_inertia for d in self.machine.discs)


def shaft_rotor(machine: Machine) -> fe_shaft.Rotor:
    """The rotor of a machine on its bearings without a film, with the analyses of `fe_shaft`, also for ROSS.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rotor = rs.plant.shaft_rotor(rs.load_machine("plain_rotor"))
    >>> int(rotor.run_modal(0.0).wn[0])
    277
    """
    found = Mesh(machine).rotor
    return fe_shaft.Rotor(found.shaft_elements, found.disk_elements, found.bearing_elements, found.point_mass_elements)


def _ground(node: int, support: Support) -> BearingElement:
    """Springs and dampers under a housing."""
    (kxx, kyy), (cxx, cyy) = support.stiffness, support.damping
    return BearingElement(node, kxx, cxx, kyy, cyy=cyy)
