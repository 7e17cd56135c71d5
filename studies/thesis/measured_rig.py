r"""The thesis' printed rig as if it were on a bench: records of its models, diagnosed with the machine of its campaign.

    python studies/thesis/measured_rig.py [--out measured_rig]

Paper A prints the rotor over the speed at 8 bar (Table A.3), the thesis the pins behind their references (Table C.2).
Both are linear systems of a few states, fitted to a rig that stood in a laboratory; nothing in them comes from this
project's film, rotor or pins. Held references r of a period make

.. math:: y(\omega) = C\,(e^{i\omega T_s} I - F)^{-1} G\,r(\omega),

to which the noise is added that the thesis prints. The rig turns from y to x in this project's axes. The printed models
have no orders of the shaft's speed, so the machine file is taken without unbalance, coupling and runout.

Cites: thesis.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

sys.path.append(str(Path(__file__).resolve().parents[2]))

import numpy as np
from scipy.linalg import expm

import identification as idn
import rotorsim as rs
from identification.local.greybox import cascade, model_1
from rotorsim.base.display import line
from rotorsim.base.units import KRPM, MPA, RIG_SAMPLE, TO_UM
from rotorsim.discrepancy.gap import STAGES, reduction
from studies.thesis.printed import actuator_lags, model_a, printed

if TYPE_CHECKING:
    from rotorsim.discrepancy import Diagnosis

CAMPAIGN = "dtu_paper_a"
"""Machine that is calibrated to open-loop figures of the same campaign."""
POINTS = {
    "fit": ((3.0, 1.0), (4.2, 0.5), (5.4, 1.0), (6.0, 0.5)),
    "held_out": ((4.8, 1.0), (3.3, 0.5)),
    "untouched": ((3.6, 1.0), (5.7, 0.5)),
}
"""Shaft speeds [krpm], each with whole turns in a period, and largest references [V] by role."""
PERIOD, PERIODS, HIGHEST = 2000, 3, 100
"""Samples of a period, periods of a record, highest line of a reference in lines of a period."""
NOISE = 3.3e-7
"""Noise of a sample [m], as the thesis prints it."""


def matrices(krpm: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A, B and C of the printed models at a speed, from references [V] to the disc [m]."""
    model = model_a(krpm * KRPM)
    rotor = [model.A[2:, :2].ravel(), model.A[2:, 2:].ravel(), model.B[2:].ravel()]
    return cascade(np.concatenate([*rotor, actuator_lags(1.0)]), rotor=model_1)[:3]


def disc(krpm: float, reference: np.ndarray) -> np.ndarray:
    """Displacement (n, 2) [m] of the disc over a period of a reference (n, 2) [V] that repeats."""
    A, B, C = matrices(krpm)
    n = len(A)
    step = expm(RIG_SAMPLE * np.block([[A, B], [np.zeros((2, n + 2))]]))
    F, G = step[:n, :n], step[:n, n:]
    lines = np.fft.rfft(reference, axis=0)
    z = np.exp(2j * np.pi * np.arange(len(lines)) / len(reference))
    y = [C @ np.linalg.solve(one * np.eye(n) - F, G @ r) for one, r in zip(z, lines, strict=True)]
    return np.fft.irfft(np.array(y), len(reference), axis=0)


def own_lines(axis: int) -> np.ndarray:
    """Lines of a period that the reference of an axis has: odd ones, as no order of a shaft with whole turns is."""
    return np.arange(1 + 2 * axis, HIGHEST + 1, 4)


def multisine(rng: np.random.Generator) -> np.ndarray:
    """References (PERIOD, 2) of x and y, each with lines of its own, up to 1."""
    lines = np.zeros((PERIOD // 2 + 1, 2), complex)
    for axis in range(2):
        lines[own_lines(axis), axis] = np.exp(2j * np.pi * rng.random(len(own_lines(axis))))
    waves = np.fft.irfft(lines, PERIOD, axis=0)
    return waves / np.abs(waves).max()


def records(seed: int = 0) -> list[Any]:
    """Records at all points, with their roles."""
    rng, pressure, found = np.random.default_rng(seed), printed()["A3"]["pressure"] * MPA, []
    for role, points in POINTS.items():
        for krpm, amplitude in points:
            reference = amplitude * multisine(rng)
            y = np.tile(disc(krpm, reference), (PERIODS, 1))
            t = np.arange(len(y)) * RIG_SAMPLE
            found.append(idn.from_arrays(
                t, np.tile(reference, (PERIODS, 1)), y + rng.normal(0, NOISE, y.shape), angle=-krpm * KRPM * t,
                speed=-krpm * KRPM, pressure=pressure,
                attrs={"record": f"{role}_{krpm:g}_krpm_{amplitude:g}_V", "role": role},
            ))  # fmt: skip
    return found


def without_orders(machine: rs.Machine) -> rs.Machine:
    """The machine without what moves the disc, or its reading, with the orders of the shaft's speed."""
    zero = {"unbalance.me": "0 g*mm", "coupling.force_2x": "0 N", "coupling.force_3x": "0 N"}
    zero |= {f"runout.{name}": "0 um" for name in ("amplitude_1x", "amplitude_2x", "amplitude_3x", "roughness")}
    for name, value in zero.items():
        machine = machine.replace(f"effects.{name}", value)
    return machine


def story(found: Diagnosis, path: Path) -> None:
    """Picture: measured lines and what is left of them at an untouched speed, and the gap by role and stage."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(12, 3.6), layout="constrained", width_ratios=(2, 2, 1.4))
    shown = found.spectra["untouched"][-1]
    for k, (plot, axis) in enumerate(zip(axes, "xy", strict=False)):
        own = np.isin(np.round(shown["frequency"] * PERIOD * RIG_SAMPLE).astype(int), own_lines(k))
        f = shown["frequency"][own]
        plot.semilogy(f, TO_UM * shown["measured"][k][own], "k.-", label="measured")
        for name, stage in zip(STAGES, shown["stages"], strict=False):
            plot.semilogy(f, TO_UM * stage[k][own], ".-", lw=1, label=f"left, {name}")
        plot.semilogy(f, TO_UM * shown["floor"][k][own], color="0.6", ls="--", lw=1, label="floor")
        plot.set(xlabel="frequency [Hz]", ylabel=f"line of {axis} [um]", title=f"{shown['point']}, untouched")
    axes[0].legend(fontsize="small")
    for role, stages in gaps(found).items():
        axes[2].plot(range(len(stages)), list(stages.values()), "o-", label=role.replace("_", " "))
    axes[2].set_xticks(range(len(STAGES)), ["nominal", "re-cali-\nbrated", "with\neffect", "floor"])
    axes[2].set(ylabel="gap, rms [um]", ylim=(0, None), title=f"verdict: {found.status.replace('_', ' ')}")
    axes[2].legend(fontsize="small")
    figure.savefig(path, dpi=100)


def gaps(found: Diagnosis) -> dict[str, dict[str, float]]:
    """Gap [um rms] by role and stage."""
    gap, roles = found.gap["gap"].values * TO_UM, found.gap["role"].values
    return {role: {name: float(np.sqrt(np.mean(gap[roles == role, :, k] ** 2))) for k, name in enumerate(STAGES)}
            for role in POINTS}  # fmt: skip


def main() -> None:
    """Diagnose, write report, numbers and picture, and print what was found."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("measured_rig"))
    out, cpu = parser.parse_args().out, time.process_time()
    out.mkdir(parents=True, exist_ok=True)
    machine = without_orders(rs.load_machine(CAMPAIGN))
    found = rs.diagnose(machine, records(), progress=lambda stage, most=0: line(stage, stage == "show"))
    seconds = time.process_time() - cpu
    found.report(out / "report.html")
    numbers = {"status": found.status, "sentence": found.sentence, "gap_um": gaps(found), "gone": reduction(found.gap),
               "notes": found.notes, "odds": found.odds, "cpu_s": seconds,
               "calibration": {one.place: (one.value, one.sd, one.before) for one in found.recalibration},
               "effects": {one.form: (one.parameters, one.sd) for one in found.effects}}  # fmt: skip
    (out / "measured_rig.json").write_text(json.dumps(numbers, indent=2, default=float))
    story(found, out / "measured_rig.png")
    print(found.sentence)
    for role, stages in gaps(found).items():
        print(role.replace("_", " "), ", ".join(f"{name} {value:.3g} um" for name, value in stages.items()))
    print(f"{seconds:.0f} s of processor time")


if __name__ == "__main__":
    main()
