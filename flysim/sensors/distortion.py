"""A lens that is no pinhole, and rows that are read one after the other: where a pixel's light comes from.

Distortion is radial and tangential (Brown, Close-Range Camera Calibration, 1971), with OpenCV's names and signs.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from flysim.errors import FlysimError
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, frozen
from flysim.sensors.parameters import SensorParams

ROUNDS = 100  # of the inversion; the rover's image takes 8 of them at k1 = -0.1, 49 at -0.23, where it is about to fold
CONVERGED, EXACT = 1e-4, 0.01  # [px] a round moves less; the inversion is off by no more
WIDEST = 1.0  # of the image's width or height: what more is to be drawn on a side is no lens any more


@dataclass(frozen=True, slots=True, kw_only=True)
class Margin:
    """What a lens sees beyond the pinhole's image, on each side [px]."""

    left: int = 0
    right: int = 0
    top: int = 0
    bottom: int = 0

    def union(self, other: Margin) -> Margin:
        """The margin that is wide enough for both."""
        return Margin(
            left=max(self.left, other.left),
            right=max(self.right, other.right),
            top=max(self.top, other.top),
            bottom=max(self.bottom, other.bottom),
        )

    def round(self, camera: Camera) -> Camera:
        """The same pinhole with an image that is so much larger."""
        return Camera(
            width=camera.width + self.left + self.right,
            height=camera.height + self.top + self.bottom,
            fx=camera.fx,
            fy=camera.fy,
            cx=camera.cx + self.left,
            cy=camera.cy + self.top,
        )


def rays(camera: Camera, params: SensorParams) -> tuple[Array, Array]:
    """The rays x / z and y / z, `[H, W]` each, read-only, of what every pixel of a distorted image shows.

    Raises:
        FlysimError: the lens folds the image: two rays would fall on one pixel.
    """
    lens = SensorParams(k1=params.k1, k2=params.k2, p1=params.p1, p2=params.p2)
    return _rays(camera, lens)


@functools.lru_cache(maxsize=4)  # both eyes have one lens, and a drive is checked before it is driven
def _rays(camera: Camera, params: SensorParams) -> tuple[Array, Array]:
    u, v = np.arange(camera.width, dtype=np.float64), np.arange(camera.height, dtype=np.float64)
    grid = np.meshgrid((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy)
    xd, yd = (np.asarray(one, np.float64) for one in grid)
    x, y = xd, yd
    with np.errstate(all="ignore"):  # where it does not converge, which is told below
        for _ in range(ROUNDS if params.distorts else 0):
            radial, dx, dy = _lens(x, y, params)
            before, x, y = x, (xd - dx) / radial, (yd - dy) / radial
            if np.abs(x - before).max() * camera.fx < CONVERGED:
                break
        u, v = distorted(x, y, params)
        off = max(np.abs(u - xd).max() * camera.fx, np.abs(v - yd).max() * camera.fy)
        r2 = x * x + y * y
        grows = (1.0 + 3.0 * params.k1 * r2 + 5.0 * params.k2 * r2 * r2).min()
    if not (off <= EXACT and grows > 0.0):  # of NaN too
        given = f"k1 = {params.k1:g}, k2 = {params.k2:g}, p1 = {params.p1:g}, p2 = {params.p2:g}"
        raise FlysimError(
            f"sensors: a lens of {given} folds the image of {camera.width}x{camera.height} px: take less."
        )
    return frozen(x), frozen(y)


def distorted(x: Array, y: Array, params: SensorParams) -> tuple[Array, Array]:
    """Where the lens puts the rays x / z, y / z, in the same coordinates."""
    radial, dx, dy = _lens(x, y, params)
    return x * radial + dx, y * radial + dy


def _lens(x: Array, y: Array, params: SensorParams) -> tuple[Array, Array, Array]:
    r2 = x * x + y * y
    radial = 1.0 + params.k1 * r2 + params.k2 * r2 * r2
    dx = 2.0 * params.p1 * x * y + params.p2 * (r2 + 2.0 * x * x)
    dy = params.p1 * (r2 + 2.0 * y * y) + 2.0 * params.p2 * x * y
    return radial, dx, dy


def margin(camera: Camera, params: SensorParams) -> Margin:
    """How much more than its image a pinhole has to draw, so that the distorted image has no black border.

    Raises:
        FlysimError: as `rays`, or the lens sees more than twice as far as the pinhole.
    """
    if not params.distorts:
        return Margin()
    x, y = rays(camera, params)
    u, v = x * camera.fx + camera.cx, y * camera.fy + camera.cy
    last_u, last_v = camera.width - 1, camera.height - 1
    # Two pixels for the cubic that reads between them.
    sides = (-u.min(), u.max() - last_u, -v.min(), v.max() - last_v)
    found = [max(0, int(np.ceil(side)) + 2) if side > 0.0 else 0 for side in sides]
    if max(found[:2]) > WIDEST * camera.width or max(found[2:]) > WIDEST * camera.height:
        raise FlysimError(f"sensors: k1 = {params.k1:g} sees {max(found)} px beyond the pinhole's image: take less.")
    return Margin(left=found[0], right=found[1], top=found[2], bottom=found[3])


def turned(x: Array, y: Array, camera: Camera, row_time: float, turn_rate: float) -> tuple[Array, Array]:
    """The rays as they were when the middle row was read, of a camera that turns while its rows are read.

    Only the rotation counts: what a robot moves meanwhile would need the depth of each pixel, and at 0.5 m/s and 20 us
    from row to row it is 5 mm over 480 rows.

    Args:
        x, y: of each pixel at the time of its own row.
        camera: whose rows they are; its y axis is taken for the axis of the turn.
        row_time: [s] from row to row.
        turn_rate: [rad/s] counter-clockwise seen from above.
    """
    late = (np.arange(camera.height)[:, None] - (camera.height - 1) / 2.0) * row_time
    c, s = np.cos(turn_rate * late), np.sin(turn_rate * late)
    z = x * s + c
    return (x * c - s) / z, y / z
