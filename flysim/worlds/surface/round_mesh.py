"""Round shapes that flysim has no exact form of, as fine meshes: capsules, cones and ellipsoids."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flysim.geometry.frames import Array
from flysim.worlds.shapes import Mesh

SIDES = 48  # chords are at most 0.2 % of the radius inside


def round_mesh(kind: str, half: tuple[float, float, float], path: Path) -> Mesh:
    """A `capsule`, `cone` or `ellipsoid` about its centre, its axis along z.

    Args:
        kind: which of them.
        half: half of its extent along x, y, z [m]; of a capsule the last is half of what is between its caps.
        path: of the file it stands in, for messages.
    """
    rx, ry, rz = half
    turn = np.arange(SIDES // 4 + 1) * (np.pi / 2.0 / (SIDES // 4))
    rise = np.stack([np.sin(turn), -np.cos(turn)], axis=1)  # radius and height from the lower pole to the equator
    if kind == "cone":
        profile = np.array([[0.0, -rz], [rx, -rz], [0.0, rz]])
    elif kind == "capsule":
        lower = rise * rx - [0.0, rz]
        profile = np.concatenate([lower, lower[::-1] * [1.0, -1.0]])
    else:
        lower = rise * [rx, rz]
        profile = np.concatenate([lower, lower[-2::-1] * [1.0, -1.0]])
    return _turned(profile, ry / rx, path)


def _turned(profile: Array, squeeze: float, path: Path) -> Mesh:
    """The surface that a profile `[n, 2]` of radius and height, from the lower to the upper axis, makes round z."""
    angle = np.arange(SIDES) * (2.0 * np.pi / SIDES)
    ring = np.stack([np.cos(angle), np.sin(angle) * squeeze], axis=1)
    vertices = np.concatenate([np.c_[ring * radius, np.full(SIDES, z)] for radius, z in profile.tolist()])
    faces = []
    for k in range(len(profile) - 1):
        a = k * SIDES + np.arange(SIDES)
        b = k * SIDES + (np.arange(SIDES) + 1) % SIDES
        faces += [np.stack([a, b, b + SIDES], axis=1), np.stack([a, b + SIDES, a + SIDES], axis=1)]
    used = np.concatenate(faces)
    corners = vertices[used]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return Mesh(vertices=vertices, faces=used[area > 1e-12 * area.max()].astype(np.int32), uv=None, path=path)
