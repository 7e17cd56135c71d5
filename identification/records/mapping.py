"""Mapping of file columns to channels with units: a small TOML file, checked entry by entry.

::

    [time]                          # or: sample_rate = "5 kHz"
    column = "t"                    # name, or number from 1
    unit = "ms"
    [channels.disc_measured.x]
    column = "X probe"
    unit = "V"
    sensitivity = "8 V/mm"          # also: scale = 2.0, sign = -1, offset = "0.1 mm"
    [constants]
    pressure = "0.3 MPa"

    [keyphasor]                     # pulses: the shaft's angle and speed
    column = "key"
    unit = "V"
    edge = "falling"                # or rising; level = "2.5 V", hysteresis = "0.5 V", pulses = 1
    [probes.A]                      # in place of channels.disc_measured: probes at any angle from x towards y
    column = "probe A"
    unit = "mil"
    angle = "45 deg"
    coupling = "DC"                 # or AC; gap = "-10 V" or "mean" is taken off a DC-coupled one
    position = "150 mm"             # its plane; [disc] position = "150 mm" chooses the disc's among several

    [hammer]                        # in place of channels.disc_force: one force at any angle and plane
    column = "hammer"
    unit = "N"
    angle = "90 deg"                # from x towards y
    position = "320 mm"             # if that is not the disc's

    [file]                          # where it is not clear: delimiter = "tab", decimal = "comma"
    encoding = "cp1252"             # UTF-8 is tried first, then Latin-1

and for run-up vectors `[speed]` and `[vectors.1X.x]` with `amplitude` and `phase`, each an entry as above. A value is
sign * scale * (column in SI, through the sensitivity if there is one) + offset.

The table [changes] states what was changed on purpose before a record was made.

::

    [changes]
    trial_weight = { me = "300 g*mm", phase = "45 deg", position = "160 mm" }   # or a list; else the first disc
    sensor_ring = { angle = "30 deg" }                                          # of both probes, from x towards y
    "effects.gas_heating.rise" = "12 K"                                         # a new value of the machine file

It becomes the attribute `changes` of the record, a JSON text with weights and ring in SI; `rotorsim diagnose` reads it.
"""

import json
import math
import re
import tomllib
from collections.abc import Mapping as Tables
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from identification.records import sensors
from identification.records.columns import quantity_at
from identification.records.schema import AXES, VARIABLES, VECTORS
from rotorsim.base.display import did_you_mean, quote
from rotorsim.base.errors import ReadError
from rotorsim.base.input_files import instead, parse_toml

MAX_BYTES = 1_000_000
MOST_PULSES = 10_000
_ENTRY = ("column", "unit", "sensitivity", "scale", "sign", "offset", "full_scale")
_SECTIONS = ("time", "channels", "keyphasor", "hammer", "probes", "disc", "constants", "conditions", "changes", "speed",
             "vectors", "slow_roll", "file")  # fmt: skip
_KEYPHASOR = ("level", "hysteresis", "edge", "pulses")
_CONDITIONS = {"accuracy": "m", "rate": "rad/s", "pressure": "Pa", "clock": "s", "probe_angle": "rad"}
"""Conditions of a whole file with their SI units: standard deviations of an amplitude and of the displacements' clock,
ramp rate and supply pressure of vectors, angle of their only probe."""
TURNS = "turns"
_FILE = {"delimiter": ("comma", "semicolon", "tab", "space"), "decimal": ("point", "comma"), "encoding": ()}
_ORDER = re.compile(r"([1-9]\d{0,2})X", re.ASCII)


@dataclass(frozen=True)
class ColumnEntry:
    """Source of the values of one channel; `path` is the entry's place in the mapping."""

    path: str
    column: str | int
    unit: str | None = None
    sensitivity: str | None = None
    factor: float = 1.0
    offset: str | None = None
    full_scale: str | None = None
    """Full scale of a column in shares of it, as in WAV files."""


@dataclass(frozen=True)
class Mapping:
    """Channels by (variable, label), vectors by (quantity, order, axis); the label is '' where a variable has none.

    Examples
    --------
    >>> import rotorsim as rs
    >>> from identification.records.mapping import ColumnEntry
    >>> channels = {("angle", ""): ColumnEntry("channels.angle", column="phi", unit="rad")}
    >>> rs.identification.Mapping(sample_rate=5e3, channels=channels).maps_columns
    True
    """

    time: ColumnEntry | None = None
    sample_rate: float | None = None
    channels: dict[tuple[str, str], ColumnEntry] = field(default_factory=dict)
    constants: dict[str, float] = field(default_factory=dict)
    speed: ColumnEntry | None = None
    vectors: dict[tuple[str, int, str], ColumnEntry] = field(default_factory=dict)
    file: dict[str, str] = field(default_factory=dict)
    conditions: dict[str, Any] = field(default_factory=dict)
    text: str = ""
    keyphasor: tuple[ColumnEntry, sensors.Keyphasor] | None = None
    probes: dict[str, tuple[ColumnEntry, sensors.LabProbe]] = field(default_factory=dict)
    hammer: tuple[ColumnEntry, sensors.LabHammer] | None = None
    slow_roll: sensors.SlowRollSource | None = None
    disc: float | None = None
    """Position [m] of the plane that is the disc's, where probes stand at several."""

    @property
    def maps_columns(self) -> bool:
        """Whether it maps any column; one of conditions alone leaves that to the columns' names."""
        return bool(self.vectors or self.channels or self.probes)


def load_mapping(mapping: str | Path | Tables[str, Any] | Mapping) -> Mapping:
    """Mapping from a TOML file or from its tables; raises ReadError with one sentence for the first problem.

    Examples
    --------
    >>> import rotorsim as rs
    >>> channels = {"disc_measured": {"x": {"column": "X", "unit": "um"}, "y": {"column": "Y", "unit": "um"}}}
    >>> rs.identification.load_mapping({"time": {"sample_rate": "5 kHz"}, "channels": channels}).sample_rate
    5000.0
    """
    if isinstance(mapping, Mapping):
        return mapping
    if isinstance(mapping, Tables):
        return parse(dict(mapping))
    path = Path(mapping)
    try:
        text = _text(path)
        return parse(parse_toml(text), text, path.parent)
    except tomllib.TOMLDecodeError as error:
        reason = instead(path, "a mapping", "") or f"not a TOML file: {str(error)[:200]}; correct that line"
        raise ReadError(f"{path}: {reason}") from error
    except ReadError as error:
        ours = instead(path, "a mapping", "a mapping of measured data")
        reason = f"{ours}; 'rotorsim data mapping' drafts one" if ours else str(error)
        raise ReadError(f"{path}: {reason}") from error


def parse(tables: dict[str, Any], text: str = "", folder: Path = Path()) -> Mapping:
    """Mapping from TOML tables; paths in it start from `folder`."""
    _only("mapping", tables, _SECTIONS)
    if isinstance(tables.get("keyphasor"), list):
        raise ReadError(f"keyphasor: {len(tables['keyphasor'])} keyphasors; keep the one that marks the angle")
    for section, table in tables.items():
        _table(section, table)
    time = dict(tables.get("time", {}))
    rate = time.pop("sample_rate", None)
    mapping = Mapping(
        time=_entry("time", time) if time else None,
        sample_rate=None if rate is None else _rate(rate),
        channels=_channels(tables.get("channels", {})),
        constants={name: _constant(name, value) for name, value in tables.get("constants", {}).items()},
        speed=_entry("speed", tables["speed"]) if "speed" in tables else None,
        vectors=_vectors(tables.get("vectors", {})),
        file=_file(tables.get("file", {})),
        conditions=_conditions(tables.get("conditions", {})) | stated_changes(tables.get("changes", {})),
        text=text,
        keyphasor=_keyphasor(dict(tables["keyphasor"])) if "keyphasor" in tables else None,
        slow_roll=sensors.parse_slow_roll(tables["slow_roll"], _order, folder) if "slow_roll" in tables else None,
        disc=_disc(tables["disc"]) if "disc" in tables else None,
        hammer=_hammer(dict(tables["hammer"])) if "hammer" in tables else None,
        probes={name: _probe(f"probes.{name}", part) for name, part in tables.get("probes", {}).items()},
    )
    return _consistent(mapping)


def _conditions(table: dict[str, Any]) -> dict[str, Any]:
    """Accuracy [m], rate [rad/s2], pressure [Pa], clock [s], probe_angle [rad] and turns, as attributes of a record."""
    _only("conditions", table, (*_CONDITIONS, TURNS))
    written = {name: _per_second(value) if name == "rate" else value for name, value in table.items()}
    turns = {TURNS: _turns(written.pop(TURNS))} if TURNS in written else {}
    found = {name: quantity_at(f"conditions.{name}", value, _CONDITIONS[name]) for name, value in written.items()}
    for name, value in found.items():
        if not 0 < value < math.inf and name != "probe_angle":
            raise ReadError(f"conditions.{name}: {quote(table[name])}; give a positive one")
    return found | turns


def _turns(value: Any) -> float:
    """The number of revolutions that each vector is fitted over."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 1 <= value < math.inf:
        raise ReadError(f"conditions.turns: {quote(value)}; write a number from 1, e.g. turns = 8")
    return float(value)


def _per_second(rate: Any) -> Any:
    """The speed that a ramp rate, such as '229 rpm/s', gains in a second."""
    if isinstance(rate, str) and rate.replace(" ", "").endswith("/s"):
        return rate.rpartition("/")[0]
    raise ReadError(f"conditions.rate: {quote(rate)}; write a speed per second, e.g. rate = '229 rpm/s'")


def _consistent(mapping: Mapping) -> Mapping:
    if mapping.vectors and (mapping.channels or mapping.time or mapping.constants or mapping.sample_rate):
        raise ReadError("mapping: holds [vectors] and parts of a time series; a file is one or the other: remove one")
    if mapping.vectors and not mapping.speed:
        raise ReadError("mapping: [vectors] without [speed]; name the column of the speed and its unit")
    if mapping.speed and not mapping.vectors:
        raise ReadError("mapping: [speed] without [vectors]; the speed of a time series goes to [channels.speed]")
    names = {name for name, _ in mapping.channels} | set(mapping.constants)
    if mapping.probes and "disc_measured" in names:
        raise ReadError("mapping: [probes] and [channels.disc_measured] are the same motion; remove one")
    if mapping.keyphasor and "angle" in names:
        raise ReadError("mapping: [keyphasor] and [channels.angle] are the same angle; remove one")
    if mapping.hammer and "disc_force" in names:
        raise ReadError("mapping: [hammer] and [channels.disc_force] are the same force; remove one")
    if mapping.vectors and (mapping.keyphasor or mapping.probes or mapping.hammer):
        raise ReadError("mapping: [vectors] are not a time series; remove [keyphasor], [hammer] and [probes]")
    alone = mapping.time or mapping.sample_rate or mapping.constants or mapping.keyphasor or mapping.hammer
    if not mapping.maps_columns and (alone or not (mapping.conditions or mapping.slow_roll or mapping.file)):
        raise ReadError("mapping: no [channels.NAME] and no [vectors.1X.x]; map at least one column")
    twice = set(mapping.constants) & {name for name, _ in mapping.channels}
    if twice:
        raise ReadError(f"mapping: {min(twice)} is a channel and a constant; remove one")
    return mapping


def _disc(table: dict[str, Any]) -> float:
    _only("disc", table, ("position",))
    if "position" not in table:
        raise ReadError("disc.position: is missing; give that of the disc's probes, e.g. '150 mm', or leave out [disc]")
    return quantity_at("disc.position", table["position"], "m")


def _keyphasor(table: dict[str, Any]) -> tuple[ColumnEntry, sensors.Keyphasor]:
    several = [name for name, part in table.items() if isinstance(part, dict)]
    if several:
        raise ReadError(
            f"keyphasor: {len(several)} keyphasors ({', '.join(several)}); keep the one that marks the angle"
        )
    own = {key: table.pop(key) for key in _KEYPHASOR if key in table}
    entry = _entry("keyphasor", table, _KEYPHASOR)
    volts = {key: quantity_at(f"keyphasor.{key}", own[key], "V") for key in ("level", "hysteresis") if key in own}
    edge, pulses = own.get("edge", "falling"), own.get("pulses", 1)
    if edge not in ("falling", "rising"):
        raise ReadError(f"keyphasor.edge: {quote(edge)}; write falling or rising")
    if isinstance(pulses, bool) or not isinstance(pulses, int) or not 1 <= pulses <= MOST_PULSES:
        raise ReadError(f"keyphasor.pulses: {quote(pulses)}; give the whole number of pulses in a turn")
    return entry, sensors.Keyphasor(edge=edge, pulses=pulses, **volts)


def _hammer(table: dict[str, Any]) -> tuple[ColumnEntry, sensors.LabHammer]:
    if "angle" not in table:
        raise ReadError("hammer.angle: is missing; give the direction of the blow from x towards y, e.g. '90 deg'")
    angle = quantity_at("hammer.angle", table.pop("angle"), "rad")
    position = quantity_at("hammer.position", table.pop("position"), "m") if "position" in table else None
    return _entry("hammer", table, ("angle", "position")), sensors.LabHammer(angle, position)


def _probe(path: str, table: Any) -> tuple[ColumnEntry, sensors.LabProbe]:
    _table(path, table)
    entry, probe = sensors.split_probe(path, table)
    return _entry(path, entry, sensors.OWN), probe


def _channels(table: dict[str, Any]) -> dict[tuple[str, str], ColumnEntry]:
    entries = {}
    for name, value in table.items():
        path = f"channels.{name}"
        _table(path, value)
        if name not in VARIABLES:
            raise ReadError(f"{path}: no such channel; {did_you_mean(name, VARIABLES)}")
        dims = VARIABLES[name].dims
        if not dims:
            entries[name, ""] = _entry(path, value)
            continue
        for label, part in value.items():
            _table(f"{path}.{label}", part, f"write [{path}.{'1' if dims == ('injector',) else 'x'}]")
            entries[name, label] = _entry(f"{path}.{label}", part)
    return entries


def _vectors(table: dict[str, Any]) -> dict[tuple[str, int, str], ColumnEntry]:
    entries = {}
    for order, axes in table.items():
        number = _order(order)
        _table(f"vectors.{order}", axes)
        _only(f"vectors.{order}", axes, AXES)
        for axis, parts in axes.items():
            path = f"vectors.{order}.{axis}"
            _table(path, parts)
            _only(path, parts, tuple(VECTORS))
            for name in VECTORS:
                if name not in parts:
                    raise ReadError(f"{path}: no {name}; write e.g. {name} = {{ column = 2, unit = 'deg' }}")
                _table(f"{path}.{name}", parts[name])
                entries[name, number, axis] = _entry(f"{path}.{name}", parts[name])
    return entries


def _order(name: str) -> int:
    match = _ORDER.fullmatch(name)
    if not match:
        raise ReadError(f"vectors.{name}: not an order; write e.g. [vectors.1X.x]")
    return int(match[1])


def _entry(path: str, table: dict[str, Any], more: tuple[str, ...] = ()) -> ColumnEntry:
    _only(path, table, (*_ENTRY, *more))
    column = table.get("column")
    if isinstance(column, bool) or not isinstance(column, (str, int)) or column == "":
        raise ReadError(f"{path}.column: {quote(column)}; give the column's name, or its number from 1")
    for key in ("unit", "sensitivity", "offset", "full_scale"):
        if not isinstance(table.get(key, ""), str):
            raise ReadError(f"{path}.{key}: {quote(table[key])} has no unit; write it as text, e.g. 'um'")
    scale, sign = table.get("scale", 1.0), table.get("sign", 1)
    if isinstance(scale, bool) or not isinstance(scale, (int, float)) or not math.isfinite(scale) or scale == 0:
        raise ReadError(f"{path}.scale: {quote(scale)}; give a number other than 0")
    if isinstance(sign, bool) or sign not in (1, -1):
        raise ReadError(f"{path}.sign: {quote(sign)}; write 1 or -1")
    if "full_scale" in table and "unit" in table:
        raise ReadError(f"{path}: full_scale and unit; the unit is that of the full scale: remove one")
    unit, measured, scaled = (table.get(key) for key in ("unit", "sensitivity", "full_scale"))
    return ColumnEntry(path, column, unit, measured, float(scale) * sign, table.get("offset"), scaled)


def _constant(name: str, value: Any) -> float:
    if name not in VARIABLES or VARIABLES[name].dims:
        known = [n for n, variable in VARIABLES.items() if not variable.dims]
        raise ReadError(f"constants.{name}: no quantity that a constant can give; {did_you_mean(name, known)}")
    return quantity_at(f"constants.{name}", value, VARIABLES[name].units)


def _rate(value: Any) -> float:
    rate = quantity_at("time.sample_rate", value, "Hz")
    if rate <= 0:
        raise ReadError(f"time.sample_rate: {quote(value)} must be above 0")
    return rate


def _file(table: dict[str, Any]) -> dict[str, str]:
    _only("file", table, tuple(_FILE))
    for key, value in table.items():
        if key == "encoding":
            _check_encoding(value)
        elif value not in _FILE[key]:
            raise ReadError(f"file.{key}: {quote(value)}; write one of {', '.join(_FILE[key])}")
    return table


def _check_encoding(name: Any) -> None:
    """Raise ReadError unless a name is that of a text encoding."""
    try:
        "a".encode(name)
    except (LookupError, TypeError, UnicodeError, ValueError) as error:
        raise ReadError(f"file.encoding: {quote(name)} is no encoding; write e.g. 'utf-8' or 'latin-1'") from error


def _only(path: str, table: dict[str, Any], known: tuple[str, ...]) -> None:
    for key in table:
        if key not in known:
            raise ReadError(f"{path}: unknown entry {quote(key)}; {did_you_mean(key, known)}")


def _table(path: str, value: Any, hint: str = "") -> None:
    if not isinstance(value, dict):
        raise ReadError(f"{path}: {quote(value)} is not a table; {hint or f'write [{path}] and its entries below'}")


def _text(path: Path) -> str:
    if not path.is_file():
        raise ReadError("is not a file; give the path of a mapping")
    if path.stat().st_size > MAX_BYTES:
        raise ReadError("is above the limit of 1 MB; is it a mapping?")
    try:
        return path.read_bytes().decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ReadError("cannot be read as text; a mapping is TOML in UTF-8") from error


WEIGHT, RING = "trial_weight", "sensor_ring"
_PARTS = {WEIGHT: {"me": "kg*m", "phase": "rad", "position": "m"}, RING: {"angle": "rad"}}
_EXAMPLES = {WEIGHT: "{ me = '300 g*mm', phase = '45 deg' }", RING: "{ angle = '30 deg' }"}


def stated_changes(table: dict[str, Any]) -> dict[str, str]:
    """The attribute; raises ReadError with one sentence."""
    found: dict[str, Any] = {}
    for name, value in table.items():
        if name == WEIGHT:
            weights = value if isinstance(value, list) else [value]
            found[name] = [_numbers(WEIGHT, w) for w in weights]
        elif name == RING:
            found[name] = _numbers(RING, value)
        elif isinstance(value, bool) or not isinstance(value, (str, int, float)):
            raise ReadError(f"changes.{quote(name)}: {quote(value)}; quote the path and give one value with its unit")
        else:
            found[name] = value
    return {"changes": json.dumps(found)} if found else {}


def _numbers(change: str, given: Any) -> dict[str, float]:
    """The numbers [SI] of a weight or ring, of which the first is needed."""
    path, units = f"changes.{change}", _PARTS[change]
    if not isinstance(given, dict) or next(iter(units)) not in given:
        raise ReadError(f"{path}: {quote(given)}; write {_EXAMPLES[change]}")
    for name in given:
        if name not in units:
            raise ReadError(f"{path}.{name}: is not known; give {', '.join(units)}")
    return {name: quantity_at(f"{path}.{name}", value, units[name]) for name, value in given.items()}
