"""`rotorsim cite MACHINE|RUN`: the sources that a machine, a record, a model or a law stands on."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from rotorsim.analysis import cite as cited
from rotorsim.base.references import bibtex, references, sorted_keys
from rotorsim.commands.completion import machines
from rotorsim.commands.lazy_group import example
from rotorsim.commands.options import AsJson


@example("rotorsim cite dtu_gas_bearing --bibtex", "rs.analysis.cite('dtu_gas_bearing')")
def cite(
    what: Annotated[
        str,
        typer.Argument(
            metavar="MACHINE|RUN",
            help="Machine, or a record .nc, model or law .json or .mat, or their folder.",
            autocompletion=machines,
        ),
    ],
    as_bibtex: Annotated[bool, typer.Option("--bibtex", help="As BibTeX entries.")] = False,
    as_json: AsJson = False,
) -> None:
    """Print the sources that a machine or a result stands on."""
    parts = cited(what)
    keys = sorted_keys(key for part in parts.values() for key in part)
    if as_json:
        typer.echo(json.dumps({"parts": parts, "references": {k: references().get(k, k) for k in keys}}, indent=2))
    elif as_bibtex:
        typer.echo("\n\n".join(bibtex().get(key, f"% {key}") for key in keys))
    else:
        for part, own in parts.items():
            typer.echo(f"{part}: {', '.join(own)}")
        typer.echo("\n" + "\n".join(f"[{key}] {references().get(key, key)}" for key in keys))
