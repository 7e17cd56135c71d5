"""Alarm messages of a running law, one sentence per code that `guard` writes."""

from __future__ import annotations

import numpy as np

from rotorsim.control.runtime import guard

HELD = "the output is held, fades out within 105 samples and comes back with the samples"
TRIES = "the output fades out and the law tries to come back after 0.1 s at 5 kHz, later each time it fails"
SENTENCES = {
    guard.SENSOR: f"the measured displacement is not a number: {HELD}; check the sensors",
    guard.POINT: f"speed or pressure, over which the law is scheduled, is not a number: {HELD}; check its measurement",
    guard.OVERFLOW: "the law's own states overflowed and start again from rest: it is unstable; design it again",
    guard.JUMP: f"the measured displacement jumped further than a rotor moves in a sample: {TRIES}; check the sensors",
    guard.STUCK: f"a sensor has shown one and the same value for long: {HELD}; check the sensors",
    guard.POINT_FAR: "speed or pressure, over which the law is scheduled, jumped or left its limits: "
    f"{HELD}; check its measurement",
    guard.RANGE: "the measured displacement is out of its range about the centre: the output fades out within 40 "
    "samples and comes back with the samples; check the sensors",
    **{
        guard.CONNECTION + k: f"{way}, as the model the law was designed on shows: {TRIES}; check the wiring"
        for k, way in enumerate(
            (
                "the sensor of x is reversed",
                "the sensor of y is reversed",
                "both sensors are reversed",
                "the sensors of x and y are swapped",
            )
        )
    },
    guard.UNSTEADY: f"samples are missing or implausible again and again: {TRIES}; check the sensors",
}
"""Sentence of each alarm code; code 0 is no alarm."""


def code(memory: np.ndarray, at: int) -> int:
    """Alarm code of a law now; `at` is where its memory holds what the guard keeps."""
    return int(memory[at + guard.ALARM])


def past(memory: np.ndarray, at: int) -> str:
    """A sentence about all bad samples since the start; empty if there were none."""
    lost = int(memory[at + guard.LOST])
    return f"{lost} bad samples; the last: {SENTENCES[memory[at + guard.LAST]]}" if lost else ""
