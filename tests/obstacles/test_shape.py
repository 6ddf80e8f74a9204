import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flysim.geometry.frames import Pose2
from flysim.obstacles.parameters import ObstacleParams
from flysim.obstacles.round import fit_circle, fit_sphere
from flysim.obstacles.shape import fit_solid

UP = (0.0, 0.0, 1.0)


def solid(cloud, **changed):
    return fit_solid(cloud, np.arange(len(cloud.points)), ObstacleParams(**changed))


def eyes(x, y, turns=(0.0, 2.1, 4.2), z=0.9):
    return [(x + 2.2 * math.cos(a), y + 2.2 * math.sin(a), z) for a in turns]


def ball(flies, radius, x, y, turns, *, n=150, seed=0):
    """Parts of a cloud on a sphere that lies on the floor: small faces about its middle height and above."""
    rng = np.random.default_rng(seed)
    parts = []
    for eye in eyes(x, y, turns):
        towards = math.atan2(eye[1] - y, eye[0] - x)
        for _ in range(n // 5):
            turn, rise = towards + rng.uniform(-1.1, 1.1), rng.uniform(-0.5, 1.2)
            normal = np.array([math.cos(turn) * math.cos(rise), math.sin(turn) * math.cos(rise), math.sin(rise)])
            side = np.array([-math.sin(turn), math.cos(turn), 0.0])
            tangent = [0.002 * side, 0.002 * np.cross(normal, side)]
            center = np.array([x, y, radius]) + radius * normal
            parts.append(flies.on_face(rng, 5, center, *tangent, normal, np.array(eye), ends=(False, False)))
    return parts


@settings(max_examples=20, deadline=None)
@given(st.floats(0.04, 0.4), st.floats(0.2, 0.9), st.integers(0, 100))
def test_a_cylinder_has_its_diameter_and_height(flies, radius, height, seed):
    pose = Pose2(2.0, 1.0, 0.0)
    found = solid(flies.cloud_of(flies.cylinder(radius, height, pose, eyes(2.0, 1.0, z=height + 0.3), seed=seed)))
    assert (found.shape, found.yaw) == ("cylinder", 0.0)  # it has no heading
    np.testing.assert_allclose(found.size, (2 * radius, 2 * radius, height), atol=0.006)
    np.testing.assert_allclose(found.center, (2.0, 1.0, height / 2), atol=0.004)


@pytest.mark.parametrize("radius", [0.12, 0.25])
def test_a_cylinder_seen_from_one_side_still_has_its_diameter(flies, radius):
    found = solid(flies.cloud_of(flies.cylinder(radius, 0.5, Pose2(2.0, 1.0, 0.0), eyes(2.0, 1.0, (0.4,)))))
    assert found.shape == "cylinder"
    np.testing.assert_allclose(found.size[:2], 2 * radius, atol=0.006)
    np.testing.assert_allclose(found.center[:2], (2.0, 1.0), atol=0.004)


@pytest.mark.parametrize("radius", [0.12, 0.3])
@pytest.mark.parametrize("turns", [(0.0, 2.1, 4.2), (1.0,)])
def test_a_sphere_has_its_diameter(flies, radius, turns):
    found = solid(flies.cloud_of(ball(flies, radius, 2.0, 1.0, turns)))
    assert found.shape == "sphere"
    np.testing.assert_allclose(found.size, 2 * radius, atol=0.006)
    np.testing.assert_allclose(found.center, (2.0, 1.0, radius), atol=0.004)
    assert found.yaw == 0.0  # it has none


@settings(max_examples=20, deadline=None)
@given(
    st.tuples(st.floats(0.2, 0.8), st.floats(0.2, 0.8), st.floats(0.2, 0.8)),
    st.floats(-1.5, 1.5),
    st.integers(0, 100),
    st.booleans(),
)
def test_a_box_is_no_round_thing(flies, size, yaw, seed, whole):
    seen = ("+x", "-x", "+y", "-y", "top") if whole else ("+x", "-y", "top")
    found = solid(flies.cloud_of(flies.faces(size, Pose2(2.0, 1.0, yaw), seen, seed=seed)))
    assert found.shape == "box"


def test_two_boxes_that_make_an_l_are_something_else_in_their_common_box(flies):
    faces = ("+x", "-x", "+y", "-y", "top")
    long = flies.faces((0.9, 0.2, 0.4), Pose2(0.0, 0.0, 0.0), faces)
    short = flies.faces((0.2, 0.7, 0.4), Pose2(-0.35, 0.45, 0.0), faces)
    found = solid(flies.cloud_of(long + short))
    assert found.shape == "other"
    np.testing.assert_allclose(found.size, (0.9, 0.9, 0.4), atol=0.01)
    np.testing.assert_allclose(found.center[:2], (0.0, 0.35), atol=0.01)


def test_too_few_flies_or_too_little_of_a_circle_make_nothing_round():
    turn = np.linspace(0.0, math.radians(70.0), 200)
    side = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    little = 0.3 * side + (0.0, 0.0, 0.2)
    spread = np.full_like(little, 0.001)
    assert fit_circle(little, side, spread) is None
    assert fit_sphere(little, spread) is None
    turn = np.linspace(0.0, math.radians(180.0), 11)
    side = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    assert fit_circle(0.3 * side, side, np.full_like(side, 0.001)) is None


def test_where_round_things_are_not_looked_for_all_are_boxes(flies):
    cloud = flies.cloud_of(flies.cylinder(0.2, 0.5, Pose2(2.0, 1.0, 0.0), eyes(2.0, 1.0)))
    assert solid(cloud).shape == "cylinder"
    assert solid(cloud, round=False).shape == "box"


@pytest.mark.parametrize(("share", "shape"), [(0.02, "box"), (0.05, "other")])
def test_flies_deep_within_make_a_box_something_else(flies, share, shape):
    """What an L's inner sides, and the legs under a slab, hold; a few may be astray."""
    parts = flies.box((0.6, 0.5, 0.4), Pose2(0.0, 0.0, 0.0), eyes(0.0, 0.0))
    cloud = flies.cloud_of(parts)
    rng, points = np.random.default_rng(3), cloud.points.copy()
    deep = rng.choice(len(points), round(share * len(points)), replace=False)
    points[deep] = rng.uniform((-0.2, -0.15, 0.1), (0.2, 0.15, 0.3), (len(deep), 3))
    moved = dataclasses.replace(cloud, points=points)
    found = solid(moved)
    assert found.shape == shape
    np.testing.assert_allclose(found.size, (0.6, 0.5, 0.4), atol=0.01)


def test_unsure_flies_within_a_box_say_nothing(flies):
    cloud = flies.cloud_of(flies.box((0.6, 0.5, 0.4), Pose2(0.0, 0.0, 0.0), eyes(0.0, 0.0)))
    rng, points, spread = np.random.default_rng(3), cloud.points.copy(), cloud.spread.copy()
    deep = rng.choice(len(points), round(0.05 * len(points)), replace=False)
    points[deep] += 0.06 * -cloud.normals[deep]
    spread[deep] *= 0.04 / np.linalg.norm(spread[deep], axis=1, keepdims=True)
    assert solid(dataclasses.replace(cloud, points=points)).shape == "other"
    assert solid(dataclasses.replace(cloud, points=points, spread=spread)).shape == "box"
