"""Equilibrium of a plant: call of the kernel, exceptions for its status codes, named results."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from reynolds.workspace import at_cache_line
from rotorsim.base.display import Card, Shown, several
from rotorsim.base.errors import ConvergenceError, MachineFileError, NoLiftOffError
from rotorsim.base.units import MPA, TO_RPM, TO_UM
from rotorsim.machine import Machine
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.kernels.equilibrium_kernel import BEYOND_STROKE, NO_LIFT_OFF, RESTLESS

SLOW = 1e-6
"""Velocity [m/s] of difference quotients."""


@dataclass(frozen=True, repr=False)
class Equilibrium(Shown):
    """Equilibrium of a machine: disc (2,) [m], h_min [m] of all films, flows (injectors,) [kg/s] of all films.

    journal (2,) [m], film force (2,) [N] and eccentricity ratio are those of the first film; `journals` (films, 2),
    `forces` (films, 2) and `eccentricity_ratios` (films,) those of all; `temperature_rises` (films, 3) [K] those of
    gas, journal and sleeve, 0 without the effect `heat_balance`.
    """

    disc: np.ndarray
    journal: np.ndarray
    eccentricity_ratio: float
    force: np.ndarray
    mass_flow: np.ndarray
    h_min: float
    journals: np.ndarray
    forces: np.ndarray
    eccentricity_ratios: np.ndarray
    temperature_rises: np.ndarray

    def card(self) -> Card:
        """Disc, and of films the least thickness, eccentricity ratios, forces and flow."""
        rows = []
        if len(self.journals):
            rows = [
                ("least film", f"{self.h_min * TO_UM:.4g} um"),
                ("eccentricity ratio", several(self.eccentricity_ratios, ".3g")),
                ("film force", f"{several(np.hypot(*self.forces.T))} N"),
            ]
        if self.temperature_rises.any():
            rows.append(("gas warmer by", f"{several(self.temperature_rises[:, 0], '.3g')} K"))
        if len(self.mass_flow):
            rows.append(("flow", f"{1e6 * self.mass_flow.sum():.4g} mg/s"))
        return Card(f"Equilibrium: disc at {self.disc[0] * TO_UM:.2f}, {self.disc[1] * TO_UM:.2f} um", rows)


def matrix(a: Assembly, offset: int, w: np.ndarray) -> np.ndarray:
    """A modal matrix (n, n) out of a workspace."""
    n = a.rotor.n
    return np.array(w[offset : offset + n * n].reshape(n, n).T)


def rows(a: Assembly, offset: int, w: np.ndarray) -> np.ndarray:
    """Rows (2, n) out of a workspace: displacement = rows @ q, modal force = force @ rows."""
    return np.array(w[offset : offset + 2 * a.rotor.n].reshape(2, a.rotor.n))


def stiffness(a: Assembly, w: np.ndarray, speed: float) -> np.ndarray:
    """Modal stiffness (n, n) at rest where w stands: with the tangent of forces that depend on the motion."""
    w = w.copy()
    a.module.static_terms(w, a.parameters, speed, True)
    return matrix(a, a.rotor.KT, w)


def damping(a: Assembly, w: np.ndarray, speed: float) -> np.ndarray:
    """Modal damping (n, n), gyroscopic terms included."""
    C = matrix(a, a.rotor.C, w) + speed * matrix(a, a.rotor.G, w) + motion_damping(a, w, speed)
    C = C + table_damping(a, w, speed) if a.rotor.n_tables else C
    return C + turning_time(a) * matrix(a, a.rotor.KS, w) if a.rotor.turning else C


def table_damping(a: Assembly, w: np.ndarray, speed: float) -> np.ndarray:
    """Modal damping (n, n) of the tables at `speed`, as `add_tables` of the kernels has it."""
    R, n = a.rotor, a.rotor.n
    shapes = w[R.table_rows : R.table_rows + 2 * n * R.n_tables].reshape(-1, 2, n)
    values = w[R.table_values : R.table_values + 8 * R.n_tables * R.n_points].reshape(R.n_tables, R.n_points, 2, 2, 2)
    speeds = w[R.table_speeds : R.table_speeds + R.n_points]
    k = min(max(int(np.searchsorted(speeds, abs(speed))), 1), R.n_points - 1)
    share = min(max((abs(speed) - speeds[k - 1]) / (speeds[k] - speeds[k - 1]), 0.0), 1.0)
    C = values[:, k - 1, 1] + share * (values[:, k, 1] - values[:, k - 1, 1])
    if speed < 0:
        C = C * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return np.asarray((shapes.transpose(0, 2, 1) @ C @ shapes).sum(axis=0))


def motion_damping(a: Assembly, w: np.ndarray, speed: float) -> np.ndarray:
    """Modal damping (n, n) of steady forces that depend on the velocity, at rest where w stands."""
    total = np.zeros((a.rotor.n, a.rotor.n))
    q = w[a.rotor.q : a.rotor.q + a.rotor.n]
    for call in a.calls:
        if call.effect.port == "motion" and call.effect.steady:
            kernel = type(call.effect).kernel
            force = partial(getattr(kernel, "py_func", kernel), 0.0, 0.0, speed, *(rows(a, call.shape, w) @ q))
            steps = ((SLOW, 0.0), (0.0, SLOW))
            p = getattr(a.P, call.record)
            slope = [np.subtract(force(*v, p), force(*np.negative(v), p)) / (2 * SLOW) for v in steps]
            shape = rows(a, call.shape, w)
            total -= shape.T @ np.stack(slope, axis=1) @ shape
    return total


def turning_time(a: Assembly) -> float:
    """Damping time [s] of the turning shaft, all effects together."""
    times = (call for call in a.calls if call.effect.port == "rotating")
    return sum(getattr(k := type(c.effect).kernel, "py_func", k)(getattr(a.P, c.record)) for c in times)


def settle(a: Assembly, speed: float, pressure: float) -> np.ndarray:
    """Workspace with the machine at rest in equilibrium at `speed` [rad/s] and gauge pressure [Pa].

    Raises NoLiftOffError where the film does not carry the rotor, MachineFileError where an actuator cannot hold its
    pin at the bias, ConvergenceError if the iteration with effects does not converge, DataError for a pressure below
    vacuum.
    """
    w = at_cache_line(a.w.size)
    status = a.module.settle(w, a.w, a.ix, a.parameters, float(speed), a.machine.gas.absolute(pressure))
    if status == BEYOND_STROKE:
        raise MachineFileError(
            f"injection.pin_bias: '{max(a.P.pin_bias) * TO_UM:.4g} um' is beyond the stroke of the actuators between "
            f"{a.P.volt_low:g} V and {a.P.volt_high:g} V; change it or actuators.sensitivity"
        )
    if status == NO_LIFT_OFF:
        loads = np.hypot(*w[a.rotor.static_rhs :][: 2 * len(a.films)].reshape(-1, 2).T)
        remedy = "raise the injection pressure" if a.film.n_inj else "start at a higher speed"
        raise NoLiftOffError(
            f"no lift-off: at {pressure / MPA:.3g} MPa gauge and {speed * TO_RPM:.0f} rpm the film does not carry "
            f"the {sum(loads):.1f} N on it; {_remedy(a.machine, loads) or remedy}"
        )
    if status == RESTLESS:
        names = coupled_effects(a)
        raise ConvergenceError(
            f"equilibrium: the iteration did not converge at {pressure / MPA:.3g} MPa gauge and "
            f"{speed * TO_RPM:.0f} rpm with {', '.join(f'[effects.{name}]' for name in names)}; "
            f"make {'it' if len(names) == 1 else 'one of them'} weaker or leave it out",
            effects=names,
        )
    return w


def coupled_effects(a: Assembly) -> tuple[str, ...]:
    """Names of the effects that an equilibrium is repeated for: of supply, heat, and steady forces of the motion.

    Those at their neutral values, which do nothing, are not among them.
    """
    effects = [call.effect for call in a.calls]
    coupled = [e for e in effects if e.port in ("supply", "heat") or (e.port == "motion" and e.steady)]
    return tuple(dict.fromkeys(effect.name for effect in coupled if effect != type(effect)()))


def describe(a: Assembly, w: np.ndarray) -> Equilibrium:
    """Read an equilibrium out of a workspace that `settle` returned."""
    L, R = a.film, a.rotor
    disc = rows(a, R.disc, w) @ w[R.q : R.q + R.n]
    if not a.films:
        nothing, none = np.full(2, np.nan), np.zeros((0, 2))
        return Equilibrium(
            disc, nothing, np.nan, nothing, np.zeros(0), np.nan, none, none, np.zeros(0), np.zeros((0, 3))
        )
    parts = [a.film_part(w, k) for k in range(len(a.films))]
    journals = np.array([v[L.journal : L.journal + 2] for v in parts])
    forces = np.array([v[L.force : L.force + 2] for v in parts])
    flows = [v[L.film_flow : L.film_flow + len(f.injectors)] for v, f in zip(parts, a.films, strict=True)]
    ratios = np.hypot(*journals.T) / [f.clearance for f in a.films]
    gap = float(a.module.narrowest(w, a.parameters))
    first = journals[0], float(ratios[0]), forces[0]
    rises = w[a.rig.heat : a.rig.heat + 3 * len(a.films)].reshape(-1, 3).copy()
    return Equilibrium(disc, *first, np.concatenate(flows), gap, journals, forces, ratios, rises)


def _remedy(machine: Machine, loads: np.ndarray) -> str:
    """Remedy for the form of a sleeve that its load [N] alone closes; empty if none is."""
    for film, load in zip(machine.films, loads, strict=True):
        for form in film.sleeve.forms.values():
            if remedy := form.remedy(float(load), film.clearance, film.diameter * film.length):
                return remedy
    return ""
