r"""Terms of a law and the motion that they are of: what records show of a place where no probe is.

What the re-calibrated plant leaves at the probes, r, is taken for the response to a force at one place. The linear
model of the plant about its equilibrium gives the receptances H; with them the force, and the motion at the place,

.. math:: f = H_{sp}^{-1} r, \qquad q_p = q_p^{twin} + H_{pp} f

where lines stand clear of the floor. A term g of that motion with a coefficient of one adds to the data

.. math:: -H_{sp}\,\mathcal F\{g(q_p, \dot q_p, \Omega, \varphi)\}

Assumes: blocks are whole periods of the motion; the motion at the place is that of the twin to first order in the law.
Sources: Platz & Markert (2001) for the force; Brunton, Proctor & Kutz (2016) for the library of terms.

Cites: platz_2001, brunton_2016.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product
from types import SimpleNamespace

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.base.rounding import answer
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.discrepancy.calibration import ParameterPoint
from rotorsim.discrepancy.changes import PLANE, RING, RING_KEY, ring_axes
from rotorsim.discrepancy.comparison import TwinComparison, simulate
from rotorsim.discrepancy.fit import ParameterFit
from rotorsim.discrepancy.trial import Trial
from rotorsim.discrepancy.twin import Twin
from rotorsim.effects.base import BETWEEN, HOUSING
from rotorsim.machine import Machine
from rotorsim.machine.gas_film import GasFilm
from rotorsim.plant.linearise import LinearPlant, linearise
from rotorsim.plant.locations import OF_HOUSING
from rotorsim.plant.mesh import Mesh
from rotorsim.plant.simulation import settle

SLOW = 1e-4
"""Velocity [m/s] below which dry friction gives way."""
CLEAR_LINE = 3.0
"""Residual of a line, in floors, from which on the force that makes it moves the place."""
CLEARANCE = "clearance"
"""Name of the number of a shape that is a film's clearance, which is known and not searched."""
THINNEST = 0.02
"""Film thickness in a term, as a share of the clearance, below which it does not fall."""
MOTION = ("u", "w", "du", "dw")
"""Names of displacement and velocity along the axis of an expression and across it."""
OVER = 4
"""Moments of a block over its lines: products of three lines do not fold back."""
MOMENTS, PART = 500, 0.25
"""Moments of a record that show a force, and the part of its period in which they lie, about the largest motion."""


def slipping(u: np.ndarray, reach: float) -> np.ndarray:
    """Stretch (n,) [m] of a spring behind a slider that gives way at a `reach` [m], over a period u (n,) [m] of motion.

    Between two turns of the motion it follows the motion up to the reach.
    """
    if np.ndim(u) == 0:
        return np.clip(u, -reach, reach)
    stretch, now = np.empty(len(u)), 0.0
    ends = [0, *(np.flatnonzero(np.diff(np.sign(np.diff(u)))) + 1), len(u) - 1]
    for _ in range(2):  # from the second period on it repeats
        now = stretch[0] = np.clip(now + u[0] - u[-1], -reach, reach)
        for first, last in pairwise(ends):
            stretch[first : last + 1] = np.clip(now + u[first : last + 1] - u[first], -reach, reach)
            now = stretch[last]
    return stretch


NUMPY = {"math": SimpleNamespace(cos=np.cos, sin=np.sin, fabs=np.fabs, tanh=np.tanh, hypot=np.hypot,
                                 copysign=np.copysign), "max": np.maximum, "min": np.minimum,
         "slipping": slipping}  # fmt: skip
"""Functions of an expression, moment by moment."""


@dataclass(frozen=True)
class LibraryTerm:
    """A typed term of a force: its parts for one axis, with u, du along it, w, dw across; s is 1 along x, -1 along y.

    unit : that of its coefficients
    parts : expressions of u, w, du, dw, s, speed, angle and the numbers of `shape` (p.name)
    shape : names of numbers that are searched, their units, and tried values: of a length as shares of the largest |u|;
        the clearance of a film is known
    memory : factor on the displacement by omega (k,) and the numbers of the shape, of a term that remembers linearly
    """

    name: str
    unit: str
    parts: tuple[str, ...]
    shape: tuple[tuple[str, str, tuple[float, ...]], ...] = ()
    memory: Callable[..., np.ndarray] | None = None

    def __post_init__(self) -> None:
        for part in self.parts:
            if (wanted := self._unit_of(part)) != self.unit.replace("kg", "N*s^2/m"):
                raise DataError(
                    f"law term '{self.name}': its coefficient has the unit {self.unit}, and '{part}' asks for {wanted}",
                    argument="unit",
                    value=self.unit,
                )

    def _unit_of(self, part: str) -> str:
        """Unit that makes a part a force, from its degree in lengths and in rates, far above thresholds of numbers."""

        def size(length: float, rate: float) -> float:
            shape = {k: v[0] * {"m": length, "s": 1 / rate, "rad/s": rate}.get(unit, 1.0) for k, unit, v in self.shape}
            known = NUMPY | {"s": 1.0, "speed": 7 * rate, "angle": 0.7, "p": SimpleNamespace(**shape)}
            factor = 1.0 if self.memory is None else abs(self.memory(np.array([11.0 * rate]), **shape)[0])
            moved = [{"u": u, "w": length, "du": u * rate, "dw": 5 * length * rate} for u in (2 * length, -2 * length)]
            return factor * sum(abs(float(eval(part, known | one))) for one in moved)  # of both senses, for stops

        metres, rates = (round(math.log2(size(*twice) / size(1.0, 1.0))) for twice in ((2.0, 1.0), (1.0, 2.0)))
        time, length = "*s" * min(rates, 1) + (f"^{rates}" if rates > 1 else ""), "/m" if metres > 0 else "*m"
        return "N" + time + length * bool(metres) + (f"^{abs(metres)}" if abs(metres) > 1 else "")

    @property
    def key(self) -> str:
        """Name as that of a parameter."""
        return self.name.replace(" ", "_")

    @property
    def slips(self) -> bool:
        """Whether it is of a stretch that dry friction limits."""
        return any("slipping" in part for part in self.parts)

    @property
    def turns(self) -> bool:
        """Whether it changes with the angle of the shaft."""
        return any("angle" in part for part in self.parts)

    @property
    def constant(self) -> bool:
        """Whether it is linear in displacement and velocity with a factor that neither speed nor angle changes."""
        return all(part.removeprefix("s * ") in MOTION for part in self.parts)

    @property
    def linear(self) -> bool:
        """Whether it is linear in displacement and velocity with a factor that no angle changes, but the speed may."""
        return all(part.replace("speed * ", "").removeprefix("s * ") in MOTION for part in self.parts)

    @property
    def of_film(self) -> bool:
        """Whether it changes with the thickness of a film."""
        return any(name == CLEARANCE for name, _, _ in self.shape)

    @property
    def resonates(self) -> bool:
        """Whether it has a resonance of its own."""
        return any(name == "resonance" for name, _, _ in self.shape)

    def options(self, largest: float, clearance: float = 0.0) -> Iterator[dict[str, float]]:
        """Numbers of the shape to try, where the largest displacement is this [m], with a film's clearance [m]."""
        tried = [[value * (largest if unit == "m" else 1.0) for value in values] for _, unit, values in self.shape]
        tried = [[clearance] if clearance and name == CLEARANCE else values
                 for (name, *_), values in zip(self.shape, tried, strict=True)]  # fmt: skip
        for values in product(*tried):
            yield dict(zip((name for name, _, _ in self.shape), values, strict=True))


def _parametric(n: int) -> tuple[LibraryTerm, LibraryTerm]:
    turn = f"{n} * angle" if n > 1 else "angle"
    waves = f"math.cos({turn})", f"math.sin({turn})"
    return (LibraryTerm(f"stiffness at {n}X", "N/m", tuple(f"{wave} * u" for wave in waves)),
            LibraryTerm(f"cross stiffness at {n}X", "N/m", tuple(f"{wave} * w" for wave in waves)))  # fmt: skip


def _over_thickness(n: int) -> tuple[LibraryTerm, ...]:
    """Stiffness, swirl and damping over a power of the smallest thickness of a round film."""
    least = f"math.hypot(u, w), {THINNEST} * p.{CLEARANCE})"
    h, power = f"max(p.{CLEARANCE} - {least}", f" ** {n}" if n > 1 else ""
    length, own = ("", "*m", "*m^2")[n - 1], ((CLEARANCE, "m", (3.0,)),)
    name = f"over thickness{('', ' squared', ' cubed')[n - 1]}"
    return (
        LibraryTerm(f"stiffness {name}", f"N{length}", (f"u / {h}{power}",), own),
        LibraryTerm(f"swirl {name}", f"N{length}", (f"s * w / {h}{power}",), own),
        LibraryTerm(f"damping {name}", f"N*s{length}", (f"du / {h}{power}",), own),
    )


def _late(omega: np.ndarray, delay: float) -> np.ndarray:
    return np.asarray(np.exp(-1j * omega * delay))


def _relaxing(omega: np.ndarray, corner: float) -> np.ndarray:
    return np.asarray(1j * omega / (corner + 1j * omega))


def _of_hidden_mass(omega: np.ndarray, resonance: float, damping_ratio: float) -> np.ndarray:
    spring = resonance**2 + 2j * damping_ratio * resonance * omega
    return np.asarray(-(omega**2) * spring / (spring - omega**2))


GAPS = (("gap", "m", (0.15, 0.3, 0.45, 0.6, 0.75)),)
LIBRARY = (
    LibraryTerm("stiffness", "N/m", ("u",)),
    LibraryTerm("cross stiffness", "N/m", ("w",)),
    LibraryTerm("swirl", "N/m", ("s * w",)),
    LibraryTerm("damping", "N*s/m", ("du",)),
    LibraryTerm("gyroscopic", "N*s/m", ("s * dw",)),
    LibraryTerm("quadratic", "N/m^2", ("u * u",)),
    LibraryTerm("quadratic modulus", "N/m^2", ("math.fabs(u) * u",)),
    LibraryTerm("cubic", "N/m^3", ("u * u * u",)),
    LibraryTerm("radial cubic", "N/m^3", ("(u * u + w * w) * u",)),
    LibraryTerm("dry", "N", (f"math.tanh(du / {SLOW})",)),
    LibraryTerm("radial dry", "N", (f"du / math.hypot(math.hypot(du, dw), {SLOW})",)),
    LibraryTerm("drag", "N*s^2/m^2", ("math.fabs(du) * du",)),
    LibraryTerm("radial drag", "N*s^2/m^2", ("math.hypot(du, dw) * du",)),
    LibraryTerm("cubic damping", "N*s^3/m^3", ("du * du * du",)),
    LibraryTerm("damping with displacement", "N*s/m^3", ("u * u * du",)),
    LibraryTerm("dead band", "N/m", ("math.copysign(max(math.fabs(u) - p.gap, 0.0), u)",), GAPS),
    LibraryTerm("stop", "N/m", ("max(u - p.gap, 0.0)",), GAPS),
    LibraryTerm("stop below", "N/m", ("min(u + p.gap, 0.0)",), GAPS),
    LibraryTerm("stiffness with speed", "N*s/m", ("speed * u",)),
    LibraryTerm("stiffness with speed squared", "N*s^2/m", ("speed * speed * u",)),
    LibraryTerm("swirl with speed", "N*s/m", ("s * speed * w",)),
    LibraryTerm("swirl with speed squared", "N*s^2/m", ("s * speed * speed * w",)),
    LibraryTerm("damping with speed", "N*s^2/m", ("speed * du",)),
    *_parametric(1),
    *_parametric(2),
    *_over_thickness(1),
    *_over_thickness(2),
    *_over_thickness(3),
    LibraryTerm("delayed stiffness", "N/m", ("u",), (("delay", "s", (5e-4, 1e-3, 2e-3, 4e-3)),), _late),
    LibraryTerm("hidden mass", "kg", ("u",), (("resonance", "rad/s", tuple(np.geomspace(60.0, 1600.0, 40))),
                                      ("damping_ratio", "1", (0.01, 0.03, 0.1))), _of_hidden_mass),
)  # fmt: skip
"""Terms that a law may have; those of a film's thickness at its bearing alone."""
SLIPPING_SPRING = LibraryTerm("slipping spring", "N/m", ("slipping(u, p.reach)",),
                              (("reach", "m", (0.05, 0.1, 0.2, 0.4, 0.7)),))  # fmt: skip
"""A spring behind dry friction, for where no law of `LIBRARY` holds: with a short reach it is nearly dry friction."""


def order_forces(n: int) -> tuple[LibraryTerm, LibraryTerm]:
    """Forces at an order of the shaft, one constant and one that grows with the square of the speed."""

    def at(unit: str, factor: str, grown: str) -> LibraryTerm:
        waves = tuple(f"{factor}math.{wave}({n} * angle)" for wave in ("cos", "sin"))
        return LibraryTerm(f"force at {n}X{grown}", unit, waves)

    return at("N", "", ""), at("N*s^2", "speed * speed * ", " with speed squared")


ORDER_FORCES = (*order_forces(1), *order_forces(2))
"""Forces that turn or pulse with the shaft and are no law: a stiffness at an order, of a journal far from the middle of
its film, is nearly one."""
CORNERS = (30.0, 100.0, 300.0, 850.0)
"""Corners [rad/s] of relaxations, 5 to 135 Hz; one between two of them is nearly a sum of both."""
RELAXATION = LibraryTerm("relaxation", "N/m", ("u",), (("corner", "rad/s", CORNERS),), _relaxing)
"""Force that gives way when slow, as that of a gas that is squeezed or of a plenum that fills; not a law."""


def clearances(machine: Machine) -> dict[str, float]:
    """Clearance [m] of each radial gas film, by the name of its bearing as a place of a law."""
    pairs = zip(machine.bearings_in_words, machine.bearings, strict=True)
    return {name: b.clearance for name, b in pairs if isinstance(b, GasFilm)}


def off_shaft(machine: Machine) -> dict[str, str]:
    """Parts that move at the places where a law does not act between shaft and ground, by the places' names.

    A bearing whose housing moves acts between both, and the housing's own support between it and the ground.
    """
    names = [machine.bearings_in_words[i] for i in machine.supported]
    return dict.fromkeys(names, BETWEEN) | {f"{OF_HOUSING}{name}": HOUSING for name in names}


def law_places(machine: Machine) -> dict[str, float]:
    """Places [m] where a law may act, by name: discs, bearings, housings, and a plane of probes of its own."""
    found = {n: d.position for n, d in zip(machine.disc_names, machine.discs, strict=True)}
    found |= {n: b.position for n, b in zip(machine.bearings_in_words, machine.bearings, strict=True)}
    z = Mesh(machine).probe
    near = all(abs(z - own) > 1e-6 for own in found.values())
    found |= {name: found[name.removeprefix(OF_HOUSING)] for name in off_shaft(machine)}
    return found | ({"the plane of the probes": z} if near else {})


@dataclass(frozen=True, eq=False)
class PlaceMotion:
    """Motion at a place in a record: displacement, velocity (2, n) [m, m/s], shaft angle (n,) [rad], speed [rad/s].

    H (lines, 2, 2) [m/N] is the receptance from a force there to the channels; `clearance` [m] is that of a film there.
    """

    displacement: np.ndarray
    velocity: np.ndarray
    angle: np.ndarray
    speed: float
    H: np.ndarray
    frequencies: np.ndarray
    clearance: float = 0.0

    def force(self, part: str, axis: int, shape: dict[str, float]) -> np.ndarray:
        """Minus a part of a term (n,) along an axis, with a coefficient of one."""
        i = axis
        names = {"u": self.displacement[i], "w": self.displacement[1 - i], "du": self.velocity[i],
                 "dw": self.velocity[1 - i], "s": 1.0 - 2.0 * i, "speed": self.speed, "angle": self.angle}  # fmt: skip
        return np.asarray(-eval(part, NUMPY | names | {"p": SimpleNamespace(**shape)}))  # an expression of LIBRARY

    def response(self, term: LibraryTerm, part: str, axis: int, shape: dict[str, float]) -> np.ndarray:
        """Lines (2, lines) [m] of the response to minus a part of a term along an axis, with a coefficient of one."""
        if term.memory is None:
            lines = lines_of_series(self.force(part, axis, shape), len(self.H))
        else:
            lines = -term.memory(2 * np.pi * self.frequencies, **shape) * lines_of_series(
                self.displacement[axis], len(self.H)
            )
        return np.asarray(self.H[:, :, axis] * lines[:, None]).T


@dataclass(frozen=True, eq=False)
class ObservedPlaces:
    """Observed places of a comparison: whitened residual, calibration's columns, motions by place."""

    comparison: TwinComparison
    residual: np.ndarray
    J: np.ndarray
    motions: dict[str, list[PlaceMotion]]

    @classmethod
    def of(cls, comparison: TwinComparison, base: ParameterFit, residual: np.ndarray, J: np.ndarray) -> ObservedPlaces:
        """Motions at all places of the comparison's machine, at the calibration of a fit."""
        places = law_places(comparison.twin.machine)
        motions: dict[str, list[PlaceMotion]] = {name: [] for name in places}
        known: dict[str, dict[str, PlaceMotion]] = {}
        for trial in comparison.trials:
            if trial.inputs not in known:
                same = [k for k, t in enumerate(comparison.trials) if t.inputs == trial.inputs]
                r = np.mean([complex_lines(comparison, k, residual * comparison.sigma) for k in same], axis=0)
                clear = np.mean([np.abs(complex_lines(comparison, k, residual)) for k in same], axis=0) > CLEAR_LINE
                known[trial.inputs] = _motions(comparison, base.point, trial, np.where(clear, r, 0.0), places)
            for name in places:
                motions[name].append(known[trial.inputs][name])
        return cls(comparison, residual, J, motions)

    def columns(self, place: str, term: LibraryTerm, shape: dict[str, float]) -> np.ndarray:
        """Whitened responses (n, 2 parts) to a term at a place: its parts along x, then along y."""
        return self.joined(
            place, lambda m: [m.response(term, part, axis, shape) for axis, part in product((0, 1), term.parts)]
        )

    def joined(self, place: str, lines: Callable[[PlaceMotion], Sequence[np.ndarray]]) -> np.ndarray:
        """Whitened responses (n, k) of all records, whose k `lines` (2, lines) [m] follow from the motion at a place.

        Records that repeat each other share a motion.
        """
        known: dict[int, np.ndarray] = {}
        for t, m in zip(self.comparison.trials, self.motions[place], strict=True):
            if id(m) not in known:
                known[id(m)] = np.column_stack([t.vector(one[None]) for one in lines(m)])
        whole = np.concatenate([known[id(m)] for m in self.motions[place]])
        return np.asarray(whole / self.comparison.sigma[:, None])

    def largest(self, place: str) -> float:
        """Largest displacement [m] at a place."""
        return max(float(np.abs(m.displacement).max()) for m in self.motions[place])


def complex_lines(comparison: TwinComparison, i: int, vector: np.ndarray) -> np.ndarray:
    """Lines (2, lines) of trial i in a data vector, with the mean."""
    layout, lines = comparison.layout, comparison.lines_of(i, vector)
    means = [vector[np.flatnonzero((layout.record == i) & (layout.channel == c))[0]] for c in (0, 1)]
    return np.column_stack([means, lines])


def probe_answers(twin: Twin, point: ParameterPoint, trial: Trial, order: int) -> np.ndarray:
    """Largest vibration of a trial's probes (places,) [m/N] by a force at an order, at each of `law_places`."""
    plant, mesh, seen = linear_model(twin, point, trial)
    moved = seen @ answer(np.linalg.inv, plant.dynamic_stiffness(1j * order * abs(trial.speed)))
    moving = off_shaft(twin.machine)
    shapes = [mesh.moving(moving.get(name, PLANE), z) for name, z in law_places(twin.machine).items()]
    return np.array([np.linalg.norm(moved @ shape.T, 2) for shape in shapes])


def linear_model(twin: Twin, point: ParameterPoint, trial: Trial) -> tuple[LinearPlant, Mesh, np.ndarray]:
    """Plant about its equilibrium in a trial, its mesh, and what the channels see of its coordinates (2, m)."""
    values = point.setting(twin, trial.speed, trial.pressure, trial.changes)
    a = twin.lean(values).set(values)
    plant = linearise(a, settle(a, trial.speed, twin.regulator(values, trial.speed, trial.pressure)), trial.speed)
    ring = ring_axes(values.get(RING_KEY, getattr(twin.effect(RING, 0), "angle", 0.0)))
    seen = np.zeros((2, len(plant.rotor.stiffness)))
    seen[: len(trial.channels)] = trial.directions @ ring @ a.mesh.shape_between(trial.changes.get(PLANE, a.mesh.probe))
    return plant, a.mesh, seen


def _motions(
    comparison: TwinComparison, point: ParameterPoint, trial: Trial, r: np.ndarray, places: dict[str, float]
) -> dict[str, PlaceMotion]:
    """Motions at places in a trial whose clear residual lines (2, lines) [m] come from a force there."""
    twin = comparison.twin
    plant, mesh, seen = linear_model(twin, point, trial)
    omega = 2 * np.pi * trial.frequencies
    Z = answer(np.linalg.inv, plant.factor(1j * omega).stiffness)
    n = 2 ** math.ceil(math.log2(2 * OVER * len(omega)))
    t = np.arange(n) / n * trial.length * RIG_SAMPLE
    found, films, moving = {}, clearances(twin.machine), off_shaft(twin.machine)
    known = {key: value for key, value in trial.changes.items() if key != PLANE}
    for name, z in places.items():
        what = moving.get(name, PLANE)
        own = replace(trial, changes={**known, what: z}, probe_angle=None, names=())
        q = simulate(twin, own, point).mean(axis=0)
        shape = mesh.moving(what, z)
        H, here = (np.array([rows @ inverse @ shape.T for inverse in Z]) for rows in (seen, shape))
        force = np.array([answer(np.linalg.pinv, h, rcond=0.05) @ line for h, line in zip(H, r.T, strict=True)])
        q = q + np.einsum("lij,lj->il", here, force)
        found[name] = PlaceMotion(
            series_of_lines(q, n),
            series_of_lines(1j * omega * q, n),
            trial.angle_of_window + trial.speed * t,
            trial.speed,
            H,
            trial.frequencies,
            films.get(name, 0.0),
        )
    return found


def force_curve(
    seen: ObservedPlaces, place: str, left: np.ndarray,
    along: Callable[[PlaceMotion], tuple[np.ndarray, np.ndarray]],
) -> dict[str, np.ndarray]:  # fmt: skip
    """Moments of the record with the largest motion at a place, with the force (2, n) [N] and its spread `along` it.

    They are displacement, velocity (n, 2), force (n, 2) measured and as given. The measured force is the given one and
    what makes the rest (n,) [m], on the lines on which the given one shows.
    """
    motions = seen.motions[place]
    i = int(np.argmax([np.abs(m.displacement).max() for m in motions]))
    m, n = motions[i], motions[i].displacement.shape[1]
    force, spread = along(m)
    lines, comparison = lines_of_series(force, len(m.H)), seen.comparison
    shows = np.abs(np.einsum("lij,jl->il", m.H, lines)) > complex_lines(comparison, i, comparison.sigma).real
    rest = np.where(shows.any(axis=0), complex_lines(comparison, i, left), 0.0)
    more = np.array([answer(np.linalg.pinv, h, rcond=0.05) @ line for h, line in zip(m.H, rest.T, strict=True)]).T
    apart = max(int(PART * n / MOMENTS), 1)  # one after the other, so that their way is seen
    first = int(np.argmax(np.abs(m.displacement).max(axis=0))) - min(MOMENTS, n) // 2 * apart
    chosen = (first + apart * np.arange(min(MOMENTS, n))) % n
    return {"displacement": m.displacement.T[chosen], "velocity": m.velocity.T[chosen],
            "measured": (force + series_of_lines(more, n)).T[chosen], "law": force.T[chosen],
            "spread": spread.T[chosen]}  # fmt: skip


def lines_of_series(series: np.ndarray, count: int) -> np.ndarray:
    """Lines (..., count) of a series (..., n)."""
    found = np.fft.rfft(series)[..., :count] * (2 / series.shape[-1])
    found[..., 0] /= 2
    return np.asarray(found)


def series_of_lines(lines: np.ndarray, n: int) -> np.ndarray:
    """Series (2, n) of lines (2, k)."""
    whole = np.zeros((2, n // 2 + 1), complex)
    whole[:, : lines.shape[1]] = lines * (n / 2)
    whole[:, 0] *= 2
    return np.asarray(np.fft.irfft(whole, n, axis=1))
