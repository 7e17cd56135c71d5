"""Tables of 1X vectors: the same conditions from every encoding, delimiter and decimal sign."""

from codecs import BOM_UTF8

import numpy as np
import pytest

from rotorsim.balance import read_conditions
from rotorsim.base.errors import DataError

MAPPING = {
    "conditions": {"column": "Läufe"},
    "speed": {"column": "rpm"},
    "readings": {"x": {"amplitude": "µm", "phase": "lag", "unit": "um"}},
    "planes": {"disc": {"amount": "U", "angle": "at", "unit": "g*mm"}},
}
ROWS = [
    ("Läufe", "rpm", "µm", "lag", "U", "at"),
    ("without", "3000.5", "10.25", "30.5", "0", "0"),
    ("trial", "3000.5", "-.5", "1.5e1", "12.5", "90"),
    ("now", "3000.5", "20.75", "3", "", ""),
]


def table(delimiter=",", comma=False):
    rows = [[cell.replace(".", ",") if comma else cell for cell in row] for row in ROWS]
    return "".join(delimiter.join(row) + "\r\n" for row in rows)


FORMS = {
    "UTF-8 with mark": BOM_UTF8 + table().encode(),
    "Latin-1": table().encode("latin-1"),
    "Latin-1 with mark": BOM_UTF8 + table().encode("latin-1"),
    "UTF-16": table(";", comma=True).encode("utf-16"),
    "semicolons": table(";").encode(),
    "decimal commas": table(";", comma=True).encode("cp1252"),
    "tabs": table("\t", comma=True).encode(),
}


@pytest.mark.parametrize("form", FORMS)
def test_every_form_of_a_table_gives_the_same_conditions(tmp_path, form):
    (tmp_path / "plain.csv").write_bytes(table().encode())
    (tmp_path / "other.csv").write_bytes(FORMS[form])
    plain, other = (read_conditions([tmp_path / name], MAPPING) for name in ("plain.csv", "other.csv"))
    assert plain.labels == other.labels == ("without", "trial", "now")
    for name in ("speed", "vectors", "unbalance"):
        assert np.array_equal(getattr(plain, name), getattr(other, name), equal_nan=True)


def test_two_decimal_signs_in_one_table_are_refused(tmp_path):
    (tmp_path / "a.csv").write_text(table(";").replace("10.25", "10,25"), encoding="utf-8")
    with pytest.raises(DataError, match="'10,25', which is not a number"):
        read_conditions([tmp_path / "a.csv"], MAPPING)


def test_a_table_that_is_not_there_is_named_as_any_missing_file(tmp_path):
    with pytest.raises(DataError, match="is not there") as caught:
        read_conditions([tmp_path / "none.csv"], {"conditions": {"column": "id"}})
    assert "Errno" not in str(caught.value)
