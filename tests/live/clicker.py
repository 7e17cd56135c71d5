"""Random clicks and keys on the page of a live rig, with displayed values compared with the plant's.

    python tests/live/clicker.py --minutes 40 --seed 1 --machine dtu_gas_bearing

prints a line a minute and ends with code 1 if anything was raised, logged, or read wrongly.
"""

import argparse
import json
import random
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = ["--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader"]
KEYS = ["x", "y", "r", " ", " ", "Tab", "Tab", "Enter", "Escape", "ArrowLeft", "ArrowRight", "ArrowUp", "x", "y"]
SIZES = [(1440, 900), (1024, 700), (800, 1000), (1920, 1080), (480, 800)]
TEXTS = ["", "0", "-1", "1e9", "abc", "1e-9", "-0", "99999999999", "3.14159", "nan", "1e400", "  5 "]
READ = """() => ({frame: window.rotorsimRead, last: window.rotorsimFrame, strip: Object.fromEntries(
  [...document.querySelectorAll('[data-reading]')].map(e => [e.dataset.reading, e.innerText]))})"""
SEEN = """() => [...document.querySelectorAll('button, [role=tab], .q-expansion-item .q-item--clickable')]
  .map((e, i) => [i, e.getBoundingClientRect(), e.innerText]).filter(([i, r]) => r.width > 0 && r.height > 0)
  .map(([i, r, text]) => [r.x + r.width / 2, r.y + r.height / 2, text])"""
SAMPLE = 2e-4


@dataclass
class ClickCounts:
    """Counts of actions and of readings that were compared, and everything that was wrong."""

    actions: Counter[str] = field(default_factory=Counter)
    compared: Counter[str] = field(default_factory=Counter)
    skipped: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)

    def check(self, what: str, right: bool, words: str) -> None:
        """Count a comparison."""
        self.compared[what] += 1
        if not right:
            self.wrong.append(f"{what}: {words}")

    def plain(self) -> dict[str, Any]:
        """Values ready for JSON."""
        return {
            "actions": sum(self.actions.values()), "by kind": dict(self.actions), "compared": dict(self.compared),
            "skipped": dict(self.skipped), "hits without a reading": dict(self.reasons), "wrong": self.wrong,
        }  # fmt: skip


class Server:
    """An audited rig in a process of its own; `lines` is what it wrote to stderr."""

    def __init__(self, machine: str, folder: Path, port: int) -> None:
        command = [sys.executable, str(Path(__file__).with_name("audited.py")), machine, str(folder), str(port)]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.lines: list[str] = []
        threading.Thread(target=self._listen, daemon=True).start()
        self.address = (self.process.stdout.readline() if self.process.stdout else "").strip()
        if not self.address:
            self.process.wait()
            raise RuntimeError("\n".join(self.lines))

    def _listen(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.lines.append(line.rstrip())

    def close(self) -> int:
        """Exit code after Ctrl-C."""
        self.process.send_signal(2)
        return self.process.wait(timeout=60)


class Clicker:
    """Turns a page at random; every draw comes from one seed."""

    def __init__(self, browser: Any, server: Server, seed: int) -> None:
        self.rng, self.server, self.outcome = random.Random(seed), server, ClickCounts()
        self.context = browser.new_context(viewport={"width": 1440, "height": 900})
        self.page = self.context.new_page()
        self.page.on("pageerror", lambda error: self.outcome.wrong.append(f"page: {error}"))
        self.page.on("console", self._console)
        self._open(server.address)

    def _console(self, message: Any) -> None:
        if message.type == "error" and "ERR_CONNECTION" not in message.text:
            self._once(f"console: {message.text[:300]}")

    def _once(self, words: str) -> None:
        if words not in self.outcome.wrong:
            self.outcome.wrong.append(words)

    def _open(self, address: str) -> None:
        self.page.goto(address, timeout=120e3)
        self.page.wait_for_function("window.rotorsimFrames > 6", timeout=120e3)

    def run(self, minutes: float) -> ClickCounts:
        """Click for some minutes."""
        begin, reported = time.monotonic(), 0.0
        while (passed := time.monotonic() - begin) < 60 * minutes:
            if self.rng.random() < 0.06:
                self.measure()
            else:
                self.act()
            if self.rng.random() < 0.3:
                self.compare()
            if self.server.process.poll() is not None:
                self.outcome.wrong.append("the server has ended")
                break
            if passed > reported:
                reported += 60
                print(f"{passed / 60:5.1f} min", json.dumps(self.outcome.plain())[:1500], flush=True)
        self.outcome.wrong += [f"log: {line}" for line in self.server.lines]
        return self.outcome

    def act(self) -> None:
        """One random action."""
        kind = self.rng.choices(
            ["button", "key", "field", "slider", "place", "wheel", "size", "reload", "window", "rush"],
            [30, 20, 20, 12, 8, 3, 1, 0.6, 0.4, 1],
        )[0]
        self.outcome.actions[kind] += 1
        getattr(self, f"_{kind}")()
        self.page.wait_for_timeout(self.rng.choice([0, 0, 20, 100, 400]))

    def _button(self) -> None:
        seen = self.page.evaluate(SEEN)
        size = self.page.viewport_size
        seen = [s for s in seen if 0 <= s[0] < size["width"] and 0 <= s[1] < size["height"]]
        if seen:
            self.page.mouse.click(*self.rng.choice(seen)[:2])

    def _key(self) -> None:
        self.page.keyboard.press(self.rng.choice(KEYS))

    def _rush(self) -> None:
        for _ in range(self.rng.randrange(5, 30)):
            self.page.keyboard.press(self.rng.choice(KEYS))

    def _field(self) -> None:
        fields = [f for f in self.page.get_by_label(re.compile(r" value$")).all() if f.is_visible()]
        if not fields:
            return
        field = self.rng.choice(fields)
        text = self.rng.choice(TEXTS) if self.rng.random() < 0.4 else f"{self.rng.uniform(-3, 10):.3g}"
        try:
            field.click(timeout=2000)
            self.page.keyboard.press("Control+a")
            self.page.keyboard.type(text)
            self.page.keyboard.press(self.rng.choice(["Enter", "Tab", "Escape"]))
        except Exception as error:  # a page that was turned meanwhile
            self.outcome.skipped[type(error).__name__] += 1

    def _slider(self) -> None:
        places = self.page.evaluate(
            "[...document.querySelectorAll('.q-slider')].map(e => e.getBoundingClientRect())"
            ".filter(r => r.width > 0).map(r => [r.x, r.y + r.height / 2, r.width])"
        )
        if places:
            x, y, width = self.rng.choice(places)
            self.page.mouse.move(x + self.rng.random() * width, y)
            self.page.mouse.down()
            for _ in range(self.rng.randrange(4)):
                self.page.mouse.move(x + self.rng.random() * width, y)
            self.page.mouse.up()

    def _place(self) -> None:
        size = self.page.viewport_size
        self.page.mouse.click(self.rng.randrange(size["width"]), self.rng.randrange(size["height"]))

    def _wheel(self) -> None:
        self.page.mouse.move(self.rng.randrange(300), self.rng.randrange(600))
        self.page.mouse.wheel(0, self.rng.choice([-400, 300, 800]))

    def _size(self) -> None:
        width, height = self.rng.choice(SIZES)
        self.page.set_viewport_size({"width": width, "height": height})

    def _reload(self) -> None:
        self._open(self.server.address.split("?")[0])

    def _window(self) -> None:
        other = self.context.new_page()
        other.on("pageerror", lambda error: self.outcome.wrong.append(f"second window: {error}"))
        other.goto(self.server.address.split("?")[0])
        other.wait_for_timeout(1000)
        other.close()

    def measure(self) -> None:
        """A hit as a person would do it: effects as in the file, a point, a reset, some patience, a hit."""
        self.outcome.actions["measure"] += 1
        page, rng = self.page, self.rng
        page.set_viewport_size({"width": 1440, "height": 900})
        try:
            page.keyboard.press("Escape")
            page.get_by_role("tab", name="Files").click(timeout=5000)
            page.get_by_role("button", name="Back to the plant").click(timeout=5000)
            if self._frame()["last"]["status"]["recording"] is not None:
                page.get_by_label("record", exact=True).click(timeout=5000)
            if rng.random() < 0.8:
                page.get_by_role("tab", name="Effects").click(timeout=5000)
                page.get_by_role("button", name="Back to the machine file").click(timeout=5000)
            page.get_by_role("tab", name="Operate").click(timeout=5000)
            page.get_by_label("simulation speed").get_by_role("button", name="1x", exact=True).click(timeout=5000)
            page.get_by_label("drive", exact=True).get_by_role("button", name="speed").click(timeout=5000)
            point = {"impulse": rng.choice([5, 10, 20]), "speed": rng.choice([0, 1000, 3000, 4500, 6000, 9000, 12000])}
            point |= {"pressure": rng.choice([0.3, 0.4, 0.5, 0.6]), "reference_x": 0, "reference_y": 0}
            for key, value in point.items():
                found = page.get_by_label(f"{key} value", exact=True)
                if found.count():
                    found.fill(str(value), timeout=5000)
                    found.press("Enter")
            switch = page.get_by_label("controller", exact=True)
            if switch.count():
                name = rng.choice(["off", "off", "hinf"])
                switch.get_by_role("button", name=name, exact=True).click(timeout=5000)
            page.get_by_label("reset to equilibrium").click(timeout=5000)
            self._after(1.5)
            page.get_by_label(f"hit {rng.choice('xy')}", exact=True).click(timeout=5000)
            self._after(1.0)
            self.compare()
        except Exception as error:  # a page that was turned meanwhile, or a plant that has stopped
            self.outcome.skipped[f"measure: {type(error).__name__}"] += 1

    def _after(self, seconds: float) -> None:
        """Wait for seconds of the plant."""
        then = self._frame()["last"]["time"]
        self.page.wait_for_function(f"window.rotorsimFrame.time > {then + seconds}", timeout=60e3)
        self.page.wait_for_timeout(500)

    def _frame(self) -> dict[str, Any]:
        return dict(self.page.evaluate(READ))

    def compare(self) -> None:
        """Compare what is shown with the plant's own."""
        shown = self._frame()
        frame, strip = shown["frame"], shown["strip"]
        if not frame or not frame.get("now") or frame["status"]["replay"] or not strip:
            self.outcome.skipped["no plant is shown"] += 1
            return
        status = frame["status"]
        modes = status["modes"]
        speed, pressure = modes.get("speed", 0) * 0.10471975511965977, modes.get("pressure", 0.0) * 1e6
        query = f"sample={round(frame['time'] / SAMPLE)}&epoch={status['epoch']}&speed={speed}&pressure={pressure}"
        query += f"&shown={'false' if modes['why'] else 'true'}"
        own = self.page.evaluate(f"fetch('audit?{query}').then(r => r.json())")
        if "error" in own:
            self.outcome.skipped[own["error"]] += 1
            return
        self.outcome.wrong += [f"fault: {words}" for words in own["faults"]]
        self._rows(frame, strip, own["rows"], f"in epoch {status['epoch']} for {own['epoch']}")
        if "own" not in own:
            self.outcome.skipped["turned meanwhile"] += 1
            return
        if self._frame()["frame"]["status"]["epoch"] == status["epoch"]:
            self._modes(strip, modes, own["own"])
            self._hit(strip, status["reading"], own["own"])

    def _rows(self, frame: dict[str, Any], strip: dict[str, str], rows: list[dict[str, Any]], when: str) -> None:
        if not rows:
            self.outcome.skipped["rows have gone"] += 1
            return
        wrong = [list(_differ(frame, strip, one)) for one in rows]
        for name in ("speed", "swing", "orbit", "pressure", "film", "spectrum"):
            found = [[words for what, words in one if what == name] for one in wrong]
            self.outcome.check(name, any(not one for one in found), f"{str(found)[:300]} {when}")

    def _modes(self, strip: dict[str, str], modes: dict[str, Any], own: dict[str, Any]) -> None:
        text = next((words for name, words in strip.items() if name.startswith("eigenvalue")), "")
        found = re.findall(r"[xy]: (-?[\d.]+) Hz, zeta (-?[\d.]+)", text)
        if not found:
            self.outcome.skipped["eigenvalue has a reason"] += 1
            return
        for (f, zeta), (own_f, own_zeta) in zip(found, own["modes"], strict=True):
            near = abs(float(f) - own_f) < 0.06 + 2e-3 * own_f and abs(float(zeta) - own_zeta) < 1.5e-3
            self.outcome.check("eigenvalue", near, f"{text} for {own['modes']} at {modes}")

    def _hit(self, strip: dict[str, str], reading: dict[str, Any], own: dict[str, Any]) -> None:
        text = strip.get("last hit", "")
        found = re.search(r"([\d.]+) ± ([\d.]+) Hz, zeta (-?[\d.]+) ± ([\d.]+)", text)
        if not found:
            self.outcome.reasons[text.split("last hit")[-1].strip()[2 if ": " in text else 0 :][:60]] += 1
            return
        if not own["linear"]:
            self.outcome.skipped["hit with forces that the linear model lacks"] += 1
            return
        f, df, zeta, dz = map(float, found.groups())
        near = [abs(f - one) <= df and abs(zeta - z) <= dz for one, z in own["ring"]]
        self.outcome.check("last hit", any(near), f"{text} for {own['ring']} at {own['speed']:.1f} rad/s")

    def close(self) -> None:
        """Close the page."""
        self.context.close()


def _differ(frame: dict[str, Any], strip: dict[str, str], own: dict[str, Any]) -> Any:
    """Name and sentence of each number that is not the plant's."""
    number = {name: [float(v) for v in re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", words.replace(name, "", 1))]
              for name, words in strip.items()}  # fmt: skip
    now = frame["now"]
    if abs(number["speed"][0] - own["speed"]) > 0.51:
        yield "speed", f"{strip['speed']} for {own['speed']}"
    if (
        now["swing"]
        and own["swing"]
        and max(abs(a - b) for a, b in zip(number["swing x, y"][:2], own["swing"], strict=True)) > 0.06
    ):
        yield "swing", f"{strip['swing x, y']} for {own['swing']}"
    if max(abs(frame["orbit"]["disc"][k][-1] - own["disc"][k]) for k in (0, 1)) > _moved(frame):
        yield "orbit", f"{[axis[-1] for axis in frame['orbit']['disc']]} for {own['disc']}"
    if "pressure" in strip and abs(number["pressure"][0] - own["pressure"]) > 6e-4:
        yield "pressure", f"{strip['pressure']} for {own['pressure']}"
    if "least film" in strip and abs(number["least film"][0] - own["h_min"]) > 0.06:
        yield "film", f"{strip['least film']} for {own['h_min']}"
    if frame["spectrum"] and "spectrum" in own:
        lines = frame["spectrum"][1:]
        far = max(abs(a - b) for a, b in zip(lines, own["spectrum"], strict=True))
        if far > 2e-3 + 1e-3 * max(own["spectrum"]):
            yield "spectrum", f"{far:.3g} um off, largest line {max(own['spectrum']):.3g}"


def _moved(frame: dict[str, Any]) -> float:
    """Most that the disc moves between two points of the orbit that is drawn [um]: its last point is a sample older."""
    return 0.02 + max(
        (abs(b - a) for axis in frame["orbit"]["disc"] for a, b in zip(axis[-20:], axis[-19:], strict=False)),
        default=0.0,
    )


def click(minutes: float, seed: int, machine: str = "dtu_gas_bearing", port: int = 8800) -> ClickCounts:
    """Outcome of some minutes on a rig of its own."""
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as folder, sync_playwright() as engine:
        server = Server(machine, Path(folder), port)
        browser = engine.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        try:
            clicker = Clicker(browser, server, seed)
            outcome = clicker.run(minutes)
            clicker.close()
        finally:
            browser.close()
            code = server.close()
        if code:
            outcome.wrong.append(f"the server ended with code {code}")
        return outcome


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=40.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--machine", default="dtu_gas_bearing")
    parser.add_argument("--port", type=int, default=8800)
    asked = parser.parse_args()
    outcome = click(asked.minutes, asked.seed, asked.machine, asked.port)
    print(json.dumps(outcome.plain(), indent=1))
    sys.exit(1 if outcome.wrong else 0)


if __name__ == "__main__":
    main()
