"""Random numbers by counter: a fly's draws depend on (seed, generation, slot) alone, so threads change nothing."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
MIX_2 = np.uint64(0x94D049BB133111EB)
S30, S27, S31, S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
UNIT = 2.0**-53


@njit(cache=True)
def mix(x: np.uint64) -> np.uint64:
    """The finaliser of splitmix64 (Steele, Lea and Flood, 2014): every bit of x moves every bit out."""
    x = (x ^ (x >> S30)) * MIX_1
    x = (x ^ (x >> S27)) * MIX_2
    return x ^ (x >> S31)


@njit(cache=True)
def stream(seed: np.uint64, generation: int, slot: int) -> np.uint64:
    """The start of a slot's own stream in a generation."""
    return mix(mix(seed + GOLDEN * np.uint64(generation + 1)) + GOLDEN * np.uint64(slot + 1))


@njit(cache=True)
def uniform(state: np.uint64, draw: int) -> float:
    """The stream's number `draw`, in [0, 1)."""
    return float(mix(state + GOLDEN * np.uint64(draw + 1)) >> S11) * UNIT


@njit(cache=True)
def gaussian(state: np.uint64, draw: int) -> float:
    """A standard normal from the draws `draw` and `draw + 1` (Box and Muller)."""
    return math.sqrt(-2.0 * math.log(1.0 - uniform(state, draw))) * math.cos(2.0 * math.pi * uniform(state, draw + 1))
