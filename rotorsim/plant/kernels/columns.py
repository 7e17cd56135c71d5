"""Columns of the two tables of a run: inputs that are held over a sample, and what a sample gives.

A row of inputs has six columns: speed [rad/s] that is reached at the sample's end (NaN: the drive is off), supply
pressure [Pa, gauge; absolute in the kernels], references x, y [V], force on the disc x, y [N]. A row of the sample
table has `COLUMNS`, which all machines have, then the travel [m] of each pin, the reading of each probe, `FILM_COLUMNS`
for each of several films and `HEAT_COLUMNS` for each film that friction heats.
"""

import numpy as np

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
SPEED_READ, PRESSURE_READ = AT["speed_measured"], AT["pressure_measured"]
"""Measured speed [rad/s] and gauge pressure [Pa] in a row."""
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
