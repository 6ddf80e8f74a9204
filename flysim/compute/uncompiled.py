"""The innermost loops of `vectors` in plain Python: what NUMBA_DISABLE_JIT=1 runs, to step through a kernel or test it.

They give the same whole numbers as the compiled ones, some hundred times slower.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import wraps
from threading import Lock
from typing import Any

import numpy as np

_MEMORY = (ctypes.c_ubyte * (1 << 47)).from_address(0)  # all that a process can address
_counting = Lock()


def plain_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """A kernel as Python runs it: a plain structured array's elements have no attributes, a recarray's have."""

    @wraps(function)
    def called(*arguments: Any) -> Any:
        with np.errstate(all="ignore"):  # which each thread has its own of
            return function(*map(_with_fields, arguments))

    return called


def _with_fields(value: Any) -> Any:
    """A structured array, or those in a tuple, with its fields as attributes."""
    if isinstance(value, tuple):
        fields = map(_with_fields, value)
        return type(value)(*fields) if hasattr(value, "_fields") else tuple(fields)
    if isinstance(value, np.ndarray) and value.dtype.names is not None:
        return value.view(np.recarray)
    return value


def byte(address: int, index: int) -> int:
    """The byte at `address + index`."""
    return _MEMORY[int(address) + int(index)]


def fetch(address: int, index: int) -> None:
    """Nothing: memory comes when it is read."""


def add(counters: Any, index: int, number: int) -> int:
    """Adds to a counter that several threads share, and returns what it was."""
    with _counting:
        before = int(counters[index])
        counters[index] = before + number
    return before


def row(left: int, right: int, at: int, base: int, x: int, step: int, n: int) -> int:
    """Sum of (256 e)^2 over `n` pixels of a window's row; arguments as the compiled one's."""
    total = 0
    for k in range(n):
        place = x + k * step
        pixel, share = 3 * (base + (place >> 16)), (place >> 8) & 255
        for colour in range(3):
            one, other = byte(right, pixel + colour), byte(right, pixel + 3 + colour)
            e = ((byte(left, at + 3 * k + colour) - one) << 8) - share * (other - one)
            total += e * e
    return total


def sobel(image: int, at: int, north: int, south: int, west: int, east: int) -> int:
    """Sum over the colours of a squared slope along the row; arguments as the compiled one's."""
    total = 0
    for k in range(at, at + 3):
        slope = sum(
            n * (byte(image, k + row + east) - byte(image, k + row + west))
            for row, n in ((north, 1), (0, 2), (south, 1))
        )
        total += slope * slope
    return total


def slopes(
    left: int, right: int, at: int, base: int, wide: int, right_wide: int, u: float, ui: float, uj: float,
    half: int, stride: int,
) -> tuple[int, ...]:  # fmt: skip
    """Sums of s s to s d j over the grey pixels of a window; arguments as the compiled one's."""
    sums = [0] * 9
    for j in range(-half, half + 1, stride):
        row = at + wide * j
        for i in range(-half, half + 1):
            place = int((u + uj * j - ui * half) * 65536.0) + (i + half) * int(ui * 65536.0)
            first, share = base + right_wide * j + (place >> 16), (place >> 8) & 255
            here = row + i + half
            before, pixel, after, behind = (byte(right, first + beside) for beside in (-1, 0, 1, 2))
            west, east = after - before, behind - pixel
            s = ((west + byte(left, here + 1) - byte(left, here - 1)) << 8) + share * (east - west)
            d = ((byte(left, here) - pixel) << 8) - share * (after - pixel)
            si, sj = s * i, s * j
            for which, product in enumerate((s * s, s * si, s * sj, si * si, si * sj, sj * sj, s * d, si * d, sj * d)):
                sums[which] += product
    return tuple(sums)


def differences(
    left: int, right: int, at: int, start: int, wide: int, right_wide: int, side: int, n: int, found: Any
) -> None:
    """Fills `found[:n]` with sums of squared grey differences; arguments as the compiled one's."""
    for k in range(n):
        total = 0
        for j in range(side):
            for i in range(side):
                e = byte(left, at + j * wide + i) - byte(right, start + k + j * right_wide + i)
                total += e * e
        found[k] = total
