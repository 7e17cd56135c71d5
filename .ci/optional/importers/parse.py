"""Syntax of the docs' examples in other languages, by parsers that pip brings; ends with 1 where one has a fault."""

import sys
from pathlib import Path

import pymoca.parser
import tree_sitter
import tree_sitter_julia
import tree_sitter_matlab

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"
GRAMMARS = {".m": tree_sitter_matlab, ".jl": tree_sitter_julia}


def sound(file: Path) -> bool:
    """Whether a file has the syntax of its language."""
    text = file.read_text(encoding="utf-8")
    if file.suffix == ".mo":
        return pymoca.parser.parse(text) is not None
    parser = tree_sitter.Parser(tree_sitter.Language(GRAMMARS[file.suffix].language()))
    return not parser.parse(text.encode()).root_node.has_error


found = {file.name: sound(file) for file in sorted(EXAMPLES.iterdir()) if file.suffix in (".mo", *GRAMMARS)}
assert len(found) == 4, found
for name, good in found.items():
    print(f"{name}: {'parsed' if good else 'has a fault'}")
sys.exit(not all(found.values()))
