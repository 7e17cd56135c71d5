r"""Rotor of beam elements that shares no code with rotorsim, its records, and the machine file that is believed.

Two discs on a shaft of Euler's beam elements with rotary inertia and gyroscopic moments, on two anisotropic supports;
two planes with probes at 45 and 135 deg, a keyphasor, 12.8 kHz, hum of the mains, 16 bits, CSV files. Supports
and unbalance are not those of the machine file (`foreign_set` draws them). A response to forces that turn at the order
n is

.. math:: q = (K - \omega^2 M + i \omega (C + \Omega G))^{-1} f, \qquad \omega = n \Omega

with the polar inertia in G so that the forward modes rise with the speed: :math:`J_d x'' + \Omega J_p y' = M_x` for the
slopes x, y and their derivatives in time. A stop on one side of the second disc acts at the first `HARMONICS` orders,
by harmonic balance. Source of the elements: Friswell et al. (2010).

Cites: friswell_2010.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from scipy.linalg import eigvals
from scipy.optimize import least_squares, root

RATE, SECONDS = 12800, 1.5
"""Sampling rate [Hz] and length [s] of a record."""
LENGTH, DIAMETER, ELEMENTS = 0.6, 0.025, 12
E, RHO = 208e9, 7850.0
DISCS = ((4, 4.0, 0.0150, 0.0080), (9, 3.0, 0.0100, 0.0055))
"""Node, mass [kg], polar and diametral inertia [kg m^2]."""
BEARINGS = ((0, 2.2e6, 1.4e6, 300.0, 250.0), (12, 2.0e6, 1.2e6, 300.0, 250.0))
"""Node, stiffness along x and y [N/m] and damping [N s/m] of the machine file."""
PLANES, ANGLES = (4, 9), (45.0, 135.0)
"""Nodes of the planes of probes, and angles [deg] of the two probes of each."""
PROBES = ("1L", "1R", "2L", "2R")
UNBALANCE = (20e-6, 12e-6)
"""Unbalance of the discs in the machine file [kg m], at 0 deg."""
SPEEDS = {"fit": (16, 22, 28, 34, 43), "held_out": (19, 37), "untouched": (24, 40)}
"""Shaft speeds [Hz] by role; the first bending mode lies above."""
HERTZ = tuple(hertz for own in SPEEDS.values() for hertz in own)
WITHIN = 0.2
"""Share by which supports of a sound machine are off those of the file at most."""
ACCURACY, NOISE, HUM, RANGE = 5e-8, 2e-7, 1e-7, 250e-6
"""Stated accuracy of a line, noise, hum, and range of 16 bits [m]."""
HARMONICS = 5
"""Orders of the response to a stop."""


@dataclass(frozen=True)
class TwoDiscRig:
    """Machine and measurement as they are, in SI units."""

    bearings: tuple[tuple[float, ...], ...]
    """Stiffness along x and y and damping along x and y of each bearing."""
    unbalance: tuple[tuple[float, float], ...]
    """Size and phase of each disc's unbalance."""
    bow: float = 0.0
    """Bow half-way between the bearings, at 0.9 rad."""
    forward_2x: float = 0.0
    """Force at the left end that turns forward at 2X."""
    seal: float = 0.0
    """Cross-coupled stiffness at the second disc."""
    stop: tuple[float, float] = (0.0, 0.0)
    """Stiffness of a stop above the second disc, and its gap from the static position."""
    pedestal: tuple[float, float] = (0.0, 0.0)
    """Stiffness and mass of a loose pedestal under the right bearing; rigid for 0."""
    housing: tuple[float, ...] = ()
    """Mass, stiffness along x and y, damping along both of the right bearing's housing, node 13; none: it is rigid."""
    heating: float = 0.0
    """Share by which the unbalance of the first disc grows in a record."""
    hum: float = HUM
    gains: tuple[float, ...] = (1.0,) * 4
    order: tuple[int, ...] = (0, 1, 2, 3)
    """Probe of which each column shows the reading."""
    turned: tuple[float, float] = (0.0, 0.0)
    """Angle by which the probes of each plane are turned."""
    sense: int = 1
    drift: float = 0.0
    """Drift of the first probe in a record."""
    clock: tuple[float, float] = (0.0, 0.0)
    """Delay of the probes' clock, and its drift."""
    speed_error: float = 0.0
    """Relative error of the stated speed."""


@cache
def beam(
    length: float = LENGTH, diameter: float = DIAMETER, elements: int = ELEMENTS,
    discs: tuple[tuple[int, float, float, float], ...] = DISCS, shear: float = 0.0,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Mass, gyroscopic and stiffness matrix of shaft and discs; coordinates x, y, slopes of x and y by node.

    `shear` is 12 E I over the shear stiffness and the square of an element's length.
    """
    h, area, inertia = length / elements, np.pi * diameter**2 / 4, np.pi * diameter**4 / 64
    k = E * inertia / h**3 / (1 + shear) * np.array(
        [[12, 6 * h, -12, 6 * h], [6 * h, (4 + shear) * h * h, -6 * h, (2 - shear) * h * h],
         [-12, -6 * h, 12, -6 * h], [6 * h, (2 - shear) * h * h, -6 * h, (4 + shear) * h * h]])  # fmt: skip
    m = RHO * area * h / 420 * np.array(
        [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
         [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]])  # fmt: skip
    rotary = RHO * inertia / (30 * h) * np.array(
        [[36, 3 * h, -36, 3 * h], [3 * h, 4 * h * h, -3 * h, -h * h],
         [-36, -3 * h, 36, -3 * h], [3 * h, -h * h, -3 * h, 4 * h * h]])  # fmt: skip
    n = 4 * (elements + 1)
    M, G, K = np.zeros((3, n, n))
    for e in range(elements):
        x = 4 * e + np.array([0, 2, 4, 6])
        for at in (x, x + 1):
            K[np.ix_(at, at)] += k
            M[np.ix_(at, at)] += m + rotary
        G[np.ix_(x, x + 1)] += 2 * rotary
        G[np.ix_(x + 1, x)] -= 2 * rotary
    for node, mass, polar, diametral in discs:
        first = 4 * node
        M[first, first] += mass
        M[first + 1, first + 1] += mass
        M[first + 2, first + 2] += diametral
        M[first + 3, first + 3] += diametral
        G[first + 2, first + 3] += polar
        G[first + 3, first + 2] -= polar
    return M, G, K


def rotor(rig: TwoDiscRig, speed: float, omega: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, velocity and stiffness matrix (n, n) at a speed [rad/s], a pedestal's at omega [rad/s]."""
    M, G, free = (np.pad(one, (0, 4 * bool(rig.housing))) for one in beam())
    K, C = free.astype(complex), 2e-6 * free  # a little internal loss, which does not turn
    if rig.housing:
        for axis in (0, 1):
            at = len(M) - 4 + axis
            M[at, at], K[at, at] = rig.housing[0], rig.housing[1 + axis] + 1j * omega * rig.housing[3 + axis]
            K[at + 2, at + 2] = 1.0  # no slopes
    for number, (node, own) in enumerate(zip((node for node, *_ in BEARINGS), rig.bearings, strict=True)):
        for axis in (0, 1):
            k = own[axis] + 1j * omega * own[2 + axis]
            if number == 1 and rig.pedestal[0]:
                under = rig.pedestal[0] - omega**2 * rig.pedestal[1]
                k = k * under / (k + under)
            K[4 * node + axis, 4 * node + axis] += k
            if number == 1 and rig.housing:
                both = [4 * node + axis, len(M) - 4 + axis]
                K[np.ix_(both, both)] += [[0, -k], [-k, k]]
    at = 4 * DISCS[1][0]
    K[at, at + 1] += rig.seal
    K[at + 1, at] -= rig.seal
    return M, C + rig.sense * speed * G, K


def least_damping(rig: TwoDiscRig, speed: float) -> float:
    """Damping ratio of the least damped mode on a rigid pedestal at a speed [rad/s]; negative for an unstable rotor."""
    M, C, K = rotor(replace(rig, pedestal=(0.0, 0.0)), speed, 0.0)
    for (node, *_), own in zip(BEARINGS, rig.bearings, strict=True):
        for axis in (0, 1):
            C[4 * node + axis, 4 * node + axis] += own[2 + axis]
    below = -np.linalg.solve(M, np.hstack([K.real, C]))
    poles = eigvals(np.vstack([np.hstack([np.zeros_like(M), np.eye(len(M))]), below]))
    return float(np.min(-poles.real / np.abs(poles)))


def response(rig: TwoDiscRig, speed: float) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Static sag (n,) [m] and amplitudes by order (n,) [m] of exp(i n angle), at a speed [rad/s]."""
    free, mass = beam()[2], beam()[0]

    def answer(force: np.ndarray, omega: float) -> np.ndarray:
        M, C, K = rotor(rig, speed, omega)
        return np.linalg.solve(K - omega**2 * M + 1j * omega * C, force)

    force = np.zeros((HARMONICS + 1, len(free)), complex)
    for (me, phase), (node, *_) in zip(rig.unbalance, DISCS, strict=True):
        force[1, 4 * node : 4 * node + 2] += me * np.exp(1j * phase) * speed**2 * np.array([1, -1j * rig.sense])
    z = np.arange(ELEMENTS + 1) * LENGTH / ELEMENTS
    shape = np.zeros(len(free), complex)
    for axis, turn in enumerate((1, -1j * rig.sense)):
        shape[axis::4] = rig.bow * np.exp(0.9j) * turn * np.sin(np.pi * z / LENGTH)
        shape[axis + 2 :: 4] = rig.bow * np.exp(0.9j) * turn * np.pi / LENGTH * np.cos(np.pi * z / LENGTH)
    force[1] += free @ shape
    force[2, :2] = rig.forward_2x * np.exp(0.5j) * np.array([1, -1j * rig.sense])
    weight = np.zeros(len(free))
    weight[1::4] = -9.81 * mass[1::4, 1::4].sum(axis=1)
    sag = answer(weight, 0.0).real
    found = {n: answer(f, n * speed) if np.any(f) else np.zeros(len(f), complex) for n, f in enumerate(force)}
    if rig.stop[0]:
        found |= stopped(rig, found, answer, speed)
    orders = {n: q for n, q in found.items() if n and np.any(q)}
    return sag + found[0].real, orders


def stopped(
    rig: TwoDiscRig, free: dict[int, np.ndarray], answer: Callable[[np.ndarray, float], np.ndarray], speed: float
) -> dict[int, np.ndarray]:
    """Amplitudes by order (n,) [m] with the stop above the second disc, by harmonic balance from the `free` ones."""
    (stiffness, gap), at, count = rig.stop, 4 * DISCS[1][0] + 1, HARMONICS + 1
    unit = np.zeros(len(free[0]))
    unit[at] = 1.0
    moved = [answer(unit, n * speed) for n in range(count)]
    waves = np.exp(1j * np.outer(np.linspace(0, 2 * np.pi, 128, endpoint=False), np.arange(count)))

    def pushed(x: np.ndarray) -> np.ndarray:
        y = (waves @ (x[:count] + 1j * x[count:])).real
        force = -stiffness * np.maximum(y - gap, 0.0)
        lines = 2 * np.conj(waves).T @ force / len(waves)
        lines[0] /= 2
        return np.asarray(lines)

    def left(x: np.ndarray) -> np.ndarray:
        lines = pushed(x)
        d = np.array([x[n] + 1j * x[count + n] - free[n][at] - moved[n][at] * lines[n] for n in range(count)]) * 1e6
        return np.concatenate([d.real, d.imag])

    start = np.array([free[n][at] for n in range(count)])
    found = root(left, np.concatenate([start.real, start.imag]))
    if not found.success:
        raise ValueError(f"the stop has no periodic motion at {speed:.4g} rad/s: {found.message}")
    return {n: free[n] + moved[n] * line for n, line in enumerate(pushed(found.x))}


def table(rig: TwoDiscRig, hertz: float, rng: np.random.Generator) -> np.ndarray:
    """Columns of a record: time, keyphasor [V], probes [V] of 8 mV/um with 16 bits."""
    speed = 2 * np.pi * hertz
    sag, orders = response(rig, speed)
    hotter = response(replace(rig, unbalance=((2 * rig.unbalance[0][0], rig.unbalance[0][1]), rig.unbalance[1])), speed)
    t = np.arange(round(RATE * SECONDS)) / RATE
    angle, late = speed * t, speed * (t * (1 + rig.clock[1]) - rig.clock[0])
    mains = rig.hum * np.cos(2 * np.pi * 50.0 * t + rng.uniform(0, 6))
    motion = []
    for plane, (node, turn) in enumerate(zip(PLANES, rig.turned, strict=True)):
        xy = np.array([sag[4 * node + a] + sum((q[4 * node + a] * np.exp(1j * n * late)).real
                                               for n, q in orders.items()) for a in (0, 1)])  # fmt: skip
        if rig.heating:
            more = hotter[1][1] - orders[1]
            xy += rig.heating * t / SECONDS * np.array([(more[4 * node + a] * np.exp(1j * late)).real for a in (0, 1)])
        for degrees in ANGLES:
            a = np.deg2rad(degrees) + turn
            motion.append(xy[0] * np.cos(a) + xy[1] * np.sin(a) + mains + rng.normal(0, NOISE, len(t)))
        motion[0] = motion[0] + (rig.drift * t / SECONDS if plane == 0 else 0.0)
    probes = np.array([motion[i] for i in rig.order]) * np.array(rig.gains)[:, None]
    bits = np.round(probes / RANGE * 32767) / 32767 * RANGE
    key = np.where(np.mod(angle, 2 * np.pi) < 0.15, -10.0, -2.0)
    return np.column_stack([t, key, *(8e-3 * 1e6 * bits)])


def lines(rig: TwoDiscRig) -> np.ndarray:
    """Amplitudes (speeds, probes, orders) [m] of the orders in the readings of all records, as columns show them."""
    found = np.zeros((len(HERTZ), len(PROBES), HARMONICS), complex)
    for k, hertz in enumerate(HERTZ):
        speed = 2 * np.pi * hertz
        for n, q in response(rig, speed)[1].items():
            late = np.exp(-1j * n * speed * rig.clock[0])
            for column, probe in enumerate(rig.order):
                a, at = np.deg2rad(ANGLES[probe % 2]) + rig.turned[probe // 2], 4 * PLANES[probe // 2]
                found[k, column, n - 1] = rig.gains[column] * late * (q[at] * np.cos(a) + q[at + 1] * np.sin(a))
    return found


def left_by_sound(rig: TwoDiscRig) -> np.ndarray:
    """Rms (probes,) [m] of the vibration that no sound machine makes, over all records.

    A sound one has supports within `WITHIN` of the file's, any unbalance and no fault; of these the nearest one counts.
    """
    wanted, filed = lines(rig), np.array(BEARINGS)[:, 1:]

    def left(v: np.ndarray) -> np.ndarray:
        sizes = v[8::2] + 1j * v[9::2]
        unbalance = tuple((float(abs(z)) * 1e-6, float(np.angle(z))) for z in sizes)
        bearings = tuple(tuple(map(float, own)) for own in filed * v[:8].reshape(2, 4))
        apart = (lines(TwoDiscRig(bearings, unbalance)) - wanted).ravel() / ACCURACY
        return np.concatenate([apart.real, apart.imag])

    true = np.clip(np.array(rig.bearings) / filed, 1 - 0.99 * WITHIN, 1 + 0.99 * WITHIN).ravel()
    z = np.array([1e6 * me * np.exp(1j * phase) for me, phase in rig.unbalance])
    ends = [np.concatenate([np.full(8, 1 + side * WITHIN), np.full(4, side * 300.0)]) for side in (-1, 1)]
    near = [true, *([] if np.allclose(true, (np.array(rig.bearings) / filed).ravel()) else [np.ones(8)])]
    starts = [np.concatenate([own, np.column_stack([z.real, z.imag]).ravel()]) for own in near]
    best = min((least_squares(left, v, bounds=ends, ftol=1e-3) for v in starts), key=lambda one: one.cost)
    apart = (best.fun * ACCURACY).reshape(2, *wanted.shape)
    return np.asarray(np.sqrt(np.mean(np.sum(apart**2, axis=(0, 3)) / 2, axis=0)))


MAPPING = """
[time]
column = "time"
unit = "s"

[keyphasor]
column = "key"
unit = "V"
edge = "falling"

[disc]
position = "200 mm"

[conditions]
accuracy = "0.05 um"
"""


def write_records(rig: TwoDiscRig, seed: int, folder: Path) -> dict[str, list[Path]]:
    """CSV files of a rig by role, with the mapping next to them; the seed is that of the noise."""
    folder.mkdir(parents=True, exist_ok=True)
    mapping, wrong = MAPPING, rig.speed_error
    for i, name in enumerate(PROBES):
        z = 1e3 * PLANES[i // 2] * LENGTH / ELEMENTS
        mapping += f'\n[probes.{name}]\ncolumn = "{name}"\nunit = "V"\nsensitivity = "8 mV/um"\n'
        mapping += f'angle = "{ANGLES[i % 2]:g} deg"\nposition = "{z:g} mm"\n'
    if wrong:
        mapping = mapping.replace("[disc]", '[channels.speed_measured]\ncolumn = "speed"\nunit = "rpm"\n\n[disc]')
    (folder / "rig.toml").write_text(mapping)
    found: dict[str, list[Path]] = {}
    for role, speeds in SPEEDS.items():
        for hertz in speeds:
            columns = table(rig, hertz, np.random.default_rng([seed, hertz]))
            head = ",".join(["time", "key", *PROBES])
            if wrong:
                columns = np.column_stack([columns, np.full(len(columns), 60 * hertz * (1 + wrong))])
                head += ",speed"
            path = folder / f"{role}_{hertz}.csv"
            np.savetxt(path, columns, "%.7g", delimiter=",", header=head, comments="")
            found.setdefault(role, []).append(path)
    return found


def machine_text() -> str:
    """Machine file as it is believed to be."""
    text = f"""
name = "two_discs"
[shaft]
start = "0 mm"
damping_ratio = 0.002
[shaft.material]
density = "{RHO:g} kg/m^3"
youngs_modulus = "{E / 1e9:g} GPa"
poisson_ratio = 0.3
[[shaft.sections]]
length = "{1e3 * LENGTH:g} mm"
outer_diameter = "{1e3 * DIAMETER:g} mm"
[probe]
position = "{1e3 * PLANES[0] * LENGTH / ELEMENTS:g} mm"
[effects.gravity]
acceleration = "9.81 m/s^2"
"""
    for node, mass, polar, diametral in DISCS:
        text += f"""
[[discs]]
position = "{1e3 * node * LENGTH / ELEMENTS:g} mm"
mass = "{mass} kg"
polar_inertia = "{polar} kg*m^2"
diametral_inertia = "{diametral} kg*m^2"
"""
    for name, (node, kx, ky, cx, cy) in zip(("left", "right"), BEARINGS, strict=True):
        text += f"""
[[bearings]]
kind = "linear"
name = "{name}"
position = "{1e3 * node * LENGTH / ELEMENTS:g} mm"
kxx = "{kx / 1e6} MN/m"
kyy = "{ky / 1e6} MN/m"
cxx = "{cx} N*s/m"
cyy = "{cy} N*s/m"
"""
    for me, (node, *_) in zip(UNBALANCE, DISCS, strict=True):
        text += f"""
[[effects.unbalance]]
me = "{1e6 * me:g} g*mm"
position = "{1e3 * node * LENGTH / ELEMENTS:g} mm"
"""
    return text
