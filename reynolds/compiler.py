"""Compilers of kernels, numba's without what kernels do not need, and the disk cache of what they make.

Most of numba's work on a kernel is Python's, and much of it is repeated or for nothing: it types every sum of two
floats anew, trying a dozen templates, looks for closures, generators and arrays to fuse, asks LLVM for the size of each
array's type and optimises the whole twice. Here the signatures of operators and the sizes of types are remembered, only
the passes that kernels need are made, and plain arithmetic and elements of vectors become code at once (`KernelLower`).
The results have the same bits. What would be wrong without a word is refused: `raise` and `assert`, since no kernel
reads the status of what it calls by address, and an index below a vector's start.

The disk cache is numba's, safe against killed and concurrent processes: numba numbers its data files in an index that
it writes first. Killed between the two, or with a second process at work, its index can name the machine code of
another signature. Here a file is named by the hash of what it was compiled for and written before the index names it.
An unreadable or unwritable file is not an error: the kernel is compiled again.
"""

from __future__ import annotations

import gc
import operator
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any, ClassVar, NoReturn, cast

from llvmlite.binding import Linkage, parse_bitcode
from numba.core import event, ir, typed_passes as typed, types, untyped_passes as untyped
from numba.core.base import BaseContext
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.errors import NumbaError
from numba.core.ir_utils import get_definition, guard
from numba.core.itanium_mangler import mangle
from numba.core.lowering import Lower
from numba.core.types.functions import BaseFunction
from numba.core.types.misc import unliteral

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
    for the one it compiles. Raises DataError for a kernel that `KernelLower` refuses.
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


FLOATS: dict[Any, Any] = {
    operator.add: lambda b, x, y: b.fadd(x, y),
    operator.sub: lambda b, x, y: b.fsub(x, y),
    operator.mul: lambda b, x, y: b.fmul(x, y),
    operator.truediv: lambda b, x, y: b.fdiv(x, y),
    operator.lt: lambda b, x, y: b.fcmp_ordered("<", x, y),
    operator.le: lambda b, x, y: b.fcmp_ordered("<=", x, y),
    operator.gt: lambda b, x, y: b.fcmp_ordered(">", x, y),
    operator.ge: lambda b, x, y: b.fcmp_ordered(">=", x, y),
    operator.eq: lambda b, x, y: b.fcmp_ordered("==", x, y),
    operator.ne: lambda b, x, y: b.fcmp_unordered("!=", x, y),
}
"""Instructions for two float64; kernels divide by zero as IEEE 754 does."""
INTEGERS: dict[Any, Any] = {
    operator.add: lambda b, x, y: b.add(x, y, flags=["nsw"]),
    operator.sub: lambda b, x, y: b.sub(x, y, flags=["nsw"]),
    operator.mul: lambda b, x, y: b.mul(x, y, flags=["nsw"]),
} | {
    function: lambda b, x, y, sign=sign: b.icmp_signed(sign, x, y)
    for function, sign in (
        (operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">="), (operator.eq, "=="),
        (operator.ne, "!="),
    )
}  # fmt: skip
"""Instructions for two int64."""


IN_PLACE = {
    operator.iadd: operator.add, operator.isub: operator.sub, operator.imul: operator.mul,
    operator.itruediv: operator.truediv,
}  # fmt: skip


SUMS = {operator.add: 1, operator.iadd: 1, operator.sub: -1, operator.isub: -1}
"""Sign of the second number in a sum or difference."""


class KernelLower(Lower):
    """Writer of LLVM's code: of plain arithmetic and of elements of vectors without numba's search for how.

    An index counts from a vector's start. Numba would test each one for being negative; here one whose literals show
    that it is, is refused, as are errors. Raises DataError, which `compiling` hands on.
    """

    def return_exception(self, exc_class: Any, exc_args: Any = None, loc: Any = None) -> NoReturn:
        """Refuse a kernel that raises."""
        name = getattr(exc_class, "__name__", "an error")
        self._refuse(f"can raise {name}, which no caller reads; give a number, and refuse values in `problems`")

    def return_dynamic_exception(self, exc_class: Any, exc_args: Any, nb_types: Any, loc: Any = None) -> NoReturn:
        """Refuse a kernel that raises with numbers of its own."""
        self.return_exception(exc_class)

    def _refuse(self, reason: str) -> NoReturn:
        """Raise this kernel's error, which `compiling` knows it by."""
        where = f"{Path(self.loc.filename).name}, line {self.loc.line}"
        _refusals.append(DataError(f"kernel {self.func_ir.func_id.func_name} ({where}): {reason}"))
        raise _refusals[-1]

    def _least(self, variable: Any) -> int | None:
        """The smallest value of an integer where literals tell it: of a number, of a loop's variable, of their sum."""
        kind, found = self.typeof(variable.name), self._meaning(variable)
        if isinstance(kind, types.IntegerLiteral):
            return int(kind.literal_value)
        if isinstance(found, ir.Var):
            return self._least(found)
        if self._op(found) in ("binop", "inplace_binop") and found.fn in SUMS:
            left, right = self._least(found.lhs), self._least(found.rhs)
            known = right is not None and (SUMS[found.fn] > 0 or isinstance(self.typeof(found.rhs.name), types.Literal))
            return left + SUMS[found.fn] * right if known and left is not None and right is not None else None
        for step in ("pair_first", "iternext", "getiter"):
            if self._op(found) != step:
                return None
            found = self._meaning(found.value)
        if self._op(found) != "call" or getattr(self.typeof(found.func.name), "typing_key", None) is not range:
            return None
        return 0 if len(found.args) == 1 else self._least(found.args[0]) if len(found.args) == 2 else None

    def _meaning(self, variable: Any) -> Any:
        """Definition of a variable; None where it has more than one."""
        found = guard(get_definition, self.func_ir, variable)
        return self._meaning(found.value) if self._op(found) == "cast" else found

    @staticmethod
    def _op(found: Any) -> str | None:
        return found.op if isinstance(found, ir.Expr) else None

    def lower_binop(self, resty: Any, expr: Any, op: Any) -> Any:
        """Value of an operation on two numbers."""
        signature = self.fndesc.calltypes[expr]
        kinds = tuple(signature.args)
        table = FLOATS if kinds == (types.float64,) * 2 else INTEGERS if kinds == (types.int64,) * 2 else {}
        instruction = table.get(IN_PLACE.get(op, op))
        if instruction is None:
            return super().lower_binop(resty, expr, op)
        values = [
            self.context.cast(self.builder, self.loadvar(side.name), self.typeof(side.name), kind)
            for side, kind in zip((expr.lhs, expr.rhs), kinds, strict=True)
        ]
        result = instruction(self.builder, *values)
        return self.context.cast(self.builder, result, signature.return_type, resty)

    def lower_getitem(self, resty: Any, expr: Any, value: Any, index: Any, signature: Any) -> Any:
        """An element of a vector, or of what else has elements."""
        place = self._place(value, index)
        if place is None:
            return super().lower_getitem(resty, expr, value, index, signature)
        return self.builder.load(place)

    def lower_setitem(self, target_var: Any, index_var: Any, value_var: Any, signature: Any) -> Any:
        """Write an element."""
        place = self._place(target_var, index_var)
        if place is None:
            return super().lower_setitem(target_var, index_var, value_var, signature)
        kind = self.typeof(target_var.name).dtype
        value = self.context.cast(self.builder, self.loadvar(value_var.name), self.typeof(value_var.name), kind)
        self.builder.store(value, place)
        return None

    def _place(self, array: Any, index: Any) -> Any:
        """Address of an element of a contiguous vector of numbers; None for all else."""
        kind, of_index = self.typeof(array.name), unliteral(self.typeof(index.name))
        if type(kind) is not types.Array or (kind.ndim, kind.layout, of_index) != (1, "C", types.int64):
            return None
        if kind.dtype not in (types.float64, types.int64) or not kind.aligned:
            return None
        least = self._least(index)
        if least is not None and least < 0:
            self._refuse(
                f"takes {array.name}[{least}]; an index counts from the start of the array and not from its end"
            )
        whole, at = self.loadvar(array.name), self.loadvar(index.name)
        data = self.context.data_model_manager[kind].get_field_position("data")
        return self.builder.gep(self.builder.extract_value(whole, data), [at])


@register_pass(mutates_CFG=True, analysis_only=False)
class KernelLowering(typed.NativeLowering):
    """Pass that writes LLVM's code."""

    _name = "kernel_lowering"

    @property
    def lowering_class(self) -> type:
        """Its writer."""
        return KernelLower


class KernelCompiler(Compiler):
    """Compiler of allocation-free functions of numbers, arrays, records and tuples."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        if _linked_only:
            self.link_only()

    def link_only(self) -> None:
        """Make no machine code of this function."""
        self.state.library = LinkedLibrary(self.state.targetctx.codegen(), "linked")

    def compile_extra(self, function: Any) -> Any:
        """The result without what only numba's reports on types show, a tenth of what a compiled machine holds."""
        result: Any = super().compile_extra(function)
        result.fndesc.typemap = result.fndesc.calltypes = None
        return result._replace(type_annotation=None)

    def define_pipelines(self) -> list[PassManager]:
        """The passes."""
        passes = PassManager("kernel")
        for each in (*PASSES, KernelLowering, typed.NoPythonBackend):
            passes.add_pass(each)
        passes.finalize()
        return [passes]


class SeldomLibrary(JITCodeLibrary):
    """Machine code that is short rather than fast."""

    def _optimize_final_module(self) -> None:
        passes = self._codegen._pass_builder(opt=1, loop_vectorize=False, slp_vectorize=False)
        passes.getModulePassManager().run(self._final_module, passes)


class SeldomCompiler(KernelCompiler):
    """Compiler of an entry point that runs once where others run a million times."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        if not _linked_only:
            self.state.library = SeldomLibrary(self.state.targetctx.codegen(), "seldom")
            self.state.library.enable_object_caching()


class LinkedLibrary(JITCodeLibrary):
    """Code without an address: what numba does with one finds none.

    It is kept as bitcode, a tenth of the memory of modules that are ready to be linked.
    """

    def add_linking_library(self, library: JITCodeLibrary) -> None:
        """Link other code, but for what is shared: that is called where it is."""
        if library.name != SHARED:
            super().add_linking_library(library)

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

    def _get_module_for_linking(self) -> Any:
        """The code, in which further definitions of its functions may stand."""
        self._ensure_finalized()
        return parse_bitcode(self._bitcode)

    def get_llvm_str(self) -> str:
        """The code as text."""
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


_places: dict[str, tuple[str, str, Any]] = {}
"""Module, function and types of each symbol of shared code that this process has."""


def _noted(result: Any) -> Any:
    """A compile result whose symbol is kept if its code is shared."""
    if result.library.name == SHARED:
        f = result.fndesc
        _places[f.mangled_name] = f.modname, f.qualname, f.argtypes
    return result


class _Results(CompileResultCacheImpl):
    """Cached form of a kernel: its code, and which shared code that calls."""

    _locator_classes: ClassVar = [c for c in CompileResultCacheImpl._locator_classes if "UserProvided" in c.__name__]
    """The folder that was given, and no other: numba's further ones are not looked at for who can write there."""

    def reduce(self, result: Any) -> Any:
        """Places of the shared code, and numba's own form of the result."""
        functions = _noted(result).library._final_module.functions
        return [_places[f.name] for f in functions if f.is_declaration and f.name in _places], super().reduce(result)

    def rebuild(self, context: Any, kept: Any) -> Any:
        """The result, after the shared code that it calls."""
        places, result = kept
        for module, name, arguments in places:
            getattr(sys.modules[module], name).compile(arguments)
        return _noted(super().rebuild(context, result))


class _Files(IndexDataCacheFile):
    """Index and data files of one kernel."""

    def save(self, key: Any, data: Any) -> None:
        """Keep the machine code of a key: types, processor, bytecode."""
        name = f"{self._index_name.removesuffix('.nbi')}.{sha256(repr(key).encode()).hexdigest()[:16]}.nbc"
        self._save_data(name, data)
        self._save_index(self._load_index() | {key: name})

    def load(self, key: Any) -> Any:
        """Machine code of a key; None if there is none that can be read."""
        with suppress(Exception):  # whatever unpickling a damaged file raises
            return super().load(key)

    def _load_index(self) -> dict[Any, str]:
        with suppress(Exception):
            return super()._load_index()
        return {}


class KernelCache(FunctionCache):
    """Cache of one kernel."""

    _impl_class = _Results

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _Files(self._cache_path, self._impl.filename_base, stamp)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code, if there is any, where the disk takes it."""
        with suppress(OSError):
            if not isinstance(data.library, LinkedLibrary):
                super().save_overload(sig, data)
