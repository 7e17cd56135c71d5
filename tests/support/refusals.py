"""Refusals as tests ask for them: by class, argument and value, not by their wording."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from rotorsim.base.errors import RotorsimError


@contextmanager
def refused(kind: type[RotorsimError], argument: str, value: Any = None) -> Iterator[pytest.ExceptionInfo[Any]]:
    """Require an error of a class about an argument and its value, whose message is one sentence.

    `value` may be a function that judges it.
    """
    with pytest.raises(kind) as caught:
        yield caught
    error = caught.value
    assert error.argument == argument, f"{error.argument!r}: {error}"
    good = value(error.value) if isinstance(value, Callable) else error.value == value
    assert good, f"{error.value!r}: {error}"
    assert "\n" not in str(error) and str(error).strip()
