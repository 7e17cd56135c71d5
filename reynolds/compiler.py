"""Compilers of kernels: numba's without what kernels do not need, behind a writer of plain kernels.

A kernel in plain language becomes LLVM's code in one pass (`KernelWriter`). For any other, signatures of operators and
sizes of types are remembered and only the passes that kernels need are made. The results have the same bits. What
would be wrong without a word is refused on both ways: errors, since no kernel reads the status of what it calls by
address.
"""

from __future__ import annotations

import gc
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NoReturn, cast

from llvmlite.binding import Linkage, parse_bitcode
from numba.core import event, typed_passes as typed, untyped_passes as untyped
from numba.core.base import BaseContext
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.errors import NumbaError
from numba.core.ir import unknown_loc
from numba.core.itanium_mangler import mangle
from numba.core.lowering import Lower
from numba.core.types.functions import BaseFunction

from reynolds.kernel_expressions import Value
from reynolds.kernel_writer import ERROR, KernelWriter, WiderTypeError
from rotorsim.base.errors import DataError

PASSES = (
    untyped.TranslateByteCode, untyped.FixupArgs, untyped.IRProcessing, untyped.GenericRewrites, untyped.ReconstructSSA,
    typed.NopythonTypeInference, typed.PreLowerStripPhis, typed.IRLegalization,
)  # fmt: skip
SHARED = "shared"
"""Name of the libraries of `SharedCompiler`."""
YOUNG = 50_000
"""New objects after which garbage is collected."""


@contextmanager
def compiling() -> Iterator[None]:
    """Compile with remembered signatures, no reports and few collections of garbage.

    Numba makes a million objects that stay, and reports each call of LLVM to a stopwatch for every function that waits
    for the one it compiles. Raises DataError for a kernel that a writer refuses.
    """
    functions, contexts = cast(Any, BaseFunction), cast(Any, BaseContext)
    with global_compiler_lock:
        asked, report, thresholds = functions.get_call_type, event.broadcast, gc.get_threshold()
        sizes = contexts.get_abi_sizeof
        functions.get_call_type, event.broadcast, contexts.get_abi_sizeof = _remembered, _unheard, _size
        gc.set_threshold(YOUNG, *thresholds[1:])
        _refusals.clear()
        try:
            yield
        except NumbaError:
            if _refusals:
                raise _refusals[0] from None
            raise
        finally:
            functions.get_call_type, event.broadcast, contexts.get_abi_sizeof = asked, report, sizes
            gc.set_threshold(*thresholds)


_refusals: list[DataError] = []
"""Why kernels were refused since a compilation began: numba makes errors of its own of what it meets."""


def _unheard(happened: Any) -> None:
    """Nothing."""


def _remembered(function: BaseFunction, context: Any, arguments: Any, named: dict[str, Any]) -> Any:
    """Signature of an operator or a built-in function for types of arguments."""
    if named:
        return _ask(function, context, arguments, named)
    return _signature(function, context, tuple(arguments))


def _size(context: Any, kind: Any) -> int:
    """Size [bytes] of a type."""
    text = str(kind)
    if text not in _sizes:
        _sizes[text] = _measure(context, kind)
    return _sizes[text]


_ask: Any = BaseFunction.get_call_type
_measure: Any = BaseContext.get_abi_sizeof
_sizes: dict[str, int] = {}


@cache
def _signature(function: BaseFunction, context: Any, arguments: tuple[Any, ...]) -> Any:
    return _ask(function, context, arguments, {})


_linked_only = False


def link_only() -> None:
    """Make no machine code in this process: kernels leave it as LLVM IR, an entry point's with all that it calls."""
    global _linked_only
    _linked_only = True


def links_only() -> bool:
    """Whether this process makes no machine code."""
    return _linked_only


def _refuse(function: Any, reason: str, line: int) -> NoReturn:
    """Raise a kernel's error, which `compiling` hands on."""
    where = f"{Path(function.__code__.co_filename).name}, line {line}"
    _refusals.append(DataError(f"kernel {function.__name__} ({where}): {reason}"))
    raise _refusals[-1]


class RefusingLower(Lower):
    """Numba's writer of LLVM's code, which refuses errors."""

    def return_exception(self, exc_class: Any, exc_args: Any = None, loc: Any = None) -> NoReturn:
        """Refuse a kernel that raises."""
        _refuse(self.func_ir.func_id.func, ERROR.format(getattr(exc_class, "__name__", "an error")), self.loc.line)

    def return_dynamic_exception(self, exc_class: Any, exc_args: Any, nb_types: Any, loc: Any = None) -> NoReturn:
        """Refuse a kernel that raises with numbers of its own."""
        self.return_exception(exc_class)


@register_pass(mutates_CFG=True, analysis_only=False)
class KernelLowering(typed.NativeLowering):
    """Pass that writes the code of a kernel for which numba has found the types."""

    _name = "kernel_lowering"

    @property
    def lowering_class(self) -> type:
        """Its writer."""
        return RefusingLower


_open: set[Any] = set()
"""Code of the functions that are being written."""


class PlainLower(Lower):
    """Writer of the code of a kernel in plain language, from its syntax."""

    def init(self) -> None:
        """Nothing: there are no blocks of numba's."""

    def lower(self) -> None:
        """Write the kernel, again where a variable's type was wider than what is written of it."""
        function = self.func_ir.func_id.func
        self.writer = KernelWriter(function, partial(_refuse, function))
        while True:
            self.fndesc.restype = self.writer.declared
            try:
                super().lower()
                return
            except WiderTypeError:
                self.module = self.library.create_ir_module(self.fndesc.unique_name)

    def lower_normal_function(self, fndesc: Any) -> None:
        """Write the function's body, behind a block for its variables."""
        self.setup_function(fndesc)
        start = self.function.append_basic_block()
        self.builder.position_at_end(start)
        given = zip(fndesc.argtypes, self.extract_function_arguments(), strict=True)
        self.writer.write(self.context, self.builder, [Value(kind, code) for kind, code in given])
        self.builder.position_at_end(self.entry_block)
        self.builder.branch(start)


@register_pass(mutates_CFG=True, analysis_only=False)
class PlainLowering(typed.NativeLowering):
    """Pass that finds the types of a kernel in plain language and writes its code."""

    _name = "plain_lowering"

    @property
    def lowering_class(self) -> type:
        """Its writer."""
        return PlainLower

    def run_pass(self, state: Any) -> bool:
        """Write a kernel, or leave it to the passes of the next pipeline."""
        code, state.cr = state.func_id.func.__code__, None
        if code in _open:  # it calls itself
            return False
        _open.add(code)
        try:
            self._write(state)
        except (NumbaError, NotImplementedError):
            return False
        finally:
            _open.remove(code)
        return bool(typed.NoPythonBackend().run_pass(state))

    def _write(self, state: Any) -> None:
        names = state.func_id.arg_names
        state.typemap = {f"arg.{name}": kind for name, kind in zip(names, state.args, strict=True)}
        state.func_ir = SimpleNamespace(
            func_id=state.func_id, arg_names=names, blocks={0: None}, generator_info=None, loc=unknown_loc
        )
        state.calltypes = {}
        super().run_pass(state)
        state.return_type = state.cr.fndesc.restype


def _passes(name: str, *made: Any) -> PassManager:
    passes = PassManager(name)
    for each in made:
        passes.add_pass(each)
    passes.finalize()
    return passes


class KernelLibrary(JITCodeLibrary):
    """Machine code of an entry point, optimised once with all that it calls.

    Numba optimises each function alone before, and the whole a first time: to find counts of references side by side,
    of which kernels have none. Without either the code is as fast and has the same bits.
    """

    LEVEL, LOOPS = 2, True
    _linking_libraries: list[Any]

    def finalize(self) -> None:
        """Link all functions that are called, each once, and make machine code of them."""
        reached = _reached(self._linking_libraries)
        self._linking_libraries = [OwnCode(one) if isinstance(one, LinkedLibrary) else one for one in reached]
        super().finalize()

    def _optimize_functions(self, module: Any) -> None:
        module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        passes = self._codegen._pass_builder(opt=self.LEVEL, loop_vectorize=self.LOOPS, slp_vectorize=False)
        passes.getModulePassManager().run(self._final_module, passes)


class KernelCompiler(Compiler):
    """Compiler of allocation-free functions of numbers, arrays, records and tuples."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        if _linked_only:
            self.link_only()
        else:
            self.write_to(KernelLibrary, "kernel")

    def write_to(self, kind: type[KernelLibrary], name: str) -> None:
        """Put the function's code into a library of its own."""
        self.state.library = kind(self.state.targetctx.codegen(), name)
        self.state.library.enable_object_caching()  # as numba does with one of its own

    def link_only(self) -> None:
        """Make no machine code of this function."""
        self.state.library = LinkedLibrary(self.state.targetctx.codegen(), "linked")

    def compile_extra(self, function: Any) -> Any:
        """The result without what only numba's reports on types show, a tenth of what a compiled machine holds."""
        result: Any = super().compile_extra(function)
        result.fndesc.typemap = result.fndesc.calltypes = None
        return result._replace(type_annotation=None)

    def define_pipelines(self) -> list[PassManager]:
        """The passes for plain kernels, then those for all."""
        return [_passes("plain", PlainLowering), _passes("kernel", *PASSES, KernelLowering, typed.NoPythonBackend)]


class SeldomLibrary(KernelLibrary):
    """Machine code that is short rather than fast."""

    LEVEL, LOOPS = 1, False


class SeldomCompiler(KernelCompiler):
    """Compiler of an entry point that runs once where others run a million times."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        if not _linked_only:
            self.write_to(SeldomLibrary, "seldom")


def _reached(libraries: Iterable[Any]) -> list[Any]:
    """Libraries with all that functions in them call."""
    found, waiting = dict.fromkeys(libraries), [*libraries]
    for library in waiting:
        new = [one for one in getattr(library, "called", ()) if one not in found]
        found.update(dict.fromkeys(new))
        waiting += new
    return list(found)


class LinkedLibrary(KernelLibrary):
    """Code of one function without an address: what numba does with one finds none.

    It is kept as bitcode, a tenth of the memory of modules that are ready to be linked. What it calls is linked with it
    into the entry point: code that held what it calls would be copied from caller to caller.
    """

    def __init__(self, codegen: Any, name: str) -> None:
        super().__init__(codegen, name)
        self.called: list[Any] = []

    def add_linking_library(self, library: JITCodeLibrary) -> None:
        """Note other code that is called, but for what is shared: that is called where it is."""
        if library.name != SHARED:
            library._ensure_finalized()
            self.called.append(library)

    def _optimize_final_module(self) -> None:
        """The entry point's library is optimised when this one is part of it."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.external:
                function.linkage = "linkonce_odr"
        self._bitcode = self._final_module.as_bitcode()
        self._final_module.close()
        self._finalized = True

    def own_module(self) -> Any:
        """The code of this function alone, in which further definitions of it may stand."""
        self._ensure_finalized()
        return parse_bitcode(self._bitcode)

    def _get_module_for_linking(self) -> Any:
        """The code with all that it calls, for a caller that links nothing else: a function that numba compiles."""
        module = self.own_module()
        for library in _reached(self.called):
            module.link_in(OwnCode(library)._get_module_for_linking(), preserve=True)
        return module

    def get_llvm_str(self) -> str:
        """The code as text, with all that it calls."""
        return str(self._get_module_for_linking())

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


class OwnCode:
    """Code of one function, for a caller that links each function that is called."""

    def __init__(self, library: Any) -> None:
        self._reload_init = library._reload_init
        self._get_module_for_linking = getattr(library, "own_module", library._get_module_for_linking)


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
        self.write_to(KernelLibrary, SHARED)
        self.state.targetctx.mangler = _lasting_name


def _lasting_name(name: str, arguments: Any, **_: Any) -> str:
    """Symbol of a function: its name, and its types as a hash, since numba numbers records as they come."""
    return str(mangle(f"{name}_{sha256(str(arguments).encode()).hexdigest()[:12]}", ()))
