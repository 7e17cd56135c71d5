"""Compilation of kernels: allocation-free numba functions with a safe disk cache.

`kernel` compiles an entry point, `inlined` a building block that is merged into its callers, so that literal sizes
given by a caller reach every loop, `part` what only the entry points of a generated module call. All refuse any
allocation at compile time (``_nrt=False``), which is what lets the same code run outside Python. Kernels never raise:
they return a status.

numba's own cache looks only at the file of the decorated function; a change in a building block elsewhere would serve
stale physics. Hence the cache folder carries the hash of every kernel source given to `cache_folder`.

A building block is compiled where it is first used: a machine file names effects, whose kernels are such blocks, and is
read without numba.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cache, cached_property, partial, update_wrapper
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorsim.base.cache import in_cache, installed, kernels_in
from rotorsim.base.interrupt import apart

if TYPE_CHECKING:
    from reynolds.compiler import KernelCompiler

_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "_nrt": False}


class BuildingBlock:
    """A Python function that numba merges into the kernels that call it, and compiles alone where Python calls it."""

    __name__: str

    def __init__(self, function: Callable[..., Any]) -> None:
        self.py_func = function
        update_wrapper(self, function)

    @cached_property
    def compiled(self) -> Any:
        """Numba's function, made when it is first asked for.

        Kernels merge it as a part: machine code of its own, and what makes a layout's hundred numbers of Python's, are
        only there where Python calls it.
        """
        import numba
        from numba.core import config

        from reynolds.compiler import KernelCompiler

        made: Any = numba.njit(forceinline=True, pipeline_class=KernelCompiler, **_OPTIONS)(self.py_func)
        if not config.DISABLE_JIT:
            made.get_call_template = lambda given, named: merged(self).get_call_template(given, named)
            made.get_overload = lambda signature: merged(self).get_overload(signature)
            # a kernel that it calls is compiled by a thread, which would wait for this one's lock of the compiler
            made.compile = partial(apart, made.compile)
        return made

    @property
    def _numba_type_(self) -> Any:
        """Type by which numba knows it among the names of a kernel's module."""
        return self.compiled._numba_type_

    def __call__(self, *arguments: Any) -> Any:
        """Value for numbers and arrays, from machine code."""
        return self.compiled(*arguments)


def inlined(function: Callable[..., Any]) -> BuildingBlock:
    """A building block: merged into the kernels that call it."""
    return BuildingBlock(function)


def view(function: Callable[..., Any]) -> BuildingBlock:
    """A part of an array as one expression, which a generated module has where it is called.

    A kernel that manages no memory can use such a part, but not return it.
    """
    return inlined(function)


def part(inline: bool) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """A function of a generated module that only its entry points call, merged into its callers with `inline`."""

    import numba
    from numba.core import config

    from reynolds.compiler import LinkedCompiler

    def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
        if config.DISABLE_JIT:
            return function
        options = _OPTIONS | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": LinkedCompiler}
        return _of_types(numba.njit(forceinline=inline, **options)(function))

    return compiled


def _of_types(dispatcher: Any) -> Any:
    """A compiled function that is the same for all numbers: a literal reaches it where it is merged, or as a value."""
    from numba.core.types.misc import unliteral

    template = dispatcher.get_call_template
    dispatcher.get_call_template = lambda given, named: template([unliteral(a) for a in given], named)
    return dispatcher


@cache
def merged(block: Callable[..., Any]) -> Any:
    """A building block of another module as a part, which costs no machine code of its own."""
    return part(inline=True)(getattr(block, "py_func", block))


def shared(function: Callable[..., Any]) -> Callable[..., Any]:
    """An entry point of a generated module that others call as it is, without compiling it into their own."""
    from reynolds.compiler import SharedCompiler

    return kernel(function, SharedCompiler)


def addressed(function: Callable[..., Any]) -> Callable[..., Any]:
    """An entry point that other machine code calls by its address, and Python does not call."""
    return kernel(function, no_cpython_wrapper=True, no_cfunc_wrapper=True)


def address_of(function: Any, kinds: str, record: Any) -> int:
    """Address of a function of arguments of `kinds` (w: an array, i: an integer, d: a number) and of a record."""
    import numba

    one = {"w": numba.types.Array(numba.float64, 1, "C"), "i": numba.int64, "d": numba.float64}
    signature = (*(one[kind] for kind in kinds), numba.typeof(record))
    function.compile(signature)
    result = function.overloads[signature]
    return int(result.library.get_pointer_to_function(result.fndesc.llvm_func_name))


def calls_addresses() -> bool:
    """Whether kernels run as machine code of this process, which has addresses."""
    from numba.core import config

    from reynolds import compiler

    return not (config.DISABLE_JIT or compiler.links_only())


def seldom(function: Callable[..., Any]) -> Callable[..., Any]:
    """An entry point that runs seldom: its code is compiled in half the time."""
    from reynolds.compiler import SeldomCompiler

    return kernel(function, SeldomCompiler)


def kernel(
    function: Callable[..., Any], compiler: type[KernelCompiler] | None = None, **options: Any
) -> Callable[..., Any]:
    """An entry point, cached on disk under the hash of the sources it may be made of.

    These are all files of its package, or the file alone if it belongs to none (a generated module, whose name hashes
    what it imports). Plain Python where NUMBA_DISABLE_JIT is set.
    """
    import numba
    from numba.core import config

    from reynolds.compiler import KernelCompiler, compiling
    from reynolds.kernel_cache import KernelCache

    if config.DISABLE_JIT:
        return function
    module = sys.modules[function.__module__]
    own = Path(module.__file__ or "")
    dispatcher = _of_types(numba.njit(pipeline_class=compiler or KernelCompiler, **_OPTIONS, **options)(function))
    folder = cache_folder(own.parent.glob("*.py") if module.__package__ else [own])
    with kernels_in(folder, config), suppress(RuntimeError):  # of numba, if the folder takes nothing
        dispatcher._cache = KernelCache(function)
    dispatcher.compile = partial(apart, compiling()(dispatcher.compile))  # it takes long and receives no signals
    return dispatcher


def cache_folder(sources: Iterable[Path]) -> Path:
    """Folder in the user's cache that belongs to exactly these sources, this Python and this numba."""
    return in_cache(cache_digest(sources))


def cache_digest(sources: Iterable[Path]) -> str:
    """Hash of sources, each with its name and length, of this Python and this numba."""
    digest = hashlib.sha256(f"{sys.version}{installed('numba')}".encode())
    for source in sorted(sources):
        content = source.read_bytes()
        digest.update(f"{source.name} {len(content)}\0".encode() + content)
    return digest.hexdigest()[:16]
