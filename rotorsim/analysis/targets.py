"""Calibration targets from a TOML file: free parameters with bounds, operating points, measured values.

A parameter is one number; `fields` are what depends on it, each scale * value + offset. A target is either a range, the
smallest and the largest value over all operating points (`low`, `high`), or a `value` at one speed and pressure.
Targets with role = "predict" are reported and not fitted.

A table `pins` has poles, gain and fit of the pairs of pins by axis, as identification finds them behind their sensors.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rotorsim.analysis.axes import TEXT, checked
from rotorsim.base.display import neither
from rotorsim.base.errors import DataError
from rotorsim.base.input_files import instead, parse_toml
from rotorsim.base.units import parse

AXES = ("x", "y")
PINS = {"pole_slow": "rad/s", "pole_fast": "rad/s", "pin_gain": "1", "pin_fit": "1"}
"""Figures of a pair of pins as their sensors read them, with their SI units; gains in volts of the sensor per volt."""
UNITS = (
    {f"wn_{a}": "rad/s" for a in AXES}
    | {f"zeta_{a}": "1" for a in AXES}
    | {f"delay_{a}": "s" for a in AXES}
    | {f"gain_{a}{b}": "m/V" for a in AXES for b in AXES}
    | {f"{name}_{a}": unit for name, unit in PINS.items() for a in AXES}
    | {f"delay_read_{a}": "s" for a in AXES}
    | {"eccentricity_ratio": "1", "h_min": "m", "mass_flow": "kg/s", "lift_off": "Pa", "whirl_onset": "rad/s"}
)
"""Quantities with their SI units; gain_xy is disc x per volt of reference y, delay_read_x that behind pins as read."""
BARE = ("lift_off", "whirl_onset")
"""Figures of no single operating point: lift-off of the speed, whirl onset of the pressure."""
ROLES = ("fit", "predict")
COVERED = 0.5
"""Least share of a target's range that a machine's range must be wide."""


@dataclass(frozen=True)
class FollowingField:
    """A field of the machine file that follows a parameter: scale * value + offset, in the parameter's unit."""

    path: str
    scale: float
    offset: float


@dataclass(frozen=True)
class Parameter:
    """A free number between `low` and `high`, in `unit` (empty for pure numbers); `start` NaN: the machine's own."""

    name: str
    start: float
    low: float
    high: float
    unit: str
    fields: tuple[FollowingField, ...]

    def text(self, value: float) -> Any:
        """A value as a machine file has it."""
        return f"{value:.12g} {self.unit}" if self.unit else value


@dataclass(frozen=True)
class Target:
    """A measured or published figure in SI: `low` and `high` of a range, or the same value twice at an `at`."""

    name: str
    quantity: str
    low: float
    high: float
    tolerance: float
    role: str
    at: tuple[float, float] | None
    source: str

    def verdict(self, ends: tuple[float, float]) -> str:
        """'met' if both ends are within the tolerance, 'inside' if the range lies within this one, else 'not met'.

        Neither holds for a range less than `COVERED` as wide: a machine that hardly varies is not the rig.
        """
        low, high = ends
        if not np.isfinite([low, high]).all() or high - low < COVERED * (self.high - self.low):
            return "not met"
        if abs(low - self.low) <= self.tolerance and abs(high - self.high) <= self.tolerance:
            return "met"
        slack = 1e-12 * abs(self.tolerance)
        return "inside" if low >= self.low - slack and high <= self.high + slack else "not met"


@dataclass(frozen=True)
class Targets:
    """Everything a calibration needs besides the machine; speeds [rad/s], pressures [Pa]."""

    name: str
    parameters: tuple[Parameter, ...]
    targets: tuple[Target, ...]
    speeds: np.ndarray
    pressures: np.ndarray


def read_targets(path: str | Path) -> Targets:
    """Targets of a file, or of a shipped one by name; raises DataError with one sentence.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.analysis.read_targets("dtu_orifice").name
    'DTU thesis, Table E.2, orifice form'
    """
    known = shipped()
    file = known.get(str(path), Path(path))
    if not file.is_file():
        raise DataError(neither(str(path), "a shipped file of targets", known), argument="targets", value=path)
    try:
        document = parse_toml(file.read_text(encoding="utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        reason = instead(file, "targets", "") or f"is not a TOML file ({error})"
        raise DataError(f"{path}: {reason}; correct it") from error
    try:
        return _targets(document, str(file.stem))
    except DataError as error:
        ours = instead(file, "targets", "a file of targets")
        raise DataError(f"{path}: {ours}; give a file of targets" if ours else f"{path}: {error}") from error


def shipped() -> dict[str, Path]:
    """Targets that come along, by name."""
    folder = Path(__file__).parent / "shipped"
    return {file.stem: file for file in sorted(folder.glob("*.toml"))}


def _targets(document: dict[str, Any], name: str) -> Targets:
    grid = _table(document, "operating_points", "")
    speeds = checked("operating_points.speeds", _numbers(grid, "speeds", "rad/s"))
    pressures = checked("operating_points.pressures", _numbers(grid, "pressures", "Pa"))
    parameters = tuple(_parameter(n, t) for n, t in _table(document, "parameters", "").items())
    entries = document.get("targets", [])
    if not isinstance(entries, list) or not (entries or "pins" in document) or not parameters:
        raise DataError("there is nothing to fit; give [parameters.NAME] tables and [[targets]] or [pins]")
    pins = _pins(_table(document, "pins", "")) if "pins" in document else ()
    targets = (*pins, *(_target(t, k) for k, t in enumerate(entries)))
    if not any(t.role == "fit" for t in targets):
        raise DataError("no target has role = 'fit'; give at least one")
    _refuse_contradiction([t for t in targets if t.role == "fit"])
    return Targets(str(document.get("name", name)), parameters, targets, speeds, pressures)


def _pins(table: dict[str, Any]) -> tuple[Target, ...]:
    """Targets of the table `pins`: poles, gain and fit of the axes that it has, at one operating point.

    Tolerances of poles and gain are shares of the value, that of the fit is in points.
    """
    keys = ("speed", "pressure", "tolerances", "role", "source", *AXES)
    if unknown := [key for key in table if key not in keys]:
        raise DataError(f"pins.{unknown[0]}: there is no such entry; there are {', '.join(keys)}")
    at = _quantity("pins.speed", table.get("speed"), "rad/s"), _quantity("pins.pressure", table.get("pressure"), "Pa")
    shares, role, source = _table(table, "tolerances", "pins."), table.get("role", "fit"), str(table.get("source", ""))
    found = []
    for axis in (a for a in AXES if a in table):
        for entry, values in _pair(f"pins.{axis}", _table(table, axis, "pins.")).items():
            share = _positive(f"pins.tolerances.{entry}", shares.get(entry), "1")
            for name, value in values.items():
                tolerance = share if entry == "fit" else share * value
                words = f"{name.replace('_', ' ')} {axis}"
                found.append(Target(words, f"{name}_{axis}", value, value, tolerance, _role("pins", role), at, source))
    if not found:
        raise DataError(
            f"pins: has no axis; write pins.{AXES[0]} = {{poles = ['3000 rad/s', '8000 rad/s'], gain = 1.8}}"
        )
    return tuple(found)


def _pair(where: str, table: dict[str, Any]) -> dict[str, dict[str, float]]:
    """Values by quantity of each entry of an axis: two poles, a gain, a fit."""
    names = {"poles": ("pole_slow", "pole_fast"), "gain": ("pin_gain",), "fit": ("pin_fit",)}
    found = {}
    for key, entry in table.items():
        if key not in names:
            raise DataError(f"{where}.{key}: a pair of pins has no such entry; there are {', '.join(names)}")
        listed = entry if key == "poles" else [entry]
        if not isinstance(listed, list) or len(listed) != len(names[key]):
            raise DataError(f"{where}.poles: give two, the slow one first, e.g. ['3000 rad/s', '8000 rad/s']")
        values = [_positive(f"{where}.{key}", v, PINS[name]) for v, name in zip(listed, names[key], strict=True)]
        if values != sorted(values):
            raise DataError(f"{where}.poles: the slow one comes first; exchange them")
        found[key] = dict(zip(names[key], values, strict=True))
    return found


def _positive(where: str, value: Any, unit: str) -> float:
    """A quantity above zero."""
    number = _quantity(where, value, unit)
    if not number > 0:
        raise DataError(f"{where}: {value!r} is not positive; correct it")
    return number


def _role(where: str, role: Any) -> str:
    if role not in ROLES:
        raise DataError(f"{where}: role {role!r}; choose 'fit' or 'predict'")
    return str(role)


def _refuse_contradiction(fitted: list[Target]) -> None:
    """Refuse two fitted targets that ask the same number to be at two places further apart than their tolerances."""
    for i, one in enumerate(fitted):
        for other in fitted[:i]:
            if one.quantity != other.quantity or one.at != other.at:
                continue
            for end in ("low", "high"):
                a, b = getattr(one, end), getattr(other, end)
                if abs(a - b) > one.tolerance + other.tolerance:
                    weights = one.tolerance**-2, other.tolerance**-2
                    middle = (weights[0] * a + weights[1] * b) / sum(weights)
                    missed = abs(a - middle) / one.tolerance, abs(b - middle) / other.tolerance
                    asked = f"{b:.5g} and {a:.5g} {UNITS[one.quantity]}".removesuffix(" 1")
                    raise DataError(
                        f"targets '{other.name}' and '{one.name}' contradict each other: they ask {one.quantity} to be "
                        f"{asked}, and the best compromise, {middle:.5g}, misses them by "
                        f"{missed[1]:.2g} and {missed[0]:.2g} tolerances; leave one out or predict it"
                    )


def _table(document: dict[str, Any], key: str, where: str) -> dict[str, Any]:
    if not isinstance(document.get(key), dict):
        raise DataError(f"{where}{key}: is missing or no table; see 'rotorsim machine calibrate --help'")
    return dict(document[key])


def _numbers(table: dict[str, Any], key: str, unit: str) -> list[float]:
    values = table.get(key)
    if not isinstance(values, list):
        raise DataError(f"operating_points.{key}: give a list of texts with units")
    return [_quantity(f"operating_points.{key}", v, unit) for v in values]


def _quantity(where: str, value: Any, unit: str) -> float:
    if unit == "1":
        if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
            raise DataError(f"{where}: {value!r} is not a finite number")
        return float(value)
    try:
        number = float(parse(value, unit))
    except (ValueError, TypeError, AttributeError) as error:
        raise DataError(f"{where}: {error}") from error
    if not np.isfinite(number):
        raise DataError(f"{where}: {value!r} is not a finite number")
    return number


def _parameter(name: str, table: dict[str, Any]) -> Parameter:
    where = f"parameters.{name}"
    keys = ("low", "high", "start") if "start" in table else ("low", "high")
    values = {key: split(f"{where}.{key}", table.get(key)) for key in keys}
    units = {unit for _, unit in values.values()}
    if len(units) != 1:
        raise DataError(f"{where}: {', '.join(keys)} have the units {sorted(units)}; write all in one unit")
    low, high = values["low"][0], values["high"][0]
    start = values["start"][0] if "start" in table else float("nan")
    if not low < high or not (low <= start <= high or np.isnan(start)):
        raise DataError(f"{where}: start {start:g} is not between low {low:g} and high {high:g}; correct the bounds")
    unit = units.pop()
    fields = table.get("fields", [name])
    if not isinstance(fields, list) or not fields:
        raise DataError(f"{where}.fields: give a list of paths of the machine file")
    return Parameter(name, start, low, high, unit, tuple(_field(where, f, unit) for f in fields))


def _field(where: str, entry: Any, unit: str) -> FollowingField:
    if isinstance(entry, str):
        return FollowingField(entry, 1.0, 0.0)
    if not isinstance(entry, dict) or not isinstance(entry.get("path"), str):
        raise DataError(f"{where}.fields: {entry!r} has no path; write e.g. {{path = 'probe.position', scale = 1}}")
    offset, own = split(f"{where}.fields.offset", entry.get("offset", f"0 {unit}" if unit else 0))
    if own != unit:
        raise DataError(f"{where}.fields.offset: unit '{own}' is not the parameter's, '{unit}'; write it in that")
    return FollowingField(entry["path"], float(entry.get("scale", 1.0)), offset)


def split(where: str, value: Any) -> tuple[float, str]:
    """Number and unit of a text, or a pure number."""
    if isinstance(value, int | float) and not isinstance(value, bool) and np.isfinite(value):
        return float(value), ""
    match = TEXT.fullmatch(value) if isinstance(value, str) else None
    if not match or not match[2]:
        raise DataError(f"{where}: {value!r} is neither a number with a unit nor a pure number")
    return float(match[1]), match[2]


def _target(entry: dict[str, Any], number: int) -> Target:
    name = str(entry.get("name", f"target {number + 1}"))
    where, quantity, role = f"target '{name}'", entry.get("quantity"), entry.get("role", "fit")
    if quantity not in UNITS:
        raise DataError(f"{where}: quantity {quantity!r} does not exist; there are {', '.join(UNITS)}")
    unit = UNITS[quantity]
    single = "value" in entry
    if single == ("low" in entry and "high" in entry):
        raise DataError(f"{where}: give either a value or low and high")
    low, high = (_quantity(f"{where}.{k}", entry[k], unit) for k in (("value",) * 2 if single else ("low", "high")))
    if low > high:
        raise DataError(f"{where}: low is above high; exchange them")
    tolerance = _quantity(f"{where}.tolerance", entry.get("tolerance"), unit)
    if not tolerance > 0:
        raise DataError(f"{where}.tolerance: must be positive; it is the deviation that counts as one")
    at = None
    if single:
        speed = 0.0 if quantity == "whirl_onset" else _quantity(f"{where}.speed", entry.get("speed"), "rad/s")
        at = speed, 0.0 if quantity == "lift_off" else _quantity(f"{where}.pressure", entry.get("pressure"), "Pa")
    return Target(name, quantity, low, high, tolerance, _role(where, role), at, str(entry.get("source", "")))


def value_at(text: str, path: str) -> Any:
    """The value at a dotted path of a machine file's text; raises DataError where there is none."""
    value: Any = parse_toml(text)
    for key in path.split("."):
        try:
            value = value[int(key)] if isinstance(value, list) else value[key]
        except (KeyError, IndexError, ValueError, TypeError) as error:
            raise DataError(f"{path}: the machine file has no such value; check the path or give a start") from error
    return value
