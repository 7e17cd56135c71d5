"""Draft of a mapping for a file: recognised columns filled in, the others as comments."""

from __future__ import annotations

import json

import numpy as np

from identification.records.column_names import meaning, schema_unit
from identification.records.schema import VARIABLES
from identification.records.table import Column, Table
from identification.records.vectors import VECTORS

_HELP = """\
# Mapping for {file}: take away the '#' of a section, write the channel's name, check column and unit.
# Channels over x and y: {axis}; pin.1, pin.2 ...
# Others: {plain}
# Run-up vectors: [speed] and [vectors.1X.x] with amplitude (unit e.g. 'um pp') and phase (a LAG; sign = -1 for a lead).
# An entry may also have: sensitivity = "8 V/mm", scale = 2.0, sign = -1, offset = "0.1 mm".
"""


def mapping_template(table: Table, file: str) -> str:
    """TOML text that `identification.records.mapping` reads once it is filled in; `file` is the name shown.

    Examples
    --------
    >>> import rotorsim as rs
    >>> "column" in rs.identification.mapping_template(rs.identification.columns("run.csv"), "run.csv")
    True
    """
    axis = ", ".join(f"{name}.x" for name, variable in VARIABLES.items() if variable.dims == ("axis",))
    plain = ", ".join(name for name, variable in VARIABLES.items() if not variable.dims)
    safe = "".join(c if c.isprintable() else "?" for c in file)
    parts = [_HELP.format(file=safe, axis=axis, plain=plain), *_clock(table)]
    taken: set[tuple[str, str, str]] = set()
    for number, column in enumerate(table.columns, 1):
        if column.fault:
            parts.append(f"# not usable: column {number}, {column.fault}\n")
            continue
        key = meaning(column.name)
        fresh = key is not None and key not in taken and key[0] not in VECTORS
        parts.append(_known(column, key) if key and fresh else _unknown(column, number, table))
        taken |= {key} if key else set()
    parts += [f"# not usable: {_text(name)} {reason}\n" for name, reason in table.others.items()]
    return "\n".join([*parts, '# [constants]\n# pressure = "0.3 MPa"\n'])


def _clock(table: Table) -> list[str]:
    if table.clocked:
        return ["# The file has its own clock; no [time] is needed.\n"]
    if any(column.name == "time" for column in table.columns):
        return []
    return ['# [time]\n# column = "..."\n# unit = "s"\n# or, without such a column: sample_rate = "5 kHz"\n']


def _known(column: Column, key: tuple[str, str, str]) -> str:
    section = "time" if key[0] == "time" else ".".join(filter(None, ("channels", *key)))
    unit = column.unit if column.unit is not None else schema_unit(key)
    return f"# {_extent(column)}\n[{section}]\ncolumn = {_text(column.name)}\nunit = {_text(unit)}\n"


def _unknown(column: Column, number: int, table: Table) -> str:
    unit = f"unit = {_text(column.unit)}" if column.unit is not None else 'unit = "?"'
    clear = sum(other.name == column.name for other in table.columns) == 1
    name = f"column = {_text(column.name) if clear else number}"
    return f"# column {number}: {_extent(column)}\n# [channels.NAME.x]\n# {name}\n# {unit}\n"


def _extent(column: Column) -> str:
    finite = column.values[np.isfinite(column.values)]
    if not finite.size:
        return f"{column.values.size} values, none of them finite"
    return f"{column.values.size} values from {finite.min():.6g} to {finite.max():.6g}"


def _text(text: str) -> str:
    """A TOML string; JSON's escapes are TOML's, but for DEL and for what stands outside the first plane."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
