"""Display units of pages: the one place that turns metric numbers of texts and tables into imperial ones.

Results are computed and stored in SI and pages are made in metric units; a page for other readers is converted when
it is written, text by text. Numbers keep their count of significant digits, amplitudes stay 0-pk or pk-pk as stated.
"""

from __future__ import annotations

import re
from html import escape, unescape

from rotorsim.base.errors import DataError
from rotorsim.base.suggest import did_you_mean

SYSTEMS = ("metric", "imperial")
_INCH, _LBF, _PSI = 25.4e-3, 4.4482216152605, 6894.757293168361
_OUNCE, _SCF = 28.349523125e-3, 28.316846592 * 273.15 / 288.7055555555556
"""Ounce [kg]; standard cubic foot (60 degF) in normal litres (0 degC)."""
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
    "g mm": ("oz in", 1e-6 / (_OUNCE * _INCH)),
    "g": ("oz", 1e-3 / _OUNCE),
}
"""By metric unit of pages: imperial unit, and how many of it are one."""
OF_SHORT_NAME = {"N", "g"}
"""Units that are converted behind a number and in brackets only: as words they are something else."""
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?"
_NAMES = "|".join(re.escape(unit) for unit in sorted(IMPERIAL, key=len, reverse=True))
_NAMES = _NAMES.replace("µ", "[µu]").replace(r"g\ mm", "g[ *]mm")
_END = r"(?![\w/]|\*\w| s/m| m\b)"
QUANTITY = re.compile(rf"(?<![\w.])((?:{NUMBER}(?: to | and |, | \+- | ± ))*{NUMBER})(\s?)({_NAMES}){_END}"
                      rf"( \({NUMBER} to {NUMBER}\))?")  # fmt: skip
"""Numbers with a unit: '1.2 µm', '0.3 to 0.7 MPa', '52 mg/s (51 to 53)'."""
BARE = re.compile(rf"(?<![\w/])({_NAMES}){_END}")
BRACKETED = re.compile(rf"\[({_NAMES}){_END}")
_KEPT = re.compile(r"(<(?:script|style|pre)\b.*?</(?:script|style|pre)>|<[^>]*>)", re.DOTALL)
_TABLE, _ROW, _CELL = (re.compile(rf"(<{tag}>)(.*?)(</{tag}>)", re.DOTALL) for tag in ("table", "tr", "t[hd]"))


def check_units(units: str) -> None:
    """Raise DataError for a system of units that is not known."""
    if units not in SYSTEMS:
        raise DataError(f"units: '{units}' is not known; {did_you_mean(units, SYSTEMS)}")


def imperial(unit: str) -> tuple[str, float]:
    """Imperial unit of a metric one, and how many of it are one metric unit."""
    return IMPERIAL[unit.replace("um", "µm").replace("*", " ")]


def unit_in(text: str) -> str | None:
    """Metric unit in the brackets of a label, or anywhere in that of a colour scale."""
    found = BRACKETED.search(text)
    return found[1] if found else None


def unit_anywhere(text: str) -> str | None:
    """Metric unit of a label that states it without brackets; none of a short name, which may be a word."""
    found = BARE.search(text)
    return found[1] if found and found[1] not in OF_SHORT_NAME else None


def converted(text: str) -> str:
    """Plain text with its quantities and units in imperial ones."""
    text = QUANTITY.sub(_quantity, text)
    text = BRACKETED.sub(lambda at: f"[{imperial(at[1])[0]}", text)
    return BARE.sub(lambda at: at[1] if at[1] in OF_SHORT_NAME else imperial(at[1])[0], text)


def scaled(number: str, factor: float) -> str:
    """A number times a factor, with as many significant digits, at least three."""
    digits = re.sub(r"e.*", "", number.lower()).lstrip("+-0.").replace(".", "")
    return f"{float(number) * factor:.{max(3, len(digits))}g}"


def _quantity(at: re.Match[str]) -> str:
    unit, factor = imperial(at[3])

    def number(one: re.Match[str]) -> str:
        return scaled(one[0], factor)

    return f"{re.sub(NUMBER, number, at[1])}{at[2]}{unit}{re.sub(NUMBER, number, at[4] or '')}"


def converted_html(page: str) -> str:
    """HTML with the quantities of its text in imperial units; scripts, styles and machine files stay."""
    page = _TABLE.sub(_table, page)
    pieces = _KEPT.split(page)
    return "".join(p if k % 2 else escape(converted(unescape(p)), quote=False) for k, p in enumerate(pieces))


def micrometres(page: str) -> str:
    """HTML with the sign µm for the unit that terminals and files write as um; machine files stay."""
    pieces = _KEPT.split(page)
    return "".join(p if k % 2 else re.sub(r"(?<=[\d\[( ])um\b", "µm", p) for k, p in enumerate(pieces))


def _table(at: re.Match[str]) -> str:
    """A table with the numbers below heads that state a metric unit converted; the heads are text like any other."""
    heads: list[str | None] = []

    def row(line: re.Match[str]) -> str:
        cells = _CELL.findall(line[2])
        if cells and cells[0][0] == "<th>" and cells[-1][0] == "<th>":
            heads[:] = [unit_in(unescape(text)) for _, text, _ in cells]
            return line[0]
        if len(cells) != len(heads):
            return line[0]
        pairs = zip(cells, heads, strict=True)
        return line[1] + "".join(a + _cell(text, unit) + b for (a, text, b), unit in pairs) + line[3]

    return at[1] + _ROW.sub(row, at[2]) + at[3]


def _cell(text: str, unit: str | None) -> str:
    return scaled(text, imperial(unit)[1]) if unit and re.fullmatch(NUMBER, text) else text
