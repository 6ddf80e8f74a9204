"""Where the lines of the evaluation lie: what is just inside counts, what is just outside does not."""

import math

import numpy as np
import pytest

from flysim.evaluate.matching import _cost, _reaches, match
from flysim.evaluate.surface import _spacing, _to_nearest, score_surface, visible_surface
from flysim.geometry.camera import Camera
from flysim.geometry.frames import pose6
from flysim.truth.body import measure
from flysim.truth.motion import Motion
from flysim.truth.obstacles import TrueObstacle, one_a_voxel
from flysim.truth.sight import seen_by_both, sights
from flysim.worlds.shapes import Box, Cylinder, Plane, Sphere
from flysim.worlds.view import TrueView

LENS = Camera(width=9, height=7, fx=8.0, fy=8.0, cx=4.0, cy=3.0)


def true_obstacle(size=(0.4, 0.4, 0.4), yaw=0.0, pixels=1000, points=(), center=(0.0, 0.0)):
    return TrueObstacle(
        name="it",
        links=(0,),
        center=np.array([*center, size[2] / 2]),
        size=np.array(size),
        yaw=yaw,
        symmetry="rectangle",
        shape="box",
        visible_points=np.asarray(points, float).reshape(-1, 3),
        visible_pixels=pixels,
    )


def view(depth, link=0, camera=LENS, T=None):
    shape = (camera.height, camera.width)
    return TrueView(
        camera=camera,
        rgb=np.zeros((*shape, 3), np.uint8),
        depth=np.broadcast_to(np.asarray(depth, np.float32), shape).copy(),
        link=np.broadcast_to(np.asarray(link, np.int32), shape).copy(),
        T_world_optical=np.eye(4) if T is None else T,
    )


# What both cameras see.


@pytest.mark.parametrize("z", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_point_is_the_same_within_two_centimetres_or_two_hundredths_of_its_depth(z, sign):
    allowed = 0.02 * max(1.0, z)
    for share, seen in ((0.98, True), (1.02, False)):
        assert seen_by_both((view(z), view(z + sign * share * allowed)), 6.0).all() == seen


def test_what_is_seen_lies_in_range_in_front_and_in_the_other_image():
    assert seen_by_both((view(2.0), view(2.0)), 2.0).all()
    assert not seen_by_both((view(2.0), view(2.0)), 1.999).any()
    assert not seen_by_both((view(2.0, link=-1), view(2.0, link=-1)), 6.0).any()
    assert not seen_by_both((view(0.0), view(0.0)), 6.0).any()
    assert seen_by_both((view(0.05), view(0.05)), 6.0).all()
    assert not seen_by_both((view(np.inf), view(np.inf)), 6.0).any()
    # Half a pixel decides, at all four borders: what falls on -0.4 is on the first pixel, on -0.6 on none.
    for axis, size in ((0, 9), (1, 7)):
        for pixels in (0.4, 0.6, 1.4, -0.4, -0.6, -1.4):
            T = np.eye(4)
            T[axis, 3] = pixels / 8.0  # at a depth of 1 m
            seen = seen_by_both((view(1.0), view(1.0, T=T)), 6.0)
            expected = np.rint(np.arange(size) - pixels)
            expected = (expected >= 0) & (expected < size)
            assert (seen == (expected[None] if axis == 0 else expected[:, None])).all()
    ahead = pose6(0.0, 0.0, 1.5, 0.0, 0.0, 0.0)  # the other camera stands behind what is seen
    assert not seen_by_both((view(1.0), view(0.5, T=ahead)), 6.0).any()


def test_every_pixel_is_asked_where_it_falls_in_a_turned_camera():
    rng = np.random.default_rng(0)
    depth = rng.uniform(1.0, 2.0, (7, 9))
    T = pose6(0.05, -0.04, 0.1, 0.02, 0.1, 0.3)
    other = Camera(width=11, height=8, fx=9.0, fy=10.0, cx=4.5, cy=3.7)
    right = view(rng.uniform(1.0, 2.0, (8, 11)), camera=other, T=T)
    seen = seen_by_both((view(depth), right), 6.0)
    for v, u in np.ndindex(7, 9):
        p = LENS.unproject([[u, v]], [depth[v, u]])[0]
        p = T[:3, :3].T @ (p - T[:3, 3])
        x, y = np.rint(other.project(p[None])[0]).astype(int)
        inside = 0 <= x < 11 and 0 <= y < 8
        assert seen[v, u] == (inside and abs(right.depth[y, x] - p[2]) <= 0.02 * max(1.0, p[2]))


# What truly stands.


@pytest.mark.parametrize(("pixels", "visible"), [(50, True), (49, False)])
def test_fifty_pixels_make_an_obstacle_visible(pixels, visible):
    assert true_obstacle(pixels=pixels).visible == visible


@pytest.mark.parametrize(("lowest", "height"), [(0.049, 0.4), (0.051, 0.349)])
def test_seen_down_to_five_centimetres_it_is_seen_to_its_foot(lowest, height):
    points = [[-0.1, 0.0, lowest], [0.1, 0.1, 0.4]]
    center, size = true_obstacle(points=points).visible_extent()
    assert size == pytest.approx([0.2, 0.1, height])
    assert center == pytest.approx([0.0, 0.05, 0.4 - height / 2.0])
    # Along another heading, and of one that hangs 1 m high.
    turned = true_obstacle(points=points).visible_extent(math.pi / 2.0)
    assert turned[1][:2] == pytest.approx([0.1, 0.2]) and turned[0][:2] == pytest.approx([0.0, 0.05])


@pytest.mark.parametrize(("gap", "together"), [(0.0895, True), (0.0905, False)])
def test_bodies_up_to_nine_centimetres_apart_are_one_obstacle(by_hand, gap, together):
    world = by_hand.world(
        by_hand.box("a", (0.4, 0.2, 0.3), 0.0, 0.0), by_hand.box("b", (0.4, 0.2, 0.3), 0.4 + gap, 0.0)
    )
    assert (len(by_hand.truth(world, []).obstacles) == 1) == together


@pytest.mark.parametrize(("n", "name"), [(4, "c0+c1+c2+c3"), (5, "c0+c1+c2+2 more")])
def test_a_crowd_of_more_than_four_is_cut_short(by_hand, n, name):
    crowd = [by_hand.body(f"c{i}", Cylinder(0.075, 1.0), 0.15 * i) for i in range(n)]
    assert [o.name for o in by_hand.truth(by_hand.world(*crowd), []).obstacles] == [name]


def test_one_point_a_voxel_is_the_first():
    points = np.array([[1, 0, 0], [4, 1, 4], [6, 0, 0], [-1, 0, 0], [2, 6, 0], [1, 0, 6]]) / 1000.0
    assert sorted(one_a_voxel(points, 0.005)) == [0, 2, 3, 4, 5]
    assert sorted(one_a_voxel(points[:1], 0.005)) == [0]
    rows = np.array([[k // 5, 0, 0] for k in range(20)]) / 100.0  # neighbours that share a cell, and cells come once
    assert one_a_voxel(rows, 0.01 - 1e-9).tolist() == [0, 5, 10, 15]
    assert len(one_a_voxel(np.random.default_rng(0).uniform(0.0, 1.0, (4000, 3)), 0.25)) == 64


# Bodies.


@pytest.mark.parametrize(("angle", "kind"), [(1.38e-3, "box"), (1.45e-3, "other")])
def test_a_box_that_leans_a_twelfth_of_a_degree_is_upright(angle, kind):
    assert measure([(Box((0.4, 0.2, 0.3)), pose6(0.0, 0.0, 0.15, angle, 0.0, 0.0))]).shape == kind
    upright = measure([(Cylinder(0.1, 0.3), pose6(0.0, 0.0, 0.15, angle, 0.0, 0.0))]).shape
    assert upright == ("cylinder" if kind == "box" else "other")


@pytest.mark.parametrize(("longer", "symmetry"), [(0.00095, "square"), (0.00105, "rectangle")])
def test_sides_that_differ_by_a_millimetre_are_no_square(longer, symmetry):
    upright = pose6(0.0, 0.0, 0.15, 0.0, 0.0, 0.0)
    assert measure([(Box((0.4 + longer, 0.4, 0.3)), upright)]).symmetry == symmetry
    halves = [(Box((0.2 + longer / 2, 0.4, 0.3)), pose6(x, 0.0, 0.15, 0, 0, 0)) for x in (0.0, 0.2 + longer / 2)]
    assert measure(halves).symmetry == symmetry


@pytest.mark.parametrize(("beside", "symmetry"), [(0.00095, "round"), (0.00105, "rectangle")])
def test_round_things_on_one_axis_are_round(beside, symmetry):
    stack = [
        (Cylinder(0.1, 0.3), pose6(0.0, 0.0, 0.15, 0, 0, 0)),
        (Cylinder(0.05, 0.4), pose6(0.0, beside, 0.5, 0, 0, 0)),
    ]
    found = measure(stack)
    if symmetry == "round":
        assert (found.symmetry, found.shape) == ("round", "other")
        assert found.size == pytest.approx([0.2, 0.2, 0.7]) and found.center == pytest.approx([0.0, 0.0, 0.35])
    else:
        assert found.symmetry != "round"


def test_measures_by_hand():
    ball = measure([(Sphere(0.5), pose6(1.0, 2.0, 0.3, 0, 0, 0))])
    assert ball.size == pytest.approx([1.0, 1.0, 0.8]) and ball.center == pytest.approx([1.0, 2.0, 0.4])
    assert measure([(Sphere(0.5), pose6(0.0, 0.0, -0.5, 0, 0, 0))]) is None
    assert measure([(Cylinder(0.5, 1.0), pose6(0.0, 0.0, -0.5, 0, 0, 0))]) is None
    assert measure([(Box((1.0, 1.0, 1.0)), pose6(0.0, 0.0, -0.5, 0, 0, 0))]) is None
    assert measure([]) is None
    low = measure([(Box((1.0, 0.5, 1.0)), pose6(0.0, 0.0, -0.4, 0, 0, 0))])
    assert low.size == pytest.approx([1.0, 0.5, 0.1]) and low.center[2] == pytest.approx(0.05)


# What stands for what.


@pytest.mark.parametrize(("off", "matches"), [(0.095, True), (0.105, False)])
def test_a_centre_may_lie_ten_centimetres_off_the_footprint(by_hand, off, matches):
    long = true_obstacle((3.0, 0.2, 0.4), yaw=math.pi / 2.0)
    beside = by_hand.estimate(0.1 + off, 1.2, (0.2, 0.2, 0.4))
    assert (_cost(long, beside) < 1.0) == matches
    beyond = by_hand.estimate(0.0, -1.5 - off, (0.2, 0.2, 0.4))
    assert (_cost(long, beyond) < 1.0) == matches


def test_a_match_costs_its_distance_as_a_share_of_the_farthest(by_hand):
    def cost(x, size):
        return _cost(true_obstacle(size), by_hand.estimate(x, 0.0, (0.1, 0.1, 0.4)))

    assert cost(0.15, (0.1, 0.1, 0.4)) == pytest.approx(0.5)  # of 0.3 m
    assert cost(0.3, (0.1, 0.1, 0.4)) == pytest.approx(1.0) and cost(0.3, (0.1, 0.1, 0.4)) < 1.0
    assert cost(0.301, (0.1, 0.1, 0.4)) == 1.0
    assert cost(0.75, (3.0, 0.2, 0.4)) == pytest.approx(0.75 / (math.hypot(1.5, 0.1) + 0.1))


@pytest.fixture
def on_wall(by_hand):
    """Whether flies at a distance from a wall make a cluster on structure."""
    floor = by_hand.body("floor", Plane((20.0, 20.0)), structure=True)
    wall = by_hand.body("wall", Box((0.1, 8.0, 1.0)), 3.05, 0.0, 0.5, structure=True)
    world = by_hand.world(floor, wall)
    stop = by_hand.stop(world, 0.0, 0.0, 0.0, camera=Camera.from_fov(4, 3, 1.2))

    def on(offsets):
        points = np.array([[3.0 - off, 0.0, 0.5] for off in offsets])
        estimate = by_hand.estimate(2.9, 0.0, (0.1, 0.1, 0.4), flies=range(len(points)))
        found = match([], [estimate], world=world, motion=Motion.of(world, [stop]), cloud=by_hand.cloud(points))
        return found.on_structure == (0,) and found.false == ()

    return on


def test_flies_within_three_centimetres_in_the_median_lie_on_a_wall(on_wall):
    assert on_wall([0.029] * 9) and not on_wall([0.031] * 9)
    assert on_wall([0.01] * 5 + [0.099] * 4) and not on_wall([0.01] * 4 + [0.099] * 5)


def test_a_wall_with_a_slab_across_the_room_is_no_wall(on_wall):
    assert on_wall([0.01] * 199 + [0.5] * 1) and not on_wall([0.01] * 195 + [0.5] * 5)
    assert not on_wall([0.01] * 195 + [0.105] * 5)


def test_a_cluster_is_asked_how_near_it_is_to_an_obstacle_that_some_fly_can_touch():
    it = true_obstacle((0.6, 0.8, 0.4), center=(1.0, 2.0))  # a circle of 50 cm, and 3 cm beside
    far = np.array([[9.0, 9.0, 0.0]])
    assert _reaches(it, np.concatenate([far, [[1.0, 2.529, 9.0]]]))
    assert not _reaches(it, np.concatenate([far, [[1.0, 2.531, 0.2]]]))


# Motion.


@pytest.mark.parametrize(("by", "moved"), [(0.95e-4, False), (1.05e-4, True)])
def test_a_body_that_moves_by_less_than_a_tenth_of_a_millimetre_stands_still(by_hand, by, moved):
    world = by_hand.world(by_hand.box("box", (0.4, 0.2, 0.3), 0.0, 0.0))
    camera = Camera.from_fov(4, 3, 1.2)
    first, last = (np.array([pose6(x, 0.0, 0.15, 0, 0, 0)]) for x in (by, 0.0))
    stops = [by_hand.stop(world, -2, 0, 0, index=i, camera=camera, T_world_links=T) for i, T in ((3, first), (5, last))]
    motion = Motion.of(world, stops)
    assert motion.moved.tolist() == [moved]
    points = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    shifted = points - ((by if moved else 0.0), 0.0, 0.0)
    assert motion.carry(0, 3, points) == pytest.approx(shifted, abs=1e-12)
    assert motion.carry(0, 5, points) == pytest.approx(points) and motion.carry(0, 9, points) == pytest.approx(points)
    both = motion.carry_all(0, np.array([5, 3]), points)
    assert both == pytest.approx(np.stack([points[0], shifted[1]]), abs=1e-12)


# The surface.


def grid(z, slope=0.0, width=5, height=4, pixel=0.01):
    """Samples in the optical frame of a plane that goes away by `slope` [m/m] to the right."""
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    x = pixel * u * z
    return x.astype(np.float32), (pixel * v * z).astype(np.float32), (z + slope * x).astype(np.float32)


def test_a_sample_reaches_three_quarters_of_the_diagonal_of_its_cell():
    everywhere, one = np.ones((4, 5), bool), np.zeros((4, 5), np.int32)
    facing = _spacing(grid(2.0), everywhere, one, 0.01)
    np.testing.assert_allclose(facing, 0.75 * 0.02 * math.sqrt(2.0), rtol=1e-5)
    slanted = _spacing(grid(2.0, slope=2.0), everywhere, one, 0.01)
    np.testing.assert_allclose(slanted, 0.75 * 0.02 * math.sqrt(1.0 + 5.0), rtol=1e-4)
    # Alone it is that of a surface that faces the camera, whatever lies beside it.
    alone = np.zeros((4, 5), bool)
    alone[1, 2] = True
    np.testing.assert_allclose(
        _spacing(grid(2.0, slope=2.0), alone, one, 0.01)[1, 2], 0.75 * 0.02 * math.sqrt(2.0), rtol=0.1
    )
    # To the nearer neighbour, on the same body.
    x, y, z = grid(2.0)
    x[:, 3:] += 0.05
    near = _spacing((x, y, z), everywhere, one, 0.01)
    np.testing.assert_allclose(near, 0.75 * 0.02 * math.sqrt(2.0), rtol=1e-5)
    other = one.copy()
    other[:, 3:] = 1
    x[:, 3:] -= 0.06  # a step back over 10 mm, to another body
    np.testing.assert_allclose(
        _spacing((x, y, z), everywhere, other, 0.01)[:, :3], 0.75 * 0.02 * math.sqrt(2.0), rtol=1e-5
    )


def test_completeness_counts_a_point_a_voxel_and_looks_as_far_as_it_must():
    points = np.array([[0.0, 0.0, 0.001 * k] for k in range(60)])  # three voxels of 2 cm
    found = _to_nearest(points, np.array([[0.0, 0.0, 0.0]]))
    assert found == pytest.approx([0.0, 0.02, 0.04], abs=1e-9)
    assert _to_nearest(points[:1], np.array([[0.0502, 0.0, 0.0]])) == pytest.approx([0.0502])
    assert np.isinf(_to_nearest(points[:1], np.array([[0.06, 0.0, 0.0]]))).all()
    assert _to_nearest(points[:0], points).shape == (0,)
    assert np.isinf(_to_nearest(points, points[:0])).tolist() == [True] * 3


def test_flies_and_surface_are_within_a_threshold_that_they_do_not_reach(by_hand):
    world = by_hand.world(by_hand.body("wall", Box((0.1, 4.0, 4.0)), 2.05, 0.0, 1.0, structure=True))
    stop = by_hand.stop(world, 0.0, 0.0, 0.0, height=1.0, down=0.0)
    motion = Motion.of(world, [stop])
    seen = sights([stop], 6.0)
    for off, expected in ((0.0098, (1, 1, 1)), (0.0102, (0, 1, 1)), (0.0198, (0, 1, 1)), (0.0202, (0, 0, 1)),
                          (0.0498, (0, 0, 1)), (0.0502, (0, 0, 0))):  # fmt: skip
        cloud = by_hand.cloud([[2.0 - off, 0.1, 1.0], [2.0 - off, 0.2, 1.1], [2.0 - off, 0.3, 1.0]])
        assert score_surface(world, motion, seen, cloud).precision == expected
    offs = [0.001 * k for k in range(1, 11)]
    cloud = by_hand.cloud([[2.0 - off, 0.1, 1.0] for off in offs])
    score = score_surface(world, motion, seen, cloud)
    assert (score.accuracy_median, score.accuracy_p90) == pytest.approx((0.0055, 0.010), abs=1e-6)
    assert score.f_score[2] == pytest.approx(2.0 * score.completeness[2] / (1.0 + score.completeness[2]))


def test_samples_are_thinned_once_all_stops_together_hold_more_than_enough(by_hand):
    world = by_hand.world(by_hand.body("wall", Box((0.1, 9.0, 9.0)), 2.05, 0.0, 1.0, structure=True))
    camera = Camera.from_fov(400, 250, 1.2)  # 100,000 pixels
    stop = by_hand.stop(world, 0.0, 0.0, 0.0, height=1.0, down=0.0, camera=camera)
    motion, seen = Motion.of(world, [stop]), sights([stop], 6.0)
    whole = len(visible_surface(seen, motion).points)
    assert whole == seen[0].seen.sum()
    assert len(visible_surface(seen * 8, motion).points) == 8 * whole
    thinned = visible_surface(seen * 9, motion).points
    assert len(thinned) == pytest.approx(9 * whole / 4, rel=0.01)
    every_second = np.zeros_like(seen[0].seen)
    every_second[::2, ::2] = seen[0].seen[::2, ::2]
    np.testing.assert_allclose(thinned[: len(thinned) // 9], seen[0].points(every_second), atol=1e-5)
