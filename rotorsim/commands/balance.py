"""`rotorsim balance MACHINE RECORDS`: unbalance from measured 1X vectors, and the weights against it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorsim.base.files import write_json, write_text
from rotorsim.commands.options import GivenMachine, ResultOptions
from rotorsim.commands.registry import command


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
    *,
    result: ResultOptions,
) -> None:
    """Find unbalance and correction weights from 1X vectors.

    By influence coefficients and by the machine's model, side by side.
    """
    result.check()
    from rotorsim.machine import load_machine

    model = load_machine(machine)
    from rotorsim.balance import assess, read_conditions
    from rotorsim.balance.unbalance import result_rows, summary, unbalance_csv

    found = assess(model, read_conditions(records, mapping), correct)
    with result.folder("balance", "balance.json", "unbalance.csv") as folder:
        write_json(folder.add("results", "balance.json"), summary(found))
        write_text(folder.add("unbalance", "unbalance.csv"), unbalance_csv(found))
        if result.report:
            from rotorsim.report.balance import write_balance

            folder.write_page(lambda path: write_balance(found, path))
    result.show(summary(found), result_rows(found), folder.files)
