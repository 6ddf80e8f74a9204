"""EuRoC's sensor.yaml, one file an eye: a pinhole, its distortion, and where it sits on the body.

Burri et al., "The EuRoC micro aerial vehicle datasets", IJRR 2016. Lengths are in metres.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from flysim.errors import FlysimError
from flysim.foreign.yaml_text import parse_yaml
from flysim.geometry.calibration.calibration import Calibration, RawCamera, numbers, rotation, whole_sides
from flysim.geometry.frames import Array, inverse, se3
from flysim.plain import shown

MODELS = {"radial-tangential": "brown", "radtan": "brown", "equidistant": "fisheye", "none": "brown"}


def euroc(left: str, right: str, where: tuple[str, str]) -> Calibration:
    """The calibration of two sensor.yaml.

    Args:
        left, right: texts of the files.
        where: they are, for errors.

    Raises:
        FlysimError: a key is missing or nonsense.
    """
    lenses, poses = [], []
    for text, place in zip((left, right), where, strict=True):
        data = _data(text, place)
        lenses.append(_lens(data, place))
        poses.append(_pose(data, place))
    return Calibration(name="EuRoC", lenses=(lenses[0], lenses[1]), T_right_left=inverse(poses[1]) @ poses[0])


def _data(text: str, where: str) -> dict[str, Any]:
    try:
        data = parse_yaml(text)
    except ValueError as refusal:
        raise FlysimError(f"{where}: cannot read the calibration: {refusal}.") from None
    if not isinstance(data, dict) or not {"intrinsics", "T_BS"} <= data.keys():
        raise FlysimError(f"{where}: needs the keys intrinsics, resolution, T_BS of a sensor.yaml of EuRoC.")
    return data


def _lens(data: dict[str, Any], where: str) -> RawCamera:
    fx, fy, cx, cy = numbers(data["intrinsics"], 4, "intrinsics", where)
    model = str(data.get("distortion_model", "none")).lower()
    if model not in MODELS or str(data.get("camera_model", "pinhole")) != "pinhole":
        told = data.get("camera_model", "pinhole") if model in MODELS else model
        raise FlysimError(f"{where}: a camera of {shown(str(told))}: pinhole with {', '.join(MODELS)} is read.")
    size = data.get("resolution") or [None, None]
    if not isinstance(size, list) or len(size) != 2:
        raise FlysimError(f"{where}: resolution must be [width, height], got {shown(str(size))}.")
    return RawCamera(
        K=np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]),
        size=whole_sides(size, where),
        model="fisheye" if MODELS[model] == "fisheye" else "brown",
        distortion=numbers(data.get("distortion_coefficients"), (0, 4, 5, 8), "distortion_coefficients", where),
    )


def _pose(data: dict[str, Any], where: str) -> Array:
    given = data["T_BS"]
    values = numbers(given.get("data") if isinstance(given, dict) else given, 16, "T_BS", where).reshape(4, 4)
    return se3(rotation(values[:3, :3], "T_BS", where), values[:3, 3])
