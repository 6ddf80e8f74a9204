"""The image divided in regions, and the share of the population each one gets."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

# What a region keeps of an equal share however plain it is: an obstacle can still appear there.
FLOOR_SHARE = 0.5


def grid(regions: int | tuple[int, int]) -> tuple[int, int]:
    """(rows, columns): 1 is the whole image, 2 are its left and right half, 4 its quadrants (paper, Table 1)."""
    return {1: (1, 1), 2: (1, 2), 4: (2, 2)}[regions] if isinstance(regions, int) else regions


def rectangles(width: int, height: int, regions: int | tuple[int, int]) -> NDArray[np.int32]:
    """`[R, 4]` half-open pixel rectangles (u0, u1, v0, v1), row by row."""
    rows, columns = grid(regions)
    us = [round(width * i / columns) for i in range(columns + 1)]
    vs = [round(height * j / rows) for j in range(rows + 1)]
    return np.array([(us[i], us[i + 1], vs[j], vs[j + 1]) for j in range(rows) for i in range(columns)], dtype=np.int32)


def equal_quotas(population: int, regions: int) -> NDArray[np.int64]:
    """`[R]` flies a region holds at the start: "the population is equally divided" (paper, section 4.1)."""
    return split(population, np.ones(regions))


def steered_quotas(population: int, grey: NDArray[np.uint8], rects: NDArray[np.int32]) -> NDArray[np.int64]:
    """`[R]` flies a region holds once its standard deviation is known (paper, section 4.1).

    The paper computes "the standard deviation of each region" and leaves its use open. Here it is that of the grey
    levels: where nothing contrasts no fly can settle. Half of an equal share is kept, the rest goes by deviation.
    """
    if len(rects) == 1:
        return np.array([population], np.int64)
    deviation = np.array([float(cv2.meanStdDev(grey[v0:v1, u0:u1])[1][0, 0]) for u0, u1, v0, v1 in rects])
    if deviation.sum() <= 0.0:
        return equal_quotas(population, len(rects))
    weights = FLOOR_SHARE / len(rects) + (1.0 - FLOOR_SHARE) * deviation / deviation.sum()
    return split(population, weights)


def split(total: int, weights: NDArray[np.float64]) -> NDArray[np.int64]:
    """Whole numbers in proportion to weights that sum to `total` exactly (largest remainders)."""
    whole = float(np.sum(weights))
    exact = [total * weight / whole for weight in weights.tolist()]  # so few that numpy would take longer
    counts = [math.floor(share) for share in exact]
    order = sorted(range(len(exact)), key=lambda k: counts[k] - exact[k])
    for k in order[: total - sum(counts)]:
        counts[k] += 1
    return np.array(counts, dtype=np.int64)
