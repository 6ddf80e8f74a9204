import math
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flysim.geometry.frames import pose6
from flysim.geometry.plan_view import axes
from flysim.truth.body import measure
from flysim.truth.sight import sights
from flysim.truth.truth import Truth
from flysim.worlds.model import Link, Part
from flysim.worlds.shapes import Box, Cylinder, Plane, Sphere


def truth(by_hand, *links, stops=(), **other):
    return Truth.of(by_hand.world(*links), stops, **({"max_range": 6.0} | other)).obstacles


def test_ground_and_walls_are_no_obstacles_and_the_order_is_the_files(by_hand):
    found = truth(
        by_hand,
        by_hand.body("floor", Plane((9.0, 9.0)), structure=True),
        by_hand.box("b", (0.4, 0.2, 0.3), 1.0, 0.0),
        by_hand.body("wall", Box((0.1, 9.0, 1.0)), 4.0, structure=True),
        by_hand.box("a", (0.4, 0.2, 0.3), -1.0, 0.0),
    )
    assert [(o.name, o.links) for o in found] == [("b", (1,)), ("a", (3,))]


@settings(max_examples=50, deadline=None)
@given(st.floats(-3.0, 3.0), st.permutations([0.5, 0.3, 0.2]), st.sampled_from([0.0, math.pi / 2, math.pi]))
def test_an_upright_box_is_measured_exactly_however_it_is_written(yaw, size, roll):
    height = {0.0: size[2], math.pi: size[2], math.pi / 2: size[1]}[roll]
    box = measure([(Box(tuple(size)), pose6(1.0, 2.0, height / 2, roll, 0.0, yaw))])
    flat = sorted(set(size) - {height}, reverse=True)
    assert box.size == pytest.approx([*flat, height])
    assert box.center == pytest.approx([1.0, 2.0, height / 2])
    assert -math.pi / 2 <= box.yaw < math.pi / 2
    # The length is along the axis it was written on: x, or the flat other one.
    turned = yaw if size[0] > flat[1] else yaw + math.pi / 2
    assert math.sin(box.yaw - turned) == pytest.approx(0.0, abs=1e-9)
    assert box.symmetry == "rectangle"


def test_square_and_round(by_hand):
    square, post, ball = truth(
        by_hand,
        by_hand.box("square", (0.4, 0.4, 0.3), 0.0, 0.0, 0.3),
        by_hand.body("post", Cylinder(0.05, 1.0), 2.0, 0.0, 0.5, 0.7),
        by_hand.body("ball", Sphere(0.2), 4.0, 0.0, 0.2),
    )
    assert (square.symmetry, post.symmetry, ball.symmetry) == ("square", "round", "round")
    assert post.size == pytest.approx([0.1, 0.1, 1.0])
    assert ball.size == pytest.approx([0.4, 0.4, 0.4])
    assert post.yaw == ball.yaw == 0.0


def test_what_is_below_the_ground_does_not_count(by_hand):
    pole, sunk, ball, tilted = truth(
        by_hand,
        by_hand.body("pole", Cylinder(0.075, 1.0), 0.0, 0.0, 0.0),  # as BARN's: half of it shows
        by_hand.body("sunk", Box((0.4, 0.2, 0.6)), 2.0, 0.0, 0.1),
        by_hand.body("ball", Sphere(0.5), 4.0, 0.0, -0.3),
        # A rod leaning at 45 degrees whose middle is on the ground: half of its plan extent shows.
        by_hand.body("rod", Box((0.02, 0.02, 2.0)), 6.0, 0.0, 0.0, pitch=math.pi / 4),
        by_hand.box("under", (0.4, 0.2, 0.3), 8.0, 0.0),
    )[:4]
    assert (pole.size[2], pole.center[2]) == pytest.approx((0.5, 0.25))
    assert (sunk.size[2], sunk.center[2]) == pytest.approx((0.4, 0.2))
    assert ball.size == pytest.approx([0.8, 0.8, 0.2])  # 0.5, 0.3, 0.4: the circle at the ground
    reach = math.sqrt(0.5) * (1.0 + 0.01)
    assert tilted.size[2] == pytest.approx(reach)
    assert tilted.size[0] == pytest.approx(math.sqrt(0.5) + 0.01 * math.sqrt(0.5) + 0.01 * math.sqrt(2), abs=1e-3)
    assert tilted.size[1] == pytest.approx(0.02)


def test_a_body_below_the_ground_is_no_obstacle(by_hand):
    assert truth(by_hand, by_hand.body("pipe", Box((1.0, 0.2, 0.2)), 0.0, 0.0, -0.2)) == ()


def test_bodies_closer_than_the_gap_are_one_obstacle_and_farther_ones_are_not(by_hand):
    one = by_hand.box("box_1", (0.4, 0.2, 0.3), 0.0, 0.0)
    near, far = (
        by_hand.box("box_2", (0.4, 0.2, 0.5), 0.44, 0.0),
        by_hand.box("box_2", (0.4, 0.2, 0.5), 0.5, 0.0),
    )
    (group,) = truth(by_hand, one, near)
    assert group.name == "box_1+box_2"
    assert group.links == (0, 1)
    assert group.size == pytest.approx([0.84, 0.2, 0.5])
    assert group.center == pytest.approx([0.22, 0.0, 0.25])
    assert len(truth(by_hand, one, far)) == 2
    assert len(truth(by_hand, one, far, merge_gap=0.11)) == 1


def test_long_thin_boxes_whose_middles_touch_are_one(by_hand):
    cross = [
        by_hand.box("a", (4.0, 0.1, 0.1), 0.0, 0.0),
        by_hand.box("b", (4.0, 0.1, 0.1), 0.0, 2.09, math.pi / 2),
    ]
    assert len(truth(by_hand, *cross)) == 1  # a T: b's end is 4 cm from a's middle
    apart = [cross[0], by_hand.box("b", (4.0, 0.1, 0.1), 0.0, 2.15, math.pi / 2)]
    assert len(truth(by_hand, *apart)) == 2


def test_a_model_of_many_links_is_named_once_and_a_crowd_is_cut_short(by_hand):
    table = [by_hand.box(f"leg_{i}", (0.2, 0.2, 0.5), 0.2 * i, 0.0, model="table") for i in range(2)]
    assert [o.name for o in truth(by_hand, *table)] == ["table"]
    apart = [by_hand.box(f"leg_{i}", (0.2, 0.2, 0.5), 1.0 * i, 0.0, model="table") for i in range(2)]
    assert [o.name for o in truth(by_hand, *apart)] == ["table/leg_0", "table/leg_1"]
    crowd = [by_hand.body(f"c{i}", Cylinder(0.075, 1.0), 0.15 * i) for i in range(9)]
    assert [o.name for o in truth(by_hand, *crowd)] == ["c0+c1+c2+6 more"]


def test_truth_is_what_cameras_see_the_visuals(by_hand):
    def part(size):
        return Part(name="p", shape=Box(size), T_link_part=pose6(0, 0, size[2] / 2, 0, 0, 0))

    def link(visuals, collisions):
        return Link(
            name="l",
            model="m",
            T_world_link=np.eye(4),
            visuals=visuals,
            collisions=collisions,
            static=True,
            structure=False,
        )

    seen, felt = part((0.4, 0.2, 0.3)), part((1.0, 1.0, 1.0))
    assert truth(by_hand, link((seen,), (felt,)))[0].size == pytest.approx([0.4, 0.2, 0.3])
    assert truth(by_hand, link((), (felt,)))[0].size == pytest.approx([1.0, 1.0, 1.0])
    assert truth(by_hand, link((), ())) == ()


def test_the_visible_extent_of_a_box_seen_all_round_is_its_own_to_a_pixel(yard):
    box_1, box_2, pole = yard.truth.obstacles
    pixel = 2.2 / yard.stops[0].views[0].camera.fx
    for o in (box_1, box_2, pole):
        center, size = o.visible_extent()
        assert o.visible
        assert size == pytest.approx(o.size, abs=pixel)
        assert center == pytest.approx(o.center, abs=pixel)


def test_one_stop_sees_one_side(by_hand):
    world = by_hand.world(by_hand.box("box", (1.0, 0.5, 0.3), 0.0, 0.0, math.pi / 2))
    stop = by_hand.stop(world, -2.0, 0.0, 0.0, height=0.15, down=0.0)  # below the top: the front face alone
    (o,) = Truth.of(world, [stop], max_range=6.0).obstacles
    _, size = o.visible_extent()
    assert size == pytest.approx([1.0, 0.0, 0.3], abs=0.01)
    center, size = o.visible_extent(0.0)  # the same in other axes
    assert size == pytest.approx([0.0, 1.0, 0.3], abs=0.01)
    assert center[:2] == pytest.approx([-0.25, 0.0], abs=0.01)


@pytest.mark.parametrize(("kerb", "expected"), [(0.04, 0.5), (0.2, 0.3)])
def test_height_goes_down_to_the_foot_when_all_but_the_foot_was_seen(by_hand, kerb, expected):
    world = by_hand.world(
        by_hand.box("box", (0.4, 0.4, 0.5), 0.0, 0.0),
        by_hand.body("screen", Box((0.01, 3.0, kerb)), -0.3, 0.0, kerb / 2, structure=True),
    )
    stop = by_hand.stop(world, -2.0, 0.0, 0.0, height=kerb, down=0.0)
    (o,) = Truth.of(world, [stop], max_range=6.0).obstacles
    assert o.visible_points[:, 2].min() == pytest.approx(kerb, abs=0.01)
    assert o.visible_extent()[1][2] == pytest.approx(expected, abs=0.012)


def test_what_is_hidden_or_out_of_range_is_not_visible(by_hand):
    world = by_hand.world(
        by_hand.body("wall", Box((0.1, 6.0, 2.0)), 1.0, 0.0, 1.0, structure=True),
        by_hand.box("behind", (0.4, 0.4, 0.5), 1.8, 0.0),
        by_hand.box("before", (0.2, 0.2, 0.3), 0.5, 0.0),
    )
    stop = by_hand.stop(world, -1.5, 0.0, 0.0)
    behind, before = Truth.of(world, [stop], max_range=6.0).obstacles
    assert not behind.visible
    assert behind.visible_extent() is None
    assert before.visible
    assert not any(o.visible for o in Truth.of(world, [stop], max_range=1.5).obstacles)


def test_a_body_that_was_pushed_is_where_it_stands_last(by_hand):
    world = by_hand.world(by_hand.box("box", (0.4, 0.2, 0.3), 0.0, 0.0))
    before = np.array([world.links[0].T_world_link])
    after = np.array([pose6(0.3, 0.1, 0.15, 0, 0, 0.4)])
    stops = [
        by_hand.stop(world, -2.0, 0.0, 0.0, index=0, T_world_links=before),
        by_hand.stop(world, 2.0, 0.0, math.pi, index=1, T_world_links=before),
        by_hand.stop(world, 0.3, -2.0, math.pi / 2, index=2, T_world_links=after),
    ]
    (o,) = Truth.of(world, stops, max_range=6.0).obstacles
    assert o.center == pytest.approx([0.3, 0.1, 0.15])
    assert o.yaw == pytest.approx(0.4)
    center, size = o.visible_extent()
    assert size == pytest.approx(o.size, abs=0.012)  # not smeared over both places
    assert center == pytest.approx(o.center, abs=0.012)


def test_stored_points_are_few_and_lie_on_the_body(by_hand):
    world = by_hand.world(by_hand.box("box", (0.5, 0.3, 0.4), 0.0, 0.0))
    stops = by_hand.around(world, 6, 1.2)
    (o,) = Truth.of(world, stops, max_range=6.0).obstacles
    # One in each cell of 5 mm that a pixel shows, and those few beside that bound it; of each stop's, and of all.
    stored = set(map(tuple, np.floor(o.visible_points / 0.005).astype(int)))
    shown = {tuple(cell) for sight in sights(stops, 6.0) for cell in np.floor(sight.points() / 0.005).astype(int)}
    assert stored == shown
    assert len(o.visible_points) < 1.03 * len(stored)
    assert Box((0.5, 0.3, 0.4)).distance(o.visible_points - o.center).max() < 1e-5
    with pytest.raises(ValueError, match="read-only"):
        o.visible_points[0] = 0.0


def test_thinning_moves_no_extent(by_hand):
    # Near enough that many pixels share a voxel.
    world = by_hand.world(
        by_hand.body("ball", Sphere(0.1613), 0.0, 0.0, 0.1613),
        by_hand.box("box", (0.3, 0.1, 0.2), 0.0, 0.4, 0.3),
    )
    stops = by_hand.around(world, 3, 0.6, height=0.3)
    seen = sights(stops, 6.0)
    for o in Truth.of(world, stops, max_range=6.0).obstacles:
        masks = [sight.seen & (sight.stop.views[0].link == o.links[0]) for sight in seen]
        points = np.concatenate([sight.points(mask) for sight, mask in zip(seen, masks, strict=True)])
        assert len(points) == o.visible_pixels
        for end in (np.min, np.max):
            assert end(o.visible_points[:, 2]) == end(points[:, 2])
        for yaw in (0.0, 0.4, 1.0, o.yaw):
            assert o.visible_extent(yaw)[1][:2] == pytest.approx(np.ptp(points[:, :2] @ axes(yaw).T, axis=0), abs=3e-4)


def test_a_world_of_nothing_has_no_obstacles(by_hand):
    assert truth(by_hand) == ()
    assert truth(by_hand, stops=by_hand.around(by_hand.world(), 2)) == ()


def test_three_hundred_poles_are_measured_within_a_second(by_hand):
    poles = [by_hand.body(f"p{i}", Cylinder(0.075, 1.0), 0.15 * (i % 20), 0.4 * (i // 20)) for i in range(300)]
    began = time.process_time()
    found = truth(by_hand, *poles)
    assert time.process_time() - began < 1.0
    assert len(found) == 15
    assert found[0].size == pytest.approx([3.0, 0.15, 0.5])
