"""How high an upright surface goes: followed in the image to where nothing supports it any more.

Few flies, or none, sit near the top of a thin post, and those of the nearest stops, which are most, do not see it. One
fly anywhere below it, at a stop that does see it, is enough: what is upright is at one depth from foot to top.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flysim.compute.compiled import kernel
from flysim.compute.vectors import add
from flysim.flies.threads import share
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array
from flysim.geometry.rig import ImagePair
from flysim.obstacles.flat import MISSES, compared, on_planes, right_of

MISPLACED = 0.3  # [px] as `flat.MISPLACED`, but less: what is behind and half a pixel off is not what is followed
HIGHEST = 400  # [px] that a surface is followed
TOLD = 0.5  # times what pixels that are alike may differ by: a squared gradient that tells depths apart
QUIET = 4  # rows at least that are alike at any depth, as a sky's are, and
PLAIN = 0.05  # [m] of them: no surface is taken to be that plain, it ended before the first of them


def climb(
    pair: ImagePair, limit: float, up: Array, points: Array, normals: Array, pixels: NDArray[np.int64]
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Follows upwards what some flies lie on, taken to be upright.

    Args:
        pair: what the flies evolved on.
        limit: what a pixel that is alike may differ by where it has no contrast [grey levels^2].
        up: `[3]` unit vector, left optical frame.
        points, normals, pixels: `[n, 3]`, `[n, 3]`, `[n, 2]` of the flies: [m], left optical frame, left image.

    Returns:
        `[n, 3]` the last point on each that its texture tells to be there [m, left optical frame]; `[n, 3]` from there
        one pixel further up; `[n]` whether the surface ends there, rather than leaving the view.
    """
    planes = upright(pair.rig.left, up, points, normals)
    vanishing = pair.rig.left.K @ up  # where all that is upright meets in the image
    rows = vanishing[1] - pixels[:, 1] * vanishing[2]
    lean = (vanishing[0] - pixels[:, 0] * vanishing[2]) / np.where(rows == 0.0, np.inf, rows)
    quiet = np.maximum(np.rint(PLAIN * pair.rig.left.fy / points[:, 2]), QUIET).astype(np.int64)
    last, ended = np.zeros(len(pixels), np.int64), np.zeros(len(pixels), np.bool_)
    taken, lines = np.zeros(1, np.int64), (lean, quiet)
    share(_ascend, taken, pair.left, pair.right, right_of(pair.rig), pixels, planes, lines, limit, last, ended)
    ends = (pixels - np.stack([np.rint(last * lean), last], axis=1))[:, None].astype(np.float64)
    half = np.stack([lean, np.ones(len(lean))], axis=1)[:, None] / 2.0
    lower, upper = (on_planes(pair.rig.left, planes, way)[:, 0] for way in (ends + half, ends - half))
    return on_planes(pair.rig.left, planes, ends)[:, 0], upper - lower, ended


def upright(camera: Camera, up: Array, points: Array, normals: Array) -> Array:
    """`[n, 3]` upright planes through points [m, left optical frame]: `planes[k] @ (u, v, 1)` is an inverse depth."""
    level = normals - (normals @ up)[:, None] * up
    return level / (level * points).sum(axis=1, keepdims=True) @ np.linalg.inv(camera.K)


@kernel
def _ascend(lane, taken, left, right, to_right, pixels, planes, lines, allowed, last, ended):
    """Fills `last` `[n]`, the rows that each fly's surface goes up, and `ended` `[n]`.

    `lines` are `[n]` the pixels to the left that each moves in a row, and after how many quiet rows it has ended.
    """
    lean, quiet = lines
    while True:
        n = add(taken, 0, 1)
        if n >= len(pixels):
            return
        missed = alike = told = 0  # rows that differ; the last alike, and the last alike at this depth alone
        for step in range(1, HIGHEST + 1):
            u, v = pixels[n, 0] - round(step * lean[n]), pixels[n, 1] - step
            different = contrast = least = 0.0
            for k in range(-1, 2):
                e, g = compared(left, right, to_right, planes, n, u + k, v)
                least = min(least, e)
                different += e
                contrast += g
            if least < 0.0:
                break
            if different > MISPLACED**2 * contrast + 3.0 * allowed:
                missed += 1
                if missed == MISSES:
                    ended[n] = True
                    break
                continue
            missed, alike = 0, step
            if contrast > 3.0 * TOLD * allowed:
                told = step
            elif step - told >= quiet[n]:
                ended[n] = True
                break
        last[n] = alike if ended[n] and alike - told < quiet[n] else told
