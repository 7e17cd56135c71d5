"""`rotorsim live`: a virtual rig in the browser."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.base.interrupt import done, finishing
from rotorsim.commands.options import MachineName, PlantOptions, a_folder, note_compiling
from rotorsim.commands.registry import command
from rotorsim.report.browser import has_browser

if TYPE_CHECKING:
    from rotorsim.live.folder import Scene
    from rotorsim.live.records import Replay

UNVISITED = 60.0
"""Seconds after which a page that only complains is taken away if nobody came."""


@command("live", "rotorsim live dtu_gas_bearing --law my_law.json", "rs.live.serve_rig('dtu_gas_bearing')")
def live(
    machine: MachineName = "dtu_gas_bearing",
    law: Annotated[list[Path] | None, typer.Option(help="A saved controller to switch on; may be repeated.")] = None,
    *,
    settings: PlantOptions,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the machine's noise.")] = 0,
    out: Annotated[Path, typer.Option(callback=a_folder, help="Folder for scenes and records.")] = Path("live"),
    port: Annotated[int, typer.Option(help="Port on this machine; the next free one if it is taken.")] = 8750,
    keep_open: Annotated[bool, typer.Option("--keep-open", help="Run on after the last window is closed.")] = False,
    browser: Annotated[bool, typer.Option(help="Open the browser.")] = True,
) -> None:
    """The rig in the browser: change it while it runs.

    MACHINE may also be a scene (.json) or a record (.nc) that was saved here; a record is replayed.
    """
    warnings.filterwarnings("ignore", module="requests")  # the server imports it and does not use it
    if not 1 <= port <= 65535:
        raise DataError(f"--port: {port} is not a port; give one from 1 to 65535")
    scene, replay = _saved(machine)
    name: Any = scene.machine if scene else replay.machine if replay else machine

    def print_address(address: str, taken: int) -> None:
        print_where(address, port, taken, keep_open)

    own = scene is None and replay is None and Path(machine).is_file()
    if own and browser and has_browser():  # who reads the page may not see the terminal
        from rotorsim.machine import load_machine

        try:
            load_machine(machine)
        except MachineFileError as error:
            from rotorsim.live.serving import complaint, serve

            typer.echo(str(error), err=True)
            serve(complaint(machine, error.problems), port, _print_refused, browser, False, patience=UNVISITED)
            raise typer.Exit(2) from error
    plant = settings.plant(name)
    from rotorsim.live.folder import open_folder
    from rotorsim.live.laws import read_laws
    from rotorsim.live.serving import run_rig
    from rotorsim.live.settings import equip
    from rotorsim.plant import Plant

    laws = read_laws(law or [], plant.machine)
    note_compiling(Plant(equip(plant.machine)).assembly, "settle", "run")
    values = scene.values if scene else None  # of this machine, whatever --set changed of it
    rig_folder = open_folder(plant.machine, laws, seed, out, values, replay)
    finishing()  # from here on the server ends by itself, after the record under way
    run_rig(rig_folder, port, print_address, browser, keep_open)
    done()


def _print_refused(address: str, taken: int) -> None:
    typer.echo(f"nothing runs; a page with these problems is at {address}")
    typer.echo("closing the page or Ctrl-C ends it", err=True)


def print_where(address: str, wanted: int, taken: int, keep_open: bool) -> None:
    """Print the address of a page, and how it ends."""
    if taken != wanted:
        typer.echo(f"port {wanted} is in use, took {taken}", err=True)
    typer.echo(f"the page is at {address}")
    typer.echo("Ctrl-C ends it" if keep_open else "closing the page or Ctrl-C ends it", err=True)


def _saved(name: str) -> tuple[Scene | None, Replay | None]:
    """Scene or record of a file that was saved on a live rig; neither for a machine."""
    if name.endswith(".json"):
        from rotorsim.live.folder import load_scene

        return load_scene(Path(name)), None
    if name.endswith(".nc"):
        from rotorsim.live.records import Replay

        return None, Replay(Path(name))
    return None, None
