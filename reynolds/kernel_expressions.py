"""Expressions of kernels in plain language: from Python's syntax to LLVM's code, with the type of each value.

The type of an expression follows from those of its parts, so code is written while the syntax is read. What is not
plain arithmetic (`min`, `math.exp`, an intrinsic, another kernel) numba resolves and writes, so it means what it means
to numba. An expression that the writer cannot write raises UnwrittenError.

An index below zero counts from the array's end, as in Python and in kernels that numba compiles. One that literals show
to be below zero is refused where no condition stands before it.
"""

from __future__ import annotations

import ast
import builtins
import operator
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any, NamedTuple, NoReturn

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.errors import NumbaError
from numba.core.types.containers import BaseTuple
from numba.core.types.misc import Optional

FLOATS: dict[Any, Any] = {
    operator.add: lambda b, x, y: b.fadd(x, y),
    operator.sub: lambda b, x, y: b.fsub(x, y),
    operator.mul: lambda b, x, y: b.fmul(x, y),
    operator.truediv: lambda b, x, y: b.fdiv(x, y),
    operator.ne: lambda b, x, y: b.fcmp_unordered("!=", x, y),
}
"""Instructions for two float64; kernels divide by zero as IEEE 754 does."""
INTEGERS: dict[Any, Any] = {
    operator.add: lambda b, x, y: b.add(x, y, flags=["nsw"]),
    operator.sub: lambda b, x, y: b.sub(x, y, flags=["nsw"]),
    operator.mul: lambda b, x, y: b.mul(x, y, flags=["nsw"]),
    operator.ne: lambda b, x, y: b.icmp_signed("!=", x, y),
}
"""Instructions for two int64."""
for _function, _sign in ((operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">="),
                         (operator.eq, "==")):  # fmt: skip
    FLOATS[_function] = lambda b, x, y, sign=_sign: b.fcmp_ordered(sign, x, y)
    INTEGERS[_function] = lambda b, x, y, sign=_sign: b.icmp_signed(sign, x, y)
OPERATORS: dict[type[ast.AST], Any] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow, ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_, ast.BitXor: operator.xor, ast.LShift: operator.lshift, ast.RShift: operator.rshift,
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Eq: operator.eq,
    ast.NotEq: operator.ne, ast.USub: operator.neg, ast.UAdd: operator.pos, ast.Invert: operator.invert,
}  # fmt: skip
COMPARISONS = {operator.lt, operator.le, operator.gt, operator.ge, operator.eq, operator.ne}
INTEGER = ir.IntType(64)
SMALL = 64
"""Largest power that is written as products."""
ALWAYS = object()
"""Condition of what runs in every call."""
NAMELESS = object()
"""Meaning of an expression that is no name of a constant, function or module."""


class UnwrittenError(NumbaError):
    """A kernel has an expression or statement that the writer cannot write; the text names it."""


class Value(NamedTuple):
    """A value in the code that is written."""

    kind: Any
    code: Any
    least: int | None = None
    """The smallest value of an integer, where literals tell it and no condition may have raised it since."""


def operator_of(sign: ast.AST) -> Any:
    """Function of an operator; raises UnwrittenError for those that numbers do not have."""
    function = OPERATORS.get(type(sign))
    if function is None:
        raise UnwrittenError(f"the operator {type(sign).__name__}")
    return function


class ExpressionWriter:
    """Writer of the expressions of a kernel, where the builder `b` stands."""

    context: Any
    typing: Any
    b: Any

    def __init__(self, function: Callable[..., Any], local: set[str], refuse: Callable[[str, int], NoReturn]) -> None:
        self.function, self.local, self.refuse = function, local, refuse
        self.kinds: dict[str, Any] = {}
        """Types of variables."""
        self.given: dict[str, Value] = {}
        """Arguments that stay as they are."""
        self.places: dict[str, Any] = {}
        """Addresses of variables."""
        self.least: dict[str, int | None] = {}
        self.since: dict[str, object] = {}
        """Conditions under which variables were assigned."""
        self.condition: object = ALWAYS
        """The condition under which the code runs that is written."""

    @contextmanager
    def under_condition(self, condition: object = None) -> Iterator[None]:
        """Write code that runs under a condition, by default one of its own."""
        before, self.condition = self.condition, condition or object()
        yield
        self.condition = before

    def written(self, node: ast.AST) -> Any:
        """The method that writes a kind of node."""
        found = getattr(self, f"_{type(node).__name__}", None)
        if found is None:
            raise UnwrittenError(f"{self.function.__name__}: {type(node).__name__}")
        return found

    def joined(self, one: Any, other: Any) -> Any:
        """Type that has the values of both."""
        kind = one if one == other else self.typing.unify_types(one, other)
        if kind is None or isinstance(kind, Optional):
            raise UnwrittenError(f"{self.function.__name__}: {one} and {other} in one variable")
        return kind

    def cast(self, value: Value, kind: Any) -> Any:
        if value.kind == kind:
            return value.code
        return self.context.cast(self.b, value.code, value.kind, kind)

    def name(self, name: str) -> Value:
        if name in self.given:
            return self.given[name]
        if name in self.places:
            least = self.least[name] if self.since[name] is self.condition else None
            return Value(self.kinds[name], self.b.load(self.places[name]), least)
        raise UnwrittenError(f"{self.function.__name__}: {name} is used before it is set")

    def value(self, node: ast.expr) -> Value:
        value: Value = self.written(node)(node)
        return value

    def meaning(self, node: ast.AST) -> Any:
        """The constant, function or module that an expression names, or NAMELESS."""
        if isinstance(node, ast.Name) and node.id not in self.local:
            names = self.function.__globals__
            return names[node.id] if node.id in names else getattr(builtins, node.id, NAMELESS)
        owner = self.meaning(node.value) if isinstance(node, ast.Attribute) else NAMELESS
        return getattr(owner, node.attr, NAMELESS) if isinstance(owner, (ModuleType, tuple)) else NAMELESS  # type: ignore[attr-defined]

    def integer(self, value: int) -> Value:
        return Value(types.int64, INTEGER(value), value)

    def _constant(self, value: Any) -> Value:
        if isinstance(value, bool):
            return Value(types.boolean, ir.IntType(1)(value))
        if type(value) is int and abs(value) < 2**63:
            return self.integer(value)
        if isinstance(value, float):
            return Value(types.float64, ir.DoubleType()(float(value)))
        if isinstance(value, np.number):
            kind = self.typing.resolve_value_type(value)
            return Value(kind, self.context.get_constant_generic(self.b, kind, value))
        if not isinstance(value, tuple):
            raise UnwrittenError(f"a constant of {type(value).__name__}")
        return self._tuple([self._constant(one) for one in value])

    def _tuple(self, values: list[Value]) -> Value:
        kind = BaseTuple.from_types([value.kind for value in values])
        return Value(kind, self.context.make_tuple(self.b, kind, [value.code for value in values]))

    def _Constant(self, node: ast.Constant) -> Value:
        return self._constant(node.value)

    def _Tuple(self, node: ast.Tuple) -> Value:
        return self._tuple([self.value(element) for element in node.elts])

    def _Name(self, node: ast.Name) -> Value:
        meaning = self.meaning(node)
        return self.name(node.id) if meaning is NAMELESS else self._constant(meaning)

    def _Attribute(self, node: ast.Attribute) -> Value:
        meaning = self.meaning(node)
        if meaning is not NAMELESS:
            return self._constant(meaning)
        owner = self.value(node.value)
        kind = self.typing.resolve_getattr(owner.kind, node.attr)
        if kind is None or isinstance(kind, types.BoundFunction):
            raise UnwrittenError(f"{node.attr} of {owner.kind}")
        write = self.context.get_getattr(owner.kind, node.attr)
        return Value(kind, write(self.context, self.b, owner.kind, owner.code, node.attr))

    def _Subscript(self, node: ast.Subscript) -> Value:
        owner = self.value(node.value)
        if isinstance(owner.kind, BaseTuple):
            index = self.value(node.slice)
            if isinstance(index.code, ir.Constant) and index.kind == types.int64:
                k = index.code.constant
                if not 0 <= k < len(owner.kind):
                    raise UnwrittenError(f"element {k} of {owner.kind}")
                return self.item(owner, k)
            return self._call(operator.getitem, owner, index)
        if isinstance(node.slice, ast.Slice):
            return self._call(operator.getitem, owner, self._slice(node.slice))
        place = self.place(owner, node)
        if place is None:
            raise UnwrittenError(f"an element of {owner.kind}")
        return Value(owner.kind.dtype, self.b.load(place))

    def item(self, owner: Value, k: int) -> Value:
        return Value(owner.kind[k], self.b.extract_value(owner.code, k))

    def _slice(self, node: ast.Slice) -> Value:
        first, last = (self.value(n) if n else None for n in (node.lower, node.upper))
        if node.step is not None or any(v is not None and v.kind != types.int64 for v in (first, last)):
            raise UnwrittenError("a slice of other steps")
        made = self.context.make_helper(self.b, types.slice2_type)
        made.start, made.step = first.code if first else INTEGER(0), INTEGER(1)
        made.stop = last.code if last else INTEGER(2**63 - 1)
        return Value(types.slice2_type, made._getvalue())

    def place(self, owner: Value, node: ast.Subscript) -> Any:
        """Address of an element of a contiguous array of numbers; None for all else."""
        kind = owner.kind
        if not isinstance(kind, types.Array) or kind.layout != "C" or kind.dtype not in (types.float64, types.int64):
            return None
        indices = [self.value(n) for n in (node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice])]
        if len(indices) != kind.ndim or any(index.kind != types.int64 for index in indices) or not kind.aligned:
            return None
        bare = self.condition is not ALWAYS and not any(n.id in self.local for n in _names(node.slice))
        for index in indices:
            if index.least is not None and index.least < 0 and not bare:
                self.refuse(
                    f"takes {ast.unparse(node.value)}[{index.least}], an element from the end of the array; give an "
                    "index from its start",
                    node.lineno,
                )
        fields = self.context.data_model_manager[kind]
        shape = self.b.extract_value(owner.code, fields.get_field_position("shape"))
        codes = [self._from_start(index, self.b.extract_value(shape, k)) for k, index in enumerate(indices)]
        if kind.ndim == 1:
            return self.b.gep(self.b.extract_value(owner.code, fields.get_field_position("data")), codes)
        array = self.context.make_array(kind)(self.context, self.b, owner.code)
        return cgutils.get_item_pointer(self.context, self.b, kind, array, codes)

    def _from_start(self, index: Value, length: Any) -> Any:
        """An index counted from the start of an axis of this length, as numba does it."""
        if index.least is not None and index.least >= 0:
            return index.code
        below = self.b.icmp_signed("<", index.code, INTEGER(0))
        return self.b.select(below, self.b.add(index.code, length), index.code)

    def _BinOp(self, node: ast.BinOp) -> Value:
        left, right = self.value(node.left), self.value(node.right)
        if isinstance(node.op, ast.Pow):
            return self._power(left, right)
        return self.operate(operator_of(node.op), left, right)

    def operate(self, function: Any, left: Value, right: Value) -> Value:
        """Value of an operation on two values."""
        kinds = {left.kind, right.kind}
        if not kinds <= {types.int64, types.float64}:
            return self._call(function, left, right)
        whole = kinds == {types.int64} and function is not operator.truediv
        write = (INTEGERS if whole else FLOATS).get(function)
        if write is None:
            return self._call(function, left, right)
        kind = types.int64 if whole else types.float64
        code = write(self.b, self.cast(left, kind), self.cast(right, kind))
        least = None
        if left.least is not None and right.least is not None:
            if function is operator.add:
                least = left.least + right.least
            elif function is operator.sub and isinstance(right.code, ir.Constant):
                least = left.least - right.least
        return Value(types.boolean if function in COMPARISONS else kind, code, least if whole else None)

    def _power(self, base: Value, exponent: Value) -> Value:
        """A power; with a small literal as its exponent a product, in numba's order."""
        if exponent.kind != types.int64:
            return self._call(operator.pow, base, exponent)
        left = exponent.least if isinstance(exponent.code, ir.Constant) else None
        if left is None or not 0 < left <= SMALL or base.kind not in (types.int64, types.float64):
            raise UnwrittenError("a power of another exponent")
        whole = base.kind == types.int64
        result, factor = INTEGER(1) if whole else ir.DoubleType()(1.0), base.code
        while left:
            if left & 1:
                result = self.b.mul(result, factor) if whole else self.b.fmul(result, factor)
            factor = self.b.mul(factor, factor) if whole else self.b.fmul(factor, factor)
            left >>= 1
        return Value(base.kind, result)

    def _UnaryOp(self, node: ast.UnaryOp) -> Value:
        if isinstance(node.op, ast.Not):
            return Value(types.boolean, self.b.not_(self.truth(node.operand)))
        literal = node.operand.value if isinstance(node.operand, ast.Constant) else None
        if isinstance(node.op, ast.USub) and isinstance(literal, (int, float)):
            return self._constant(-literal)
        value = self.value(node.operand)
        if isinstance(node.op, ast.USub) and value.kind == types.float64:
            return Value(types.float64, self.b.fneg(value.code))
        return self._call(operator_of(node.op), value)

    def _Compare(self, node: ast.Compare) -> Value:
        if len(node.ops) > 1 and any(isinstance(n, ast.Call) for n in ast.walk(node)):
            raise UnwrittenError("calls in a chain of comparisons")
        values = [self.value(n) for n in (node.left, *node.comparators)]
        codes = []
        for sign, left, right in zip(node.ops, values[:-1], values[1:], strict=True):
            codes.append(self.cast(self.operate(operator_of(sign), left, right), types.boolean))
        result = codes[0]
        for code in codes[1:]:
            result = self.b.and_(result, code)
        return Value(types.boolean, result)

    def truth(self, node: ast.expr) -> Any:
        """Whether a condition holds, as one bit."""
        value = self.value(node)
        if value.kind == types.boolean:
            return value.code
        if value.kind not in (types.int64, types.float64):
            raise UnwrittenError(f"truth of {value.kind}")
        return self.operate(operator.ne, value, self.integer(0)).code

    def _BoolOp(self, node: ast.BoolOp) -> Value:
        end, decisive = self.b.append_basic_block(), isinstance(node.op, ast.Or)
        found = []
        for k, term in enumerate(node.values):
            with self.under_condition(None if k else self.condition):
                value = self.value(term)
            if value.kind != types.boolean:
                raise UnwrittenError("`and` or `or` of numbers")
            if k == len(node.values) - 1:
                found.append((value.code, self.b.block))
                self.b.branch(end)
                break
            found.append((ir.IntType(1)(decisive), self.b.block))
            following = self.b.append_basic_block()
            self.b.cbranch(value.code, *((end, following) if decisive else (following, end)))
            self.b.position_at_end(following)
        self.b.position_at_end(end)
        return Value(types.boolean, self._one_of(ir.IntType(1), found))

    def _one_of(self, kind: Any, found: list[tuple[Any, Any]]) -> Any:
        """The code that belongs to the block from which this one was entered."""
        result = self.b.phi(kind)
        for code, block in found:
            result.add_incoming(code, block)
        return result

    def _IfExp(self, node: ast.IfExp) -> Value:
        blocks = [self.b.append_basic_block() for _ in range(2)]
        self.b.cbranch(self.truth(node.test), *blocks)
        found = []
        for block, part in zip(blocks, (node.body, node.orelse), strict=True):
            self.b.position_at_end(block)
            with self.under_condition():
                found.append((self.value(part), self.b.block))
        kind, end = self.joined(*(value.kind for value, _ in found)), self.b.append_basic_block()
        codes = []
        for value, block in found:
            self.b.position_at_end(block)
            codes.append((self.cast(value, kind), block))
            self.b.branch(end)
        self.b.position_at_end(end)
        return Value(kind, self._one_of(self.context.get_value_type(kind), codes))

    def _Call(self, node: ast.Call) -> Value:
        callee = self.meaning(node.func)
        if node.keywords or callee is NAMELESS:
            raise UnwrittenError(f"a call of {ast.unparse(node.func)}")
        if callee is len and len(node.args) == 1 and isinstance(self.meaning(node.args[0]), tuple):
            return self.integer(len(self.meaning(node.args[0])))
        given = [self.value(argument) for argument in node.args]
        if callee in (int, float) and len(given) == 1 and given[0].kind in (types.int64, types.float64):
            kind = types.int64 if callee is int else types.float64
            return Value(kind, self.cast(given[0], kind))
        return self._call(callee, *given)

    def _call(self, callee: Any, *given: Value) -> Value:
        """Value of a function that numba resolves."""
        kind = _kind_of(self.typing, callee)
        if isinstance(kind, types.NumberClass) and len(given) == 1:
            return Value(kind.instance_type, self.cast(given[0], kind.instance_type))
        signature = kind.get_call_type(self.typing, tuple(value.kind for value in given), {})
        taken: tuple[Any, ...] = () if signature is None else signature.args
        folded = len(taken) == 1 and isinstance(taken[0], BaseTuple) and len(given) == len(taken[0]) != 1
        taken = tuple(taken[0]) if folded else taken  # any number of arguments
        if signature is None or len(taken) != len(given):
            raise UnwrittenError(f"{callee} of {[value.kind for value in given]}")
        codes = [self.cast(value, one) for value, one in zip(given, taken, strict=True)]
        if folded:
            codes = [self.context.make_tuple(self.b, signature.args[0], codes)]
        return Value(signature.return_type, self.context.get_function(kind, signature)(self.b, codes))


def _names(node: ast.AST) -> list[ast.Name]:
    return [n for n in ast.walk(node) if isinstance(n, ast.Name)]


def _kind_of(typing: Any, callee: Any) -> Any:
    """Numba's type of a function; raises UnwrittenError for what it cannot call."""
    try:
        kind = typing.resolve_value_type(callee)
    except (ValueError, TypeError) as error:
        raise UnwrittenError(str(error)) from None
    if not isinstance(kind, (types.Function, types.Dispatcher, types.NumberClass)):
        raise UnwrittenError(f"a call of {kind}")
    return kind
