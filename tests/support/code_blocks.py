"""Code blocks of README, CONTRIBUTING and the pages of the site."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
GENERATED = {"api.md", "bibliography.md", "changes.md", "gallery.md"}
"""Pages that follow from the sources."""
FENCE = re.compile(r"^```([^\n`]*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
INDENTED = re.compile(r"(?<=\n\n)((?: {4}[^\n]*\n)+)(?=\n)")


@dataclass(frozen=True)
class CodeBlock:
    """A block of code: page, line on it, language ('' without one, 'indented' for four spaces), text."""

    page: str
    line: int
    language: str
    text: str


def pages() -> list[Path]:
    """Return every page that people wrote."""
    site = [p for p in sorted((ROOT / "docs").glob("*.md")) if p.name not in GENERATED]
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *site, *sorted((ROOT / "docs" / "rk4").glob("*.md"))]


def blocks() -> list[CodeBlock]:
    """Return every block of every page, in order."""
    return [block for page in pages() for block in blocks_of(page)]


def blocks_of(path: Path) -> Iterator[CodeBlock]:
    """Yield the blocks of a page, fenced ones first."""
    text, page = path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix()
    for found in FENCE.finditer(text):
        yield CodeBlock(page, text.count("\n", 0, found.start()) + 1, found[1].strip(), found[2])
    rest = FENCE.sub(lambda found: "\n" * found[0].count("\n"), text)
    for found in INDENTED.finditer(rest):
        yield CodeBlock(page, rest.count("\n", 0, found.start()) + 1, "indented", found[1])


def command_lines(block: CodeBlock) -> list[str]:
    """Return the commands of a block of shell lines, comments removed."""
    lines = [line.strip().removeprefix("$ ") for line in block.text.splitlines()]
    if block.language == "console":
        lines = [line.strip()[2:] for line in block.text.splitlines() if line.strip().startswith("$ ")]
    return [re.sub(r"\s{2,}#.*$", "", line) for line in lines if line]
