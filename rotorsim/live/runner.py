"""Runs a rig beside the clock in a thread of its own; pages ask for frames and leave orders.

A plant that falls behind the clock does not try to catch up: the real-time factor tells. Orders wait in a queue of
bounded length and act between two blocks of samples, at most 10 ms apart.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorsim.errors import RotorsimError
from rotorsim.live.eigenvalue import Modes, Watcher
from rotorsim.live.frame import Geometry, make_frame
from rotorsim.live.operating import PACES
from rotorsim.live.pacer import Pacer
from rotorsim.live.recorder import Recorder
from rotorsim.live.replay import Replay
from rotorsim.live.rig import Rig
from rotorsim.live.ringdown import WAIT, Reading, read_ringdown
from rotorsim.machine.numerics import SAMPLE

if TYPE_CHECKING:
    import numpy as np

PART = 10
PATIENCE = 0.03
"""Samples at a time, and seconds after which a block is left for the next orders."""
ORDERS = 1000
"""Orders that can wait; more are refused."""


class Runner:
    """A rig with a clock; everything public may be called from any thread."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.geometry = _geometry(rig)
        self.replay: Replay | None = None
        self.recorder: Recorder | None = None
        self.modes, self.reading = Modes(), Reading("")
        self._pacer = Pacer()
        self._orders: queue.Queue[Callable[[], None]] = queue.Queue(ORDERS)
        self._lock = threading.Lock()
        self._over = threading.Event()
        self._asked: tuple[Any, ...] = ()
        self._watcher = Watcher(self._keep_modes)
        self._thread = threading.Thread(target=self._work, name="plant", daemon=True)

    def start(self) -> None:
        """Begin to run."""
        self._thread.start()

    def close(self) -> None:
        """End; a record under way is finished."""
        self._over.set()
        if self._thread.is_alive():
            self._thread.join(timeout=10.0)
        self._watcher.close()
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

    def strike(self, axis: int) -> bool:
        """Order a hit."""
        return self.order(lambda: self.rig.strike(axis))

    def restore_effects(self) -> bool:
        """Order the effects of the machine file."""
        return self.order(self._restore_effects)

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
            self.rig.say(f"{replay.name}: its film is on another grid than this rig's and is not drawn")
        return self.order(lambda: setattr(self, "replay", replay))

    def frame(self) -> dict[str, Any]:
        """What a page draws now."""
        with self._lock:
            frame = self.replay.frame() if self.replay else self._rig_frame()
            frame["status"] = self._status()
        return frame

    def stop_recording(self) -> None:
        """Finish the record under way."""
        with self._lock:
            if self.recorder is not None:
                recorder, self.recorder = self.recorder, None
                recorder.close()
                self.rig.say(f"{recorder.seconds:.1f} s recorded in {recorder.path}")

    def _rig_frame(self) -> dict[str, Any]:
        rig = self.rig
        pressure = rig.simulation.film_pressure() if rig.has_film else None
        return make_frame(rig.history.last(10**9), pressure, self.geometry, rig.simulation.samples * SAMPLE, rig.rest)

    def _status(self) -> dict[str, Any]:
        reading, modes = self.reading, self.modes
        replay = self.replay
        return {
            "factor": round(self._pacer.factor, 2), "revision": self.rig.settings.revision, "stopped": self.rig.stopped,
            "sentence": self.rig.sentences,
            "recording": None if self.recorder is None else round(self.recorder.seconds, 1),
            "replay": None if replay is None else [replay.name, round(replay.at * SAMPLE, 2), replay.samples * SAMPLE],
            "reading": [reading.axis, round(reading.frequency, 1), round(reading.zeta, 4), reading.why],
            "modes": [[round(f, 1) for f in modes.frequency], [round(z, 4) for z in modes.zeta], modes.why],
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
                    self.rig.say(_sentence(error))
        self._watch()

    def _advance(self, samples: int) -> int:
        """Run on by at most so many samples: by fewer if each of them is hard, so that orders are not kept waiting."""
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
            new = self.rig.advance(samples)
            self._write(new)
            self._listen()
        except Exception as error:  # the plant's thread must live on
            self.rig.stopped = f"{_sentence(error)}; reset goes on"
            self.rig.say(self.rig.stopped)
            return 0
        return len(new)

    def _write(self, new: np.ndarray) -> None:
        """Record what is new; a disk that takes no more ends the record, not the run."""
        if self.recorder is None:
            return
        try:
            self.recorder.write(new)
        except (RotorsimError, OSError) as error:
            self.recorder = None
            self.rig.say(f"the record ends here: {error}")

    def apply(self, key: str, value: Any) -> None:
        """Set something now and note it in the record; for orders only."""
        self.rig.set(key, value)
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

    def _restore_effects(self) -> None:
        self.arrange(self.rig.settings.file)

    def _reset(self) -> None:
        if self.recorder is not None:
            self.rig.say("a record cannot jump; stop recording before a reset")
        else:
            self.rig.reset()

    def _record(self, path: Path) -> None:
        if self.recorder is None:
            self.recorder = Recorder(self.rig, path)

    def _listen(self) -> None:
        """Take the reading of a blow once its ring-down is complete."""
        impact = self.rig.impact
        if impact is None or self.rig.simulation.samples < impact[0] + WAIT:
            return
        passed = self.rig.simulation.samples - impact[0]
        rows = self.rig.history.last(passed)
        self.rig.impact = None
        if len(rows) >= WAIT:
            self.reading = read_ringdown(rows[:WAIT].copy(), impact[1])

    def _watch(self) -> None:
        """Ask for new eigenvalues when the point or an effect has changed."""
        rig = self.rig
        question = (round(rig.speed / 5.0), rig.pressure, rig.settings.revision)
        if question != self._asked and self.replay is None:
            self._asked = question
            self._watcher.ask(rig.assembly, rig.speed, rig.pressure)

    def _keep_modes(self, modes: Modes) -> None:
        self.modes = modes


def _sentence(error: Exception) -> str:
    if isinstance(error, (RotorsimError, OSError)):
        return str(error)
    return f"{type(error).__name__}: {error}; this is a fault of the program"


def _geometry(rig: Rig) -> Geometry:
    import numpy as np

    if rig.assembly.film_model is None:
        return Geometry.of(rig.machine, np.zeros(0), np.zeros(0))
    grid = rig.assembly.film_model.grid
    return Geometry.of(rig.machine, grid.theta, grid.z)
