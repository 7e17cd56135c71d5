"""Records as tables of other programs: pandas, and the layout of a MATLAB timetable.

CSV with units in its heads is `identification.save(record, "run.csv")`.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.records.sampling import sampling_time
from identification.records.schema import named_axes
from identification.records.validate import validate
from identification.writers.flat import flat_columns, over_time
from rotorsim.base.exchange.mat import cells, write_mat

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

ONE_LINE = (
    "s = load('run.mat'); t = array2timetable(s.Data, 'RowTimes', seconds(s.Time), 'VariableNames', s.VariableNames); "
    "t.Properties.VariableUnits = s.VariableUnits;"
)
"""How MATLAB makes a timetable of the file."""


def to_pandas(record: xr.Dataset) -> pd.DataFrame:
    """A record as a DataFrame: a row a sample, columns disc_x, disc_y, ..., time [s] as index.

    Parameters
    ----------
    record : Dataset
        Of the schema; run-up vectors have a row a speed.

    Returns
    -------
    DataFrame
        SI values; `attrs["units"]` has the unit of each column.

    Raises
    ------
    SchemaError
        If the record does not fit the schema.

    Examples
    --------
    >>> import rotorsim as rs
    >>> record = rs.experiments.steady("plain_rotor", speed=100.0, duration=0.01)
    >>> table = rs.identification.to_pandas(record)
    >>> table.attrs["units"]["disc_x"]
    'm'
    """
    import pandas as pd

    columns = _columns(record)
    first = next(iter(columns))
    table = pd.DataFrame({name: values for name, (_, values) in columns.items()}).set_index(first)
    table.attrs["units"] = {name: unit for name, (unit, _) in columns.items()}
    return table


def save_timetable(record: xr.Dataset, path: str | Path) -> Path:
    """Write a record as .mat laid out as a timetable: Time [s], Data, VariableNames, VariableUnits, SampleRate [Hz].

    A timetable itself is an object that only MATLAB writes; `HowTo` in the file is the line that makes one.

    Raises
    ------
    SchemaError
        If the record does not fit the schema.
    WriteError
        If the file cannot be written.

    Examples
    --------
    >>> import rotorsim as rs
    >>> record = rs.experiments.steady("plain_rotor", speed=100.0, duration=0.01)
    >>> rs.identification.save_timetable(record, "run.mat").name
    'run.mat'
    """
    columns = _columns(record)
    (first, (_, axis)), *rest = columns.items()
    content: dict[str, Any] = {
        "Time" if first == "time" else "Speed": axis[:, None],
        "Data": np.column_stack([values for _, (_, values) in rest]),
        "VariableNames": cells([name for name, _ in rest]),
        "VariableUnits": cells([unit for _, (unit, _) in rest]),
        "HowTo": ONE_LINE.replace("run.mat", Path(path).name),
    }
    if first == "time":
        content["SampleRate"] = 1 / sampling_time(record)
    write_mat(path, content)
    return Path(path)


def _columns(record: xr.Dataset) -> dict[str, tuple[str, np.ndarray]]:
    return flat_columns(over_time(named_axes(validate(record))))
