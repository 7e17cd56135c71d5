"""Fixtures of the browser tests: browser, started live rig, open page."""

import pytest

from live_browser import PATIENCE, Started


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
    page = context.new_page()
    page.set_default_timeout(PATIENCE * 1e3)
    page.elsewhere = []
    page.on("request", lambda r: page.elsewhere.append(r.url) if _foreign(r.url, address) else None)
    page.on("pageerror", lambda error: page.elsewhere.append(str(error)))
    page.goto(address)
    page.wait_for_function("window.rotorsimFrames > 3", timeout=PATIENCE * 1e3)
    yield page
    assert page.elsewhere == []
    context.close()


def _foreign(url, address):
    return not url.startswith((address.split("?")[0], "data:", "blob:", "ws://127.0.0.1"))
