"""Explanation of a disagreement with its probability."""

from __future__ import annotations

from dataclasses import dataclass

BEYOND = "something that is not in the catalogue"
NOTHING = "nothing is missing"
NOT_IN_CATALOGUE = "not in the catalogue"
"""Name of all explanations together that hold something which is not in the catalogue."""
SURE = 0.95
"""Probability from which an explanation is settled."""
MOST_LISTED = 6
"""Effects that a sentence lists at most."""
LEAST_SHOWN = 1e-3
"""Probability below which an explanation is not listed."""


@dataclass(frozen=True)
class Explanation:
    """Set of effects that may be missing, with its probability.

    effects : keys of forms, none where nothing of the catalogue is missing
    beyond : whether something that is not in the catalogue is missing as well
    alike : explanations that no record distinguishes from it; their probabilities are in this one
    evidence : logarithm, above that of nothing missing
    error : relative error of the model's form that it leaves, most probable value
    shown : whether the records narrow its size down; otherwise it cannot be distinguished from nothing
    refitted : whether the plant was fitted with it; otherwise by the sensitivities alone
    unseen : explanations that are counted with it because these records do not show them; other records may
    """

    effects: tuple[str, ...]
    beyond: bool
    evidence: float
    error: float
    refitted: bool
    probability: float = 0.0
    alike: tuple[tuple[str, ...], ...] = ()
    shown: bool = True
    unseen: tuple[Explanation, ...] = ()

    @property
    def shown_probability(self) -> float:
        """Probability without that of the effects that the records do not show."""
        return self.probability - sum(e.probability for e in self.unseen)

    @property
    def unseen_sentence(self) -> str:
        """Sentence on the effects that the records do not show, with their probability; empty for none."""
        if not self.unseen:
            return ""
        names = [e.name for e in self.unseen]
        more = f" and {len(names) - MOST_LISTED} others" if len(names) > MOST_LISTED else ""
        share = shown_share(self.probability - self.shown_probability)
        return f"{share} of it is of effects that these records do not show: {', '.join(names[:MOST_LISTED])}{more}"

    @property
    def name(self) -> str:
        """Name as text."""
        if not self.effects:
            return BEYOND if self.beyond else NOTHING
        return " with ".join(self.effects) + (f" and {BEYOND}" if self.beyond else "")


def shown_share(probability: float) -> str:
    """Probability in percent, next to certainty by the bound that it exceeds."""
    if probability > 0.999:
        return "> 99.9 %"
    return f"{100 * probability:.0f} %" if 0.01 <= probability < 0.99 else f"{100 * probability:.1f} %"
