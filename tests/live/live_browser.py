"""Live page in a real browser: start of the rig, reading and setting of its controls.

These tests take minutes and want a processor for the browser: set ROTORSIM_BROWSER=1, as .ci/run does for the
live page and the nightly job for all.
"""

import os
import subprocess
import sys
import threading
import time
from importlib.util import find_spec
from pathlib import Path

import pytest

from clicker import CHROMIUM
from waiting import PATIENCE as LONGEST

IN_BROWSER = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("playwright") is None, reason="playwright is not installed; pip install '.[test]'"),
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here; install Debian's package chromium"),
    pytest.mark.skipif("ROTORSIM_BROWSER" not in os.environ, reason="set ROTORSIM_BROWSER=1 to drive a browser"),
]
COARSE = ["--grid", "16x8", "--time-step", "0.2 ms", "--set", "shaft.max_element_length=80 mm"]
ROOT = str(Path(__file__).parents[2])
"""Folder of the packages."""
PATIENCE = float(os.environ.get("PATIENCE", LONGEST))
UNIT = {"speed": 30 / 3.141592653589793, "pressure": 1e-6, "impulse": 1e3, "acceleration": 30 / 3.141592653589793}

CONTRAST = """() => {
  const parts = (text) => text.match(/[\\d.]+/g).map(Number);
  const linear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
  const light = ([r, g, b]) => [r, g, b].map((v) => linear(v / 255))
    .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);
  const behind = (one) => {
    for (let at = one; at; at = at.parentElement) {
      const found = parts(getComputedStyle(at).backgroundColor);
      if (found.length === 3 || found[3] > 0.99) return found;
    }
    return document.body.classList.contains("body--dark") ? [18, 18, 18] : [255, 255, 255];
  };
  const texts = [...document.querySelectorAll(".desk *, .live-head *, .live-page *")];
  const seen = texts.filter((one) => one.checkVisibility() && !one.disabled &&
    !one.closest("svg") && [...one.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim()));
  return seen.map((one) => {
    const [a, b] = [light(parts(getComputedStyle(one).color)), light(behind(one))];
    return [(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), one.outerHTML.slice(0, 90)];
  });
}"""
"""Contrast of every text that is seen with what is behind it, and its element."""


def start(folder, *options):
    """A rig as a user would start it, and its address."""
    return serve("live", *COARSE, "--no-browser", "--out", str(folder), *options)


def serve(*words, program=("-m", "rotorsim")):
    """A command that serves a page, and the address of that."""
    command = [sys.executable, *program, *words]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, (ROOT, os.environ.get("PYTHONPATH"))))}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    line = process.stdout.readline()
    assert "http://127.0.0.1" in line, process.stderr.read()
    return process, line.split()[-1]


class Started:
    """A command that serves a page and was started: its address, and what it writes to stderr."""

    def __init__(self, folder, *options, command=start):
        self.process, self.address = command(folder, *options)
        self.lines = []
        threading.Thread(target=lambda: self.lines.extend(self.process.stderr), daemon=True).start()


def watched(context, address):
    """A new page of a browser, which keeps its errors and what it asks of others than an address."""
    page, own = context.new_page(), (address.split("?")[0], "data:", "blob:", "ws://127.0.0.1")
    page.set_default_timeout(PATIENCE * 1e3)
    page.faults = []
    page.on("request", lambda asked: page.faults.extend([] if asked.url.startswith(own) else [asked.url]))
    page.on("pageerror", lambda error: page.faults.append(str(error)))
    return page


def settings(page):
    return page.evaluate("fetch('settings').then(r => r.json())")


def until(page, what, seconds=PATIENCE, asked=settings):
    """Wait until what is asked of the page, the plant's settings else, fulfils a condition."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if what(found := asked(page)):
            return found
        page.wait_for_timeout(50)
    raise AssertionError([found, page.locator(".q-notification").all_inner_texts()])


def fill(page, key, value):
    field = page.get_by_label(f"{key} value", exact=True)
    field.fill(value)
    field.press("Enter")


def frame(page):
    return page.evaluate("window.rotorsimFrame")


def expect(locator):
    """Playwright's assertion on a locator, which waits."""
    from playwright import sync_api

    sync_api.expect.set_options(timeout=PATIENCE * 1e3)
    return sync_api.expect(locator)
