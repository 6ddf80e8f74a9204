"""Clouds of flies as an evolution leaves them on the faces that an eye sees, without any image."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from flysim.geometry.frames import Pose2, transform
from flysim.obstacles.reach import LONGEST
from flysim.products.cloud import FlyCloud

FOCAL_PX, BASELINE = 502.0, 0.12  # the rover's
REACH_PX = 2
MATCH_PX = 0.04  # how well a fly is placed, where `spread` promises 0.1 px
NORMAL_DEG = 4.0


def on_face(rng, n, center, along, up, normal, eye, *, ends=(True, True)):
    """Flies on a rectangle: `along` and `up` are its half axes [m].

    `ends` says along which of the two axes the surface ends with the rectangle.
    """
    z = np.linalg.norm(eye - center)
    pixel = z / FOCAL_PX
    unit = [axis / np.linalg.norm(axis) for axis in (along, up)]
    half = [np.linalg.norm(axis) for axis in (along, up)]
    # The outermost flies are those whose window ends with the face.
    places = [rng.uniform(-1, 1, (n, 1)) * max(h - REACH_PX * pixel, 0.2 * h) for h in half]
    points = center + places[0] * unit[0] + places[1] * unit[1]
    sight = points - eye
    spread = sight * (0.1 * np.linalg.norm(sight, axis=1, keepdims=True) / (FOCAL_PX * BASELINE))
    shift = spread * (MATCH_PX / 0.1) * rng.normal(size=(n, 1))
    normals = normal + np.radians(NORMAL_DEG) * rng.normal(size=(n, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = points + shift
    arms, steps, ended = [], [], []
    for place, u, h, closed in zip(places, unit, half, ends, strict=True):
        for sign in (1.0, -1.0):
            room = np.floor((h - sign * place) / pixel)  # the last whole pixel on the face
            arms.append(points + sign * u * pixel * np.clip(room, 0, LONGEST))
            steps.append(np.tile(sign * u * pixel, (n, 1)))
            ended.append((room <= LONGEST - 2)[:, 0] & closed)
    return points, normals, spread, np.stack(arms, axis=1), np.stack(steps, axis=1), np.stack(ended, axis=1)


def box_faces(size, pose):
    """(name, centre, half axis, half axis, normal) of the faces of a box that stands on the floor."""
    length, width, height = size
    T = pose.matrix
    x, y, z = T[:3, 0], T[:3, 1], T[:3, 2]
    middle = T[:3, 3] + height / 2 * z
    X, Y, Z = x * length / 2, y * width / 2, z * height / 2
    return [
        ("+x", middle + X, Y, Z, x),
        ("-x", middle - X, Y, Z, -x),
        ("+y", middle + Y, X, Z, y),
        ("-y", middle - Y, X, Z, -y),
        ("top", middle + Z, X, Y, z),
    ]


def joined(parts):
    return [np.concatenate([part[k] for part in parts]) for k in range(6)]


def cloud_of(parts) -> FlyCloud:
    """A cloud of [(points, normals, spread, arms, steps, ended), ...]."""
    points, normals, spread, arms, steps, ended = joined(parts)
    n = len(points)
    return FlyCloud(
        points=points,
        normals=normals,
        spread=spread,
        arms=arms,
        steps=steps,
        ended=ended,
        fitness=np.full(n, 10.0, np.float32),
        stop=np.zeros(n, np.int32),
        uv=np.zeros((n, 2), np.float32),
        uv_right=np.zeros((n, 2), np.float32),
        rgb=np.zeros((n, 3), np.uint8),
    )


def count(density, along, up):
    """Flies on a face: `density` a square metre, 60 at least."""
    return max(60, round(density * 4 * np.linalg.norm(along) * np.linalg.norm(up)))


def box(size, pose, eyes, *, density=800.0, seed=0):
    """Parts of a cloud: a box seen from eyes."""
    rng = np.random.default_rng(seed)
    parts = []
    for eye in np.atleast_2d(np.asarray(eyes, dtype=float)):
        for _, center, along, up, normal in box_faces(size, pose):
            if normal @ (eye - center) > 0.2 * np.linalg.norm(eye - center):  # not at a grazing angle
                parts.append(on_face(rng, count(density, along, up), center, along, up, normal, eye))
    return parts


def faces(size, pose, names, *, density=800.0, seed=0, stray=0.0, scale=0.1):
    """Parts of a cloud: the named faces of a box, each seen from 2.2 m before it and a little above.

    A share `stray` of the flies lies astray: about `scale` metres from where they belong, and leaning anyhow.
    """
    rng = np.random.default_rng(seed)
    parts = [
        on_face(rng, count(density, along, up), center, along, up, normal, center + 2.2 * normal + (0.0, 0.0, 0.6))
        for name, center, along, up, normal in box_faces(size, pose)
        if name in names
    ]
    if stray > 0.0:
        points, normals, spread, arms, steps, ended = joined(parts)
        n = round(stray * len(points))
        who = rng.integers(0, len(points), n)
        shift = scale * rng.normal(size=(n, 3))
        # Slanted at random, but towards the eye: no camera sees a surface from behind.
        leaning = normals[who] + rng.normal(size=(n, 3))
        leaning *= -np.sign((leaning * spread[who]).sum(axis=1, keepdims=True))
        leaning /= np.linalg.norm(leaning, axis=1, keepdims=True)
        parts.append((points[who] + shift, leaning, spread[who], arms[who] + shift[:, None], steps[who], ended[who]))
    return parts


def cylinder(radius, height, pose, eyes, *, flies=300, seed=0):
    """Parts of a cloud: an upright cylinder's side and top."""
    rng = np.random.default_rng(seed)
    parts, z = [], np.array([0.0, 0.0, 1.0])
    for eye in np.atleast_2d(np.asarray(eyes, dtype=float)):
        way = eye[:2] - (pose.x, pose.y)
        towards = np.arctan2(way[1], way[0])
        for _ in range(flies // 10):
            angle = towards + rng.uniform(-1.2, 1.2)
            normal = np.array([np.cos(angle), np.sin(angle), 0.0])
            center = np.array([pose.x, pose.y, height / 2]) + radius * normal
            side = np.array([-normal[1], normal[0], 0.0]) * 0.002
            parts.append(on_face(rng, 10, center, side, z * height / 2, normal, eye, ends=(False, True)))
        if eye[2] > height:
            center = np.array([pose.x, pose.y, height])
            half = radius / np.sqrt(2.0)
            parts.append(on_face(rng, flies // 3, center, half * np.eye(3)[0], half * np.eye(3)[1], z, eye))
    return parts


def ground(extent, eye, *, flies=500, seed=0):
    rng = np.random.default_rng(seed)
    X, Y, Z = np.eye(3)
    return [on_face(rng, flies, np.zeros(3), extent * X, extent * Y, Z, np.asarray(eye, dtype=float))]


def moved(parts, pose: Pose2):
    """The same parts in another frame."""
    T = pose.matrix
    R = T[:3, :3].T
    return [
        (transform(T, p), n @ R, s @ R, transform(T, a.reshape(-1, 3)).reshape(a.shape), d @ R, e)
        for p, n, s, a, d, e in parts
    ]


@pytest.fixture(scope="session")
def flies():
    """The tools of this file."""
    return SimpleNamespace(
        box=box,
        faces=faces,
        cylinder=cylinder,
        ground=ground,
        cloud_of=cloud_of,
        box_faces=box_faces,
        moved=moved,
        on_face=on_face,
    )
