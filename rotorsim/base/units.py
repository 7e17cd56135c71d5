"""Units: the table of those in machine files and recorded data, conversion of text to SI floats and back.

Factors are decimal strings. A test compares every entry of the table with pint, which is asked for what is not listed.
`parse` and `show` are inverse to each other, to the last bit. Numbers are scaled as decimals: '25 um' is the
double nearest to 25e-6. A gauge pressure is a plain pressure here.

Code that works in SI takes the factors to and from engineering units (`RPM`, `TO_HZ`) as numbers.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from decimal import Decimal
from functools import lru_cache, partial
from math import isclose, isfinite, log, pi
from typing import Any

from rotorsim.base.display import quote


@dataclass(frozen=True)
class Dimension:
    """Kind of quantity; `people` are the units in which values are shown, from small to large.

    `recorded` are further spellings that files of measured data use and machine files do not.
    """

    name: str
    example: str
    people: tuple[str, ...]
    factors: dict[str, str]
    recorded: dict[str, str] = field(default_factory=dict)


RPM, KRPM, HZ, MPA = pi / 30, 1000 * pi / 30, 2 * pi, 1e6
"""Values of one rpm [rad/s], 1000 rpm [rad/s], one Hz [rad/s] and one MPa [Pa]."""
TO_RPM, TO_HZ, TO_MPA, TO_UM = 30 / pi, 1 / (2 * pi), 1e-6, 1e6
"""Factors from rad/s to rpm, from rad/s to Hz, from Pa to MPa and from m to um."""
RIG_SAMPLE = 2e-4
"""Sampling time [s] of the thesis' rig: the default of a machine that states neither rate nor highest speed."""
MINUTE = 60.0
"""Length [s] of a minute."""
NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
"""Pattern of a decimal number, for `re.ASCII`."""
_TURN = repr(2 * pi)
_RPM, _KRPM = repr(2 * pi / 60), repr(2000 * pi / 60)
_DEG = repr(pi / 180)
_INCH, _MIL, _PSI = "0.0254", "25.4e-6", "6894.757293168361"
_PER_MIL, _G = repr(1e-3 / 25.4e-6), 9.80665
"""Standard gravity [m/s^2]: the g of accelerometers' sensitivities."""

TABLE: dict[str, Dimension] = {
    "1": Dimension("number", "0.5", (), {}, {"1": "1", "-": "1", "": "1"}),
    "m": Dimension(
        "length",
        "25 mm",
        ("um", "mm"),
        {"m": "1", "cm": "1e-2", "mm": "1e-3", "um": "1e-6", "nm": "1e-9"},
        {"micron": "1e-6", "microns": "1e-6", "mil": _MIL, "mils": _MIL, "in": _INCH, "inch": _INCH},
    ),
    "m^3": Dimension("volume", "1 mm^3", ("mm^3",), {"m^3": "1", "mm^3": "1e-9", "cm^3": "1e-6"}),
    "kg": Dimension("mass", "1.5 kg", ("g", "kg"), {"kg": "1", "g": "1e-3"}),
    "kg*m": Dimension("mass*length", "10 g*mm", ("g*mm",), {"kg*m": "1", "g*mm": "1e-6", "kg*mm": "1e-3"}),
    "kg*m^2": Dimension(
        "moment of inertia", "0.0037 kg*m^2", ("kg*m^2",), {"kg*m^2": "1", "kg*mm^2": "1e-6", "g*mm^2": "1e-9"}
    ),
    "kg/m^3": Dimension("density", "7850 kg/m^3", ("kg/m^3",), {"kg/m^3": "1", "g/cm^3": "1e3"}),
    "s": Dimension(
        "time",
        "0.1 ms",
        ("us", "ms", "s"),
        {"s": "1", "ms": "1e-3", "us": "1e-6", "min": "60"},
        {"sec": "1", "ns": "1e-9"},
    ),
    "K": Dimension("temperature", "293.15 K", ("K",), {"K": "1"}),
    "rad": Dimension(
        "angle", "90 deg", ("deg",), {"rad": "1", "mrad": "1e-3", "deg": _DEG, "turn": _TURN}, {"°": _DEG, "rev": _TURN}
    ),
    "rad/s": Dimension(
        "rotational speed",
        "6000 rpm",
        ("rpm",),
        {"rad/s": "1", "rpm": _RPM, "krpm": _KRPM, "Hz": _TURN, "deg/s": _DEG},
        {"kHz": repr(1e3 * float(_TURN)), "RPM": _RPM, "r/min": _RPM, "1/min": _RPM, "rev/s": _TURN},
    ),
    "1/s": Dimension("angular frequency", "101 rad/s", ("rad/s",), {"rad/s": "1", "1/s": "1"}),
    "Hz": Dimension("frequency", "50 Hz", ("Hz",), {"Hz": "1", "kHz": "1e3", "MHz": "1e6", "mHz": "1e-3"}),
    "rad/s^2": Dimension(
        "rotational acceleration",
        "100 rpm/s",
        ("rpm/s",),
        {"rad/s^2": "1", "rpm/s": _RPM, "krpm/s": _KRPM, "Hz/s": _TURN, "deg/s^2": _DEG},
    ),
    "m/s": Dimension(
        "velocity",
        "1 mm/s",
        ("mm/s", "m/s"),
        {"m/s": "1", "mm/s": "1e-3", "um/s": "1e-6"},
        {"in/s": _INCH, "ips": _INCH},
    ),
    "m/s^2": Dimension(
        "acceleration",
        "9.81 m/s^2",
        ("m/s^2",),
        {"m/s^2": "1", "mm/s^2": "1e-3"},
        {"g": repr(_G), "mg": repr(1e-3 * _G)},
    ),
    "s/m": Dimension("time/length", "1 s/m", ("s/m",), {"s/m": "1"}),
    "N": Dimension("force", "0.5 N", ("N",), {"N": "1", "mN": "1e-3", "kN": "1e3"}, {"lbf": "4.4482216152605"}),
    "N^2/Hz": Dimension("force^2/frequency", "0.01 N^2/Hz", ("N^2/Hz",), {"N^2/Hz": "1", "mN^2/Hz": "1e-6"}),
    "Pa": Dimension(
        "pressure",
        "0.3 MPa",
        ("Pa", "kPa", "MPa", "GPa"),
        {"Pa": "1", "kPa": "1e3", "MPa": "1e6", "GPa": "1e9", "bar": "1e5", "mbar": "1e2"},
        {"hPa": "1e2", "psi": _PSI, "barg": "1e5", "psig": _PSI},
    ),
    "Pa/s": Dimension(
        "pressure rate", "2 MPa/s", ("MPa/s",), {"Pa/s": "1", "kPa/s": "1e3", "MPa/s": "1e6", "bar/s": "1e5"}
    ),
    "Pa*s": Dimension("viscosity", "18.5 uPa*s", ("uPa*s",), {"Pa*s": "1", "uPa*s": "1e-6", "mPa*s": "1e-3"}),
    "N*s": Dimension("impulse", "10 mN*s", ("mN*s",), {"N*s": "1", "mN*s": "1e-3"}),
    "N/m": Dimension(
        "stiffness",
        "50 MN/m",
        ("N/m", "MN/m"),
        {"N/m": "1", "kN/m": "1e3", "MN/m": "1e6", "N/mm": "1e3", "N/um": "1e6"},
    ),
    "N/m^3": Dimension(
        "stiffness per area or cubic stiffness",
        "4.7 GN/m^3",
        ("GN/m^3",),
        {"N/m^3": "1", "MN/m^3": "1e6", "GN/m^3": "1e9", "N/mm^3": "1e9"},
    ),
    "N*s/m": Dimension("damping", "100 N*s/m", ("N*s/m",), {"N*s/m": "1", "kN*s/m": "1e3", "N*s/mm": "1e3"}),
    "N*m": Dimension("torque", "5 mN*m", ("mN*m", "N*m"), {"N*m": "1", "mN*m": "1e-3", "kN*m": "1e3"}),
    "N*m*s": Dimension("torque/speed", "1e-5 N*m*s", ("N*m*s",), {"N*m*s": "1", "mN*m*s": "1e-3"}),
    "1/K": Dimension("thermal expansion", "1.15e-5 1/K", ("1/K",), {"1/K": "1"}),
    "Pa*s/kg": Dimension(
        "pressure/flow", "1e8 Pa*s/kg", ("Pa*s/kg",), {"Pa*s/kg": "1", "kPa*s/kg": "1e3", "MPa*s/kg": "1e6"}
    ),
    "kg/s": Dimension(
        "mass flow",
        "1e-4 kg/s",
        ("kg/s",),
        {"kg/s": "1", "g/s": "1e-3", "mg/s": "1e-6"},
        {"kg/min": repr(1 / 60), "g/min": repr(1e-3 / 60), "kg/h": repr(1 / 3600)},
    ),
    "V": Dimension("voltage", "5 V", ("V",), {"V": "1", "mV": "1e-3"}, {"uV": "1e-6", "kV": "1e3"}),
    "m/V": Dimension("length/voltage", "4.2 um/V", ("um/V",), {"m/V": "1", "um/V": "1e-6", "mm/V": "1e-3"}),
    "V/m": Dimension(
        "voltage/length",
        "7.87 V/mm",
        ("V/mm",),
        {"V/m": "1", "V/mm": "1e3", "mV/um": "1e3", "V/um": "1e6", "mV/mil": _PER_MIL, "V/mil": repr(1 / 25.4e-6)},
    ),
    "V*s/m": Dimension(
        "voltage/velocity", "4 V*s/m", ("V*s/m",), {"V*s/m": "1", "mV*s/mm": "1", "V*s/mm": "1e3", "V/(m/s)": "1"}
    ),
    "V*s^2/m": Dimension(
        "voltage/acceleration",
        "10.2 mV*s^2/m",
        ("mV*s^2/m",),
        {"V*s^2/m": "1", "mV*s^2/m": "1e-3", "mV/(m/s^2)": "1e-3", "V/g": repr(1 / _G), "mV/g": repr(1e-3 / _G)},
    ),
    "J/(kg*K)": Dimension("gas constant", "287.05 J/(kg*K)", ("J/(kg*K)",), {"J/(kg*K)": "1", "kJ/(kg*K)": "1e3"}),
    "kg/(s*Pa^2)": Dimension("loss factor", "3e-16 kg/(s*Pa^2)", ("kg/(s*Pa^2)",), {"kg/(s*Pa^2)": "1"}),
}

CLOSED = frozenset({"rad", "rad/s", "rad/s^2", "1/s", "Hz"})
"""Dimensions whose units are these and no others: pint takes radians for a number and 1 Hz for 1 rad/s."""


READ_ONLY = frozenset({"cm", "cm^3", "turn", "mbar", "deg/s", "deg/s^2"})
"""Units that are read and never advised: drawings and data sheets of machines have others."""


CHARACTERS = {"µ": "u", "μ": "u", "·": "*", "⋅": "*", "⁻¹": "^-1", "⁻²": "^-2", "²": "^2", "³": "^3", "**": "^"}
"""Characters of units, with those that the table has in their place."""
_WORDS = {
    "V": "volt volts v vdc vac v*dc v*ac millivolt=mV millivolts=mV mvolts=mV microvolt=uV microvolts=uV kilovolt=kV",
    "m": "meter meters metre metres millimeter=mm millimeters=mm millimetre=mm millimetres=mm "  # codespell:ignore
    "micron=um microns=um "
    "micrometer=um micrometers=um micrometre=um micrometres=um nanometer=nm mil=mil mils=mil thou=mil inch=in "
    "inches=in in.=in",
    "rad/s": "rpm=rpm r.p.m.=rpm rev/min=rpm revs/min=rpm u/min=rpm tr/min=rpm o/min=rpm omdr/min=rpm "
    "varv/min=rpm giri/min=rpm min^-1=rpm rps=rev/s "
    "radian/s radians/s rad/sec °/s=deg/s",
    "rad": "radian radians degree=deg degrees=deg deg=deg revs=rev revolution=rev revolutions=rev",
    "Pa": "pascal pascals kilopascal=kPa megapascal=MPa psi=psi psig=psig bar=bar barg=barg bar(g)=barg psi(g)=psig",
    "N": "newton newtons kilonewton=kN pound-force=lbf",
    "s": "sec secs second seconds msec=ms msecs=ms millisecond=ms milliseconds=ms usec=us usecs=us microsecond=us "
    "microseconds=us nsec=ns minute=min minutes=min",
    "m/s": "m/sec mm/sec=mm/s um/sec=um/s in/sec=in/s inch/s=in/s inch/sec=in/s ips=ips m*s^-1 mm*s^-1=mm/s",
    "m/s^2": "m/s/s m*s^-2 ms^-2 m/sec^2 mm/sec^2=mm/s^2 gn=g g_n=g g0=g gs=g g's=g gee=g gees=g",
    "Hz": "hz hertz khz=kHz kilohertz=kHz s/s cps sps samples/s 1/s=Hz s^-1=Hz",
    "kg*m": "g.mm=g*mm g-mm=g*mm gmm=g*mm kg.m kg-m kg.mm=kg*mm kg-mm=kg*mm",
    "kg/s": "kg/sec g/sec=g/s kg/hr=kg/h",
}
SPELLINGS = {
    si: {word: meant or si for word, _, meant in (entry.partition("=") for entry in words.split())}
    for si, words in _WORDS.items()
}
"""Further spellings of recorded data in small letters, by SI unit, with the unit of the table that each means."""
SPELLINGS["m/s^2"] |= {"G": "g", "mG": "mg"}


def advised(unit: str) -> tuple[str, ...]:
    """Units to advise for a quantity, the most common first."""
    kind = dimension(unit)
    common = (kind.example.partition(" ")[2], *reversed(kind.people), *kind.factors)
    return tuple(one for one in dict.fromkeys(common) if one not in READ_ONLY)


def dimension(unit: str) -> Dimension:
    """The entry of an SI unit; a plain one for a unit that is not listed."""
    return TABLE.get(unit) or Dimension(f"quantity in {unit}", f"1 {unit}", (unit,), {unit: "1"})


_TEXT = re.compile(rf"\s*({NUMBER})\s*(.*?)\s*", re.ASCII | re.DOTALL)
_COMMA = re.compile(r"\s*([+-]?\d+),(\d+)\s*([^\d,][^,]*?)?\s*", re.ASCII | re.DOTALL)
_UNIT = re.compile(r"(?!.*\d\d)[\w°%*/^(). -]{1,40}")
_SPELLINGS = CHARACTERS | {" * ": "*", " / ": "/", "°C": "degC"}
LONGEST = 25
"""Longest digits [characters] that an advice repeats as they stand; repr of a double has up to 24."""


CLOSE = 25.0
"""Largest factor from the example at which a number is advised in the example's unit."""
Suggest = Callable[[str], str]
"""Recommended text in place of an unreadable value, from its digits if there are any."""


def parse(value: Any, unit: str, suggest: Suggest | None = None) -> float:
    """SI value of `value`, text such as '25 um', or a bare number when `unit` is '1'.

    `suggest` makes the example of an error's sentence; by default it is one that is typical of the dimension.

    Raises
    ------
    ValueError
        With a sentence that names the value and the way out, if it has no unit, a wrong or an unknown one, or
        is not finite.
    """
    kind = dimension(unit)
    suggest = suggest or partial(suggestion, unit)

    def wrong(fault: str, digits: str = "") -> ValueError:
        return ValueError(f"{quote(value)} {fault}; write e.g. {quoted(suggest(digits), unit)}")

    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise wrong(f"is not {a(kind.name)}")
    plain = value if isinstance(value, str) else repr(int(value) if isinstance(value, int) else float(value))
    match = _TEXT.fullmatch(plain)
    if not match:
        raise wrong(f"is not {a(kind.name)}")
    if comma := _COMMA.fullmatch(plain):
        texts = _with_point(*comma.groups(""))
        if isfinite(_value(texts[0], unit)):
            raise ValueError(f"{quote(value)} has a comma; write {' or '.join(quoted(one, unit) for one in texts)}")
        raise wrong("has a comma", texts[0].partition(" ")[0])
    digits, written = match.groups()
    if not written and unit != "1":
        raise wrong("has no unit", digits)
    if written and unit == "1":
        plain = _shortest(_scaled(digits, "0.01", "0")) if written == "%" else digits
        raise wrong("has a unit but is a plain number", plain)
    factor, offset, fault = _conversion(written, unit) if written else ("1", "0", "")
    if fault:
        raise wrong(fault)
    number = _scaled(digits, factor, offset) if written else float(digits)
    if not isfinite(number):
        raise wrong("is too large a number")
    return number


def _with_point(whole: str, decimals: str, written: str) -> list[str]:
    """A number written with a comma, with a point; and without, where three digits after it may mean thousands."""
    meant = [f"{whole}.{decimals}", f"{whole}{decimals}"][: 2 if len(decimals) == 3 else 1]
    return [f"{number} {written}".strip() for number in meant]


def suggestion(unit: str, digits: str = "", fits: Callable[[float], bool] = lambda value: True, own: str = "") -> str:
    """A text that can be read: the digits with the unit that brings them nearest to an example, if they fit.

    Else the example; `own` is one of the field that is asked for, instead of the dimension's typical one.
    """
    example = own or dimension(unit).example
    if unit == "1":
        return digits if digits and isfinite(float(digits)) and fits(float(digits)) else example
    number, _, typical = example.partition(" ")
    typical_size = abs(_value(example, unit))
    units = list(dict.fromkeys((typical, *advised(unit))))
    short = digits if len(digits) <= LONGEST else _shortest(float(digits))
    for n in (short, number):
        own_unit = _value(f"{n} {typical}", unit) if n else 0.0
        if fits(own_unit) and _apart(abs(own_unit), typical_size) < log(CLOSE) and own_unit:
            return f"{n} {typical}"
        fitting = [f"{n} {u}" for u in units if n and isfinite(v := _value(f"{n} {u}", unit)) and fits(v)]
        if fitting:
            return min(fitting, key=lambda text: _apart(abs(_value(text, unit)), typical_size))
    return example


def _apart(a: float, b: float) -> float:
    """Distance of two sizes in powers; 0 where one of them is 0."""
    return abs(log(a) - log(b)) if a > 0 and b > 0 else 0.0


def _value(text: str, unit: str) -> float:
    """SI value of a number with a unit of the table; not a number where it is none."""
    number, _, written = text.partition(" ")
    return _scaled(number, dimension(unit).factors.get(written, "nan"), "0")


def quoted(text: str, unit: str) -> str:
    """A value as a machine file has it: in quotes where it has a unit."""
    return text if unit == "1" else f"'{text}'"


def show(value: float, unit: str) -> str:
    """Text of an SI value in a unit people use; `parse` gives exactly the same value back."""
    return _shortest(value) if unit == "1" else _with_unit(float(value), unit)


@lru_cache(maxsize=4096)
def _with_unit(value: float, unit: str) -> str:
    kind = dimension(unit)
    if value == 0:
        return "0 " + kind.example.split(" ", 1)[1]
    fitting = [u for u in kind.people if abs(value) >= 0.1 * float(kind.factors[u])] or list(kind.people[:1])
    decimal = Decimal(repr(value))
    for written in (fitting[-1], kind.people[-1]):
        scaled = float(decimal / Decimal(kind.factors[written]))
        for candidate in (float(f"{scaled:.12g}"), scaled):
            text = f"{_shortest(candidate)} {written}"
            if _reads_back(text, unit, value):
                return text
    return f"{_shortest(value)} {unit}"


def split(text: str) -> tuple[str, str]:
    """Digits and unit of a text such as '25 um'; the text and nothing where it has no digits."""
    match = _TEXT.fullmatch(text)
    return match.groups() if match else (text, "")  # type: ignore[return-value]


def _reads_back(text: str, unit: str, value: float) -> bool:
    try:
        return parse(text, unit) == value
    except ValueError:  # out of range in this unit
        return False


def a(noun: str) -> str:
    """A noun with its article."""
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"


def _shortest(value: float) -> str:
    return repr(float(value)).removesuffix(".0")


@lru_cache(maxsize=4096)
def _scaled(digits: str, factor: str, offset: str) -> float:
    plain = float(digits)
    if plain == 0 or not isfinite(plain):
        return plain + float(offset)
    return float(Decimal(digits) * Decimal(factor) + Decimal(offset))


@lru_cache(maxsize=1024)
def _conversion(written: str, unit: str) -> tuple[str, str, str]:
    """Factor and offset from `written` to `unit`, and what is wrong with it (nothing if it is a unit of this kind)."""
    for spelling, plain in _SPELLINGS.items():
        written = written.replace(spelling, plain)
    kind = dimension(unit)
    if written in kind.factors:
        return kind.factors[written], "0", ""
    problem = "" if _UNIT.fullmatch(written) else "unknown"
    factor, offset = "", ""
    if not problem:
        factor, offset, problem = _ask_pint(written, unit)
    if problem == "unknown":
        return "", "", "has an unknown unit"
    if problem or unit in CLOSED:
        return "", "", f"is not {a(kind.name)}"
    return factor, offset, ""


@lru_cache(maxsize=256)
def _ask_pint(written: str, unit: str) -> tuple[str, str, str]:
    """Factor, offset and problem ('', 'unknown' or 'wrong') of a unit that the table does not list."""
    from pint import DimensionalityError

    ureg = _registry()
    try:
        offset = ureg.Quantity(0.0, written).to(unit).magnitude
        factor = ureg.Quantity(1.0, written).to(unit).magnitude - offset
    except DimensionalityError:
        return "", "", "wrong"
    except Exception:  # pint's parser answers nonsense with anything from TokenError to AttributeError
        return "", "", "unknown"
    return repr(_round(factor)), repr(_round(offset)), ""


def _round(number: float) -> float:
    """`number` without pint's rounding error where a short decimal is meant."""
    short = float(f"{number:.12g}")
    return short if isclose(short, number, rel_tol=2e-15) else number


@lru_cache(maxsize=1)
def _registry() -> Any:
    from pint import UnitRegistry

    return UnitRegistry()
