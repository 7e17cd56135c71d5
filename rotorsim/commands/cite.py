"""`rotorsim cite MACHINE|RUN`: the sources that a machine, a record, a model or a law stands on."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

import identification as idn
from rotorsim.base.errors import DataError
from rotorsim.base.references import bibtex, cited_by, references, sorted_keys
from rotorsim.commands.lazy_group import example
from rotorsim.commands.options import AsJson
from rotorsim.control import load_law
from rotorsim.machine import Machine, load_machine
from rotorsim.machine.citations import citations


@example("rotorsim cite dtu_gas_bearing --bibtex")
def cite(
    what: Annotated[
        str,
        typer.Argument(metavar="MACHINE|RUN", help="Machine, or a record .nc, model or law .json, or their folder."),
    ],
    as_bibtex: Annotated[bool, typer.Option("--bibtex", help="As BibTeX entries.")] = False,
    as_json: AsJson = False,
) -> None:
    """Print the sources of the equations and data that a machine or a result stands on."""
    parts = stands_on(what)
    keys = sorted_keys(key for cited in parts.values() for key in cited)
    if as_json:
        typer.echo(json.dumps({"parts": parts, "references": {k: references().get(k, k) for k in keys}}, indent=2))
    elif as_bibtex:
        typer.echo("\n\n".join(bibtex().get(key, f"% {key}") for key in keys))
    else:
        for part, cited in parts.items():
            typer.echo(f"{part}: {', '.join(cited)}")
        typer.echo("\n" + "\n".join(f"[{key}] {references().get(key, key)}" for key in keys))


def stands_on(what: str) -> dict[str, list[str]]:
    """Return keys of sources by part, of a machine, a file of results or all results in a folder.

    Raises DataError for a folder without results, and what the file's reader raises.
    """
    path = Path(what)
    if path.is_dir():
        return _of_folder(path)
    if path.suffix == ".nc":
        return _of_record(path)
    if path.suffix == ".json":
        return _of_json(path)
    return citations(load_machine(what))


def _of_folder(folder: Path) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for path in sorted(p for p in folder.iterdir() if p.suffix == ".nc" or _is_result(p)):
        for part, keys in stands_on(str(path)).items():
            found[part] = sorted_keys([*found.get(part, []), *keys])
    if not found:
        raise DataError(
            f"{folder}: holds no record (.nc), model or law (.json); give a machine, a file or their folder"
        )
    return found


def _is_result(path: Path) -> bool:
    """Return whether a file is a model or a law."""
    return path.suffix == ".json" and _kind(path) in ("law", "linear", "lpv")


def _kind(path: Path) -> str:
    try:
        data: Any = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        return ""
    return str(data.get("kind", "")) if isinstance(data, dict) else ""


def _of_record(path: Path) -> dict[str, list[str]]:
    """Return the sources of a record: of its machine and of its experiment."""
    attrs = idn.load(path).attrs
    if "machine" not in attrs:
        raise DataError(f"{path}: states no machine, as measured records do; give the machine that it is compared with")
    parts = citations(Machine.from_text(str(attrs["machine"])))
    experiment = str(attrs.get("experiment", ""))
    keys = _keys(f"rotorsim.experiments.{experiment}") if experiment.isidentifier() else []
    return parts | ({f"experiment {experiment}": keys} if keys else {})


def _of_json(path: Path) -> dict[str, list[str]]:
    """Return the sources of an identified model or of a law."""
    if _kind(path) == "law":
        law = load_law(path)
        design = _keys(f"rotorsim.control.designs.{law.name}")
        return {f"law {law.name}": sorted_keys([*design, *cited_by("rotorsim.control.law")])}
    model = idn.load_model(path)
    local = cited_by("identification.local")
    surfaces = cited_by("identification.lpv") if isinstance(model, idn.LpvModel) else ()
    return {"identification": sorted_keys([*local, *surfaces])}


def _keys(module: str) -> list[str]:
    """Return the keys that a module cites, none where there is no such module."""
    try:
        return list(cited_by(module))
    except ModuleNotFoundError:
        return []
