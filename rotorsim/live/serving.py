"""The live rig of a machine, served to the browser from one call."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rotorsim.live.rig.desk import Desk
from rotorsim.live.rig.laws import read_laws
from rotorsim.live.rig.records import Replay
from rotorsim.live.rig.rig import Rig
from rotorsim.live.rig.runner import Runner
from rotorsim.live.server.server import run_desk
from rotorsim.machine import Machine, load_machine


def print_address(address: str, taken: int) -> None:
    """Print where the page is."""
    print(f"the page is at {address}; closing it or Ctrl-C ends it")


def serve_rig(
    machine: Machine | str | Path,
    laws: Sequence[Path] | Mapping[str, Any] = (),
    seed: int = 0,
    out: str | Path = "live",
    port: int = 8750,
    browser: bool = True,
    keep_open: bool = False,
    values: Mapping[str, Any] | None = None,
    record: Replay | str | Path | None = None,
    announce: Callable[[str, int], None] = print_address,
) -> None:
    """Run a machine in real time with its page in the browser, until the page is closed or Ctrl-C.

    Parameters
    ----------
    machine : Machine, name or path
    laws : sequence of path, or mapping
        Files of control laws to switch on, or what `read_laws` returns.
    seed : int
        Of the sensors' noise.
    out : path
        Folder of scenes and records.
    port : int
        Port on this computer; the next free one if it is taken.
    browser, keep_open : bool
        Whether to open the browser, and to run on after the last window is closed.
    values : mapping, optional
        Settings of a scene.
    record : path, optional
        Record to replay, or its `Replay`.
    announce : callable
        Given the address and the port of the page.

    Raises
    ------
    DataError, LawError

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.live.serve_rig("dtu_gas_bearing")  # doctest: +SKIP
    """
    loaded = machine if isinstance(machine, Machine) else load_machine(machine)
    known = laws if isinstance(laws, Mapping) else read_laws([Path(path) for path in laws], loaded)
    played = record if isinstance(record, Replay | None) else Replay(Path(record))
    run_desk(make_desk(loaded, known, seed, Path(out), values, played), port, announce, browser, keep_open)


def make_desk(
    machine: Machine, laws: Mapping[str, Any], seed: int, out: Path, values: Mapping[str, Any] | None,
    record: Replay | None,
) -> Desk:  # fmt: skip
    """Desk of a machine with the settings of a scene, or replaying a record."""
    desk = Desk(Runner(Rig(machine, laws, seed)), machine, out)
    if values is not None:
        desk.arrange(dict(values))
    if record is not None:
        desk.runner.play(record)
    return desk
