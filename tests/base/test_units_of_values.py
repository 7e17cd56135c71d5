"""Conversion of text with units to SI floats and back."""

import math
import re

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from refusals import refused
from rotorsim.analysis.axes import read_axis
from rotorsim.base.errors import DataError
from rotorsim.base.units import TABLE, parse, show, suggestion

FINITE = st.floats(allow_nan=False, allow_infinity=False)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("25 um", "m", 25e-6),
        ("25µm", "m", 25e-6),
        ("1 in", "m", 0.0254),
        ("20 degC", "K", 293.15),
        ("20 °C", "K", 293.15),
        ("0.3 MPa", "Pa", 0.3e6),
        ("43.5 psi", "Pa", 43.5 * 6894.757293168361),
        ("12 g*mm", "kg*m", 12e-6),
        ("12 g mm", "kg*m", 12e-6),
        ("12 g·mm", "kg*m", 12e-6),
        ("3e-16 kg/(s*Pa^2)", "kg/(s*Pa^2)", 3e-16),
        ("7.85 g/cm³", "kg/m^3", 7850.0),
        ("6 krpm", "rad/s", 200 * math.pi),
        ("100 Hz", "rad/s", 200 * math.pi),
        ("0.1 krpm/s", "rad/s^2", 10 * math.pi / 3),
        ("90 deg", "rad", math.pi / 2),
        ("1 s/m", "s/m", 1.0),
        (0.5, "1", 0.5),
        ("0.5", "1", 0.5),
    ],
)
def test_text_with_a_unit_becomes_its_si_value(text, unit, value):
    assert parse(text, unit) == pytest.approx(value, rel=1e-14)


def test_decimal_units_give_the_nearest_double():
    assert parse("25 um", "m") == 25e-6
    assert parse("0.1 ms", "s") == 1e-4
    assert parse("0.001 inch", "m") == 25.4e-6


@pytest.mark.parametrize("unit", [u for u in TABLE if u != "1"])
def test_the_table_of_units_agrees_with_pint(unit):
    pint = pytest.importorskip("pint")
    ureg = pint.UnitRegistry()
    for written, factor in TABLE[unit].factors.items():
        turns = 2 * math.pi if written.startswith("Hz") and unit != "Hz" else 1.0  # pint takes 1 Hz for 1 rad/s
        known = written.replace("/mil", "/thou").replace("/g", "/g_0") if unit.startswith("V") else written
        assert float(factor) == pytest.approx(turns * ureg.Quantity(1.0, known).to(unit).magnitude, rel=1e-12)


@pytest.mark.parametrize("unit", list(TABLE))
def test_every_example_in_an_error_message_is_valid(unit):
    parse(TABLE[unit].example if unit != "1" else float(TABLE[unit].example), unit)
    assert set(TABLE[unit].people) <= set(TABLE[unit].factors)


@settings(derandomize=True)
@given(value=FINITE, unit=st.sampled_from([*TABLE, "W/m"]))
def test_what_is_shown_reads_back_to_the_last_bit(value, unit):
    assert parse(show(value, unit), unit) == value


@pytest.mark.parametrize(
    ("value", "unit", "sentence"),
    [
        (0, "m", "0 has no unit; write e.g. '0 mm'"),
        ("25", "m", "'25' has no unit; write e.g. '25 mm'"),
        ("20 g", "kg*m", "'20 g' is not a mass*length; write e.g. '10 g*mm'"),
        ("3 furlings", "m", "'3 furlings' has an unknown unit; write e.g. '25 mm'"),
        ("wide", "m", "'wide' is not a length; write e.g. '25 mm'"),
        ("", "m", "'' is not a length; write e.g. '25 mm'"),
        (True, "m", "true is not a length; write e.g. '25 mm'"),
        (True, "1", "true is not a number; write e.g. 0.5"),
        ([1, 2], "m", "[1, 2] is not a length; write e.g. '25 mm'"),
        (math.nan, "1", "nan is not a number; write e.g. 0.5"),
        (math.inf, "1", "inf is not a number; write e.g. 0.5"),
        ("nan mm", "m", "'nan mm' is not a length; write e.g. '25 mm'"),
        ("1e999 mm", "m", "'1e999 mm' is too large a number; write e.g. '25 mm'"),
        ("0.3 mm", "1", "'0.3 mm' has a unit but is a plain number; write e.g. 0.3"),
        ("3 Bq", "rad/s", "'3 Bq' is not a rotational speed; write e.g. '6000 rpm'"),
        ("0.2 %", "1", "'0.2 %' has a unit but is a plain number; write e.g. 0.002"),
        ("10 %", "1", "'10 %' has a unit but is a plain number; write e.g. 0.1"),
        ("3", "rad", "'3' has no unit; write e.g. '3 rad'"),
    ],
)
def test_what_is_no_such_quantity_is_refused_with_a_sentence(value, unit, sentence):
    with pytest.raises(ValueError) as caught:
        parse(value, unit)
    assert str(caught.value) == sentence


@settings(derandomize=True)
@given(st.text(max_size=30))
def test_no_text_breaks_the_reader_of_units(text):
    try:
        assert math.isfinite(parse("1 " + text, "m"))
    except ValueError as error:
        assert "write e.g." in str(error)


DIGITS = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False).map(repr),
    st.floats(allow_nan=False, allow_infinity=False, width=32).map(repr),
    st.integers(-(10**30), 10**30).map(str),
    st.from_regex(r"[+-]?[0-9]{1,40}\.?[0-9]{0,40}([eE][+-]?[0-9]{1,3})?", fullmatch=True),
)
UNITS = [unit for unit in TABLE if unit != "1"]


@settings(max_examples=300, deadline=None)
@given(DIGITS, st.sampled_from(UNITS))
def test_the_text_that_a_missing_unit_is_answered_with_can_be_read(digits, unit):
    """The number stands in it whole, or another example does: what it recommends is always a value of the kind."""
    with pytest.raises(ValueError, match="has no unit") as caught:
        parse(digits, unit)
    advice = str(caught.value).rpartition("write e.g. '")[2].rstrip("'")
    value = parse(advice, unit)
    assert math.isfinite(value)
    number = advice.split(" ")[0]
    assert number == digits or float(number) == float(digits) or advice == suggestion(unit)


@settings(max_examples=100, deadline=None)
@given(DIGITS, st.sampled_from(["%", "um", "kg"]))
def test_the_text_that_a_needless_unit_is_answered_with_can_be_read(digits, unit):
    with pytest.raises(ValueError, match="plain number") as caught:
        parse(f"{digits} {unit}", "1")
    advice = str(caught.value).rpartition("write e.g. ")[2]
    assert math.isfinite(parse(advice, "1"))


def test_a_number_of_seventeen_digits_is_recommended_whole():
    with pytest.raises(ValueError, match=r"write e\.g\. '3\.441954492434852e-05 "):
        parse("3.441954492434852e-05", "kg*m")
    assert parse("3.441954492434852e-05 kg*m", "kg*m") == 3.441954492434852e-05


@pytest.mark.parametrize("value", [np.float64(0.5), np.float32(0.5), 0.5])
def test_numbers_of_numpy_are_numbers(value):
    if isinstance(value, float):
        assert parse(value, "1") == 0.5
    with pytest.raises(ValueError, match=r"^0\.5 "):
        parse(value, "m")


@pytest.mark.parametrize(("text", "unit", "remedies"), [
    ("8,0 um", "m", ["8.0 um"]), ("8,0um", "m", ["8.0 um"]), ("-0,5 V", "V", ["-0.5 V"]),
    ("1,000 rpm", "rad/s", ["1.000 rpm", "1000 rpm"]),
])  # fmt: skip
def test_a_decimal_comma_is_named_and_every_advice_can_be_read(text, unit, remedies):
    with pytest.raises(ValueError, match="has a comma") as caught:
        parse(text, unit)
    advised = re.findall(r"'([^']*)'", str(caught.value).partition("write")[2])
    assert advised == remedies and all(np.isfinite(parse(one, unit)) for one in advised)


def test_a_list_of_values_is_not_taken_for_a_decimal_comma():
    with refused(DataError, "speed", "8,5 rpm"):
        read_axis("speed", "8,5 rpm", "rad/s")
    assert len(read_axis("speed", "8 rpm,9 rpm", "rad/s")) == len(read_axis("over", "0,5", "1")) == 2
