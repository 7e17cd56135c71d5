r"""The thesis' printed rig as if it were on a bench: records of its models, diagnosed with the shipped machine file.

    python studies/thesis/measured_rig.py [--out measured_rig]

Paper A prints the rotor over the speed at 8 bar (Table A.3), the thesis the pins behind their references (Table C.2).
Both are linear systems of a few states, fitted to a rig that stood in a laboratory; nothing in them comes from this
project's film, rotor or pins. Held references r of a period make

.. math:: y(\omega) = C\,(e^{i\omega T_s} I - F)^{-1} G\,r(\omega),

to which the noise is added that the thesis prints. The rig turns from y to x in this project's axes.

Cites: thesis.
"""

from __future__ import annotations

import argparse
import json
import sys
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

SPEEDS = {"fit": (3.0, 4.2, 6.0), "held_out": (5.04,), "untouched": (3.6,)}
"""Shaft speeds [krpm] by role, with whole turns in a period."""
AMPLITUDES, PERIOD, PERIODS, CLOCK = (1.0, 0.5), 2500, 4, 5
"""References [V], samples of a period, periods of a record, samples of a step of the binary reference."""
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


def records(seed: int = 0) -> list[Any]:
    """Records at all speeds and amplitudes, each made twice, with their roles."""
    rng, found = np.random.default_rng(seed), []
    pattern = rng.choice([-1.0, 1.0], (PERIOD // CLOCK, 2)).repeat(CLOCK, axis=0)
    pressure = printed()["A3"]["pressure"] * MPA
    for role, speeds in SPEEDS.items():
        for krpm in speeds:
            for amplitude in AMPLITUDES:
                for repeat in (1, 2):
                    reference = np.tile(amplitude * pattern, (PERIODS, 1))
                    y = np.tile(disc(krpm, amplitude * pattern), (PERIODS, 1))
                    time = np.arange(len(y)) * RIG_SAMPLE
                    found.append(idn.from_arrays(
                        time, reference, y + rng.normal(0, NOISE, y.shape), angle=-krpm * KRPM * time,
                        speed=-krpm * KRPM, pressure=pressure,
                        attrs={"record": f"{role}_{krpm:g}_krpm_{amplitude:g}_V_{repeat}", "role": role},
                    ))  # fmt: skip
    return found


def story(found: Diagnosis, path: Path) -> None:
    """Picture: measured and simulated response at the untouched speed, and the gap by role and stage."""
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4))
    shown = found.spectra["untouched"][0]
    f = shown["frequency"]
    left.semilogy(f, TO_UM * shown["measured"].max(axis=0), color="k", lw=1, label="measured")
    for name, stage in zip(STAGES, shown["stages"], strict=False):
        left.semilogy(f, TO_UM * stage.max(axis=0), lw=1, label=f"left, {name}")
    left.set(xlim=(0, 300), xlabel="frequency [Hz]", ylabel="line [um]", title=f"Untouched: {shown['point']}")
    left.legend()
    gap, roles = found.gap["gap"].values * TO_UM, found.gap["role"].values
    for k, name in enumerate(STAGES):
        right.plot(list(SPEEDS), [np.sqrt(np.mean(gap[roles == role, :, k] ** 2)) for role in SPEEDS], "o-", label=name)
    right.set(ylabel="gap, rms [um]", yscale="log", title=found.status.replace("_", " "))
    right.legend()
    figure.tight_layout()
    figure.savefig(path, dpi=100)


def gaps(found: Diagnosis) -> dict[str, dict[str, float]]:
    """Gap [um rms] by role and stage."""
    gap, roles = found.gap["gap"].values * TO_UM, found.gap["role"].values
    return {role: {name: float(np.sqrt(np.mean(gap[roles == role, :, k] ** 2))) for k, name in enumerate(STAGES)}
            for role in SPEEDS}  # fmt: skip


def main() -> None:
    """Diagnose, write report, numbers and picture, and print what was found."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("measured_rig"))
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    found = rs.diagnose("dtu_gas_bearing", records(), progress=lambda stage: line(stage, stage == "show"))
    found.report(out / "report.html")
    numbers = {"status": found.status, "sentence": found.sentence, "gap_um": gaps(found), "gone": reduction(found.gap),
               "notes": found.notes, "calibration": found.calibration}  # fmt: skip
    (out / "measured_rig.json").write_text(json.dumps(numbers, indent=2, default=float))
    story(found, out / "measured_rig.png")
    print(found.sentence)
    for role, stages in gaps(found).items():
        print(role.replace("_", " "), ", ".join(f"{name} {value:.3g} um" for name, value in stages.items()))


if __name__ == "__main__":
    main()
