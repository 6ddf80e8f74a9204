"""The derivative of a smoothed picture along its rows, row by row: what `prefilter` counts and writes.

Every product and sum is a single one, in a fixed order: a picture is filtered alike on every machine, which OpenCV's
filters, fused here and not there, do not promise. A row stays in the processor's nearest memory until it is done.
"""

from __future__ import annotations

import numpy as np

from flysim.compute.compiled import compiled, either, inlined, kernel
from flysim.compute.vectors import add

TAPS = 3  # on each side of a pixel, that are added up in one go; kernels have a multiple of it
COLOURS = 3
ROWS = 24  # that a thread takes together
MAGIC = np.float32(12582912.0)  # 1.5 * 2^23: the last place of what lies about it is 1, so that adding it rounds
LOW, HIGH, HALF, ONCE = (np.float32(number) for number in (0.0, 255.0, 0.5, 1.0))


def _smoothed_by_pixel(out, middle, w, a, b, w1, c, d, w2, e, f, w3):
    """Fills `out` with a weighted sum of rows: the middle one, and pairs above and below it."""
    for x in range(len(out)):
        # Bytes are added as whole numbers, so that half as many are made floats; exact either way.
        one, two, three = np.int32(a[x] + b[x]), np.int32(c[x] + d[x]), np.int32(e[x] + f[x])
        out[x] = w * np.float32(middle[x]) + w1 * np.float32(one) + w2 * np.float32(two) + w3 * np.float32(three)


def _sloped_by_pixel(out, start, a, b, w1, c, d, w2, e, f, w3):
    """Fills `out` with `start` and weighted differences of rows, the second of each pair less the first."""
    for x in range(len(out)):
        out[x] = start[x] + w1 * (b[x] - a[x]) + w2 * (d[x] - c[x]) + w3 * (f[x] - e[x])


def _sloped_bytes_by_pixel(out, start, a, b, w1, c, d, w2, e, f, w3):
    """As `_sloped_by_pixel`, to the nearest bytes; halves go to the even one."""
    for x in range(len(out)):
        value = start[x] + w1 * (b[x] - a[x]) + w2 * (d[x] - c[x]) + w3 * (f[x] - e[x])
        out[x] = np.uint8(np.int32((min(max(value, LOW), HIGH) + MAGIC) - MAGIC))


# The same in numpy, for who compiles nothing: pixel by pixel, Python would take a minute for a picture.
def _smoothed_by_row(out, middle, w, a, b, w1, c, d, w2, e, f, w3):
    m, a, b, c, d, e, f = (row.astype(np.float32) for row in (middle, a, b, c, d, e, f))
    out[:] = w * m + w1 * (a + b) + w2 * (c + d) + w3 * (e + f)


def _sloped_by_row(out, start, a, b, w1, c, d, w2, e, f, w3):
    out[:] = start + w1 * (b - a) + w2 * (d - c) + w3 * (f - e)


def _sloped_bytes_by_row(out, start, a, b, w1, c, d, w2, e, f, w3):
    out[:] = (np.clip(start + w1 * (b - a) + w2 * (d - c) + w3 * (f - e), LOW, HIGH) + MAGIC) - MAGIC


_smoothed = either(_smoothed_by_pixel, _smoothed_by_row)
_sloped = either(_sloped_by_pixel, _sloped_by_row)
_sloped_bytes = either(_sloped_bytes_by_pixel, _sloped_bytes_by_row)


@compiled
def smoothed(picture, y, rows, columns, across, lines):
    """A row of the smoothed picture, with its pixels beyond the border: one of `lines`.

    Args:
        picture: `[H, 3 W]` uint8.
        y: the row.
        rows, columns: where what lies up to n pixels beyond the border is read: `[H + 2 n]` rows, and `[2 n]` columns,
            those left of the picture first.
        across: `[2 n + 1]` float32, n a multiple of TAPS.
        lines: `[5, 3 (W + 2 n)]` float32 to work in.
    """
    n, wide = len(across) // 2, picture.shape[1]
    pad, at = COLOURS * n, y + n
    line = lines[0]
    _smoothed(
        line[pad : pad + wide], picture[y], across[n],
        picture[rows[at - 1]], picture[rows[at + 1]], across[n + 1],
        picture[rows[at - 2]], picture[rows[at + 2]], across[n + 2],
        picture[rows[at - 3]], picture[rows[at + 3]], across[n + 3],
    )  # fmt: skip
    for k in range(TAPS + 1, n + 1, TAPS):
        # Never the same memory to read and to write: the compiler would do one number after the other.
        before, line = line, lines[1 - k % 2]
        _smoothed(
            line[pad : pad + wide], before[pad : pad + wide], ONCE,
            picture[rows[at - k]], picture[rows[at + k]], across[n + k],
            picture[rows[at - k - 1]], picture[rows[at + k + 1]], across[n + k + 1],
            picture[rows[at - k - 2]], picture[rows[at + k + 2]], across[n + k + 2],
        )  # fmt: skip
    for k in range(n):
        for colour in range(COLOURS):
            line[COLOURS * k + colour] = line[pad + COLOURS * columns[k] + colour]
            line[pad + wide + COLOURS * k + colour] = line[pad + COLOURS * columns[n + k] + colour]
    return line


@compiled
def sloped(line, along, start, lines):
    """`start` and the weighted differences of a smoothed row, but for the outermost TAPS, in one of `lines`."""
    n, wide, found = len(along) // 2, len(start), start
    for k in range(1, n - TAPS + 1, TAPS):
        before, found = found, lines[2 + k % 2, :wide]
        _sloped(
            found, before,
            beside(line, n, -k, wide), beside(line, n, k, wide), along[n + k],
            beside(line, n, -k - 1, wide), beside(line, n, k + 1, wide), along[n + k + 1],
            beside(line, n, -k - 2, wide), beside(line, n, k + 2, wide), along[n + k + 2],
        )  # fmt: skip
    return found


@inlined
def beside(line, n, k, wide):
    """A smoothed row as it is `k` pixels further right."""
    first = COLOURS * (n + k)
    return line[first : first + wide]


@kernel
def derive(lane, counters, pictures, found, alongs, rows, columns, across, start, scratch):
    """Fills `found` with the derivatives along the rows of smoothed pictures and `start`, to the nearest byte.

    A lane takes ROWS of a picture and comes for the next.

    Args:
        lane: which of the threads this is.
        counters: `[1]` int64, how often rows were taken.
        pictures, found: `[H, 3 W]` uint8 each, one size for all, as many of both.
        alongs: `[2 n + 1]` float32 for each, the derivative's kernel: what is on the right less what is on the left.
        rows, columns, across: of `smoothed`.
        start: `[3 W]` float32 that is added to each row.
        scratch: for each lane the `lines` of `smoothed`.
    """
    high, wide = pictures[0].shape
    each, n, lines = (high + ROWS - 1) // ROWS, len(across) // 2, scratch[lane]
    while True:
        block = add(counters, 0, 1)
        if block >= len(pictures) * each:
            return
        k, first = block // each, block % each * ROWS
        along = alongs[k]
        for y in range(first, min(first + ROWS, high)):
            line = smoothed(pictures[k], y, rows, columns, across, lines)
            _sloped_bytes(
                found[k][y], sloped(line, along, start, lines),
                beside(line, n, 2 - n, wide), beside(line, n, n - 2, wide), along[2 * n - 2],
                beside(line, n, 1 - n, wide), beside(line, n, n - 1, wide), along[2 * n - 1],
                beside(line, n, -n, wide), beside(line, n, n, wide), along[2 * n],
            )  # fmt: skip


@kernel
def count_slopes(picture, tops, high, edge, along, rows, columns, across, start, lines, counts):
    """Adds to `counts` how often each whole number is the absolute derivative, in bands of a picture.

    Args:
        picture: `[H, 3 W]` uint8.
        tops: `[B]` first rows of the bands. Each is filtered as a picture of its own.
        high: rows of a band.
        edge: of those, how many above and below are not counted.
        along, rows, columns, across, start: of `derive`, for a band.
        lines: of `smoothed`.
        counts: what it has no place for counts for its last.
    """
    n, wide, most = len(along) // 2, picture.shape[1], len(counts) - 1
    slopes = lines[4, :wide]
    for top in tops:
        band = picture[top : top + high]
        for y in range(edge, high - edge):
            line = smoothed(band, y, rows, columns, across, lines)
            _sloped(
                slopes, sloped(line, along, start, lines),
                beside(line, n, 2 - n, wide), beside(line, n, n - 2, wide), along[2 * n - 2],
                beside(line, n, 1 - n, wide), beside(line, n, n - 1, wide), along[2 * n - 1],
                beside(line, n, -n, wide), beside(line, n, n, wide), along[2 * n],
            )  # fmt: skip
            for x in range(wide):
                counts[min(int(abs(slopes[x]) + HALF), most)] += 1


@kernel
def count_mask(picture, tops, high, colour, counts):
    """Adds to `counts` how often each number is the absolute answer to Immerkaer's mask, in bands of a picture."""
    wide = picture.shape[1]
    for top in tops:
        for y in range(top + 1, top + high - 1):
            north, here, south = picture[y - 1], picture[y], picture[y + 1]
            one = np.int64(north[colour]) - 2 * np.int64(here[colour]) + np.int64(south[colour])
            x = colour + COLOURS
            two = np.int64(north[x]) - 2 * np.int64(here[x]) + np.int64(south[x])
            for x in range(colour + 2 * COLOURS, wide, COLOURS):
                three = np.int64(north[x]) - 2 * np.int64(here[x]) + np.int64(south[x])
                counts[abs(one - 2 * two + three)] += 1
                one, two = two, three
