"""What a stereo pair can know at a stop: the pixels of the left image that the right camera sees too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array, inverse, transform
from flysim.truth.stop import Stop
from flysim.worlds.view import TrueView

DEPTH_TOLERANCE = 0.02  # [m] and as a share of the depth, the larger: two pixel grids never fall on the same points


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sight:
    """A stop and what both of its cameras saw there.

    Attributes:
        seen: `[H, W]` bool over the left image: a body within range that the right camera sees too.
    """

    stop: Stop
    seen: NDArray[np.bool_]

    @property
    def views(self) -> tuple[TrueView, TrueView]:
        """What both cameras truly saw, left and right."""
        left, right = self.stop.views  # type: ignore[assignment]  # a sight is of two
        return left, right

    def points(self, seen: NDArray[np.bool_] | None = None) -> Array:
        """`[N, 3]` true surface points [m, world] at the pixels of `seen` (default: all), row by row."""
        view = self.stop.views[0]
        v, u = np.nonzero(self.seen if seen is None else seen)
        optical = view.camera.unproject(np.stack([u, v], axis=1), view.depth[v, u])
        return transform(view.T_world_optical, optical)


def sights(stops: Sequence[Stop], max_range: float) -> tuple[Sight, ...]:
    """What both cameras saw at each stop with a frame, within `max_range` [m] along the left optical axis."""
    return tuple(Sight(stop=stop, seen=seen_by_both(stop.views, max_range)) for stop in stops if len(stop.views) == 2)


def seen_by_both(views: tuple[TrueView, TrueView], max_range: float) -> NDArray[np.bool_]:
    """`[H, W]` bool over the left image: some body within `max_range` that the right camera sees too.

    A left pixel's true point is projected into the right view. It is seen there when it falls in the image
    and the pixel it falls on shows the same body at the same depth.
    """
    left, right = views
    known = (left.link >= 0) & (left.depth > 0.0) & (left.depth <= max_range)
    z = np.where(known, left.depth, np.float32(1.0)).astype(np.float32, copy=False)
    camera, T = left.camera, inverse(right.T_world_optical) @ left.T_world_optical
    x = (np.arange(camera.width) - camera.cx) / camera.fx
    y = (np.arange(camera.height)[:, None] - camera.cy) / camera.fy
    # p_right = R (z ray) + t, row by row of [R t], so that only three images are made.
    xr, yr, zr = (
        ((row[0] * x).astype(np.float32) + (row[1] * y + row[2]).astype(np.float32)) * z + np.float32(row[3])
        for row in T[:3]
    )
    known &= zr > 1e-6
    zr = np.where(known, zr, np.float32(1.0))
    other = right.camera
    u = np.rint(xr / zr * np.float32(other.fx) + np.float32(other.cx))
    v = np.rint(yr / zr * np.float32(other.fy) + np.float32(other.cy))
    known &= (u >= 0) & (u < other.width) & (v >= 0) & (v < other.height)
    at = np.where(known, v * other.width + u, 0.0).astype(np.int32)
    # Beyond 2^24 pixels a float32 index would lose its last bit; no camera here comes near.
    same = right.link.ravel()[at] == left.link
    off = np.abs(right.depth.ravel()[at] - zr)
    return known & same & (off <= np.maximum(np.float32(DEPTH_TOLERANCE), np.float32(DEPTH_TOLERANCE) * zr))
