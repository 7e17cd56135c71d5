"""Columns of the two tables of a run: inputs that are held over a sample, and what a sample gives.

A row of inputs has six columns: speed [rad/s] that is reached at the sample's end (NaN: the drive is off), supply
pressure [Pa, gauge; absolute in the kernels], references x, y [V], force on the disc x, y [N]. A row of the sample
table has `COLUMNS`, which all machines have, then the travel [m] of each pin and, where pins have sensors, the reading
[m] of each, the reading of each probe, `FILM_COLUMNS` for each of several films and `HEAT_COLUMNS` for each film that
friction heats.

Memory layout of the rotor.

Memory layout of drive, supply line, actuators, sensors and the effects' own states.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from reynolds.grid import Layout

SPEED, SUPPLY, REFERENCE, FORCE, N_INPUTS = 0, 1, slice(2, 4), slice(4, 6), 6
"""Places in a row of inputs, and their number."""
COLUMNS = (
    "disc_x", "disc_y", "journal_x", "journal_y", "angle", "speed", "pressure", "film_force_x", "film_force_y",
    "h_min", "mass_flow", "contact", "disc_measured_x", "disc_measured_y", "angle_measured", "speed_measured",
    "pressure_measured",
)  # fmt: skip
"""Columns that all machines have: [m], angle [rad], speed [rad/s], gauge pressure [Pa], force [N], h_min [m], flow
[kg/s], contact 0 or 1."""
AT = {name: place for place, name in enumerate(COLUMNS)}
"""Place of each of `COLUMNS`."""
AT_JOURNAL, AT_ANGLE, AT_SPEED, AT_PRESSURE = AT["journal_x"], AT["angle"], AT["speed"], AT["pressure"]
AT_FORCE, AT_GAP, AT_FLOW, AT_CONTACT = AT["film_force_x"], AT["h_min"], AT["mass_flow"], AT["contact"]
"""The same as numbers for the kernels; the disc is at 0."""
READ = AT["disc_measured_x"]
"""First of the columns that sensors read."""
DISC, DISC_READ = slice(0, 2), slice(READ, READ + 2)
"""True and measured displacement x, y [m] of the disc in a row."""
ANGLE_READ, SPEED_READ, PRESSURE_READ = AT["angle_measured"], AT["speed_measured"], AT["pressure_measured"]
"""Measured shaft angle [rad], speed [rad/s] and gauge pressure [Pa] in a row."""
FILM_COLUMNS = 6
"""Columns of each of several films: journal x, y [m], film force x, y [N], smallest thickness [m], mass flow [kg/s]."""
HEAT_COLUMNS = 3
"""Columns of each film that friction heats: rises of gas, journal and sleeve [K]."""


def inputs_of(rows: np.ndarray) -> np.ndarray:
    """Inputs (n, N_INPUTS) of rows that hold them behind the sample table."""
    return rows[:, -N_INPUTS:]


def film_columns(n_films: int, heated: bool = False) -> int:
    """Columns at the end of the table for films one by one; of a single film its temperatures at most."""
    return (FILM_COLUMNS * n_films if n_films > 1 else 0) + (HEAT_COLUMNS * n_films if heated else 0)


VECTORS = ("q", "v", "q_old", "v_old", "a_old", "q_mid", "v_mid", "q_rhs", "v_rhs", "f", "free")
MATRICES = ("K", "C", "G", "T", "TK", "KT", "KS", "N")
ROTOR_SCALARS = (
    "time", "angle", "turns", "speed", "acceleration", "order", "matrix_speed", "matrix_step",
    "disc_fx", "disc_fy", "touched", "substeps", "largest", "error",
)  # fmt: skip
PAIRS = ("journal_start", "journal_free", "journal_before", "journal_force", "contact_push")
"""x, y of every journal: what the stage starts from, where it goes without a force, where it was before a correction,
the force on it, the contact's part of it at no displacement."""
FILM_MATRICES = {"compliance": "journal_b", "journal_a": "journal_a", "static_a": "static_a"}
FILM_PAIRS = {"journal_rhs": "journal_rhs", "static_rhs": "static_rhs"}
"""Matrices (2f, 2f) and right-hand sides (2f) of all journals; those of a single film lie in the film's own part."""


class RotorLayout(NamedTuple):
    """Sizes and offsets (in doubles) of the rotor's part of a workspace.

    `struck`: the (2, n) rows of the place where the external force acts, that of the disc unless a run moves it.
    largest: the largest part of a step that contact leaves, 0 before the first; error: the largest of a step's parts.
    """

    n: int
    n_machine: int
    n_housings: int
    n_films: int
    turning: int
    n_tables: int
    n_points: int
    q: int
    v: int
    q_old: int
    v_old: int
    a_old: int
    q_mid: int
    v_mid: int
    q_rhs: int
    v_rhs: int
    f: int
    free: int
    K: int
    C: int
    G: int
    T: int
    TK: int
    KT: int
    KS: int
    N: int
    to_journal: int
    journal: int
    disc: int
    struck: int
    time: int
    angle: int
    turns: int
    speed: int
    acceleration: int
    order: int
    matrix_speed: int
    matrix_step: int
    disc_fx: int
    disc_fy: int
    touched: int
    substeps: int
    largest: int
    error: int
    contact: int
    contact_k: int
    journal_start: int
    journal_free: int
    journal_before: int
    journal_force: int
    contact_push: int
    compliance: int
    journal_a: int
    static_a: int
    journal_rhs: int
    static_rhs: int
    small: int
    small_matrix: int
    table_rows: int
    table_speeds: int
    table_values: int
    size: int


def make_rotor_layout(
    n_modes: int,
    film: Layout,
    n_films: int,
    n_supports: int = 0,
    turning: bool = False,
    tables: tuple[int, int] = (0, 0),
    n_housings: int = 0,
) -> RotorLayout:
    """Layout behind `n_films` films laid out as `film` (one that is not used, without films).

    n_modes counts both planes and two for each of the `n_housings` in the machine file. Every resonance of an effect
    adds two modal coordinates behind; `turning`: the shaft has damping in its own frame; `tables`: bearings that are
    tables, and the speeds at which they stand.
    """
    n_machine, n_modes = n_modes, n_modes + 2 * n_supports
    journals, displacements = max(n_films, 1), 2 * n_films
    sizes = dict.fromkeys(VECTORS, n_modes) | dict.fromkeys(MATRICES, n_modes**2)
    sizes |= {
        "to_journal": 2 * n_modes * journals,
        "journal": 2 * n_modes * journals,
        "disc": 2 * n_modes,
        "struck": 2 * n_modes,
    }
    sizes |= dict.fromkeys(ROTOR_SCALARS, 1) | dict.fromkeys(PAIRS, 2 * journals)
    sizes |= {"contact": journals, "contact_k": 4 * journals}
    own = {name: getattr(film, place) for name, place in (FILM_MATRICES | FILM_PAIRS).items()}
    sizes |= {"small": 0, "small_matrix": 0}
    if n_films > 1:
        own = {}
        sizes |= dict.fromkeys((*FILM_MATRICES, "small_matrix"), displacements**2)
        sizes |= dict.fromkeys((*FILM_PAIRS, "small"), displacements)
    n_tables, n_points = tables
    sizes |= {"table_rows": 2 * n_modes * n_tables, "table_speeds": n_points, "table_values": 8 * n_tables * n_points}
    offsets, at = {}, journals * film.size
    for name, size in sizes.items():
        offsets[name], at = at, at + (size if name in ROTOR_SCALARS else (size + 7) // 8 * 8)
    flags = {
        "n_films": n_films,
        "turning": int(turning),
        "n_housings": n_housings,
        "n_tables": n_tables,
        "n_points": n_points,
    }
    return RotorLayout(n=n_modes, n_machine=n_machine, size=at, **flags, **offsets, **own)


RIG_SCALARS = ("seed", "tick", "begin", "command", "ripple", "line", "line_end", "supply", "held_x",
           "held_y", "impulse", "torque_old", "torque_mid")  # fmt: skip
READINGS = 6
"""Disc x, y [m], shaft angle [rad], speed [rad/s], gauge pressure [Pa], angle of the probes' ring [rad]."""

AROUND = 12
"""x, y of the housing and of the foundation: displacement [m], velocity [m/s] and acceleration [m/s^2] of each."""


LIVE = (
    "n_pin_columns", "n_random_force", "n_motion", "n_contact", "n_film", "n_gas", "n_heat", "n_injector", "n_supply",
    "n_reference", "n_pin_sensor", "n_braking", "n_stroke_states", "n_states", "new", "states",
)  # fmt: skip
"""Fields of the layout below that depend on the effects: compiled code reads them from the parameter record."""
OF_EFFECTS = (*LIVE, "n_plenum", "n_sensor", "motion", "shapes", "size")
"""Those, and the ones that compiled code does not read."""


class RigLayout(NamedTuple):
    """Sizes and offsets (in doubles); `n_...` are numbers of effects of a port; `driven`: piezos move the pins.

    seed, tick (number of the sample), begin (its time [s]); command and ripple [rad/s] of the drive; line and line_end,
    pressure [Pa, absolute] behind the supply line at both ends of the sample, supply the one before it; impulse [N m s]
    that rub and contact have given the shaft since the sample's start, their torque [N m] at the start and in the
    middle of a step; clearance [m], mean gap of each film; uneven [m], how much it varies; heat, rises [K] of gas,
    journal and sleeve of each film; held: reference [V]. seen and read, signals [m] of the pins' sensors at the end and
    at the start of the sample. n_inj injectors of all films, n_pin of them with a pin, which have n_pin_columns in the
    sample table.
    """

    n_inj: int
    n_pin: int
    n_pin_columns: int
    driven: int
    substeps: int
    n_random_force: int
    n_motion: int
    n_contact: int
    n_film: int
    n_gas: int
    n_heat: int
    n_injector: int
    n_plenum: int
    n_supply: int
    n_reference: int
    n_sensor: int
    n_pin_sensor: int
    n_braking: int
    n_stroke_states: int
    n_states: int
    n_probe: int
    seed: int
    tick: int
    begin: int
    command: int
    ripple: int
    line: int
    line_end: int
    supply: int
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
    seen: int
    read: int
    reading: int
    probe: int
    around: int
    old: int
    new: int
    motion: int
    shapes: int
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
    n_shapes: int = 0,
) -> RigLayout:
    """Layout from offset `base`; `ports` counts the effects of each port, `n_states` their own states in all,
    `n_braking` the effects that brake the shaft, `n_shapes` the numbers in the (2, n) rows of all effects.

    What depends on the effects stands at the end: all other places are those of any machine of these sizes.

    Each of the `n_probe` probes has a row of factors: of displacement, velocity and acceleration of the `n_machine`
    coordinates of shaft and housings, and of the motion `around` the shaft (see `sample.read_probes`).
    """
    n = max(n_inj, 1)
    sizes = dict.fromkeys(RIG_SCALARS, 1) | dict.fromkeys(("pin", "volt", "stroke", "lead", "travel", "rest"), n)
    sizes |= dict.fromkeys(("clearance", "uneven"), max(n_films, 1))
    sizes |= {"heat": 3 * max(n_films, 1)}
    sizes |= {"nodes": n * (substeps + 1), "rates": n * (substeps + 1), "table": 5 * n}
    sizes |= dict.fromkeys(("seen", "read"), n)
    sizes |= {"reading": READINGS, "probe": n_probe * (3 * n_machine + AROUND), "around": AROUND if n_probe else 0}
    sizes |= dict.fromkeys(("old", "new"), max(n * n_stroke_states, 1))
    sizes |= {"motion": max(16 * ports["motion"], 1), "shapes": max(n_shapes, 1), "states": max(n_states, 1)}
    offsets, at = {}, base
    for name, size in sizes.items():
        offsets[name], at = at, at + (size if name in RIG_SCALARS else (size + 7) // 8 * 8)
    counted = ("random_force", "motion", "contact", "film", "gas", "heat", "injector", "plenum", "supply", "reference",
               "sensor", "pin_sensor")  # fmt: skip
    counts = {f"n_{port}": ports[port] for port in counted}
    # warm walls shape the gap, warm gas changes the viscosity
    counts["n_film"], counts["n_gas"] = ports["film"] + ports["heat"], ports["gas"] + ports["heat"]
    return RigLayout(
        n_inj=n_inj, n_pin=n_pin, n_pin_columns=n_pin * (2 if ports["pin_sensor"] else 1), driven=driven,
        substeps=substeps, n_stroke_states=n_stroke_states, n_states=n_states, n_probe=n_probe, n_braking=n_braking,
        size=(at + 7) // 8 * 8, **counts, **offsets,
    )  # fmt: skip
