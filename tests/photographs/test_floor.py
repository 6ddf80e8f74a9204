"""The floor by hand arithmetic: a plane of flies under a tilted camera, and what is none."""

import numpy as np
import pytest

from flysim.geometry.frames import rotation_rpy, transform
from flysim.photographs.floor import find_floor, without_floor


def plane(height, pitch_deg, roll_deg, rng, n=400):
    """Flies on a floor: points and normals in the optical frame of a camera so high, looking down, rolled."""
    ground = np.column_stack([rng.uniform(-1.5, 1.5, n), np.full(n, height), rng.uniform(1.0, 4.0, n)])
    # Optical frame: x right, y down, z ahead; a turn of the camera by pitch down and roll clockwise.
    R = rotation_rpy(0.0, 0.0, np.radians(roll_deg)).T @ rotation_rpy(np.radians(-pitch_deg), 0.0, 0.0).T
    return ground @ R.T, np.tile((0.0, -1.0, 0.0), (n, 1)) @ R.T, R


@pytest.mark.parametrize(("height", "pitch", "roll"), [(0.3, 0.0, 0.0), (0.5, 25.0, 0.0), (1.2, -10.0, 8.0)])
def test_height_and_tilt_are_those_of_the_camera(height, pitch, roll):
    rng = np.random.default_rng(5)
    points, normals, R = plane(height, pitch, roll, rng)
    clutter = np.column_stack([rng.uniform(-1, 1, 300), rng.uniform(-1.0, 0.5 * height, 300), rng.uniform(1.5, 4, 300)])
    points = np.concatenate([points, clutter @ R.T])
    normals = np.concatenate([normals, np.tile((0.0, 0.0, -1.0), (300, 1)) @ R.T])
    spread = points * 0.002
    floor = find_floor(points, normals, spread, rng=rng)
    assert floor is not None
    assert floor.height == pytest.approx(height, abs=0.002)
    assert (floor.pitch_deg, floor.roll_deg) == pytest.approx((pitch, roll), abs=0.2)
    assert 0.5 < floor.share < 0.65
    assert transform(floor.T_base_left, points[:400])[:, 2] == pytest.approx(0.0, abs=0.005)


def test_a_table_above_the_floor_is_not_the_floor():
    rng = np.random.default_rng(6)
    low, normals, _ = plane(0.8, 15.0, 0.0, rng)
    high, _, _ = plane(0.4, 15.0, 0.0, rng, n=900)
    points = np.concatenate([low, high])
    floor = find_floor(points, np.concatenate([normals, np.tile(normals[0], (900, 1))]), points * 0.002, rng=rng)
    assert floor is not None
    assert floor.height == pytest.approx(0.8, abs=0.01)


def test_a_wall_a_ledge_and_nothing_are_no_floor():
    rng = np.random.default_rng(7)
    wall = np.column_stack([rng.uniform(-1, 1, 300), rng.uniform(-1, 1, 300), np.full(300, 2.0)])
    assert find_floor(wall, np.tile((0.0, 0.0, -1.0), (300, 1)), wall * 0.002, rng=rng) is None
    ledge = np.column_stack([rng.uniform(-1, 1, 300), np.full(300, 0.3), rng.uniform(2.0, 2.1, 300)])
    assert find_floor(ledge, np.tile((0.0, -1.0, 0.0), (300, 1)), ledge * 0.002, rng=rng) is None
    none = np.empty((0, 3))
    assert find_floor(none, none, none, rng=rng) is None
    assert transform(without_floor(wall), wall)[:, 2].min() > 0.0
