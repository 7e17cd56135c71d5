"""Compilation of functions that only other kernels call.

Numba optimises each function with all that it calls and makes machine code of it, layer over layer. A function of a
generated module is never called from Python: here it stays code that its entry points link, and is optimised with them.
"""

from __future__ import annotations

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


class LinkedLibrary(JITCodeLibrary):
    """Code without an address: what numba does with one finds none."""

    def _optimize_final_module(self) -> None:
        """The entry point's library is optimised when this one is part of it."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """0: there is no machine code."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> Any:
        """The library itself, which takes the one call that needs machine code."""
        return self

    def set_env(self, name: str, env: Any) -> None:
        """Nothing: the environment serves errors raised in Python, and kernels raise none."""


class LinkedCompiler(Compiler):
    """Numba's compiler with such a library."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.library = LinkedLibrary(self.state.targetctx.codegen(), "linked")
