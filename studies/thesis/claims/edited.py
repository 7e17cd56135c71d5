"""Rules that a study began with, kept in its folder, and what was edited in them since, which reports state."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorsim.base.errors import DataError
from rotorsim.base.files import write_json
from rotorsim.base.input_files import parse_json
from studies.thesis.claims.rules import AMENDED, FIRST, text

if TYPE_CHECKING:
    from rotorsim.report.page import Block

KEPT = "rules.json"
"""File in a study's folder that holds the rules of its first run."""
RESULTS = ("report.html", "study.json", "control.json", "claims.md")
"""Files that a study has when it has been judged."""
LOST = "lost"
"""Entry of rules that were kept anew, because those of the first run were not there any more."""
JUDGING = ("thesis", "met", "near", "kind", "one_sided", "old")
"""Parts of a figure's rule that decide its verdict or what is compared."""


def judging() -> dict[str, Any]:
    """All that verdicts follow from, by 'points.NAME', 'I2.figure' and, as amended or added, 'I7.figure (amended)'."""
    kept: dict[str, Any] = {}
    for name, heads in ((FIRST, {"claims": ""}), (AMENDED, {"amended": " (amended)", "added": " (added)"})):
        table = tomllib.loads(text(name))
        kept |= {f"points.{point}": one["at"] for point, one in table["points"].items()}
        kept |= {f"as_run.{path}": value for path, value in table.get("as_run", {}).get("values", {}).items()}
        kept |= {f"machines.{machine}": one["claims"] for machine, one in table.get("machines", {}).items()}
        for head, word in heads.items():
            for number, claim in table[head].items():
                kept |= {f"{number}.{figure}{word}": rule for figure, rule in _judging(claim).items()}
    return kept


def _judging(claim: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """Entries that decide the verdicts on a claim's figures, by name."""
    shared = {key: claim[key] for key in JUDGING if key in claim}
    return {
        figure.get("name") or figure["old"]: {
            key: str(value) for key, value in (shared | figure).items() if key in JUDGING
        }
        for figure in claim["figures"]
    }


def edited(folder: Path, rules: Mapping[str, Any] | None = None) -> list[str]:
    """A sentence for each rule that was edited since the first run in `folder`; the first keeps the rules there.

    Where a report is there and the rules it was judged by are not, that is a sentence too, in this run and all later.

    Parameters
    ----------
    folder : Path
        Folder of the study.
    rules : mapping
        What verdicts follow from, `judging()` if not given.

    Raises
    ------
    DataError
        If the file of the first run's rules cannot be read: without it nobody knows what was judged by.
    WriteError
        If it cannot be written.

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> folder = Path(mkdtemp())
    >>> edited(folder)
    []
    """
    now, path = parse_json(json.dumps(judging() if rules is None else dict(rules))), folder / KEPT
    if not path.exists():
        lost = _lost(folder)
        write_json(path, now | ({LOST: lost[0]} if lost else {}))
        return lost
    try:
        before = parse_json(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError) as error:
        raise DataError(
            f"{path}: cannot be read ({error}); restore it, or study in another folder", argument="folder", value=path
        ) from error
    if not isinstance(before, dict):
        raise DataError(
            f"{path}: does not hold rules; restore it, or study in another folder", argument="folder", value=path
        )
    lost = [str(before.pop(LOST))] if LOST in before else []
    return lost + [
        _sentence(key, before.get(key), now.get(key))
        for key in sorted({*before, *now})
        if before.get(key) != now.get(key)
    ]


def _lost(folder: Path) -> list[str]:
    """A sentence where an earlier run left results in the folder and its rules are gone."""
    found = [name for name in RESULTS if (folder / name).exists()]
    if not found:
        return []
    return [f"{KEPT}: was not there, though {found[0]} of an earlier run was: its rules are not known and may differ"]


def _sentence(key: str, before: Any, now: Any) -> str:
    return f"{key}: {_words(before)} at the first run, {_words(now)} now"


def _words(rule: Any) -> str:
    if rule is None:
        return "not there"
    return ", ".join(f"{key} {value}" for key, value in rule.items()) if isinstance(rule, dict) else str(rule)


def edited_block(sentences: list[str]) -> list[Block]:
    """The section of a report that states the edits; none without any."""
    from rotorsim.report.page import Block

    if not sentences:
        return []
    words = (
        "Verdicts below are by the rules as they are now; since the first run of this study these were edited or lost."
    )
    return [Block("Rules edited after a run", words, ("rule",), [(one,) for one in sentences])]


def edited_markdown(sentences: list[str]) -> str:
    """The same for Markdown and text; empty without any."""
    if not sentences:
        return ""
    return "\n".join(
        ["Rules edited or lost after the first run of this study:", "", *(f"- {one}" for one in sentences), "", ""]
    )
