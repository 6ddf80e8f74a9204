"""The picture of an episode: what the left eye sees, beside a map."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array
from flysim.geometry.rig import ImagePair
from flysim.nav.drive import Drive
from flysim.paths.course import Course

HEIGHT = 360  # [px] of the picture
SPAN = 8.0  # [m] of the map's side, about the robot
PAPER, THING, WAY, ROBOT, GOAL, FLY = (
    (250, 250, 248),
    (90, 95, 105),
    (150, 190, 230),
    (25, 60, 120),
    (30, 150, 60),
    (220, 70, 30),
)


def draw(
    pair: ImagePair, outline: Array, course: Course, drive: Drive, seen: Array, radius: float
) -> NDArray[np.uint8]:
    """`[360, W, 3]` RGB: the left image, and the map with north up.

    Args:
        pair: what the robot sees.
        outline: `[n, 2]` [m] the truth, grey.
        course: its goal, green.
        drive: the robot and where it has been, blue.
        seen: `[m, 2]` [m] the flies that are remembered, orange; odometry frame.
        radius: of the robot [m].
    """
    height, width = pair.left.shape[:2]
    eye = cv2.resize(pair.left, (round(width * HEIGHT / height), HEIGHT), interpolation=cv2.INTER_NEAREST)
    page = np.full((HEIGHT, HEIGHT, 3), PAPER, np.uint8)
    scale = HEIGHT / SPAN
    centre = np.array([drive.true.x, drive.true.y])

    def place(xy: Array) -> NDArray[np.int32]:
        at = (np.asarray(xy, np.float64).reshape(-1, 2) - centre) * (scale, -scale) + HEIGHT / 2.0
        return np.clip(np.rint(at), -10_000, 10_000).astype(np.int32)

    for points, colour, half in ((outline, THING, 0), (seen, FLY, 1)):
        at = place(points)
        at = at[((at >= half) & (at < HEIGHT - half)).all(axis=1)]
        for dx in range(-half, half + 1):
            page[at[:, 1], at[:, 0] + dx] = colour
    cv2.polylines(page, [place(np.array(drive.track))], False, WAY, 2)
    (goal,), (here,) = place(np.array([course.goal])), place(centre)
    cv2.circle(page, goal.tolist(), max(3, round(0.15 * scale)), GOAL, -1)
    cv2.circle(page, here.tolist(), max(2, round(radius * scale)), ROBOT, 2)
    nose = centre + 2.0 * radius * np.array([math.cos(drive.true.yaw), math.sin(drive.true.yaw)])
    cv2.line(page, here.tolist(), place(nose)[0].tolist(), ROBOT, 2)
    return np.concatenate([np.asarray(eye, np.uint8), page], axis=1)
