"""What tells the three paths apart: from which sides they look, how they are ordered, and how they are joined."""

import itertools
import math

import numpy as np
import pytest

from flysim.paths.grid import survey
from flysim.paths.kinds import MAX_STOPS, frontal, joined, orbit, sweep
from flysim.paths.outlook import outlook
from flysim.paths.route import Ways
from flysim.paths.target import find_targets
from flysim.worlds.sdf.reader import read_world

BOX = (2.5, 0.0)


@pytest.fixture(scope="module")
def floor(made, tmp_path_factory):
    """A box ahead and one aside: grid, ways, targets, robot, and the start's own view."""
    models = (
        made.body("ahead", made.box(0.5, 0.5, 0.5), f"{BOX[0]} {BOX[1]} 0.25 0 0 0"),
        made.body("aside", made.box(0.4, 0.4, 0.5), "0.5 3.0 0.25 0 0 0"),
    )
    world, robot = read_world(made.write(tmp_path_factory.mktemp("kinds") / "w.sdf", *models)), made.geometry()
    grid = survey(world, robot.height)
    ways, targets = Ways(grid, robot.radius + 0.03), find_targets(world, grid, 0.05)
    start = outlook(grid, targets, robot, np.zeros((1, 2)), np.zeros(1)), 0
    return grid, ways, targets, robot, start


@pytest.fixture(scope="module")
def paths(floor):
    return {kind.__name__: kind(*floor) for kind in (orbit, frontal, sweep)}


def places(views):
    return np.array([one.xy[k] for one, k in views])


@pytest.mark.parametrize("name", ["orbit", "frontal", "sweep"])
def test_each_begins_at_the_start_and_stands_where_the_robot_can(floor, paths, name):
    grid, ways, _, robot, start = floor
    views = paths[name]
    assert views[0] is start or views[0] == start
    assert 2 <= len(views) <= MAX_STOPS
    assert grid.clear_of(places(views)).min() >= robot.radius
    assert len({ways.region[ways.node_at(xy)] for xy in places(views)}) == 1


def test_an_orbit_looks_from_all_round_and_frontal_from_before_alone(paths):
    def bearings(views):
        """From the box ahead to the stops that are nearer to it than to the other one [degrees]."""
        off = places(views) - BOX
        near = np.linalg.norm(off, axis=1) < np.linalg.norm(places(views) - (0.5, 3.0), axis=1)
        return np.degrees(np.arctan2(off[near, 1], off[near, 0]))

    round_it, before = bearings(paths["orbit"]), bearings(paths["frontal"])
    assert {math.floor((b + 45.0) / 90.0) % 4 for b in round_it} == {0, 1, 2, 3}
    assert (np.abs(np.abs(before) - 180.0) < 52.0).all()  # the start lies at 180 degrees from it
    assert len(before) >= 2  # the start's own view among them


def test_every_obstacle_is_shown_by_an_orbit(floor, paths):
    targets = floor[2]
    shown = {k for one, view in paths["orbit"] for k in targets.obstacle[one.entries(view)[0] // 3].tolist()}
    assert shown == {0, 1}


def test_a_sweep_looks_along_its_rows_and_across_them(paths):
    quarters = [views.yaw[k] / (math.pi / 2.0) for views, k in paths["sweep"][1:]]
    assert quarters == pytest.approx([round(quarter) for quarter in quarters], abs=1e-9)
    assert {round(quarter) % 2 for quarter in quarters} == {0, 1}
    for views, k in paths["sweep"][1:]:
        assert len(views.entries(k)[0]) > 0  # nothing is looked at where there is nothing


def test_the_order_is_a_short_tour(floor, paths):
    ways, views = floor[1], paths["orbit"]
    nodes = [ways.node_at(xy) for xy in places(views)]

    def driven(order):
        return sum(ways.costs(a)[b] for a, b in itertools.pairwise(order))

    rng = np.random.default_rng(0)
    others = [driven([nodes[0], *rng.permutation(nodes[1:]).tolist()]) for _ in range(20)]
    assert driven(nodes) < min(others)


def test_views_are_joined_by_ways_that_are_free(floor, paths):
    grid, ways, _, robot, _ = floor
    views = paths["orbit"]
    legs = joined(ways, views)
    assert len(legs) == len(views) - 1
    for (a, b), via in zip(itertools.pairwise(places(views)), legs, strict=True):
        for one, other in itertools.pairwise([a, *map(np.array, via), b]):
            on_it = one + np.linspace(0.0, 1.0, 40)[:, None] * (other - one)
            assert grid.clear_of(on_it).min() >= robot.radius
