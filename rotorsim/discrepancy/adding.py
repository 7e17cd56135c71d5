"""The machine file with what was found: tables of effects with uncertainty and evidence as comments, new calibration.

The fit's own numbers are written, as the effects and factors that the fit turned, so that a simulation of the new file
is the fitted one. Trends of the calibration over pressure and speed, the sensors' zeros and unequal gains of the
actuators have no place in a machine file and stand as comments.
"""

from __future__ import annotations

from cmath import phase as argument
from dataclasses import fields
from difflib import unified_diff
from typing import TYPE_CHECKING, Any

from rotorsim.effects import REGISTRY
from rotorsim.errors import MachineFileError
from rotorsim.machine import Machine
from rotorsim.machine.units import show

if TYPE_CHECKING:
    from rotorsim.discrepancy.result import Diagnosis, Found


def extended(diagnosis: Diagnosis) -> Machine:
    """The diagnosis' machine with the effects it named, or tied or partial ones, and the new calibration."""
    text = diagnosis.machine._source or diagnosis.machine.text
    try:
        return Machine.from_text(_written(diagnosis, text, last=True))
    except MachineFileError:
        # sensors and actuators are chains: what was added must stand ahead of what is there
        return Machine.from_text(_written(diagnosis, text, last=False))


def _written(diagnosis: Diagnosis, text: str, last: bool) -> str:
    """The machine file's text with what was found, new tables behind or ahead of the others."""
    import tomlkit

    machine = diagnosis.machine
    document = tomlkit.parse(text)
    effects: Any = document.setdefault("effects", tomlkit.table(is_super_table=True))
    before = list(effects)
    left_out = _calibrate(document, effects, diagnosis)
    for found in diagnosis.effects:
        _add(effects, machine, found.effect, found.parameters, _comments(diagnosis, found))
    if not last:
        _put_ahead(effects, [name for name in effects if name not in before])
    for line in left_out:
        document.add(tomlkit.comment(line))
    return tomlkit.dumps(document)


def _put_ahead(effects: Any, names: list[str]) -> None:
    """Move new tables ahead of the others."""
    others = [(name, effects.pop(name)) for name in list(effects) if name not in names]
    for name, table in others:
        effects.add(name, table)


def difference(before: Machine, after: Machine) -> str:
    """Unified diff of two machine files."""
    old, new = ((m._source or m.text).splitlines() for m in (before, after))
    return "\n".join(unified_diff(old, new, "before", "after", lineterm=""))


def _comments(diagnosis: Diagnosis, found: Found) -> list[str]:
    units = {f.name: f.metadata.get("unit", "") for f in fields(REGISTRY[found.effect])}
    lines = [f"found by rotorsim diagnose, verdict: {diagnosis.status}; data {diagnosis.data_hash}"]
    lines += [f"{p} +- {_rough(sd, units[p])} (one standard deviation)" for p, sd in found.sd.items()]
    evidence = diagnosis.evidence
    if "share_gone" in evidence:
        lines.append(
            f"evidence: chi2 {evidence['chi2_calibrated']:.0f} -> {evidence['chi2_with_effect']:.0f} of "
            f"{evidence['numbers']:.0f}; {100 * evidence['share_gone']:.0f} % of the flagged excess gone"
        )
    others = [k for k in found.tie_class if k != found.form] + [" with ".join(t) for t in diagnosis.ties]
    if others:
        lines.append(f"cannot be told from: {', '.join(others)}")
    return lines


def _rough(value: float, unit: str) -> str:
    """Two digits of a value in a unit people use."""
    number, _, written = show(value, unit).partition(" ")
    return f"{float(number):.2g} {written}".rstrip()


def _add(effects: Any, machine: Machine, name: str, values: dict[str, float], comments: list[str]) -> None:
    """A table of an effect: into the one that is there where the effect is single, else a further one."""
    import tomlkit

    units = {f.name: f.metadata.get("unit", "") for f in fields(REGISTRY[name])}
    texts = {p: short(v) if units[p] == "1" else show(short(v), units[p]) for p, v in values.items()}
    present = effects.get(name)
    if present is not None and REGISTRY[name].single:
        for line in comments:
            present.add(tomlkit.comment(line))
        present.update(texts)
        return
    table = tomlkit.table()
    for line in comments:
        table.add(tomlkit.comment(line))
    for p, text in texts.items():
        table.add(p, text)
    if present is None:
        effects.add(name, table)
        return
    several = tomlkit.aot()
    for one in present if isinstance(present, list) else [present]:
        copy = tomlkit.table()
        for p, v in one.items():
            copy.add(p, v)
        several.append(copy)
    several.append(table)
    effects[name] = several


def short(value: float) -> float:
    """A number with nine digits, as it is written."""
    return float(f"{value:.9g}")


def _calibrate(document: Any, effects: Any, diagnosis: Diagnosis) -> list[str]:
    """Write the calibration; returns comments on what has no place in the file."""
    machine, left_out = diagnosis.machine, []
    tables: dict[str, dict[str, float]] = {}
    turned: dict[str, complex] = {}
    for key, (value, sd) in diagnosis.calibration.items():
        if " x " in key or key in (
            "offset_x",
            "offset_y",
            "mesh",
            "law",
            "actuator_x",
            "actuator_y",
            "shaft_stiffness",
        ):
            left_out.append(f"calibration not written: {key} = {value:.4g} +- {sd:.2g}")
        elif "~" in key:
            turned[key[:-2]] = turned.get(key[:-2], 0) + value * (1 if key[-1] == "c" else 1j)
        elif key == "shaft_damping":
            document["shaft"]["damping_ratio"] = short(machine.shaft.damping_ratio * (1 + value))
        elif key == "curtain_discharge" and machine.injection is not None:
            document["injection"]["curtain_discharge"] = short(machine.injection.curtain_discharge * (1 + value))
        elif key.startswith("bearing."):
            _, number, what = key.split(".")
            bearing: Any = machine.bearings[int(number)]
            own = getattr(bearing, f"{what[0]}{what[1]}{what[1]}")
            size = getattr(bearing, f"{what[0]}xx") if own is None else own
            unit = "N/m" if what[0] == "k" else "N*s/m"
            document["bearings"][int(number)][f"{what[0]}{what[1]}{what[1]}"] = show(short(size * (1 + value)), unit)
        else:
            name, _, parameter = key.split(".")
            tables.setdefault(name, {})[parameter] = value
    for name, changes in tables.items():
        present = machine.effects.get(name, ())
        own = present[0] if present and REGISTRY[name].single else REGISTRY[name]()
        _add(effects, machine, name, {p: getattr(own, p) + v for p, v in changes.items()}, ["re-calibrated"])
    for key, z in turned.items():
        owner, _, pair = key.rpartition(".")
        amplitude, _, phase = pair.partition("~")
        _add(effects, machine, owner.split(".")[0], {amplitude: abs(z), phase: argument(z)}, ["re-calibrated"])
    return left_out
