"""Findings of a diagnosis, and the machine file that takes them up, with uncertainty and evidence as comments.

The fit's own numbers are written, as the effects and factors that the fit turned, so that a simulation of the new file
is the fitted one. Clear gains of the actuators along an axis are those of its pins. Trends of the calibration over
pressure and speed and the sensors' zeros have no place in a machine file and stand as comments.
"""

from __future__ import annotations

from cmath import phase as argument
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from difflib import unified_diff
from math import log, nan, pi, sqrt
from textwrap import fill
from typing import Any

import numpy as np
import tomlkit

from rotorsim.base.errors import MachineFileError
from rotorsim.base.quantity import quantities
from rotorsim.base.units import TO_RPM, TO_UM, show
from rotorsim.discrepancy.calibration import DIRECTIONS, LOSS_SD, SHEAR, sd_of_polar, wave
from rotorsim.discrepancy.twin import FACTORS, of_axis, of_bearing, of_each_film, own_tables
from rotorsim.effects import REGISTRY, Effect
from rotorsim.machine import Machine
from rotorsim.machine.file_text import comment, inline
from rotorsim.plant.locations import place_at
from rotorsim.plant.mesh import Mesh

CLEAR_RATIO = 1.05
"""Ratio of a calibrated value and the file's from which on it is stated: what rounds to 1 states nothing."""
UNBALANCE = "unbalance."
"""Beginning of the calibration's keys of the parts of unbalances."""
CLOCK = "clock of "
"""Beginning of the calibration's keys of clock offsets [s], before the name of a record."""
HEAD = (
    "# Re-calibrated by rotorsim diagnose with data {data}: the values marked so; comments on others are those of the\n"
    "# file before.\n"
)
"""Comment at the top of a re-calibrated machine file."""
NOT_BETTER = "calibration not written: it makes untouched records worse ({records})"
"""Comment on a calibration that is not written."""
NOT_IN_FILE = "; the gap is shown with it, so that a simulation of this file leaves more"
"""End of the comment on the shaft's shear, which a machine file cannot change."""
WRITTEN = ("named", "tie")
"""Verdicts whose effects are written."""
LARGE = {"k": 1.5, "c": 2.0}
"""Factor on the stiffness (k) and on the damping (c) of a bearing from which on its calibration is a finding."""
MOVED = 1.5
"""Factor on a number of the machine file from which on its calibration is stated next to a peaceful verdict."""
NARROWED = 0.5
"""Standard deviation of a bearing's loss over its prior, below which the records show its damping."""
WORDS_OF_CHANGE = {"k": ("stiffer", "softer"), "c": ("more damped", "less damped")}
"""Words for a larger and a smaller number of a bearing."""
CHANGED = ("larger", "smaller")
"""Words for other numbers."""
FACTORS_OF: dict[str, tuple[str, str, str, Callable[[Any], float]]] = {
    "shaft_damping": ("shaft.damping_ratio", "the damping ratio of the shaft", "1", lambda m: m.shaft.damping_ratio),
    "shaft_stiffness": (
        "shaft.material.youngs_modulus", "Young's modulus of the shaft", "Pa",
        lambda m: m.shaft.material.youngs_modulus,
    ),
    "curtain_discharge": (
        "injection.curtain_discharge", "the discharge coefficient of the curtains", "1",
        lambda m: m.injection.curtain_discharge,
    ),
}  # fmt: skip
"""Path, place, unit and value before of the numbers that a relative change of the calibration turns."""
OF_AXES = {"actuator": "the gain of the actuators", "offset": "the zero of the probes"}
"""Words for numbers along an axis, by the keys before it."""
CLEAR_GAIN = 2.0
"""Standard deviations by which a gain of the actuators along an axis differs from the file's where it is written."""
SAME_PLACE = 1e-6
"""Distance [m] within which two effects act at one place."""
FOUND, FITTED = "found by rotorsim diagnose", "re-calibrated by rotorsim diagnose"
"""Remarks next to an identified and to a calibrated value."""


@dataclass(frozen=True)
class IdentifiedEffect:
    """Identified effect: name, form, table of parameters for the machine file (SI), standard deviations."""

    effect: str
    form: str
    parameters: dict[str, float]
    sd: dict[str, float]
    tie_class: tuple[str, ...]
    written: bool = True
    """Whether the machine file has a place for it: it has none for single probes, and for those of other planes."""

    def sizes(self) -> Iterator[tuple[str, str, str]]:
        """Parameter, value and standard deviation in display units; no standard deviation where it was held."""
        units = {name: known.unit for name, known in quantities(REGISTRY[self.effect]).items()}
        for name, value in self.parameters.items():
            sd = with_unit(self.sd[name], units[name], 2) if name in self.sd else ""
            yield name, with_unit(value, units[name], 4), sd


@dataclass(frozen=True)
class RecalibratedValue:
    """Number of the machine file that was calibrated: its path, value, standard deviation and value before [SI].

    `key` is that of the calibration, `place` what the number belongs to, in words.
    """

    path: str
    value: float
    sd: float
    before: float
    unit: str
    key: str
    place: str

    @property
    def large(self) -> bool:
        """Whether a bearing's number has changed by a factor of `LARGE`, by two standard deviations at least."""
        least = LARGE.get(self.key.rpartition(".")[2][:1]) if self.key.startswith("bearing.") else None
        if least is None or not min(self.value, self.before) > 0:
            return False
        if self.key.rpartition(".")[2][:1] == "c" and self.value < self.before:  # a loss may be gone: no logarithm
            return self.value + 2 * self.sd < self.before / least
        return abs(log(self.value / self.before)) - 2 * self.sd / self.value > log(least)

    @property
    def open(self) -> bool:
        """Whether a bearing's stiffness may have changed by that factor, within two standard deviations."""
        if not (self.key.startswith("bearing.") and self.key.rpartition(".")[2][:1] == "k"):
            return False
        return abs(log(self.value / self.before)) + 2 * self.sd / self.value > log(LARGE["k"])

    @property
    def moved(self) -> bool:
        """Whether the number has clearly changed by a factor of `MOVED`, and is neither large nor open.

        Angles have no factor, nor do numbers that are 0 in the file, with which a calibration begins.
        """
        if self.large or self.open or not min(self.value, self.before) > 0 or self.unit == "rad":
            return False
        return abs(log(self.value / self.before)) > max(log(MOVED), 3 * self.sd / self.value)

    @property
    def sentence(self) -> str:
        """Sentence on the place, the size with its standard deviation, and the change."""
        size = f"{_rough(self.value, self.unit, 3)} +- {_rough(self.sd, self.unit, like=float(f'{self.value:.3g}'))}"
        file = f"the file has {_rough(self.before, self.unit, 3)}" if self.before else "the file has none"
        words = WORDS_OF_CHANGE.get(self.key.rpartition(".")[2][:1] if self.key.startswith("bearing.") else "", CHANGED)
        ratio = self.value / self.before if self.before else nan
        clear = ratio > 0 and self.unit != "rad" and max(ratio, 1 / ratio) >= CLEAR_RATIO
        more = f": {max(ratio, 1 / ratio):.2g} times {words[ratio < 1]}" if clear else ""
        return f"{self.place} is {size}, {file}{more}"

    @property
    def cells(self) -> tuple[str, str, str, str, str]:
        """Place, value before and now, standard deviation, change in percent of the former, of an angle in degrees."""
        if self.unit == "rad":
            before, value = (with_unit(size, "rad", 4) for size in (self.before, self.value))
            sd = with_unit(self.sd, "rad", 2)
            change = f"{(180 / pi * (self.value - self.before) + 180) % 360 - 180:+.1f} deg"
        else:
            before, value = (_rough(size, self.unit, 4) for size in (self.before, self.value))
            sd = _rough(self.sd, self.unit, like=float(f"{self.value:.4g}"))
            change = f"{100 * (self.value - self.before) / abs(self.before):+.1f} %" if self.before else ""
        return (self.place, before, value, sd, change) if self.path else (self.place, "none", value, sd, "")


def recalibrated_values(
    machine: Machine, calibration: Mapping[str, tuple[float, float]], related: Mapping[str, float] | None = None
) -> tuple[RecalibratedValue, ...]:
    """Numbers of the machine file that a calibration (value and standard deviation by key) replaces.

    `related` has the correlation of a bearing's compliance and loss, by the key of the loss. A bearing's damping is
    replaced only where the records narrow its loss: otherwise it would follow from the prior and the stiffness.
    """
    found = []
    for key, (change, sd) in calibration.items():
        _, _, last = key.rpartition(".")
        if key.startswith("bearing."):
            narrowed = key.split(".")[2][0] == "k" or sd < NARROWED * LOSS_SD
            rows = _of_bearing(machine, key, calibration, related or {})
            found += [row for row in rows if row.value and narrowed]
        elif key in FACTORS_OF:
            path, name, unit, own = FACTORS_OF[key]
            before = own(machine)
            found.append(RecalibratedValue(path, before * (1 + change), abs(before) * sd, before, unit, key, name))
        elif " x " not in key and "~" not in key and "." in key and not key.startswith(CLOCK):
            name, table = key.split(".")[:2]
            before = float(getattr(_table_before(machine, name, int(table)), last))
            path, shown = f"effects.{name}.{table}.{last}", f"{last} of {name}"
            found.append(RecalibratedValue(path, before + change, sd, before, _unit_of(key), key, shown))
    for key in dict.fromkeys(key[:-2] for key in calibration if "~" in key):
        found += _of_wave(machine, key, calibration)
    return tuple(found)


def far_off(
    machine: Machine, calibration: Mapping[str, tuple[float, float]], related: Mapping[str, float], far: Iterable[str]
) -> dict[str, str]:
    """Sentences on numbers far from the machine file, by key: large changes of bearings, and strained keys (`far`)."""
    strained = dict.fromkeys(key[:-2] if "~" in key else key for key in far)
    rows = recalibrated_values(machine, calibration, related)
    # of a table the number at the highest speed speaks for all: they change alike
    named = ((row.key if row.key.startswith("bearing.") else row.path, row) for row in rows)
    shown = {name: row.sentence for name, row in named if row.large or row.key in strained}
    without = [key for key in strained if key not in {row.key for row in rows}]
    return shown | {key: _without_row(machine, calibration, key) for key in without}


def total_unbalance(
    machine: Machine, calibration: Mapping[str, tuple[float, float]], related: Mapping[str, float]
) -> Iterator[RecalibratedValue]:
    """Vector sum of the unbalances of all planes, which records may show where they do not tell the planes apart."""
    keys = [key for key in calibration if key.startswith(UNBALANCE) and "~" in key]
    if len(keys) < 4 or "unbalance" not in machine.effects:
        return
    change, sd = np.array([calibration[key] for key in keys]).T
    R = [[1.0 if a == b else related.get(f"{a}, {b}", related.get(f"{b}, {a}", 0.0)) for a in keys] for b in keys]
    total = np.array([[float(key.endswith(part)) for key in keys] for part in (".c", ".s")])
    before = sum(wave(effect, "me", "phase") for effect in machine.effects["unbalance"])
    c, s = (total @ change).tolist()
    size, _, error, _ = sd_of_polar(c, s, total @ (R * np.outer(sd, sd)) @ total.T, before)
    yield RecalibratedValue("", size, error, abs(before), "kg*m", UNBALANCE, "the unbalance of all planes together")


def in_words(machine: Machine, keys: Iterable[str]) -> list[str]:
    """Calibrated numbers as a sentence names them; those of both directions at a place as one."""
    found: dict[str, list[str]] = {}
    for key in keys:
        words, way = _number_in_words(machine, key)
        found.setdefault(words, []).append(way)
    return [words + (ways[0] if len(ways) == 1 else "") for words, ways in found.items()]


def _number_in_words(machine: Machine, key: str) -> tuple[str, str]:
    """A calibrated number, by its key, and its direction with a blank before it; empty where it has none."""
    if key in FACTORS_OF:
        return FACTORS_OF[key][1], ""
    if key == SHEAR.key:
        return "the softening of the shaft by shear", ""
    name, _, axis = key.rpartition("_")
    if name in OF_AXES:
        return OF_AXES[name], f" along {axis}"
    if "." not in key:
        return key.replace("_", " "), ""
    name, number, last = key.split(".", 2)
    if name == "bearing":
        what = "stiffness" if last[0] == "k" else "loss c / k^2"
        return f"the {what} of {machine.bearings_in_words[int(number)]}", f" along {last[1]}"
    effect = name.replace("_", " ")
    if "~" in last:
        way = " along 0 deg" if last.endswith(".c") else " along 90 deg"
        return f"the {effect} of {place_at(machine, _plane(machine, name, int(number))).name}", way
    return f"the {last.replace('_', ' ')} of {effect} {int(number) + 1}", ""


def _without_row(machine: Machine, calibration: Mapping[str, tuple[float, float]], key: str) -> str:
    """Sentence on a calibrated number that has no place in the machine file."""
    if "~" in key:
        return next(_of_parts(key, calibration, key.partition(".")[0].replace("_", " "))).sentence
    size, sd = calibration[key]
    return f"{''.join(_number_in_words(machine, key))} has changed by {100 * size:+.3g} % +- {100 * sd:.2g} %"


def _of_wave(machine: Machine, key: str, calibration: Mapping[str, tuple[float, float]]) -> Iterator[RecalibratedValue]:
    """Amplitude and phase of a wave of the machine file whose parts were calibrated; none where it has no such wave."""
    name, table, pair = key.split(".")
    number = _same_place(machine, name, int(table))
    if number is None:
        return
    amplitude, phase = pair.split("~")
    own = wave(machine.effects[name][number], amplitude, phase)
    yield from _of_parts(key, calibration, f"{name} {number + 1}", own, f"effects.{name}.{number}.")


def _of_parts(
    key: str, calibration: Mapping[str, tuple[float, float]], words: str, own: complex = 0.0, path: str = ""
) -> Iterator[RecalibratedValue]:
    """Amplitude and phase of a calibrated wave with the file's `own`, whose table has this path; none without one."""
    (name, _, pair), parts = key.split("."), [calibration.get(f"{key}.{part}", (0.0, 0.0)) for part in "cs"]
    sizes = sd_of_polar(parts[0][0], parts[1][0], np.diag([sd**2 for _, sd in parts]), own)
    for i, (parameter, before) in enumerate(zip(pair.split("~"), (abs(own), argument(own)), strict=True)):
        unit, shown = quantities(REGISTRY[name])[parameter].unit, f"{parameter} of {words}"
        yield RecalibratedValue(path and path + parameter, sizes[i], sizes[2 + i], before, unit, key, shown)


def _same_place(machine: Machine, name: str, table: int) -> int | None:
    """Number of the machine file's own table of an effect at the place of a table of its twin; None for none."""
    mesh, place = Mesh(machine), _plane(machine, name, table)
    present = machine.effects.get(name, ())
    return next((i for i, effect in enumerate(present) if abs(mesh.place(effect) - place) < SAME_PLACE), None)


def _plane(machine: Machine, name: str, table: int) -> float:
    """Plane [m] of a table of an effect of a machine's twin."""
    return Mesh(machine).place(REGISTRY[name].neutral(machine, table - len(machine.effects.get(name, ()))))


def _of_bearing(
    machine: Machine, key: str, calibration: Mapping[str, tuple[float, float]], related: Mapping[str, float]
) -> Iterator[RecalibratedValue]:
    """Calibrated stiffness or damping of a bearing along an axis, of a table at each of its speeds."""
    _, place, last = key.split(".")
    what, axis = last[0], last[1]
    (stiffer, sd_k), (lossier, sd_c) = (calibration.get(f"bearing.{place}.{w}{axis}", (0.0, 0.0)) for w in "kc")
    bearing, i = machine.bearings[int(place)], "kc".index(what)
    before = of_axis(bearing, axis)
    new = of_bearing(*before, stiffer, lossier)
    # logarithms: log k' = log k - log(1 - s), log c' = log c + log(1 + l) - 2 log(1 - s)
    of_k, of_c = sd_k / (1 - stiffer), sd_c / (1 + lossier)
    together = 4 * related.get(f"bearing.{place}.c{axis}", 0.0) * of_k * of_c
    shares = (of_k, sqrt(max(of_c**2 + 4 * of_k**2 + together, 0.0)))
    name = f"{('stiffness', 'damping')[i]} {what}{axis}{axis} of {machine.bearings_in_words[int(place)]}"
    for number, (value, old) in enumerate(zip(new[i].tolist(), before[i].tolist(), strict=True)):
        at, shown = "", ""
        if bearing.speeds.size:
            at, shown = f".points.{number}", f" at {bearing.speeds[number] * TO_RPM:.5g} rpm"
        path = f"bearings.{place}{at}.{what}{axis}{axis}"
        yield RecalibratedValue(path, value, shares[i] * value, old, ("N/m", "N*s/m")[i], key, name + shown)


@dataclass(frozen=True, eq=False)
class Findings:
    """Effects found in a machine and its new calibration, with the evidence."""

    status: str
    machine: Machine
    effects: tuple[IdentifiedEffect, ...]
    ties: tuple[tuple[str, ...], ...]
    calibration: dict[str, tuple[float, float]]
    evidence: dict[str, float]
    data_hash: str
    related: dict[str, float] = field(default_factory=dict, kw_only=True)
    """Correlation of a bearing's compliance and loss, by the key of the loss; of parts of unbalances, by both keys."""
    worse: tuple[str, ...] = field(default=(), kw_only=True)
    """Untouched records that the calibration makes worse; with one it is not written."""

    @property
    def file_notes(self) -> tuple[str, ...]:
        """Sentences on what the new machine file has and has not, then on its use; none where it has all."""
        return ()

    @property
    def added_bearing(self) -> dict[str, Any]:
        """Table of a bearing that the machine file lacks; empty where it lacks none."""
        return {}

    @property
    def recalibration(self) -> tuple[RecalibratedValue, ...]:
        """Calibrated numbers of the machine file: path, value, standard deviation and value before."""
        return recalibrated_values(self.machine, self.calibration, self.related)

    @property
    def moved(self) -> tuple[str, ...]:
        """Sentences on numbers that the calibration has changed clearly, and on the unbalance of all planes."""
        rows = [row for row in self.recalibration if row.moved]
        if not any(row.path.startswith(f"effects.{UNBALANCE}") for row in rows):
            rows += [row for row in total_unbalance(self.machine, self.calibration, self.related) if row.moved]
        return tuple(row.sentence for row in rows)

    @property
    def left_open(self) -> tuple[str, ...]:
        """Sentences on stiffnesses of bearings that may be far from the machine file, as these records have them."""
        return tuple(row.sentence.partition(": ")[0] for row in self.recalibration if row.open)

    def changes(self) -> tuple[RecalibratedValue, ...]:
        """Calibrated numbers with those before; waves at planes where the file has none are without a path."""
        rows = self.recalibration
        waves = dict.fromkeys(key[:-2] for key in self.calibration if "~" in key)
        for key in [key for key in waves if key not in {row.key for row in rows}]:
            rows += tuple(_of_parts(key, self.calibration, _number_in_words(self.machine, f"{key}.c")[0]))
        return rows

    def other_changes(self) -> Iterator[tuple[str, str, str]]:
        """Fitted numbers that are not among `changes`, with standard deviations; relative where without a unit."""
        known = {row.key for row in self.recalibration}
        for key, (value, sd) in self.calibration.items():
            if key not in known and "~" not in key:
                words = key if " x " in key or key.startswith(CLOCK) else "".join(_number_in_words(self.machine, key))
                unit = _unit_of(key)
                yield words, with_unit(value, unit, 4), with_unit(sd, unit, 2)


def _unit_of(key: str) -> str:
    """SI unit of a calibrated parameter such as 'unbalance.1.me~phase.c', '1' for a relative change."""
    if key in ("offset_x", "offset_y"):
        return "m"
    if key.startswith(CLOCK):
        return "s"
    effect, _, parameter = key.partition(" ")[0].partition("~")[0].rpartition(".")
    known = quantities(REGISTRY[effect.partition(".")[0]]) if effect.partition(".")[0] in REGISTRY else {}
    return known[parameter].unit if parameter in known else "1"


def with_unit(value: float, unit: str, digits: int) -> str:
    """A number of SI with its unit; lengths in micrometres, angles in degrees, unbalances in g mm, kN/m and grams."""
    if unit in ("N/m", "kg"):
        return show(float(f"{value:.{digits}g}"), unit)
    known = {"m": (TO_UM, "um"), "rad": (180 / pi, "deg"), "kg*m": (1e6, "g mm"), "1": (1.0, "")}
    factor, shown = known.get(unit, (1.0, unit))
    return f"{value * factor:.{digits}g} {shown}".rstrip()


def extended(diagnosis: Findings) -> Machine:
    """Machine file with the named or tied effects of a diagnosis and the new calibration; a partial one is left out."""
    source, plain = diagnosis.machine._source or diagnosis.machine.text, diagnosis.machine.text
    # sensors and actuators are chains: what is added must stand ahead of what is there, if not behind it;
    # a file of inline tables has no room for tables of effects, its canonical text has
    for text, last in ((source, True), (source, False), (plain, True)):
        with suppress(MachineFileError, ValueError):
            return Machine.from_text(_written(diagnosis, text, last))
    return Machine.from_text(_written(diagnosis, plain, last=False))


def _written(diagnosis: Findings, text: str, last: bool) -> str:
    """Machine file's text with the identified effects, new tables behind or ahead of the others."""
    document = tomlkit.parse(text)
    effects: Any = document.setdefault("effects", tomlkit.table(is_super_table=True))
    before = list(effects)
    changed = {one.effect for one in diagnosis.effects}
    calibration = {} if diagnosis.worse else diagnosis.calibration
    _one_for_each_film(effects, diagnosis.machine, changed | {key.split(".")[0] for key in calibration})
    left_out = _calibrate(document, effects, diagnosis) if calibration else []
    left_out += [NOT_BETTER.format(records=", ".join(diagnosis.worse))] if diagnosis.worse else []
    for found in diagnosis.effects if diagnosis.status in WRITTEN else ():
        if not found.written:
            left_out += [f"{found.form}: {p} = {value}{f' +- {sd}' if sd else ''}" for p, value, sd in found.sizes()]
            continue
        _add(effects, found.effect, found.parameters, _comments(diagnosis, found), FOUND)
    if diagnosis.added_bearing:
        table: Any = tomlkit.item(diagnosis.added_bearing)
        table.comment(FOUND)
        table["support"].add(tomlkit.nl())
        document["bearings"].append(table)
    if not last:
        _put_ahead(effects, [name for name in effects if name not in before])
    for line in left_out:
        document.add(tomlkit.comment(line))
    head = HEAD.format(data=diagnosis.data_hash) if calibration else ""
    notes = "".join(fill(f"# {note}", 118, subsequent_indent="# ") + "\n" for note in diagnosis.file_notes)
    return head + notes + tomlkit.dumps(document)


def _put_ahead(effects: Any, names: list[str]) -> None:
    """Move new tables ahead of the others."""
    others = [(name, effects.pop(name)) for name in list(effects) if name not in names]
    for name, table in others:
        effects.add(name, table)


def difference(before: Machine, after: Machine) -> str:
    """Unified diff of two machine files.

    Examples
    --------
    >>> import rotorsim as rs
    >>> after = machine.replace("effects.unbalance.me", "12 g*mm")
    >>> "12 g*mm" in rs.discrepancy.difference(machine, after)
    True
    """
    old, new = ((m._source or m.text).splitlines() for m in (before, after))
    return "\n".join(unified_diff(old, new, "before", "after", lineterm=""))


def _comments(diagnosis: Findings, found: IdentifiedEffect) -> list[str]:
    known = quantities(REGISTRY[found.effect])
    lines = [f"{FOUND}, verdict: {diagnosis.status}; data {diagnosis.data_hash}"]
    lines += [f"{p} +- {_rough(sd, known[p].unit)} (one standard deviation)" for p, sd in found.sd.items()]
    evidence = diagnosis.evidence
    if "share_gone" in evidence:
        lines.append(
            f"evidence: chi2 {evidence['chi2_calibrated']:.0f} -> {evidence['chi2_with_effect']:.0f} of "
            f"{evidence['numbers']:.0f}; {100 * evidence['share_gone']:.0f} % of the flagged excess gone"
        )
    others = [k for k in found.tie_class if k != found.form] + [" with ".join(t) for t in diagnosis.ties]
    if others:
        lines.append(f"indistinguishable from: {', '.join(others)}")
    return lines


def _rough(value: float, unit: str, digits: int = 2, like: float = 0.0) -> str:
    """Value with a few digits, in the unit that machine files use for it, or for the value `like`."""
    if unit == "1":
        return f"{value:.{digits}g}"
    shown = like or float(f"{value:.{digits}g}")
    number, _, written = show(shown, unit).partition(" ")
    size = value * float(number) / shown if shown else 0.0
    return f"{float(f'{size:.{digits}g}'):g} {written}".rstrip()


def _add(effects: Any, name: str, values: dict[str, float], comments: list[str], remark: str) -> None:
    """Write a table of an effect: into the present one where the effect is single, else a further one."""
    units = {p: known.unit for p, known in quantities(REGISTRY[name]).items()}
    texts = {p: short(v) if units[p] == "1" else show(short(v), units[p]) for p, v in values.items()}
    present = effects.get(name)
    own = _of_film(present, values.get("bearing")) if REGISTRY[name].single else None
    if own is not None:
        for line in comments if not inline(own) else ():
            own.add(tomlkit.comment(line))
        for p, text in texts.items():
            _put(own, p, text, remark)
        return
    table = tomlkit.table()
    for line in comments:
        table.add(tomlkit.comment(line))
    for p, text in texts.items():
        table.add(p, text)
    if present is None:
        effects.add(name, table)
        return
    if isinstance(present, tomlkit.items.AoT):
        present.append(table)
        return
    several = tomlkit.aot()
    for one in present if isinstance(present, list) else [present]:
        copy = tomlkit.table()
        for p, v in one.items():
            copy.add(p, v)
        several.append(copy)
    several.append(table)
    effects[name] = several


def _of_film(present: Any, bearing: float | None) -> Any:
    """Table of one film, or of all, among those of an effect that a film has once; None where there is none."""
    tables = present if isinstance(present, list) else [present] if present is not None else []
    return next((one for one in tables if one.get("bearing") == bearing), None)


def _one_for_each_film(effects: Any, machine: Machine, changed: set[str]) -> None:
    """Repeat tables about all films for each of them, where a film's own values are to be written."""
    for name in sorted(changed & set(machine.effects)):
        about = [getattr(e, "bearing", None) for e in own_tables(REGISTRY[name], machine)]
        films = [bearing for bearing in about if bearing is not None]
        if not films or not REGISTRY[name].single or "bearing" in effects[name] or isinstance(effects[name], list):
            continue
        several = tomlkit.aot()
        for bearing in films:
            several.append(tomlkit.item({**effects[name].unwrap(), "bearing": bearing}))
        effects[name] = several


def _table_before(machine: Machine, name: str, table: int) -> Effect:
    """Effect of a machine in a table of its twin, before the calibration."""
    present, own = machine.effects.get(name, ()), own_tables(REGISTRY[name], machine)
    if not REGISTRY[name].single:
        return own[table - len(present)]
    return of_each_film(present, own)[table] if present else own[table]


def _film(effect: Effect) -> dict[str, float]:
    """The bearing that an effect names, as a value for its table."""
    bearing = getattr(effect, "bearing", None)
    return {} if bearing is None else {"bearing": bearing}


def _where(machine: Machine, name: str, table: int) -> dict[str, float]:
    """Position of the calibrated effect of a table of the twin, where it has one."""
    own = REGISTRY[name].neutral(machine, table - len(machine.effects.get(name, ())))
    position = getattr(own, "position", None)
    return {} if position is None else {"position": position}


def _put(table: Any, key: str, value: Any, remark: str) -> None:
    """Write a value with its origin as the comment, in place of the comment on the older value."""
    table[key] = value
    comment(table, key, remark)


def short(value: float) -> float:
    """Number as text with nine digits."""
    return float(f"{value:.9g}")


def _replace(document: Any, row: RecalibratedValue) -> None:
    """Write a calibrated number, with its standard deviation and the value before as its comment."""
    *path, last = row.path.split(".")
    table = document
    for name in path:
        # a single table of an effect needs no number
        if not name.isdigit() or isinstance(table, list):
            table = table[int(name) if name.isdigit() else name]
    value = short(row.value) if row.unit == "1" else show(short(row.value), row.unit)
    sd = _rough(row.sd, row.unit, like=short(row.value))
    _put(table, last, value, f"{FITTED}, +- {sd}; before {_rough(row.before, row.unit, 9)}")


def pins_along(machine: Machine, axis: str) -> tuple[int, ...]:
    """Numbers of the injectors whose pins follow the reference of an axis, from 1."""
    return tuple(k for k, one in enumerate(machine.injectors, 1) if one.reference.endswith(axis))


def _keep_y(table: Any, bearing: Any, replaced: set[str]) -> None:
    """Write a bearing's numbers along y where the file leaves them to be those along x, and only these are replaced."""
    tables, coefficients = (table["points"], bearing.points) if bearing.speeds.size else ([table], [bearing])
    for what, values, unit in zip("kc", of_axis(bearing, "y"), ("N/m", "N*s/m"), strict=True):
        alone = f"{what}xx" in replaced and f"{what}yy" not in replaced
        for own, given, value in zip(tables, coefficients, values, strict=True):
            if getattr(given, f"{what}yy") is None and value and alone:
                own[f"{what}yy"] = show(float(value), unit)


def _calibrate(document: Any, effects: Any, diagnosis: Findings) -> list[str]:
    """Write the calibration; returns comments on the numbers that have no place in the file."""
    machine, left_out = diagnosis.machine, []
    tables: dict[tuple[str, int], dict[str, float]] = {}
    turned: dict[str, complex] = {}
    direct: list[str] = []
    for key, (value, sd) in diagnosis.calibration.items():
        pins = pins_along(machine, key[-1]) if key in ("actuator_x", "actuator_y") else ()
        if pins and abs(value) > CLEAR_GAIN * sd:
            comments = [f"{FITTED}, {key}", f"error +- {_rough(sd, '1')} (one standard deviation)"]
            for pin in pins:
                _add(effects, "actuator_gain", {"injector": float(pin), "error": value}, comments, FITTED)
        elif " x " in key or key.startswith(CLOCK) or (key in (*DIRECTIONS, *FACTORS) and key not in FACTORS_OF):
            more = NOT_IN_FILE if key == SHEAR.key and value else ""
            left_out.append(f"calibration not written: {key} = {value:.4g} +- {sd:.2g}{more}")
        elif "~" in key:
            turned[key[:-2]] = turned.get(key[:-2], 0) + value * (1 if key[-1] == "c" else 1j)
        elif key in FACTORS_OF or key.startswith("bearing."):
            direct.append(key)
        else:
            name, table, parameter = key.split(".")
            tables.setdefault((name, int(table)), {})[parameter] = value
    rows = diagnosis.recalibration
    for number in dict.fromkeys(int(key.split(".")[1]) for key in direct if key.startswith("bearing.")):
        own = {row.path.rpartition(".")[2] for row in rows if row.key.startswith(f"bearing.{number}.")}
        _keep_y(document["bearings"][number], machine.bearings[number], own)
    replaced = set()
    for row in rows:
        if row.key in direct or row.key in turned:
            _replace(document, row)
            replaced.add(row.key)
    for (name, number), changes in tables.items():
        before = _table_before(machine, name, number)
        _add(effects, name, {p: getattr(before, p) + v for p, v in changes.items()} | _film(before), [FITTED], FITTED)
    for key, z in ((key, z) for key, z in turned.items() if key not in replaced):
        owner, _, pair = key.rpartition(".")
        amplitude, _, phase = pair.partition("~")
        name, place = owner.split(".")
        values = {amplitude: abs(z), phase: argument(z)}
        _add(effects, name, values | _where(machine, name, int(place)), [FITTED], FITTED)
    unseen = [(key, *diagnosis.calibration[key]) for key in direct if key not in replaced]
    left_out += [f"calibration not written: {key} = {value:.4g} +- {sd:.2g}" for key, value, sd in unseen]
    return left_out
