"""Browsers of this computer: the user's own shows pages, one of the Chrome family draws PNG and SVG."""

import base64
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from rotorsim.base.errors import DataError
from rotorsim.base.interrupt import undoing

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
"""Usual places of their programs that are not on the path."""
NO_CHROME = "there is no Chrome, Chromium or Edge to draw figures; install one or set BROWSER_PATH to its program"


def has_browser() -> bool:
    """True if the user's browser can be opened: there is one, and a display, or the variable BROWSER names it."""
    try:
        webbrowser.get()
    except webbrowser.Error:
        return False
    shown = any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"))
    return shown or not sys.platform.startswith("linux")


def open_page(path: Path) -> bool:
    """Open a file in the user's browser; True if that was possible."""
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


PATIENCE = 180.0
"""Seconds after which a browser counts as stuck."""
WIDTH = 1100
"""Width [px] of a figure that states none."""
SWITCHES = ("headless", "disable-gpu", "enable-unsafe-swiftshader", "no-first-run", "virtual-time-budget=60000",
            "dump-dom")  # fmt: skip
SCRIPT = """(async () => {
  const place = document.getElementById('images');
  for (const one of figures) {
    const image = document.createElement('pre');
    try { image.textContent = await Plotly.toImage({data: one.data, layout: one.layout}, one.options); }
    catch (error) { image.textContent = 'failed: ' + error; }
    place.append(image);
  }
  place.className = 'complete';
})()"""


def images(figures: Sequence[dict[str, Any]], kind: str, width: int | None = None, height: int | None = None,
           scale: float = 2.0) -> list[bytes]:  # fmt: skip
    """Files of figures (`data` and `layout` of plotly) as "png" or "svg".

    Width and height [px] are those of the figure, or 1100 x 700, where None; a PNG has `scale` pixels by px. Raises
    DataError without a browser, or if it draws nothing.
    """
    from plotly.offline import get_plotlyjs

    program = chrome()
    if program is None:
        raise DataError(f"{NO_CHROME}, or save the figure from the toolbar of the HTML page")
    jobs = []
    for one in figures:
        layout = {name: value for name, value in one["layout"].items() if name != "width"}
        size = {"width": width or one["layout"].get("width") or WIDTH, "height": height or layout.get("height") or 700}
        options = {"format": kind, **size, "scale": scale if kind == "png" else 1}
        jobs.append({"data": one["data"], "layout": layout, "options": options})
    text = json.dumps(jobs).replace("<", "\\u003c")
    page = (
        '<!doctype html><html><head><meta charset="utf-8"></head><body><div id="images"></div>'
        f"<script>{get_plotlyjs()}</script><script>const figures = {text}; {SCRIPT}</script></body></html>"
    )
    return [_decoded(url) for url in _urls(program, page)]


def _urls(program: str, page: str) -> list[str]:
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder, undoing():
        path = Path(folder) / "figures.html"
        path.write_text(page, encoding="utf-8")
        own = ["no-sandbox"] if getattr(os, "geteuid", lambda: 1)() == 0 else []  # root has no sandbox
        switches = (*SWITCHES, *own, f"user-data-dir={folder}/profile")
        line = [program, *(f"--{switch}" for switch in switches), path.as_uri()]
        try:
            done = subprocess.run(line, capture_output=True, timeout=PATIENCE, check=False)
        except (OSError, subprocess.TimeoutExpired) as error:
            late = isinstance(error, subprocess.TimeoutExpired)
            reason = f"nothing within {PATIENCE:g} s" if late else str(error)
            raise DataError(f"{program} drew no figure ({reason}); set BROWSER_PATH to another browser") from error
    text = done.stdout.decode("utf-8", errors="replace")
    place = re.search(r'<div id="images" class="complete">(.*?)</div>', text, re.DOTALL)
    urls = re.findall(r"<pre>(.*?)</pre>", place[1], re.DOTALL) if place else []
    if not urls or any(not url.startswith("data:image/") for url in urls):
        raise DataError(f"{program} drew no figure; set BROWSER_PATH to another browser of the Chrome family")
    return urls


def _decoded(url: str) -> bytes:
    head, _, content = url.replace("&amp;", "&").partition(",")
    return base64.b64decode(content) if head.endswith(";base64") else unquote(content).encode()
