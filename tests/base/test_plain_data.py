"""Dataclasses as plain data: round trip of every declared type, places of what does not fit."""

import json
from dataclasses import dataclass, field, make_dataclass
from typing import Any

import numpy as np
import pytest

from rotorsim.base.plain_data import from_plain, to_plain


@dataclass(frozen=True)
class Inner:
    name: str
    values: tuple[float, ...]
    pair: tuple[int, str] = (0, "")


@dataclass(frozen=True)
class Outer:
    inner: tuple[Inner, ...]
    by_keys: dict[tuple[str, ...], Inner | None]
    matrix: np.ndarray
    anything: dict[str, Any]
    flag: bool = False
    later: list[float] = field(default_factory=list)


def outer():
    """One with every declared type."""
    inner = Inner("a", (1.0, np.inf, 0.1), (3, "b"))
    anything = {"x": np.float64(0.3), "z": {"u": np.arange(3) * 1j}, "n": None, "s": (1, True)}
    return Outer((inner,), {("k", "l"): inner, (): None}, np.eye(2), anything, flag=True, later=[2])


def there_and_back(value, kind):
    arrays = {}
    text = json.dumps(to_plain(value, arrays))
    return from_plain(kind, json.loads(text), arrays)


def test_a_dataclass_is_the_same_after_the_round_trip():
    one, again = outer(), there_and_back(outer(), Outer)
    assert (again.inner, again.by_keys, again.flag, again.later) == (one.inner, one.by_keys, True, [2])
    assert np.array_equal(again.matrix, one.matrix) and again.anything["x"] == 0.3
    assert np.array_equal(again.anything["z"]["u"], np.arange(3) * 1j) and again.anything["s"] == [1, True]


def test_a_field_that_is_new_has_its_default_and_one_that_is_gone_is_left_out():
    stored = {"name": "a", "values": [1], "gone": 5}
    assert from_plain(Inner, stored, {}) == Inner("a", (1.0,))


@pytest.mark.parametrize(
    ("stored", "sentence"),
    [
        ({"values": []}, "name is missing"),
        ({"name": 3, "values": []}, "name is not of type str"),
        ({"name": "a", "values": ["b"]}, r"values\[0\] is not of type float"),
        ({"name": "a", "values": [True]}, r"values\[0\] is not of type float"),
        ({"name": "a", "values": 1.0}, "values is not a list"),
        ({"name": "a", "values": [], "pair": [1]}, "pair has 1 values in place of 2"),
        ([], "is not an object"),
    ],
)
def test_what_does_not_fit_is_named(stored, sentence):
    with pytest.raises(ValueError, match=sentence):
        from_plain(Inner, stored, {})


def test_a_missing_array_is_named():
    kind = make_dataclass("One", [("grid", np.ndarray)])
    with pytest.raises(ValueError, match="the array of grid is missing"):
        from_plain(kind, {"grid": {"$array": "array_0"}}, {})


def test_what_is_no_data_is_refused_when_it_is_written():
    with pytest.raises(TypeError, match="function cannot be stored"):
        to_plain({"a": outer}, {})
    with pytest.raises(TypeError, match="ndarray cannot be stored"):
        to_plain(np.array([outer], object), {})
