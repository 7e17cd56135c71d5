"""`rotorsim identify --advice` and `--compare`: what records suggest before a fit, and models held against records."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import typer

from identification import Prefilter, advise, compare_models, load_model, open_pair
from identification.campaign import NO_EXCITATION
from identification.errors import UnfitError
from identification.local.models import plain
from rotorsim.base.errors import DataError
from rotorsim.base.sentences import told_apart
from rotorsim.study.identify_records import sources_of

Made = Callable[[Any, Any], Any]


def print_advice(paths: Sequence[Path], settings: Prefilter, mapping: Any, as_json: bool) -> None:
    """Advice about each record that excites."""
    _print(paths, mapping, as_json, lambda record, steady: advise(record, steady, settings))


def print_comparison(
    paths: Sequence[Path], models: Sequence[Path], settings: Prefilter, mapping: Any, as_json: bool
) -> None:
    """Model files held against each record that excites."""
    names = [path.stem for path in models]
    if len(set(names)) < len(names):
        names = [str(path) for path in models]
    if len(set(names)) < len(names):
        raise DataError(f"--compare: {models[0]} or another model is given twice; give different models")
    loaded = {name: load_model(path) for name, path in zip(names, models, strict=True)}
    _print(paths, mapping, as_json, lambda record, steady: compare_models(loaded, record, steady, settings))


def _print(paths: Sequence[Path], mapping: Any, as_json: bool, make: Made) -> None:
    sources = sources_of(paths, mapping)
    if not sources:
        raise UnfitError(f"{paths[0]}: {NO_EXCITATION}")
    names = told_apart([source.path for source in sources])
    found = [(name, make(*open_pair(source, mapping))) for name, source in zip(names, sources, strict=True)]
    if as_json:
        typer.echo(json.dumps({"records": [{"record": name, **_plain(one)} for name, one in found]}, indent=2))
        return
    for name, one in found:
        typer.echo(f"{name}\n{one.report()}")


def _plain(value: Any) -> dict[str, Any]:
    """Fields of a dataclass, of those in it too, for JSON."""
    content = {field.name: getattr(value, field.name) for field in fields(value)}
    rows = content.get("rows")
    return plain(content | ({} if rows is None else {"rows": [_plain(row) for row in rows]}))
