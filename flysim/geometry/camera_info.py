"""The calibration of a camera as ROS has it: `sensor_msgs/CameraInfo`, and the YAML its tools read and write.

A stereo pair is two such files: `R` turns each eye into the rectified frame, and `P` of the right one has
`Tx = -fx' B` in its last column (REP 104, `sensor_msgs/CameraInfo`).
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flysim.common.whole_file import write_whole
from flysim.errors import FlysimError, did_you_mean
from flysim.foreign.files import read_text
from flysim.foreign.yaml_text import parse_yaml
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, frozen, se3
from flysim.geometry.rig import StereoRig
from flysim.plain import plain, shown, shown_path

MAX_BYTES = 2**16
MAX_SIDE = 65_535  # [px]
MIN_FOCAL, MAX_NUMBER = 1e-3, 1e6  # [px]: what is beyond is a typing error
MAX_NAME = 200  # characters
# How many coefficients each model of a lens has; plumb_bob is Brown's, equidistant that of OpenCV's fisheye.
MODELS: Mapping[str, tuple[int, ...]] = {"plumb_bob": (0, 4, 5), "rational_polynomial": (8,), "equidistant": (4,)}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CameraInfo:
    """What one camera was calibrated to be; pixel centres at integers, as OpenCV has them.

    Attributes:
        name: of the camera, as "stereo/left".
        width, height: of the images it was calibrated by [px].
        K: `[3, 3]` of the raw image.
        model: of the lens, one of `MODELS`.
        D: its coefficients: k1, k2, p1, p2, k3 for plumb_bob. None at all is a pinhole.
        R: `[3, 3]` turns this camera's optical frame into the rectified one; the unit matrix for a camera alone.
        P: `[3, 4]` projection of the rectified image; `P[0, 3] = -fx' B` for the right eye of a pair.

    Raises:
        ValueError: a figure that is no finite number of its range, or a matrix that is not of its form.
    """

    width: int
    height: int
    K: Array
    name: str = "camera"
    model: str = "plumb_bob"
    D: Array = field(default_factory=lambda: np.zeros(5))
    R: Array = field(default_factory=lambda: np.eye(3))
    P: Array | None = None

    def __post_init__(self) -> None:
        if not (1 <= self.width <= MAX_SIDE and 1 <= self.height <= MAX_SIDE):
            raise ValueError(f"the image must be from 1 to {MAX_SIDE} px a side, got {self.width}x{self.height}")
        if self.model not in MODELS:
            raise ValueError(f"no distortion model {shown(self.model)}. {did_you_mean(self.model, MODELS)}")
        K = _matrix("camera_matrix", self.K, (3, 3))
        P = np.hstack([K, np.zeros((3, 1))]) if self.P is None else _matrix("projection_matrix", self.P, (3, 4))
        R = _matrix("rectification_matrix", self.R, (3, 3))
        D = frozen(self.D, np.float64)
        if D.shape not in [(n,) for n in MODELS[self.model]] or not (np.abs(D) <= MAX_NUMBER).all():
            wanted = " or ".join(str(n) for n in MODELS[self.model] if n)
            raise ValueError(f"a lens of {self.model} has {wanted} finite coefficients, got {D.size}")
        if not np.allclose(R @ R.T, np.eye(3), atol=1e-4) or np.linalg.det(R) < 0.0:
            raise ValueError("rectification_matrix must be a rotation, got one that is not orthonormal, or a mirror")
        for name, value in {"K": K, "R": R, "P": P, "D": D}.items():
            object.__setattr__(self, name, frozen(value))

    @property
    def camera(self) -> Camera:
        """The pinhole of the raw image, its lens left out."""
        return _pinhole(self.K, self.width, self.height)

    @property
    def rectified(self) -> Camera:
        """The pinhole of the rectified image."""
        assert self.P is not None  # set at birth
        return _pinhole(self.P, self.width, self.height)

    @property
    def distorts(self) -> bool:
        """Whether its lens is no pinhole's: an equidistant one always bends."""
        return self.model == "equidistant" or bool(np.any(self.D))


def stereo_rig(left: CameraInfo, right: CameraInfo) -> StereoRig:
    """The two raw pinholes, as they stand by what rectifies them; their lenses are left out.

    Raises:
        ValueError: the two files do not tell where the right eye stands, or it is on the left.
    """
    assert left.P is not None and right.P is not None  # set at birth
    ahead = right.P[0, 3] / right.P[0, 0] - left.P[0, 3] / left.P[0, 0]
    if not ahead < 0.0:
        raise ValueError(
            "projection_matrix of the right eye must have -fx B in its last column, B > 0 m: these are no left and "
            f"right eye of a pair (B = {0.0 - ahead:g} m)"
        )
    T_right = se3(right.R.T @ left.R, right.R.T @ np.array([ahead, 0.0, 0.0]))
    u, _, vt = np.linalg.svd(T_right[:3, :3])  # a file has few digits
    T_right[:3, :3] = u @ vt
    return StereoRig(left=left.camera, right=right.camera, T_right_left=T_right)


def read_camera_info(path: str | Path) -> CameraInfo:
    """Reads a camera's calibration from the YAML of ROS (`camera_calibration`, `camera_info_manager`).

    Raises:
        FlysimError: the file cannot be read, is no such YAML, or has a figure that cannot be.
    """
    path = Path(path)
    where, text = shown_path(path), read_text(path, "calibration", MAX_BYTES)
    try:
        return parse_camera_info(text)
    except ValueError as error:
        raise FlysimError(f"{where}: {str(error).removesuffix('.')}.") from error


def parse_camera_info(text: str) -> CameraInfo:
    """As `read_camera_info`, of a text.

    Raises:
        ValueError: as `read_camera_info`.
    """
    data = parse_yaml(text)
    if not isinstance(data, dict) or "camera_matrix" not in data:
        raise ValueError("no camera_info of ROS: it needs image_width, image_height, camera_matrix, ...")
    model = data.get("distortion_model") or "plumb_bob"
    more: dict[str, Any] = {
        key: _values(data, name)
        for key, name in {"R": "rectification_matrix", "P": "projection_matrix"}.items()
        if data.get(name) is not None
    }
    if data.get("distortion_coefficients") is not None:
        more["D"] = _values(data, "distortion_coefficients").ravel()
    return CameraInfo(
        name=plain(str(data.get("camera_name") or "camera"))[:MAX_NAME],
        width=_pixels(data, "image_width"),
        height=_pixels(data, "image_height"),
        K=_values(data, "camera_matrix"),
        model=str(model),
        **more,
    )


def write_camera_info(path: str | Path, info: CameraInfo) -> None:
    """Writes the YAML of ROS, whole or not at all.

    Raises:
        OSError: it cannot be written.
    """
    write_whole(Path(path), camera_info_yaml(info))


def camera_info_yaml(info: CameraInfo) -> str:
    """A calibration as the YAML that ROS tools read."""
    name = info.name if re.fullmatch(r"[A-Za-z][\w/-]*", info.name) else json.dumps(plain(info.name))
    lines = [f"image_width: {info.width}", f"image_height: {info.height}", f"camera_name: {name}"]
    assert info.P is not None  # set at birth
    for key, matrix in (
        ("camera_matrix", info.K),
        ("distortion_coefficients", info.D[None]),
        ("rectification_matrix", info.R),
        ("projection_matrix", info.P),
    ):
        if key == "distortion_coefficients":
            lines.append(f"distortion_model: {info.model}")
        values = ", ".join(map(_written, matrix.ravel()))
        lines += [f"{key}:", f"  rows: {matrix.shape[0]}", f"  cols: {matrix.shape[1]}", f"  data: [{values}]"]
    return "\n".join(lines) + "\n"


def _written(value: float) -> str:
    """A number with all its digits, and a dot before its exponent: without one YAML 1.1 has it for text."""
    text = repr(float(value))
    return text if "." in text else text.replace("e", ".0e")


def _pinhole(K: Array, width: int, height: int) -> Camera:
    return Camera(width=width, height=height, fx=K[0, 0], fy=K[1, 1], cx=K[0, 2], cy=K[1, 2])


def _matrix(name: str, values: ArrayLike, shape: tuple[int, int]) -> Array:
    M = np.asarray(values, np.float64)
    if M.shape != shape or not (np.abs(M) <= MAX_NUMBER).all():  # of NaN too
        raise ValueError(f"{name} must hold {shape[0]}x{shape[1]} numbers up to {MAX_NUMBER:g}")
    if name == "rectification_matrix":
        return M
    if min(M[0, 0], M[1, 1]) < MIN_FOCAL:
        raise ValueError(f"{name} must have focal lengths of at least {MIN_FOCAL} px: was the camera calibrated?")
    if M[0, 1] or M[1, 0] or list(M[2, :3]) != [0.0, 0.0, 1.0]:
        raise ValueError(f"{name} must be fx 0 cx; 0 fy cy; 0 0 1")
    return M


def _pixels(data: dict[str, Any], name: str) -> int:
    value = data.get(name)
    if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= MAX_SIDE:
        raise ValueError(f"{name} must be a whole number of pixels, 1 to {MAX_SIDE}, got {shown(str(value))}")
    return value


def _values(data: dict[str, Any], name: str) -> Array:
    """A matrix as ROS writes it (rows, cols, data), or its numbers in a row."""
    table = data.get(name)
    given = table.get("data") if isinstance(table, dict) else table
    if not isinstance(given, Sequence) or isinstance(given, str):
        raise ValueError(f"{name} needs rows, cols and a list of data")
    values = np.array([_number(one, name) for one in given])
    if not isinstance(table, dict):
        return values.reshape(_shape(name, values.size))
    rows, cols = table.get("rows"), table.get("cols")
    counts = all(isinstance(n, int) and not isinstance(n, bool) and 0 <= n <= MAX_BYTES for n in (rows, cols))
    if not counts or rows * cols != len(values):  # type: ignore[operator]
        raise ValueError(f"{name} says {shown(f'{rows}x{cols}')} numbers and has {len(values)}")
    return values.reshape(rows, cols)  # type: ignore[arg-type]


def _shape(name: str, size: int) -> tuple[int, ...]:
    wanted = {"camera_matrix": (3, 3), "rectification_matrix": (3, 3), "projection_matrix": (3, 4)}.get(name, (size,))
    if math.prod(wanted) != size:
        raise ValueError(f"{name} must hold {'x'.join(map(str, wanted))} numbers, got {size}")
    return wanted


def _number(value: Any, name: str) -> float:
    if isinstance(value, str):  # 1e-05 is text to YAML 1.1
        value = float(value) if re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d{1,3})?", value) else None
    if not isinstance(value, int | float) or isinstance(value, bool) or not abs(value) <= MAX_NUMBER:
        raise ValueError(f"{name} must hold numbers up to {MAX_NUMBER:g}, got {shown(str(value))}")
    return float(value)
