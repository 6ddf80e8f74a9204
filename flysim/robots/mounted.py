"""A pair of cameras for a robot that has none: the rover's, at a stated place."""

from __future__ import annotations

import math
from pathlib import Path

from flysim.geometry.camera import Camera
from flysim.geometry.frames import R_BODY_OPTICAL, pose6, se3
from flysim.robots.account import Account
from flysim.robots.cameras import Vision, stereo

WIDTH, HEIGHT, FOV = 640, 480, math.radians(65.0)  # [px], [px], [rad] of each, as the rover has them
BASELINE = 0.12  # [m]
PITCH = 0.2  # [rad] down
HIGH = 0.5  # [m] above the floor, or higher where the robot is
ABOVE = 0.03  # [m] above the highest of it
ROUND_TO = 3  # digits of metres


def mounted(path: Path, front: float, height: float, account: Account) -> tuple[Vision, float]:
    """The pair on a robot that reaches so far forward and so high [m], and how high it reaches with it."""
    x, z = round(front, ROUND_TO), round(max(HIGH, height + ABOVE), ROUND_TO)
    camera = Camera.from_fov(WIDTH, HEIGHT, FOV)
    T_base_bar = pose6(x, 0.0, z, 0.0, PITCH, 0.0)
    left, right = (
        T_base_bar @ pose6(0.0, y, 0.0, 0.0, 0.0, 0.0) @ se3(R_BODY_OPTICAL, (0, 0, 0))
        for y in (BASELINE / 2.0, -BASELINE / 2.0)
    )
    account.note(
        "mounted",
        f"{WIDTH}x{HEIGHT} px and {math.degrees(FOV):.0f} degrees each, {BASELINE:g} m apart, {x:g} m before the axle, "
        f"{z:g} m high, {PITCH:g} rad down",
    )
    return stereo(path, camera, camera, left, right), max(height, z)
