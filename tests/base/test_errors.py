"""One family of errors: a user catches every one by one class."""

import pytest

import fe_shaft
import identification as idn
import reynolds
import rotorsim as rs
from rotorsim.base.display import listing, quote


@pytest.mark.parametrize(
    "mistake",
    [
        lambda: rs.load_machine("no_such_machine"),
        lambda: fe_shaft.ShaftElement(-1.0, 0, 0.05),
        lambda: reynolds.GasBearing(0.02, 0.04, 25e-6).steady((26e-6, 0.0), 1.0),
        lambda: idn.read("no_such_record.csv"),
        lambda: idn.load_model("no_such_model.json"),
        lambda: rs.load_law("no_such_law.json"),
    ],
)
def test_a_mistake_in_any_package_is_one_kind_of_error(mistake):
    with pytest.raises(rs.RotorsimError):
        mistake()


def test_values_are_quoted_as_a_file_has_them_and_cut():
    assert (quote(True), quote("a\n")) == ("true", "'a\\n'")
    assert quote("x" * 90) == "'" + "x" * 55 + "...'"
    assert listing("abc", 2) == "'a', 'b' and 1 more"
