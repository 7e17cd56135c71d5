"""Atomic replacement of a set of files: all new or all old after any interruption or kill.

They are written into a temporary folder. Once it is complete it is renamed, and its content moves to the final
names. A process that is killed before leaves the older files; one that is killed during the move leaves the rest in the
complete folder, and `finish_sets` moves it in a later run.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from rotorsim.base.exchange import json_text as json
from rotorsim.base.files import COMPLETE, is_ours, left_behind, make_folder, temporary, write_error, write_json
from rotorsim.base.interrupt import Interrupt, undoing

ORDER = ".order"
"""File in the temporary folder: the names that move, and those that are removed."""


@contextmanager
def replacing_all(folder: str | Path, names: Sequence[str] = ()) -> Iterator[Path]:
    """Temporary folder whose files replace those in `folder` at the end of the block; none if the block raises.

    Parameters
    ----------
    folder : str or Path
        Is made; files there of the same names are replaced.
    names : sequence of str
        All names that the set may have. Those that are not written are removed; the last one, by which others know
        that the set is complete, is taken away first and moves last.

    Yields
    ------
    Path
        An empty folder in `folder`.

    Raises
    ------
    WriteError
        If something cannot be written; it names the file as it would have been called.
    """
    folder = Path(folder)
    part, ready = temporary(folder / "results"), temporary(folder / "results", COMPLETE)
    own = not folder.exists()
    try:
        make_folder(part)
        with undoing():
            yield part
        _note_order(part, names)
        with Interrupt():  # Ctrl-C comes too late from here on
            os.rename(part, ready)
            _move(ready)
    except OSError as error:
        shutil.rmtree(part, ignore_errors=True)
        if own:
            with suppress(OSError):
                folder.rmdir()
        if not Path(str(error.filename)).is_relative_to(part):
            raise
        raise write_error(folder / Path(str(error.filename)).relative_to(part), error) from error
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _note_order(part: Path, names: Sequence[str]) -> None:
    written = sorted(os.listdir(part), key=lambda name: names.index(name) if name in names else -1)
    write_json(part / ORDER, {"moved": written, "removed": [name for name in names if name not in written]})


def _move(ready: Path) -> None:
    """Move what is left of a complete set, and remove its folder."""
    folder, order = ready.parent, json.loads((ready / ORDER).read_text(encoding="utf-8"))
    if any(Path(name).name != name for name in (*order["moved"], *order["removed"])):
        raise ValueError(f"{ready}: names files elsewhere")
    last = order["moved"][-1:]
    for name in [*(name for name in last if (ready / name).is_file()), *order["removed"]]:
        (folder / name).unlink(missing_ok=True)
    for name in order["moved"]:
        if (ready / name).exists():
            os.replace(ready / name, folder / name)
    shutil.rmtree(ready, ignore_errors=True)


def finish_sets(folder: Path) -> None:
    """Complete the replacement of file sets whose process on this computer was killed."""
    for ready in left_behind(folder, COMPLETE):
        with suppress(OSError, ValueError, KeyError, TypeError, AttributeError):
            if is_ours(ready):  # anybody can make a folder like it where all may write
                _move(ready)
