"""Fixtures of the browser tests: browser, started live rig, open page."""

import pytest

from live_browser import PATIENCE, Started, watched


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("live")


@pytest.fixture(scope="module")
def rig(folder):
    rig = Started(folder, "--keep-open")
    yield rig
    rig.process.send_signal(2)
    assert rig.process.wait(timeout=PATIENCE) == 0
    assert not [line for line in rig.lines if "Traceback" in line]


@pytest.fixture(scope="module")
def address(rig):
    return rig.address


@pytest.fixture
def page(browser, address):
    """A window on the rig, calm, and what it asked of others."""
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    page = watched(context, address)
    page.goto(address)
    page.wait_for_function("window.rotorsimFrames > 3", timeout=PATIENCE * 1e3)
    yield page
    assert page.faults == []
    context.close()
