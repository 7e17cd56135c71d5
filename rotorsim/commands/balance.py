"""`rotorsim balance MACHINE RECORDS`: unbalance from measured 1X vectors, and the weights against it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from rotorsim.base.files import write_json, write_text
from rotorsim.commands.options import AsJson, GivenMachine, PageOptions, WithReport, a_folder, print_table
from rotorsim.commands.registry import command
from rotorsim.commands.results import results


@command(
    "balance",
    "rotorsim balance bently_rk4 docs/rk4/open.csv docs/rk4/unlabelled.csv --mapping docs/rk4/balance.toml",
    "rs.balance.assess('bently_rk4', rs.balance.read_conditions(records, 'balance.toml'))",
)
def balance(
    machine: GivenMachine,
    records: Annotated[list[Path], typer.Argument(metavar="RECORDS", help="CSV files of 1X vectors, a row a record.")],
    mapping: Annotated[Path, typer.Option(help="TOML file: which columns are probes, planes and known unbalances.")],
    correct: Annotated[str, typer.Option(help="Condition to balance; default the first without added unbalance.")] = "",
    out: Annotated[Path | None, typer.Option(callback=a_folder, help="Folder; default a new folder 'balance'.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace results that are in the folder.")] = False,
    report: WithReport = True,
    *,
    page: PageOptions,
    as_json: AsJson = False,
) -> None:
    """Find unbalance and correction weights from 1X vectors.

    By influence coefficients and by the machine's model, side by side.
    """
    page.check(report)
    from rotorsim.machine import load_machine

    model = load_machine(machine)
    from rotorsim.balance import assess, read_conditions
    from rotorsim.balance.unbalance import result_rows, summary, unbalance_csv

    found = assess(model, read_conditions(records, mapping), correct)
    names = ["balance.json", "unbalance.csv", *(["report.html"] if report else [])]
    with results(out, "balance", names, force) as folder:
        page.begin(folder / "report.html", force)
        write_json(folder / "balance.json", summary(found))
        write_text(folder / "unbalance.csv", unbalance_csv(found))
        files = {"results": str(folder / "balance.json"), "unbalance": str(folder / "unbalance.csv")}
        if report:
            from rotorsim.report.balance import write_balance

            files["report"] = str(write_balance(found, folder / "report.html"))
            files |= page.finish(files["report"])
    if as_json:
        typer.echo(json.dumps({**summary(found), "files": files}, indent=2))
    else:
        print_table(result_rows(found), files)
