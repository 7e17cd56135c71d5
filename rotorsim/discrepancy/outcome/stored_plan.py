"""Plan of the next experiment as it was stored with a diagnosis: its numbers, texts and the plan of a campaign."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class StoredPlan:
    """A plan that was read from a file; it has what pages and files show of a plan."""

    content: dict[str, Any]
    toml: str = ""

    @property
    def sentence(self) -> str:
        """What to do next."""
        return str(self.content.get("sentence", ""))

    def as_dict(self) -> dict[str, Any]:
        """As plain numbers and text."""
        return dict(self.content)

    def campaign(self, *_: Any) -> str:
        """The best experiment as the plan of a campaign, of the machine that it was written for."""
        return self.toml
