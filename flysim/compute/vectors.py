"""The innermost loops of the kernels, written for the processor's vector units: bytes, rows of windows, curves.

All samples are whole numbers: colours times 256, places in 1/65536 px. Sums of whole numbers do not depend on the
order in which a processor adds them, so a swarm is the same on every machine. Rows are taken in blocks; what a block
reads beyond a window is left out of its sums. It lies in the image, because a window's last row is not the image's.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.extending import intrinsic

from flysim.compute import uncompiled

_I8, _I16, _I32, _I64 = (ir.IntType(bits) for bits in (8, 16, 32, 64))
COLUMNS = 16  # of a curve that are taken together


def _vector(kind: Any, *numbers: int) -> Any:
    return ir.Constant(ir.VectorType(kind, len(numbers)), list(numbers))


def _load(builder: Any, kind: Any, *address: Any) -> Any:
    """What lies at the sum of the addresses, which need not be aligned."""
    place = address[0]
    for more in address[1:]:
        place = builder.add(place, more)
    return builder.load(builder.inttoptr(place, kind.as_pointer()), align=1)


def _spread(builder: Any, value: Any, lanes: int) -> Any:
    """A vector whose lanes all hold `value`."""
    undefined = ir.Constant(ir.VectorType(value.type, lanes), ir.Undefined)
    one = builder.insert_element(undefined, value, ir.Constant(_I32, 0))
    return builder.shuffle_vector(one, undefined, _vector(_I32, *[0] * lanes))


def _total(builder: Any, vector: Any) -> Any:
    """The sum of a vector's lanes, of which there are a power of two."""
    lanes = vector.type.count
    while lanes > 1:
        lanes //= 2
        upper = builder.shuffle_vector(vector, vector, _vector(_I32, *range(lanes, 2 * lanes)))
        vector = builder.add(builder.shuffle_vector(vector, vector, _vector(_I32, *range(lanes))), upper)
    return builder.extract_element(vector, ir.Constant(_I32, 0))


def _places(builder: Any, x: Any, step: Any, number: Any) -> Any:
    """The lower bits of x + step number [1/65536 px], for each lane of `number`: its share of a pixel is among them."""
    first, by = (_spread(builder, builder.trunc(value, _I32), number.type.count) for value in (x, step))
    return builder.add(first, builder.mul(by, number))


def _whole(number: int) -> Any:
    return ir.Constant(_I64, number)


def _byte(context: Any, address: Any, index: Any) -> Any:
    """The byte at `address + index`. The kernels see to it that both lie in an image; nothing else does."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.zext(_load(builder, _I8, *arguments), _I64)

    return types.int64(types.uint64, types.int64), generate


def _fetch(context: Any, address: Any, index: Any) -> Any:
    """Asks for the memory at `address + index` ahead of its use."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointer = builder.inttoptr(builder.add(*arguments), _I8.as_pointer())
        kind = ir.FunctionType(ir.VoidType(), [_I8.as_pointer(), _I32, _I32, _I32])
        ask = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
        builder.call(ask, [pointer, *(ir.Constant(_I32, number) for number in (0, 3, 1))])  # to read, to keep, data
        return context.get_dummy_value()

    return types.void(types.uint64, types.int64), generate


def _add(context: Any, counters: Any, index: Any, number: Any) -> Any:
    """Adds to a counter that several threads share, and returns what it was."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        counters, index, number = arguments
        data = context.make_array(signature.args[0])(context, builder, counters).data
        return builder.atomic_rmw("add", builder.gep(data, [index]), number, "seq_cst")

    return types.int64(counters, types.int64, types.int64), generate


def _row(context: Any, left: Any, right: Any, at: Any, base: Any, x: Any, step: Any, n: Any) -> Any:
    """Sum of (256 e)^2 over `n` pixels of a window's row, four pixels with their colours at once.

    The left pixels begin at byte `at`; the right ones at x, x + step, ... [1/65536 px] in the row whose first pixel is
    number `base`.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        left, right, at, base, x, step, n = arguments
        bytes_16, words_16 = ir.VectorType(_I8, 16), ir.VectorType(_I32, 16)
        total = cgutils.alloca_once_value(builder, _vector(_I64, *[0] * 8))
        with cgutils.for_range_slice(builder, _whole(0), n, _whole(4), _I64, inc=True) as (first, _):
            here = _load(builder, bytes_16, left, at, builder.mul(first, _whole(3)))
            # Three colours and nothing for each pixel.
            three = [lane + 3 * pixel if lane < 3 else 16 for pixel in range(4) for lane in range(4)]
            nothing = _vector(_I8, *[0] * 16)
            here = builder.zext(builder.shuffle_vector(here, nothing, _vector(_I32, *three)), words_16)
            pixels = ir.Constant(ir.VectorType(_I64, 4), ir.Undefined)
            place = builder.add(x, builder.mul(first, step))
            number = builder.add(_vector(_I32, *range(4)), _spread(builder, builder.trunc(first, _I32), 4))
            shares = builder.lshr(_places(builder, x, step, number), _vector(_I32, *[8] * 4))
            shares = builder.and_(shares, _vector(_I32, *[255] * 4))
            for k in range(4):
                number = builder.add(base, builder.ashr(place, _whole(16)))
                lane = ir.Constant(_I32, k)
                two = _load(builder, _I64, right, builder.mul(number, _whole(3)))  # this pixel and the next
                pixels = builder.insert_element(pixels, two, lane)
                place = builder.add(place, step)
            pairs = builder.bitcast(pixels, ir.VectorType(_I8, 32))
            one = [8 * pixel + lane for pixel in range(4) for lane in range(4)]
            other = [8 * pixel + lane + 3 for pixel in range(4) for lane in range(4)]
            one = builder.zext(builder.shuffle_vector(pairs, pairs, _vector(_I32, *one)), words_16)
            other = builder.zext(builder.shuffle_vector(pairs, pairs, _vector(_I32, *other)), words_16)
            each = [pixel for pixel in range(4) for _ in range(4)]
            f = builder.shuffle_vector(shares, shares, _vector(_I32, *each))
            e = builder.shl(builder.sub(here, one), _vector(_I32, *[8] * 16))
            e = builder.sub(e, builder.mul(f, builder.sub(other, one)))
            valid = builder.icmp_signed(
                "<", _vector(_I32, *each), _spread(builder, builder.trunc(builder.sub(n, first), _I32), 16)
            )
            colour = _vector(ir.IntType(1), *[lane < 3 for _ in range(4) for lane in range(4)])
            e = builder.select(builder.and_(valid, colour), e, _vector(_I32, *[0] * 16))
            # |256 e| is at most 65280: its square just fits 32 bits without a sign.
            squares = builder.bitcast(builder.mul(e, e), ir.VectorType(_I64, 8))
            low = builder.and_(squares, _vector(_I64, *[0xFFFFFFFF] * 8))
            high = builder.lshr(squares, _vector(_I64, *[32] * 8))
            builder.store(builder.add(builder.load(total), builder.add(low, high)), total)
        return _total(builder, builder.load(total))

    signature = types.int64(types.uint64, types.uint64, *[types.int64] * 5)
    return signature, generate


def _sobel(context: Any, image: Any, at: Any, north: Any, south: Any, west: Any, east: Any) -> Any:
    """Sum over the colours of the squared answer to Sobel's mask along the row of the pixel at byte `at`.

    The others are how many bytes away its neighbours begin. The pixel down and right must not be the image's last.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        image, at, north, south, west, east = arguments
        words = ir.VectorType(_I32, 4)

        def change(row: Any) -> Any:
            left, right = (
                builder.zext(_load(builder, ir.VectorType(_I8, 4), image, at, row, column), words)
                for column in (west, east)
            )
            return builder.sub(right, left)

        here = builder.shl(change(_whole(0)), _vector(_I32, 1, 1, 1, 1))
        found = builder.add(here, builder.add(change(north), change(south)))
        found = builder.mul(found, builder.mul(found, _vector(_I32, 1, 1, 1, 0)))  # a pixel has three colours
        return builder.sext(_total(builder, found), _I64)

    return types.int64(types.uint64, *[types.int64] * 5), generate


def _slopes(
    context: Any, left: Any, right: Any, at: Any, base: Any, wide: Any, right_wide: Any, u: Any, ui: Any, uj: Any,
    half: Any, stride: Any,
) -> Any:  # fmt: skip
    """Sums of s s, s s i, s s j, s s i i, s s i j, s s j j, s d, s d i, s d j over every `stride`-th row of a window.

    s is 1024 times the slope along the row, the mean of both images'; d is 256 times the difference, left less right;
    (i, j) counts grey pixels from the window's middle. The left row j begins at byte `at + wide j`, the right one at
    the column u + uj j - ui half of the row at byte `base + right_wide j`, and goes on in steps of ui [px].
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        left, right, at, base, wide, right_wide, u, ui, uj, half, stride = arguments
        words, longs = ir.VectorType(_I32, 8), ir.VectorType(_I64, 8)
        eight, low = _vector(_I32, *[8] * 8), _vector(_I32, *[255] * 8)
        sums = [cgutils.alloca_once_value(builder, _vector(_I64, *[0] * 8)) for _ in range(9)]
        n, one_px = builder.add(builder.shl(half, _whole(1)), _whole(1)), ir.Constant(ir.DoubleType(), 65536.0)
        back = builder.fmul(ui, builder.sitofp(half, ir.DoubleType()))
        step = builder.fptosi(builder.fmul(ui, one_px), _I64)
        with cgutils.for_range_slice(builder, _whole(0), n, stride, _I64, inc=True) as (number_of_row, _):
            j = builder.sub(number_of_row, half)
            one_row = builder.add(at, builder.mul(j, wide))
            other_row = builder.add(base, builder.mul(j, right_wide))
            x = builder.fadd(u, builder.fmul(uj, builder.sitofp(j, ir.DoubleType())))
            x = builder.fptosi(builder.fmul(builder.fsub(x, back), one_px), _I64)
            with cgutils.for_range_slice(builder, _whole(0), n, _whole(8), _I64, inc=True) as (first, _):

                def beside(pixels: int) -> Any:
                    found = _load(builder, ir.VectorType(_I8, 8), left, one_row, first, _whole(pixels))
                    return builder.zext(found, words)

                here, across = beside(0), builder.sub(beside(1), beside(-1))
                four = ir.Constant(words, ir.Undefined)
                place = builder.add(x, builder.mul(first, step))
                for k in range(8):
                    found = _load(builder, _I32, right, other_row, builder.ashr(place, _whole(16)), _whole(-1))
                    four = builder.insert_element(four, found, ir.Constant(_I32, k))
                    place = builder.add(place, step)
                before, pixel, after, behind = (
                    builder.and_(builder.lshr(four, _vector(_I32, *[shift] * 8)), low) for shift in (0, 8, 16, 24)
                )
                number = builder.add(_vector(_I32, *range(8)), _spread(builder, builder.trunc(first, _I32), 8))
                f = builder.and_(builder.lshr(_places(builder, x, step, number), eight), low)
                west, east = builder.sub(after, before), builder.sub(behind, pixel)
                s = builder.shl(builder.add(west, across), eight)
                s = builder.add(s, builder.mul(f, builder.sub(east, west)))
                right_value = builder.add(builder.shl(pixel, eight), builder.mul(f, builder.sub(after, pixel)))
                d = builder.sub(builder.shl(here, eight), right_value)
                count = _spread(builder, builder.trunc(n, _I32), 8)
                s = builder.select(builder.icmp_signed("<", number, count), s, _vector(_I32, *[0] * 8))
                si = builder.mul(s, builder.sub(number, _spread(builder, builder.trunc(half, _I32), 8)))
                sj = builder.mul(s, _spread(builder, builder.trunc(j, _I32), 8))
                s, si, sj, d = (builder.sext(value, longs) for value in (s, si, sj, d))
                pairs = (s, s), (s, si), (s, sj), (si, si), (si, sj), (sj, sj), (s, d), (si, d), (sj, d)
                for k, (one, other) in enumerate(pairs):
                    builder.store(builder.add(builder.load(sums[k]), builder.mul(one, other)), sums[k])
        found = [_total(builder, builder.load(one)) for one in sums]
        return context.make_tuple(builder, signature.return_type, found)

    signature = types.UniTuple(types.int64, 9)(
        types.uint64, types.uint64, *[types.int64] * 4, *[types.float64] * 3, *[types.int64] * 2
    )
    return signature, generate


def _differences(
    context: Any, left: Any, right: Any, at: Any, start: Any, wide: Any, right_wide: Any, side: Any, n: Any, found: Any
) -> Any:
    """Fills `found` with sums of squared grey differences of a window of `side` pixels at `n` right columns.

    The left window begins at byte `at`, the right ones at `start`, `start + 1`, ... `found` is float32 and has room
    for a multiple of COLUMNS.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        left, right, at, start, wide, right_wide, side, n, found = arguments
        words, floats_16 = ir.VectorType(_I32, COLUMNS), ir.VectorType(ir.FloatType(), COLUMNS)
        floats = context.make_array(signature.args[-1])(context, builder, found).data
        floats = builder.ptrtoint(floats, _I64)
        total = cgutils.alloca_once(builder, words)
        zero, one = _whole(0), _whole(1)
        with cgutils.for_range_slice(builder, zero, n, _whole(COLUMNS), _I64, inc=True) as (first, _):
            builder.store(_vector(_I32, *[0] * COLUMNS), total)
            with cgutils.for_range_slice(builder, zero, side, one, _I64, inc=True) as (j, _):
                one_row = builder.add(at, builder.mul(j, wide))
                other_row = builder.add(builder.add(start, first), builder.mul(j, right_wide))
                with cgutils.for_range_slice(builder, zero, side, one, _I64, inc=True) as (i, _):
                    here = _spread(builder, builder.zext(_load(builder, _I8, left, one_row, i), _I16), COLUMNS)
                    there = _load(builder, ir.VectorType(_I8, COLUMNS), right, other_row, i)
                    e = builder.sub(here, builder.zext(there, here.type))
                    square = builder.zext(builder.mul(e, e), words)  # 255^2 fits 16 bits without a sign
                    builder.store(builder.add(builder.load(total), square), total)
            values = builder.uitofp(builder.load(total), floats_16)
            place = builder.add(floats, builder.mul(first, _whole(4)))
            builder.store(values, builder.inttoptr(place, floats_16.as_pointer()), align=4)
        return context.get_dummy_value()

    signature = types.void(types.uint64, types.uint64, *[types.int64] * 6, found)
    return signature, generate


def _made(compiled: Any, plain: Any) -> Any:
    return plain if config.DISABLE_JIT else intrinsic(compiled)  # type: ignore[attr-defined]


byte: Any = _made(_byte, uncompiled.byte)
fetch: Any = _made(_fetch, uncompiled.fetch)
add: Any = _made(_add, uncompiled.add)
row: Any = _made(_row, uncompiled.row)
sobel: Any = _made(_sobel, uncompiled.sobel)
slopes: Any = _made(_slopes, uncompiled.slopes)
differences: Any = _made(_differences, uncompiled.differences)
