r"""Controllers of the live rig: the proportional law, shipped laws and saved ones, and the check before one acts.

The shipped law `hinf` was designed in the folder `shipped` on the identified Model 2 of the shipped rig:

    rotorsim design hinf rig_model_2.json --preset rig --out hinf.json

It has the limits of plausibility of that design, so sensors that are turned or reversed on the page give an alarm.

A law is checked in a sampled loop with the plant's own linear model before it is switched on:

.. math:: G(z) = z^{-1} Z\{H_0(s)\, G_{plant}(s)\, G_{pins}(s)\}, \qquad S = (I - G K)^{-1}

It is refused where the loop is unstable with its own gain or one that is `MARGIN` larger or smaller, and where the
present motion, m_n at the order n of the shaft's speed, would take more of the actuators' range than `RESERVE`: the
reference is K S m_n, the disc then moves by m_n + (S - 1) m_n. What a controller that is on moves is taken from m_n.
Pins are linear here, the two of an axis alike; hysteresis and creep make their gain uncertain, hence the margin. Film
modes beyond `FAST` are taken to follow at once.

Cites: astrom_1997.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rotorsim.base.errors import DataError, RotorsimError
from rotorsim.base.units import MPA, RPM, TO_UM
from rotorsim.control.law import load_law
from rotorsim.control.runout import RunoutTable
from rotorsim.control.sampled_loop import closed_poles, law_system, smallest_damping
from rotorsim.control.systems import (
    System,
    added,
    balanced_states as balanced,
    block_diag,
    feedback,
    gain,
    held,
    late,
    response,
    series,
    side_by_side,
)
from rotorsim.experiments.laws import ProportionalLaw
from rotorsim.live.modes import ORDERS
from rotorsim.live.settings import OFF, P_LAW, driven_axes
from rotorsim.machine import Machine
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.kernels.layout import ANGLE_READ, AT, DISC, DISC_READ, REFERENCE, inputs_of
from rotorsim.plant.linearise import linearise
from rotorsim.plant.simulation import describe, settle

SHIPPED = Path(__file__).parent / "shipped"
LAWS = ("hinf",)
"""Shipped laws by name; the folder also holds the model that they were designed on."""


def read_laws(paths: Sequence[Path], machine: Machine | None = None) -> dict[str, Any]:
    """Laws by file name, after those of the machine; raises LawError or DataError.

    A machine whose pins are not driven along both axes takes none.

    Examples
    --------
    >>> import rotorsim as rs
    >>> sorted(rs.live.read_laws([], machine))[:1]
    ['P']
    """
    if machine is not None and driven_axes(machine) != "xy":
        if paths:
            raise DataError(f"--law: {machine.name} has no injectors that a controller could move; leave it out")
        return {OFF: None}
    laws: dict[str, Any] = {OFF: None, P_LAW: P_LAW}
    laws |= {path.stem: load_law(path) for path in (SHIPPED / f"{name}.json" for name in LAWS)}
    for path in paths:
        if path.stem in laws:
            raise DataError(f"--law {path}: there is a controller '{path.stem}' already; rename the file")
        laws[path.stem] = load_law(path)
    return laws


def running(law: Any, centre: tuple[float, float]) -> Any:
    """Controller at rest, with its centre at `centre` [m] if it has none of its own."""
    if law == P_LAW:
        return ProportionalLaw(centre=centre)
    return law.with_(centre=centre) if law.centre is None else law


RESERVE = 0.8
"""Share of the actuators' range that the present motion may ask for."""
MARGIN = 1.5
"""Factor by which the loop's gain may be off."""
FAST = 2e4
"""Eigenvalue [rad/s] from which a mode of the plant follows at once: above the Nyquist frequency of the law's
samples, 1.6e4."""
FEWEST = 500
"""Samples that show a motion."""
DECAY = 1000
"""Samples after a change that are left out: free vibration of what was changed, .2 s at 5 kHz."""
FIRST = 2.0
"""Highest mode whose damping is stated, as a multiple of the plant's lowest."""


@dataclass(frozen=True)
class Motion:
    """Motion now: disc and its measurement [um] and the output [V] of the controller that is on, mean and amplitudes
    (1 + orders, 2); rest of the measurement (2,) [um, rms], external reference (2,) [V], turns per sample [rad]."""

    disc: np.ndarray
    measured: np.ndarray
    output: np.ndarray
    noise: np.ndarray
    reference: np.ndarray
    turn: float


@dataclass(frozen=True)
class StabilityVerdict:
    """Verdict on a law at an operating point.

    Smallest damping ratio without and with it, 1X amplitude [um] of the disc without and with it, largest reference
    [V]; `why` it is refused.
    """

    why: str = ""
    damping: tuple[float, float] = (0.0, 0.0)
    orbit: tuple[float, float] = (0.0, 0.0)
    volts: float = 0.0

    def sentence(self, name: str) -> str:
        """Message when it is switched on."""
        (zeta, own), (before, after) = self.damping, self.orbit
        sentence = f"{name} is on; by the linear model smallest damping {zeta:.3f} -> {own:.3f}"
        return sentence + (f", orbit at 1X {before:.1f} -> {after:.1f} um" if max(before, after) > 0.05 else "")


def motion(
    rows: np.ndarray, Ts: float, external: tuple[float, float] = (0.0, 0.0), runout: RunoutTable | None = None
) -> Motion | None:
    """Motion in the last rows (n, columns + 6), a row every Ts [s], under a constant reference [V]; None if too few.

    What is measured is less the `runout` that a law takes off.
    """
    if len(rows) < FEWEST:
        return None
    disc = rows[:, DISC] * TO_UM
    read = rows[:, DISC_READ] * TO_UM
    if runout is not None:
        read = read - runout.at(rows[:, ANGLE_READ]) * TO_UM
    speed = float(rows[-1, AT["speed"]])
    orders = ORDERS if abs(speed) * Ts * len(rows) > 2 * np.pi else ()
    waves = [np.ones(len(rows))] + [np.exp(1j * n * rows[:, AT["angle"]]) for n in orders]
    real = np.stack([waves[0], *(f(w) for w in waves[1:] for f in (np.real, np.imag))], axis=1)
    output = inputs_of(rows)[:, REFERENCE] - np.asarray(external)
    moved, seen, asked = (np.linalg.lstsq(real, table, rcond=None)[0] for table in (disc, read, output))
    noise = (read - real @ seen).std(axis=0)
    return Motion(_complex(moved), _complex(seen), _complex(asked), noise, np.asarray(external), speed * Ts)


def _complex(parts: np.ndarray) -> np.ndarray:
    """Mean and complex amplitudes (1 + orders, 2) from cosine and sine parts; orders that were not fitted are zero."""
    found = np.zeros((1 + len(ORDERS), 2), complex)
    found[0] = parts[0]
    for k in range((len(parts) - 1) // 2):
        found[1 + k] = parts[1 + 2 * k] - 1j * parts[2 + 2 * k]
    return found


def check(a: Assembly, law: Any, speed: float, pressure: float, now: Motion | None, limit: float) -> StabilityVerdict:
    """Verdict on a law at a speed [rad/s] and gauge pressure [Pa]; `now`: present motion, `limit`: range [V]."""
    where, Ts = f"{speed / RPM:.0f} rpm, {pressure / MPA:.2f} MPa", a.machine.sampling_time
    try:
        w = settle(a, speed, pressure)
        G, near = sampled(a, w, speed)
        K = law_of(law, speed, pressure, Ts)
    except RotorsimError as error:
        return StabilityVerdict(f"it cannot be checked at {where}: {error}")
    poles = closed_poles(G, K)
    for factor in (1.0, MARGIN, 1 / MARGIN):
        worst = closed_poles(G, System(K.A, K.B, factor * K.C, factor * K.D))
        worst = worst[np.abs(worst).argmax()]
        if abs(worst) >= 1:
            return StabilityVerdict(_leaves(worst, factor, where, Ts))
    highest = FIRST * near / (2 * np.pi)
    damping = (smallest_damping(np.linalg.eigvals(G.A), Ts, highest), smallest_damping(poles, Ts, highest))
    if now is None:
        return StabilityVerdict("", damping)
    orbit, volts = _reserve(G, K, now, describe(a, w).disc * TO_UM)
    why = ""
    if volts > RESERVE * limit:
        why = f"the present motion would take {volts:.1f} V of its {limit:g} V at {where}"
    return StabilityVerdict(why, damping, orbit, volts)


def _leaves(pole: complex, factor: float, where: str, Ts: float) -> str:
    gain = "" if factor == 1.0 else f" if the pins move {abs(factor - 1):.0%} {'more' if factor > 1 else 'less'}"
    rate, hertz = np.log(abs(pole)) / Ts, abs(np.angle(pole)) / (2 * np.pi * Ts)
    return f"with it the rotor is unstable{gain} at {where} (grows at {rate:.2g} 1/s, {hertz:.3g} Hz)"


def _reserve(G: System, K: System, now: Motion, rest: np.ndarray) -> tuple[tuple[float, float], float]:
    """1X amplitude [um] of the disc without and with the law, and the largest reference [V]."""
    orders = np.exp(1j * now.turn * np.arange(1 + len(ORDERS)))
    plant, law = response(G, orders), response(K, orders)
    driven = np.einsum("n,nij,nj->ni", orders, plant, now.output)  # of the sample itself: without the law's delay
    m = now.measured - driven
    m[0] -= rest
    S = np.linalg.inv(np.eye(2) - plant @ law)
    seen = np.einsum("nij,nj->ni", S, m)
    asked = np.abs(np.einsum("nij,nj->ni", law, seen))
    noisy = 3 * _rms_gain(G, K) @ now.noise
    volts = float((asked.sum(axis=0) + np.abs(now.reference) + noisy).max())
    with_law = now.disc[1] - driven[1] + seen[1] - m[1]
    return (float(np.abs(now.disc[1]).max()), float(np.abs(with_law).max())), volts


def _rms_gain(G: System, K: System) -> np.ndarray:
    """Rms of each reference per rms of white noise of each sensor (2, 2) [V/um]."""
    z = np.exp(1j * np.pi * (np.arange(100) + 0.5) / 100)
    law = response(K, z)
    KS = law @ np.linalg.inv(np.eye(2) - response(G, z) @ law)
    return np.asarray(np.sqrt(np.mean(np.abs(KS) ** 2, axis=0)))


def sampled(a: Assembly, w: np.ndarray, speed: float) -> tuple[System, float]:
    """The plant about the equilibrium in w, in um and V, sampled, with the law's sample of delay; its lowest natural
    frequency [rad/s]."""
    found = linearise(a, w, speed)
    rotor, values = slow_modes(System(found.A, found.B[:, :2], found.C * TO_UM, np.zeros((2, 2))))
    near = np.abs(values[values.imag > 0.44 * np.abs(values)]).min()
    return late(held(balanced(series(pins(a), rotor)), a.machine.sampling_time)), float(near)


def slow_modes(system: System) -> tuple[System, np.ndarray]:
    """Reduced system of modes below `FAST` with the others' static response; the kept eigenvalues [rad/s]."""
    even = balanced(system)
    values, shapes = np.linalg.eig(even.A)
    B, C = np.linalg.solve(shapes, even.B.astype(complex)), even.C @ shapes
    kept = (np.abs(values) < FAST) & (values.imag >= 0)
    quick = np.abs(values) >= FAST
    D = even.D + np.real(C[:, quick] @ (B[quick] / -values[quick, None]))
    parts = [_real_mode(values[k], B[k], C[:, k]) for k in np.flatnonzero(kept)]
    A, B, C = block_diag(*(p[0] for p in parts)), np.vstack([p[1] for p in parts]), np.hstack([p[2] for p in parts])
    return System(A, B, C, D), values[kept]


def _real_mode(value: complex, b: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A, B, C of a real eigenvalue, or of a complex one with its conjugate."""
    if value.imag == 0.0:
        return np.array([[value.real]]), b.real[None], c.real[:, None]
    A = np.array([[value.real, value.imag], [-value.imag, value.real]])
    return A, np.stack([2 * b.real, -2 * b.imag]), np.stack([c.real, c.imag], axis=1)


def pins(a: Assembly) -> System:
    """Actuator dynamics from references to pin travel of each axis, relative to an ideal pin."""
    actuators, common, P = a.machine.actuators, a.machine.injection, a.P
    if actuators is None or common is None or actuators.mode == "ideal":
        return gain(np.eye(2))
    axes = []
    for signs in (P.sign_x, P.sign_y):
        both = [k for k in range(len(a.machine.injectors)) if signs[k] != 0.0]
        mean = gain(np.zeros((1, 1)))
        for k in both:
            mean = added(mean, _pin(a, k), 1 / len(both))
        axes.append(mean)
    return side_by_side(*axes)


def _pin(a: Assembly, k: int) -> System:
    """Transfer from the reference to pin k over that of an ideal pin (see `rotorsim.plant.kernels.injectors`)."""
    actuators, common, P = a.machine.actuators, a.machine.injection, a.P
    assert actuators is not None and common is not None
    stroke = series(
        _lag(P.amplifier_lag[k]), _lag(P.stack_lag[k], actuators.sensitivity / actuators.sensor_sensitivity)
    )
    if actuators.mode == "reference":
        zero, pole, P_k = P.pd_zero[k], actuators.pd_pole, P.pd_gain[k]
        pd = System(np.array([[-pole]]), np.ones((1, 1)), np.array([[P_k * (zero - pole)]]), np.array([[P_k]]))
        stroke = feedback(series(pd, stroke), _sensor(a, k))
    return System(stroke.A, stroke.B, stroke.C * actuators.sensor_sensitivity / common.pin_per_volt, stroke.D)


def _sensor(a: Assembly, k: int) -> System:
    """Sensor of pin k with the sign of a feedback."""
    for call in (c for c in a.calls if c.effect.port == "pin_sensor"):
        p = getattr(a.P, call.record)
        if p.injector in (0.0, a.P.pinned[k]) and (p.lag, p.gain) != (0.0, 0.0):
            return _lag(p.lag, -1.0 - p.gain) if p.lag > 0.0 else gain([[-1.0 - p.gain]])
    return gain([[-1.0]])


def _lag(time: float, size: float = 1.0) -> System:
    """First-order lag; one of no time [s] is taken as 1 us."""
    rate = 1 / max(time, 1e-6)
    return System(np.array([[-rate]]), np.array([[rate]]), np.array([[size]]), np.zeros((1, 1)))


def law_of(law: Any, speed: float, pressure: float, Ts: float) -> System:
    """Controller at an operating point as a sampled system in um and V; a proportional one is sampled every Ts [s]."""
    if not isinstance(law, ProportionalLaw):
        return law_system(law, speed, pressure)
    keep = float(np.exp(-2 * np.pi * law.low_pass * Ts))
    own, asked = keep * np.eye(2), (1 - keep) * np.diag([law.gain_x, law.gain_y]) * 1e-6
    return System(own, asked, own, asked)
