"""The page of the live rig in a real browser: every control is turned and its effect on the plant read back.

These take minutes and want a processor for the browser: set ROTORSIM_BROWSER=1, as .ci/run does.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from rotorsim.machine import machine_text

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed; pip install '.[test]'")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here; install Debian's package chromium"),
    pytest.mark.skipif("ROTORSIM_BROWSER" not in os.environ, reason="set ROTORSIM_BROWSER=1 to drive a browser"),
]
COARSE = ["--grid", "16x8", "--time-step", "0.2 ms", "--set", "shaft.max_element_length=80 mm"]
PATIENCE = 120.0
UNIT = {"speed": 30 / 3.141592653589793, "pressure": 1e-6, "impulse": 1e3, "acceleration": 30 / 3.141592653589793}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("live")


def start(folder, *options):
    """A rig as a user would start it, and its address."""
    command = [sys.executable, "-m", "rotorsim", "live", *COARSE, "--no-browser", "--out", str(folder), *options]
    root = str(Path(__file__).parents[2])
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, (root, os.environ.get("PYTHONPATH"))))}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    line = process.stdout.readline()
    assert "http://127.0.0.1" in line, process.stderr.read()
    return process, line.split()[-1]


@pytest.fixture(scope="module")
def address(folder):
    process, address = start(folder, "--keep-open")
    yield address
    process.send_signal(2)
    assert process.wait(timeout=60) == 0
    assert "Traceback" not in process.stderr.read()


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as engine:
        flags = ["--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader"]
        browser = engine.chromium.launch(executable_path=CHROMIUM, args=flags)
        yield browser
        browser.close()


@pytest.fixture
def page(browser, address):
    """A window on the rig, calm, and what it asked of others."""
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    page = context.new_page()
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


def settings(page):
    return page.evaluate("fetch('settings').then(r => r.json())")


def until(page, what, seconds=PATIENCE):
    """Wait until the plant's settings fulfil a condition."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if what(found := settings(page)):
            return found
        page.wait_for_timeout(50)
    raise AssertionError(found)


def fill(page, key, value):
    field = page.get_by_label(f"{key} value", exact=True)
    field.fill(value)
    field.press("Enter")


def frame(page):
    return page.evaluate("window.rotorsimFrame")


def test_operating_controls_turn_the_plant(page):
    for key, shown, value in (
        ("acceleration", "900", 900 / UNIT["acceleration"]),
        ("torque", "1.5", 1.5),
        ("impulse", "12", 0.012),
        ("pressure", "0.45", 0.45e6),
        ("reference_x", "-1.25", -1.25),
        ("reference_y", "0.5", 0.5),
        ("speed", "600", 600 / UNIT["speed"]),
    ):
        fill(page, key, shown)
        until(page, lambda s, key=key, value=value: abs(s[key] - value) <= 1e-9 * abs(value))
    page.wait_for_function("window.rotorsimFrame.now.speed > 590", timeout=PATIENCE * 1e3)
    page.wait_for_function("Math.abs(window.rotorsimFrame.now.pressure - 0.45) < 0.02", timeout=PATIENCE * 1e3)
    page.wait_for_function("window.rotorsimFrame.trace.reference_x.at(-1) === -1.25", timeout=PATIENCE * 1e3)


def test_switches_turn_the_plant(page):
    for label, key, positions in (
        ("drive", "drive", ("torque", "coast", "speed")),
        ("sense", "sense", ("backward", "forward")),
        ("noise", "noise", ("off", "on")),
        ("controller", "controller", ("P", "off")),
        ("simulation speed", "pace", ("0.1x", "fastest", "1x")),
    ):
        for position in positions:
            page.get_by_label(label, exact=True).get_by_role("button", name=position, exact=True).click()
            found = until(page, lambda s, key=key, position=position: s[key] == position)
            if key == "noise":
                assert (found["noise.sigma"] == 0.0) is (position == "off")


def test_every_effect_of_the_catalogue_is_turned_by_its_field(page):
    page.get_by_label("simulation speed", exact=True).get_by_role("button", name="pause", exact=True).click()
    page.get_by_role("tab", name="Effects").click()
    before = settings(page)
    keys = [key for key in before if "." in key]
    assert len(keys) > 80
    for key in keys:
        field = page.get_by_label(f"{key} value", exact=True)
        if not field.is_visible():
            page.locator(".q-expansion-item").filter(has=field).locator(".q-item--clickable").click()
            field.wait_for(timeout=PATIENCE * 1e3)
        shown = float(field.input_value())
        whole = key.endswith(("injector", "order", "_lobes", "counts", "window", "surface"))
        fill(page, key, f"{shown + 1 if whole else shown * 0.9 or 0.01:.6g}")
        until(page, lambda s, key=key: s[key] != before[key])
        fill(page, key, f"{shown:g}")
    page.get_by_role("button", name="Back to the machine file").click()
    until(page, lambda s: all(s[key] == before[key] for key in keys))
    page.get_by_label("simulation speed", exact=True).get_by_role("button", name="1x", exact=True).click()
    until(page, lambda s: s["pace"] == "1x")


def test_sliders_move_by_the_keyboard_and_lose_no_step(page):
    fill(page, "pressure", "0.45")
    before = until(page, lambda s: s["pressure"] == pytest.approx(0.45e6))["pressure"]
    slider = page.get_by_label("pressure", exact=True)
    playwright.expect(slider).to_have_attribute("aria-valuenow", re.compile(r"0\.214"), timeout=PATIENCE * 1e3)
    slider.locator("[tabindex]").focus()
    for _ in range(5):
        page.keyboard.press("ArrowLeft")
    until(page, lambda s: s["pressure"] < before)
    for _ in range(5):
        page.keyboard.press("ArrowRight")
    until(page, lambda s: s["pressure"] == before)


def test_a_slider_that_is_moved_step_by_step_stays_where_it_is_put(page):
    """Its first steps away from the neutral place change nothing that three digits show."""
    slider = page.get_by_label("acceleration", exact=True)
    fill(page, "acceleration", "500")
    until(page, lambda s: s["acceleration"] == pytest.approx(500 / UNIT["acceleration"]))
    playwright.expect(slider).to_have_attribute("aria-valuenow", "0", timeout=PATIENCE * 1e3)
    slider.locator("[tabindex]").focus()
    for _ in range(3):
        page.keyboard.press("ArrowRight")
        page.wait_for_timeout(1500)
    playwright.expect(slider).to_have_attribute("aria-valuenow", "0.003", timeout=PATIENCE * 1e3)


def test_keys_pause_and_hit(page):
    page.locator("body").click(position={"x": 700, "y": 5})
    page.keyboard.press(" ")
    until(page, lambda s: s["pace"] == "pause")
    page.keyboard.press(" ")
    until(page, lambda s: s["pace"] == "1x")
    page.evaluate("window.hits = 0; const look = () => { if (window.rotorsimFrame.now.force[0] !== 0) window.hits++;"
                  " requestAnimationFrame(look); }; look()")  # fmt: skip
    page.keyboard.press("x")
    page.wait_for_function("window.rotorsimFrame.status.reading[0] === 'x'", timeout=PATIENCE * 1e3)


def test_values_beyond_limits_are_clamped_and_said(page):
    fill(page, "pressure", "7")
    until(page, lambda s: s["pressure"] == 1e6)
    page.get_by_text("is beyond 0 MPa to 1 MPa, set to 1 MPa").first.wait_for(timeout=PATIENCE * 1e3)
    fill(page, "pressure", "0.3")
    until(page, lambda s: s["pressure"] == pytest.approx(0.3e6))


def test_two_windows_see_the_same_machine(page, browser, address):
    other = browser.new_context().new_page()
    other.goto(address)
    other.wait_for_function("window.rotorsimFrames > 3", timeout=PATIENCE * 1e3)
    fill(page, "reference_y", "2.5")
    other.wait_for_function("window.rotorsimFrame.trace.reference_y.at(-1) === 2.5", timeout=PATIENCE * 1e3)
    field = other.get_by_label("reference_y value", exact=True)
    playwright.expect(field).to_have_value("2.5", timeout=PATIENCE * 1e3)
    fill(other, "reference_y", "0")
    until(page, lambda s: s["reference_y"] == 0.0)
    other.context.close()


def test_a_page_that_is_not_seen_asks_for_nothing_and_the_plant_runs_on(page):
    page.evaluate("window.requestAnimationFrame = () => 0")
    page.wait_for_timeout(500)
    asked, then = page.evaluate("window.rotorsimFrames"), page.evaluate("fetch('frame').then(r => r.json())")["time"]
    page.wait_for_timeout(1500)
    assert page.evaluate("window.rotorsimFrames") == asked
    assert page.evaluate("fetch('frame').then(r => r.json())")["time"] > then


def test_a_record_is_written_and_replayed(page, folder):
    page.get_by_label("record", exact=True).click()
    page.wait_for_function("window.rotorsimFrame.status.recording > 0.5", timeout=PATIENCE * 1e3)
    page.get_by_label("record", exact=True).click()
    page.wait_for_function("window.rotorsimFrame.status.recording === null", timeout=PATIENCE * 1e3)
    page.get_by_role("tab", name="Files").click()
    page.get_by_role("button", name="record-1").click(timeout=PATIENCE * 1e3)
    page.wait_for_function("window.rotorsimFrame.status.replay !== null", timeout=PATIENCE * 1e3)
    page.wait_for_function("window.rotorsimFrame.time >= 0.5", timeout=PATIENCE * 1e3)
    page.get_by_role("button", name="Back to the plant").click()
    page.wait_for_function("window.rotorsimFrame.status.replay === null", timeout=PATIENCE * 1e3)
    assert (folder / "record-1.nc").exists()


def test_a_scene_is_saved_and_loaded(page, folder):
    fill(page, "impulse", "33")
    until(page, lambda s: s["impulse"] == pytest.approx(0.033))
    page.get_by_role("tab", name="Files").click()
    page.get_by_role("button", name="Save scene").click()
    page.get_by_role("button", name="scene", exact=True).wait_for(timeout=PATIENCE * 1e3)
    assert json.loads((folder / "scene.scene.json").read_text())["values"]["impulse"] == pytest.approx(0.033)
    page.get_by_role("tab", name="Operate").click()
    fill(page, "impulse", "10")
    until(page, lambda s: s["impulse"] == pytest.approx(0.01))
    page.get_by_role("tab", name="Files").click()
    page.get_by_role("button", name="scene", exact=True).click()
    until(page, lambda s: s["impulse"] == pytest.approx(0.033))


def test_a_strangers_page_cannot_drive_the_rig(browser, page, address):
    stranger = browser.new_context().new_page()
    stranger.route("http://evil.example/*", lambda route: route.fulfill(body="<p>evil</p>", content_type="text/html"))
    stranger.goto("http://evil.example/")
    place = address.split("?")[0]
    tried = stranger.evaluate(
        """async (place) => {
            const read = await fetch(place + "frame", { credentials: "include" }).then(() => "read", () => "refused");
            const socket = await new Promise((done) => {
                const path = "_nicegui_ws/socket.io/?EIO=4&transport=websocket";
                const s = new WebSocket(place.replace("http", "ws") + path);
                s.onopen = () => done("open"); s.onerror = () => done("refused");
            });
            return [read, socket];
        }""",
        place,
    )
    assert tried == ["refused", "refused"]
    stranger.context.close()


def test_malformed_huge_and_flooding_messages_are_refused_and_the_plant_runs_on(page, address):
    ended = page.evaluate(
        """async (place) => {
            const ended = [];
            const url = place.replace("http", "ws") + "_nicegui_ws/socket.io/?EIO=4&transport=websocket";
            for (const messages of [["nonsense", "4", "42{", "40"], ["x".repeat(200000)], Array(5000).fill("2probe")]) {
                ended.push(await new Promise((done) => {
                    const s = new WebSocket(url);
                    s.onopen = () => {
                        for (const m of messages) s.send(m);
                        setTimeout(() => { s.close(); done("kept"); }, 4000);
                    };
                    s.onclose = () => done("ended");
                }));
            }
            return ended;
        }""",
        address.split("?")[0],
    )
    assert ended[1:] == ["ended", "ended"]
    then = frame(page)["time"]
    page.wait_for_function(f"window.rotorsimFrame.time > {then} + 0.2", timeout=PATIENCE * 1e3)


def test_every_scene_of_the_tour_opens(page):
    page.get_by_role("tab", name="Tour").click()
    for title in ("Lift-off", "Critical speed", "Cross-coupling", "Whirl onset", "Controller on"):
        page.get_by_role("button", name=title).click()
        page.wait_for_timeout(700)
        assert frame(page)["status"]["stopped"] == ""
    until(page, lambda s: s["controller"] == "P")


def test_a_machine_file_with_an_error_is_shown_on_a_page(browser, tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(machine_text("dtu_gas_bearing").replace('me = "6.5 g*mm"', 'me = "10 g"'))
    command = [sys.executable, "-m", "rotorsim", "live", str(path), "--out", str(tmp_path)]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2]), "BROWSER": "true"}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    page = browser.new_context().new_page()
    page.goto(process.stdout.readline().split()[-1])
    said = page.get_by_role("alert").first
    playwright.expect(said).to_contain_text("effects.unbalance.me", timeout=PATIENCE * 1e3)
    page.context.close()
    assert process.wait(timeout=PATIENCE) == 2
    assert "effects.unbalance.me" in process.stderr.read()


def test_closing_the_page_ends_the_rig_and_finishes_its_record(browser, tmp_path):
    process, address = start(tmp_path)
    page = browser.new_context().new_page()
    page.goto(address)
    page.get_by_label("record", exact=True).click(timeout=PATIENCE * 1e3)
    page.wait_for_function(
        "window.rotorsimFrame && window.rotorsimFrame.status.recording > 0.2", timeout=PATIENCE * 1e3
    )
    page.context.close()
    assert process.wait(timeout=PATIENCE) == 0
    assert (tmp_path / "record-1.nc").exists() and "Traceback" not in process.stderr.read()
