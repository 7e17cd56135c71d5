"""Sources of the equations: BibTeX entries by key, the line that shows one, and the keys that modules cite.

A module states its sources by a line of its docstring, ``Cites: friswell_2010, thesis.``; an effect by its `cites`.
"""

import ast
import re
from collections.abc import Iterable
from functools import cache, lru_cache
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

_ENTRY = re.compile(r"^@(\w+)\{(\w+),\n(.*?)^\}", re.MULTILINE | re.DOTALL)
_FIELD = re.compile(r"^  (\w+) = \{(.*)\},$", re.MULTILINE)
_CITES = re.compile(r"^Cites: ([\w, \n]+)\.", re.MULTILINE)
_PLACES = ("journal", "booktitle", "publisher", "institution", "school", "howpublished")


@lru_cache(maxsize=1)
def bibtex() -> dict[str, str]:
    """Return every entry as BibTeX, by key."""
    text = (files("rotorsim.base") / "references.bib").read_text(encoding="utf-8")
    return {found[2]: found[0] for found in _ENTRY.finditer(text)}


@lru_cache(maxsize=1)
def entries() -> dict[str, dict[str, str]]:
    """Return the fields of every entry, by key."""
    return {key: dict(_FIELD.findall(text)) for key, text in bibtex().items()}


@lru_cache(maxsize=1)
def references() -> dict[str, str]:
    """Return every reference as one line of text, by key."""
    return {key: shown(entry) for key, entry in entries().items()}


def shown(entry: dict[str, str]) -> str:
    """Return an entry as one line: authors (year), title, place."""
    authors = ", ".join(_name(one) for one in entry["author"].split(" and "))
    head = f"{authors} ({entry['year']})" if "year" in entry else authors
    place = next((entry[field] for field in _PLACES if field in entry), "")
    place = " ".join(filter(None, (place, entry.get("volume"), entry.get("number"))))
    place = ", ".join(filter(None, (place, entry.get("pages"))))
    doi = f"doi:{entry['doi']}" if "doi" in entry else ""
    parts = (head, entry.get("title"), place, entry.get("note"), doi)
    return ", ".join(filter(None, parts)).replace("\\&", "&")


def _name(author: str) -> str:
    """Return 'Last, F. M.' as 'F. M. Last'."""
    last, _, first = author.strip("{}").partition(", ")
    return f"{first} {last}".strip()


@cache
def cited_by(module: str) -> tuple[str, ...]:
    """Return the keys that a module, or a package with all in it, cites in docstrings; read from its sources.

    Raises ModuleNotFoundError for a name that is not a module.
    """
    spec = find_spec(module)
    if spec is None or spec.origin is None:
        raise ModuleNotFoundError(f"{module}: there is no such module")
    paths = sorted(Path(spec.origin).parent.rglob("*.py")) if spec.submodule_search_locations else [Path(spec.origin)]
    return tuple(sorted({key for path in paths for key in keys_of(path.read_text(encoding="utf-8"))}))


def keys_of(source: str) -> set[str]:
    """Return the keys that the docstrings of a source file cite."""
    tree = ast.parse(source)
    nodes = (ast.Module, ast.ClassDef, ast.FunctionDef)
    texts = [ast.get_docstring(node) or "" for node in ast.walk(tree) if isinstance(node, nodes)]
    return {key.strip() for text in texts for found in _CITES.findall(text) for key in found.split(",")}


def sorted_keys(keys: Iterable[str]) -> list[str]:
    """Return keys without repeats, the thesis first."""
    return sorted(set(keys), key=lambda key: (key != "thesis", key))
