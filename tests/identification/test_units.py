"""Units of measured data: factors, sensitivities, refusals."""

import math

import pytest

from identification import ReadError
from identification.records.columns import FACTORS, amplitude_factor, factor, quantity, sensitivity
from identification.records.proposal import likely
from refusals import refused
from rotorsim.base.units import SPELLINGS, parse


@pytest.mark.parametrize(
    ("unit", "si", "expected"),
    [
        *(("um", "m", 1e-6), ("µm", "m", 1e-6), ("μm", "m", 1e-6), ("micron", "m", 1e-6), ("mil", "m", 25.4e-6)),
        *(("rpm", "rad/s", 2 * math.pi / 60), ("Hz", "rad/s", 2 * math.pi), ("deg", "rad", math.pi / 180)),
        *(("bar", "Pa", 1e5), ("psi", "Pa", 6894.757293168361), ("g/s", "kg/s", 1e-3), ("kg/h", "kg/s", 1 / 3600)),
    ],
)
def test_factors_are_those_of_the_si_brochure(unit, si, expected):
    assert factor(unit, si) == pytest.approx(expected, rel=1e-15)


EXACT = {
    "m": {
        **{"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "micron": 1e-6, "microns": 1e-6, "nm": 1e-9},
        **{"mil": 25.4e-6, "mils": 25.4e-6, "in": 25.4e-3, "inch": 25.4e-3},
    },
    "V": {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "kV": 1e3},
    "rad/s": {
        **dict.fromkeys(("rpm", "RPM", "r/min", "1/min"), math.pi / 30),
        **{"rad/s": 1.0, "krpm": 1000 * math.pi / 30},
        **{"Hz": 2 * math.pi, "rev/s": 2 * math.pi, "deg/s": math.pi / 180},
    },
    "rad": {
        **{"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180, "°": math.pi / 180},
        **{"rev": 2 * math.pi, "turn": 2 * math.pi},
    },
    "Pa": {
        **{"Pa": 1.0, "hPa": 1e2, "kPa": 1e3, "MPa": 1e6, "mbar": 1e2, "bar": 1e5, "barg": 1e5},
        **{"psi": 6894.757293168361, "psig": 6894.757293168361},
    },
    "N": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": 4.4482216152605},
    "s": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "kg/s": {"kg/s": 1.0, "g/s": 1e-3, "mg/s": 1e-6, "kg/min": 1 / 60, "g/min": 1e-3 / 60, "kg/h": 1 / 3600},
    "Hz": {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6},
    "1": {"1": 1.0, "-": 1.0, "": 1.0},
}


def test_factors_of_the_table_are_exact_to_the_last_bit():
    assert all(FACTORS[si][unit] == value for si, kind in EXACT.items() for unit, value in kind.items())


LAB = {
    "m/s^2": {"m/s2": 1.0, "m/s²": 1.0, "m/s^2": 1.0, "m s-2": 1.0, "m/s/s": 1.0, "m·s⁻²": 1.0, "mm/s²": 1e-3,
              **dict.fromkeys(("g", "G", "gn", "Gs", "g's"), 9.80665), "mG": 9.80665e-3},
    "V": {"Volts": 1.0, "volt": 1.0, "VOLTS": 1.0, "Vdc": 1.0, "Millivolts": 1e-3, "V DC": 1.0},
    "m": {"Microns": 1e-6, "micrometers": 1e-6, "Mils": 25.4e-6, "MIL": 25.4e-6, "inches": 25.4e-3, "mm ": 1e-3},
    "rad/s": {"Rpm": math.pi / 30, "rev/min": math.pi / 30, "min-1": math.pi / 30, "U/min": math.pi / 30},
    "rad": {"Degrees": math.pi / 180, "Radians": 1.0}, "Hz": {"Hertz": 1.0, "KHZ": 1e3, "hz": 1.0},
    "Pa": {"PSI": 6894.757293168361, "Bar": 1e5, "kilopascal": 1e3},
    "s": {"Seconds": 1.0, "msec": 1e-3, "minutes": 60.0},
    "m/s": {"mm/sec": 1e-3, "IPS": 0.0254}, "N": {"Newtons": 1.0}, "kg*m": {"g mm": 1e-6, "g·mm": 1e-6, "g.mm": 1e-6},
}  # fmt: skip


@pytest.mark.parametrize(("si", "unit"), [(si, unit) for si, words in LAB.items() for unit in words])
def test_spellings_of_laboratories_are_read(si, unit):
    assert factor(unit, si) == pytest.approx(LAB[si][unit], rel=1e-14)
    assert sensitivity(f"2 V/{unit.strip()}", "V", "m") > 0 if si == "m" else True


def test_a_spelling_means_one_unit_of_its_own_quantity():
    for si, words in SPELLINGS.items():
        assert set(words.values()) <= set(FACTORS[si])
        known = FACTORS[si]
        assert all(known[word] == known[meant] for word, meant in words.items() if word in known)


def test_machine_files_do_not_take_the_spellings_of_recorded_speeds():
    for text in ("100 1/min", "100 RPM", "100 r/min"):
        with pytest.raises(ValueError, match=r"'100 .*'"):
            parse(text, "rad/s")


def test_every_kind_of_unit_begins_with_its_si_unit():
    assert all(next(iter(kind)) == si and kind[si] == 1.0 for si, kind in FACTORS.items())


@pytest.mark.parametrize(("unit", "si"), [("mPa", "Pa"), ("UM", "m"), ("furlong", "m"), ("V", "m"), ("bara", "Pa")])
def test_an_unknown_or_wrong_unit_is_refused_with_the_known_ones(unit, si):
    with refused(ReadError, "unit", unit):
        factor(unit, si)


def test_amplitudes_in_pp_pk_and_rms_become_0_pk():
    assert amplitude_factor("um pp") == pytest.approx(0.5e-6)
    assert amplitude_factor("mil pk-pk") == pytest.approx(12.7e-6)
    assert amplitude_factor("um rms") == pytest.approx(math.sqrt(2) * 1e-6)
    assert amplitude_factor("um") == amplitude_factor("um 0-pk") == 1e-6
    with pytest.raises(ReadError, match="'peak'"):
        amplitude_factor("um peak")


def test_a_sensitivity_divides_or_multiplies_as_its_units_state():
    assert sensitivity("8 V/mm", "V", "m") == pytest.approx(1.25e-4)
    assert sensitivity("8 V/mm", "mV", "m") == pytest.approx(1.25e-7)
    assert sensitivity("200 mV/mil", "V", "m") == pytest.approx(5 * 25.4e-6)
    assert sensitivity("125 um/V", "V", "m") == pytest.approx(1.25e-4)


@pytest.mark.parametrize("text", ["8", "8 V", "0 V/mm", "V/mm", "8 A/mm", "8 V/s", None])
def test_what_is_no_sensitivity_is_refused(text):
    with pytest.raises(ReadError):
        sensitivity(text, "V", "m")


@pytest.mark.parametrize("text", ["0.3", 0.3, "MPa", "1e400 MPa", "0.3 kg", "nan Pa", True, None])
def test_a_quantity_without_number_or_unit_is_refused(text):
    with pytest.raises(ReadError):
        quantity(text, "Pa")


def test_units_of_amplitudes_are_not_those_of_channels():
    with pytest.raises(ReadError, match="'mil pp'"):
        factor("mil pp", "m")


def test_misspelt_columns_are_likened_to_channels():
    assert likely("disc_mesured_x") == "disc_measured_x"
    assert likely("pressur") == "pressure"
    assert likely("disc_measured_x") == likely("temperature_7") == ""


@pytest.mark.parametrize(
    ("column", "channel"),
    [
        ("pin2", "pin_2"), ("pin_04", "pin_4"), ("Pin 3", "pin_3"), ("pins", "pin_1"), ("Refrence_Y", "reference_y"),
        ("disc_measuredy", "disc_measured_y"), ("pin0", ""), ("speed_1", "speed"),
        ("presure1", "pressure"), ("pressure_a", "pressure"), ("angle_d", "angle"),
        ("disc_measured_z", ""), ("reference1", ""), ("", ""),
    ],
)  # fmt: skip
def test_the_channel_of_a_misspelt_column_keeps_its_injector_and_axis(column, channel):
    assert likely(column) == channel
