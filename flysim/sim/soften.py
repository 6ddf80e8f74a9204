"""Textures for TinyRenderer, which samples the nearest texel and would turn finer detail into noise."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np

from flysim.world.mesh import TriangleMesh

# [m] standard deviation of the blur: what is finer than a pixel at 2.5 m is gone. A texture mapped by mipmaps, as the
# `gl` renderer does it, chooses this by distance; here one size has to serve.
BLUR = 0.004


def softened(texture: Path, mesh: TriangleMesh, folder: Path, name: str) -> Path:
    """A blurred copy of a texture in `folder`, blurred by BLUR on the surface that it covers."""
    image = cv2.imdecode(np.frombuffer(texture.read_bytes(), np.uint8), cv2.IMREAD_COLOR)
    assert image is not None, texture  # the world's reader has decoded it before
    sigma = BLUR / max(metres_per_texel(mesh, image.shape[1], image.shape[0]), 1e-9)
    # Blurs below half a texel change nothing, those above an eighth of the image would leave nothing.
    soft = cv2.GaussianBlur(image, (0, 0), float(np.clip(sigma, 0.3, min(image.shape[:2]) / 8.0 + 0.3)))
    path = folder / f"{name}.png"
    path.write_bytes(cv2.imencode(".png", soft)[1].tobytes())  # cv2's own writer says nothing of a full disk
    return path


def metres_per_texel(mesh: TriangleMesh, width: int, height: int) -> float:
    """Mean side of a texel of a `width` x `height` texture on a mesh [m]."""
    corners, uv = mesh.vertices[mesh.faces].astype(np.float64), mesh.uv[mesh.faces].astype(np.float64)
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    texels = 0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() * width * height
    return math.sqrt(area / max(texels, 1e-12))
