"""Eigenvalues of the plant at the point and with the effects that are set, computed beside the run."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rotorsim.errors import RotorsimError
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.equilibrium import settle
from rotorsim.plant.linearise import linearise

REST = 0.5
"""Seconds between two answers, so that the plant keeps its processor."""


@dataclass(frozen=True)
class Modes:
    """Frequency [Hz] and damping ratio of the lowest mode of each axis, or the reason why there is none."""

    frequency: tuple[float, ...] = ()
    zeta: tuple[float, ...] = ()
    why: str = ""


def modes_at(a: Assembly, speed: float, pressure: float) -> Modes:
    """Lowest modes at a speed [rad/s] and gauge pressure [Pa], without controller."""
    try:
        plant = linearise(a, settle(a, speed, pressure), speed)
    except RotorsimError as error:
        return Modes(why=str(error))
    except np.linalg.LinAlgError:
        return Modes(why="cannot be computed here")
    first = [plant.mode_of_axis(axis) for axis in range(2)]
    return Modes(tuple((plant.wn[first] / (2 * np.pi)).tolist()), tuple(plant.zeta[first].tolist()))


class Watcher:
    """Keeps modes up to date in a thread of its own: only the newest question is answered."""

    def __init__(self, answer: Callable[[Modes], None]) -> None:
        self._answer, self._question = answer, threading.Condition()
        self._asked: tuple[Any, ...] | None = None
        self._over = False
        self._thread = threading.Thread(target=self._work, name="eigenvalues", daemon=True)
        self._thread.start()

    def ask(self, a: Assembly, speed: float, pressure: float) -> None:
        """Ask for the modes of an assembly whose record and workspace are copied here."""
        own = replace(a, record=a.record.copy(), w=a.w.copy())
        with self._question:
            self._asked = (own, speed, pressure)
            self._question.notify()

    def close(self) -> None:
        """End the thread."""
        with self._question:
            self._over = True
            self._question.notify()
        self._thread.join(timeout=5.0)

    def _work(self) -> None:
        while True:
            with self._question:
                self._question.wait_for(lambda: self._over or self._asked is not None)
                if self._over:
                    return
                asked, self._asked = self._asked, None
            assert asked is not None
            self._answer(modes_at(*asked))
            with self._question:
                self._question.wait_for(lambda: self._over, timeout=REST)
