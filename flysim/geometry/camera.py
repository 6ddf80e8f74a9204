"""The pinhole camera: pixel centres at integers, as OpenCV has them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from flysim.geometry.frames import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Camera:
    """Intrinsics without distortion. The optical frame has x right, y down, z forward.

    Raises:
        ValueError: a size below 1 px, a focal length that is not positive, or a NaN.
    """

    width: int  # [px]
    height: int  # [px]
    fx: float  # [px]
    fy: float  # [px]
    cx: float  # [px] principal point; 0 is the centre of the first pixel
    cy: float  # [px]

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise ValueError(f"an image must be at least 1x1 px, got {self.width}x{self.height}")
        for name in ("fx", "fy", "cx", "cy"):
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"{name} must be finite, got {getattr(self, name)}")
        if self.fx <= 0 or self.fy <= 0:
            raise ValueError(f"focal lengths must be > 0 px, got fx={self.fx}, fy={self.fy}")

    @classmethod
    def from_fov(cls, width: int, height: int, horizontal_fov: float) -> Camera:
        """Square pixels, principal point in the middle of the image, `horizontal_fov` in rad (Gazebo's tag)."""
        if not 0.0 < horizontal_fov < math.pi:
            raise ValueError(f"horizontal_fov must be in (0, pi) rad, got {horizontal_fov}")
        f = width / 2.0 / math.tan(horizontal_fov / 2.0)
        return cls(width=width, height=height, fx=f, fy=f, cx=(width - 1) / 2.0, cy=(height - 1) / 2.0)

    def resized(self, width: int, height: int, *, stretched: bool = False) -> Camera:
        """The camera with an image of another size, which shows the same across.

        Args:
            width: [px]
            height: [px]
            stretched: it shows the same above and below as well, so that pixels change their shape; otherwise they keep
                it, and what is above and below the middle is cut or grows.
        """
        a = width / self.width
        b, more = (height / self.height, 0.0) if stretched else (a, (height - self.height * a) / 2.0)
        # An image begins half a pixel before its first pixel's centre.
        return Camera(
            width=width,
            height=height,
            fx=self.fx * a,
            fy=self.fy * b,
            cx=(self.cx + 0.5) * a - 0.5,
            cy=(self.cy + 0.5) * b - 0.5 + more,
        )

    @property
    def K(self) -> Array:
        """`[3, 3]` calibration matrix."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    def project(self, points_optical: ArrayLike) -> Array:
        """`[N, 2]` pixels (u, v) of `[N, 3]` points [m]; NaN where a point is not in front of the camera."""
        p = np.asarray(points_optical, dtype=np.float64)
        z = np.where(p[..., 2] > 0.0, p[..., 2], np.nan)
        return np.stack([self.fx * p[..., 0] / z + self.cx, self.fy * p[..., 1] / z + self.cy], axis=-1)

    def unproject(self, uv: ArrayLike, depth: ArrayLike) -> Array:
        """`[N, 3]` points [m, optical frame] of `[N, 2]` pixels at depths along the axis `[N]` [m]."""
        uv = np.asarray(uv, dtype=np.float64)
        z = np.asarray(depth, dtype=np.float64)
        x = (uv[..., 0] - self.cx) / self.fx * z
        y = (uv[..., 1] - self.cy) / self.fy * z
        return np.stack([x, y, np.broadcast_to(z, x.shape)], axis=-1)

    def contains(self, uv: ArrayLike, margin: float = 0.0) -> np.ndarray:
        """`[N]` bool: the pixel lies in the image, `margin` px away from its border. NaN is outside."""
        uv = np.asarray(uv, dtype=np.float64)
        u, v = uv[..., 0], uv[..., 1]
        inside = (u >= margin) & (u <= self.width - 1 - margin)
        return inside & (v >= margin) & (v <= self.height - 1 - margin)
