"""SI units in FMI notation: exponents of the base units, display units with their factors."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterable
from xml.etree.ElementTree import Element, SubElement

from rotorsim.base.units import TABLE, dimension

DERIVED = {
    "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "Hz": {"s": -1},
}
BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


def exponents(unit: str) -> dict[str, int]:
    """Exponents of the base units, e.g. of 'N*m': kg 1, m 2, s -2."""
    found = _walk(ast.parse(unit.replace("^", "**"), mode="eval").body)
    return {name: found[name] for name in BASE if found[name]}


def _walk(node: ast.AST) -> Counter[str]:
    if isinstance(node, ast.Name):
        return Counter(DERIVED.get(node.id, {node.id: 1}))
    if isinstance(node, ast.BinOp):
        left = _walk(node.left)
        if isinstance(node.op, ast.Pow) and isinstance(node.right, ast.Constant):
            power = int(str(node.right.value))
            return Counter({name: n * power for name, n in left.items()})
        sign = 1 if isinstance(node.op, ast.Mult) else -1
        for name, n in _walk(node.right).items():
            left[name] += sign * n
        return left
    return Counter()


def fmi_name(unit: str) -> str:
    """'N*m' as 'N.m', 'm/s^2' as 'm/s2'."""
    return unit.replace("*", ".").replace("^", "")


def display_unit(unit: str, typical: float) -> str | None:
    """Display unit for a value of this size, None where that is the SI unit."""
    if unit not in TABLE:
        return None
    kind = dimension(unit)
    fitting = [u for u in kind.people if u in kind.factors and abs(typical) >= 0.1 * float(kind.factors[u])]
    best = (fitting or list(kind.people))[-1 if fitting else 0]
    return fmi_name(best) if best != unit and best in kind.factors else None


def unit_definitions(units: Iterable[str]) -> Element:
    """The element UnitDefinitions for all units used."""
    root = Element("UnitDefinitions")
    for unit in sorted(set(units) - {"1", ""}):
        entry = SubElement(root, "Unit", name=fmi_name(unit))
        SubElement(entry, "BaseUnit", {name: str(n) for name, n in exponents(unit).items()})
        kind = dimension(unit)
        for shown in kind.people:
            if shown != unit and shown in kind.factors:
                SubElement(entry, "DisplayUnit", name=fmi_name(shown), factor=repr(1 / float(kind.factors[shown])))
    return root
