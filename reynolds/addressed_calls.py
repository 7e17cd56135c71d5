"""Calls of compiled functions that are known by their address alone, from rows of numbers behind a record.

A kernel takes a record; behind it in memory lie rows of `WIDTH` integers, one for each function that the kernel calls,
and the records of these functions. A row begins with the function's address and with the place of its record, in bytes
from the start of the kernel's own. The function takes what the kernel gives it and its record. Machine code at an
address does not tell its types: each call states those of the function by a sample of its arguments.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.errors import TypingError
from numba.core.types.containers import UniTuple
from numba.core.types.misc import unliteral
from numba.extending import intrinsic

WIDTH = 9
"""Integers in a row."""
ADDRESS, RECORD, SHAPE, SLOT, STATE, OWN, DOF, JOURNAL, FILM = range(WIDTH)
"""Columns of a row: address, place of the record, and the numbers by which a call of an effect differs."""
_BYTE, _INTEGER = ir.IntType(8).as_pointer(), ir.IntType(64)


def _bytes_behind(builder: Any, record: Any, distance: Any) -> Any:
    return builder.gep(builder.bitcast(record, _BYTE), [distance])


def _number(builder: Any, kind: Any, record: Any, call: Any, column: Any) -> Any:
    place = builder.add(builder.mul(call, _INTEGER(WIDTH)), column)
    distance = builder.add(_INTEGER(kind.size), builder.mul(place, _INTEGER(8)))
    return builder.load(builder.bitcast(_bytes_behind(builder, record, distance), _INTEGER.as_pointer()))


@intrinsic
def entry(typing, P, call, column):
    """Integer in a column of a row."""

    def generate(context, builder, signature, args):
        return _number(builder, P, *args)

    return types.int64(P, types.int64, types.int64), generate


def _answer(result: Any) -> Any:
    """Intrinsic that calls the function of a row with a tuple of arguments and its record, for a type of result.

    Raises TypingError where the arguments are not of the types of the sample.
    """

    @intrinsic
    def answer(typing, P, call, sample, given):
        taken, got = ([unliteral(kind) for kind in values.types] for values in (sample, given))
        if got != taken:
            raise TypingError(
                f"call by address: the function takes {taken}, and is given {got}; change the port's lines"
            )
        kinds = [*got, P]

        def generate(context, builder, signature, args):
            record, call, _, values = args
            kind = context.call_conv.get_function_type(result, kinds)
            address = _number(builder, P, record, call, _INTEGER(ADDRESS))
            own = _bytes_behind(builder, record, _number(builder, P, record, call, _INTEGER(RECORD)))
            values = [*cgutils.unpack_tuple(builder, values), builder.bitcast(own, record.type)]
            function = builder.inttoptr(address, kind.as_pointer())
            return context.call_conv.call_function(builder, function, result, kinds, values)[1]

        return result(P, types.int64, sample, given), generate

    return answer


answer_0, answer_1 = _answer(types.none), _answer(types.float64)
answer_2, answer_3, answer_6 = (_answer(UniTuple(types.float64, count)) for count in (2, 3, 6))
