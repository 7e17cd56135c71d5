"""Finite-element rotor of a machine and its modal reduction, with nodes at the machine's parts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from fe_shaft import BearingElement, DiskElement, Material, ReducedRotor, Rotor, ShaftElement, modal_reduction
from fe_shaft.elements import deflection
from fe_shaft.static import loose_motions
from rotorsim.base.errors import MachineFileError
from rotorsim.effects import Effect
from rotorsim.machine.rotor import LinearBearing
from rotorsim.machine.schema import Machine

SAME_PLACE = 1e-7


@dataclass(frozen=True)
class Mesh:
    """Rotor of a machine: `nodes` are coordinates z [m]."""

    machine: Machine

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
        places = [d.position for d in machine.discs] + [b.position for b in machine.bearings]
        places += [self.probe] + [self.place(e) for es in machine.effects.values() for e in es]
        return [*ends, *(min(max(z, ends[0]), ends[-1]) for z in places)]

    @property
    def probe(self) -> float:
        """Where displacement is measured: the probe, else the first disc, else the middle of the shaft."""
        machine = self.machine
        if machine.probe is not None:
            return machine.probe.position
        if machine.discs:
            return machine.discs[0].position
        return 0.5 * (machine.shaft.start + machine.shaft.end)

    def place(self, effect: Effect) -> float:
        """Where an effect acts along the shaft [m]."""
        position = getattr(effect, "position", None)
        if position is not None:
            return float(position)
        films, number = self.machine.films, self.machine.film_number(effect)
        if effect.place == "film" and films:
            return films[number or 0].position
        if effect.place == "start":
            return self.machine.shaft.start
        if effect.place == "bearing":
            return next((b.position for b in self.machine.bearings if isinstance(b, LinearBearing)), self.probe)
        return self.machine.discs[0].position if self.machine.discs else self.probe

    def node(self, z: float) -> int:
        """Number of the node at z."""
        return int(np.abs(self.nodes - z).argmin())

    @cached_property
    def rotor(self) -> Rotor:
        """The finite-element rotor with its linear bearings."""
        bearings = [self._bearing(b) for b in self.machine.bearings if isinstance(b, LinearBearing)]
        return Rotor(self._elements(), self._discs(), bearings)

    def _discs(self) -> list[DiskElement]:
        return [
            DiskElement(self.node(d.position), d.mass, d.diametral_inertia, d.polar_inertia) for d in self.machine.discs
        ]

    def _elements(self) -> list[ShaftElement]:
        shaft = self.machine.shaft
        steel = shaft.material
        material = Material("shaft", steel.density, steel.youngs_modulus, Poisson=steel.poisson_ratio)
        ends = shaft.start + np.cumsum([s.length for s in shaft.sections])
        elements = []
        for a, b in pairwise(self.nodes):
            section = shaft.sections[min(int(np.searchsorted(ends, 0.5 * (a + b))), len(ends) - 1)]
            elements.append(ShaftElement(b - a, section.inner_diameter, section.outer_diameter, material=material))
        return elements

    def _bearing(self, bearing: LinearBearing) -> BearingElement:
        return BearingElement(
            self.node(bearing.position),
            bearing.kxx,
            bearing.cxx,
            kyy=bearing.kxx if bearing.kyy is None else bearing.kyy,
            cyy=bearing.cxx if bearing.cyy is None else bearing.cyy,
            kxy=bearing.kxy,
            kyx=bearing.kyx,
            cxy=bearing.cxy,
            cyx=bearing.cyx,
        )

    def _loose(self, springs: dict[int, float]) -> str:
        """Which rigid-body motions bearings and nominal films do not resist."""
        held = [b for b in self.rotor.bearing_elements if b.n not in springs]
        held += [BearingElement(node, stiffness, 0.0) for node, stiffness in springs.items()]
        return ", ".join(loose_motions(replace(self.rotor, bearing_elements=held))) or "hardly held"

    @cached_property
    def reduced(self) -> ReducedRotor:
        """The modes the time simulation uses."""
        machine = self.machine
        springs = {self.node(film.position): film.nominal_stiffness for film in machine.films}
        modes = min(machine.solver.modes_per_plane, 2 * len(self.nodes))
        reduced = modal_reduction(self.rotor, springs, modes, machine.shaft.damping_ratio)
        if reduced.frequencies.min() < 1e-4 * reduced.frequencies.max():
            raise MachineFileError(
                f"bearings: they leave the shaft free to fall or to tilt ({self._loose(springs)}); "
                "add a bearing or stiffness"
            )
        return reduced

    def shape(self, z: float) -> np.ndarray:
        """Modes (2, 2n) at z [m]."""
        return self.reduced.shape(self.node(z))

    def shape_between(self, z: float) -> np.ndarray:
        """Modes (2, 2n) at any z [m], in the shapes of the element there; the mesh needs no node at z."""
        nodes = self.nodes
        if np.abs(nodes - z).min() <= SAME_PLACE:
            return self.shape(z)
        k = int(np.searchsorted(nodes, z)) - 1
        rows = deflection(self.rotor.shaft_elements[k], z - float(nodes[k]))
        return np.asarray(rows @ self.reduced.Phi[4 * k : 4 * k + 8])

    def residual_compliance(self, z: float) -> float:
        """Static compliance at z [m/N], mean of both planes, that the modes left out would add."""
        stiffness = self.rotor.K().copy()
        for film in self.machine.films:
            held = [4 * self.node(film.position), 4 * self.node(film.position) + 1]
            stiffness[held, held] += film.nominal_stiffness
        at = 4 * self.node(z) + np.arange(2)
        whole = np.linalg.inv(stiffness)[at, at]
        reduced, shape = self.reduced, self.shape(z)
        kept = shape @ np.linalg.solve(reduced.Phi.T @ stiffness @ reduced.Phi, shape.T)
        return float(np.mean(whole - np.diag(kept)))

    @cached_property
    def free_stiffness(self) -> np.ndarray:
        """Stiffness (ndof, ndof) of the shaft alone [N/m, N, N m]: without bearings."""
        return Rotor(self._elements(), self._discs(), []).K()

    @property
    def shaft_stiffness(self) -> np.ndarray:
        """Stiffness of the shaft alone in modal coordinates (2n, 2n) [1/s2]."""
        Phi = self.reduced.Phi
        return np.asarray(Phi.T @ self.free_stiffness @ Phi)

    @property
    def shaft_damping(self) -> np.ndarray:
        """Damping of the shaft alone in modal coordinates (2n, 2n) [1/s]: that of its damping ratio."""
        return np.diag(2 * self.machine.shaft.damping_ratio * self.reduced.frequencies)

    @property
    def circulation(self) -> np.ndarray:
        """N (2n, 2n) [1/s2]: damping beta K_s in the turning frame adds Omega beta N to the stiffness."""
        Phi = self.reduced.Phi
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
        return np.asarray(bent @ self.free_stiffness @ self.reduced.Phi)

    @property
    def polar_inertia(self) -> float:
        """Moment of inertia of shaft and discs about the axis [kg m2]."""
        shaft = self.machine.shaft
        rho = shaft.material.density
        turned = [np.pi / 32 * rho * s.length * (s.outer_diameter**4 - s.inner_diameter**4) for s in shaft.sections]
        return float(sum(turned) + sum(d.polar_inertia for d in self.machine.discs))
