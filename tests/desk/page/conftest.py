"""Fixtures of the desk's browser tests: browser, started desk on a file of its own, open page."""

import json

import pytest

from live_browser import PATIENCE, Started, serve, watched
from rotorsim.machine import machine_text

READY = "[...document.querySelectorAll('[data-panel]')].length > 0 && window.deskTimes.some((one) => one.all)"


@pytest.fixture
def desk_of(tmp_path, browser):
    """Opens the desk of a copy of a shipped machine, or an empty one: its page, which talks to nobody else."""
    begun = []

    def start(name=None, scheme="light", width=1400, ready=True, hidden=(), program=("-m", "rotorsim"), text=None):
        path = tmp_path / "rotor.toml"
        if name is not None:
            path.write_bytes((text or machine_text(name)).encode())
        words = ("desk", *([str(path)] if name else []), "--folder", str(tmp_path), "--no-browser", "--keep-open")
        desk = Started(tmp_path, command=lambda folder: serve(*words, program=program))
        context = browser.new_context(
            viewport={"width": width, "height": 900}, color_scheme=scheme, reduced_motion="reduce"
        )  # a mode that moves takes the processor
        page = watched(context, desk.address)
        begun.append((desk, context, page))
        page.file, page.address, page.lines = path, desk.address, desk.lines
        if hidden:
            kept = json.dumps(json.dumps(dict.fromkeys(hidden, True)))
            page.add_init_script(f"localStorage.setItem('rotorsim-desk-hidden', {kept})")
        page.goto(desk.address)
        page.wait_for_selector(".desk")  # the printed address leads on to the page
        if name is not None and ready:
            page.wait_for_function(READY)
        return page

    yield start
    for desk, context, page in begun:
        assert page.faults == []
        context.close()
        desk.process.send_signal(2)
        assert desk.process.wait(timeout=PATIENCE) == 0
        assert not [line for line in desk.lines if "Traceback" in line or "Exception" in line]
