"""Alarm messages of a running law, one sentence per code that `guard` writes."""

from __future__ import annotations

import numpy as np

from rotorsim.control.runtime import guard

HELD = "the output is held, fades out within 105 samples and comes back with the samples"
SENTENCES = {
    guard.SENSOR: f"the measured displacement is not a number: {HELD}; check the sensors",
    guard.POINT: f"speed or pressure, over which the law is scheduled, is not a number: {HELD}; check its measurement",
    guard.OVERFLOW: "the law's own states overflowed and start again from rest: it is unstable; design it again",
}
"""By alarm code; 0: no alarm."""


def code(memory: np.ndarray, at: int) -> int:
    """Alarm code of a law now; `at` is where its memory holds what the guard keeps."""
    return int(memory[at + guard.ALARM])


def past(memory: np.ndarray, at: int) -> str:
    """A sentence about all bad samples since the start; empty if there were none."""
    lost = int(memory[at + guard.LOST])
    return f"{lost} bad samples; the last: {SENTENCES[memory[at + guard.LAST]]}" if lost else ""
