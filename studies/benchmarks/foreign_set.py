r"""Verdicts of `diagnose` on a set of faults of the independent rotor (`foreign_rotor`), through files and the reader.

    python -m studies.benchmarks.foreign_set FOLDER [--seeds 1 2] [--faults NAME ...]

The supports are 10 to 20 % off those of the machine file in every case, and the unbalance is another one. Everything
that is drawn stands in the truth, which is written first; its SHA-256 is the first line of the results.

What the records are too coarse to show is decided by the generator alone, before any verdict: where a sound machine,
with supports within 20 % of the file's and any unbalance, makes the same readings within the stated accuracy at every
probe, "no disagreement" is a fault that is missed; else it is wrong.

A verdict is right by its name, its class or its place; a refusal by its argument and the mistake that it states. Sizes
of all verdicts are compared with the truth, in stated standard deviations. A case whose result in the folder has the
hashes of its truth and of the sources is not run again.
"""

import argparse
import hashlib
import json
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

from identification import read, resample
from rotorsim.base.cache import sources_hash
from rotorsim.base.errors import RotorsimError
from rotorsim.discrepancy import diagnose
from rotorsim.discrepancy.calibration import CompiledModels
from rotorsim.discrepancy.comparison import SOURCES as RUN_SOURCES
from rotorsim.machine import Machine
from studies.benchmarks.foreign_rotor import (
    ACCURACY,
    BEARINGS,
    HERTZ,
    UNBALANCE,
    E,
    TwoDiscRig,
    least_damping,
    left_by_sound,
    machine_text,
    write_records,
)


@dataclass(frozen=True)
class RigFault:
    """RigFault with the answers that are right: effects, a place, argument and words of a refusal ('probes: ...').

    `change` draws its sizes for a sound rig, `sizes` has the true ones by form and parameter.
    """

    name: str
    answers: tuple[str, ...]
    change: Callable[[np.random.Generator, TwoDiscRig], dict[str, Any]]
    sizes: Callable[[TwoDiscRig], Mapping[str, float]] = lambda rig: {}


NOTHING, FAINT = "nothing", "faint"
"""Answers that nothing disagrees, which is right, or that the records are too coarse to show it: it is missed."""
OWN = (str(Path(__file__).with_name(f"foreign_{part}.py")) for part in ("rotor", "set"))
SOURCES = (*RUN_SOURCES, "identification", *OWN)
"""Sources that a result follows from; the study's own are not installed."""


def bearing(number: int, stiffness: tuple[float, float], damping: tuple[float, float] = (1.0, 1.0)) -> Any:
    """Change of a bearing by factors drawn from ranges."""

    def change(rng: np.random.Generator, rig: TwoDiscRig) -> dict[str, Any]:
        k, c = rng.uniform(*stiffness), rng.uniform(*damping)
        own = tuple(v * f for v, f in zip(rig.bearings[number], (k, k, c, c), strict=True))
        return {"bearings": tuple(own if i == number else one for i, one in enumerate(rig.bearings))}

    return change


def gain(probe: int, low: float, high: float) -> Any:
    """Change of a probe's gain, drawn from a range."""
    return lambda rng, rig: {"gains": tuple(rng.uniform(low, high) if i == probe else 1.0 for i in range(4))}


def seal(rng: np.random.Generator, rig: TwoDiscRig) -> dict[str, Any]:
    """Cross-coupled stiffness, drawn as a share of that from which the rotor is unstable at the highest speed."""
    speed = 2 * np.pi * max(HERTZ)
    limit = brentq(lambda k: least_damping(replace(rig, seal=k), speed), 0.0, 1e6, xtol=10.0)
    return {"seal": float(limit * rng.uniform(0.5, 0.8))}


def fixed(**changes: Any) -> Any:
    """Change without anything drawn."""
    return lambda rng, rig: changes


FAULTS = (
    RigFault("nothing", (NOTHING,), fixed()),
    RigFault("right bearing softer", ("bearing right",), bearing(1, (0.3, 0.5))),
    RigFault("left bearing softer", ("bearing left",), bearing(0, (0.3, 0.5))),
    RigFault("right bearing stiffer", ("bearing right",), bearing(1, (2.2, 3.5))),
    RigFault("left bearing stiffer", ("bearing left",), bearing(0, (2.2, 3.5))),
    RigFault("left bearing less damped", ("bearing left",), bearing(0, (1.0, 1.0), (0.15, 0.3))),
    RigFault("right bearing less damped", ("bearing right",), bearing(1, (1.0, 1.0), (0.15, 0.3))),
    RigFault("unbalance turned", (NOTHING, "unbalance"),
          lambda rng, rig: {"unbalance": ((rng.uniform(25e-6, 40e-6), rng.uniform(1.5, 3.0)), rig.unbalance[1])}),
    RigFault("bow", ("shaft_bow.bow", "runout.amplitude_1x"), lambda rng, rig: {"bow": rng.uniform(8e-6, 20e-6)},
          lambda rig: {"shaft_bow.bow": rig.bow}),
    RigFault("force at 2X", ("coupling.force_2x", "asymmetric_shaft", "crack"),
          lambda rng, rig: {"forward_2x": rng.uniform(15, 40)},
          lambda rig: {"coupling.force_2x": rig.forward_2x}),
    RigFault("seal", ("labyrinth_seal.cross_stiffness of disc 1", "internal_damping"),
          seal,
          lambda rig: {"labyrinth_seal.cross_stiffness": rig.seal}),
    RigFault("stop", ("rub.stiffness of disc 1",), lambda rng, rig: {"stop": (rng.uniform(2e5, 5e5), 3e-6)}),
    RigFault("loose pedestal", ("bearing right",), lambda rng, rig: {"pedestal": (rng.uniform(0.8e6, 1.5e6), 2.0)}),
    RigFault("hot spot", (), lambda rng, rig: {"heating": rng.uniform(0.3, 0.6)}),
    RigFault("strong hum", (NOTHING,), lambda rng, rig: {"hum": rng.uniform(1e-6, 2e-6)}),
    RigFault("probe 1R reads more", ("sensor_gain.x of 1R", "sensor_gain.y of 1R"), gain(1, 1.07, 1.15),
          lambda rig: {"sensor_gain.x": rig.gains[1] - 1, "sensor_gain.y": rig.gains[1] - 1}),
    RigFault("probe 2L reads less", ("sensor_gain.x of 2L", "sensor_gain.y of 2L"), gain(2, 0.85, 0.93),
          lambda rig: {"sensor_gain.x": rig.gains[2] - 1, "sensor_gain.y": rig.gains[2] - 1}),
    RigFault("probe 2L reversed", ("probes: 2L is reversed",), gain(2, -1.0, -1.0)),
    RigFault("probes of plane 1 exchanged", ("probes: 1L and 1R are exchanged",), fixed(order=(1, 0, 2, 3))),
    RigFault("planes exchanged", ("probes: the planes are exchanged",), fixed(order=(2, 3, 0, 1))),
    RigFault("plane 2 turned by 45 deg", ("probes: 2L and 2R are turned",), fixed(turned=(0.0, np.pi / 4))),
    RigFault("other sense of rotation", ("probes: the rotation is in the other sense",), fixed(sense=-1)),
    RigFault("probe 1L drifts", (NOTHING,), lambda rng, rig: {"drift": rng.uniform(10e-6, 30e-6)}),
    RigFault("clock of the probes late", ("clock: the displacement is shifted", "sensor_delay", "sensor_lag"),
          lambda rng, rig: {"clock": (rng.uniform(1e-3, 3e-3), 0.0)},
          lambda rig: {"sensor_delay.delay": rig.clock[0]}),
    RigFault("clock of the probes drifts", ("clock: the clock of the probes drifts",),
          lambda rng, rig: {"clock": (0.0, rng.uniform(1e-4, 4e-4))}),
    RigFault("speed stated too high", ("speed: but the angle turns",),
          lambda rng, rig: {"speed_error": rng.uniform(0.03, 0.06)}),
)  # fmt: skip
"""Faults of the set; each is drawn by every seed."""


@dataclass(frozen=True)
class RigCase:
    """RigFault of a seed with the rig that was drawn."""

    fault: RigFault
    seed: int
    rig: TwoDiscRig

    @property
    def name(self) -> str:
        """Name with the seed."""
        return f"{self.fault.name}, seed {self.seed}"

    @cached_property
    def answers(self) -> tuple[str, ...]:
        """Answers that are right; `FAINT` is one where a sound machine makes the same readings.

        The same is within the stated accuracy at every probe, of a fault that makes a steady motion.
        """
        sound = TwoDiscRig(self.rig.bearings, self.rig.unbalance)
        steady = replace(self.rig, hum=sound.hum, heating=0.0, drift=0.0, clock=(self.rig.clock[0], 0.0))
        if NOTHING in self.fault.answers or steady != replace(self.rig, hum=sound.hum) or self.rig.speed_error:
            return self.fault.answers
        faint = bool(np.all(left_by_sound(self.rig) < ACCURACY))
        return (*self.fault.answers, FAINT) if faint else self.fault.answers

    @property
    def truth(self) -> dict[str, Any]:
        """All that is drawn, with the answers that are right."""
        return {"name": self.name, "answers": self.answers, "rig": asdict(self.rig)}


def drawn(fault: RigFault, seed: int) -> RigCase:
    """RigCase of a fault: supports 10 to 20 % off, another unbalance, and the fault's own sizes."""
    rng = np.random.default_rng([seed, *fault.name.encode()])
    off = 1 + rng.choice([-1, 1], (2, 4)) * rng.uniform(0.1, 0.2, (2, 4))
    bearings = tuple(tuple(map(float, own)) for own in off * np.array(BEARINGS)[:, 1:])
    unbalance = tuple((float(me * rng.uniform(0.7, 1.4)), float(rng.uniform(-1, 1))) for me in UNBALANCE)
    sound = TwoDiscRig(bearings, unbalance)
    return RigCase(fault, seed, replace(sound, **fault.change(rng, sound)))


def judged(
    answers: Iterable[str], status: str, sentence: str, names: Iterable[str] = (), rivals: Iterable[str] = (),
    large: Iterable[str] = (), argument: str = "",
) -> str:  # fmt: skip
    """Outcome of a verdict: 'name', 'class', 'place', 'mistake', 'nothing' are right, 'silent' gives no answer.

    'false peace' and what begins with 'WRONG' are wrong, 'missed' is neither; `large` are the sentences on the
    calibration, `argument` is that of a refusal.
    """
    names = tuple(names)
    if status == "refused":
        refusals = [answer.partition(": ") for answer in answers]
        if any(about == argument and words and words in sentence for about, _, words in refusals):
            return "mistake"
        return "silent" if "unexplained" in sentence else "WRONG mistake"
    if status in ("unknown", "partial"):
        return "silent"
    if status == "no_disagreement":
        return "nothing" if NOTHING in answers else "missed" if FAINT in answers else "false peace"
    if status == "recalibrated":
        own = [any(answer in one for answer in answers) for one in large]
        if not own or not all(own):
            return "WRONG place"
        return "class" if any("one of these places" in one for one in large) else "place"
    if names and all(any(name.startswith(answer) for answer in answers) for name in names):
        return "name" if status == "named" else "class"
    if status == "tie" and any(rival.startswith(answer) for rival in rivals for answer in answers):
        return "class"
    return "WRONG name"


RIGHT = ("name", "class", "place", "mistake", "nothing")
"""Outcomes that are right."""


def deviations(case: RigCase, found: Any) -> dict[str, float]:
    """Stated less true sizes in stated standard deviations, of the calibration and of the effects."""
    rig, out = case.rig, {}
    true = {f"bearings.{i}.{name}": v for i, own in enumerate(rig.bearings)
            for name, v in zip(("kxx", "kyy", "cxx", "cyy"), own, strict=True)}  # fmt: skip
    if rig.pedestal[0]:
        true = {key: v for key, v in true.items() if not key.startswith("bearings.1")}
    for i, (me, phase) in enumerate(rig.unbalance):
        true |= {f"effects.unbalance.{i}.me": me, f"effects.unbalance.{i}.phase": phase}
    true["shaft.material.youngs_modulus"] = E
    for row in found.recalibration:
        if row.path in true and row.sd > 0:
            error = row.value - true[row.path]
            out[row.path] = float((np.angle(np.exp(1j * error)) if row.unit == "rad" else error) / row.sd)
    sizes = case.fault.sizes(rig)
    for effect in found.effects:
        for name, sd in effect.sd.items():
            if f"{effect.effect}.{name}" in sizes and sd > 0:
                out[effect.form] = (effect.parameters[name] - sizes[f"{effect.effect}.{name}"]) / sd
    return out


def diagnosed(case: RigCase, folder: Path, models: Any) -> dict[str, Any]:
    """Verdict on one case, through files and the reader, with its outcome."""
    files, cpu = write_records(case.rig, case.seed, folder), time.process_time()
    try:
        own = {
            role: [resample(read(p, folder / "rig.toml"), 5000.0).assign_attrs(record=p.stem, role=role) for p in paths]
            for role, paths in files.items()
        }
        found = diagnose(Machine.from_text(machine_text()), [r for part in own.values() for r in part], models=models)
    except RotorsimError as error:
        seen = {
            "status": "refused",
            "sentence": str(error),
            "outcome": judged(case.answers, "refused", str(error), argument=error.argument),
        }
        return {"case": case.name, "cpu_s": time.process_time() - cpu, **seen}
    names = [one.form for one in found.effects]
    rivals = [*(name for tie in found.ties for name in tie), *(key for one in found.effects for key in one.tie_class)]
    outcome = judged(case.answers, found.status, found.sentence, names, rivals, found.large)
    return {
        "case": case.name, "cpu_s": time.process_time() - cpu, "status": found.status, "sentence": found.sentence,
        "outcome": outcome, "deviations": deviations(case, found), "odds": found.odds, "large": list(found.large),
        "notes": list(found.notes), "effects": [[one.form, one.parameters, one.sd] for one in found.effects],
        "recalibration": [[r.path, r.value, r.sd, r.before] for r in found.recalibration],
    }  # fmt: skip


def summary(results: list[dict[str, Any]]) -> str:
    """Outcomes, share of right ones, and share of all sizes within three stated standard deviations."""
    count = Counter(one["outcome"] for one in results)
    right = [one for one in results if one["outcome"] in RIGHT]
    z = np.abs([v for one in results for v in one.get("deviations", {}).values()])
    text = ", ".join(f"{name} {n}" for name, n in sorted(count.items()))
    sizes = f"; {int((z < 3).sum())} of {len(z)} sizes within 3 standard deviations" if len(z) else ""
    return f"{len(right)} of {len(results)} right: {text}{sizes}"


def with_result(case: RigCase, path: Path, run: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """Result of a case from a file, where it has the same truth and sources; else that of a run, which is written."""
    truth = hashlib.sha256(json.dumps(case.truth, sort_keys=True).encode()).hexdigest()
    own = {"truth": truth, "sources": sources_hash(*SOURCES)}
    known: dict[str, Any] = json.loads(path.read_text()) if path.exists() else {}
    if own.items() <= known.items():
        return known
    path.write_text(json.dumps(run() | own, indent=1, default=float))
    return dict(json.loads(path.read_text()))


def main() -> None:
    """Write the truth, then diagnose case by case."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--faults", nargs="+", choices=[f.name for f in FAULTS], default=[f.name for f in FAULTS])
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    cases = [drawn(fault, seed) for seed in asked.seeds for fault in FAULTS]
    truth = json.dumps([case.truth for case in cases], sort_keys=True)
    (asked.folder / "truth.json").write_text(truth)
    print(f"truth {hashlib.sha256(truth.encode()).hexdigest()}", flush=True)
    models, results = CompiledModels.of(Machine.from_text(machine_text())), []
    for case in (case for case in cases if case.fault.name in asked.faults):
        run = partial(diagnosed, case, asked.folder / case.name, models)
        found = with_result(case, asked.folder / f"{case.name}.json", run)
        print(f"{found['outcome']:11} {found['cpu_s']:5.0f} s  {case.name}: {found['sentence']}", flush=True)
        results.append(found)
    print(summary(results))


if __name__ == "__main__":
    main()
