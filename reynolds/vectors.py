"""Dense products and sums in eight vector lanes, added in the same order on every processor.

Without reassociation a compiler may not vectorise a sum; here the eight partial sums are part of the definition,
written as LLVM vectors. A processor with shorter vectors takes several of them and finds the same bits. The Python
bodies define what is computed and run when compilation is switched off.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import cgutils, config, types
from numba.extending import intrinsic

from reynolds.jit import inlined

LANES = 8
"""Numbers of 64 bits in a vector."""
_DOUBLE = ir.DoubleType()


def _vector_at(builder: Any, data: Any, index: Any, lanes: int) -> Any:
    """Pointer to `lanes` doubles from data[index]."""
    return builder.bitcast(builder.gep(data, [index]), ir.VectorType(_DOUBLE, lanes).as_pointer())


def _splat(builder: Any, value: Any, lanes: int) -> Any:
    return _spread(builder, value, ir.VectorType(_DOUBLE, lanes))


def _spread(builder: Any, value: Any, vector: Any) -> Any:
    """Vector of a type whose elements are all one value."""
    lanes = vector.count
    one = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
    mask = ir.Constant(ir.VectorType(ir.IntType(32), lanes), [0] * lanes)
    return builder.shuffle_vector(one, ir.Constant(vector, ir.Undefined), mask)


def _data(context: Any, builder: Any, array_type: Any, array: Any) -> Any:
    return context.make_array(array_type)(context, builder, array).data


def _zero(lanes: int) -> Any:
    return ir.Constant(ir.VectorType(_DOUBLE, lanes), [0.0] * lanes)


def _sum_of_lanes(builder: Any, lanes: Any) -> Any:
    parts = [builder.extract_element(lanes, ir.Constant(ir.IntType(32), i)) for i in range(LANES)]
    while len(parts) > 1:
        half = len(parts) // 2
        parts = [builder.fadd(parts[i], parts[i + half]) for i in range(half)]
    return parts[0]


@intrinsic
def _dot(typing, w, x, y, n):
    def generate(context, builder, signature, args):
        data = _data(context, builder, signature.args[0], args[0])
        total = cgutils.alloca_once_value(builder, _zero(LANES))
        step = ir.Constant(args[3].type, LANES)
        with cgutils.for_range_slice(builder, ir.Constant(args[3].type, 0), args[3], step) as (k, _):
            a = builder.load(_vector_at(builder, data, builder.add(args[1], k), LANES), align=8)
            b = builder.load(_vector_at(builder, data, builder.add(args[2], k), LANES), align=8)
            builder.store(builder.fadd(builder.load(total), builder.fmul(a, b)), total)
        return _sum_of_lanes(builder, builder.load(total))

    return types.float64(w, types.intp, types.intp, types.intp), generate


@intrinsic
def _two_dots(typing, w, x, y, z, n):
    def generate(context, builder, signature, args):
        data = _data(context, builder, signature.args[0], args[0])
        totals = [cgutils.alloca_once_value(builder, _zero(LANES)) for _ in range(2)]
        step = ir.Constant(args[4].type, LANES)
        with cgutils.for_range_slice(builder, ir.Constant(args[4].type, 0), args[4], step) as (k, _):
            a = builder.load(_vector_at(builder, data, builder.add(args[1], k), LANES), align=8)
            for total, other in zip(totals, args[2:4], strict=True):
                b = builder.load(_vector_at(builder, data, builder.add(other, k), LANES), align=8)
                builder.store(builder.fadd(builder.load(total), builder.fmul(a, b)), total)
        sums = [_sum_of_lanes(builder, builder.load(total)) for total in totals]
        return context.make_tuple(builder, signature.return_type, sums)

    return types.UniTuple(types.float64, 2)(w, *[types.intp] * 4), generate


@intrinsic
def wide_vectors(typing):
    """Let the loops of the very function that calls this fill 512-bit vectors where the processor has them; same bits.

    Compilers take half of that by default, which slowed the clock of older processors less.
    """

    def generate(context, builder, signature, args):
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')  # llvmlite's own `add` knows no text
        return context.get_dummy_value()

    return types.none(), generate


def _block_product(lanes: int, columns: int) -> Any:
    """Intrinsic y = B x or y = y - B x for `lanes` rows and n columns (a multiple of `columns`) at distance `lead`."""

    @intrinsic
    def product(typing, w, block, lead, x, y, n, keep):
        def generate(context, builder, signature, args):
            data = _data(context, builder, signature.args[0], args[0])
            block, lead, x, y, n, keep = args[1:]
            sums = [cgutils.alloca_once_value(builder, _zero(lanes)) for _ in range(columns)]
            step = ir.Constant(n.type, columns)
            with cgutils.for_range_slice(builder, ir.Constant(n.type, 0), n, step) as (k, _):
                for i, part in enumerate(sums):
                    m = builder.add(k, ir.Constant(n.type, i))
                    column = _vector_at(builder, data, builder.add(block, builder.mul(m, lead)), lanes)
                    value = _splat(builder, builder.load(builder.gep(data, [builder.add(x, m)])), lanes)
                    product = builder.fmul(builder.load(column, align=8), value)
                    builder.store(builder.fadd(builder.load(part), product), part)
            total = builder.load(sums[0])
            for part in sums[1:]:
                total = builder.fadd(total, builder.load(part))
            target = _vector_at(builder, data, y, lanes)
            difference = builder.fsub(builder.load(target, align=8), total)
            builder.store(builder.select(keep, difference, total), target, align=8)
            return context.get_dummy_value()

        integer = types.intp
        return types.none(w, integer, integer, integer, integer, integer, types.boolean), generate

    return product


_rows_of_8, _rows_of_4 = _block_product(8, 2), _block_product(4, 2)


def _column_products(lanes: int) -> Any:
    """Intrinsic: products of a block of `lanes` rows and columns, kept in registers, with several vectors.

    Each y is B x, or y - B x with `keep`, added as `_block_product` adds it.
    """

    @intrinsic
    def products(typing, w, block, x, far_x, y, far_y, count, keep):
        def generate(context, builder, signature, args):
            data = _data(context, builder, signature.args[0], args[0])
            block, x, far_x, y, far_y, count, keep = args[1:]
            places = [ir.Constant(block.type, m) for m in range(lanes)]
            lead = ir.Constant(block.type, lanes)
            starts = [builder.add(block, builder.mul(m, lead)) for m in places]
            columns = [builder.load(_vector_at(builder, data, start, lanes), align=8) for start in starts]
            with cgutils.for_range(builder, count, intp=count.type) as loop:
                begin = builder.add(x, builder.mul(loop.index, far_x))
                sums = [_zero(lanes), _zero(lanes)]
                for m, column in enumerate(columns):
                    value = builder.load(builder.gep(data, [builder.add(begin, places[m])]))
                    sums[m % 2] = builder.fadd(sums[m % 2], builder.fmul(column, _splat(builder, value, lanes)))
                total = builder.fadd(*sums)
                target = _vector_at(builder, data, builder.add(y, builder.mul(loop.index, far_y)), lanes)
                difference = builder.fsub(builder.load(target, align=8), total)
                builder.store(builder.select(keep, difference, total), target, align=8)
            return context.get_dummy_value()

        integer = types.intp
        return types.none(w, *[integer] * 6, types.boolean), generate

    def plain(w: Any, block: int, x: int, far_x: int, y: int, far_y: int, count: int, keep: bool) -> None:
        for c in range(count):
            _rows_plain(lanes)(w, block, lanes, x + c * far_x, y + c * far_y, lanes, keep)

    return plain if config.DISABLE_JIT else products


_columns_of_8, _columns_of_4 = _column_products(8), _column_products(4)


def _tridiagonal(lanes: int) -> Any:
    """Intrinsic: block of `lanes` rows and columns with a diagonal and those below and above it, by the row."""

    @intrinsic
    def tridiagonal(typing, w, block, below, diagonal, above):
        def generate(context, builder, signature, args):
            data = _data(context, builder, signature.args[0], args[0])
            parts = [builder.load(_vector_at(builder, data, at, lanes), align=8) for at in args[2:]]
            bits = ir.VectorType(ir.IntType(1), lanes)
            for c in range(lanes):
                column = _zero(lanes)
                for row, part in zip((c + 1, c, c - 1), parts, strict=True):
                    column = builder.select(ir.Constant(bits, [int(k == row) for k in range(lanes)]), part, column)
                at = builder.add(args[1], ir.Constant(args[1].type, c * lanes))
                builder.store(column, _vector_at(builder, data, at, lanes), align=8)
            return context.get_dummy_value()

        return types.none(w, *[types.intp] * 4), generate

    def plain(w: Any, block: int, below: int, diagonal: int, above: int) -> None:
        part = w[block : block + lanes * lanes].reshape(lanes, lanes)
        part[:] = 0.0
        for c in range(lanes):
            for row, at in ((c + 1, below), (c, diagonal), (c - 1, above)):
                if 0 <= row < lanes:
                    part[c, row] = w[at + row]

    return plain if config.DISABLE_JIT else tridiagonal


_tridiagonal_8, _tridiagonal_4 = _tridiagonal(8), _tridiagonal(4)


def _less_scaled(lanes: int) -> Any:
    """Intrinsic B = B - T A F for blocks of `lanes` rows and columns, with T and F diagonal."""

    @intrinsic
    def less(typing, w, block, t, a, f):
        def generate(context, builder, signature, args):
            data = _data(context, builder, signature.args[0], args[0])
            block, t, a, f = args[1:]
            rows = builder.load(_vector_at(builder, data, t, lanes), align=8)
            for c in range(lanes):
                column = ir.Constant(block.type, c * lanes)
                target = _vector_at(builder, data, builder.add(block, column), lanes)
                part = builder.load(_vector_at(builder, data, builder.add(a, column), lanes), align=8)
                factor = builder.load(builder.gep(data, [builder.add(f, ir.Constant(f.type, c))]))
                product = builder.fmul(builder.fmul(rows, part), _splat(builder, factor, lanes))
                builder.store(builder.fsub(builder.load(target, align=8), product), target, align=8)
            return context.get_dummy_value()

        return types.none(w, *[types.intp] * 4), generate

    def plain(w: Any, block: int, t: int, a: int, f: int) -> None:
        part, other = (w[o : o + lanes * lanes].reshape(lanes, lanes) for o in (block, a))
        part -= w[t : t + lanes] * other * w[f : f + lanes, None]

    return plain if config.DISABLE_JIT else less


_less_scaled_8, _less_scaled_4 = _less_scaled(8), _less_scaled(4)


def _inverses(lanes: int) -> Any:
    """Intrinsic: inverses, in place and side by side, of two blocks of `lanes` rows, which stay in registers."""

    def generate(context, builder, signature, args):
        data = _data(context, builder, signature.args[0], args[0])
        places = [
            [
                _vector_at(builder, data, builder.add(block, ir.Constant(block.type, c * lanes)), lanes)
                for c in range(lanes)
            ]
            for block in args[1:]
        ]
        blocks = [[builder.load(place, align=8) for place in one] for one in places]
        integers = ir.VectorType(ir.IntType(32), lanes)
        for c in range(lanes):
            lane = ir.Constant(integers, [c] * lanes)
            own_lane = ir.Constant(ir.VectorType(ir.IntType(1), lanes), [int(k == c) for k in range(lanes)])
            for block in blocks:
                own = block[c]
                pivot = builder.fdiv(
                    ir.Constant(_DOUBLE, 1.0), builder.extract_element(own, ir.Constant(ir.IntType(32), c))
                )
                pivots = _splat(builder, pivot, lanes)
                for b in range(lanes):
                    if b != c:
                        spread = builder.shuffle_vector(block[b], ir.Constant(own.type, ir.Undefined), lane)
                        factor = builder.fmul(spread, pivots)
                        block[b] = builder.select(own_lane, factor, builder.fsub(block[b], builder.fmul(own, factor)))
                block[c] = builder.select(own_lane, pivots, builder.fmul(own, builder.fneg(pivots)))
        for one, block in zip(places, blocks, strict=True):
            for place, column in zip(one, block, strict=True):
                builder.store(column, place, align=8)
        return context.get_dummy_value()

    @intrinsic
    def inverses(typing, w, a, b):
        return types.none(w, types.intp, types.intp), generate

    def plain(w: Any, *blocks: int) -> None:
        for block in blocks:
            columns = w[block : block + lanes * lanes].reshape(lanes, lanes)
            for c in range(lanes):
                pivot = 1.0 / columns[c, c]
                own = columns[c].copy()
                for b in range(lanes):
                    if b != c:
                        factor = columns[b, c] * pivot
                        columns[b] -= own * factor
                        columns[b, c] = factor
                columns[c] = own * -pivot
                columns[c, c] = pivot

    return plain if config.DISABLE_JIT else inverses


_invert_8, _invert_4 = _inverses(8), _inverses(4)


def _any_above(lanes: int) -> Any:
    """Intrinsic: whether the size of one of `lanes` values from x is above a limit."""

    @intrinsic
    def above(typing, w, x, limit):
        def generate(context, builder, signature, args):
            data = _data(context, builder, signature.args[0], args[0])
            values = builder.load(_vector_at(builder, data, args[1], lanes), align=8)
            limits = [_splat(builder, value, lanes) for value in (args[2], builder.fneg(args[2]))]
            large = [builder.fcmp_ordered(sign, values, limit) for sign, limit in zip("><", limits, strict=True)]
            found = builder.bitcast(builder.or_(*large), ir.IntType(lanes))
            return builder.icmp_unsigned("!=", found, ir.Constant(found.type, 0))

        return types.boolean(w, types.intp, types.float64), generate

    def plain(w: Any, x: int, limit: float) -> bool:
        return bool((abs(w[x : x + lanes]) > limit).any())

    return plain if config.DISABLE_JIT else above


_above_8, _above_4 = _any_above(8), _any_above(4)


def _elementwise(lanes: int, operands: int, value: Callable[..., Any], plain: Callable[..., Any]) -> Any:
    """Intrinsic y = f(a, b, ...) for `lanes` values: all are read before one is written, in whatever order they lie."""

    def generate(context, builder, signature, args):
        data = _data(context, builder, signature.args[0], args[0])
        read = [builder.load(_vector_at(builder, data, at, lanes), align=8) for at in args[2:]]
        builder.store(value(builder, *read), _vector_at(builder, data, args[1], lanes), align=8)
        return context.get_dummy_value()

    def signature(w, count):
        return types.none(w, *[types.intp] * count)

    @intrinsic
    def one(typing, w, y, a):
        return signature(w, 2), generate

    @intrinsic
    def two(typing, w, y, a, b):
        return signature(w, 3), generate

    @intrinsic
    def three(typing, w, y, a, b, c):
        return signature(w, 4), generate

    def on_slices(w: Any, y: int, *offsets: int) -> None:
        w[y : y + lanes] = plain(*(w[a : a + lanes].copy() for a in offsets))

    return on_slices if config.DISABLE_JIT else (one, two, three)[operands - 1]


_copy_8, _copy_4 = (_elementwise(k, 1, lambda b, x: x, lambda x: x) for k in (8, 4))
_times_8, _times_4 = (_elementwise(k, 2, lambda b, x, y: b.fmul(x, y), lambda x, y: x * y) for k in (8, 4))
_less_product_8, _less_product_4 = (
    _elementwise(k, 3, lambda b, x, y, z: b.fsub(x, b.fmul(y, z)), lambda x, y, z: x - y * z) for k in (8, 4)
)


def _clear(lanes: int) -> Any:
    """Intrinsic y = y - f x for `lanes` values, or f x without `keep`, but `one` in lane c: one write of the whole."""

    @intrinsic
    def clear(typing, w, y, x, factor, one, c, keep):
        def generate(context, builder, signature, args):
            data = _data(context, builder, signature.args[0], args[0])
            y, x, factor, one, c, keep = args[1:]
            numbers = ir.VectorType(c.type, lanes)
            lane = builder.icmp_signed("==", _spread(builder, c, numbers), ir.Constant(numbers, list(range(lanes))))
            target = _vector_at(builder, data, y, lanes)
            product = builder.fmul(
                builder.load(_vector_at(builder, data, x, lanes), align=8), _splat(builder, factor, lanes)
            )
            rest = builder.select(keep, builder.fsub(builder.load(target, align=8), product), product)
            builder.store(builder.select(lane, _splat(builder, one, lanes), rest), target, align=8)
            return context.get_dummy_value()

        return types.none(w, types.intp, types.intp, types.float64, types.float64, types.intp, types.boolean), generate

    def plain(w: Any, y: int, x: int, factor: float, one: float, c: int, keep: bool) -> None:
        product = w[x : x + lanes] * factor
        w[y : y + lanes] = w[y : y + lanes] - product if keep else product
        if 0 <= c < lanes:
            w[y + c] = one

    return plain if config.DISABLE_JIT else clear


_clear_8, _clear_4 = _clear(8), _clear(4)


def _less_complex(lanes: int, gather: bool) -> Any:
    """Intrinsic y = y - a x for complex numbers in `lanes`, real parts before imaginary ones, at places of a pattern.

    For each f of a range j is place[columns[f]], and x stands at 2 f lanes of `factors`, y and a in w. One a serves all
    y at j; with `gather` all a at j serve one y.
    """

    @intrinsic
    def less(typing, w, one, place, columns, first, last, factors):
        def generate(context, builder, signature, args):
            data, places, numbers, of = (_data(context, builder, signature.args[k], args[k]) for k in (0, 2, 3, 6))
            one, first, last = args[1], args[4], args[5]
            size = ir.Constant(one.type, lanes)

            def at(offset: Any, of: Any = data) -> list[Any]:
                return [_vector_at(builder, of, start, lanes) for start in (offset, builder.add(offset, size))]

            def load(offset: Any, of: Any = data) -> list[Any]:
                return [builder.load(vector, align=8) for vector in at(offset, of)]

            def left(y: list[Any], a: list[Any], x: list[Any]) -> list[Any]:
                real = builder.fsub(builder.fmul(a[0], x[0]), builder.fmul(a[1], x[1]))
                imag = builder.fadd(builder.fmul(a[0], x[1]), builder.fmul(a[1], x[0]))
                return [builder.fsub(y[0], real), builder.fsub(y[1], imag)]

            def store(values: list[Any], offset: Any) -> None:
                for value, vector in zip(values, at(offset), strict=True):
                    builder.store(value, vector, align=8)

            fixed, sums = load(one), [cgutils.alloca_once(builder, ir.VectorType(_DOUBLE, lanes)) for _ in range(2)]
            for value, total in zip(fixed if gather else [], sums, strict=False):
                builder.store(value, total)
            with cgutils.for_range_slice(builder, first, last, ir.Constant(one.type, 1)) as (f, _):
                j = builder.load(builder.gep(places, [builder.load(builder.gep(numbers, [f]))]))
                x = load(builder.mul(f, ir.Constant(one.type, 2 * lanes)), of)
                if gather:
                    for value, total in zip(left([builder.load(s) for s in sums], load(j), x), sums, strict=True):
                        builder.store(value, total)
                else:
                    store(left(load(j), fixed, x), j)
            if gather:
                store([builder.load(total) for total in sums], one)
            return context.get_dummy_value()

        return types.none(w, types.intp, place, columns, types.intp, types.intp, factors), generate

    def plain(w: Any, one: int, place: Any, columns: Any, first: int, last: int, factors: Any) -> None:
        def value(offset: int, of: Any = w) -> Any:
            return of[offset : offset + lanes] + 1j * of[offset + lanes : offset + 2 * lanes]

        for f in range(first, last):
            j = int(place[columns[f]])
            y, a = (one, j) if gather else (j, one)
            found = value(y) - value(a) * value(2 * lanes * f, factors)
            w[y : y + lanes], w[y + lanes : y + 2 * lanes] = found.real, found.imag

    return plain if config.DISABLE_JIT else less


_less_complex_8, _less_complex_sum_8 = _less_complex(8, False), _less_complex(8, True)


def _dot_plain(w: Any, x: int, y: int, n: int) -> float:
    parts = [sum((float(w[x + k] * w[y + k]) for k in range(lane, n, LANES)), 0.0) for lane in range(LANES)]
    while len(parts) > 1:
        half = len(parts) // 2
        parts = [parts[i] + parts[i + half] for i in range(half)]
    return parts[0]


def _two_dots_plain(w: Any, x: int, y: int, z: int, n: int) -> tuple[float, float]:
    return _dot_plain(w, x, y, n), _dot_plain(w, x, z, n)


def _rows_plain(lanes: int) -> Any:
    def product(w: Any, block: int, lead: int, x: int, y: int, n: int, keep: bool) -> None:
        sums = []
        for r in range(lanes):
            even = sum((w[block + m * lead + r] * w[x + m] for m in range(0, n, 2)), 0.0)
            odd = sum((w[block + m * lead + r] * w[x + m] for m in range(1, n, 2)), 0.0)
            sums.append(even + odd)
        for r in range(lanes):
            w[y + r] = w[y + r] - sums[r] if keep else sums[r]

    return product


def _nothing() -> None:
    pass


if config.DISABLE_JIT:
    _dot, _rows_of_8, _rows_of_4 = _dot_plain, _rows_plain(8), _rows_plain(4)
    _two_dots, wide_vectors = _two_dots_plain, _nothing


@inlined
def dot(w, x, y, n):
    """Sum of x_k y_k over n values, n a multiple of 8, in eight partial sums."""
    return _dot(w, x, y, n)


@inlined
def two_dots(w, x, y, z, n):
    """Sums of x_k y_k and x_k z_k, each as `dot` adds it, in the time of one: an addition waits for the last."""
    return _two_dots(w, x, y, z, n)


@inlined
def multiply(w, block, x, y, n, keep):
    """y = B x, or y = y - B x with `keep`, for the column-major n x n block; x and y must not overlap."""
    done = 0
    if n % 2 == 0:
        for r in range(0, n - 7, 8):
            _rows_of_8(w, block + r, n, x, y + r, n, keep)
            done = r + 8
        for r in range(done, n - 3, 4):
            _rows_of_4(w, block + r, n, x, y + r, n, keep)
            done = r + 4
    for r in range(done, n):
        a = 0.0
        for m in range(n):
            a += w[block + m * n + r] * w[x + m]
        w[y + r] = w[y + r] - a if keep else a


@inlined
def multiply_columns(w, block, x, far_x, y, far_y, n, count, keep):
    """`multiply` for `count` vectors, at distances far_x and far_y."""
    if count > 1 and n == 8:
        _columns_of_8(w, block, x, far_x, y, far_y, count, keep)
    elif count > 1 and n == 4:
        _columns_of_4(w, block, x, far_x, y, far_y, count, keep)
    else:
        for c in range(count):
            multiply(w, block, x + c * far_x, y + c * far_y, n, keep)


@inlined
def tridiagonal(w, block, below, diagonal, above, n):
    """Fill the n x n block with a diagonal and those below and above it, by the row."""
    if n == 8:
        _tridiagonal_8(w, block, below, diagonal, above)
    elif n == 4:
        _tridiagonal_4(w, block, below, diagonal, above)
    else:
        for e in range(n * n):
            w[block + e] = 0.0
        for a in range(n):
            w[block + a * n + a] = w[diagonal + a]
            if a > 0:
                w[block + (a - 1) * n + a] = w[below + a]
            if a < n - 1:
                w[block + (a + 1) * n + a] = w[above + a]


@inlined
def less_scaled(w, block, t, a, f, n):
    """B = B - T A F for the n x n blocks at offsets block and a, with the diagonal T and F at t and f."""
    if n == 8:
        _less_scaled_8(w, block, t, a, f)
    elif n == 4:
        _less_scaled_4(w, block, t, a, f)
    else:
        for c in range(n):
            for r in range(n):
                w[block + c * n + r] -= w[t + r] * w[a + c * n + r] * w[f + c]


@inlined
def invert_two(w, a, b, n):
    """Invert the n x n blocks at offsets a and b in place, by Gauss-Jordan without pivoting, side by side."""
    if n == 8:
        _invert_8(w, a, b)
    elif n == 4:
        _invert_4(w, a, b)
    else:
        for c in range(n):
            clear_column(w, a, n, c)
            clear_column(w, b, n, c)


@inlined
def clear_column(w, block, n, c):
    """Column c of Gauss-Jordan's inversion; a column is written whole, since it is read whole in the next turn."""
    own = block + c * n
    pivot = 1.0 / w[own + c]
    for b in range(n):
        if b != c:
            column = block + b * n
            factor = w[column + c] * pivot
            clear(w, column, own, factor, factor, c, n, True)
    clear(w, own, own, -pivot, pivot, c, n, False)


@inlined
def exceed(w, x, n, limit):
    """Whether one of n values from x is larger than the limit, whatever its sign."""
    found = False
    done = 0
    for k in range(0, n - 7, 8):
        found = found or _above_8(w, x + k, limit)
        done = k + 8
    for k in range(done, n - 3, 4):
        found = found or _above_4(w, x + k, limit)
        done = k + 4
    for k in range(done, n):
        found = found or abs(w[x + k]) > limit
    return found


@inlined
def copy(w, y, a, n):
    """y = a for n values."""
    done = 0
    for k in range(0, n - 7, 8):
        _copy_8(w, y + k, a + k)
        done = k + 8
    for k in range(done, n - 3, 4):
        _copy_4(w, y + k, a + k)
        done = k + 4
    for k in range(done, n):
        w[y + k] = w[a + k]


@inlined
def clear(w, y, x, factor, one, c, n, keep):
    """y = y - f x, or f x without `keep`, for n values, of which the c-th becomes `one`."""
    done = 0
    for k in range(0, n - 7, 8):
        _clear_8(w, y + k, x + k, factor, one, c - k, keep)
        done = k + 8
    for k in range(done, n - 3, 4):
        _clear_4(w, y + k, x + k, factor, one, c - k, keep)
        done = k + 4
    for k in range(done, n):
        product = w[x + k] * factor
        rest = w[y + k] - product if keep else product
        w[y + k] = one if k == c else rest


@inlined
def times(w, y, a, b, n):
    """y = a b for n values."""
    done = 0
    for k in range(0, n - 7, 8):
        _times_8(w, y + k, a + k, b + k)
        done = k + 8
    for k in range(done, n - 3, 4):
        _times_4(w, y + k, a + k, b + k)
        done = k + 4
    for k in range(done, n):
        w[y + k] = w[a + k] * w[b + k]


@inlined
def less_product(w, y, a, b, c, n):
    """y = a - b c for n values."""
    done = 0
    for k in range(0, n - 7, 8):
        _less_product_8(w, y + k, a + k, b + k, c + k)
        done = k + 8
    for k in range(done, n - 3, 4):
        _less_product_4(w, y + k, a + k, b + k, c + k)
        done = k + 4
    for k in range(done, n):
        w[y + k] = w[a + k] - w[b + k] * w[c + k]


@inlined
def less_complex_products(w, a, place, columns, first, last, factors):
    """y = y - a x for eight complex numbers at once: x of the places of a row, y at place[column] of each."""
    _less_complex_8(w, a, place, columns, first, last, factors)


@inlined
def less_complex_sum(w, y, place, columns, first, last, factors):
    """y = y - sum a x for eight complex numbers at once: x of the places of a row, a at place[column] of each."""
    _less_complex_sum_8(w, y, place, columns, first, last, factors)


@inlined
def add_columns(w, y, first_column, distance, factors, columns, start, n):
    """y_k += sum_c factor_c column_c[k] for n values from `start`; four columns a sweep."""
    done = 0
    for c in range(0, columns - 3, 4):
        a, b, d, e = w[factors + c], w[factors + c + 1], w[factors + c + 2], w[factors + c + 3]
        o = first_column + c * distance
        for k in range(start, start + n):
            w[y + k] += (a * w[o + k] + b * w[o + distance + k]) + (
                d * w[o + 2 * distance + k] + e * w[o + 3 * distance + k]
            )
        done = c + 4
    for c in range(done, columns - 1, 2):
        a, b = w[factors + c], w[factors + c + 1]
        o = first_column + c * distance
        for k in range(start, start + n):
            w[y + k] += a * w[o + k] + b * w[o + distance + k]
        done = c + 2
    for c in range(done, columns):
        a = w[factors + c]
        o = first_column + c * distance
        for k in range(start, start + n):
            w[y + k] += a * w[o + k]
