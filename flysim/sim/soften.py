"""Textures for TinyRenderer, which samples the nearest texel and would turn finer detail into noise."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.worlds.surface.mesh import TriangleMesh

# [m] standard deviation of the blur: what is finer than a pixel at 2.5 m is gone. A texture mapped by mipmaps, as the
# `gl` renderer does it, chooses this by distance; here one size has to serve.
BLUR = 0.004


def softened(texture: NDArray[np.uint8], mesh: TriangleMesh) -> NDArray[np.uint8]:
    """A `[H, W, 3]` texture, blurred by BLUR on the surface that it covers."""
    height, width = texture.shape[:2]
    sigma = BLUR / max(metres_per_texel(mesh, width, height), 1e-9)
    # Blurs below half a texel change nothing, those above an eighth of the image would leave nothing.
    soft = cv2.GaussianBlur(texture, (0, 0), float(np.clip(sigma, 0.3, min(height, width) / 8.0 + 0.3)))
    return np.asarray(soft, np.uint8)


def metres_per_texel(mesh: TriangleMesh, width: int, height: int) -> float:
    """Mean side of a texel of a `width` x `height` texture on a mesh [m]."""
    corners, uv = mesh.vertices[mesh.faces].astype(np.float64), mesh.uv[mesh.faces].astype(np.float64)
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    texels = 0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() * width * height
    return math.sqrt(area / max(texels, 1e-12))
