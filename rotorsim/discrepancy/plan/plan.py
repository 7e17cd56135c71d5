"""Ranking of the experiments that a rig can do next by what they should leave of the odds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import tomlkit

from rotorsim.base.constants import MPA, TO_RPM
from rotorsim.base.errors import DataError
from rotorsim.discrepancy.fit.least_squares import Fit
from rotorsim.discrepancy.fit.parameters import FitParameter
from rotorsim.discrepancy.fit.uncertainty import scaled
from rotorsim.discrepancy.linear_algebra import NoAnswerError, answer
from rotorsim.discrepancy.odds.explanation import Explanation
from rotorsim.discrepancy.odds.odds import TEMPERATURE
from rotorsim.discrepancy.plan.expected import Outlook, Predicted, entropy, outlook
from rotorsim.discrepancy.plan.options import Option, options
from rotorsim.discrepancy.residuals.comparison import Comparison, simulate
from rotorsim.discrepancy.search.indistinguishable import signature_of

LEAST = 0.01
"""Probability below which an explanation is no rival."""
RIVALS = 5
"""Rivals that are followed into a new run, at most."""
ENOUGH = 0.02
"""Share of today's entropy that a run has to take away to be worth its time."""


@dataclass(frozen=True)
class Proposal:
    """An experiment with what it should leave of the odds."""

    option: Option
    outlook: Outlook

    def as_dict(self) -> dict[str, Any]:
        """As plain numbers and text."""
        one = self.option
        return {
            "experiment": one.name, "kind": one.kind, "speed_rpm": one.speed * TO_RPM,
            "pressure_mpa": one.pressure / MPA, "amplitude": one.amplitude, "minutes": one.minutes,
            "entropy_bit": self.outlook.entropy, "chance_of_95_percent": self.outlook.decided,
        }  # fmt: skip


@dataclass(frozen=True)
class Plan:
    """Experiments, the best first; entropy [bit] of today's odds; what no experiment separates, in words."""

    entropy: float
    rivals: tuple[str, ...]
    proposals: tuple[Proposal, ...]
    unbreakable: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """What to do next."""
        if len(self.rivals) < 2 or not self.proposals:
            return "No next experiment: one explanation is left, or none was re-fitted."
        best = self.proposals[0]
        if best.outlook.entropy > (1 - ENOUGH) * self.entropy:
            return f"No allowed experiment separates {' from '.join(self.rivals[:2])}."
        return (
            f"Next: {best.option.name} ({best.option.minutes:.0f} min): {100 * best.outlook.decided:.0f} % chance that "
            f"one explanation gets 95 %; entropy {self.entropy:.2f} -> {best.outlook.entropy:.2f} bit."
        )

    def as_dict(self) -> dict[str, Any]:
        """As plain numbers and text."""
        return {
            "sentence": self.sentence, "entropy_bit": self.entropy, "rivals": list(self.rivals),
            "proposals": [p.as_dict() for p in self.proposals], "unbreakable": list(self.unbreakable),
        }  # fmt: skip

    def campaign(self, machine: str) -> str:
        """The best experiment as the plan of a campaign; `machine` is a shipped one, or a file next to the plan."""
        document = tomlkit.document()
        document.add(tomlkit.comment(self.sentence))
        document.add("name", "next")
        document.add("machine", machine)
        table = tomlkit.table()
        for key, value in self.proposals[0].option.table().items():
            table.add(key, value)
        document.add("experiments", tomlkit.table(is_super_table=True).add("next", table))
        return tomlkit.dumps(document)


def rivals_of(odds: Iterable[Explanation]) -> list[Explanation]:
    """Explanations that a new run may settle: probable ones without something that has no response to predict."""
    return [e for e in odds if e.probability >= LEAST and not e.beyond]


def plan_next(
    comparison: Comparison, fits: dict[tuple[str, ...], Fit], odds: Iterable[Explanation], allow: Iterable[str],
    progress: Callable[[], None] = lambda: None,
) -> Plan:  # fmt: skip
    """Rank the experiments that are allowed.

    Parameters
    ----------
    comparison : Comparison
        The records there are.
    fits : dict
        Explanations by the effects that they name, re-fitted or by their sensitivities; () is nothing missing.
    odds : explanations with probabilities
    allow : names
        What may change, of `options.ALLOWED`.
    """
    found = options(comparison.twin.machine, comparison.trials, allow)
    if not found:
        raise DataError("plan: no experiment is possible with what is allowed; allow more")
    known = [e for e in rivals_of(odds) if e.effects in fits][:RIVALS]
    ties = tuple(_unbreakable(e) for e in known if e.alike)
    rivals = tuple(e.name for e in known)
    if len(known) < 2:
        return Plan(0.0, rivals, (), ties)
    p = np.array([e.probability for e in known])
    p /= p.sum()
    shape = max(e.error for e in known)
    own = [fits[e.effects] for e in known]
    proposals = []
    for option in found:
        progress()
        try:
            predicted, sigma = _predicted(comparison, option, own, shape)
            proposals.append(Proposal(option, outlook(p, predicted, sigma, TEMPERATURE)))
        except NoAnswerError:
            continue
    proposals.sort(key=lambda one: (round(one.outlook.entropy, 3), one.option.minutes))
    return Plan(float(entropy(p)), rivals, tuple(proposals), ties)


def _predicted(
    comparison: Comparison, option: Option, fits: Sequence[Fit], shape: float
) -> tuple[list[Predicted], np.ndarray]:
    """Predictions of the fits in a new run, and the standard deviation (n,) [m] of its numbers.

    Sensitivities that rivals share are taken at the first one's point.
    """
    trial = option.trial()
    shared: dict[FitParameter, np.ndarray] = {}
    out, largest = [], np.zeros(0)
    for fit in fits:
        mean = trial.vector(simulate(comparison.twin, trial, fit.point))
        columns = []
        for parameter in fit.parameters:
            if parameter.key in comparison.directions or parameter.trend:
                columns.append(np.zeros_like(mean))
                continue
            if parameter not in shared:
                moved = fit.point.moved([parameter], np.array([parameter.step]))
                shared[parameter] = (trial.vector(simulate(comparison.twin, trial, moved)) - mean) / parameter.step
            columns.append(shared[parameter])
        out.append(Predicted(mean, np.column_stack(columns) @ _root(fit)))
        largest = np.abs(mean) if not len(largest) else np.maximum(largest, np.abs(mean))
    floor = float(np.median(comparison.sigma))
    return out, np.hypot(floor, shape * largest)


def _root(fit: Fit) -> np.ndarray:
    """Root (k, k) of the covariance of a fit's parameters."""
    size, _, H = scaled(fit)
    L = answer(np.linalg.cholesky, answer(np.linalg.inv, H))
    return np.asarray(L / size[:, None])


def _unbreakable(e: Explanation) -> str:
    """Why no experiment separates explanations of one class."""
    others = ", ".join(" with ".join(one) for one in e.alike)
    reason = next((s for s in map(signature_of, e.effects) if s), "the same response in every record")
    return f"no experiment separates {e.name} from {others}: {reason}"
