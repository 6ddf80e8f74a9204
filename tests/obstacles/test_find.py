import math

import numpy as np
import pytest

from flysim.geometry.frames import Pose2
from flysim.obstacles.find import find_obstacles
from flysim.obstacles.gather import gather
from flysim.obstacles.parameters import ObstacleParams

EYES = [(0.0, 0.0, 0.8), (4.4, 0.5, 0.8), (2.0, 3.0, 0.8), (2.2, -2.5, 0.8)]


def round_the(box, eyes=EYES):
    """Eyes 2.2 m from a box, in the directions of EYES from (2, 0)."""
    out = []
    for x, y, z in eyes:
        way = math.atan2(y, x - 2.0)
        out.append((box.x + 2.2 * math.cos(way), box.y + 2.2 * math.sin(way), z))
    return out


def test_an_empty_cloud_holds_no_obstacles():
    empty = gather([], ObstacleParams())
    assert find_obstacles(empty, ObstacleParams()) == ()
    assert find_obstacles(empty, ObstacleParams(min_flies=0, min_neighbours=0)) == ()


def test_a_box_is_one_obstacle_that_knows_its_flies(flies):
    pose = Pose2(2.0, 0.0, 0.3)
    cloud = flies.cloud_of(flies.box((0.5, 0.3, 0.4), pose, round_the(pose)))
    (found,) = find_obstacles(cloud, ObstacleParams())
    np.testing.assert_allclose(found.size, (0.5, 0.3, 0.4), atol=0.005)
    np.testing.assert_allclose(found.center, (2.0, 0.0, 0.2), atol=0.004)
    assert found.yaw == pytest.approx(0.3, abs=0.02)
    above = np.flatnonzero(cloud.points[:, 2] > ObstacleParams().ground_clearance)
    assert set(found.flies) <= set(above)
    assert len(found.flies) > 0.95 * len(above)


def test_flies_on_the_ground_are_dropped(flies):
    pose = Pose2(2.0, 0.0, 0.0)
    box = flies.box((0.5, 0.3, 0.4), pose, round_the(pose))
    ground = flies.ground(3.0, (0.0, 0.0, 0.3), flies=20_000)
    assert find_obstacles(flies.cloud_of(ground), ObstacleParams()) == ()
    (alone,) = find_obstacles(flies.cloud_of(box), ObstacleParams())
    (found,) = find_obstacles(flies.cloud_of(box + ground), ObstacleParams())
    np.testing.assert_array_equal(found.size, alone.size)
    np.testing.assert_array_equal(found.flies, alone.flies)


def test_two_boxes_30_cm_apart_are_two_obstacles(flies):
    one, two = Pose2(2.0, 0.0, 0.0), Pose2(2.0, 0.7, 0.0)  # 0.4 m wide each
    parts = [p for k, pose in enumerate((one, two)) for p in flies.box((0.5, 0.4, 0.5), pose, round_the(pose), seed=k)]
    found = find_obstacles(flies.cloud_of(parts), ObstacleParams())
    assert len(found) == 2
    for pose in (one, two):
        nearest = min(found, key=lambda o: math.dist(o.center[:2], (pose.x, pose.y)))
        np.testing.assert_allclose(nearest.center[:2], (pose.x, pose.y), atol=0.005)
        np.testing.assert_allclose(nearest.size, (0.5, 0.4, 0.5), atol=0.006)
    assert len(found[0].flies) >= len(found[1].flies)  # the one with most flies first


def test_boxes_that_stand_closer_than_flies_link_are_one(flies):
    parts = [
        part
        for y in (0.0, 0.44)
        for part in flies.box((0.5, 0.4, 0.5), Pose2(2.0, y, 0.0), round_the(Pose2(2.0, y, 0.0)))
    ]
    (found,) = find_obstacles(flies.cloud_of(parts), ObstacleParams())
    np.testing.assert_allclose(found.size, (0.84, 0.5, 0.5), atol=0.006)


def test_a_box_seen_from_opposite_stops_is_one_obstacle_with_all_its_dimensions(flies):
    pose = Pose2(2.0, 0.0, 0.5)
    size = (0.6, 0.35, 0.4)
    corner = [(2.0 + 2.2 * math.cos(a), 2.2 * math.sin(a), 0.8) for a in (0.5 + 0.8, 0.5 + 0.8 + math.pi)]
    first, second = (flies.box(size, pose, eye, seed=k) for k, eye in enumerate(corner))
    # One stop sees two sides and where they end; the other the other two.
    for parts in (first, first + second):
        (found,) = find_obstacles(flies.cloud_of(parts), ObstacleParams())
        np.testing.assert_allclose(found.size, size, atol=0.005)
        np.testing.assert_allclose(found.center, (2.0, 0.0, 0.2), atol=0.004)


@pytest.mark.parametrize("scale", [0.03, 0.05, 0.1, 0.3])
@pytest.mark.parametrize("seed", range(5))
def test_flies_astray_move_no_seen_face_by_a_centimetre(flies, scale, seed):
    size, pose = (0.55, 0.3, 0.4), Pose2(2.0, 1.0, 0.7)
    parts = flies.faces(size, pose, ("+x", "-x", "+y", "-y", "top"), seed=seed, stray=0.02, scale=scale)
    found = find_obstacles(flies.cloud_of(parts), ObstacleParams())[0]
    np.testing.assert_allclose(found.size, size, atol=0.02)
    np.testing.assert_allclose(found.center, (2.0, 1.0, 0.2), atol=0.01)
    assert found.yaw == pytest.approx(0.7, abs=math.radians(1.5))


def test_what_is_too_low_or_too_sparse_is_no_obstacle(flies):
    pose = Pose2(2.0, 0.0, 0.0)
    kerb = flies.cloud_of(flies.box((0.5, 0.3, 0.1), pose, round_the(pose)))
    assert len(find_obstacles(kerb, ObstacleParams())) == 1
    assert find_obstacles(kerb, ObstacleParams(min_height=0.12)) == ()
    assert find_obstacles(kerb, ObstacleParams(ground_clearance=0.12)) == ()
    assert find_obstacles(kerb, ObstacleParams(min_flies=100_000)) == ()
    few = type(kerb)(**{name: getattr(kerb, name)[::200] for name in kerb.__slots__})
    assert find_obstacles(few, ObstacleParams(min_flies=1)) == ()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"trim": 0.5}, "trim must be < 0.5, got 0.5"),
        ({"link_distance": 0.0}, "link_distance must be > 0 m, got 0"),
        ({"min_flies": -1}, "min_flies must be finite and >= 0, at most 1e.06, got -1"),
        ({"min_height": math.nan}, "min_height must be finite and >= 0, at most 1e.06, got nan"),
        ({"ground_clearance": math.inf}, "ground_clearance must be finite"),
        ({"link_distance": 1e300}, "link_distance must be finite and >= 0, at most 1e.06, got 1e.300"),
    ],
)
def test_nonsense_is_refused_by_its_figure(change, says):
    with pytest.raises(ValueError, match=says):
        ObstacleParams(**change)


def test_a_leg_whose_upper_end_the_table_hides_is_a_part_of_the_table(flies):
    top = (0.0, 0.0, 0.45)
    slab = flies.faces((0.7, 0.5, 0.1), Pose2(2.0, 1.0, 0.4), ("+x", "-x", "+y", "-y", "top"))
    lifted = [(p + top, n, s, a + top, d, e) for p, n, s, a, d, e in slab]
    leg = flies.faces((0.1, 0.1, 0.25), Pose2(2.05, 1.05, 0.4), ("+x", "-x", "+y", "-y"), seed=1)
    (found,) = find_obstacles(flies.cloud_of(lifted + leg), ObstacleParams())
    np.testing.assert_allclose(found.size, (0.7, 0.5, 0.55), atol=0.006)
    np.testing.assert_allclose(found.center[:2], (2.0, 1.0), atol=0.004)
    beside = flies.faces((0.1, 0.1, 0.25), Pose2(2.0, 1.6, 0.4), ("+x", "-x", "+y", "-y"), seed=1)
    assert len(find_obstacles(flies.cloud_of(lifted + beside), ObstacleParams())) == 2


def test_what_stands_in_a_ring_of_walls_is_no_part_of_them(flies):
    inside = ((0.0, 2.0), "-y"), ((0.0, -2.0), "+y"), ((2.0, 0.0), "-x"), ((-2.0, 0.0), "+x")
    walls = [
        part
        for (x, y), face in inside
        for part in flies.faces((4.0, 0.1, 0.5) if y else (0.1, 4.0, 0.5), Pose2(x, y, 0.0), (face,), density=400.0)
    ]
    box = flies.box((0.4, 0.3, 0.4), Pose2(0.3, 0.2, 0.4), round_the(Pose2(0.3, 0.2, 0.4)))
    found = find_obstacles(flies.cloud_of(walls + box), ObstacleParams())
    assert any(np.allclose(o.size, (0.4, 0.3, 0.4), atol=0.01) for o in found)


def test_a_rim_that_floats_over_a_leg_is_its_table_though_nobody_sees_the_top(flies):
    up = (0.0, 0.0, 0.3)
    rim = flies.faces((0.6, 0.4, 0.12), Pose2(2.0, 1.0, 0.4), ("+x", "-x", "+y", "-y"))
    lifted = [(p + up, n, s, a + up, d, e) for p, n, s, a, d, e in rim]
    leg = flies.faces((0.1, 0.1, 0.2), Pose2(2.0, 1.0, 0.4), ("+x", "-x", "+y", "-y"), seed=1)
    (found,) = find_obstacles(flies.cloud_of(lifted + leg), ObstacleParams())
    np.testing.assert_allclose(found.size, (0.6, 0.4, 0.42), atol=0.006)


def test_a_kerb_in_a_room_of_high_walls_is_no_part_of_them(flies):
    up = (0.0, 0.0, 0.3)  # what stands before the walls hides their feet
    sides = ((0.0, 2.0), "-y"), ((0.0, -2.0), "+y"), ((2.0, 0.0), "-x"), ((-2.0, 0.0), "+x")
    walls = [
        (p + up, n, s, a + up, d, e)
        for (x, y), face in sides
        for p, n, s, a, d, e in flies.faces((4.0, 0.1, 0.5) if y else (0.1, 4.0, 0.5), Pose2(x, y, 0.0), (face,))
    ]
    kerb = flies.box((0.8, 0.2, 0.1), Pose2(0.3, 0.2, 0.4), round_the(Pose2(0.3, 0.2, 0.4)))
    found = find_obstacles(flies.cloud_of(walls + kerb), ObstacleParams())
    assert any(np.allclose(o.size, (0.8, 0.2, 0.1), atol=0.01) for o in found)


NAMES = ("points", "normals", "spread", "arms", "steps", "ended")


def test_two_sides_with_a_bare_strip_between_them_are_one_box(flies):
    """The strip is wider than flies are linked over; as of a side that is seen at a low angle."""
    size, pose = (0.5, 0.4, 0.3), Pose2(2.0, 1.0, 0.3)
    front = flies.cloud_of(flies.faces(size, pose, ("-x",)))
    side = flies.cloud_of(flies.faces(size, pose, ("-y",), seed=1))
    along = np.array([np.cos(0.3), np.sin(0.3), 0.0])
    place = (side.points - (2.0, 1.0, 0.0)) @ along
    far = np.flatnonzero(place > -0.13)  # 12 cm of its 50 are bare, and its flies' arms run over them to the corner
    side.arms[far, 1] = side.points[far] - (place[far, None] + 0.25) * along
    side.ended[far, 1] = True
    parts = [[getattr(front, name) for name in NAMES], [getattr(side, name)[far] for name in NAMES]]
    (found,) = find_obstacles(flies.cloud_of(parts), ObstacleParams())
    np.testing.assert_allclose(found.size, size, atol=0.01)
    np.testing.assert_allclose(found.center[:2], (2.0, 1.0), atol=0.01)


@pytest.mark.parametrize("gap", [0.12, 0.3])
def test_two_boxes_beside_each_other_stay_two(flies, gap):
    size = (0.3, 0.3, 0.3)
    one = flies.faces(size, Pose2(2.0, 1.0, 0.0), ("-x", "-y"))
    other = flies.faces(size, Pose2(2.0, 1.3 + gap, 0.0), ("-x", "-y"), seed=1)
    assert len(find_obstacles(flies.cloud_of(one + other), ObstacleParams())) == 2
