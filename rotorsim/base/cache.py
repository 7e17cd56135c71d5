"""Cache of results in files, each named by a hash of all that it follows from, the sources that compute it included.

A file that is missing, damaged or of an earlier version is no error: the result is computed again.

What lies in the cache is executed: compiled kernels, generated modules, objects for units. So it lies where nobody but
this user can write, nor replace a folder on the way there (`private_folder`), or else in a new folder of this process.
"""

import errno
import hashlib
import json
import os
import shutil
import stat
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs

from rotorsim.base.errors import NoCache
from rotorsim.base.files import make_folder, write_bytes, write_error, write_json
from rotorsim.base.interrupt import at_end

ROOT = Path(__file__).resolve().parents[2]
"""Folder of the packages."""
PLANT = (
    "reynolds", "fe_shaft", "identification",
    *(f"rotorsim/{room}" for room in ("base", "signals", "effects", "machine", "plant")),
)  # fmt: skip
"""Sources that a simulation of the plant follows from, as paths below ROOT."""
RUNS = (*PLANT, "rotorsim/experiments", "rotorsim/control")
"""Sources that a simulated record follows from."""

OTHERS = stat.S_IWGRP | stat.S_IWOTH
"""Mode bits that let other users write."""


class OpenFolderError(OSError):
    """Folder in which another user can put files, or which another user can replace; its text states why."""


def in_cache(name: str, temporary: bool = False) -> Path:
    """A writable folder of this name in the user's cache, which nobody else can enter.

    Where the cache is not safe or takes nothing, and with `temporary`, it lies among temporary files: in a folder of
    this user that is kept, or, if that is not safe either, in a new one. Raises WriteError if there is none at all.
    """
    root = Path(os.environ.get("ROTORSIM_CACHE_DIR") or platformdirs.user_cache_dir("rotorsim"))
    usual = Path(tempfile.gettempdir()) / f"rotorsim-{os.getuid() if hasattr(os, 'getuid') else 'cache'}"
    reasons = []
    for folder in (usual,) if temporary else (root, usual):
        try:
            if folder == usual and usual.is_symlink():
                raise OpenFolderError(errno.EPERM, "is a link", str(usual))
            return _entered(private_folder(folder) / name)
        except OSError as error:
            reasons.append(f"{folder}: {_reason(error)}")
    return _entered(_new_root("; ".join(reasons)) / name)


def _entered(folder: Path) -> Path:
    """A folder of a private one, closed to others whatever the umask opens in it; raises OSError if not writable."""
    found = private_folder(folder)
    if os.name == "posix" and stat.S_IMODE(found.stat().st_mode) & 0o077:
        found.chmod(0o700)
    with tempfile.TemporaryFile(dir=found):
        return found


_process_roots: list[Path] = []
"""Cache folder of this process alone, where it needed one."""


def _new_root(reasons: str) -> Path:
    """A new folder for this process and those that it starts, removed at its end."""
    if _process_roots:
        return _process_roots[0]
    try:
        root = Path(os.path.realpath(tempfile.mkdtemp(prefix="rotorsim-")))
    except OSError as error:
        raise write_error(Path(tempfile.gettempdir()), error) from error
    _process_roots.append(root)
    os.environ["ROTORSIM_CACHE_DIR"] = str(root)
    owner = os.getpid()
    at_end(lambda: shutil.rmtree(root, ignore_errors=True) if os.getpid() == owner else None)
    way = "set ROTORSIM_CACHE_DIR to a folder that only you can write to"
    warnings.warn(f"cache: no folder is safe ({reasons}); kernels are kept for this run alone; {way}", NoCache, 2)
    return root


def private_folder(path: Path) -> Path:
    """Real path of a folder, made with its parents where it is missing, that no other user can fill or replace.

    The folder and all above it belong to this user or to the system's administrator. Others may write to none of them;
    above it they may where a sticky bit keeps what is not theirs, as in the folder for temporary files. Raises
    OpenFolderError if another user could put files there, OSError if it cannot be made.
    """
    absolute = Path(os.path.abspath(path))
    for missing in [folder for folder in (absolute, *absolute.parents) if not folder.exists()][::-1]:
        with suppress(FileExistsError):
            missing.mkdir(mode=0o700)
    real = Path(os.path.realpath(absolute))
    if not real.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, "is not a folder", str(real))
    if hasattr(os, "geteuid"):
        trusted = {os.geteuid(), 0, os.stat("/").st_uid}
        for folder in (real, *real.parents):
            _check_owner(folder, trusted, folder == real)
    return real


def _check_owner(folder: Path, trusted: set[int], last: bool) -> None:
    found = os.lstat(folder)
    if found.st_uid not in trusted:
        raise OpenFolderError(errno.EPERM, f"belongs to another user ({found.st_uid})", str(folder))
    if found.st_mode & OTHERS and (last or not found.st_mode & stat.S_ISVTX):
        mode = stat.S_IMODE(found.st_mode)
        raise OpenFolderError(errno.EPERM, f"others can write to it (mode {mode:o})", str(folder))


@contextmanager
def kernels_in(folder: Path, config: Any) -> Iterator[None]:
    """Point the cache of numba's `config` at a folder while decorating, and leave other people's code alone."""
    before = config.CACHE_DIR
    config.CACHE_DIR = str(folder)
    try:
        yield
    finally:
        config.CACHE_DIR = before


def _reason(error: OSError) -> str:
    if isinstance(error, OpenFolderError):
        return f"{error.filename} {error.strerror}"
    return (error.strerror or str(error)).lower()


@lru_cache
def sources_hash(*places: str) -> str:
    """Hash of source files, given as files or folders (with all below) relative to ROOT or absolute.

    Raises FileNotFoundError for a place that does not exist, so that a moved source cannot drop out unnoticed.
    """
    digest = hashlib.sha256()
    for path in source_files(*places):
        name = path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else path.name
        digest.update(f"{name}\0".encode() + path.read_bytes())
    return digest.hexdigest()


def source_files(*places: str) -> list[Path]:
    """Files of places below ROOT: themselves, or the Python files of folders; raises FileNotFoundError."""
    found: set[Path] = set()
    for place in places:
        own = sorted((ROOT / place).rglob("*.py")) if not (ROOT / place).is_file() else [ROOT / place]
        if not own:
            raise FileNotFoundError(f"{place}: no such source in {ROOT}")
        found.update(own)
    return sorted(found)


@lru_cache
def installed(name: str) -> str:
    """Version of an installed package; 'source' if it runs from its source tree."""
    try:
        return version(name)
    except PackageNotFoundError:
        return "source"


__version__ = installed("rotorsim")


def key_of(*parts: Any) -> str:
    """Key by parts whose `repr` is complete: text, numbers, tuples, lists and dicts of them, never arrays."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:32]


@dataclass(frozen=True)
class Cache:
    """Folder of cached results; where they are `required`, a file that cannot be written raises WriteError."""

    folder: Path
    required: bool = False

    def array(self, key: str, shape: tuple[int, ...], compute: Callable[[], np.ndarray]) -> np.ndarray:
        """The cached array of real numbers, or the one computed now."""
        path = self.folder / f"{key}.npy"
        found = _read_array(path, shape)
        if found is None:
            found = compute()
            content = BytesIO()
            np.save(content, found)
            self._keep(write_bytes, path, content.getvalue())
        return found

    def find(self, name: str) -> Any:
        """The cached JSON value, or None."""
        try:
            return json.loads((self.folder / f"{name}.json").read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError):
            return None

    def keep(self, name: str, value: Any) -> Any:
        """Cache a JSON value; returns it as it will be read."""
        plain = json.loads(json.dumps(value))
        self._keep(write_json, self.folder / f"{name}.json", plain, None)
        return plain

    def _keep(self, write: Callable[..., None], path: Path, *content: Any) -> None:
        with nullcontext() if self.required else suppress(OSError):
            make_folder(path.parent)
            write(path, *content)


def _read_array(path: Path, shape: tuple[int, ...]) -> np.ndarray | None:
    """The array of a file; None if it is missing, damaged or of another shape."""
    try:
        found = np.lib.format.read_array(BytesIO(path.read_bytes()), allow_pickle=False)
    except Exception:  # numpy raises many kinds for damaged files
        return None
    return found if found.shape == shape and found.dtype == float else None
