"""Flies' windows looked for in another frame's picture, bent as their surfaces bend them for its camera."""

from __future__ import annotations

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array, inverse, transform
from flysim.localise.glimpse import Glimpse

HALF = 6  # [px] of a window on either side of its middle
MOST = 90  # windows that are looked for
CELLS = 12  # that a picture has across, for windows evenly spread
CONTRAST = 4.0  # [grey levels] standard deviation that a window has at least
SAME = 0.7  # correlation of two windows that show the same, at least
LEAN = 0.15  # least cosine between a surface's normal and the way to a camera
AREA = (0.1, 6.0)  # how many pixels of its own picture one of the other's may cover


class FoundAgain(NamedTuple):
    """Flies of one frame, found again in the picture of another.

    Attributes:
        fly: `[m]` their places in their own glimpse.
        uv: `[m, 2]` pixels in the other's left picture.
        same: `[m]` correlation of the two windows.
    """

    fly: NDArray[np.int64]
    uv: Array
    same: Array


_NOTHING = FoundAgain(np.empty(0, np.int64), np.empty((0, 2)), np.empty(0))


def looked_for(
    there: Glimpse, here: Glimpse, T_there_here: Array, most: int = MOST, cells: int = CELLS
) -> NDArray[np.int64]:
    """`[k]` flies of `here` whose surface the other camera ought to see, the fittest of each part of the picture first.

    Args:
        there: who may see them too.
        here: whose flies they are, the fittest first.
        T_there_here: `[4, 4]` from here's base_link to there's, as believed.
        most: so many at most.
        cells: that a picture has across.
    """
    own = _leaning(here, here.points, here.normals)
    points, normals = transform(T_there_here, here.points), here.normals @ T_there_here[:3, :3].T
    uv = there.camera.project(transform(inverse(there.T_base_left), points))
    known = np.flatnonzero(own & _leaning(there, points, normals) & there.camera.contains(uv, HALF + 1.0))
    cell = np.floor(here.uv[known] / (here.camera.width / cells)).astype(np.int64)
    _, at = np.unique(cell[:, 0] + 4 * cells * cell[:, 1], return_inverse=True)
    order = np.argsort(at, kind="stable")
    first = np.searchsorted(at[order], at[order])
    rank = np.empty(len(known), np.int64)
    rank[order] = np.arange(len(known)) - first
    return known[np.argsort(rank, kind="stable")[:most]]


def _leaning(one: Glimpse, points: Array, normals: Array) -> NDArray[np.bool_]:
    """`[n]` whether surfaces, in its base_link, face a camera."""
    way = one.T_base_left[:3, 3] - points
    return (way * normals).sum(axis=1) > LEAN * np.linalg.norm(way, axis=1)


def found_again(
    there: Glimpse,
    here: Glimpse,
    T_there_here: Array,
    flies: NDArray[np.int64],
    *,
    radius: float,
    coarse: bool,
) -> FoundAgain:
    """Windows of `here`'s flies as they are found in `there`'s picture, within `radius` px of where they ought to be.

    Args:
        there: whose picture is searched.
        here: whose flies they are.
        T_there_here: `[4, 4]` from here's base_link to there's, as believed.
        flies: `[k]` which of them.
        radius: of the search [px].
        coarse: in the halved pictures.
    """
    shrunk = 2.0 ** -(there.halvings if coarse else 0), 2.0 ** -(here.halvings if coarse else 0)
    pictures = (there.coarse, here.coarse) if coarse else (there.grey, here.grey)
    middle, bend = _bent(there, here, T_there_here, flies)
    at, bend = middle * shrunk[0], bend * (shrunk[1] / shrunk[0])
    area = np.abs(np.linalg.det(bend))
    reach = max(1, round(radius * shrunk[0]))
    whole = np.rint(at).astype(np.int64)
    margin, (height, width) = HALF + reach, pictures[0].shape
    inside = (whole >= margin).all(axis=1) & (whole[:, 0] < width - margin) & (whole[:, 1] < height - margin)
    kept = np.flatnonzero(inside & (area > AREA[0]) & (area < AREA[1]))
    if not len(kept):
        return _NOTHING
    templates = _templates(pictures[1], here.uv[flies[kept]] * shrunk[1], bend[kept])
    kept, templates = kept[sharp := templates.std(axis=(1, 2)) > CONTRAST], templates[sharp]
    if not len(kept):
        return _NOTHING
    score = np.empty((len(kept), 2 * reach + 1, 2 * reach + 1), np.float32)
    for k, (template, (u, v)) in enumerate(zip(templates, whole[kept], strict=True)):
        field = pictures[0][v - margin : v + margin + 1, u - margin : u + margin + 1]
        cv2.matchTemplate(field, template, cv2.TM_CCOEFF_NORMED, score[k])
    peak, same = _peaks(score)
    # A window is asked for at a whole pixel, and lies as far beside the fly's own place there.
    found = peak - reach + whole[kept] + (at - whole)[kept]
    good = same > SAME
    return FoundAgain(flies[kept[good]], found[good] / shrunk[0], same[good])


def _bent(there: Glimpse, here: Glimpse, T_there_here: Array, flies: NDArray[np.int64]) -> tuple[Array, Array]:
    """`[k, 2]` pixels there, and `[k, 2, 2]` by how much a step of a pixel there moves in here's picture."""
    T_left_base = inverse(there.T_base_left)
    T = T_left_base @ T_there_here  # there's optical frame <- here's base_link
    points, normals = transform(T, here.points[flies]), here.normals[flies] @ T[:3, :3].T
    back = inverse(here.T_base_left) @ inverse(T)
    # Of a plane n.X = d, X' = R X + t is (R + t n^T / d) X; pixels are their cameras' linear images of the rays.
    d = (points * normals).sum(axis=1)
    G = back[:3, :3] + back[:3, 3][:, None] * (normals / d[:, None])[:, None, :]
    G = here.camera.K @ G @ np.linalg.inv(there.camera.K)
    uv = there.camera.project(points)
    at = np.einsum("kij,kj->ki", G, np.column_stack([uv, np.ones(len(uv))]))
    w = at[:, 2, None, None]
    bend = (G[:, :2, :2] - (at[:, :2] / at[:, 2:])[:, :, None] * G[:, 2, None, :2]) / w
    return uv, bend


def _templates(picture: NDArray[np.uint8], uv: Array, bend: Array) -> NDArray[np.uint8]:
    """`[k, s, s]` windows about pixels, drawn as they would look bent."""
    step = np.arange(-HALF, HALF + 1.0)
    offset = np.stack(np.meshgrid(step, step)).reshape(2, -1)  # u, v
    at, s = (uv[:, :, None] + bend @ offset).astype(np.float32), len(step)
    u, v = (at[:, k].reshape(-1, s) for k in range(2))
    return np.asarray(cv2.remap(picture, u, v, cv2.INTER_LINEAR), np.uint8).reshape(-1, s, s)


def _peaks(score: NDArray[Any]) -> tuple[Array, Array]:
    """`[k, 2]` column and row of the best correlation, to parts of a pixel, `[k]` how good it is.

    That is -1 where it is at the border of what was searched: it may go on outside.
    """
    height, width = score.shape[1:]
    score, every = np.asarray(score, np.float64), np.arange(len(score))
    v, u = np.divmod(score.reshape(len(score), -1).argmax(axis=1), width)
    within = (u > 0) & (u < width - 1) & (v > 0) & (v < height - 1)
    u, v = np.clip(u, 1, width - 2), np.clip(v, 1, height - 2)
    best = score[every, v, u]
    du = _tops(score[every, v, u - 1], best, score[every, v, u + 1])
    dv = _tops(score[every, v - 1, u], best, score[every, v + 1, u])
    return np.column_stack([u + du, v + dv]), np.where(within, best, -1.0)


def _tops(before: Array, best: Array, after: Array) -> Array:
    """Where parabolas through three values have their tops, from the middle ones."""
    bow = np.minimum(before - 2.0 * best + after, -1e-6)
    return np.clip((before - after) / (2.0 * bow), -0.5, 0.5)
