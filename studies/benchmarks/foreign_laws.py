r"""Records of the independent rotor with a law that no catalogue has, and verdicts of `diagnose` on fourteen.

    python -m studies.benchmarks.foreign_laws FOLDER [--seeds 1] [--laws NAME ...] [--size 1.0]

One plane of probes, six speeds, two amplitudes of a periodic force on the first disc, every record made twice, noise of
0.2 um. The matrices are those of `foreign_rotor`; a law acts at one place. What repeats with the force is found line by
line and moment by moment in turn,

.. math:: q = H(\omega)\,(f + \mathcal F\{F(q, \dot q, t)\}),

which has no step in time. A law's size is such that the change of the response at the probes has the stated number of
`FLOOR`; each law of a pair does so alone. Supports are 10 to 20 % off those of the machine file. Truths are written,
with their hash, before any verdict.

Cites: friswell_2010.
"""

import argparse
import hashlib
import json
import re
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import NoConvergence, brentq, newton_krylov
from scipy.signal import lfilter

import identification as idn
from rotorsim.base.errors import RotorsimError
from rotorsim.discrepancy import diagnose
from rotorsim.discrepancy.calibration import CompiledModels
from rotorsim.discrepancy.gap import reduction
from rotorsim.machine import Machine
from studies.benchmarks.foreign_rotor import BEARINGS, DISCS, UNBALANCE, TwoDiscRig, machine_text, rotor

RATE, PERIOD, PERIODS = 5000, 0.5, 4
"""Sampling rate [Hz], period [s] of the force and periods of a record."""
SPEEDS = {"fit": (16, 28, 40, 72), "held_out": (36,), "untouched": (64,)}
"""Shaft speeds [Hz] by role."""
AMPLITUDES, FORCE_LINES = (1.0, 0.5), np.arange(2.0, 180.0, 4.0)
"""Factors on the force, and its lines [Hz], which no order of a speed meets."""
FORCE = 0.6
"""Force of a line [N]."""
NOISE, FLOOR = 2e-7, 2e-7
"""Noise of a sample, and unit of the change that a law makes [m]."""
HELD = True
"""Whether the force of a sample holds until the next one."""
POINTS, HIGHEST = 8192, 800.0
"""Moments in a period, and highest line [Hz] of the response."""
PLACES = {"left bearing": 0, "disc 0": 4, "disc 1": 9, "right bearing": 12, "right housing": 13}
"""Nodes at which a law may act."""
HOUSING = (2.5, 4e6, 3e6, 400.0, 400.0)
"""Mass [kg], stiffness along x and y [N/m] and damping [N s/m] of the right bearing's housing, where it moves."""
WANDER = float(np.sqrt(2) * RATE**1.5 / np.sqrt(8))
"""Standard deviation of the noise behind two low-passes of a second that makes the angle of the shaft."""
Force = Callable[[np.ndarray, np.ndarray, np.ndarray, float], np.ndarray]
"""Force (2, n) [N] of displacement and velocity (2, n), shaft angle (n,) and speed [rad/s]."""


@dataclass(frozen=True)
class HiddenLaw:
    """A law of unit size: a force of the motion, a dynamic stiffness of omega, or something that does not repeat.

    `kind` is the class of term that is right, 'stochastic' for what does not repeat.
    """

    name: str
    kind: str
    force: Force | None = None
    stiffness: Callable[[float, float], np.ndarray] | None = None
    places: tuple[str, ...] = ("left bearing", "disc 1", "right bearing")


def each(f: Callable[[np.ndarray, np.ndarray, np.ndarray, float], np.ndarray]) -> Force:
    """Force that opposes f of displacement, velocity, angle and speed, axis by axis."""
    return lambda u, v, angle, speed: -f(u, v, angle, speed)


DEAD, DELAY, ABSORBER = 4e-6, 1e-3, (2 * np.pi * 62.0, 0.02)
"""Half width of the dead band [m], the delay [s], resonance [rad/s] and damping ratio of the absorber."""
LAWS = (
    HiddenLaw("cubic", "cubic", each(lambda u, v, a, w: u**3)),
    HiddenLaw("quadratic", "quadratic", each(lambda u, v, a, w: u**2)),
    HiddenLaw("dry", "dry", each(lambda u, v, a, w: np.tanh(v / 3e-5))),
    HiddenLaw("drag", "drag", each(lambda u, v, a, w: np.abs(v) * v)),
    HiddenLaw("parametric", "parametric", each(lambda u, v, a, w: np.cos(2 * a) * u), places=("disc 0", "disc 1")),
    HiddenLaw("dead band", "dead band", each(lambda u, v, a, w: np.sign(u) * np.maximum(np.abs(u) - DEAD, 0.0))),
    HiddenLaw("delayed", "delayed", stiffness=lambda omega, w: np.eye(2) * np.exp(-1j * omega * DELAY)),
    HiddenLaw("swirl", "swirl", stiffness=lambda omega, w: w**2 * np.array([[0, 1], [-1, 0]]),
        places=("disc 0", "disc 1")),
    HiddenLaw("absorber", "absorber", stiffness=lambda omega, w: -np.eye(2) * omega**2 * absorbed(omega),
        places=("disc 0", "disc 1")),
    HiddenLaw("softening with speed", "speed", stiffness=lambda omega, w: -(w**2) * np.eye(2)),
    HiddenLaw("broadband", "stochastic"),
    HiddenLaw("line", "stochastic"),
    HiddenLaw("drift", "stochastic"),
    HiddenLaw("moving unbalance", "stochastic", places=("disc 0", "disc 1")),
    HiddenLaw("speed wander", "stochastic", places=("disc 0",)),
)  # fmt: skip
"""Fourteen laws, and a speed that wanders."""


def absorbed(omega: float) -> complex:
    """Motion of the mass on a spring over that of its foot."""
    own, zeta = ABSORBER
    return (own**2 + 2j * zeta * own * omega) / (own**2 - omega**2 + 2j * zeta * own * omega)


@dataclass(frozen=True)
class LawCase:
    """A law of a size at a place of the rig, with the seed of everything that is drawn."""

    law: HiddenLaw
    place: str
    size: float
    rig: TwoDiscRig
    seed: int
    other: "LawCase | None" = None
    """A second law that acts too; its rig is not used."""

    @property
    def acting(self) -> "tuple[LawCase, ...]":
        """The laws that act."""
        return (self, self.other) if self.other else (self,)

    @property
    def name(self) -> str:
        """Names of the laws that act."""
        return " and ".join(one.law.name for one in self.acting)

    @property
    def truth(self) -> dict[str, Any]:
        """All that is drawn."""
        own = {"other": self.other.truth} if self.other else {}
        return own | {"law": self.law.name, "kind": self.law.kind, "place": self.place, "size": self.size,
                "seed": self.seed, "bearings": self.rig.bearings, "unbalance": self.rig.unbalance}  # fmt: skip

    @property
    def node(self) -> int:
        """Node at which the law acts."""
        return PLACES[self.place]


def receptance(rig: TwoDiscRig, hertz: float, lines: np.ndarray, outs: tuple[int, ...], ins: tuple[int, ...],
               more: Callable[[float], np.ndarray] | None = None, node: int = 0) -> np.ndarray:  # fmt: skip
    """Receptance (lines, 2 outs, 2 ins) between nodes at a speed, with a dynamic stiffness more (2, 2) at a node."""
    rows, columns = (np.ravel([(4 * n, 4 * n + 1) for n in nodes]) for nodes in (outs, ins))
    found = np.zeros((len(lines), len(rows), len(columns)), complex)
    for i, f in enumerate(lines):
        omega = 2 * np.pi * f
        M, C, K = rotor(rig, 2 * np.pi * hertz, omega)
        if more is not None:
            K = K.copy()
            K[4 * node : 4 * node + 2, 4 * node : 4 * node + 2] += more(omega)
        unit = np.zeros((len(M), len(columns)))
        unit[columns, np.arange(len(columns))] = 1.0
        found[i] = np.linalg.solve(K - omega**2 * M + 1j * omega * C, unit)[rows]
    return found


DISC_NODES = tuple(node for node, *_ in DISCS)


def excitation(rig: TwoDiscRig, hertz: float, amplitude: float, lines: np.ndarray) -> np.ndarray:
    """Lines (lines, 4) [N] of the forces on both discs, those of the exciter and of the unbalance."""
    rng, speed = np.random.default_rng(7), 2 * np.pi * hertz
    f = np.zeros((len(lines), 4), complex)
    at = np.searchsorted(lines, FORCE_LINES)
    f[at, :2] = amplitude * FORCE * np.exp(2j * np.pi * rng.uniform(size=(len(at), 2)))
    turning = np.searchsorted(lines, hertz)
    for i, (me, phase) in enumerate(rig.unbalance):
        f[turning, 2 * i : 2 * i + 2] += me * np.exp(1j * phase) * speed**2 * np.array([1, -1j])
    return f


def repeated(case: LawCase, hertz: float, amplitude: float, size: float, known: dict[Any, Any]) -> np.ndarray:
    """Lines (lines, 2) [m] at the probes, mean included, of the motion that repeats with the force."""
    lines, laws = np.arange(0.0, HIGHEST, 1 / PERIOD), (replace(case, size=size), *case.acting[1:])
    if hertz not in known:
        nodes = [one.node for one in laws]
        known[hertz] = receptance(case.rig, hertz, lines, (DISC_NODES[0], *nodes), (*DISC_NODES, *nodes))
    H, f, speed = known[hertz], excitation(case.rig, hertz, amplitude, lines), 2 * np.pi * hertz
    held = np.isin(lines, FORCE_LINES) & HELD
    f[held, :2] *= (np.sinc(lines / RATE) * np.exp(-1j * np.pi * lines / RATE))[held, None]
    q = np.einsum("lij,lj->li", H[:, :, :4], f)
    probes, there, inner = q[:, :2], q[:, 2:], H[:, 2:, 4:]
    Z = np.zeros_like(inner)
    for k, one in enumerate(laws):
        if one.law.stiffness is not None:
            own = slice(2 * k, 2 * k + 2)
            Z[:, own, own] = [one.size * one.law.stiffness(omega, speed) for omega in 2 * np.pi * lines]
    closed = np.linalg.inv(np.eye(inner.shape[1]) + inner @ Z)
    there, inner = np.einsum("lij,lj->li", closed, there), closed @ inner
    force = nonlinear(laws, there, inner, lines, speed)
    moved = there + np.einsum("lij,lj->li", inner, force)
    return np.asarray(probes + np.einsum("lij,lj->li", H[:, :2, 4:], force - np.einsum("lij,lj->li", Z, moved)))


def nonlinear(
    laws: Sequence[LawCase], there: np.ndarray, inner: np.ndarray, lines: np.ndarray, speed: float
) -> np.ndarray:
    """Lines (lines, 2 laws) [N] of the forces of laws whose places move so without them (lines, 2 laws) [m]."""
    own = {k: one.law.force for k, one in enumerate(laws) if one.law.force is not None and one.size}
    force, angle = np.zeros_like(there), speed * np.arange(POINTS) * PERIOD / POINTS
    names = " and ".join(f"{one.law.name} at {one.place}" for one in laws)

    def answered(force: np.ndarray) -> np.ndarray:
        """Forces of the laws along the motion that these forces make."""
        moved, new = there + np.einsum("lij,lj->li", inner, force), np.zeros_like(force)
        for k, f in own.items():
            at = slice(2 * k, 2 * k + 2)
            u, v = (in_time(one[:, at]) for one in (moved, 2j * np.pi * lines[:, None] * moved))
            new[:, at] = in_lines(laws[k].size * f(u, v, angle, speed), len(lines))
        return new

    for _ in range(400 if own else 0):
        new = answered(force)
        change, force = np.abs(new - force).max(), force + 0.5 * (new - force)
        if change < 1e-7 * max(np.abs(force).max(), 1e-12):
            return force
        if not np.abs(force).max() < 1e3:
            raise ValueError(f"{names}, {speed:.4g} rad/s: no motion that stays small was found")
    if not own:
        return force
    try:  # where friction is steep the steps above have no end
        found = newton_krylov(lambda x: (answered(x.view(complex)) - x.view(complex)).view(float), force.view(float),
                              f_tol=1e-7 * np.abs(force).max(), maxiter=50)  # fmt: skip
    except NoConvergence:
        raise ValueError(f"{names}, {speed:.4g} rad/s: no periodic motion was found") from None
    return np.asarray(found.view(complex))


def in_time(lines: np.ndarray) -> np.ndarray:
    """Series (2, POINTS) over a period of lines (lines, 2)."""
    whole = np.zeros((POINTS // 2 + 1, 2), complex)
    whole[: len(lines)] = lines * (POINTS / 2)
    whole[0] = lines[0] * POINTS
    return np.asarray(np.fft.irfft(whole, POINTS, axis=0).T)


def in_lines(series: np.ndarray, count: int) -> np.ndarray:
    """Lines (count, 2) of series (2, POINTS)."""
    found = np.fft.rfft(series, axis=1).T[:count] * (2 / POINTS)
    found[0] /= 2
    return np.asarray(found)


def random_motion(
    case: LawCase, hertz: float, size: float, rng: np.random.Generator, samples: int, known: dict[Any, Any]
) -> np.ndarray:
    """Displacement (samples, 2) [m] at the probes of a broadband force, or of one at 0.42 of the speed."""
    whole = 2 * samples
    lines = np.fft.rfftfreq(whole, 1 / RATE)
    below = lines < 300.0
    if ("fine", hertz) not in known:
        known["fine", hertz] = receptance(case.rig, hertz, lines[below], (DISC_NODES[0],), (case.node,))
    H = known["fine", hertz]
    f = rng.normal(size=(below.sum(), 2)) + 1j * rng.normal(size=(below.sum(), 2))
    if case.law.name == "line":
        f *= np.exp(-0.5 * ((lines[below] - 0.42 * hertz) / 0.3) ** 2)[:, None] * 10
    spectrum = np.zeros((len(lines), 2), complex)
    spectrum[below] = size * np.einsum("lij,lj->li", H, f) * np.sqrt(whole)
    return np.asarray(np.fft.irfft(spectrum, whole, axis=0)[:samples])


def wandering(line: np.ndarray, hertz: float, size: float, rng: np.random.Generator, samples: int) -> np.ndarray:
    """Displacement (samples, 2) [m] that a line (2,) [m] at 1X adds where the angle of the shaft wanders by size [rad].

    The angle is white noise behind two low-passes of a second, which the motion follows at once.
    """
    t = np.arange(samples) / RATE
    angle = lfilter([1.0], np.poly(2 * [np.exp(-1 / RATE)]), rng.normal(size=samples + 10 * RATE))[-samples:]
    turning = np.exp(1j * (2 * np.pi * hertz * t))[:, None] * (np.exp(1j * size * angle / WANDER)[:, None] - 1)
    return np.asarray((line * turning).real)


def points() -> list[tuple[str, int, float, int]]:
    """Role, speed [Hz], amplitude and number of the repeat of all records, in the order in which they are made."""
    return [(role, hertz, a, k) for k in (0, 1) for role, speeds in SPEEDS.items() for hertz in speeds
            for a in AMPLITUDES]  # fmt: skip


def displacement(case: LawCase, number: int, size: float, known: dict[Any, Any]) -> np.ndarray:
    """Displacement (n, 2) [m] of a record without noise."""
    _, hertz, amplitude, _ = points()[number]
    own, rng, share = case, np.random.default_rng([case.seed, 77, number]), number / (len(points()) - 1)
    if case.law.name == "drift":
        bearings = list(case.rig.bearings)
        k = 0 if case.place == "left bearing" else 1
        bearings[k] = tuple(v * (1 - size * share) for v in bearings[k][:2]) + bearings[k][2:]
        own, known = replace(case, rig=replace(case.rig, bearings=tuple(bearings))), {}
    if case.law.name == "moving unbalance":
        k = 0 if case.place == "disc 0" else 1
        more = size * complex(*rng.normal(size=2))
        z = case.rig.unbalance[k][0] * np.exp(1j * case.rig.unbalance[k][1]) + more
        unbalance = tuple((abs(z), float(np.angle(z))) if i == k else one for i, one in enumerate(case.rig.unbalance))
        own = replace(case, rig=replace(case.rig, unbalance=unbalance))
    lines = repeated(own, hertz, amplitude, size, known)
    n = round(RATE * PERIOD)
    whole = np.zeros((n // 2 + 1, 2), complex)
    whole[: len(lines)] = lines * n / 2
    whole[0] *= 2
    y = np.tile(np.fft.irfft(whole, n, axis=0), (PERIODS, 1))
    if case.law.name == "speed wander":
        y = y + wandering(lines[round(hertz * PERIOD)], hertz, size, rng, len(y))
    if case.law.name in ("broadband", "line"):
        y = y + random_motion(case, hertz, size, rng, len(y), known)
    return np.asarray(y)


def change(case: LawCase, size: float, known: dict[Any, Any]) -> float:
    """Change of the response at the probes by a law of a size, rms over records to fit of the larger amplitude [m]."""
    numbers = [i for i, (role, _, a, k) in enumerate(points()) if role == "fit" and a == 1.0 and k == (
        1 if case.law.kind == "stochastic" else 0)]  # fmt: skip
    moved = [displacement(case, i, size, known) - displacement(case, i, 0.0, known) for i in numbers]
    return float(np.sqrt(np.mean([(m - m.mean(axis=0)) ** 2 for m in moved]))) * np.sqrt(2)


def drawn(law: HiddenLaw, seed: int, factor: float = 1.0) -> LawCase:
    """Case of a law: place, supports and unbalance drawn, and a size that changes the response by 3 to 10 floors."""
    rng = np.random.default_rng([seed, *law.name.encode()])
    off = 1 + rng.choice([-1, 1], (2, 4)) * rng.uniform(0.1, 0.2, (2, 4))
    bearings = tuple(tuple(map(float, own)) for own in off * np.array(BEARINGS)[:, 1:])
    unbalance = tuple((float(me * rng.uniform(0.7, 1.4)), float(rng.uniform(-1, 1))) for me in UNBALANCE)
    places = ("left bearing", "right bearing") if law.name == "drift" else law.places
    case = LawCase(law, str(rng.choice(places)), 0.0, TwoDiscRig(bearings, unbalance, hum=0.0), seed)
    return sized(case, FLOOR * factor * float(np.exp(rng.uniform(np.log(3), np.log(10)))))


def on_housing(case: LawCase) -> LawCase:
    """A case with its law under the right bearing's housing, which moves, and as large a change of the response."""
    own = replace(case, place="right housing", rig=replace(case.rig, housing=HOUSING))
    return sized(own, change(case, case.size, {}))


def drawn_pair(name: str, seed: int, factor: float = 1.0) -> LawCase:
    """Case of a pair of laws, on the rig of the first one, each of which changes the response alone as in `drawn`."""
    *names, together = PAIRS[name]
    first, second = (drawn(next(law for law in LAWS if law.name == own), seed, factor) for own in names)
    free = [place for place in second.law.places if place != first.place]
    place = first.place if together else str(np.random.default_rng([seed, *name.encode()]).choice(free))
    wanted = change(second, second.size, {})
    return replace(first, other=sized(replace(second, rig=first.rig, place=place), wanted))


def sized(case: LawCase, wanted: float) -> LawCase:
    """A case with the size at which its law changes the response by this [m]."""
    known: dict[Any, Any] = {}

    def missed(log_size: float) -> float:
        try:
            return float(np.log(change(case, float(np.exp(log_size)), known) / wanted))
        except (ValueError, FloatingPointError):
            return 10.0

    low = np.log(STARTS[case.law.name]) - 3
    while missed(low) > 0:
        low -= 3
    high = low + 1.5
    while missed(high) < 0:
        high += 1.5
    return replace(case, size=float(np.exp(brentq(missed, low, high, xtol=1e-3))))


PAIRS = {
    "cubic and drag": ("cubic", "drag", True), "cubic and dry": ("cubic", "dry", False),
    "swirl and quadratic": ("swirl", "quadratic", False),
}  # fmt: skip
"""Two laws at once, by the names of both, and whether they act at one place."""
STARTS = {
    "cubic": 1e15, "quadratic": 3e9, "dry": 0.3, "drag": 1e5, "parametric": 1e4, "dead band": 1e5, "delayed": 3e4,
    "swirl": 0.1, "absorber": 0.03, "softening with speed": 1.0, "broadband": 1e-3, "line": 1e-3, "drift": 0.03,
    "moving unbalance": 1e-6, "speed wander": 0.03,
}  # fmt: skip
"""Sizes [SI] near which that of a law is looked for."""


def records(case: LawCase) -> list[Any]:
    """Records of a case as Datasets with their roles."""
    known: dict[Any, Any] = {}
    n = round(RATE * PERIOD)
    lines, found = np.arange(0.0, HIGHEST, 1 / PERIOD), []
    for i, (role, hertz, amplitude, repeat) in enumerate(points()):
        rng, t = np.random.default_rng([case.seed, 5, i]), np.arange(n * PERIODS) / RATE
        f = excitation(case.rig, 0.0, amplitude, lines)
        f[0] = 0.0
        whole = np.zeros((n // 2 + 1, 2), complex)
        whole[: len(lines)] = f[:, :2] * n / 2
        force = np.tile(np.fft.irfft(whole, n, axis=0), (PERIODS, 1))
        y = displacement(case, i, case.size, known)
        made = idn.from_arrays(
            t, None, y + rng.normal(0, NOISE, y.shape), angle=2 * np.pi * hertz * t, speed=2 * np.pi * hertz,
            disc_force=force, attrs={"record": f"{role}_{hertz}_{amplitude:g}_{repeat}", "role": role},
        )  # fmt: skip
        found.append(made)
    return found


RIGHT_TERMS = {
    "cubic": ("cubic", "radial cubic"), "quadratic": ("quadratic",), "dry": ("dry", "radial dry"),
    "drag": ("drag", "radial drag"), "parametric": ("stiffness at 2X",), "dead band": ("dead band",),
    "delayed": ("delayed stiffness",), "swirl": ("swirl with speed squared",), "absorber": ("hidden mass",),
    "speed": ("stiffness with speed squared",),
}  # fmt: skip
"""Terms of the library that are right, by the class of a law."""


def machine_of_laws(housing: bool = False) -> Machine:
    """The machine file as it is believed to be, without its weight: laws act about the middle of their places."""
    machine = Machine.from_text(re.sub(r"\[effects\.gravity\]\n.*\n", "", machine_text()))
    mass, kx, ky, cx, cy = HOUSING
    support = {"mass": f"{mass} kg", "kxx": f"{kx} N/m", "kyy": f"{ky} N/m", "cxx": f"{cx} N*s/m", "cyy": f"{cy} N*s/m"}
    return machine.replace("bearings.1.support", support) if housing else machine


KINDS = {
    "broadband": "broadband force",
    "line": "line",
    "drift": "drift",
    "moving unbalance": "drift",
    "speed wander": "speed wander",
}
"""Kind of what does not repeat, by the name of a law."""


def judged(case: LawCase, found: Any) -> dict[str, Any]:
    """Outcome of a verdict with place, form, relative error of the size and share of the gap gone.

    Of two laws the found terms may be those of either one, or of both, each at its place. A tie of places that holds
    the true one is an outcome of its own, whose place is not right.
    """
    out: dict[str, Any] = {"status": found.status, "gap": None if not found.discovered else reduction(found.gap)}
    if found.status == "discovered":
        out |= judged_law(case, found.discovered)
    elif found.status == "stochastic":
        force, kind = found.stochastic, KINDS.get(case.law.name)
        out |= {"place": force.place in (place_of(case), "the drive"), "near": place_of(case) in force.others}
        out["outcome"] = "WRONG stochastic" if kind is None else "right" if force.kind == kind else "WRONG kind"
    elif found.status in ("named", "tie"):
        out["outcome"] = "WRONG name"
    else:
        out["outcome"] = "silent" if found.status in ("unknown", "partial") else found.status
    return out


def judged_law(case: LawCase, law: Any) -> dict[str, Any]:
    """Place, form, error and outcome of a discovered law."""
    right = {kind: one for one in case.acting for kind in RIGHT_TERMS.get(one.law.kind, ())}
    at = [place for place, _ in law.places] or [law.place] * len(law.kinds)
    there = [place == place_of(right[kind]) if kind in right else place in map(place_of, case.acting)
             for kind, place in zip(law.kinds, at, strict=True)]  # fmt: skip
    out = {"place": all(there), "near": any(place_of(one) in " ".join(law.near) for one in case.acting),
           "form": set(law.kinds) <= set(right), "kinds": list(law.kinds), "error": None}  # fmt: skip
    if not out["form"]:
        return out | {"outcome": "WRONG law"}
    sizes = [size_of(right[kind], v) for kind in law.kinds for key, (v, _) in law.terms.items()
             if re.fullmatch(rf"{kind.replace(' ', '_')}(_1)?(_[xy])?", key)]  # fmt: skip
    every = len(case.acting) == len({right[kind].law.name for kind in law.kinds})
    wrong = "right, places tied" if set(map(place_of, case.acting)) <= set(law.tied) else "WRONG place"
    outcome = ("right" if every else "right, one of two") if out["place"] else wrong
    return out | {"error": max(abs(size - 1) for size in sizes), "outcome": outcome}


def place_of(case: LawCase) -> str:
    """Place of a law as a verdict calls it."""
    side, _, part = case.place.partition(" ")
    return {"bearing": f"the bearing {side}", "housing": f"the housing of the bearing {side}"}.get(part, case.place)


def size_of(case: LawCase, value: float) -> float:
    """A found coefficient over the true one."""
    sign = -1.0 if case.law.kind in ("speed",) else 1.0
    return sign * value / case.size


def diagnosed(case: LawCase, models: CompiledModels) -> dict[str, Any]:
    """Verdict on one case with its outcome."""
    made, cpu = records(case), time.process_time()
    try:
        found = diagnose(models.twin.machine, made, models=models)
    except RotorsimError as error:
        return {"outcome": "refused", "sentence": str(error), "cpu_s": time.process_time() - cpu, "status": "refused"}
    cpu = time.process_time() - cpu
    return judged(case, found) | {"sentence": found.sentence, "cpu_s": cpu, "notes": list(found.notes),
                                  "odds": list(found.odds.items())[:3]}  # fmt: skip


def main() -> None:
    """Write the truth, then diagnose case by case."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    names = [law.name for law in LAWS]
    parser.add_argument("--laws", nargs="+", choices=[*names, *PAIRS], default=names, help="laws, or pairs of them")
    parser.add_argument("--size", type=float, default=1.0, help="factor on all sizes")
    parser.add_argument("--housing", action="store_true", help="every law under the right bearing's housing")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    cases = [drawn(law, seed, asked.size) for seed in asked.seeds for law in LAWS if law.name in asked.laws]
    cases += [drawn_pair(name, seed, asked.size) for seed in asked.seeds for name in PAIRS if name in asked.laws]
    cases = [on_housing(case) for case in cases] if asked.housing else cases
    truth = json.dumps([case.truth for case in cases], sort_keys=True)
    (asked.folder / "truth.json").write_text(truth)
    print(f"truth {hashlib.sha256(truth.encode()).hexdigest()}", flush=True)
    models = CompiledModels.of(machine_of_laws(asked.housing))
    for case in cases:
        found = diagnosed(case, models) | {"at": [place_of(one) for one in case.acting]}
        found |= {"law": case.name, "sizes": [one.size for one in case.acting]}
        with (asked.folder / "results.jsonl").open("a") as file:
            file.write(json.dumps(found, default=float) + "\n")
        shown = {key: found.get(key) for key in ("place", "form", "error", "gap")}
        text = f"{case.name}, {' and '.join(found['at'])}: {found['sentence']} {shown}"
        print(f"{found['outcome']:16} {found['cpu_s']:5.0f} s  {text}", flush=True)


if __name__ == "__main__":
    main()
