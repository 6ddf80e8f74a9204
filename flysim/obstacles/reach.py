"""How far the surface under a fly goes on: its silhouettes, sought on purpose.

A fly's window has to fit on its surface, so that no fly sits nearer to a silhouette than half a window, a centimetre at
2 m, and the windows that hang over one ("foreground fattening") are dropped. But a fly carries a plane. From the fly
on, pixel by pixel along the image's rows and columns, that plane says where in the right image the same surface is; as
long as the pixels there are alike it goes on, and where they cease to be, it ends.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flysim.compute.compiled import kernel
from flysim.compute.vectors import add
from flysim.flies.threads import share
from flysim.geometry.frames import Array
from flysim.geometry.rig import ImagePair
from flysim.obstacles.climb import climb
from flysim.obstacles.flat import MISPLACED, MISSES, compared, on_planes, right_of
from flysim.products.swarm import Swarm

LONGEST = 14  # [px] of an arm: more than flies lie apart
DIRECTIONS = np.array([(1, 0), (-1, 0), (0, 1), (0, -1)])  # of the arms: right, left, down, up in the image
UP = 3  # place of the last one
UPRIGHT = 0.4  # a fly whose normal is less steep than this may lie on something upright
NOISE_ALLOWANCE = 1.5  # times what the flies' own pixels differ by, in the median
ROUNDING = 1.0  # [grey levels^2] that 8-bit images and interpolation leave
COLUMN, DEPTH, FOLLOWED = 8, 0.05, 3  # [px] and share of the depth in which so many flies are followed up
OWN = 2  # [px] about a fly that are surely on its surface


def reach(
    pair: ImagePair, swarm: Swarm, chosen: NDArray[np.int64], up: Array | None = None
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """The ends of the four arms of some flies.

    Args:
        pair: what the swarm evolved on.
        swarm: whose flies they are.
        chosen: `[n]` indices of the flies asked for.
        up: `[3]` unit vector of what is up, left optical frame: upright surfaces are followed that way as far as they
            go (`climb`). None: no arm is longer than LONGEST.

    Returns:
        `[n, 4, 3]` the last point [m, left optical frame] of each arm of DIRECTIONS that is on the fly's surface, taken
        to be flat; `[n, 4, 3]` from there one pixel further on the surface [m]; `[n, 4]` whether the surface ends
        there. Elsewhere it goes on beyond LONGEST, or leaves a view.
    """
    camera = pair.rig.left
    pixels = np.rint(swarm.uv[chosen]).astype(np.int64)
    points, normals = swarm.points[chosen].astype(np.float64), swarm.normals[chosen].astype(np.float64)
    plane = normals / (normals * points).sum(axis=1, keepdims=True)  # plane . ray is the inverse depth
    # Of a left pixel p = (u, v, 1): its inverse depth is planes . p.
    planes, to_right = plane @ np.linalg.inv(camera.K), right_of(pair.rig)
    last, ended = np.zeros((len(chosen), 4), np.int64), np.zeros((len(chosen), 4), np.bool_)
    taken, limit = np.zeros(1, np.int64), allowance(pair, pixels, planes)
    share(_stretch, taken, pair.left, pair.right, to_right, pixels, planes, limit, last, ended)
    ends = (pixels[:, None] + DIRECTIONS * last[..., None]).astype(np.float64)
    # Halfway out and back: a plane seen along itself has no next pixel, but one between it and the last.
    first, beyond = (on_planes(camera, planes, ends + DIRECTIONS * half) for half in (-0.5, 0.5))
    last_points, step = on_planes(camera, planes, ends), beyond - first
    if up is not None:
        flies = np.flatnonzero((np.abs(normals @ up) < UPRIGHT) & ~ended[:, UP] & (last[:, UP] == LONGEST))
        flies = flies[_highest(pixels[flies], points[flies, 2])]
        climbed = climb(pair, limit, up, points[flies], normals[flies], pixels[flies])
        last_points[flies, UP], step[flies, UP], ended[flies, UP] = climbed
    return last_points, step, ended


def _highest(pixels: NDArray[np.int64], depth: Array) -> NDArray[np.int64]:
    """The few highest of those flies that lie one above the other at one depth: they would be followed one way."""
    cell = np.stack([pixels[:, 0] // COLUMN, np.floor(np.log(depth) / DEPTH)], axis=1)
    _, stack = np.unique(cell, axis=0, return_inverse=True)
    order = np.lexsort((pixels[:, 1], stack.ravel()))
    stack = stack.ravel()[order]
    rank = np.arange(len(stack)) - np.searchsorted(stack, stack)
    return np.sort(order[rank < FOLLOWED])


def allowance(pair: ImagePair, pixels: NDArray[np.int64], planes: Array) -> float:
    """What a pixel that is alike may differ by where it has no contrast, by what flies' own do [grey levels^2].

    Args:
        pair: what the flies evolved on.
        pixels: `[n, 2]` of the flies, left image.
        planes: `[n, 3]` their planes; `planes[k] @ (u, v, 1)` is a left pixel's inverse depth [1/m].
    """
    own = np.zeros(len(pixels))
    share(_differ, np.zeros(1, np.int64), pair.left, pair.right, right_of(pair.rig), pixels, planes, own)
    return (NOISE_ALLOWANCE * float(np.median(own)) if len(own) else 0.0) + 3.0 * ROUNDING


@kernel
def _differ(lane, taken, left, right, to_right, pixels, planes, own):
    """Fills `own` `[n]`, what a pixel of each fly's own surface differs by, on average."""
    while True:
        n = add(taken, 0, 1)
        if n >= len(pixels):
            return
        total, seen = 0.0, 0
        for j in range(-OWN, OWN + 1):
            for i in range(-OWN, OWN + 1):
                e, _ = compared(left, right, to_right, planes, n, pixels[n, 0] + i, pixels[n, 1] + j)
                if e >= 0.0:
                    total += e
                    seen += 1
        own[n] = total / max(seen, 1)


@kernel
def _stretch(lane, taken, left, right, to_right, pixels, planes, allowed, last, ended):
    """Fills `last` `[n, 4]`, the pixels that each arm goes, and `ended` `[n, 4]`."""
    while True:
        n = add(taken, 0, 1)
        if n >= len(pixels):
            return
        for arm in range(4):
            du = 1 - 2 * arm if arm < 2 else 0
            dv = 5 - 2 * arm if arm >= 2 else 0
            missed = 0
            for step in range(1, LONGEST + 1):
                u, v = pixels[n, 0] + step * du, pixels[n, 1] + step * dv
                different = contrast = least = 0.0
                for k in range(-1, 2):  # pixels judged together, across the arm
                    e, g = compared(left, right, to_right, planes, n, u + k * dv, v + k * du)
                    least = min(least, e)
                    different += e
                    contrast += g
                if least < 0.0:
                    break
                if different <= MISPLACED**2 * contrast + 3.0 * allowed:
                    missed = 0
                    last[n, arm] = step
                    continue
                missed += 1
                if missed == MISSES:
                    ended[n, arm] = True
                    break
