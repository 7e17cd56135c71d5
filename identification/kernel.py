"""Compilation of the kernels of this package, each in one file with all that it calls, as numba's cache supposes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

from rotorsim.base.cache import in_cache, kernels_in

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(**options: Any) -> Callable[[Function], Function]:
    """Decorator: numba's `njit`, with the machine code in the user's cache folder, where nobody else can write."""

    def compiled(function: Function) -> Function:
        with kernels_in(in_cache("identification"), numba.config):
            made: Function = numba.njit(cache=True, nogil=True, error_model="numpy", **options)(function)
        return made

    return compiled
