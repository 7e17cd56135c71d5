"""One thread of linear algebra for small matrices: several only wait for each other, on busy machines for long."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from threadpoolctl import ThreadpoolController


@lru_cache(maxsize=1)
def _libraries() -> ThreadpoolController:
    import scipy.linalg  # noqa: F401 - brings its library, which must be loaded to be found

    return ThreadpoolController()


def one_thread() -> Any:
    """Context in which the libraries of numpy and scipy use one thread."""
    return _libraries().limit(limits=1)
