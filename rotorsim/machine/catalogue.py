"""Catalogue of effects as data and as Markdown, generated from the effect files.

`python -m rotorsim.machine.catalogue docs/effects.md` writes the page of the documentation.
"""

from __future__ import annotations

import inspect
import re
import sys
import textwrap
from dataclasses import Field, fields
from typing import Any

from rotorsim.base.files import write_text
from rotorsim.base.quantity import Quantity, quantity_of
from rotorsim.base.units import show
from rotorsim.effects import PORTS, REGISTRY, Effect
from rotorsim.effects.base import WHERE

HEAD = """# Effects

Every physical effect is a table `[effects.NAME]` of the machine file and one file of the package, from which this page
is made. How to write your own: [machine files](machine_files.md#your-own-effect).

At the neutral values, the defaults here, an effect leaves every bit of a trajectory as it is without it.
"""
PLACES = {
    "disc": "at the first disc",
    "film": "in the gas bearing",
    "bearing": "at the first linear bearing",
    "start": "at the left end of the shaft",
}
INFLUENCES = {
    "mass": "on every mass of the rotor",
    "bow": "between the outermost bearings",
    "housing": "on the housing of the bearing at `position`",
    "between": "between the shaft and the housing of the bearing at `position`",
}
ELSEWHERE = {
    "contact": "in the gas bearing",
    "film": "on the gap of the gas bearing",
    "gas": "on the gas in the film",
    "injector": "on the injectors' pins",
    "plenum": "on the injectors' plena",
    "supply": "on the line before the injectors",
    "reference": "on the references of the pins, in the file's order",
    "amplifier": "in the amplifiers of the piezo actuators",
    "actuator": "in every piezo actuator, in the file's order",
    "sensor": "on the readings, in the file's order",
    "pin_sensor": "on the readings of the pins",
    "drive": "on the speed of the shaft",
    "torque": "on the speed of the shaft",
    "support": "under the sleeve of the gas bearing",
    "rotating": "on the whole shaft",
}
"""Places of the effects whose port leaves no choice."""
FAMILIES = {
    "rotor": "Shaft, discs, couplings and seals",
    "film": "Gas film and its sleeve",
    "supply": "Injectors and supply",
    "actuators": "Piezo actuators",
    "sensors": "Sensors",
}
"""Families of effects by the folder of `rotorsim.effects` that holds them; a user's own have one of their own."""
OWN = "Effects of other packages"


def describe(effect: type[Effect]) -> dict[str, Any]:
    """Text on an effect: name, family, port, summary, title, equation, source, references, acts, parameters ...

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.describe(rs.effects.REGISTRY["unbalance"])["name"]
    'unbalance'
    """
    from rotorsim.base.references import references

    title, about, equation, source = _read(inspect.getmodule(effect).__doc__ or "")
    return {
        "name": effect.name,
        "family": _family(effect),
        "port": effect.port,
        "summary": " ".join((effect.__doc__ or "").split()),
        "title": title,
        "about": about,
        "equation": equation,
        "source": source,
        "references": [references().get(key, key) for key in effect.cites],
        "acts": _place(effect),
        "several": not effect.single,
        "parameters": [_parameter(f) for f in fields(effect)],
    }


def catalogue() -> list[dict[str, Any]]:
    """Every registered effect, by port and name.

    Examples
    --------
    >>> import rotorsim as rs
    >>> "unbalance" in {one["name"] for one in rs.machine.catalogue()}
    True
    """
    order = sorted(REGISTRY.values(), key=lambda e: (PORTS.index(e.port), e.name))
    return [describe(effect) for effect in order]


def _read(docstring: str) -> tuple[str, str, str, str]:
    """Title, paragraphs of prose, TeX of the equations and source out of a module's docstring."""
    title, _, rest = inspect.cleandoc(docstring).partition("\n\n")
    prose, equations = [], []
    for block in rest.split("\n\n"):
        if block.startswith(".. math::"):
            equations.append(" ".join(block.removeprefix(".. math::").split()))
        else:
            prose.append(" ".join(block.split()))
    about, _, source = "\n\n".join(prose).partition("Source: ")
    return " ".join(title.split()), about.strip(), r" \\ ".join(equations), " ".join(source.split())


def _place(effect: type[Effect]) -> str:
    if effect.port in ELSEWHERE:
        where = ELSEWHERE[effect.port]
        return f"{where.partition(', ')[0]}, before all others" if effect.begins_chain else where
    if effect.influence in INFLUENCES:
        return INFLUENCES[effect.influence]
    choice = "at `position` or " if any(f.name == "position" for f in fields(effect)) else ""
    return choice + PLACES[effect.place]


def _parameter(field: Field[Any]) -> dict[str, str]:
    """Name, unit, neutral value, limits and sentence of a parameter as people write them."""
    known = quantity_of(field) or Quantity("")
    neutral = field.default if isinstance(field.default, (int, float)) else None
    limits = (None, None) if field.name in WHERE else (known.low, known.high)
    written = ("" if value is None else show(value, known.unit) for value in (neutral, *limits))
    shown = dict(zip(("neutral", "low", "high"), written, strict=True))
    return {"name": field.name, "unit": known.unit, **shown, "doc": known.doc}


def markdown(entry: dict[str, Any]) -> str:
    """One effect as a section of Markdown."""
    again = " It may stand in several tables." if entry["several"] else ""
    lines = [f"### {entry['name']}", entry["title"]]
    lines += [f"$$\n{textwrap.fill(entry['equation'], 119, break_long_words=False)}\n$$"] if entry["equation"] else []
    lines += [_wrapped(_escaped(text)) for text in entry["about"].split("\n\n") if text]
    lines += [_wrapped(f"Source: {_escaped(entry['source'])}")] if entry["source"] else []
    lines += ["\n".join(f"- {_escaped(one)}" for one in entry["references"])] if entry["references"] else []
    lines += [_wrapped(f"Port `{entry['port']}`; acts {entry['acts']}.{again}")]
    rows = ["| parameter | neutral | limits | what |", "|---|---|---|---|"]
    for p in entry["parameters"]:
        limits = f"{p['low']} to {p['high']}" if p["low"] or p["high"] else ""
        rows.append(f"| `{p['name']}` [{p['unit']}] | {p['neutral']} | {limits} | {p['doc']} |")
    return "\n\n".join([*lines, "\n".join(rows)])


def page() -> str:
    """The whole page of the documentation."""
    parts = [HEAD.strip()]
    for family in (*FAMILIES.values(), OWN):
        entries = [e for e in catalogue() if e["family"] == family]
        rows = ["| name | port | what |", "|---|---|---|"]
        rows += [f"| [`{e['name']}`](#{e['name']}) | {e['port']} | {e['summary']} |" for e in entries]
        parts += [f"## {family}", "\n".join(rows), *map(markdown, entries)] if entries else []
    return "\n\n".join(parts) + "\n"


def _family(effect: type[Effect]) -> str:
    """Return the heading under which an effect stands."""
    package, _, rest = effect.__module__.partition(".effects.")
    return FAMILIES.get(rest.partition(".")[0], OWN) if package == "rotorsim" else OWN


def _escaped(text: str) -> str:
    """Text in which no sign is taken for Markdown."""
    return re.sub(r"([*_<])", r"\\\1", text.replace("``", "`"))


def _wrapped(text: str) -> str:
    return textwrap.fill(text, 119, break_long_words=False, break_on_hyphens=False)


if __name__ == "__main__":
    write_text(sys.argv[1], page())
