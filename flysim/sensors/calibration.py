"""What a robot wrongly believes of its two cameras: how they truly stand, and what it takes them for."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from flysim.common.ranges import ranged
from flysim.geometry.camera import Camera
from flysim.geometry.frames import inverse, se3
from flysim.geometry.rig import StereoRig


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationParams:
    """How far the true rig and the believed one are apart; all 0: they are one.

    The first four move the right camera itself, which then draws what it sees from there; the robot believes it where
    its file has it. The last four change what the robot believes. Pixels are those of the image that is drawn.
    Refuses nonsense with a ValueError that names the figure.

    Attributes:
        right_roll_deg: the right camera is turned about its optical axis [degrees], clockwise as it looks.
        right_pitch_deg: it looks so much too far up [degrees].
        right_yaw_px: it looks to the left by the angle that shifts the middle of its image so far to the right [px]:
            all seems farther away.
        row_shift_px: its image lies so much too low on its chip [px].
        focal_error: share by which the focal lengths are believed too long, of both eyes.
        baseline_error: share by which the baseline is believed too long.
        cx_error_px, cy_error_px: by which the principal points are believed too far right and down [px], of both eyes.
    """

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012 (how a scenario file reads this record)

    right_roll_deg: float = 0.0
    right_pitch_deg: float = 0.0
    right_yaw_px: float = 0.0
    row_shift_px: float = 0.0
    focal_error: float = 0.0
    baseline_error: float = 0.0
    cx_error_px: float = 0.0
    cy_error_px: float = 0.0

    def __post_init__(self) -> None:
        ranged(
            self,
            right_roll_deg=(-45.0, 45.0, "degrees"),
            right_pitch_deg=(-45.0, 45.0, "degrees"),
            right_yaw_px=(-1000.0, 1000.0, "px"),
            row_shift_px=(-1000.0, 1000.0, "px"),
            focal_error=(-0.9, 10.0, "(a share)"),
            baseline_error=(-0.9, 10.0, "(a share)"),
            cx_error_px=(-1000.0, 1000.0, "px"),
            cy_error_px=(-1000.0, 1000.0, "px"),
        )


def true_rig(rig: StereoRig, params: CalibrationParams) -> StereoRig:
    """The cameras as they truly stand, which is how they are drawn; `rig` itself where nothing is moved."""
    right, T_right_left = rig.right, rig.T_right_left
    yaw = -math.atan(params.right_yaw_px / right.fx)
    turns = (yaw, math.radians(params.right_pitch_deg), math.radians(params.right_roll_deg))
    if any(turns):
        T_right_turned = se3(Rotation.from_euler("YXZ", turns).as_matrix(), np.zeros(3))
        T_right_left = inverse(T_right_turned) @ T_right_left
    if params.row_shift_px:
        right = replace(right, cy=right.cy + params.row_shift_px)
    if right is rig.right and T_right_left is rig.T_right_left:
        return rig
    return StereoRig(left=rig.left, right=right, T_right_left=T_right_left)


def believed_rig(rig: StereoRig, params: CalibrationParams) -> StereoRig:
    """The cameras as the robot takes them to be; `rig` itself where it is right."""
    if not any((params.focal_error, params.baseline_error, params.cx_error_px, params.cy_error_px)):
        return rig
    T = rig.T_right_left
    return StereoRig(
        left=believed_camera(rig.left, params),
        right=believed_camera(rig.right, params),
        T_right_left=se3(T[:3, :3], T[:3, 3] * (1.0 + params.baseline_error)),
    )


def believed_camera(camera: Camera, params: CalibrationParams) -> Camera:
    """A camera as the robot takes it to be."""
    longer = 1.0 + params.focal_error
    return replace(
        camera,
        fx=camera.fx * longer,
        fy=camera.fy * longer,
        cx=camera.cx + params.cx_error_px,
        cy=camera.cy + params.cy_error_px,
    )
