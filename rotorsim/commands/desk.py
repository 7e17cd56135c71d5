"""`rotorsim desk`: a rotor designed in the browser."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Annotated

import typer

from rotorsim.base.errors import DataError
from rotorsim.base.interrupt import done, finishing
from rotorsim.commands import options
from rotorsim.commands.live import print_where
from rotorsim.commands.registry import command


@command("desk", "rotorsim desk my_machine.toml", "rs.desk.serve_desk('my_machine.toml')")
def desk(
    machine: Annotated[
        str | None,
        typer.Argument(
            help="Machine file, which need not be there yet, or shipped machine.", autocompletion=options.machines
        ),
    ] = None,
    folder: Annotated[Path, typer.Option(help="Folder of new files.")] = Path(),
    port: Annotated[int, typer.Option(help="Port on this machine; the next free one if it is taken.")] = 8760,
    keep_open: Annotated[bool, typer.Option("--keep-open", help="Run on after the last window is closed.")] = False,
    browser: Annotated[bool, typer.Option(help="Open the browser.")] = True,
) -> None:
    """Design a rotor in the browser, answered while you type.

    Without MACHINE the page offers beginnings. Edits are kept next to the file until they are saved.
    """
    warnings.filterwarnings("ignore", module="requests")  # the server imports it and does not use it
    if not 1 <= port <= 65535:
        raise DataError(f"--port: {port} is not a port; give one from 1 to 65535")
    if not folder.is_dir():
        raise DataError(f"--folder {folder}: is not a folder; make it, or give another")
    from rotorsim.desk.server import serve_desk

    finishing()
    serve_desk(machine, folder, port, browser, keep_open, lambda at, taken: print_where(at, port, taken, keep_open))
    done()
