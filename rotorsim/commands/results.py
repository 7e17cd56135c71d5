"""Output folders and files of the commands: checks and locks before anything is computed.

A command names its files. One that is there already is replaced with --force only, a name that another process writes
not even then, and the folder of a campaign belongs to the campaign.
"""

import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from html import unescape
from itertools import chain
from os.path import lexists
from pathlib import Path
from typing import Any

from rotorsim.base import files as disk
from rotorsim.base.errors import DataError
from rotorsim.base.input_files import parse_json

CAMPAIGN = "store.json"
"""File by which the folder of a campaign is known."""
INSTANT = 0.3
"""Time [s] for which a lock is waited for: another process may look just now whether it is in use."""
STUDY = "study-inputs.json"
"""File by which the folder of a study is known; it holds what the study follows from."""
PARTS_OF_STUDY = ("stages", "grid")
"""Folders by which that of a study is known that was begun before there was such a file."""
TITLE = 5000
"""Characters of a page in which its title stands."""
NAME = 100
"""Characters of a file's name in that of its lock, which must not become too long itself."""


@contextmanager
def results(out: Path | None, default: str, names: Sequence[str], force: bool | None = False) -> Iterator[Path]:
    """Output folder, locked for the files `names` until the block ends; removed if new and empty.

    It is `out`; without, `default` with --force, else the first of default, default-2, ... that is not there yet.
    `force` None is a command without that option, whose names may be folders. Raises DataError if something is there
    that would be replaced, is being written, or belongs to a campaign; WriteError if the folder cannot be made or
    written.
    """
    with ExitStack() as stack:
        folder = stack.enter_context(_folder(out, default, force))
        refuse_campaign(folder)
        _refuse(folder, STUDY, "study")
        stack.enter_context(files(*(folder / name for name in names), force=force))
        replaced = [text for name in names if (text := _of_another(folder, name, names))]
        yield folder
        for text in replaced:
            print(text, file=sys.stderr)


def _of_another(folder: Path, name: str, names: Sequence[str]) -> str:
    """Sentence about a page that another command wrote: no other of this command's files is there with it."""
    page = folder / name
    if page.suffix != ".html" or not page.is_file() or any((folder / one).exists() for one in names if one != name):
        return ""
    with page.open(encoding="utf-8", errors="replace") as file:
        title = re.search(r"<title>(.*?)</title>", file.read(TITLE), re.DOTALL)
    return f"{page}: replaced that of another command, '{unescape(title[1])}'" if title else ""


def refuse_campaign(folder: Path) -> None:
    """Raise DataError if the folder is a campaign's store."""
    _refuse(folder, CAMPAIGN, "campaign")


def _refuse(folder: Path, file: str, name: str) -> None:
    if lexists(folder / file):
        raise DataError(f"--out: {folder} holds a {name}; name another folder")


@contextmanager
def study(folder: Path, inputs: Mapping[str, Any]) -> Iterator[None]:
    """Folder of a study, locked until the block ends and reserved for the same study.

    Parameters
    ----------
    folder : Path
        Is made.
    inputs : mapping
        By name what the study follows from, as JSON takes it: its kind, hash of the machine, ...

    Raises
    ------
    DataError
        If the folder is of a study of other inputs, of a campaign, or holds something else; if another process runs
        the study.
    WriteError
        If the folder cannot be made or written.
    """
    refuse_campaign(folder)
    path = folder / STUDY
    begun_earlier = any((folder / name).is_dir() for name in PARTS_OF_STUDY)
    if not lexists(path) and _has_something(folder) and not begun_earlier:
        raise DataError(f"--out: {folder} is there already and is not a study; name another folder")
    with _folder(folder, "", False), _held(path, "--out"):
        _same_study(path, inputs)
        disk.write_json(path, dict(inputs))
        try:
            yield
        finally:
            if not _has_something(folder, STUDY):
                path.unlink(missing_ok=True)


def _has_something(folder: Path, but: str = "") -> bool:
    """True if there is more in a folder than one file, temporary files and locks."""
    return folder.exists() and any(not one.name.startswith(".") and one.name != but for one in folder.iterdir())


def _same_study(path: Path, inputs: Mapping[str, Any]) -> None:
    """Raise DataError if the folder is that of a study of other inputs."""
    if not path.exists():
        return
    try:
        known = dict(parse_json(path.read_text(encoding="utf-8-sig")))
    except (ValueError, TypeError) as error:
        raise DataError(f"{path}: is damaged; name another folder") from error
    wrong = [name for name in inputs if known.get(name) != inputs[name]]
    if wrong:
        raise DataError(f"--out: {path.parent} holds a study of another {' and '.join(wrong)}; name another folder")


@contextmanager
def files(*paths: Path, force: bool | None = False, another: str = "--out") -> Iterator[None]:
    """Files of one existing folder, locked until the block ends; see `results`. `another` names the argument."""
    for folder in {path.parent for path in paths}:
        tidy(folder)
    refuse_replacing(paths, force, another)
    with ExitStack() as stack:
        for path in sorted(paths):
            stack.enter_context(_held(path, another))
        refuse_replacing(paths, force, another)  # what the holder before has written
        yield


def refuse_replacing(paths: Iterable[Path], force: bool | None, another: str = "--out") -> None:
    """Raise DataError for files that are there, unless they are to be replaced; see `results` and `files`."""
    there = [path for path in paths if lexists(path)]
    for path in there:
        if force is not None and path.is_dir():
            raise DataError(f"{path}: is a folder; choose another {another}")
    if there and not force:
        several = f"{there[0].parent}: {' and '.join(path.name for path in there)} are"
        what = f"{there[0]}: is" if len(there) == 1 else several
        way_out = "" if force is None else " or add --force"
        raise DataError(f"{what} there already; choose another {another}{way_out}")


@contextmanager
def _held(path: Path, another: str) -> Iterator[None]:
    lock = disk.Lock(path.with_name(f".{path.name[:NAME]}.lock"), disk.about_us(), wait=INSTANT, remove=True)
    try:
        lock.__enter__()
    except disk.BusyError as error:
        raise DataError(
            f"{path}: {error.strerror} is writing it; wait for its end or choose another {another}"
        ) from error
    except OSError as error:
        raise disk.write_error(path, error) from error
    try:
        yield
    finally:
        lock.__exit__(None, None, None)


@contextmanager
def _folder(out: Path | None, default: str, force: bool | None) -> Iterator[Path]:
    folder = out or (Path(default) if force else None)
    missing = [] if folder is None else [path for path in (folder, *folder.parents) if not path.exists()]
    if folder is None:
        folder = _fresh(Path(default))
        missing = [folder]
    try:
        name_recovered(disk.make_folder(folder))
        yield folder
    finally:
        with suppress(OSError):  # not empty
            for path in missing:
                path.rmdir()


def name_recovered(folder: Path) -> None:
    """Recover the records of killed runs in this folder and print their names; remove their other files."""
    tidy(folder)
    if not disk.left_behind(folder, disk.GROWING):
        return
    from rotorsim.experiments.recording import duration, recover  # brings the plant with it

    for path, _ in recover(folder):
        print(f"a run into {folder} was killed: its {duration(path):.1f} s are kept in {path}", file=sys.stderr)


def tidy(folder: Path) -> None:
    """Complete interrupted file moves of killed processes in a folder; remove their temporary files and locks."""
    disk.finish_sets(folder)
    disk.sweep(folder)
    disk.sweep_locks(folder)


def _fresh(base: Path) -> Path:
    """The first of base, base-2, base-3 ... that can be made: another process may make the same one just now."""
    for folder in chain((base,), (base.with_name(f"{base.name}-{n}") for n in range(2, 10**6))):
        try:
            folder.mkdir()
            return folder
        except FileExistsError:
            name_recovered(folder)
        except OSError as error:
            raise disk.write_error(folder, error) from error
    raise DataError(f"{base}: a million results are there; choose another --out")
