import math
import time
from pathlib import Path

import numpy as np
import pytest

from flysim.evaluate.surface import fly_distances, score_surface, visible_surface
from flysim.geometry.camera import Camera
from flysim.geometry.frames import pose6
from flysim.truth.motion import Motion
from flysim.truth.sight import sights
from flysim.worlds.model import Link, Part, World
from flysim.worlds.shapes import Box, Mesh, Plane, Sphere


def score(world, stops, cloud):
    return score_surface(world, Motion.of(world, stops), sights(stops, 6.0), cloud)


def distances(world, stops, cloud):
    motion = Motion.of(world, stops)
    return fly_distances(world, motion, visible_surface(sights(stops, 6.0), motion), cloud)


def on_face(n, x, y, z, seed=0):
    """Points spread over a box of ranges."""
    rng = np.random.default_rng(seed)
    return np.stack([rng.uniform(*r, n) if isinstance(r, tuple) else np.full(n, r) for r in (x, y, z)], axis=1)


def before_the_wall(yard, n, off):
    """Points `off` metres before what was seen of the yard's wall, well above the floor."""
    seen = [sight.points(sight.seen & (sight.stop.views[0].link == 1)) for sight in sights(yard.stops, 6.0)]
    points = np.concatenate(seen)
    return np.random.default_rng(0).choice(points[points[:, 2] > 0.5], n) - (off, 0.0, 0.0)


def test_flies_planted_a_centimetre_off_read_a_centimetre(yard, by_hand):
    off_wall = before_the_wall(yard, 400, 0.01)
    off_floor = on_face(400, (-1.2, -0.4), (-0.8, 0.8), 0.01)
    for points in (off_wall, off_floor):
        s = score(yard.world, yard.stops, by_hand.cloud(points))
        assert s.accuracy_median == pytest.approx(0.01, abs=1e-6)
        assert s.accuracy_p90 == pytest.approx(0.01, abs=1e-6)
        assert s.precision[1:] == (1.0, 1.0)


@pytest.mark.parametrize(
    ("off", "expected"), [(0.009, (1, 1, 1)), (0.015, (0, 1, 1)), (0.03, (0, 0, 1)), (0.06, (0, 0, 0))]
)
def test_precision_is_the_share_within_each_threshold(yard, by_hand, off, expected):
    points = before_the_wall(yard, 200, off)
    assert score(yard.world, yard.stops, by_hand.cloud(points)).precision == expected


def test_half_the_flies_off_is_half_the_precision(yard, by_hand):
    points = np.concatenate([before_the_wall(yard, 300, 0.0), before_the_wall(yard, 100, 0.3)])
    s = score(yard.world, yard.stops, by_hand.cloud(points))
    assert s.precision == (0.75, 0.75, 0.75)
    assert s.accuracy_median == pytest.approx(0.0, abs=1e-6)
    assert s.accuracy_p90 == pytest.approx(0.3, abs=1e-6)


def test_flies_on_the_far_floor_are_exact_though_its_pixels_are_far_apart(by_hand):
    world = by_hand.world(
        by_hand.body("floor", Plane((40.0, 40.0)), structure=True),
        by_hand.box("box", (0.1, 0.1, 1.0), 4.5, 0.0),
    )
    stop = by_hand.stop(world, 0.0, 0.0, 0.0, height=0.3, down=0.0)
    points = on_face(500, (4.0, 5.0), (-0.6, 0.6), 0.0)
    in_shadow = (np.abs(points[:, 1]) < 0.12) & (points[:, 0] > 4.4)
    assert distances(world, [stop], by_hand.cloud(points[~in_shadow])).max() < 1e-6


def test_a_fly_on_a_hidden_face_is_charged_the_way_to_what_was_seen(by_hand):
    world = by_hand.world(by_hand.box("box", (0.5, 0.5, 0.5), 0.0, 0.0))
    stop = by_hand.stop(world, -2.0, 0.0, 0.0, height=0.25, down=0.0)  # sees the front alone
    cell = 1.75 / by_hand.CAMERA.fx
    front, back = on_face(50, -0.25, (-0.2, 0.2), (0.1, 0.4)), on_face(50, 0.25, (-0.2, 0.2), (0.1, 0.4))
    assert distances(world, [stop], by_hand.cloud(front)).max() < 1e-6
    assert distances(world, [stop], by_hand.cloud(back)) == pytest.approx(np.full(50, 0.5), abs=1.5 * cell)
    behind = by_hand.stop(world, 2.0, 0.0, math.pi, index=1, height=0.25, down=0.0)  # now it was seen too
    assert distances(world, [stop, behind], by_hand.cloud(back)).max() < 1e-6


def test_inside_a_body_counts_as_much_as_outside(by_hand):
    world = by_hand.world(by_hand.body("ball", Sphere(0.3), 0.0, 0.0, 0.3))
    stop = by_hand.stop(world, -2.0, 0.0, 0.0, height=0.3, down=0.0)
    for radius in (0.28, 0.32):
        assert distances(world, [stop], by_hand.cloud([[-radius, 0.0, 0.3]])) == pytest.approx([0.02], abs=1e-6)


def test_completeness_is_the_share_of_the_surface_with_a_fly_near(by_hand):
    wall = by_hand.body("wall", Box((0.1, 2.0, 2.0)), 2.05, 0.0, 1.0, structure=True)
    world = by_hand.world(wall)
    stop = by_hand.stop(world, 0.0, 0.0, 0.0, height=1.0, down=0.0)
    (sight,) = sights([stop], 6.0)
    seen = sight.points()
    half = seen[seen[:, 1] > np.median(seen[:, 1])]
    all_of_it, some = (score(world, [stop], by_hand.cloud(p)) for p in (seen, half))
    assert all_of_it.completeness == (1.0, 1.0, 1.0)
    assert all_of_it.f_score == (1.0, 1.0, 1.0)
    assert some.completeness[0] == pytest.approx(0.5, abs=0.03)
    assert some.f_score[0] == pytest.approx(2 / 3, abs=0.03)
    # One fly in a plane covers a disc: pi tau^2 of the visible area.
    area = np.ptp(seen[:, 1]) * np.ptp(seen[:, 2])
    one = score(world, [stop], by_hand.cloud([[2.0, 0.0, 1.0]]))
    assert one.completeness[2] == pytest.approx(math.pi * 0.05**2 / area, rel=0.25)


def test_a_pushed_body_is_scored_where_the_flies_saw_it(by_hand):
    world = by_hand.world(by_hand.box("box", (0.4, 0.4, 0.4), 0.0, 0.0))
    before, after = np.array([pose6(0, 0, 0.2, 0, 0, 0)]), np.array([pose6(0.5, 0, 0.2, 0, 0, 0)])
    stops = [
        by_hand.stop(world, -2.0, 0.0, 0.0, index=0, T_world_links=before),
        by_hand.stop(world, -1.5, 0.0, 0.0, index=1, T_world_links=after),
    ]
    front = on_face(100, -0.2, (-0.15, 0.15), (0.05, 0.35))
    assert distances(world, stops, by_hand.cloud(front, stop=0)).max() < 1e-6
    assert distances(world, stops, by_hand.cloud(front, stop=1)).min() > 0.4
    assert score(world, stops, by_hand.cloud(front, stop=0)).completeness[2] > 0.3
    assert score(world, stops, by_hand.cloud(front, stop=1)).completeness[2] == 0.0


def test_a_mesh_is_scored_exactly(by_hand):
    square = np.array([[0.0, -1, 0], [0, 1, 0], [0, 1, 2], [0, -1, 2]])
    mesh = Mesh(square, np.array([[0, 1, 2], [0, 2, 3]]), None, Path("wall.obj"))
    as_seen = by_hand.world(by_hand.body("wall", Box((1e-6, 2.0, 2.0)), 2.0, 0.0, 1.0, structure=True))
    stop = by_hand.stop(as_seen, 0.0, 0.0, 0.0, height=1.0, down=0.0)
    part = Part(name="wall", shape=mesh, T_link_part=np.eye(4))
    link = Link(
        name="wall",
        model="wall",
        T_world_link=pose6(2.0, 0, 0, 0, 0, 0),
        visuals=(part,),
        collisions=(),
        static=True,
        structure=True,
    )
    world = World(name="mesh", path=Path("w.sdf"), links=(link,))
    object.__setattr__(stop, "T_world_links", np.array([link.T_world_link]))
    points = on_face(300, 1.98, (-0.5, 0.5), (0.5, 1.5))
    assert distances(world, [stop], by_hand.cloud(points)) == pytest.approx(np.full(300, 0.02), abs=1e-6)


def test_no_fly_and_nothing_to_see(yard, by_hand):
    none = score(yard.world, yard.stops, by_hand.cloud())
    assert (none.accuracy_median, none.accuracy_p90) == (None, None)
    assert none.precision == none.completeness == none.f_score == (0.0, 0.0, 0.0)
    empty = by_hand.world()
    for stops in ([], [by_hand.stop(empty, 0.0, 0.0, 0.0)]):
        s = score(empty, stops, by_hand.cloud([[1.0, 0.0, 0.0]]))
        assert (s.accuracy_median, s.accuracy_p90) == (None, None)
        assert s.precision == s.completeness == s.f_score == (0.0, 0.0, 0.0)


def test_a_fly_that_is_not_finite_is_imprecise_and_harms_no_other(yard, by_hand):
    points = np.concatenate([before_the_wall(yard, 3, 0.0), [[np.nan, 0.0, 0.0]]])
    s = score(yard.world, yard.stops, by_hand.cloud(points))
    assert s.precision == (0.75, 0.75, 0.75)
    assert s.accuracy_median == pytest.approx(0.0, abs=1e-6)
    assert s.accuracy_p90 is None


def test_ten_stops_take_about_a_second(by_hand, yard):
    camera = Camera.from_fov(640, 480, 1.2)
    stops = [by_hand.stop(yard.world, -2.2, 0.0, 0.0, index=i, camera=camera) for i in range(1)] * 10
    points = sights(stops[:1], 6.0)[0].points()
    cloud = by_hand.cloud(np.random.default_rng(0).choice(points, 20_000))
    began = time.process_time()
    score(yard.world, stops, cloud)
    assert time.process_time() - began < 2.0
