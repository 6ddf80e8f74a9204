import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flysim.geometry.frames import Pose2
from flysim.obstacles.box import fit_box

TRIM = 0.003
EVERY_SIDE = ("+x", "-x", "+y", "-y", "top")
sizes = st.tuples(st.floats(0.45, 0.9), st.floats(0.15, 0.4), st.floats(0.15, 0.8))
yaws = st.floats(-1.57, 1.57)


@pytest.fixture(scope="module")
def seen(flies):
    """A function: the cloud on the named faces of a box, each seen from 2.2 m before and a little above it."""

    def cloud(size, pose, faces=EVERY_SIDE, *, seed=0, density=500.0, stray=0.0):
        return flies.cloud_of(flies.faces(size, pose, faces, seed=seed, density=density, stray=stray))

    return cloud


def fit(cloud):
    return fit_box(cloud, np.arange(len(cloud.points)), TRIM)


def half_turn(angle):
    """The angle in [-pi/2, pi/2): a box turned by half a turn is the same box."""
    return (angle + math.pi / 2) % math.pi - math.pi / 2


def face_errors(center, size, pose, true_size):
    """How far each face lies outside the true one [m], the box taken along its true axes."""
    x, y = np.array([math.cos(pose.yaw), math.sin(pose.yaw)]), np.array([-math.sin(pose.yaw), math.cos(pose.yaw)])
    d = center[:2] - (pose.x, pose.y)
    return {
        "+x": d @ x + size[0] / 2 - true_size[0] / 2,
        "-x": -d @ x + size[0] / 2 - true_size[0] / 2,
        "+y": d @ y + size[1] / 2 - true_size[1] / 2,
        "-y": -d @ y + size[1] / 2 - true_size[1] / 2,
        "top": size[2] - true_size[2],
    }


@settings(max_examples=40, deadline=None)
@given(sizes, yaws, st.floats(-3, 3), st.floats(-3, 3), st.integers(0, 1000))
def test_a_box_seen_from_all_sides_is_recovered(seen, true_size, yaw, x, y, seed):
    center, size, found = fit(seen(true_size, Pose2(x, y, yaw), seed=seed))
    np.testing.assert_allclose(size, true_size, atol=0.004)
    np.testing.assert_allclose(center, (x, y, true_size[2] / 2), atol=0.003)
    assert abs(half_turn(found - yaw)) < math.radians(1.0)


@settings(max_examples=40, deadline=None)
@given(sizes, yaws, st.sampled_from(EVERY_SIDE[:4]), st.integers(0, 1000))
def test_an_unseen_face_is_where_the_flies_on_its_neighbours_end(seen, true_size, yaw, unseen, seed):
    pose = Pose2(2.0, 1.0, yaw)
    center, size, found = fit(seen(true_size, pose, [face for face in EVERY_SIDE if face != unseen], seed=seed))
    assert abs(half_turn(found - yaw)) < math.radians(1.5)
    errors = face_errors(center, size, pose, true_size)
    for face in EVERY_SIDE:
        if face == unseen:  # what was not seen is not made up, and not much of what was is given away
            assert -0.008 < errors[face] < 0.006, errors
        else:
            assert abs(errors[face]) < 0.004, errors


@settings(max_examples=40, deadline=None)
@given(sizes, yaws, st.integers(0, 1000))
def test_two_flies_in_a_hundred_astray_move_no_face_by_a_centimetre(seen, true_size, yaw, seed):
    pose = Pose2(2.0, 1.0, yaw)
    center, size, found = fit(seen(true_size, pose, seed=seed, stray=0.02))
    assert abs(half_turn(found - yaw)) < math.radians(1.5)
    errors = face_errors(center, size, pose, true_size)
    assert max(map(abs, errors.values())) < 0.01, errors


@settings(max_examples=40, deadline=None)
@given(st.tuples(st.floats(0.6, 0.9), st.floats(0.15, 0.3), st.floats(0.15, 0.8)), yaws, st.integers(0, 1000))
def test_flies_astray_do_not_turn_a_box_of_which_two_sides_are_seen(seen, true_size, yaw, seed):
    pose = Pose2(2.0, 1.0, yaw)
    center, size, found = fit(seen(true_size, pose, ("+x", "-y", "top"), seed=seed, stray=0.02))
    assert abs(half_turn(found - yaw)) < math.radians(2.0)
    errors = face_errors(center, size, pose, true_size)
    assert max(abs(errors[face]) for face in ("+x", "-y", "top")) < 0.01, errors


@settings(max_examples=30, deadline=None)
@given(st.tuples(*[st.floats(0.15, 0.8)] * 3), st.floats(-10, 10))
def test_length_is_the_longer_side_and_yaw_lies_in_half_a_turn(seen, true_size, yaw):
    center, size, found = fit(seen(true_size, Pose2(0.5, -0.5, yaw), density=300.0))
    assert size[0] >= size[1] > 0.0 and size[2] > 0.0
    assert -math.pi / 2 <= found < math.pi / 2
    np.testing.assert_allclose(np.sort(size[:2]), np.sort(true_size[:2]), atol=0.006)
    assert center[2] == size[2] / 2  # it stands on the floor


def test_where_a_box_stands_does_not_matter_to_its_size(seen, flies):
    parts = flies.faces((0.6, 0.3, 0.4), Pose2(0.0, 0.0, 0.2), EVERY_SIDE)
    far = flies.moved(parts, Pose2(40.0, -30.0, 0.0))
    here, there = fit(flies.cloud_of(parts)), fit(flies.cloud_of(far))
    np.testing.assert_allclose(here[1], there[1], atol=1e-6)
    np.testing.assert_allclose(here[0] + (40.0, -30.0, 0.0), there[0], atol=1e-6)
    assert here[2] == pytest.approx(there[2], abs=1e-9)


@pytest.mark.parametrize("radius", [0.15, 0.2])
def test_a_cylinder_is_as_wide_as_its_diameter_both_ways(flies, radius):
    eyes = [(2.0 + 2.2 * math.cos(a), 1.0 + 2.2 * math.sin(a), 0.9) for a in (0.0, 2.1, 4.2)]
    cloud = flies.cloud_of(flies.cylinder(radius, 0.5, Pose2(2.0, 1.0, 0.0), eyes))
    center, size, _ = fit(cloud)
    np.testing.assert_allclose(size[:2], 2 * radius, atol=0.02)
    assert size[2] == pytest.approx(0.5, abs=0.004)
    np.testing.assert_allclose(center[:2], (2.0, 1.0), atol=0.008)


def test_a_single_wall_of_flies_is_a_thin_box(seen):
    _, size, found = fit(seen((0.8, 0.3, 0.5), Pose2(2.0, 0.0, 0.4), ("-y",)))
    assert size[0] == pytest.approx(0.8, abs=0.03)
    assert size[1] < 0.02
    assert abs(half_turn(found - 0.4)) < math.radians(1.0)


def test_flies_that_carry_no_normal_still_make_a_box(seen):
    """With `slant=0` every fly faces its camera: no fly lies on a face, the ends of the cloud must do."""
    cloud = seen((0.6, 0.3, 0.4), Pose2(2.0, 1.0, 0.3))
    tilted = np.tile((0.0, -1.0, 1.0) / np.sqrt(2.0), (len(cloud.points), 1))
    facing = type(cloud)(**{**{name: getattr(cloud, name) for name in cloud.__slots__}, "normals": tilted})
    center, size, found = fit(facing)
    np.testing.assert_allclose(size, (0.6, 0.3, 0.4), atol=0.03)
    np.testing.assert_allclose(center, (2.0, 1.0, 0.2), atol=0.02)
    assert abs(half_turn(found - 0.3)) < math.radians(1.0)


def test_a_step_at_the_foot_does_not_draw_the_face_inwards(seen, flies):
    """A face is where its outermost flies are, not the middle of two that look the same way."""
    pose = Pose2(2.0, 1.0, 0.0)
    parts = flies.faces((0.6, 0.4, 0.2), pose, EVERY_SIDE) + flies.faces((0.4, 0.3, 0.6), pose, EVERY_SIDE)
    center, size, _ = fit(flies.cloud_of(parts))
    np.testing.assert_allclose(size, (0.6, 0.4, 0.6), atol=0.006)
    np.testing.assert_allclose(center[:2], (2.0, 1.0), atol=0.005)
