"""Random faults in the text of machine files, as from editors, scripts and typing errors."""

import re
from collections.abc import Callable
from typing import Any

import tomlkit
from hypothesis import strategies as st

from fuzzing.machines import names_of_effects, texts
from fuzzing.values import NONSENSE, any_toml

UNITS = (
    "um",
    "mm",
    "m",
    "kg",
    "N/m",
    "MPa",
    "rpm",
    "deg",
    "V",
    "s",
    "",
    "foo",
    "K",
    "degC",
    "%",
    "N*s/m",
    "1/s",
    "m^0.5",
)
INSERTED = (
    "\0", "\ufeff", "\u2028", "\r", "[", "]", "=", '"', "'''", "#", "[[", "effects", "é", "😀", "\\u0000", "0x",
    "1979-05-27", "nan", "inf", "{", "}", ",", "[" * 2000, "a." * 500 + "b = 1", "\n[grid]\n", "\n[[bearings]]\n",
    "\n[effects.unbalance]\n",
)  # fmt: skip


def _delete(draw: Any, lines: list[str]) -> list[str]:
    at = draw(st.integers(0, len(lines) - 1))
    return lines[:at] + lines[at + draw(st.integers(1, 8)) :]


def _double(draw: Any, lines: list[str]) -> list[str]:
    a = draw(st.integers(0, len(lines) - 1))
    b = draw(st.integers(a, min(a + 12, len(lines))))
    to = draw(st.integers(0, len(lines)))
    return lines[:to] + lines[a:b] + lines[to:]


def _swap(draw: Any, lines: list[str]) -> list[str]:
    a, b = (draw(st.integers(0, len(lines) - 1)) for _ in range(2))
    lines = list(lines)
    lines[a], lines[b] = lines[b], lines[a]
    return lines


def _unit(draw: Any, lines: list[str]) -> list[str]:
    at, unit = draw(st.integers(0, len(lines) - 1)), draw(st.sampled_from(UNITS))
    return [re.sub(r' [^" ]*"$', f' {unit}"', line) if i == at else line for i, line in enumerate(lines)]


def _value(draw: Any, lines: list[str]) -> list[str]:
    at = draw(st.sampled_from([i for i, line in enumerate(lines) if "=" in line] or [0]))
    value = draw(
        st.one_of(any_toml().map(_literal), st.sampled_from(NONSENSE).map(_literal), st.sampled_from(NONSENSE))
    )
    return [f"{line.partition('=')[0]}= {value}" if i == at else line for i, line in enumerate(lines)]


def _literal(value: Any) -> str:
    try:
        return tomlkit.item(value).as_string()
    except (ValueError, TypeError):
        return repr(value)


def _insert(draw: Any, lines: list[str]) -> list[str]:
    text = "\n".join(lines)
    at = draw(st.integers(0, len(text)))
    return (text[:at] + draw(st.one_of(st.sampled_from(INSERTED), st.text(max_size=6))) + text[at:]).split("\n")


def _cut(draw: Any, lines: list[str]) -> list[str]:
    text = "\n".join(lines)
    return text[: draw(st.integers(0, len(text)))].split("\n")


def _effect(draw: Any, lines: list[str]) -> list[str]:
    name, fields = draw(st.sampled_from(names_of_effects()))
    header = draw(st.sampled_from([f"[effects.{name}]", f"[[effects.{name}]]", f"[effects.{name}.0]"]))
    values = draw(st.dictionaries(st.sampled_from(fields), any_toml().map(_literal), max_size=2))
    return [*lines, header, *(f"{key} = {value}" for key, value in values.items())]


def _rename(draw: Any, lines: list[str]) -> list[str]:
    at = draw(st.integers(0, len(lines) - 1))
    return [re.sub(r"\w+", draw(st.sampled_from(["x", "kind", "0", "effects", "name", "mass"])), line, count=1)
            if i == at else line for i, line in enumerate(lines)]  # fmt: skip


MUTATIONS: tuple[Callable[[Any, list[str]], list[str]], ...] = (
    _delete, _double, _swap, _unit, _value, _value, _insert, _cut, _effect, _rename,
)  # fmt: skip


@st.composite
def mutated(draw: Any) -> str:
    """Text of a machine file after one to three mishaps."""
    lines = texts()[draw(st.sampled_from(sorted(texts())))].split("\n")
    for mishap in draw(st.lists(st.sampled_from(MUTATIONS), min_size=1, max_size=3)):
        lines = mishap(draw, lines) or [""]
    return "\n".join(lines)
