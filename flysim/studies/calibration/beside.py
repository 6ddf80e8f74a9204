"""A calibration of simulated cameras beside the truth: the one thing that no photograph tells."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flysim.calibration.undistort import lens
from flysim.common.sheet import Sheet, number
from flysim.geometry.camera_info import CameraInfo, stereo_rig

MM = 1000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class EyeError:
    """How far the figures of one camera are from what they truly are.

    Attributes:
        focal: share by which its focal length is too long, of the two directions the one that is farther off.
        principal_px: how far its principal point is off, of the two directions the one that is farther off [px].
        lens_px: how far what its lens does to the corners of the image is off, at most [px].
        ray_px: how far a pixel in a corner of the image is from where the calibration has its ray, at most [px].
    """

    focal: float
    principal_px: float
    lens_px: float
    ray_px: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Beside:
    """What was found, less the truth.

    Attributes:
        eyes: the left and the right camera's.
        baseline_m: by which it is too long [m].
        turn_deg: by which one eye is turned against the other [degrees].
    """

    eyes: tuple[EyeError, ...]
    baseline_m: float
    turn_deg: float

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        names = ("left", "right")
        each = ({key: getattr(eye, key) for key in eye.__slots__} for eye in self.eyes)
        return {"baseline_m": self.baseline_m, "turn_deg": self.turn_deg, **dict(zip(names, each, strict=True))}

    def sheet(self) -> Sheet:
        """A table of both eyes."""
        rows = (
            ("focal length off [%]", *(f"{100.0 * eye.focal:+.3f}" for eye in self.eyes)),
            ("principal point off [px]", *(number(eye.principal_px, 2) for eye in self.eyes)),
            ("lens off in the corners [px]", *(number(eye.lens_px, 2) for eye in self.eyes)),
            ("all of it in the corners [px]", *(number(eye.ray_px, 2) for eye in self.eyes)),
        )
        note = f"The baseline is {MM * self.baseline_m:+.3f} mm off, one eye turned {self.turn_deg:.3f} degrees."
        return Sheet(title="beside the truth", columns=("", "left", "right"), rows=rows, note=note)


def beside(found: Sequence[CameraInfo], true: Sequence[CameraInfo]) -> Beside:
    """Holds a pair's calibration against what it should have been."""
    T, T_true = (stereo_rig(left, right).T_right_left for left, right in (found, true))
    turn = T[:3, :3] @ T_true[:3, :3].T
    return Beside(
        eyes=tuple(_eye(one, other) for one, other in zip(found, true, strict=True)),
        baseline_m=float(np.linalg.norm(T[:3, 3]) - np.linalg.norm(T_true[:3, 3])),
        turn_deg=math.degrees(float(np.arccos(np.clip((np.trace(turn) - 1.0) / 2.0, -1.0, 1.0)))),
    )


def _eye(found: CameraInfo, true: CameraInfo) -> EyeError:
    own, good = found.camera, true.camera
    focal = max((own.fx / good.fx - 1.0, own.fy / good.fy - 1.0), key=abs)
    corners = np.array([(u, v) for u in (0, good.width - 1) for v in (0, good.height - 1)], np.float64)
    rays = _rays_at(true, corners)
    bent = [
        lens(one, rays) - rays * (one.camera.fx, one.camera.fy) - (one.camera.cx, one.camera.cy)
        for one in (found, true)
    ]
    bent[0] *= (good.fx / own.fx, good.fy / own.fy)
    return EyeError(
        focal=focal,
        principal_px=max(abs(own.cx - good.cx), abs(own.cy - good.cy)),
        lens_px=float(np.linalg.norm(bent[0] - bent[1], axis=1).max()),
        ray_px=float(np.linalg.norm(lens(found, rays) - corners, axis=1).max()),
    )


def _rays_at(info: CameraInfo, uv: np.ndarray) -> np.ndarray:
    """`[N, 2]` rays of raw pixels, by Newton steps on what the lens does; the truth does not fold."""
    camera = info.camera
    scale = np.array([camera.fx, camera.fy])
    rays = (uv - (camera.cx, camera.cy)) / scale
    for _ in range(50):
        rays = rays + (uv - lens(info, rays)) / scale
    return rays
