"""A plane through each point of a disparity map, from its neighbours on the same surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

REACH = 3  # [px] neighbours that many columns and rows away have a say: the flies' window
# [px] a neighbour further off than these is on another surface: at first, once a plane is known
NEAR, NEARER = 2.0, 0.5
LEAST = 9  # neighbours that a plane needs; with fewer the surface is taken to face the camera
DAMPING = 0.02  # of a plane's slopes, as the flies have it: few neighbours, or all in one line, tell no slope


def local_planes(disparity: NDArray[np.float32], pixels: NDArray[np.int64]) -> tuple[NDArray, NDArray]:
    """Slopes of the disparity at some pixels, and how sure they are.

    The neighbours whose disparity is like the pixel's own vote by least squares; then once more those that lie near
    the plane found: what stands before or behind has no say.

    Args:
        disparity: `[H, W]` [px], NaN where there is none.
        pixels: `[N, 2]` u, v with a disparity.

    Returns:
        `[N, 2]` slopes along u and v [px/px], and `[N]` share of the neighbours on the plane, in [0, 1].
    """
    padded = np.pad(disparity, REACH, constant_values=np.nan)
    j, i = (grid.ravel() for grid in np.mgrid[-REACH : REACH + 1, -REACH : REACH + 1])
    u, v = pixels.T
    off = padded[v[:, None] + REACH + j, u[:, None] + REACH + i] - disparity[v, u][:, None]
    known = np.isfinite(off)
    off = np.where(known, off, 0.0)
    terms = np.stack([np.ones(len(i)), i, j])
    votes = known & (np.abs(off) <= NEAR)
    for _ in range(2):
        base, slopes = _fit(off, votes, terms)
        votes = known & (np.abs(off - np.column_stack([base, slopes]) @ terms) <= NEARER)
    enough = votes.sum(axis=1) >= LEAST
    return np.where(enough[:, None], slopes, 0.0), votes.mean(axis=1)


def _fit(off: NDArray, votes: NDArray[np.bool_], terms: NDArray) -> tuple[NDArray, NDArray]:
    """`[N]` offset and `[N, 2]` slopes of the least-squares plane through those that have a vote."""
    weights = votes.astype(np.float64)
    # Sums of 1, i, j, i i, i j, j j over the votes, and of the disparity times 1, i, j: two products of matrices.
    n, si, sj, sii, sij, sjj = (weights @ np.stack([*terms, *(terms[1] * terms[1:]), terms[2] ** 2], axis=1)).T
    b0, bi, bj = ((weights * off) @ terms.T).T
    damp = DAMPING * n * REACH**2 + 1e-6
    n, sii, sjj = n + 1e-6, sii + damp, sjj + damp
    c00, c01, c02 = sii * sjj - sij * sij, sj * sij - si * sjj, si * sij - sj * sii
    c11, c12, c22 = n * sjj - sj * sj, si * sj - n * sij, n * sii - si * si
    det = n * c00 + si * c01 + sj * c02
    slopes = np.stack([c01 * b0 + c11 * bi + c12 * bj, c02 * b0 + c12 * bi + c22 * bj], axis=1) / det[:, None]
    return (c00 * b0 + c01 * bi + c02 * bj) / det, slopes
