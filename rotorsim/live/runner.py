"""Rig in real time: a thread with a clock, a queue of orders, computations in the background, frames for the pages.

A plant that falls behind the clock does not catch up: the real-time factor shows it. Orders wait in a queue of bounded
length and act between two blocks of samples, at most 10 ms apart. Of each kind of computation only the newest request
is answered.
"""

import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rotorsim.base.errors import RotorsimError
from rotorsim.live.frame import Geometry, eigenvalues_shown, hit_shown, make_frame
from rotorsim.live.laws import DECAY, FEWEST, StabilityVerdict
from rotorsim.live.modes import BEFORE, LEAD, RING, RigModes, RingdownReading, modes_at, own_copy, read_ringdown
from rotorsim.live.records import Recorder, Replay
from rotorsim.live.rig import Rig
from rotorsim.live.settings import OFF, PACES

BLOCK = 50
"""Most samples at a time: 10 ms of a rig of 5 kHz."""
BEHIND = 0.05
"""Seconds of the plant that may wait before they are given up."""
SPAN = 0.5
"""Seconds over which the real-time factor is taken."""
REST = 0.01


class Pacer:
    """Number of samples due by the clock, and the real-time factor."""

    def __init__(self, Ts: float) -> None:
        self._Ts = Ts
        self._last, self._credit = time.monotonic(), 0.0
        self._marks: deque[tuple[float, int]] = deque([(self._last, 0)])

    def due(self, pace: float) -> int:
        """Samples to compute now for a pace (1 is real time, infinity as fast as possible); 0 after a short rest."""
        now = time.monotonic()
        passed, self._last = now - self._last, now
        if pace == float("inf"):
            self._credit = 0.0
            return BLOCK
        self._credit = min(self._credit + passed * pace, BEHIND)
        block = max(min(round(BLOCK * pace), BLOCK), 1)
        if pace > 0 and self._credit >= block * self._Ts:
            self._credit -= block * self._Ts
            return block
        time.sleep(min((block * self._Ts - self._credit) / pace, REST) if pace > 0 else REST)
        return 0

    def count(self, samples: int) -> None:
        """Note that samples were computed."""
        self._marks.append((time.monotonic(), self._marks[-1][1] + samples))
        while len(self._marks) > 2 and self._marks[-1][0] - self._marks[1][0] > SPAN:
            self._marks.popleft()

    @property
    def factor(self) -> float:
        """Seconds of the plant per second of the clock, lately."""
        (begin, before), (end, after) = self._marks[0], self._marks[-1]
        return (after - before) * self._Ts / (end - begin) if end > begin else 0.0


PAUSE = 0.1
"""Seconds between two answers, so that the plant keeps its processor."""


class Aside:
    """Runs the newest job of each kind, one at a time; `failed` receives kind and error of a failed job."""

    def __init__(self, failed: Callable[[str, Exception], None]) -> None:
        self._failed = failed
        self._change = threading.Condition()
        self._jobs: dict[str, Callable[[], None]] = {}
        self._over = False
        self._thread = threading.Thread(target=self._work, name="aside", daemon=True)
        self._thread.start()

    def ask(self, kind: str, job: Callable[[], None]) -> None:
        """Leave a job in place of one of the same kind that has not begun."""
        with self._change:
            self._jobs[kind] = job
            self._change.notify()

    def close(self) -> None:
        """End after the job under way, which is not waited for."""
        with self._change:
            self._over = True
            self._jobs.clear()
            self._change.notify()

    def _work(self) -> None:
        while True:
            with self._change:
                self._change.wait_for(lambda: self._over or self._jobs)
                if self._over:
                    return
                kind = next(iter(self._jobs))
                job = self._jobs.pop(kind)
            try:
                job()
            except Exception as error:  # the thread must live on
                self._failed(kind, error)
            with self._change:
                self._change.wait_for(lambda: self._over, timeout=PAUSE)


PART = 10
"""Samples that are computed at a time."""
PATIENCE = 0.03
"""Seconds after which a block of samples is left for the next orders."""
ORDERS = 1000
"""Orders that can wait; more are refused."""


class Runner:
    """Rig in real time; all public methods are thread-safe.

    Examples
    --------
    >>> import rotorsim as rs
    >>> runner = rs.live.Runner(rs.live.Rig(machine, {}))
    >>> runner.start()
    >>> runner.close()
    """

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.geometry = _geometry(rig)
        self.replay: Replay | None = None
        self.recorder: Recorder | None = None
        self.modes: tuple[int, RigModes] = (-1, RigModes())
        self.reading: tuple[int, float, RingdownReading] = (-1, 0.0, RingdownReading())
        """Last reading of a hit with its epoch and speed; `modes` have their epoch."""
        self._pacer = Pacer(rig.Ts)
        self._orders: queue.Queue[Callable[[], None]] = queue.Queue(ORDERS)
        self._lock = threading.Lock()
        self._over = threading.Event()
        self._asked: tuple[Any, ...] = ()
        self._aside = Aside(self._failed)
        self._wanted, self._waits = OFF, False
        self._thread = threading.Thread(target=self._work, name="plant", daemon=True)

    def start(self) -> None:
        """Begin to run."""
        self._thread.start()

    def close(self) -> None:
        """End; a record under way is finished."""
        self._over.set()
        if self._thread.is_alive():
            self._thread.join(timeout=10.0)
        self._aside.close()
        self.stop_recording()

    def order(self, what: Callable[[], None]) -> bool:
        """Leave an order for the plant's thread; false if too many wait."""
        try:
            self._orders.put_nowait(what)
        except queue.Full:
            return False
        return True

    def set(self, key: str, value: Any) -> bool:
        """Order a setting; see `Rig.set`."""
        return self.order(lambda: self.apply(key, value))

    def toggle_pause(self) -> bool:
        """Order a pause, or the pace before it."""
        return self.order(self.rig.toggle_pause)

    def strike(self, axis: int) -> bool:
        """Order a hit."""
        return self.order(lambda: self.rig.strike(axis))

    def restore_effects(self) -> bool:
        """Order the effects of the machine file."""
        return self.order(lambda: self.arrange(self.rig.settings.file))

    def reset(self) -> bool:
        """Order the equilibrium."""
        return self.order(self._reset)

    def record(self, path: Path) -> bool:
        """Order that what follows is recorded."""
        return self.order(lambda: self._record(path))

    def play(self, replay: Replay | None) -> bool:
        """Order a replay in place of the plant, or the plant again; a film on another grid is left out."""
        if replay is not None and not replay.geometry.alike(self.geometry):
            replay.drop_film()
            self.rig.notify(f"{replay.name}: its film is on another grid than this rig's and is not drawn")
        return self.order(lambda: setattr(self, "replay", replay))

    def frame(self) -> dict[str, Any]:
        """Present frame for the page."""
        with self._lock:
            frame = self.replay.frame(self.rig.shown) if self.replay else self._rig_frame()
            frame["status"] = self._status()
        return frame

    def stop_recording(self) -> None:
        """Finish the record under way."""
        with self._lock:
            if self.recorder is not None:
                self._finish(self.recorder)

    def _finish(self, recorder: Recorder) -> None:
        """Close a record and report its content; a disk that takes no more ends the record, not the run."""
        self.recorder = None
        try:
            recorder.close()
            self.rig.notify(f"{recorder.seconds:.1f} s recorded in {recorder.path}")
        except OSError as error:
            kept = f"{recorder.seconds:.1f} s are in {recorder.path}" if recorder.kept else "nothing was kept"
            self.rig.notify(f"the record ends here: {error}; {kept}")

    def _rig_frame(self) -> dict[str, Any]:
        rig = self.rig
        pressure = rig.simulation.film_pressure(rig.shown) if rig.has_film else None
        return make_frame(
            rig.history.last(10**9), pressure, self.geometry, rig.simulation.samples * rig.Ts, rig.rest, rig.shown
        )

    def _status(self) -> dict[str, Any]:
        replay = self.replay
        return {
            "factor": round(self._pacer.factor, 2), "revision": self.rig.settings.revision, "stopped": self.rig.stopped,
            "sentence": self.rig.sentences, "epoch": self.rig.epoch,
            "recording": None if self.recorder is None else round(self.recorder.seconds, 1),
            "replay": None if replay is None else [replay.name, round(replay.seconds, 2), replay.duration],
            "reading": hit_shown(self.rig, self.reading, replay is not None),
            "modes": eigenvalues_shown(self.rig, self.modes, replay is not None),
            "checking": "" if self._wanted == OFF else self._wanted, "alarm": self.rig.alarm,
        }  # fmt: skip

    def _work(self) -> None:
        while not self._over.is_set():
            self._obey()
            samples = self._pacer.due(PACES[self.rig.settings.positions["pace"]])
            self._pacer.count(self._advance(samples) if samples else 0)

    def _obey(self) -> None:
        for _ in range(self._orders.qsize()):
            what = self._orders.get_nowait()
            with self._lock:
                try:
                    what()
                except Exception as error:  # the plant's thread must live on
                    self.rig.notify(_sentence(error))
        self._watch()

    def _advance(self, samples: int) -> int:
        """Run on by this many samples at most: by fewer if each is hard, so that orders are not kept waiting."""
        begin, moved = time.monotonic(), 0
        while moved < samples and time.monotonic() - begin < PATIENCE:
            with self._lock:
                part = self._part(min(PART, samples - moved))
            if not part:
                break
            moved += part
        return moved

    def _part(self, samples: int) -> int:
        if self.replay is not None:
            return self.replay.advance(samples)
        try:
            before = self.rig.loop
            new = self.rig.advance(samples)
            self._write(new)
            if before is not self.rig.loop:
                self._note("controller")
            self._listen()
        except Exception as error:  # the plant's thread must live on
            self.rig.stopped = f"{_sentence(error)}; reset starts it again"
            self.rig.notify(self.rig.stopped)
            return 0
        return len(new)

    def _write(self, new: np.ndarray) -> None:
        """Record what is new."""
        if self.recorder is None:
            return
        try:
            self.recorder.write(new)
        except (RotorsimError, OSError):
            self._finish(self.recorder)

    def apply(self, key: str, value: Any) -> None:
        """Set something now and note it in the record; for orders only. A controller is checked while the rig runs."""
        if key == "controller":
            self._wanted = OFF
            if isinstance(value, str) and self.rig.laws.get(value) is not None:
                self._want(value)
                return
        self.rig.set(key, value)
        self._note(key)

    def _want(self, name: str) -> None:
        """Switch a controller on once it is known to hold the point, and the motion there was seen for long enough."""
        self._wanted, self._waits = name, self.rig.seen < DECAY + FEWEST
        if not self._waits:
            self._check(name)

    def _check(self, name: str) -> None:
        work, epoch = self.rig.check(name), self.rig.epoch

        def switch(verdict: StabilityVerdict) -> None:
            if self._wanted != name:
                return
            if self.rig.epoch != epoch:
                self._want(name)  # the verdict is of settings that have changed since
            else:
                self._wanted = OFF
                self.rig.switch_on(name, verdict)
                self._note("controller")

        def check() -> None:
            verdict = work()
            self.order(lambda: switch(verdict))

        self._aside.ask("law", check)

    def _failed(self, kind: str, error: Exception) -> None:
        """A computation that failed: its question counts as answered; for the other thread."""

        def end() -> None:
            if kind == "law":
                self._wanted = OFF
            elif kind == "reading":
                self.reading = (*self.reading[:2], replace(self.reading[2], why="it could not be read"))
            else:
                self.modes = self.rig.epoch, RigModes(why="cannot be computed here")
            self.rig.notify(_sentence(error))

        self.order(end)

    def _note(self, key: str) -> None:
        if self.recorder is not None:
            kept = self.rig.settings.everything().get(key)
            if kept is not None:
                self.recorder.note(key, kept)

    def arrange(self, values: Mapping[str, float | str]) -> None:
        """Set much at once and note it in the record; for orders only."""
        before = self.rig.settings.everything()
        self.rig.put_all({key: value for key, value in values.items() if before.get(key) != value})
        if self.recorder is not None:
            for key, kept in self.rig.settings.everything().items():
                if kept != before[key]:
                    self.recorder.note(key, kept)

    def _reset(self) -> None:
        if self.recorder is not None:
            self.rig.notify("a record cannot jump; stop recording before a reset")
        else:
            self.stand()

    def stand(self) -> bool:
        """Stand at the equilibrium of what is set, and check the controller there; for orders only."""
        name = self._wanted if self._wanted != OFF else str(self.rig.settings.positions["controller"])
        self.rig.set("controller", OFF)
        done = self.rig.reset()
        if name != OFF:
            self.apply("controller", name)
        return done

    def _record(self, path: Path) -> None:
        if self.recorder is None:
            self.recorder = Recorder(self.rig, path)

    def _listen(self) -> None:
        """Have a hit read once its ring-down is complete."""
        rig, hit = self.rig, self.rig.hit
        if hit is None or rig.simulation.samples < hit.sample + LEAD + RING:
            return
        rig.hit = None
        epoch, speed, name = rig.epoch, rig.speed, "xy"[hit.axis]
        rows = rig.history.last(rig.simulation.samples - hit.sample + BEFORE)[: BEFORE + LEAD + RING].copy()
        if hit.sample - rig.since < BEFORE:
            self.reading = (
                epoch,
                speed,
                RingdownReading(name, why=f"{rig.change} within {BEFORE * rig.Ts:g} s of the hit"),
            )
            return
        clearance, limit, Ts = rig.clearance, rig.limit, rig.Ts

        def read() -> None:
            self.reading = epoch, speed, read_ringdown(rows, hit.axis, clearance, limit, Ts)

        self.reading = epoch, speed, RingdownReading(name, why="being read")
        self._aside.ask("reading", read)

    def _watch(self) -> None:
        """Ask for new eigenvalues when the point or an effect has changed, and for a check that waits for samples."""
        rig = self.rig
        if self._waits and self._wanted != OFF and rig.seen >= DECAY + FEWEST:
            self._want(self._wanted)
        question = (round(rig.speed / 5.0), rig.pressure, rig.epoch)
        if question == self._asked or self.replay is not None:
            return
        self._asked = question
        a, speed, pressure, epoch = own_copy(rig.assembly), rig.speed, rig.pressure, rig.epoch

        def find() -> None:
            self.modes = epoch, modes_at(a, speed, pressure)

        self._aside.ask("modes", find)


def _sentence(error: Exception) -> str:
    if isinstance(error, (RotorsimError, OSError)):
        return str(error)
    return f"{type(error).__name__}: {error}; this is a fault of the program"


def _geometry(rig: Rig) -> Geometry:
    if rig.assembly.film_model is None:
        return Geometry.of(rig.machine, np.zeros(0), np.zeros(0))
    grids = [film.grid for film in rig.assembly.films]
    return Geometry.of(rig.machine, grids[0].theta, np.array([grid.z for grid in grids]))
