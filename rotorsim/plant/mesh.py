"""From a machine file to the finite-element rotor and its reduced form, with nodes where the machine has parts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from fe_shaft import BearingElement, DiskElement, Material, ReducedRotor, Rotor, ShaftElement, modal_reduction
from rotorsim.effects import Effect
from rotorsim.errors import MachineFileError
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
        film = self.machine.film
        if effect.place == "film" and film is not None:
            return film.position
        if effect.place == "start":
            return self.machine.shaft.start
        return self.machine.discs[0].position if self.machine.discs else self.probe

    def node(self, z: float) -> int:
        """Number of the node at z."""
        return int(np.abs(self.nodes - z).argmin())

    @cached_property
    def rotor(self) -> Rotor:
        """The finite-element rotor with its linear bearings."""
        machine = self.machine
        discs = [
            DiskElement(self.node(d.position), d.mass, d.diametral_inertia, d.polar_inertia) for d in machine.discs
        ]
        bearings = [self._bearing(b) for b in machine.bearings if isinstance(b, LinearBearing)]
        return Rotor(self._elements(), discs, bearings)

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

    @cached_property
    def reduced(self) -> ReducedRotor:
        """The modes the time simulation uses."""
        machine, film = self.machine, self.machine.film
        node = None if film is None else self.node(film.position)
        stiffness = 0.0 if film is None else film.nominal_stiffness
        modes = min(machine.solver.modes_per_plane, 2 * len(self.nodes))
        reduced = modal_reduction(self.rotor, node, stiffness, modes, machine.shaft.damping_ratio)
        if reduced.frequencies.min() < 1e-4 * reduced.frequencies.max():
            raise MachineFileError("bearings: they leave the shaft free to fall or to tilt; add a bearing or stiffness")
        return reduced

    def shape(self, z: float) -> np.ndarray:
        """Modes (2, 2n) at z [m]."""
        return self.reduced.shape(self.node(z))
