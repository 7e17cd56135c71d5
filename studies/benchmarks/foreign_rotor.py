r"""Verdicts of `diagnose` on records of a rotor that shares no code with rotorsim: beam elements of numpy alone.

    python studies/benchmarks/foreign_rotor.py FOLDER [CASE ...]

Two discs on a shaft of Euler's beam elements with rotary inertia and gyroscopic moments, on two anisotropic supports;
two planes with probes at 45 and 135 deg, a keyphasor, 12.8 kHz, hum of the mains, 16 bits, CSV files. The supports are
10 to 20 % off those of the machine file in every case, and the unbalance is another one. A response to forces that turn
at the order n is

.. math:: q = (K - \omega^2 M + i \omega (C + \Omega G))^{-1} f, \qquad \omega = n \Omega

with the polar inertia in G so that the forward modes rise with the speed: :math:`J_d x'' + \Omega J_p y' = M_x` for the
slopes x, y and their derivatives in time.

The truth of all cases is written first, and its SHA-256 is the first line of the results. A case that ends with a
refusal in one sentence has the verdict `refused`. The verdict is judged by words that it has to contain (`Case.named`).
Source of the elements: Friswell et al. (2010).

Cites: friswell_2010.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

RATE, SECONDS = 12800, 2.6
"""Sampling rate [Hz] and length [s] of a record."""
LENGTH, DIAMETER, ELEMENTS = 0.6, 0.025, 12
E, RHO = 208e9, 7850.0
DISCS = ((4, 4.0, 0.0150, 0.0080), (9, 3.0, 0.0100, 0.0055))
"""Node, mass [kg], polar and diametral inertia [kg m^2]."""
BEARINGS = ((0, 2.2e6, 1.4e6, 300.0, 250.0), (12, 2.0e6, 1.2e6, 300.0, 250.0))
"""Node, stiffness along x and y [N/m] and damping [N s/m] of the machine file."""
PLANES, ANGLES = (4, 9), (45.0, 135.0)
"""Nodes of the planes of probes, and angles [deg] of the two probes of each."""
UNBALANCE = (20e-6, 12e-6)
"""Unbalance of the discs in the machine file [kg m], at 0 deg."""
SPEEDS = {"fit": (16, 21, 26, 31, 37, 43), "held_out": (19, 34), "untouched": (24, 40)}
"""Shaft speeds [Hz] by role; the first bending mode lies above."""
ACCURACY, NOISE, HUM, RANGE = 5e-8, 2e-7, 1e-7, 250e-6
"""Stated accuracy of a line, noise, hum, and range of 16 bits [m]."""


@dataclass(frozen=True)
class Case:
    """Fault of the machine or of the measurement; `named` are the words one of which the verdict has to contain."""

    name: str
    named: tuple[str, ...]
    bearings: tuple[tuple[float, ...], ...] = ((1.0,) * 4, (1.0,) * 4)
    """Factors on the numbers of the two bearings."""
    unbalance: tuple[complex, complex] = (17e-6 * np.exp(0.4j), 14e-6 * np.exp(-0.6j))
    bow: float = 0.0
    forward_2x: float = 0.0
    seal: float = 0.0
    hum: float = HUM
    gains: tuple[float, float, float, float] = (1.0,) * 4
    order: tuple[int, int, int, int] = (0, 1, 2, 3)
    turned: tuple[float, float] = (0.0, 0.0)
    sense: int = 1
    drift: float = 0.0
    clock: float = 0.0
    speed_error: float = 0.0


SOFTER, STIFFER, DAMPED = (0.35, 0.375, 1.0, 1.0), (2.2, 2.2, 1.0, 1.0), (1.0, 1.0, 0.25, 0.25)
SAME = (1.0,) * 4
CASES = (
    Case("nothing", ("no_disagreement",)),
    Case("right bearing softer", ("bearing right",), bearings=(SAME, SOFTER)),
    Case("left bearing softer", ("bearing left",), bearings=(SOFTER, SAME)),
    Case("right bearing stiffer", ("bearing right",), bearings=(SAME, STIFFER)),
    Case("left bearing stiffer", ("bearing left",), bearings=(STIFFER, SAME)),
    Case("left bearing less damped", ("bearing left",), bearings=(DAMPED, SAME)),
    Case("unbalance turned", ("no_disagreement", "unbalance"), unbalance=(30e-6 * np.exp(2.5j), 14e-6)),
    Case("bow", ("shaft_bow", "runout.amplitude_1x"), bow=12e-6),
    Case("force at 2X", ("coupling.force_2x", "asymmetric", "crack"), forward_2x=25.0),
    Case("seal", ("labyrinth_seal", "internal_damping"), seal=6e4),
    Case("strong hum", ("no_disagreement", "hum"), hum=1.5e-6),
    Case("probe 1R reads 10 % more", ("1R",), gains=(1.0, 1.10, 1.0, 1.0)),
    Case("probe 2L reversed", ("2L",), gains=(1.0, 1.0, -1.0, 1.0)),
    Case("probes of plane 1 exchanged", ("exchanged",), order=(1, 0, 2, 3)),
    Case("planes exchanged", ("planes",), order=(2, 3, 0, 1)),
    Case("plane 2 turned by 45 deg", ("turned",), turned=(0.0, np.pi / 4)),
    Case("other sense of rotation", ("rotation",), sense=-1),
    Case("probe 1L drifts", ("no_disagreement", "1L"), drift=20e-6),
    Case("clock of the probes late by 2 ms", ("clock", "shift", "delay", "lag"), clock=2e-3),
    Case("speed stated 3 % high", ("speed", "angle"), speed_error=0.03),
)


def beam() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, gyroscopic and stiffness matrix of shaft and discs; coordinates x, y, slopes of x and y by node."""
    h, area, inertia = LENGTH / ELEMENTS, np.pi * DIAMETER**2 / 4, np.pi * DIAMETER**4 / 64
    k = E * inertia / h**3 * np.array(
        [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
         [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]])  # fmt: skip
    m = RHO * area * h / 420 * np.array(
        [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
         [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]])  # fmt: skip
    rotary = RHO * inertia / (30 * h) * np.array(
        [[36, 3 * h, -36, 3 * h], [3 * h, 4 * h * h, -3 * h, -h * h],
         [-36, -3 * h, 36, -3 * h], [3 * h, -h * h, -3 * h, 4 * h * h]])  # fmt: skip
    n = 4 * (ELEMENTS + 1)
    M, G, K = np.zeros((3, n, n))
    for e in range(ELEMENTS):
        x = 4 * e + np.array([0, 2, 4, 6])
        for at in (x, x + 1):
            K[np.ix_(at, at)] += k
            M[np.ix_(at, at)] += m + rotary
        G[np.ix_(x, x + 1)] += 2 * rotary
        G[np.ix_(x + 1, x)] -= 2 * rotary
    for node, mass, polar, diametral in DISCS:
        first = 4 * node
        M[first, first] += mass
        M[first + 1, first + 1] += mass
        M[first + 2, first + 2] += diametral
        M[first + 3, first + 3] += diametral
        G[first + 2, first + 3] += polar
        G[first + 3, first + 2] -= polar
    return M, G, K


def rotor(case: Case, off: np.ndarray, speed: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, velocity and stiffness matrix (n, n) of a case at a speed [rad/s]; the supports are `off` (2, 2)."""
    M, G, free = beam()
    K, C = free.copy(), 2e-6 * free  # a little internal loss, which does not turn
    for (node, kx, ky, cx, cy), factors, more in zip(BEARINGS, case.bearings, off, strict=True):
        for axis, (k, c) in enumerate(((kx, cx), (ky, cy))):
            at = 4 * node + axis
            K[at, at] += k * factors[axis] * more[axis]
            C[at, at] += c * factors[2 + axis]
    at = 4 * DISCS[1][0]
    K[at, at + 1] += case.seal
    K[at + 1, at] -= case.seal
    return M, C + case.sense * speed * G, K


def response(case: Case, off: np.ndarray, speed: float) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Static sag and amplitudes by order (n,) [m] of exp(i n angle), at a speed [rad/s]."""
    (M, C, K), free = rotor(case, off, speed), beam()[2]

    def answer(force: np.ndarray, omega: float) -> np.ndarray:
        return np.linalg.solve(K - omega**2 * M + 1j * omega * C, force)

    force = np.zeros((3, len(K)), complex)
    for phasor, (node, *_) in zip(case.unbalance, DISCS, strict=True):
        force[1, 4 * node : 4 * node + 2] += phasor * speed**2 * np.array([1, -1j * case.sense])
    z = np.arange(ELEMENTS + 1) * LENGTH / ELEMENTS
    shape = np.zeros(len(K), complex)
    for axis, turn in enumerate((1, -1j * case.sense)):
        shape[axis::4] = case.bow * np.exp(0.9j) * turn * np.sin(np.pi * z / LENGTH)
        shape[axis + 2 :: 4] = case.bow * np.exp(0.9j) * turn * np.pi / LENGTH * np.cos(np.pi * z / LENGTH)
    force[1] += free @ shape
    force[2, :2] = case.forward_2x * np.exp(0.5j) * np.array([1, -1j * case.sense])
    weight = np.zeros(len(K))
    weight[1::4] = -9.81 * M[1::4, 1::4].sum(axis=1)
    sag = np.linalg.solve(K, weight)
    return sag, {n: answer(force[n], n * speed) for n in (1, 2) if force[n].any()}


def table(case: Case, hertz: float, rng: np.random.Generator, off: np.ndarray) -> np.ndarray:
    """Columns of a record: time, keyphasor [V], probes 1L, 1R, 2L, 2R [V] of 8 mV/um with 16 bits."""
    speed = 2 * np.pi * hertz
    sag, orders = response(case, off, speed)
    t = np.arange(round(RATE * SECONDS)) / RATE
    angle, late = speed * t, speed * (t - case.clock)
    mains = case.hum * np.cos(2 * np.pi * 50.0 * t + rng.uniform(0, 6))
    motion = []
    for plane, (node, turn) in enumerate(zip(PLANES, case.turned, strict=True)):
        xy = np.array([sag[4 * node + a] + sum((q[4 * node + a] * np.exp(1j * n * late)).real
                                               for n, q in orders.items()) for a in (0, 1)])  # fmt: skip
        for degrees in ANGLES:
            a = np.deg2rad(degrees) + turn
            motion.append(xy[0] * np.cos(a) + xy[1] * np.sin(a) + mains + rng.normal(0, NOISE, len(t)))
        motion[0] = motion[0] + (case.drift * t / SECONDS if plane == 0 else 0.0)
    probes = np.array([motion[i] for i in case.order]) * np.array(case.gains)[:, None]
    bits = np.round(probes / RANGE * 32767) / 32767 * RANGE
    key = np.where(np.mod(angle, 2 * np.pi) < 0.15, -10.0, -2.0)
    return np.column_stack([t, key, *(8e-3 * 1e6 * bits)])


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


def write_records(case: Case, folder: Path, seed: int) -> dict[str, list[Path]]:
    """CSV files of a case by role, with the mapping next to them."""
    folder.mkdir(parents=True, exist_ok=True)
    mapping = MAPPING
    for i, name in enumerate(("1L", "1R", "2L", "2R")):
        z = 1e3 * PLANES[i // 2] * LENGTH / ELEMENTS
        mapping += f'\n[probes.{name}]\ncolumn = "{name}"\nunit = "V"\nsensitivity = "8 mV/um"\n'
        mapping += f'angle = "{ANGLES[i % 2]:g} deg"\nposition = "{z:g} mm"\n'
    if case.speed_error:
        mapping = mapping.replace("[disc]", '[channels.speed_measured]\ncolumn = "speed"\nunit = "rpm"\n\n[disc]')
    (folder / "rig.toml").write_text(mapping)
    off = np.random.default_rng(seed).uniform(0.8, 1.2, (2, 2))
    off = np.where(np.abs(off - 1) < 0.1, 1 + 0.1 * np.sign(off - 1), off)
    found: dict[str, list[Path]] = {}
    for role, speeds in SPEEDS.items():
        for hertz in speeds:
            rng = np.random.default_rng([seed, hertz])
            columns, head = table(case, hertz, rng, off), "time,key,1L,1R,2L,2R"
            if case.speed_error:
                columns = np.column_stack([columns, np.full(len(columns), 60 * hertz * (1 + case.speed_error))])
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


def judged(case: Case, verdict: str, words: str) -> str:
    """'right' for words that the case asks for, 'silent' for none given, 'wrong' for another name or no fault seen."""
    if any(word in words for word in case.named):
        return "right"
    return "silent" if verdict in ("unknown", "partial") else "wrong"


def diagnosed(case: Case, folder: Path, seed: int, models: Any) -> dict[str, object]:
    """Verdict on one case, through files and the reader."""
    from identification import read, resample
    from rotorsim.base.errors import RotorsimError
    from rotorsim.discrepancy import diagnose
    from rotorsim.machine import Machine

    files, cpu = write_records(case, folder, seed), time.process_time()
    try:
        own = {
            role: [resample(read(p, folder / "rig.toml"), 5000.0).assign_attrs(record=p.stem, role=role) for p in paths]
            for role, paths in files.items()
        }
        found = diagnose(Machine.from_text(machine_text()), [r for part in own.values() for r in part], models=models)
        verdict, sentence = found.status, found.sentence
        words = " ".join([verdict, sentence, *(f.form for f in found.effects), *(" ".join(t) for t in found.ties),
                          *(k for f in found.effects for k in f.tie_class)])  # fmt: skip
        more = {"odds": dict(list(found.odds.items())[:4]), "notes": list(found.notes), "large": list(found.large)}
    except RotorsimError as error:
        verdict, sentence, words, more = "refused", str(error), str(error), {}
    return {"case": case.name, "verdict": verdict, "sentence": sentence, "judged": judged(case, verdict, words),
            "cpu_s": time.process_time() - cpu, **more}  # fmt: skip


def main() -> None:
    """Write the truth, then diagnose case by case."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("cases", nargs="*")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    truth = json.dumps([asdict(c) for c in CASES], default=str, sort_keys=True)
    (asked.folder / "truth.json").write_text(truth)
    print(f"truth {hashlib.sha256(truth.encode()).hexdigest()}", flush=True)
    from rotorsim.discrepancy.calibration import CompiledModels
    from rotorsim.machine import Machine

    models = CompiledModels.of(Machine.from_text(machine_text()))
    wrong = 0
    for number, case in enumerate(CASES):
        if asked.cases and case.name not in asked.cases:
            continue
        found = diagnosed(case, asked.folder / f"{number:02d}", asked.seed + number, models)
        (asked.folder / f"{number:02d}.json").write_text(json.dumps(found, indent=1, default=float))
        print(f"{found['judged']:7} {found['cpu_s']:5.0f} s  {case.name}: {found['sentence']}", flush=True)
        wrong += found["judged"] == "wrong"
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
