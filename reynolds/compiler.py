"""Compilers of kernels: numba's, without what kernels do not need.

Most of numba's work on a kernel is Python's, and much of it is repeated or for nothing: it types every sum of two
floats anew, trying a dozen templates, and looks for closures, generators and arrays to fuse. Here the signatures of
operators are remembered, and only the passes that kernels need are made. The code that comes out is the same.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from hashlib import sha256
from typing import Any

from numba.core import typed_passes as typed, untyped_passes as untyped
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager
from numba.core.itanium_mangler import mangle
from numba.core.types.functions import BaseFunction

PASSES = (
    untyped.TranslateByteCode, untyped.FixupArgs, untyped.IRProcessing, untyped.GenericRewrites, untyped.ReconstructSSA,
    typed.NopythonTypeInference, typed.PreLowerStripPhis, typed.IRLegalization, typed.NativeLowering,
    typed.NoPythonBackend,
)  # fmt: skip
SHARED = "shared"
"""Name of the libraries of `SharedCompiler`."""
YOUNG = 50_000
"""New objects after which garbage is collected."""


@contextmanager
def compiling() -> Iterator[None]:
    """Compile with remembered signatures and few collections of garbage: numba makes a million objects that stay."""
    functions: Any = BaseFunction
    with global_compiler_lock:
        asked, thresholds = functions.get_call_type, gc.get_threshold()
        functions.get_call_type = _remembered
        gc.set_threshold(YOUNG, *thresholds[1:])
        try:
            yield
        finally:
            functions.get_call_type = asked
            gc.set_threshold(*thresholds)


def _remembered(function: BaseFunction, context: Any, arguments: Any, named: dict[str, Any]) -> Any:
    """Signature of an operator or a built-in function for types of arguments."""
    if named:
        return _ask(function, context, arguments, named)
    return _signature(function, context, tuple(arguments))


_ask: Any = BaseFunction.get_call_type


@cache
def _signature(function: BaseFunction, context: Any, arguments: tuple[Any, ...]) -> Any:
    return _ask(function, context, arguments, {})


_linked_only = False


def link_only() -> None:
    """Make no machine code in this process: kernels leave it as LLVM IR, an entry point's with all that it calls."""
    global _linked_only
    _linked_only = True


class KernelCompiler(Compiler):
    """Compiler of allocation-free functions of numbers, arrays, records and tuples."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        if _linked_only:
            self.link_only()

    def link_only(self) -> None:
        """Make no machine code of this function."""
        self.state.library = LinkedLibrary(self.state.targetctx.codegen(), "linked")

    def define_pipelines(self) -> list[PassManager]:
        """The passes."""
        passes = PassManager("kernel")
        for each in PASSES:
            passes.add_pass(each)
        passes.finalize()
        return [passes]


class LinkedLibrary(JITCodeLibrary):
    """Code without an address: what numba does with one finds none."""

    def add_linking_library(self, library: JITCodeLibrary) -> None:
        """Link other code, but for what is shared: that is called where it is."""
        if library.name != SHARED:
            super().add_linking_library(library)

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


class LinkedCompiler(KernelCompiler):
    """Compiler of functions that only other kernels call.

    Numba optimises each function with all that it calls and makes machine code of it, layer over layer. A function of
    a generated module is never called from Python: it stays code that its entry points link, optimised with them.
    """

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.link_only()


class SharedCompiler(KernelCompiler):
    """Compiler of an entry point that other modules call as machine code, under a name that is the same everywhere.

    Its arguments have the same types in all of them.
    """

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        if _linked_only:
            return
        self.state.library = self.state.targetctx.codegen().create_library(SHARED)
        self.state.library.enable_object_caching()  # as numba does with one of its own
        self.state.targetctx.mangler = _lasting_name


def _lasting_name(name: str, arguments: Any, **_: Any) -> str:
    """Symbol of a function: its name, and its types as a hash, since numba numbers records as they come."""
    return str(mangle(f"{name}_{sha256(str(arguments).encode()).hexdigest()[:12]}", ()))
