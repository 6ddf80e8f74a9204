"""Random numbers by counter: a fly's draws depend on (seed, generation, slot) alone, so threads change nothing.

Whole numbers, sums and quotients alone: no logarithm or cosine, which differ from one machine's library to another's.
"""

from __future__ import annotations

import numpy as np

from flysim.flies.compiled import compiled, inlined

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
MIX_2 = np.uint64(0x94D049BB133111EB)
S30, S27, S31, S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
LOW, S16, S32, S48 = np.uint64(0xFFFF), np.uint64(16), np.uint64(32), np.uint64(48)
UNIT = 2.0**-53
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
def uniform(state: np.uint64, draw: int) -> float:
    """The stream's number `draw`, in [0, 1)."""
    return float(mix(state + GOLDEN * np.uint64(draw + 1)) >> S11) * UNIT


@compiled
def gaussian(state: np.uint64, draw: int, heavy: int) -> float:
    """A standard normal from the draws `draw` to `draw + 3`: twelve uniforms less their mean (Irwin and Hall).

    If `heavy`, over a uniform one: the slash distribution, whose tails fall as 1 / x^2.
    """
    total = np.uint64(0)
    for k in range(3):
        bits = mix(state + GOLDEN * np.uint64(draw + k + 1))
        total += (bits & LOW) + ((bits >> S16) & LOW) + ((bits >> S32) & LOW) + (bits >> S48)
    normal = (float(total) + 6.0) / 65536.0 - 6.0
    if heavy:
        over = uniform(state, draw + 3)
        normal /= over if over > 1.0 / MOST_SLASH else 1.0 / MOST_SLASH
    return normal
