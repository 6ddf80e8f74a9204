"""ROS's camera_info, one file an eye: what `camera_info.py` reads of each, as the calibration of a pair."""

from __future__ import annotations

import numpy as np

from flysim.errors import FlysimError
from flysim.geometry.calibration.calibration import Calibration, LevelPair, RawCamera
from flysim.geometry.camera_info import CameraInfo, parse_camera_info


def ros(texts: tuple[str, str], wheres: tuple[str, str]) -> Calibration:
    """The calibration of two camera_info, the left one first.

    Args:
        texts: of the files.
        wheres: they are, for errors.

    Raises:
        FlysimError: one is none, or the two are no left and right eye.
    """
    left, right = (_read(text, where) for text, where in zip(texts, wheres, strict=True))
    assert left.P is not None and right.P is not None  # set at birth
    baseline = left.P[0, 3] / left.P[0, 0] - right.P[0, 3] / right.P[0, 0]
    if not baseline > 0.0:
        raise FlysimError(
            f"{wheres[1]}: projection_matrix must end with -fx B, B > 0 m, got B = {baseline:g} m: it is "
            "no right eye of a pair."
        )
    level = LevelPair(
        left=left.P[:, :3],
        right=right.P[:, :3],
        baseline=float(baseline),
        size=(left.width, left.height),
        turns=(left.R, right.R),
    )
    return Calibration(
        name="ROS", lenses=(raw_camera(left), raw_camera(right)), T_right_left=level.T_right_left(), level=level
    )


def _read(text: str, where: str) -> CameraInfo:
    try:
        return parse_camera_info(text)
    except ValueError as error:
        raise FlysimError(f"{where}: {str(error).removesuffix('.')}.") from None


def raw_camera(info: CameraInfo) -> RawCamera:
    """The camera as it takes pictures, in the names that all formats share."""
    bent = info.D if info.distorts else np.zeros(0)
    model = "fisheye" if info.model == "equidistant" else "brown"
    return RawCamera(K=info.K, size=(info.width, info.height), model=model, distortion=bent)
