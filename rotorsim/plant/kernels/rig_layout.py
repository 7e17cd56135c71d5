"""Memory layout of drive, supply line, actuators, sensors and the effects' own states."""

from __future__ import annotations

from typing import NamedTuple

SCALARS = ("seed", "tick", "begin", "command", "ripple", "line", "line_end", "held_x", "held_y",
           "impulse", "torque_old", "torque_mid")  # fmt: skip
READINGS = 6
"""Disc x, y [m], shaft angle [rad], speed [rad/s], gauge pressure [Pa], angle of the probes' ring [rad]."""

AROUND = 12
"""x, y of the housing and of the foundation: displacement [m], velocity [m/s] and acceleration [m/s^2] of each."""


class RigLayout(NamedTuple):
    """Sizes and offsets (in doubles); `n_...` are numbers of effects of a port; `driven`: piezos move the pins.

    seed, tick (number of the sample), begin (its time [s]); command and ripple [rad/s] of the drive; line and line_end,
    supply pressure [Pa, absolute] at both ends of the sample; impulse [N m s] that rub and contact have given the shaft
    since the sample's start, their torque [N m] at the start and in the middle of a step; clearance [m], mean gap of
    each film; uneven [m], how much it varies; heat, rises [K] of gas, journal and sleeve of each film; held: reference
    [V]. n_inj injectors of all films, n_pin of them with a pin.
    """

    n_inj: int
    n_pin: int
    driven: int
    substeps: int
    n_motion: int
    n_film: int
    n_gas: int
    n_heat: int
    n_injector: int
    n_plenum: int
    n_supply: int
    n_sensor: int
    n_braking: int
    n_stroke_states: int
    n_probe: int
    seed: int
    tick: int
    begin: int
    command: int
    ripple: int
    line: int
    line_end: int
    clearance: int
    uneven: int
    heat: int
    held_x: int
    held_y: int
    impulse: int
    torque_old: int
    torque_mid: int
    pin: int
    nodes: int
    rates: int
    volt: int
    stroke: int
    lead: int
    travel: int
    rest: int
    table: int
    old: int
    new: int
    reading: int
    motion: int
    probe: int
    around: int
    states: int
    size: int


def make_rig_layout(
    base: int,
    n_films: int,
    n_inj: int,
    n_pin: int,
    driven: int,
    substeps: int,
    ports: dict[str, int],
    n_stroke_states: int,
    n_states: int,
    n_probe: int = 0,
    n_machine: int = 0,
    n_braking: int = 0,
) -> RigLayout:
    """Layout from offset `base`; `ports` counts the effects of each port, `n_states` their own states in all,
    `n_braking` the effects that brake the shaft.

    Each of the `n_probe` probes has a row of factors: of displacement, velocity and acceleration of the `n_machine`
    coordinates of shaft and housings, and of the motion `around` the shaft (see `outputs.read_probes`).
    """
    n = max(n_inj, 1)
    sizes = dict.fromkeys(SCALARS, 1) | dict.fromkeys(("pin", "volt", "stroke", "lead", "travel", "rest"), n)
    sizes |= dict.fromkeys(("clearance", "uneven"), max(n_films, 1))
    sizes |= {"heat": 3 * max(n_films, 1)}
    sizes |= {"nodes": n * (substeps + 1), "rates": n * (substeps + 1), "table": 5 * n}
    sizes |= dict.fromkeys(("old", "new"), max(n * n_stroke_states, 1))
    sizes |= {"reading": READINGS, "motion": max(16 * ports["motion"], 1), "probe": n_probe * (3 * n_machine + AROUND)}
    sizes |= {"around": AROUND if n_probe else 0, "states": max(n_states, 1)}
    offsets, at = {}, base
    for name, size in sizes.items():
        offsets[name], at = at, at + (size if name in SCALARS else (size + 7) // 8 * 8)
    counted = ("motion", "film", "gas", "heat", "injector", "plenum", "supply", "sensor")
    counts = {f"n_{port}": ports[port] for port in counted}
    # warm walls shape the gap, warm gas changes the viscosity
    counts["n_film"], counts["n_gas"] = ports["film"] + ports["heat"], ports["gas"] + ports["heat"]
    return RigLayout(
        n_inj=n_inj, n_pin=n_pin, driven=driven, substeps=substeps, n_stroke_states=n_stroke_states, n_probe=n_probe,
        n_braking=n_braking, size=(at + 7) // 8 * 8,
        **counts, **offsets,
    )  # fmt: skip
