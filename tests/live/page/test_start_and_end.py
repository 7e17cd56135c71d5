"""Start and end of the live rig with a browser open on its page."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from live_browser import COARSE, IN_BROWSER, PATIENCE, ROOT, expect, start
from rotorsim.machine import machine_text
from waiting import until as holds, window

pytestmark = IN_BROWSER


def test_a_machine_file_with_an_error_is_shown_on_a_page(browser, tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(machine_text("dtu_gas_bearing").replace('me = "6.5 g*mm"', 'me = "10 g"'))
    command = [sys.executable, "-m", "rotorsim", "live", str(path), "--out", str(tmp_path)]
    environment = os.environ | {"PYTHONPATH": ROOT, "BROWSER": "true"}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    page = window(browser)
    page.goto(process.stdout.readline().split()[-1])
    message = page.get_by_role("alert").first
    expect(message).to_contain_text("effects.unbalance.me", timeout=PATIENCE * 1e3)
    page.context.close()
    assert process.wait(timeout=PATIENCE) == 2
    assert "effects.unbalance.me" in process.stderr.read()


def test_closing_the_page_ends_the_rig_and_finishes_its_record(browser, tmp_path):
    process, address = start(tmp_path)
    page = window(browser)
    page.goto(address)
    page.get_by_label("record", exact=True).click(timeout=PATIENCE * 1e3)
    page.wait_for_function(
        "window.rotorsimFrame && window.rotorsimFrame.status.recording > 0.2", timeout=PATIENCE * 1e3
    )
    page.context.close()
    assert process.wait(timeout=PATIENCE) == 0
    assert (tmp_path / "record-1.nc").exists() and "Traceback" not in process.stderr.read()


def test_the_token_is_in_no_command_line_and_the_browser_gets_in(browser, tmp_path):
    """The command that opens the browser gets a file that only its owner can read."""
    opener = tmp_path / "opener"
    part = tmp_path / "opened.part"
    opener.write_text(f'#!/bin/sh\nprintf %s "$1" > {part} && mv {part} {tmp_path}/opened\n')
    opener.chmod(0o700)
    command = [sys.executable, "-m", "rotorsim", "live", *COARSE, "--out", str(tmp_path)]
    environment = os.environ | {"PYTHONPATH": ROOT, "BROWSER": f"{opener} %s"}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    token = process.stdout.readline().split("token=")[1].strip()
    holds(lambda: (tmp_path / "opened").exists(), process)
    opened = (tmp_path / "opened").read_text()
    path = Path(opened.removeprefix("file://"))
    assert token not in opened and token in path.read_text()
    assert path.stat().st_mode & 0o077 == 0 and path.parent.stat().st_mode & 0o077 == 0
    page = window(browser)
    page.goto(opened)
    page.wait_for_function("window.rotorsimFrames > 3", timeout=PATIENCE * 1e3)
    assert token not in page.url
    page.context.close()
    process.send_signal(2)
    assert process.wait(timeout=PATIENCE) == 0 and not path.exists()


@pytest.mark.parametrize("connected", [False, True])
def test_ctrl_c_ends_the_rig_with_a_page_open_and_without_a_word(browser, tmp_path, connected):
    process, address = start(tmp_path, "--keep-open")
    if connected:
        page = window(browser)
        page.goto(address)
        page.wait_for_function("window.rotorsimFrames > 3", timeout=PATIENCE * 1e3)
    process.send_signal(2)
    assert process.wait(timeout=PATIENCE) == 0
    message = process.stderr.read()
    assert "graceful shutdown" not in message
    assert "Traceback" not in message and "Exception ignored" not in message and "never awaited" not in message
    if connected:
        page.context.close()


def test_a_rotor_without_film_has_its_own_controls_tour_and_axes(browser, tmp_path):
    command = [sys.executable, "-m", "rotorsim", "live", "plain_rotor", "--no-browser", "--out", str(tmp_path)]
    environment = os.environ | {"PYTHONPATH": ROOT}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    page = window(browser, viewport={"width": 1440, "height": 900})
    page.goto(process.stdout.readline().split()[-1])
    page.wait_for_function("window.rotorsimFrames > 6", timeout=PATIENCE * 1e3)
    assert page.get_by_label("controller", exact=True).count() == 0
    assert page.get_by_label("pressure", exact=True).count() == 0
    page.get_by_role("tab", name="Tour").click()
    page.get_by_role("button", name="A hit", exact=True).click()
    page.wait_for_function("window.rotorsimFrame.status.reading.zeta !== undefined", timeout=PATIENCE * 1e3)
    assert page.get_by_role("button", name="Critical speed").count() == 1
    page.context.close()
    process.send_signal(2)
    assert process.wait(timeout=PATIENCE) == 0
