"""Which points belong to what a robot would run into: above the floor, and not above its head."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array

ABOVE_FLOOR = 0.05  # [m] lower points are the floor
ABOVE_FLOOR_PER_M = 0.02  # [m/m] and more the farther off, as the errors of depth grow


def standing(base: Array, height: float) -> NDArray[np.bool_]:
    """`[n]` which of `[n, 3]` points [m, base_link] something of that height [m] would hit."""
    away = np.hypot(base[:, 0], base[:, 1])
    return (base[:, 2] > ABOVE_FLOOR + ABOVE_FLOOR_PER_M * away) & (base[:, 2] < height)
