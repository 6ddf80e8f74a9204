"""Random numbers by counter: a fly's draws depend on (seed, generation, slot) alone, so threads change nothing.

Whole numbers, sums and quotients alone: no logarithm or cosine, which differ from one machine's library to another's.
"""

from __future__ import annotations

import numpy as np

from flysim.compute.compiled import compiled, inlined

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
MIX_2 = np.uint64(0x94D049BB133111EB)
S30, S27, S31, S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
S8, S32, S48 = np.uint64(8), np.uint64(32), np.uint64(48)
LOW = np.uint64(0xFFFFFFFF)
EVEN_BYTES, ONES = np.uint64(0x00FF00FF00FF00FF), np.uint64(0x0001000100010001)
UNIT = 2.0**-53
# Of a sum of eight bytes, each of which is any with the same chance.
MEAN, DEVIATION = 8 * 127.5, (8 * (256**2 - 1) / 12) ** 0.5
MOST_SLASH = 16.0  # a heavy-tailed step is at most so many times a Gaussian one


@compiled
def mix(x: np.uint64) -> np.uint64:
    """The finaliser of splitmix64 (Steele, Lea and Flood, 2014): every bit of x moves every bit out."""
    x = (x ^ (x >> S30)) * MIX_1
    x = (x ^ (x >> S27)) * MIX_2
    return x ^ (x >> S31)


@inlined
def stream(seed: np.uint64, generation: int, slot: int) -> np.uint64:
    """The start of a slot's own stream in a generation."""
    return mix(mix(seed + GOLDEN * np.uint64(generation + 1)) + GOLDEN * np.uint64(slot + 1))


@compiled
def word(state: np.uint64, draw: int) -> np.uint64:
    """The stream's number `draw`, 64 bits of it."""
    return mix(state + GOLDEN * np.uint64(draw + 1))


@compiled
def uniform(state: np.uint64, draw: int) -> float:
    """The stream's number `draw`, in [0, 1)."""
    return float(word(state, draw) >> S11) * UNIT


@inlined
def low(bits: np.uint64, count: int) -> np.int64:
    """A whole number in [0, count) from the lower half of a word."""
    return np.int64(((bits & LOW) * np.uint64(count)) >> S32)


@inlined
def high(bits: np.uint64, count: int) -> np.int64:
    """A whole number in [0, count) from the upper half of a word."""
    return np.int64(((bits >> S32) * np.uint64(count)) >> S32)


@compiled
def gaussian(state: np.uint64, draw: int, heavy: int) -> float:
    """A standard normal from the number `draw`: the sum of its eight bytes (Irwin and Hall), at most 4.9.

    If `heavy`, over a uniform one, from the number behind: the slash distribution, whose tails fall as 1 / x^2.
    """
    bits = word(state, draw)
    pairs = (bits & EVEN_BYTES) + ((bits >> S8) & EVEN_BYTES)
    normal = (float((pairs * ONES) >> S48) - MEAN) * (1.0 / DEVIATION)
    if heavy:
        over = uniform(state, draw + 1)
        normal /= over if over > 1.0 / MOST_SLASH else 1.0 / MOST_SLASH
    return normal
