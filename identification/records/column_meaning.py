r"""Meaning of the columns of a file that nobody has mapped: by stated units, by names in several languages, by values.

A kind is stated only where the evidence agrees. A unit counts more than a name; values can refuse both. They show

- a clock: steps that are even once the rounding of the stamps is taken off;
- pulses of a keyphasor: two levels and even intervals;
- a speed: slow, and in every part of the record 60, 1 or 2 pi times the frequency of the pulses, or else of the
  strongest line of the displacements, which also gives its unit;
- an angle of the shaft: it rises, or starts anew at each turn, as fast as a speed of the file;
- a proximity probe: a gap voltage of some -10 V that moves with the shaft;
- a hammer: blows that stand far above a quiet signal; the axis that answers most is its direction.

Temperatures, currents, torques, sound and the like are no channel of a record, whatever else their names hold.
"""

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.records.columns import FACTORS, OTHER_UNITS, Column, DataTable, dead, is_unit, is_unit_of
from identification.records.sampling import problems, unrounded
from identification.records.schema import VARIABLES, VECTORS
from identification.records.sensors import Keyphasor, pulse_times
from rotorsim.base.errors import ReadError

_NONE = (
    r"temp(?!o\b|s\b)|température|\bt oil|(?<!wirbel)strom\b|current|courant|\bcurr\b|torque|drehmoment|couple\b|\bmic"
    r"|mikro|sound|schall|\bstatus|count|z[aä]hler|power|leistung|puissance|flow|durchfluss|débit|humid|feuchte|alarm"
    r"|\boil|öl|atmos|ambient|barom|umgebung|absol|\bv in\b|\bload|static"
    r"|(bearing|lager|palier|reaction|leje).*(force|kraft)"
)
"""Pattern of names that are no channel of a record."""
_WORDS: dict[str, tuple[str, str]] = {
    "time": (
        "s",
        r"^(t|time|zeit|temps|tid|tiempo|tempo|seconds?|sekunden|laufzeit|elapsed|relative time|x value|x axis( value)?"
        r"|messzeit|timestamp|zeitstempel)( (s|sec|ms|us|min))?$|^(time|zeit|temps|tid) ",
    ),
    "disc_force": ("N", r"force|hammer|kraft|marteau|slag|martillo|martello|fuerza|forza|\bf ?[xy]\b"),
    "keyphasor": (
        "V",
        r"key ?ph|phasor|phaseur|\bkey\b|\bkph\b|\bkp\b|tach|trig|pul[s]e?\b|once|top ?tour|phasengeber"
        r"|phasenbezug|phase ref|1/rev|per rev|lichtschranke",
    ),
    "phase": ("rad", r"\b\d ?x\b.*(phase|phas|lag|deg)|^phase\b"),
    "amplitude": ("m", r"\b\d ?x\b.*(amp|ampl|mag)|^(amp|amplitude)\b"),
    "acceleration": ("m/s^2", r"acc|accél|beschl|\ba ?[xyz]\b"),
    "velocity": ("m/s", r"\bvel(oc)?(ity)?\b|schwinggeschw|schwingschnelle|vitesse vib|svinghast"),
    "angle": (
        "rad",
        r"(wellen|dreh|kurbel|rotor)?winkel|drehgeber|\bangle|angular position|position angulaire|codeur|encoder"
        r"|[áa]ngulo|angolo|vinkel",
    ),
    "speed": (
        "rad/s",
        r"\bk?rpm\b|rpm$|speed|drehzahl|\bomega\b|^n( hz| welle| shaft)?$|vitesse|velocidad|velocità|varvtal|omdr"
        r"|velocita|régime|regime|revs|giri|tours? ?/? ?min|rotation",
    ),
    "pressure": (
        "Pa",
        r"\bpress\b|pressure|pression|presi[óo]n|druck|tryk|tryck|supply|zuluft|^p( \w+)?( (k|m)?pa| m?bar| psi)?$",
    ),
    "reference": (
        "V",
        r"\bref\b|refer|\bref[xy]|drive(?! ?end)|command|excit|\bu ?[12xy]\b|piezo|shaker|anregung|soll\b"
        r"|consigne|\bdac\b",
    ),
    "probe": (
        "m",
        r"probe|prox|disp|weg|orbit|shaft|disc|\b[xy]\b|\d+ ?(l|r|left|right)\b|y axis value|eddy|wirbelstrom|auslenk"
        r"|verschieb|dépl|depl|desplaz|forskyd|läge|spost|abstand|laser|position|\d[xy]d\b|\bd\d?[xy]\b",
    ),
}
"""SI unit of the quantity of a kind of column, and pattern of its name in plain words; the first that fits counts."""
BY_UNIT = {"m": "probe", "m/s": "velocity", "m/s^2": "acceleration", "N": "disc_force", "s": "time"}
"""Kind of a column by the quantity of its unit."""
COMMON = ("time", "speed", "pressure")
"""Names of the schema that files of others have too, in units of their own."""
AMBIGUOUS = ("in", "m", "s", "n", "v", "min", "1", "-", "g", "a")
"""Last words of a name that are units only where another word agrees."""
_AXIS = re.compile(r"(?:^|[ \d+-])([xy])(?:d?)(?:[ \d]|$)")
_PLAIN = re.compile(r"\b(?:(horiz\w*|h|hor|waag\w*|vandret|vågrät)|(verti\w*|v|vert|senk\w*|lodret|lodrät))\b")
_ANGLE = re.compile(r"(\d{1,3}) ?(?:deg|°)? ?(left|right|links|rechts|l|r)\b")
_TURNED = re.compile(r"\d{1,3} ?(?:deg|°|left|right|links|rechts|[lr]\b)(?: ?(?:left|right|links|rechts|[lr])\b)?")
_CAPITAL = re.compile(r"(?<=[a-z])(?!(?<=\b[kmu])(?:V|Hz|Pa|N)\b)(?=[A-Z])")
"""Places where a word begins with a capital letter; the units mV, kHz, kPa and the like stay whole."""
_PREFIXED = re.compile(r"(?:(?<![a-z])[ku]|m)(?:V|Hz|Pa|N)$")
_ORDER = re.compile(r"\b(\d) ?x\b")
_GUESSES: dict[str, tuple[tuple[float, str], ...]] = {
    "s": ((0.05, "s"), (50.0, "ms"), (np.inf, "us")),
    "Pa": ((1.5, ""), (12.0, "bar"), (15.0, ""), (150.0, "psi"), (5e4, ""), (np.inf, "Pa")),
    "rad": ((6.5, ""), (np.inf, "deg")),
    "m": ((3e-4, "m"), (20.0, ""), (2000.0, "um"), (np.inf, "")),
}
"""Unit to guess by the largest absolute value, up to each limit; of a time by its step. Empty where several may be."""
UNSTATED = "its unit is not stated"
RPM_FROM = 600.0
"""Least number of a speed whose unit nothing else shows and that is taken for rpm."""
GAP = (3.0, 22.0)
"""Mean [V] below 0 of a proximity probe."""
LEVELS = 0.85
"""Least share of a keyphasor's samples that are near one of its two levels."""
MOSTLY = 0.8
"""Share of the samples between which an angle turns one way."""
FEWEST = 512
"""Samples of a record that shows the shaft's frequency."""
PARTS = 8
"""Parts of a record in which a speed and the shaft's frequency are compared."""
RATIOS = {"rpm": 60.0, "Hz": 1.0, "rad/s": 2 * np.pi}
"""Number of a speed by its unit, over the shaft's frequency [Hz]."""
MATCH = 0.03
"""Largest relative difference of a speed and the shaft's frequency, in each part."""
SLOW = 0.02
"""Largest step of a slow quantity from sample to sample (rms), as a share of its mean."""
STEADY = 0.02
"""Relative standard deviation below which a force is a load."""
BLOW = 15.0
"""Peak of a blow over the usual size of the signal between blows."""
RARE = 0.05
"""Largest share of samples above a tenth of the peak of blows."""
STRONGER = 3.0
"""Answer to a blow along its axis over that across."""


@dataclass(frozen=True)
class ColumnGuess:
    """Probable meaning of a column: kind, axis, order, angle [deg], unit, and where the unit comes from.

    `label` is what its name holds beyond axis and unit, such as a bearing; `edge` and `pulses` are those of a
    keyphasor, `blows` those of a hammer; `why` states why a kind that the name suggests was refused.
    """

    column: Column
    number: int
    kind: str
    axis: str = ""
    order: int = 0
    angle: float | None = None
    unit: str = ""
    source: str = ""
    label: str = ""
    edge: str = ""
    pulses: int = 1
    blows: tuple[int, ...] = ()
    why: str = ""
    alone: bool = True
    """Whether no other column has its name."""


def guess_columns(table: DataTable, meaning: Callable[[str], tuple[str, str, str] | None]) -> list[ColumnGuess]:
    """Guess of every column; `meaning` is that of a name of the schema, None for any other."""
    ours = table.header is not None or any("_" in c.name and meaning(c.name) for c in table.columns)
    named = [_named(column, number, meaning, ours) for number, column in enumerate(table.columns, 1)]
    clocks = [i for i, g in enumerate(named) if g.kind == "time" and _is_clock(g.column.values)]
    named = [replace(g, kind="") if g.kind == "time" and i not in clocks[:1] else g for i, g in enumerate(named)]
    dt = _step(table, named, clocks)
    if clocks and not named[clocks[0]].unit:
        named[clocks[0]] = _time_unit(table, named[clocks[0]])
        dt = _step(table, named, clocks)
    named = [_pulsing(g) if not _own(g) else g for g in named]
    named = [_with_pulses(g, named, dt) if g.edge else g for g in named]
    shaft = _shaft(named, dt)
    found = [_checked(g, shaft) if not _own(g) else _vector(g) for g in named]
    found = [_turning(g, found, shaft, dt) if g.kind == "angle" and not _own(g) else g for g in found]
    found = [_struck(g, found) if g.kind == "disc_force" and not _own(g) else g for g in found]
    names = Counter(g.column.name for g in found)
    return [replace(g, alone=names[g.column.name] == 1) for g in found]


def _own(g: ColumnGuess) -> bool:
    """Whether a column's kind needs no values: it has a name of the schema, is the time, a vector or nothing."""
    return (
        g.source == "the schema's name" or g.label == "schema" or g.kind in ("time", *VECTORS) or bool(g.column.fault)
    )


def _named(
    column: Column, number: int, meaning: Callable[[str], tuple[str, str, str] | None], ours: bool
) -> ColumnGuess:
    """Guess by the name and the stated unit alone; 'speed' is a word of everybody in a file that is not `ours`."""
    if column.fault:
        return ColumnGuess(column, number, "")
    key = meaning(column.name)
    if key and (ours or column.unit or key[0] not in COMMON):
        unit, source = (column.unit, "the file") if column.unit else (schema_unit(key), "the schema's name")
        kind = {"disc_measured": "probe", "time": "time"}.get(key[0], key[0])
        own = int(key[1]) if kind in ("amplitude", "phase") else 0
        return ColumnGuess(column, number, kind, key[2] or key[1], own, None, unit, source, "schema")
    words = " ".join(_CAPITAL.sub(" ", re.sub(r"[_\-:+#.()\[\]]", " ", column.name)).lower().split())
    if (column.unit or "") in OTHER_UNITS or re.search(_NONE, words):
        return ColumnGuess(column, number, "", why="its name or its unit is that of no channel")
    kind, si = next(((kind, si) for kind, (si, pattern) in _WORDS.items() if re.search(pattern, words)), ("", ""))
    unit, source = (column.unit, "the file") if column.unit else (_named_unit(column.name, words, si), "the name")
    quantity = next((q for q in BY_UNIT if unit and is_unit_of(unit, q)), "")
    if unit and kind and kind not in VECTORS and not (is_unit_of(unit, si) or is_unit_of(unit, "V")):
        kind = ""  # a unit counts more than a name
    if kind == "keyphasor" and unit and not is_unit_of(unit, "V"):
        kind = ""
    if not kind and quantity and not (quantity == "s" and source == "the name"):
        kind = BY_UNIT[quantity]
    if (
        not kind
        and unit
        and is_unit_of(unit, "rad/s")
        and (not is_unit_of(unit, "Hz") or re.search("tach|freq", words))
    ):
        kind = "speed"
    order = _ORDER.search(words)
    axis, angle = _direction(words, kind)
    label = " ".join(_TURNED.sub(" ", _PLAIN.sub(" ", _AXIS.sub(lambda m: m[0].replace(m[1], " "), words))).split())
    return ColumnGuess(
        column, number, kind, axis, int(order[1]) if order else 0, angle, unit, source if unit else "", label or words
    )


def schema_unit(key: tuple[str, str, str]) -> str:
    """Unit of a variable of the schema; none of a probe, whose quantity the name does not give."""
    if key[0] == "probe_measured":
        return ""
    return "s" if key[0] == "time" else (VECTORS[key[0]] if key[0] in VECTORS else VARIABLES[key[0]]).units


def _direction(words: str, kind: str) -> tuple[str, float | None]:
    """Axis, or angle [deg] from x towards y, that a name holds."""
    angle = None
    if kind == "probe" and (found := _ANGLE.search(words)):
        # 45 deg right of the top, seen from the driver, is 45 deg from x towards y; 45 deg left is 135 deg. An angle
        # without a side may count from anywhere, and either way round
        angle = 90.0 + float(found[1]) * (1 if found[2][0] == "l" else -1)
    axis, plain = _AXIS.search(words), _PLAIN.search(words)
    letter = axis[1] if axis else ("x" if plain[1] else "y") if plain and kind == "probe" else ""
    if not letter and kind in ("reference", "disc_force") and re.search(r"(?:^|[a-z ])[12]$", words):
        letter = {"1": "x", "2": "y"}[words[-1]]
    return letter, angle


def _named_unit(name: str, words: str, si: str) -> str:
    """Unit that ends a column's name without brackets, as in 'time ms' and 'speed_rad_s'; empty if there is none."""
    first, *rest = words.split() or [""]
    last = rest[-1] if rest else first
    if rest[-2:] == ["rad", "s"]:
        last = "rad/s"
    plain = {"v": "V", "mv": "mV", "hz": "Hz", "khz": "kHz", "pa": "Pa", "kpa": "kPa", "mpa": "MPa"}.get(last, last)
    if last == "n" and si == "N":
        return "N"
    if prefixed := _PREFIXED.search(name.rstrip()):
        plain = prefixed[0]
    if plain in ("1", "-") or (plain in ("m", "s", "g") and not (rest and name.rstrip().endswith(plain))):
        return ""  # a letter alone, or a capital one, is a name
    if plain == "g" and rest and _AXIS.search(words):
        return "g"
    if plain in AMBIGUOUS and not (si and is_unit_of(plain, si)):
        return ""
    return plain if is_unit(plain) else ""


def _is_clock(values: np.ndarray) -> bool:
    """Whether a column rises in even steps, but for gaps."""
    finite = values[np.isfinite(values)]
    if finite.size < 3 or not finite[-1] > finite[0]:
        return False
    return not problems(unrounded(finite)) or bool(
        np.mean(np.abs(np.diff(finite) / np.median(np.diff(finite)) - 1) < 0.5) > 0.9
    )


def _step(table: DataTable, named: Sequence[ColumnGuess], clocks: Sequence[int]) -> float:
    """Time [s] from sample to sample; NaN where it is not known."""
    if clocks and (unit := named[clocks[0]].unit):
        values = named[clocks[0]].column.values
        values = values[np.isfinite(values)]
        return float(values[-1] - values[0]) / (values.size - 1) * FACTORS["s"].get(unit, np.nan)
    times = [table.time, *(column.time for column in table.columns)]
    own = next((time for time in times if time is not None and time.size > 1), None)
    if own is not None:
        return float(own[-1] - own[0]) / (own.size - 1)
    return 1 / table.rate if table.rate else np.nan


def _time_unit(table: DataTable, g: ColumnGuess) -> ColumnGuess:
    """A time with its unit, from the rate that the file states, else from its step."""
    step = _step(table, [replace(g, unit="s")], [0])
    for unit in ("s", "ms", "us", "min"):
        if table.rate and abs(step * FACTORS["s"][unit] * table.rate - 1) < MATCH:
            return replace(g, unit=unit, source="the sampling rate that the file states")
    return replace(g, unit=_by_size("s", step), source="the values")


def _by_size(si: str, largest: float) -> str:
    return next((unit for limit, unit in _GUESSES.get(si, ()) if largest <= limit), "")


def pulsing(values: np.ndarray) -> tuple[str, np.ndarray]:
    """Edge of the pulses of a column (n,) and their places [samples]; empty for anything else."""
    s = values[np.isfinite(values)]
    if s.size < 100 or s.size < values.size:
        return "", np.array([])
    low, high = np.percentile(s, (0.2, 99.8))
    if not high > low:
        return "", np.array([])
    share = (s - low) / (high - low)
    if np.mean((share < 0.25) | (share > 0.75)) < LEVELS or np.ptp(s) > 2 * (high - low):
        return "", np.array([])
    edge = "rising" if np.mean(share > 0.5) <= 0.5 else "falling"
    try:
        return edge, pulse_times(np.arange(s.size, dtype=float), s, Keyphasor(edge=edge))
    except ReadError:
        return "", np.array([])


def _pulsing(g: ColumnGuess) -> ColumnGuess:
    """A guess that its values make a keyphasor, or refuse as one."""
    volts = not g.unit or is_unit_of(g.unit, "V")
    edge = pulsing(g.column.values)[0] if volts and not g.why and g.kind in ("keyphasor", "probe", "") else ""
    if edge and (g.kind != "probe" or not g.axis):
        return replace(g, kind="keyphasor", edge=edge, unit=g.unit or "V", source=g.source or "the values")
    if g.kind == "keyphasor":
        return replace(g, kind="", why="no even pulses of two levels")
    return g


def _shaft(guesses: Sequence[ColumnGuess], dt: float) -> np.ndarray:
    """Frequency of the shaft in each part of the record [Hz], in cycles per sample without a clock; NaN if unknown."""
    step = dt if np.isfinite(dt) else 1.0
    keys = [g for g in guesses if g.edge]
    if len(keys) == 1:
        return _pulse_rates(keys[0].column.values) / step / keys[0].pulses
    return _lines(guesses) / step


def _pulse_rates(values: np.ndarray) -> np.ndarray:
    """Mean rate of the pulses in each part of a record [1 per sample]; NaN where there are none."""
    at = pulsing(values)[1]
    edges = np.clip(np.linspace(0, values.size, PARTS + 1), at[0], at[-1])
    with np.errstate(invalid="ignore"):
        return np.asarray(np.diff(np.interp(edges, at, np.arange(at.size))) / np.diff(edges))


def _lines(guesses: Sequence[ColumnGuess]) -> np.ndarray:
    """Strongest line that all displacements share in each part of a record [cycles per sample]; NaN without one."""
    moving = [g.column.values for g in guesses if g.kind == "probe" and np.isfinite(g.column.values).all()]
    lines = [np.array([_line(part) for part in np.array_split(v, PARTS)]) for v in moving if v.size >= FEWEST]
    lines = [line for line in lines if np.isfinite(line).all()]
    same = lines and all(np.all(np.abs(line / lines[0] - 1) < 0.1) for line in lines)
    return np.asarray(np.mean(lines, axis=0)) if same else np.full(PARTS, np.nan)


def _line(values: np.ndarray) -> float:
    """Frequency [cycles per sample] of the strongest line of a stretch (n,), NaN without a clear one."""
    n = values.size
    bare = values - np.polyval(np.polyfit(np.arange(n), values, 1), np.arange(n))
    size = np.abs(np.fft.rfft(bare * np.hanning(n), 8 * n))
    k = int(size.argmax())
    if not 8 < k < size.size - 1 or size[k] < 8 * np.median(size):
        return np.nan
    a, b, c = np.log(size[k - 1 : k + 2])
    return float((k + 0.5 * (a - c) / (a - 2 * b + c)) / (8 * n))


def _with_pulses(g: ColumnGuess, guesses: Sequence[ColumnGuess], dt: float) -> ColumnGuess:
    """A keyphasor with its pulses a turn, which a speed in a stated unit shows, else the line of the displacements."""
    rate = float(np.nanmean(_pulse_rates(g.column.values)))
    line = _lines(guesses)
    speeds = [o for o in guesses if o.kind == "speed" and o.unit in FACTORS["rad/s"] and np.isfinite(dt)]
    turning = [float(np.nanmean(np.abs(o.column.values))) * FACTORS["rad/s"][o.unit] / 2 / np.pi * dt for o in speeds]
    ratio = rate / (turning[0] if turning and turning[0] else float(np.mean(line)))
    whole = round(ratio) if np.isfinite(ratio) else 1
    # a strong line at half or a third of the speed makes a ratio of 2 or 3 of one pulse
    certain = abs(ratio / max(whole, 1) - 1) < MATCH and whole > (1 if turning else 4)
    return replace(g, pulses=whole) if certain else g


def _slow(values: np.ndarray) -> bool:
    """Whether a column keeps its sign, and changes little from sample to sample or in one direction alone."""
    finite = values[np.isfinite(values)]
    if finite.size < 2 or not (np.all(finite >= 0) or np.all(finite <= 0)) or not np.any(finite):
        return False
    steps = np.diff(finite)
    quiet = np.sqrt(np.mean(steps**2)) <= SLOW * np.abs(finite).mean()
    return bool(quiet or np.all(steps >= 0) or np.all(steps <= 0))


def _turning_unit(values: np.ndarray, shaft: np.ndarray) -> str:
    """Unit in which a slow column is the shaft's speed in every part; empty if in none."""
    if not np.isfinite(shaft).all() or not np.isfinite(values).all() or not _slow(values):
        return ""
    ratio = np.array([np.mean(np.abs(part)) for part in np.array_split(values, PARTS)]) / shaft
    return next((unit for unit, r in RATIOS.items() if np.all(np.abs(ratio / r - 1) < MATCH)), "")


def _checked(g: ColumnGuess, shaft: np.ndarray) -> ColumnGuess:
    """A guess after its values had their say."""
    v = g.column.values
    finite = v[np.isfinite(v)]
    if not finite.size:
        return replace(g, kind="", why="no finite value")
    if g.why:
        return g
    if g.kind == "speed" or (not g.kind and (not g.unit or is_unit_of(g.unit, "rad/s"))):
        return _speed(g, shaft)
    if g.kind == "pressure":
        if not _slow(v):
            return replace(g, kind="", why="it changes too fast for a pressure")
        return g if g.unit else _sized(g, "Pa", finite)
    if g.kind in ("acceleration", "velocity"):
        return g if g.unit else replace(g, kind="", why=UNSTATED)
    if g.kind == "reference":
        return g if g.unit else replace(g, unit="V", source="the values")
    if g.kind == "disc_force" and not g.unit:
        return replace(g, kind="", why=UNSTATED)
    if g.kind == "disc_force" and is_unit_of(g.unit, "V"):
        return replace(g, kind="", why="its sensitivity is not stated")
    if g.kind == "probe" or (not g.kind and g.unit and is_unit_of(g.unit, "V")):
        return _probe(g, finite, shaft)
    return g


def _vector(g: ColumnGuess) -> ColumnGuess:
    """An amplitude or a phase of vectors with the unit that its size shows."""
    if g.kind not in VECTORS or g.unit:
        return g
    unit = _by_size("m" if g.kind == "amplitude" else "rad", float(np.nanmax(np.abs(g.column.values), initial=0.0)))
    return replace(g, unit=unit, source="the values" if unit else "")


def _sized(g: ColumnGuess, si: str, finite: np.ndarray) -> ColumnGuess:
    """A guess with the unit that its size shows, or nothing where it may be in several."""
    unit = _by_size(si, float(np.abs(finite).max()))
    return replace(g, unit=unit, source="the values") if unit else replace(g, kind="", why=UNSTATED)


def _speed(g: ColumnGuess, shaft: np.ndarray) -> ColumnGuess:
    """A column that may be the speed."""
    v = g.column.values
    unit = _turning_unit(v, shaft)
    if not g.kind:
        if unit and g.unit and FACTORS["rad/s"].get(g.unit) != FACTORS["rad/s"][unit]:
            return g
        if unit and (np.ptp(v) > 0 or np.abs(v).max() >= RPM_FROM):
            return replace(g, kind="speed", unit=unit, source="the values, as the shaft's own frequency")
        return _probe(g, v[np.isfinite(v)], shaft)
    if g.unit and is_unit_of(g.unit, "V"):
        return replace(g, kind="", why="its sensitivity is not stated")
    if v.size > 1 and not _slow(v):
        return replace(g, kind="", why="it changes too fast for a speed")
    if g.unit:
        return g
    if unit:
        return replace(g, unit=unit, source="the values, as the shaft's own frequency")
    if np.nanmax(np.abs(v)) >= RPM_FROM:
        return replace(g, unit="rpm", source="the values")
    return replace(g, kind="", why=UNSTATED)


def _turning(g: ColumnGuess, guesses: Sequence[ColumnGuess], shaft: np.ndarray, dt: float) -> ColumnGuess:
    """An angle that turns one way, as fast as the shaft where pulses, displacements or a speed show that."""
    v = g.column.values
    if not np.isfinite(v).all() or v.size < FEWEST:
        return replace(g, kind="", why="it is no angle in every sample")
    speeds = [o for o in guesses if o.kind == "speed" and o.unit and np.isfinite(o.column.values).all()]
    if speeds:  # the strongest line of a sweep may be a resonance
        turning = np.abs(speeds[0].column.values) * FACTORS["rad/s"][speeds[0].unit] / (2 * np.pi)
        shaft = np.array([np.mean(part) for part in np.array_split(turning, PARTS)])
    edges = np.linspace(0, v.size - 1, PARTS + 1).round().astype(int)
    for unit in (g.unit,) if g.unit else ("rad", "deg"):
        turned = np.unwrap(v * FACTORS["rad"][unit]) / (2 * np.pi)
        one_way = abs(turned[-1] - turned[0]) > 1 and abs(np.sum(np.sign(np.diff(turned)))) > MOSTLY * v.size
        rate = np.abs(np.diff(turned[edges])) / (np.diff(edges) * dt)
        agrees = bool(np.all(np.abs(rate / shaft - 1) < MATCH)) if np.isfinite(shaft).all() else bool(g.unit)
        if one_way and agrees:
            return g if g.unit else replace(g, unit=unit, source="the values, as the shaft's own turning")
    return replace(g, kind="", why="it does not turn with the shaft")


def _probe(g: ColumnGuess, finite: np.ndarray, shaft: np.ndarray) -> ColumnGuess:
    """A column that may be a displacement probe: by its name, its unit or its gap voltage."""
    if g.kind == "probe" and finite.size > 1 and finite.min() == finite.max():
        return replace(g, kind="", why=f"it is {dead(finite)}")
    gap = -GAP[1] < finite.mean() < -GAP[0] and np.ptp(finite) > 1e-3
    if g.kind == "probe":
        if g.unit:
            return g
        if gap:
            return replace(g, unit="V", source="the values, as a gap voltage")
        return _sized(g, "m", finite)
    turning = gap and np.isfinite(g.column.values).all() and _turns_with(g.column.values, shaft)
    if turning:
        return replace(g, kind="probe", unit=g.unit or "V", source=g.source or "the values, as a gap voltage")
    return g


def _turns_with(values: np.ndarray, shaft: np.ndarray) -> bool:
    """Whether the strongest line of a column is the shaft's, or its double, in most parts of the record."""
    lines = np.array([_line(part) for part in np.array_split(values, PARTS)])
    if not np.isfinite(shaft).any():
        return bool(np.isfinite(lines).all())
    scale = lines / shaft
    return bool(np.mean(np.abs(scale / scale[0] - 1) < 0.1) > 0.7)


def blows(values: np.ndarray) -> tuple[int, ...]:
    """Samples at which the blows of a hammer begin in a column (n,); none where it is no such signal."""
    finite = np.where(np.isfinite(values), values, 0.0)
    bare = np.abs(finite - np.median(finite))
    peak = float(bare.max(initial=0.0))
    if not peak > 0 or np.median(bare) * BLOW > peak or np.mean(bare > 0.1 * peak) > RARE:
        return ()
    above = np.flatnonzero(bare > 0.1 * peak)
    first = np.concatenate([[True], np.diff(above) > max(10, 0.005 * values.size)])
    return tuple(int(k) for k in above[first])


def _struck(g: ColumnGuess, guesses: Sequence[ColumnGuess]) -> ColumnGuess:
    """A force with its blows and direction; none of a steady load."""
    at = blows(g.column.values)
    finite = g.column.values[np.isfinite(g.column.values)]
    if not at and np.std(finite) <= STEADY * abs(np.mean(finite)):
        return replace(g, kind="", why="it is a steady load, or no force at all")
    return replace(g, blows=at, axis=g.axis or _answering(at, guesses))


def _answering(at: Sequence[int], guesses: Sequence[ColumnGuess]) -> str:
    """Axis whose displacements or accelerations answer to blows by far the most; empty if none does."""
    rise: dict[str, float] = {}
    for g in guesses:
        if g.kind in ("probe", "acceleration") and g.axis and len(at):
            v = np.nan_to_num(g.column.values)
            width = max(32, v.size // 40)
            parts = [(v[max(k - width, 0) : k], v[k : k + width]) for k in at if k >= width]
            grown = float(np.mean([after.var() - before.var() for before, after in parts])) if parts else 0.0
            rise[g.axis] = max(rise.get(g.axis, 0.0), grown)
    if len(rise) < 2:
        return ""
    strong, weak = sorted(rise, key=lambda axis: -rise[axis])[:2]
    return strong if rise[strong] > STRONGER**2 * max(rise[weak], 0.0) and rise[strong] > 0 else ""
