"""The convex solids behind gaps and measures: farthest points, bounds, what of them shows above the floor."""

import math
from pathlib import Path

import numpy as np
import pytest

from flysim.geometry.frames import pose6
from flysim.truth.body import _above_ground, _upright_round, measure, parts_of, surface_distance
from flysim.truth.gap import Solid, _round_gap, closer_than, solids, touching_groups
from flysim.worlds.model import Link, Part
from flysim.worlds.shapes import Box, Cylinder, Mesh, Plane, Sphere

ALONG = np.array([1.0, 2.0, 2.0]) / 3.0


def solid(shape, *pose):
    (one,) = solids(shape, pose6(*(pose or (0.0,) * 6)))
    return one


@pytest.mark.parametrize(
    ("one", "farthest"),
    [
        (solid(Sphere(0.3), 1, 2, 3, 0, 0, 0), np.array([1.1, 2.2, 3.2])),
        (solid(Box((0.2, 0.4, 0.6)), 1, 2, 3, 0, 0, 0), np.array([1.1, 2.2, 3.3])),
        (solid(Cylinder(0.3, 2.0)), np.array([0.3 / math.sqrt(5), 0.6 / math.sqrt(5), 1.0])),
        (solid(Plane((2.0, 4.0))), np.array([1.0, 2.0, 0.0])),
    ],
)
def test_the_farthest_point_of_a_solid(one, farthest):
    for length in (1.0, 7.0):  # whatever the direction's
        np.testing.assert_allclose(one.support(length * ALONG), farthest, atol=1e-12)
    assert one.support(np.array([0.0, 0.0, 1.0]))[2] == pytest.approx(farthest[2] + (0.1 if one.ball else 0.0))


@pytest.mark.parametrize(
    ("one", "half"),
    [
        (solid(Sphere(0.3)), (0.3, 0.3, 0.3)),
        (solid(Box((0.2, 0.4, 0.6))), (0.1, 0.2, 0.3)),
        (solid(Cylinder(0.3, 2.0)), (0.3, 0.3, 1.0)),
        (solid(Cylinder(0.3, 2.0), 0, 0, 0, 0, math.pi / 2, 0), (1.0, 0.3, 0.3)),
        (solid(Cylinder(0.3, 2.0), 0, 0, 0, 0, math.pi / 4, 0), (1.3 / math.sqrt(2), 0.3, 1.3 / math.sqrt(2))),
    ],
)
def test_bounds_hold_a_solid_and_nothing_more(one, half):
    low, high = one.bounds()
    np.testing.assert_allclose(high, half, atol=1e-9)
    np.testing.assert_allclose(low, -np.array(half), atol=1e-9)
    for axis in np.eye(3):  # as its farthest points say
        assert one.support(axis) @ axis == pytest.approx(high @ axis, abs=1e-9)


@pytest.mark.parametrize(
    ("a", "b", "gap"),
    [
        (solid(Sphere(0.2)), solid(Sphere(0.3), 0.3, 0.4, 1.2, 0, 0, 0), 0.8),
        (solid(Sphere(0.2)), solid(Sphere(0.3), 0.3, 0.0, 0.0, 0, 0, 0), 0.0),
        (solid(Cylinder(0.1, 1.0)), solid(Cylinder(0.2, 1.0), 0.6, 0.8, 0.3, 0, 0, 0), 0.7),
        (solid(Cylinder(0.1, 1.0)), solid(Cylinder(0.2, 1.0), 0.0, 0.1, 1.5, 0, 0, 0), 0.5),
        (solid(Cylinder(0.1, 1.0)), solid(Cylinder(0.2, 1.0), 0.0, 0.7, -1.3, 0, 0, 0), 0.5),  # 0.4 beside, 0.3 below
        (solid(Cylinder(0.1, 1.0)), solid(Cylinder(0.2, 3.0), 0.0, 0.2, 0.0, 0, 0, 0), 0.0),
    ],
)
def test_gaps_of_round_things_by_hand(a, b, gap):
    for one, two in ((a, b), (b, a)):
        assert _round_gap(one, two) == pytest.approx(gap)
        assert closer_than(gap + 1e-9, one, two)
        assert gap == 0.0 or not closer_than(gap - 1e-9, one, two)


def test_of_others_there_is_no_quick_gap():
    leaning, box = solid(Cylinder(0.1, 1.0), 0, 0, 0, 0.3, 0, 0), solid(Box((1, 1, 1)))
    for other in (leaning, box, solid(Sphere(0.1))):
        assert _round_gap(solid(Cylinder(0.1, 1.0)), other) is None
        assert _round_gap(other, solid(Cylinder(0.1, 1.0))) is None
    swept = Solid(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), ball=0.1)
    assert _round_gap(swept, solid(Sphere(0.1))) is None


@pytest.mark.parametrize("gap", [0.0, 0.05, 0.3])
@pytest.mark.parametrize("way", [(1.0, 0.0, 0.0), (0.0, 0.6, 0.8)])  # face to face, and edge to edge
def test_a_gap_is_closed_when_it_is_exactly_as_wide_as_asked(gap, way):
    at = (np.array(way) > 0.0) + gap * np.array(way)
    one, other = solid(Box((1, 1, 1))), solid(Box((1, 1, 1)), *at, 0, 0, 0)
    assert closer_than(gap + 1e-6, one, other)
    assert gap == 0.0 or not closer_than(gap - 1e-6, one, other)


def test_bodies_of_several_shapes_are_as_near_as_their_nearest():
    def two(x):
        return [(Box((0.2, 0.2, 0.2)), pose6(x, 0, 0, 0, 0, 0)), (Box((0.2, 0.2, 0.2)), pose6(x, 1.0, 0, 0, 0, 0))]

    far = [(Box((0.2, 0.2, 0.2)), pose6(0.44, 0.5, 0, 0, 0, 0)), (Box((0.2, 0.2, 0.2)), pose6(0.24, 1.0, 0, 0, 0, 0))]
    assert touching_groups([two(0.0), far], 0.05) == [[0, 1]]
    assert touching_groups([two(0.0), far], 0.03) == [[0], [1]]
    assert touching_groups([two(0.0), [], far], 0.05) == [[0, 2], [1]]
    # A chain that closes late is still one group, in the order of its bodies.
    chain = [[(Box((0.2, 0.2, 0.2)), pose6(x, 0, 0, 0, 0, 0))] for x in (0.0, 0.46, 0.92, 0.23, 0.69)]
    assert touching_groups(chain, 0.05) == [[0, 1, 2, 3, 4]]


# Above the floor.


def test_what_is_cut_by_the_floor_is_cut_where_its_edges_are():
    wedge = np.array([[0.0, 0.0, 0.3], [0.0, 1.0, 0.3], [1.0, 0.0, -0.1], [1.0, 1.0, -0.1]])
    mesh = Mesh(wedge, np.array([[0, 1, 2], [1, 3, 2]]), None, Path("wedge.obj"))
    found = _above_ground(mesh, np.eye(4))
    assert found[:, 2].min() == 0.0 and found[:, 2].max() == 0.3
    assert found[:, 0].max() == pytest.approx(0.75) and set(np.round(found[:, 1], 9)) >= {0.0, 1.0}
    assert measure([(mesh, np.eye(4))]).size == pytest.approx([1.0, 0.75, 0.3])
    assert len(_above_ground(mesh, pose6(0, 0, 0.1, 0, 0, 0))) == 4
    assert len(_above_ground(mesh, pose6(0, 0, -0.4, 0, 0, 0))) == 0
    # An upright box keeps its plan, however deep it stands.
    sunk = _above_ground(Box((0.4, 0.2, 0.6)), pose6(1, 2, -0.2, 0, 0, 0))
    assert sunk.min(axis=0) == pytest.approx([0.8, 1.9, 0.0]) and sunk.max(axis=0) == pytest.approx([1.2, 2.1, 0.1])
    assert np.ptp(sunk, axis=0) == pytest.approx([0.4, 0.2, 0.1]) and sunk[:, 2].min() == 0.0


def test_what_looks_round_from_above():
    assert _upright_round(Sphere(0.5), pose6(1, 2, 0.3, 0, 0, 0)) == pytest.approx((1, 2, 0.5, -0.2, 0.8))
    assert _upright_round(Sphere(0.5), pose6(1, 2, -0.3, 0, 0, 0)) == pytest.approx((1, 2, 0.4, -0.8, 0.2))
    assert _upright_round(Sphere(0.5), pose6(1, 2, -0.6, 0, 0, 0))[2] == 0.0
    assert _upright_round(Cylinder(0.2, 1.0), pose6(1, 2, 0.5, 0, 0, 3)) == pytest.approx((1, 2, 0.2, 0.0, 1.0))
    assert _upright_round(Cylinder(0.2, 1.0), pose6(1, 2, 0.5, math.pi, 0, 0)) == pytest.approx((1, 2, 0.2, 0.0, 1.0))
    assert _upright_round(Cylinder(0.2, 1.0), pose6(1, 2, 0.5, 0.1, 0, 0)) is None
    assert _upright_round(Box((1, 1, 1)), np.eye(4)) is None


def test_a_box_is_measured_on_whichever_face_it_stands():
    for roll, pitch, size in (
        (0, 0, (0.5, 0.4, 0.3)),
        (math.pi / 2, 0, (0.5, 0.3, 0.4)),
        (0, math.pi / 2, (0.4, 0.3, 0.5)),
    ):
        found = measure([(Box((0.5, 0.4, 0.3)), pose6(1, 2, size[2] / 2, roll, pitch, 0))])
        assert found.size == pytest.approx(size) and found.shape == "box"
        assert found.center == pytest.approx([1, 2, size[2] / 2])
        # Its length lies along x, or along y where it stands on its end.
        assert abs(math.sin(found.yaw)) == pytest.approx(1.0 if pitch else 0.0, abs=1e-9)


def test_a_point_is_as_far_from_a_link_as_from_its_nearest_part():
    parts = tuple(
        Part(name=str(x), shape=Box((0.2, 0.2, 0.2)), T_link_part=pose6(x, 0, 0, 0, 0, 0)) for x in (0.0, 1.0)
    )
    link = Link(name="l", model="m", T_world_link=np.eye(4), visuals=parts, collisions=(), static=True, structure=False)
    points = np.array([[0.3, 0.0, 0.0], [0.8, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert surface_distance(link, np.eye(4), points) == pytest.approx([0.2, 0.1, 0.1])
    moved = pose6(0.0, 5.0, 0.0, 0, 0, math.pi / 2)  # the second part is now at (0, 6)
    assert surface_distance(link, moved, np.array([[0.0, 6.3, 0.0]])) == pytest.approx([0.2])
    assert parts_of(link) == parts
