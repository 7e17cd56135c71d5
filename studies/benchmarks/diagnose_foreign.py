"""Verdicts of `diagnose` on records in which something is that no candidate is, or nothing: right, unknown or wrong.

    python studies/benchmarks/diagnose_foreign.py [CASE ...]

Rotors with own effects (the kernels here, none of them a candidate), with a supply that drifts without being stated, at
speeds whose periods hold no whole turns, with three draws of noise, and the measured run-up of a rotor kit. A verdict
is right if it is that of TRUTH; unknown and partial ones count as unknown; any other name is wrong, as re-calibrated
numbers are where something is hidden, and ends the script with 1.
"""

import argparse
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from identification import read
from reynolds.jit import inlined
from rotorsim.base.errors import RotorsimError
from rotorsim.base.units import MPA
from rotorsim.discrepancy import Diagnosis, diagnose, hide
from rotorsim.discrepancy.experiments import HIGH, LOW, PERIOD, PERIODS, SPACING, PlannedRecord
from rotorsim.discrepancy.hidden_machine import draw, record_of, truth_twin
from rotorsim.effects import REGISTRY, Effect, param, register
from rotorsim.experiments import Multisine
from rotorsim.machine import Machine, load_machine

RK4 = Path(__file__).parents[1] / "docs" / "rk4"


@inlined
def own_asymmetry(t, angle, speed, x, y, vx, vy, p):
    """Shaft that is stiffer along one axis and not softer across: [N]."""
    c = math.cos(angle + p.phase)
    s = math.sin(angle + p.phase)
    along = p.difference * (x * c + y * s)
    return -along * c, -along * s


@register
class OwnAsymmetry(Effect):
    """Asymmetric shaft in another form than the catalogue's."""

    port, kernel, role = "motion", own_asymmetry, "known"
    difference: float = param("N/m", bounds=(0.0, 1e9), doc="Stiffness along the axis.")
    phase: float = param("rad", bounds=(-7.0, 7.0), doc="The axis on the shaft.")


@inlined
def own_seal(t, angle, speed, x, y, vx, vy, p):
    """The labyrinth seal of the docs: [N]."""
    cross = p.swirl * speed * p.damping
    return -p.damping * vx - cross * y, -p.damping * vy + cross * x


@register
class OwnSeal(Effect):
    """Labyrinth seal."""

    port, kernel, role, steady = "motion", own_seal, "known", True
    damping: float = param("N*s/m", bounds=(0.0, 1e5), doc="Direct damping.")
    swirl: float = param("1", default=0.5, bounds=(-2.0, 2.0), doc="Swirl of the gas over the shaft's.")


@inlined
def own_cubic(t, angle, speed, x, y, vx, vy, p):
    """Cubic stiffness: [N]."""
    k = p.stiffness * (x * x + y * y)
    return -k * x, -k * y


@register
class OwnCubic(Effect):
    """Cubic stiffness."""

    port, kernel, role, steady = "motion", own_cubic, "known", True
    stiffness: float = param("N/m^3", bounds=(0.0, 1e16), doc="Cubic stiffness.")


for _own in (OwnAsymmetry, OwnSeal, OwnCubic):
    REGISTRY.pop(_own.name)  # in the truth alone


def with_own(effect: Effect, seed: int = 1, rig: Machine | None = None) -> tuple[Any, list[Any]]:
    """The plain rotor, damped more, or another rig, and its records with an own effect at work."""
    plain = rig or load_machine("plain_rotor").replace("shaft.damping_ratio", 0.02)
    REGISTRY[effect.name] = type(effect)
    try:
        twin = truth_twin(plain.with_({f"effects.{effect.name}": (effect,)}))
        return plain, hide(plain, (), seed, truth=draw(twin, (), seed), twin=twin)
    finally:
        REGISTRY.pop(effect.name)


def drift(seed: int = 1) -> tuple[Any, list[Any]]:
    """The rig, with 3 % more supply in one record than is stated."""
    rig = load_machine("dtu_gas_bearing")

    def more(rows: np.ndarray, planned: PlannedRecord) -> np.ndarray:
        if planned.name == "fit_4":
            rows[:, 1] *= 1.03
        return rows

    records = hide(rig, (), seed, disturb=more)
    for record in records:
        if record.attrs["record"] == "fit_4":
            record["pressure_measured"] = record["pressure_measured"] / 1.03
    return rig, records


def off_the_grid(seed: int = 1) -> tuple[Any, list[Any]]:
    """The rig with nothing hidden, at speeds whose turns do not fit into a period of the excitation."""
    rig = load_machine("dtu_gas_bearing")
    twin, role = truth_twin(rig), {0: "fit", 1: "held_out", 2: "untouched"}
    truth, records = draw(twin, (), seed), []
    speeds = (21.3, 33.9, 47.1, 58.7, 71.9, 86.3, 27.7, 63.1, 93.7, 43.3, 77.9)
    for i, hertz in enumerate(speeds):
        own = role[0 if i < 6 else 1 if i < 9 else 2]
        pressure, amplitude = (0.3 + 0.07 * (i % 6)) * MPA, 1.0 - 0.5 * (i % 2)
        one = Multisine(2 * np.pi * hertz, pressure, amplitude, LOW, HIGH, PERIOD, PERIODS, SPACING, sequence=i)
        records.append(record_of(twin, PlannedRecord(f"{own}_{i}", own, one, i), truth.point, seed))
    return rig, records


def noise_draw(seed: int) -> tuple[Any, list[Any]]:
    """A coupling out of line; the same records with 0.1 um of noise from another seed each time."""
    plain = load_machine("plain_rotor")
    records, rng = hide(plain, ("coupling.force_2x",), 3), np.random.default_rng(seed)
    for record in records:
        y = record["disc_measured"]
        record["disc_measured"] = y + rng.normal(0, 1e-7, y.shape)
    return plain, records


def run_up() -> tuple[Any, list[Any]]:
    """The measured run-up, one probe."""
    return load_machine("bently_rk4"), [read(RK4 / "runup.csv", RK4 / "runup.toml")]


CASES: dict[str, Callable[[], tuple[Any, list[Any]]]] = {
    "asymmetric shaft": lambda: with_own(OwnAsymmetry(difference=2e3, phase=0.4)),
    "labyrinth seal": lambda: with_own(OwnSeal(damping=20.0)),
    "cubic stiffness": lambda: with_own(OwnCubic(stiffness=2e12)),
    "drift of supply": drift,
    "off the grid": off_the_grid,
    "noise 1": lambda: noise_draw(11),
    "noise 2": lambda: noise_draw(12),
    "noise 3": lambda: noise_draw(13),
    "run-up": run_up,
}
TRUTH: dict[str, tuple[str, ...]] = {
    "asymmetric shaft": ("asymmetric_shaft",), "labyrinth seal": ("labyrinth_seal",), "noise 1": ("coupling",),
    "noise 2": ("coupling",), "noise 3": ("coupling",), "off the grid": (),
}  # fmt: skip
"""Effects whose name is right, none where there is no disagreement; where nothing stands here only unknown is right."""


def verdict(case: str, found: Diagnosis) -> str:
    """right, class, unknown or wrong; raises ValueError for a status that no diagnosis has."""
    if found.status in ("unknown", "partial", "discovered", "stochastic"):
        return "unknown" if case in TRUTH else "right"
    if found.status in ("no_disagreement", "recalibrated"):
        return "right" if TRUTH.get(case) == () else "wrong"
    if found.status not in ("named", "tie"):
        raise ValueError(f"status {found.status!r} of a diagnosis is not known here")
    proposed = [{f.effect for f in found.effects}, *({key.split(".")[0] for key in keys} for keys in found.ties)]
    if set(TRUTH.get(case, ())) not in proposed:
        return "wrong"
    return "right" if found.status == "named" else "class"


def main() -> int:
    """Diagnose each case and print a row of the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("case", nargs="*", help=f"one of {', '.join(CASES)}; all when not given")
    cases = parser.parse_args().case or list(CASES)
    for unknown in (case for case in cases if case not in CASES):
        parser.error(f"case '{unknown}' is not known; choose one of {', '.join(CASES)}")
    verdicts = []
    print("| case | status | effects | ties | verdict | seconds |\n|---|---|---|---|---|---|")
    for case in cases:
        machine, records = CASES[case]()
        begin = time.perf_counter()
        try:
            found = diagnose(machine, records)
        except RotorsimError as error:
            verdicts.append("unknown" if case in TRUTH else "right")
            print(f"| {case} | refused: {error} | | | {verdicts[-1]} | |", flush=True)
            continue
        verdicts.append(verdict(case, found))
        effects = ", ".join(
            f"{f.form} ({'; '.join(f'{p} {value}' for p, value, _ in f.sizes())})" for f in found.effects
        )
        ties = ", ".join(" with ".join(keys) for keys in found.ties)
        seconds = f"{time.perf_counter() - begin:.0f}"
        print(f"| {' | '.join((case, found.status, effects, ties, verdicts[-1], seconds))} |", flush=True)
        for note in found.notes:
            print(f"  {note}", file=sys.stderr, flush=True)
    return int("wrong" in verdicts)


if __name__ == "__main__":
    sys.exit(main())
