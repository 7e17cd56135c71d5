r"""A hidden mass in the plant: a bearing whose housing nothing holds, written, fitted and judged there.

A mass m on a spring and a damper at a place of the shaft, whose displacement is x there, moves by z and exerts

.. math:: F = -m\,\ddot z, \qquad m\,(\ddot z + 2\zeta\omega\,(\dot z - \dot x) + \omega^2\,(z - x)) = 0

along x and y alike. The linear model proposes it about a motion without it; a resonance moves that motion more than the
model foresees. So m, omega and zeta are fitted to the plant together with the calibration, each with its own columns
next to the mass.

Cites: friswell_2010.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import tomlkit

from rotorsim.base.units import show
from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint, within
from rotorsim.discrepancy.comparison import TwinComparison, excess, table
from rotorsim.discrepancy.discovery import DiscoveredLaw, ProposedLaw, tied, units_of
from rotorsim.discrepancy.fit import MOST_ROUNDS, ParameterFit, fit_parameters
from rotorsim.discrepancy.hypotheses import CLEAR, ENOUGH
from rotorsim.discrepancy.judge import LEAST_GONE, MANY, beyond_floor, untouched_gone
from rotorsim.discrepancy.law_terms import ObservedPlaces, law_places
from rotorsim.discrepancy.machine_file import SAME_PLACE, short
from rotorsim.discrepancy.stability import Stability
from rotorsim.discrepancy.verdict import TIE_LEAST
from rotorsim.machine import Machine

UNHELD = 1e-6
"""Stiffness [N/m] to the ground of a housing that nothing holds."""
FIT_ENDED = 0.1
"""Fall of the sum of squares below which a fit has ended: neighbouring places may differ by one."""
MASS_NUMBERS = tuple(FitParameter(key, 0.01, low=-3.0, high=3.0) for key in ("mass", "resonance", "damping_ratio"))
"""Parameters of a fit: logarithms of the mass' numbers over those with which the fit begins."""


@dataclass(frozen=True)
class HiddenMass:
    """A mass [kg] on a spring and a damper, by its resonance [rad/s] and damping ratio, at a coordinate [m].

    Examples
    --------
    >>> import rotorsim as rs
    >>> mass = rs.discrepancy.hidden_mass.HiddenMass(0.3, mass=0.01, resonance=400.0, damping_ratio=0.02)
    >>> mass.table["kxx"], mass.table["support"]["mass"]
    ('1600 N/m', '10 g')
    """

    position: float
    mass: float
    resonance: float
    damping_ratio: float

    @property
    def table(self) -> dict[str, Any]:
        """The bearing of a machine file that it is."""
        stiffness, damping = self.mass * self.resonance**2, 2 * self.damping_ratio * self.resonance * self.mass
        support = {"mass": show(short(self.mass), "kg"), "kxx": show(UNHELD, "N/m")}
        return {"kind": "linear", "position": show(self.position, "m"), "kxx": show(short(stiffness), "N/m"),
                "cxx": show(short(damping), "N*s/m"), "support": support}  # fmt: skip

    def added_to(self, machine: Machine) -> Machine:
        """The machine with it; raises MachineFileError where a bearing stands at its place."""
        document: Any = tomlkit.parse(machine.text)
        document["bearings"].append(tomlkit.item(self.table))
        return machine.from_text(tomlkit.dumps(document))

    @property
    def law(self) -> str:
        """Equation of its force, and its table in a machine file, as text."""
        table = tomlkit.dumps({"bearings": [self.table]}).strip().replace("\n", "\n    ")
        return (
            f"A mass on a spring and a damper, {1e3 * self.position:.6g} mm along the shaft, that moves by z:\n\n"
            "    m (z'' + 2 damping_ratio resonance (z' - x') + resonance^2 (z - x)) = 0,    F_x = -m z'' [N]\n\n"
            f"and the same along y. In the machine file it is a bearing whose housing nothing holds:\n\n    {table}\n"
        )


@dataclass(frozen=True)
class WithMass:
    """Records compared with a twin that has a hidden mass, `start` changed by `MASS_NUMBERS`."""

    comparison: TwinComparison
    start: HiddenMass

    def mass(self, point: ParameterPoint) -> HiddenMass:
        """The hidden mass at a point."""
        changed = {k.key: getattr(self.start, k.key) * math.exp(point.values.get(k, 0.0)) for k in MASS_NUMBERS}
        return replace(self.start, **changed)

    def at(self, point: ParameterPoint) -> tuple[TwinComparison, ParameterPoint]:
        """Comparison with the plant that has the mass as it is at a point, and the calibration there."""
        twin = self.comparison.twin
        own = replace(twin, machine=self.mass(point).added_to(twin.machine)).with_candidates()
        calibration = {k: value for k, value in point.values.items() if k not in MASS_NUMBERS}
        return self.comparison.with_twin(own), replace(point, values=calibration)

    def residual(self, point: ParameterPoint) -> np.ndarray:
        """Whitened residual (n,) of the plant at a point."""
        comparison, calibration = self.at(point)
        return comparison.residual(calibration)

    def jacobian(self, point: ParameterPoint, parameters: Sequence[FitParameter], residual: np.ndarray) -> np.ndarray:
        """Whitened derivatives (n, k + 3) after a calibration's parameters and `MASS_NUMBERS` at a point."""
        comparison, calibration = self.at(point)
        moved = [self.residual(point.moved([k], np.array([k.step]))) for k in MASS_NUMBERS]
        own = [(residual - r) / k.step for k, r in zip(MASS_NUMBERS, moved, strict=True)]
        return np.column_stack([comparison.jacobian(calibration, parameters), *own])


def mass_of(law: ProposedLaw, machine: Machine) -> HiddenMass | None:
    """The hidden mass that a law is; None for another law, one that differs along x and y, and one at a bearing."""
    one, z = law.terms[0], law_places(machine)[law.place]
    at_bearing = any(abs(b.position - z) < SAME_PLACE for b in machine.bearings)
    if len(law.terms) > 1 or not (one.term.resonates and one.one) or at_bearing or law.coefficients[0] <= 0:
        return None
    return HiddenMass(z, float(law.coefficients[0]), **dict(one.shape))


def fit_mass(
    start: HiddenMass, law: ProposedLaw, base: ParameterFit, comparison: TwinComparison, progress: Callable[[], None]
) -> ParameterFit:  # fmt: skip
    """Fit a hidden mass to the plant, together with the calibration of `base`, from that which goes with the law."""
    own, keys = WithMass(comparison, start), (*base.parameters, *MASS_NUMBERS)
    v = within(base.parameters, base.vector + law.moved)
    point = base.point.moved(base.parameters, v - base.vector)
    r, cost = own.residual(point), math.inf
    for _ in range(MOST_ROUNDS):
        fit = fit_parameters(own, point, keys, own.jacobian(point, base.parameters, r), r, progress=progress)
        point, r = fit.point, fit.residual
        if cost - fit.cost < FIT_ENDED:
            break
        cost = fit.cost
    return replace(fit, J=own.jacobian(point, base.parameters, r))


@dataclass(frozen=True, eq=False)
class SolvedLaw:
    """A law with a memory, the calibration that goes with it, and what both leave.

    fit : calibration, and behind its parameters the law's coefficients, or `MASS_NUMBERS` of a mass
    base : calibration about which the law's linear columns are
    left : whitened residuals by role
    mass : what the law is in the plant, which has then been run; None where the linear model has solved it
    """

    law: ProposedLaw
    base: ParameterFit
    fit: ParameterFit
    left: Mapping[str, np.ndarray]
    mass: HiddenMass | None = None

    def sd(self, V: np.ndarray) -> dict[str, float]:
        """Standard deviations of the law's numbers out of the covariance V (k, k) of `fit`."""
        own = dict(zip((k.key for k in self.fit.parameters), np.sqrt(np.diag(V)).tolist(), strict=True))
        if self.mass is None:
            return {key: own[key] for one in self.law.terms for key in one.parameters}
        names = {"mass": self.law.terms[0].parameters[0]}
        return {names.get(k.key, k.key): own[k.key] * getattr(self.mass, k.key) for k in MASS_NUMBERS}


def by_linear_model(law: ProposedLaw, base: ParameterFit, parts: Mapping[str, ObservedPlaces]) -> SolvedLaw:
    """A law that was solved about a calibration, as the linear model has it."""
    left = {role: s.residual - s.J @ law.moved - law.columns(s) @ law.coefficients for role, s in parts.items()}
    own = tuple(FitParameter(key, 1.0) for one in law.terms for key in one.parameters)
    J = np.hstack([parts["fit"].J, law.columns(parts["fit"])])
    fit = replace(base, point=going_with(law, base), parameters=(*base.parameters, *own), J=J, residual=left["fit"])
    return SolvedLaw(law, base, fit, left)


def in_plant(
    law: ProposedLaw, base: ParameterFit, parts: Mapping[str, TwinComparison], progress: Callable[[], None]
) -> SolvedLaw | None:
    """A hidden mass fitted to the plant; None for a law that is none there."""
    start = mass_of(law, parts["fit"].twin.machine)
    if start is None:
        return None
    fit = fit_mass(start, law, base, parts["fit"], progress)
    left = {role: WithMass(part, start).residual(fit.point) for role, part in parts.items()}
    mass = WithMass(parts["fit"], start).mass(fit.point)
    one = replace(law.terms[0], shape=(("resonance", mass.resonance), ("damping_ratio", mass.damping_ratio)))
    held = float(left["held_out"] @ left["held_out"]) if "held_out" in left else 0.0
    found = replace(law, terms=(one,), coefficients=np.array([mass.mass]), cost=fit.cost, held=held,
                    left=excess(table(parts["fit"], left["fit"])))  # fmt: skip
    return SolvedLaw(found, base, fit, left, mass)


def going_with(law: ProposedLaw, fit: ParameterFit) -> ParameterPoint:
    """Point of the calibration that goes with a law, within its limits."""
    return fit.point.moved(fit.parameters, within(fit.parameters, fit.vector + law.moved) - fit.vector)


def borne_out(
    first: SolvedLaw, laws: Iterable[ProposedLaw], parts: Mapping[str, TwinComparison],
    before: Mapping[str, np.ndarray], known: float,
) -> bool:  # fmt: skip
    """Whether what a law with a memory leaves of the records bears it out.

    `before` has the whitened residuals by role without it, `laws` all others. Another form that explains the
    records as well refutes it, and so does a total that is not clearly below the `known` one.
    """
    law, gone = first.law, list[float | None]()
    if any(one.score < law.score + TIE_LEAST and one.forms != law.forms for one in laws):
        return False
    for role, part in parts.items():
        gone.append(untouched_gone(part, before[role], first.left[role]))
        if any(f.rms > MANY * f.floor for f in beyond_floor(part, first.left[role])):
            return False
    clear = known - law.total > CLEAR
    clear &= law.left <= (1 - ENOUGH) * excess(table(parts["fit"], before["fit"]))
    return clear and all(share is None or share >= LEAST_GONE["named"] for share in gone)


def law_with_memory(
    first: SolvedLaw, laws: Sequence[ProposedLaw], known: float, position: float, V: np.ndarray,
    chosen: Stability | None,
) -> DiscoveredLaw:  # fmt: skip
    """The first law: a hidden mass with its table in a machine file, another one as text.

    The others are at places that these records do not exclude where their likelihood is near. Its probability is that
    against the least total that is `known` without it; V (k, k) is the covariance of its fit.
    """
    law, mass, kinds = first.law, first.mass, first.law.forms
    sd = first.sd(V)
    pairs = [*zip((key for one in law.terms for key in one.parameters), law.coefficients.tolist(), strict=True),
             *(number for one in law.terms for number in one.shape)]  # fmt: skip
    near = tuple(one.names for one in laws if one is not law and one.score < law.score + TIE_LEAST)
    text = f"{' with '.join(kinds)} at {law.place}; it has a memory; by the linear model alone: not compiled"
    return DiscoveredLaw(
        "", law.place, position, text if mass is None else mass.law,
        {key: (value, sd.get(key, 0.0)) for key, value in pairs}, units_of(law), kinds, "", "",
        law.probability(known),
        near, tied(law, near), chosen=chosen, bearing={} if mass is None else mass.table,
    )  # fmt: skip
