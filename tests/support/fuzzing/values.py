"""Random values as text: within limits, at them, beyond them, and invalid ones."""

from typing import Any

import numpy as np
from hypothesis import strategies as st

from rotorsim.base.quantity import Quantity
from rotorsim.base.units import show

NONSENSE = (
    "", " ", "nan", "inf", "-inf m", "1e400 m", "1e-400 m", "abc", "0.05", "-1", "3 kg", "1 furlong", "5 €", "٣ mm",
    "½ m", "0x10 m", "1_000 m", "1/0 m", "1e999999999 s", "--1 V", "2 m/s^^2", "7 deg C", "1 m 2", "9" * 400,
    "1 " + "m*" * 60,
    "1 m**99999", "1 e", "\u202e1 mm", "1\tmm", "1 dB", "3 ()", "1 [m]", "$(x)", "'1 mm'", "True", "None", "\\",
    "1 %",
)  # fmt: skip
"""Leftovers of hands and scripts where a value should be."""


def text_of(value: float, spec: Quantity) -> str:
    """A value as it stands in a file or behind an option."""
    return str(round(value)) if spec.multiple else show(float(value), spec.unit)


def limits(spec: Quantity) -> tuple[float, float]:
    """Lowest and highest legal value, as far as there are any."""
    low = spec.low if spec.low is not None else spec.above
    return -1e15 if low is None else low, 1e15 if spec.high is None else spec.high


def legal(spec: Quantity, near: float | None = None) -> st.SearchStrategy[float]:
    """SI values within the limits: near a value, anywhere, or at a limit."""
    low, high = limits(spec)
    lowest = low if spec.above is None else min(low + max(abs(low), 1e-9) * 1e-6, high)
    ends = st.sampled_from([lowest, high] if high < 1e15 else [lowest])
    choices = [spread(lowest, high), ends]
    if near:
        choices = [
            st.floats(-1, 1).map(lambda e: near * 10**e),
            st.floats(-0.2, 0.2).map(lambda e: near * 10**e),
        ] * 3 + choices
    return st.one_of(choices).map(lambda value: float(min(max(value, lowest), high)))


def spread(low: float, high: float) -> st.SearchStrategy[float]:
    """Values of every magnitude in a range, of either sign where it has both."""
    top = max(abs(low), abs(high), 1e-12)
    size = st.floats(max(np.log10(top) - 12, -30.0), np.log10(top)).map(lambda e: 10**e)
    if low < 0 < high:
        return st.tuples(size, st.sampled_from([-1, 1])).map(lambda pair: pair[0] * pair[1])
    return size if high > 0 else size.map(lambda value: -value)


def beyond(spec: Quantity) -> st.SearchStrategy[float]:
    """SI values outside the limits, or absurdly large where there are none."""
    low, high = limits(spec)
    return st.sampled_from([low - max(abs(low), 1.0), high + max(abs(high), 1.0), 1e300, -1e300, 5e-324])


def broken(spec: Quantity) -> st.SearchStrategy[str]:
    """Text that is no value of this kind, mostly."""
    return st.one_of(
        beyond(spec).map(lambda value: show(value, spec.unit)), st.sampled_from(NONSENSE), st.text(max_size=12)
    )


def any_toml() -> st.SearchStrategy[Any]:
    """A value of any type that TOML knows."""
    plain = st.one_of(
        st.booleans(), st.integers(), st.floats(), st.text(max_size=8), st.sampled_from(NONSENSE),
        st.sampled_from([2**63, -(2**70), 10**400]),
    )  # fmt: skip
    nested = st.recursive(
        plain,
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
        max_leaves=6,
    )
    return nested
