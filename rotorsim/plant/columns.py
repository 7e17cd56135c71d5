"""Columns of the sample table."""

COLUMNS = (
    "disc_x", "disc_y", "journal_x", "journal_y", "angle", "speed", "pressure", "film_force_x", "film_force_y",
    "h_min", "mass_flow", "contact", "disc_measured_x", "disc_measured_y", "angle_measured", "speed_measured",
    "pressure_measured",
)  # fmt: skip
"""Before the pins, the probes and the columns of each of several films: [m], angle [rad], speed [rad/s], gauge
pressure [Pa], force [N], h_min [m], flow [kg/s], 0/1."""
READ = COLUMNS.index("disc_measured_x")
"""The first of the columns that sensors read."""
FILM_COLUMNS = 6
"""Of each of several films: journal x, y [m], film force x, y [N], smallest thickness [m], mass flow [kg/s]."""
HEAT_COLUMNS = 3
"""Of each film, where friction heats them, behind all others: rises of gas, journal and sleeve [K]."""


def film_columns(n_films: int, heated: bool = False) -> int:
    """Columns at the end of the table for films one by one; of a single film its temperatures at most."""
    return (FILM_COLUMNS * n_films if n_films > 1 else 0) + (HEAT_COLUMNS * n_films if heated else 0)
