"""Verdicts on the cases of the diagnosis benchmark, and their rates with bounds."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from rotorsim.discrepancy import Diagnosis
from rotorsim.discrepancy.calibration import DIRECTIONS, contributions, setting
from rotorsim.discrepancy.candidates import class_of, signature_of
from rotorsim.discrepancy.hidden_machine import HiddenTruth
from rotorsim.discrepancy.twin import Twin
from studies.benchmarks import odds_score as score
from studies.benchmarks.hidden_case import KINDS
from studies.benchmarks.result import Figure

INJECTOR = " of injector "
VERDICTS = ("right", "class", "partial", "missed", "wrong")
STATUSES = frozenset(
    {"no_disagreement", "recalibrated", "named", "tie", "partial", "discovered", "stochastic", "unknown"}
)
"""Statuses of a diagnosis that a case can be judged by."""
ABOVE = 2.2
"""Times its detectable size above which a single effect should nearly always be named."""


@dataclass(frozen=True)
class CaseVerdict:
    """One case's outcome."""

    number: int
    kind: str
    hidden: tuple[str, ...]
    steps: float
    times: float
    """Size of the least hidden effect over its detectable size."""
    status: str
    named: tuple[str, ...]
    verdict: str
    seconds: float
    reduction: float
    within: float
    """Share of the hidden parameters within two standard deviations (NaN where none was named)."""
    cpu: float
    """Seconds of one core."""
    ties: int = 0
    """Other explanations that the verdict holds for as good."""
    odds: tuple[tuple[str, float, bool], ...] = ()
    """Explanations with their probability and whether they are the hidden one."""
    apart: tuple[float, ...] = ()
    """Distances of the hidden parameters from those of the diagnosis, in standard deviations."""
    calibrated: tuple[float, ...] = ()
    """Distances of the hidden calibration from that of the diagnosis, in standard deviations; right verdicts alone."""


def judged(kind: str, hidden: tuple[str, ...], d: Diagnosis, known: set[str]) -> str:
    """right (exact), class (a tie that holds it), missed, partial (or one of two), or wrong (a name that is not it).

    Re-calibrated numbers take the blame, so they are wrong wherever something is hidden, of the catalogue or not.
    Raises ValueError for a status that no diagnosis has.
    """
    if d.status not in STATUSES:
        raise ValueError(f"status {d.status!r} of a diagnosis is not one of {', '.join(sorted(STATUSES))}")
    if d.status in ("no_disagreement", "unknown"):
        return "right" if not hidden and (d.status == "no_disagreement" or kind == "foreign") else "missed"
    if d.status in ("discovered", "stochastic"):
        return "right" if kind in ("foreign", "noise") else "missed" if hidden else "wrong"
    if d.status == "recalibrated":
        return "wrong" if hidden or kind == "foreign" else "right"
    if d.status == "partial":
        return "partial"
    members = product(*({f.form: 0} | dict.fromkeys(f.tie_class) for f in d.effects))  # the names themselves come first
    proposed = [*members, *d.ties]
    target = sorted(class_of(h, known) for h in hidden)
    parts = [sorted(class_of(k, known) for k in keys) for keys in proposed]
    holds = [own == target for own in parts]
    if kind == "left_out":
        # another name is not an error if no record distinguishes it from what is hidden
        return "class" if any(holds) else "wrong"
    if any(len(own) < len(target) and all(c in target for c in own) for own in parts) and not any(holds):
        return "partial"
    if d.status == "named":
        due = any(len(class_of(h, known)) > 1 for h in hidden)
        return "right" if holds[0] and not due else "wrong"
    return "class" if any(holds) and hidden else "wrong"


def apart(d: Diagnosis, truth: HiddenTruth, twin: Twin) -> tuple[float, ...]:
    """Distances of the hidden parameters from those of the diagnosis, in standard deviations."""
    found_apart = []
    for found in d.effects if d.status in ("named", "tie") else ():
        for form, amplitude in zip(truth.forms, truth.amplitudes, strict=True):
            if form.key != found.form:
                continue
            hidden = setting(
                twin, contributions(dict(zip(form.parameters, amplitude, strict=True)), 0.0, 0.0), form.fixed
            )
            for key, value in hidden.items():
                parameter = key.split(".")[2]
                if parameter in found.sd:
                    away = _apart(found.parameters[parameter] - value, parameter, hidden, key)
                    found_apart.append(float(away / found.sd[parameter]))
    return tuple(found_apart)


def calibrated(d: Diagnosis, truth: HiddenTruth) -> tuple[float, ...]:
    """Distances of the hidden calibration from that of the diagnosis, in standard deviations.

    Without the directions of mesh and law, which no machine has, and the unbalance where what turns with the shaft is
    found, which is in part the same.
    """
    hidden = {parameter.name: value for parameter, value in truth.point.values.items()}
    turning = any("vector that turns" in signature_of(found.form) for found in d.effects)
    return tuple(
        abs(value - hidden.get(name, 0.0)) / sd
        for name, (value, sd) in d.calibration.items()
        if name not in DIRECTIONS[2:] and not (turning and name.startswith("unbalance.")) and sd > 0
    )


def _apart(difference: float, parameter: str, hidden: dict[str, float], key: str) -> float:
    """Size of a difference; phases repeat after a turn, places of lobes after one lobe."""
    if not parameter.endswith("phase"):
        return abs(difference)
    turn = 2 * np.pi / hidden.get(key.replace("_phase", "_lobes"), 1.0)
    return abs((difference + turn / 2) % turn - turn / 2)


def confusion(found: list[CaseVerdict]) -> str:
    """Verdicts by kind as a table."""
    rows = ["| kind | cases | " + " | ".join(VERDICTS) + " |", "|---|---|" + "---|" * len(VERDICTS)]
    for kind in dict.fromkeys(KINDS):
        own = [c for c in found if c.kind == kind]
        if own:
            counts = [sum(c.verdict == v for c in own) for v in VERDICTS]
            rows.append(f"| {kind} | {len(own)} | " + " | ".join(map(str, counts)) + " |")
    return "\n".join(rows)


def _places(keys: tuple[str, ...]) -> set[str]:
    """Which injectors keys are of."""
    return {key.partition(INJECTOR)[2] for key in keys if INJECTOR in key}


def figures(found: list[CaseVerdict]) -> Iterator[Figure]:
    """Rates with the bounds they should meet; a bound on what must be small, none on what must be large."""

    def share(kinds: tuple[str, ...], verdicts: tuple[str, ...], least: float = 0.0) -> float:
        own = [c for c in found if c.kind in kinds and c.times >= least]
        return sum(c.verdict in verdicts for c in own) / len(own) if own else float("nan")

    yield Figure("singles not named (exact or class)", 1 - share(("single",), ("right", "class"), 1.0), "1", 0.30)
    yield Figure(
        f"singles above {ABOVE}x the detectable size not named",
        1 - share(("single",), ("right", "class"), ABOVE), "1", 0.10,
    )  # fmt: skip
    yield Figure("singles, wrong names", share(("single",), ("wrong",)), "1", 0.03)
    yield Figure("no effect, wrong names", share(("none",), ("wrong",)), "1", 0.03)
    yield Figure("out of the catalogue, wrong names", share(("foreign",), ("wrong",)), "1", 0.03)
    yield Figure("error of the injectors' law, wrong names", share(("law",), ("wrong",)), "1", 0.03)
    yield Figure("left out of the candidates, wrong names", share(("left_out",), ("wrong",)), "1", 0.10)
    yield Figure("noise x3, wrong names", share(("noise",), ("wrong",)), "1", 0.0)
    yield Figure("pairs not both named", 1 - share(("pair",), ("right", "class"), 1.0), "1", 0.40)
    yield Figure("pairs, wrong names", share(("pair",), ("wrong",)), "1", 0.05)
    correct = [c for c in found if c.verdict in ("right", "class") and c.named]
    left = [1 - c.reduction for c in correct if np.isfinite(c.reduction)]
    if left:
        yield Figure("gap left on untouched records, median", float(np.median(left)), "1", 0.20)
        yield Figure("gap left on untouched records, tenth percentile", float(np.percentile(left, 90)), "1", 0.50)
    numbered = [c for c in found if c.status in ("named", "tie") and _places(c.hidden) and c.kind != "left_out"]
    if numbered:
        missed = [c for c in numbered if _places(c.named) != _places(c.hidden)]
        yield Figure("another injector than the hidden one", len(missed) / len(numbered), "1", 0.10)
    inside = [c.within for c in correct if np.isfinite(c.within)]
    if inside:
        yield Figure("true sizes beyond two standard deviations", 1 - float(np.mean(inside)), "1", 0.10)
    yield from _of_odds(found)
    seconds = [c.seconds for c in found if c.seconds > 0]
    if seconds:
        yield Figure("one diagnosis, median", float(np.median(seconds)), "s", 180.0)
        yield Figure("one diagnosis, median, one core's time", float(np.median([c.cpu for c in found])), "s")
        yield Figure("one diagnosis, longest", float(max(seconds)), "s", 900.0)


def _of_odds(found: list[CaseVerdict]) -> Iterator[Figure]:
    """Trust in the stated probabilities and intervals."""
    stated = [c for c in found if c.odds]
    if not stated:
        return
    today = score.brier(map(score.from_verdict, stated))
    yield Figure("odds: expected calibration error", score.calibration_error(score.reliability(stated)), "1", 0.05)
    yield Figure("odds: Brier score", score.brier(c.odds for c in stated), "1", today)
    yield Figure("odds: Brier score of the verdicts read as probabilities", today, "1")
    wrong = score.sure_and_wrong(stated, ("none", "foreign", "noise"))
    yield Figure("odds: wrong names above 95 % among none, foreign, noise", wrong, "1", 0.0)
    left = list(score.beyond_left_out(stated))
    if left:
        yield Figure("odds: left out, 1 - mean probability of beyond", 1 - float(np.mean(left)), "1", 0.4)
    for share, bound in ((0.5, None), (0.9, 0.15)):
        yield Figure(f"sizes beyond the {share:.0%} interval", 1 - score.coverage(stated, share), "1", bound)
        beyond = 1 - score.coverage(stated, share, "calibrated")
        yield Figure(f"calibration beyond the {share:.0%} interval", beyond, "1", bound)
