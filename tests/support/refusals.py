"""Refusals as tests ask for them: by class, argument and value, not by their wording."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from rotorsim.base.errors import RotorsimError


@contextmanager
def refused(kind: type[RotorsimError], argument: str, value: Any = None) -> Iterator[pytest.ExceptionInfo[Any]]:
    """Require an error of a class about an argument and its value, whose message is one sentence.

    `value` may be a function that judges it; NaN and arrays count as equal where they are written alike.
    """
    with pytest.raises(kind) as caught:
        yield caught
    error = caught.value
    assert error.argument == argument, f"{error.argument!r}: {error}"
    alike = repr(error.value) == repr(value)
    good = value(error.value) if isinstance(value, Callable) else alike or error.value == value
    assert good, f"{error.value!r}: {error}"
    assert "\n" not in str(error) and str(error).strip()
