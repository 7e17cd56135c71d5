"""Case of a campaign: machine, changes, experiment and seed, with a hash of all inputs as its key."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any

from rotorsim.base import json_text as json
from rotorsim.campaign.plan.plan_file import Value

FORMAT = 1
"""Goes into every key; changes when the same case would be written another way."""


@dataclass(frozen=True)
class Case:
    """Case as sent to a worker; `machine` is the hash of the base machine's text, `set` its changed values.

    `changes` is what its record states as changed on purpose, a JSON text; a case without has the key it always had.
    """

    machine: str
    set: tuple[tuple[str, Value], ...]
    kind: str
    parameters: tuple[tuple[str, Value], ...]
    seed: int
    keep: tuple[str, ...] | None
    changes: str = ""

    @property
    def key(self) -> str:
        """Hash of the content, 32 hexadecimal digits."""
        return hashlib.sha256(f"{FORMAT} {self.text}".encode()).hexdigest()[:32]

    @property
    def text(self) -> str:
        """The case as JSON, exact to the last bit."""
        content = {name: value for name, value in vars(self).items() if name != "changes" or value}
        return json.dumps(content, sort_keys=True)

    @classmethod
    def from_text(cls, text: str) -> Case:
        """The case of its JSON."""
        content: dict[str, Any] = json.loads(text)
        pairs = {name: tuple((key, value) for key, value in content[name]) for name in ("set", "parameters")}
        keep = None if content["keep"] is None else tuple(content["keep"])
        return cls(**{**content, **pairs, "keep": keep})


def text_hash(text: str) -> str:
    """Hash of a machine's text, used as its name."""
    return hashlib.sha256(text.encode()).hexdigest()[:32]


@dataclass(frozen=True)
class Numbered:
    """Case with its number, experiment name, repeat and axis values in the campaign."""

    number: int
    experiment: str
    repeat: int
    values: dict[str, Value]
    case: Case
