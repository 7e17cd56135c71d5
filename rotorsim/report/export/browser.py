"""Browsers of this computer: the user's own, to show a page in, and one of the Chrome family, to draw figures with."""

from __future__ import annotations

import os
import shutil
import sys
import webbrowser
from pathlib import Path

CHROME = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge", "microsoft-edge")
"""Names of programs of the Chrome family."""
PLACES = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
)
"""Where they are installed without being on the path."""

NO_CHROME = "there is no Chrome, Chromium or Edge to draw figures; install one or set BROWSER_PATH to its program"


def has_browser() -> bool:
    """Whether the user's browser can be opened here: there is one, and a display, or the variable BROWSER names it."""
    try:
        webbrowser.get()
    except webbrowser.Error:
        return False
    shown = any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"))
    return shown or not sys.platform.startswith("linux")


def open_page(path: Path) -> bool:
    """Open a file in the user's browser; whether that was possible."""
    try:
        return has_browser() and webbrowser.open(path.resolve().as_uri())
    except (webbrowser.Error, OSError):
        return False


def chrome() -> str | None:
    """Path of a browser of the Chrome family: BROWSER_PATH, one on the path, one at a usual place; None without."""
    named = os.environ.get("BROWSER_PATH")
    if named:
        return shutil.which(named)
    found = (shutil.which(name) for name in (*CHROME, *PLACES))
    return next(filter(None, found), None)
