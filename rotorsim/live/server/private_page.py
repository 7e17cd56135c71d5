"""Private redirect file to the live page, which keeps the token out of command lines that all users can read."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from pathlib import Path

from rotorsim.base.errors import DataError


@contextmanager
def private_page(address: str) -> Iterator[str]:
    """Address of an owner-readable file that redirects to another address; raises DataError."""
    folder = None
    try:
        folder = Path(tempfile.mkdtemp(prefix="rotorsim-live-"))
        path = folder / "live.html"
        path.touch(mode=0o600)
        path.write_text(f'<meta http-equiv="refresh" content="0; url={escape(address)}">\n', encoding="utf-8")
    except OSError as error:
        if folder is not None:
            shutil.rmtree(folder, ignore_errors=True)
        raise DataError(
            f"{tempfile.gettempdir()}: takes no file ({error}); set TMPDIR to a folder with room"
        ) from error
    try:
        yield path.as_uri()
    finally:
        shutil.rmtree(folder, ignore_errors=True)
