"""Two cameras with a known relative pose, and the pair of images they take."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, frozen, se3, transform


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StereoRig:
    """A stereo rig: `p_right = T_right_left @ p_left`, both in optical frames [m].

    Raises:
        ValueError: the transform is not rigid and finite, or the baseline is zero.
    """

    left: Camera
    right: Camera
    T_right_left: Array  # [4, 4]

    def __post_init__(self) -> None:
        T = frozen(self.T_right_left, np.float64)
        if T.shape != (4, 4) or not np.isfinite(T).all():
            raise ValueError(f"T_right_left must be a finite 4x4 matrix, got {T.tolist()}")
        if not np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-6) or np.linalg.det(T[:3, :3]) < 0.0:
            raise ValueError("T_right_left must hold a rotation, got a matrix that is not orthonormal, or a mirror")
        if not np.allclose(T[3], (0.0, 0.0, 0.0, 1.0), atol=1e-9):
            raise ValueError(f"T_right_left must have the last row 0 0 0 1, got {T[3].tolist()}")
        if np.linalg.norm(T[:3, 3]) < 1e-9:
            raise ValueError("the baseline must be > 0 m, got 0: two cameras in one place see no depth")
        object.__setattr__(self, "T_right_left", T)

    @classmethod
    def parallel(cls, camera: Camera, baseline: float) -> StereoRig:
        """A rectified rig: two equal cameras, the right one `baseline` metres along the left one's x axis."""
        return cls(left=camera, right=camera, T_right_left=se3(np.eye(3), (-baseline, 0.0, 0.0)))

    def resized(self, width: int, height: int, *, stretched: bool = False) -> StereoRig:
        """The same two cameras with images of another size [px], as `Camera.resized`."""
        left, right = (camera.resized(width, height, stretched=stretched) for camera in (self.left, self.right))
        return replace(self, left=left, right=right)

    @property
    def baseline(self) -> float:
        """Distance between the optical centres [m]."""
        return float(np.linalg.norm(self.T_right_left[:3, 3]))

    @property
    def rectified(self) -> bool:
        """Whether the epipolar lines are the image rows: equal rotation, focal length, cy and a sideways baseline."""
        T = self.T_right_left
        same = self.left.fy == self.right.fy and self.left.cy == self.right.cy and self.left.fx == self.right.fx
        return bool(same and np.allclose(T[:3, :3], np.eye(3), atol=1e-9) and np.allclose(T[1:3, 3], 0.0, atol=1e-9))

    def project(self, points_left: Array) -> tuple[Array, Array]:
        """`[N, 2]` pixels in the left and in the right image of `[N, 3]` points [m, left optical frame]."""
        return self.left.project(points_left), self.right.project(transform(self.T_right_left, points_left))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ImagePair:
    """What the two cameras saw at one instant: `[H, W, 3]` uint8 RGB each, read-only.

    Raises:
        ValueError: an image is not 8-bit RGB, or its size is not its camera's.
    """

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    rig: StereoRig

    def __post_init__(self) -> None:
        for side, image, camera in (
            ("left", self.left, self.rig.left),
            ("right", self.right, self.rig.right),
        ):
            if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3:
                raise ValueError(f"the {side} image must be [H, W, 3] uint8 RGB, got {image.shape} {image.dtype}")
            if image.shape[:2] != (camera.height, camera.width):
                got = f"{image.shape[1]}x{image.shape[0]}"
                raise ValueError(f"the {side} image is {got} px, its camera {camera.width}x{camera.height}")
            object.__setattr__(self, side, frozen(image))
