"""Figures and report sections of identification against physics, and their JSON form."""

from typing import Any

import numpy as np

from rotorsim.base.units import TO_UM
from rotorsim.report.control import ComparedQuantity, fits_by_model, over_speed
from rotorsim.report.page import Block
from rotorsim.study.identification_vs_physics import HEADS, Study, rows, summary

DERIVED = (
    ("f1 [Hz]", "wn", (0,), 1 / (2 * np.pi)), ("f2 [Hz]", "wn", (1,), 1 / (2 * np.pi)),
    ("zeta 1", "zeta", (0,), 1.0), ("zeta 2", "zeta", (1,), 1.0),
    ("Gxx [um/V]", "static_gain", (0, 0), TO_UM), ("Gyy [um/V]", "static_gain", (1, 1), TO_UM),
    ("Gxy [um/V]", "static_gain", (0, 1), TO_UM), ("Gyx [um/V]", "static_gain", (1, 0), TO_UM),
    ("delay x [ms]", "delay", (0,), 1e3), ("delay y [ms]", "delay", (1,), 1e3),
)  # fmt: skip
UNITS = {"K": "1/s^2", "D": "1/s", "B": "m/(s^2 V)"}


def figures(study: Study) -> list[tuple[str, str, Any]]:
    """Title, sentence and figure of each."""

    def values(things: Any, key: str, index: tuple[int, ...], scale: float) -> np.ndarray:
        return np.array([np.asarray(getattr(thing, key))[index] for thing in things]) * scale

    seconds, derived, elements = [point.found["2"] for point in study.points], [], []
    for title, key, index, scale in DERIVED:
        shown = {"Model 3": values(study.results, key, index, scale),
                 "physics": values(study.physics, key, index, scale),
                 "Model 2": values(seconds, key, index, scale)}  # fmt: skip
        derived.append(ComparedQuantity(title, shown, _surface(study, key, index, scale)))
    for i, name in enumerate(study.lpv.parameters[:12]):
        shown = {"Model 3": np.array([r.theta[i] for r in study.results]),
                 "physics": np.array([p.KDB[i] for p in study.physics])}  # fmt: skip
        elements.append(ComparedQuantity(f"{name} [{UNITS[name[0]]}]", shown, _element(study, i)))
    return [
        ("Frequencies, damping, gains, delays", "Dots: Model 3 from records; lines: its second-order surfaces; "
         "diamonds: Model 2; crosses: linearised physics. A delay of Model 3 holds the actuators too, the others' is "
         "the film's.", over_speed(study.q, derived)),
        ("K, D, B", "Dots: Model 3 from records; lines: its surfaces; crosses: K, D, B that come closest to the "
         "response of the linearised plant, least squares.", over_speed(study.q, elements)),
        ("Which model", "Fit on the second record, mean of x and y: black-box models of orders 4 to 8, Models 1 to 3, "
         "and the most that the sensors' noise allows.", fits_by_model(study.sweep)),
    ]  # fmt: skip


def _surface(study: Study, key: str, index: tuple[int, ...], scale: float) -> Any:
    return lambda speed, pressure: float(study.lpv.derived(speed, pressure)[key][index] * scale)


def _element(study: Study, i: int) -> Any:
    return lambda speed, pressure: float(study.lpv.theta(speed, pressure)[i])


def identification_blocks(found: Study) -> list[Block]:
    """Sections of identification against physics."""
    errors = [(kind, name, value) for kind, table in summary(found).items() for name, value in table.items()]
    units = "Hz, um/V, ms, %. A delay of Model 3 holds actuators and film, the physics' the film alone."
    blocks = [
        Block("Identified models against the physics", "Errors over the grid in per cent. One lag for actuators and "
              "film lowers the damping and raises the gain of Model 3; Model 2 knows the pins.",
              ("model", "error", "%"), errors),
        *(Block(title, text, figure=figure) for title, text, figure in figures(found)),
        Block("Model 3, point by point", units, HEADS, rows(found)),
        Block("Model 2, point by point", "Hz, um/V, ms, %.", HEADS, rows(found, "2")),
    ]  # fmt: skip
    if found.failed:
        blocks.append(Block("Records that could not be identified", "", ("",), [(text,) for text in found.failed]))
    return blocks
