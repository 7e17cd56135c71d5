"""Display units of pages: the one place that decides in which unit a number is shown.

Results are computed and stored in SI. A number with a unit becomes a text once, by `quantity`, in the system of units
of the page that is being made (`unit_system`); columns and axes state their unit in the brackets of their label, and
`label` and `in_shown_units` turn label and numbers together. Nothing else is touched: the name of a machine, a sentence
of somebody else or an acceleration in g stay as they are. Numbers keep their count of significant digits.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar

from rotorsim.base.display import did_you_mean
from rotorsim.base.errors import DataError
from rotorsim.base.units import TO_UM

SYSTEMS = ("metric", "imperial")
_INCH, _LBF, _PSI = 25.4e-3, 4.4482216152605, 6894.757293168361
_OUNCE, _SCF = 28.349523125e-3, 28.316846592 * 273.15 / 288.7055555555556
"""Ounce [g], and a standard cubic foot (60 degF) in normal litres (0 degC)."""
IMPERIAL: dict[str, tuple[str, float]] = {
    "µm/V": ("mil/V", 1 / 25.4),
    "µm/N": ("mil/lbf", _LBF / 25.4),
    "V/µm": ("V/mil", 25.4),
    "V/N": ("V/lbf", _LBF),
    "µm": ("mil", 1 / 25.4),
    "mm": ("in", 1e-3 / _INCH),
    "MPa": ("psi", 1e6 / _PSI),
    "kPa": ("psi", 1e3 / _PSI),
    "kN s/m": ("lbf s/in", 1e3 * _INCH / _LBF),
    "MN/m": ("klbf/in", 1e6 * _INCH / _LBF / 1e3),
    "N/m": ("lbf/in", _INCH / _LBF),
    "N m": ("lbf in", 1 / (_LBF * _INCH)),
    "N": ("lbf", 1 / _LBF),
    "mg/s": ("lb/h", 1e-6 * 3600 / 0.45359237),
    "Nl/min": ("scfm", 1 / _SCF),
    "normal litres per minute": ("standard cubic feet per minute", 1 / _SCF),
    "kg": ("lb", 1 / 0.45359237),
    "g mm": ("oz in", 1e-6 / (_OUNCE * _INCH)),
    "g": ("oz", 1e-3 / _OUNCE),
}
"""Imperial unit of each metric unit of pages, and how many of it are one metric unit."""
_SYSTEM: ContextVar[str] = ContextVar("unit_system", default="metric")
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?"
_LABELLED = "|".join(
    re.escape(unit).replace("µ", "[µu]").replace(r"g\ mm", "g[ *]mm")
    for unit in sorted(IMPERIAL, key=len, reverse=True)
    if unit != "g"
)
_END = r"(?![\w/]|\*\w| s/m| m\b)"
BRACKETED = re.compile(rf"\[({_LABELLED}){_END}")
"""Unit in the brackets of a label; never g, which there is an acceleration."""
PLACED = re.compile(rf"(%\{{[^}}]*\}} )({_LABELLED}){_END}")
"""Unit behind a placeholder of the text that a figure shows at a point."""
LEADING = re.compile(rf"^({_LABELLED}){_END}")
"""Unit with which the title of a colour scale or of an axis begins."""


def check_units(units: str) -> None:
    """Raise DataError for a system of units that is not known."""
    if units not in SYSTEMS:
        raise DataError(f"units: '{units}' is not known; {did_you_mean(units, SYSTEMS)}", argument="units", value=units)


@contextmanager
def unit_system(units: str) -> Iterator[None]:
    """Within, pages are made in "metric" or "imperial" units; raises DataError for another system."""
    check_units(units)
    token = _SYSTEM.set(units)
    try:
        yield
    finally:
        _SYSTEM.reset(token)


@contextmanager
def page_system(units: str) -> Iterator[None]:
    """Within, a page is made in imperial units where they are asked for, else in those of the surroundings."""
    with nullcontext() if units == "metric" else unit_system(units):
        yield


def use_units(units: str) -> None:
    """Make pages in "metric" or "imperial" units from here on; raises DataError for another system."""
    check_units(units)
    _SYSTEM.set(units)


def is_imperial() -> bool:
    """True while a page is made in imperial units."""
    return _SYSTEM.get() == "imperial"


def imperial(unit: str) -> tuple[str, float]:
    """Imperial unit of a metric one, and how many of it are one metric unit."""
    return IMPERIAL[unit.replace("um", "µm").replace("*", " ")]


def quantity(value: float, unit: str, form: str = ".3g") -> str:
    """A number of a metric unit as a text with its unit, in the units of the page."""
    return f"{number(value, unit, form)} {unit_name(unit)}"


def displacement(value: float, form: str = ".3g") -> str:
    """A displacement [m] as a text in micrometres or mils."""
    return quantity(value * TO_UM, "µm", form)


def number(value: float, unit: str, form: str = ".3g") -> str:
    """A number of a metric unit as a text without its unit, in the units of the page."""
    text = format(value, form)
    known = is_imperial() and unit.replace("um", "µm").replace("*", " ") in IMPERIAL
    return scaled(text, imperial(unit)[1]) if known and re.fullmatch(NUMBER, text) else text


def unit_name(unit: str) -> str:
    """Name of a metric unit in the units of the page."""
    name = unit.replace("um", "µm")
    return imperial(name)[0] if is_imperial() and name.replace("*", " ") in IMPERIAL else name


def unit_in(text: str) -> str | None:
    """Metric unit in the brackets of a label."""
    found = BRACKETED.search(text)
    return found[1] if found else None


def label(text: str) -> str:
    """A label of a column or an axis with the unit in its brackets in the units of the page."""
    return imperial_label(text) if is_imperial() else text


def imperial_label(text: str) -> str:
    """A label with the unit in its brackets as an imperial one."""
    return BRACKETED.sub(lambda at: f"[{imperial(at[1])[0]}", text)


def in_shown_units(text: str, unit: str | None) -> str:
    """A number as a text, below a label that states a metric unit, in the units of the page; another text stays."""
    wanted = unit is not None and is_imperial() and re.fullmatch(NUMBER, text)
    return scaled(text, imperial(str(unit))[1]) if wanted else text


def scaled(text: str, factor: float) -> str:
    """A number times a factor, with as many significant digits, at least three."""
    digits = re.sub(r"e.*", "", text.lower()).lstrip("+-0.").replace(".", "")
    return f"{float(text) * factor:.{max(3, len(digits))}g}"


def micrometres(text: str) -> str:
    """A text with the sign µm for the unit that terminals and files write as um."""
    return re.sub(r"(?<=[\d\[( ])um\b", "µm", text)
