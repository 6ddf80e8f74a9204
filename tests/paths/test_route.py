"""Ways over the free floor and short tours of places, against lengths worked out by hand and all orders tried."""

import itertools
import math

import numpy as np
import pytest

from flysim.paths.grid import survey
from flysim.paths.route import DEAR, STEP, Ways, tour
from flysim.worlds.sdf.reader import read_world

ROOM = 0.25  # [m] that the robot's axis keeps


@pytest.fixture(scope="module")
def ways(made, tmp_path_factory):
    """A wall of 2 m across the way, from (1, -1) to (1, 1), and a closed pen behind it."""
    models = [made.body("wall", made.box(0.1, 2.0, 0.5), "1 0 0.25 0 0 0")]
    for k, (x, y, turn) in enumerate([(4.0, 0.9, 0), (4.0, -0.9, 0), (3.1, 0, 1), (4.9, 0, 1)]):
        models.append(made.body(f"pen_{k}", made.box(1.9, 0.1, 0.5), f"{x} {y} 0.25 0 0 {turn * math.pi / 2}"))
    world = read_world(made.write(tmp_path_factory.mktemp("ways") / "w.sdf", *models))
    return lambda dear=DEAR: Ways(survey(world, 0.4), ROOM, dear)


def length(ways, a, b):
    first, last = ways.node_at(np.array(a)), ways.node_at(np.array(b))
    points = np.array([ways.nodes[first], *ways.way(first, last), ways.nodes[last]])
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()), points


def test_a_way_in_the_open_is_one_straight_line(ways):
    found, points = length(ways(), (-1.0, 2.0), (2.0, 2.0))
    assert len(points) == 2
    assert found == pytest.approx(3.0, abs=2 * STEP)


def test_the_shortest_way_turns_at_the_end_of_the_wall(ways):
    found, points = length(ways(0.0), (0.0, 0.0), (2.0, 0.0))
    corner = math.hypot(0.95, 1.0 + ROOM / math.sqrt(2.0))  # past the corner of the wall, at its room
    over_cells = 1.0 / math.cos(math.pi / 8.0)  # so much longer at most than the straight one
    assert 2.0 * corner < found < 2.0 * math.hypot(1.0, 1.0 + ROOM) * over_cells
    grid = ways(0.0).grid
    for a, b in itertools.pairwise(points):
        on_it = a + np.linspace(0.0, 1.0, 50)[:, None] * (b - a)
        assert grid.clear_of(on_it).min() >= ROOM - 0.02


def test_a_berth_is_dearer_than_a_detour(ways):
    near, _ = length(ways(0.0), (0.0, 0.0), (2.0, 0.0))
    wide, _ = length(ways(8.0), (0.0, 0.0), (2.0, 0.0))
    assert wide > near + 0.1


def test_costs_are_lengths_where_nothing_is_dear_and_there_is_no_way_into_the_pen(ways):
    one = ways(0.0)
    here, there, pen = (one.node_at(np.array(p)) for p in ((-1.0, 2.0), (2.0, 2.0), (4.0, 0.0)))
    assert one.costs(here)[there] == pytest.approx(3.0, abs=2 * STEP)
    assert one.costs(here)[here] == 0.0
    assert one.costs(here)[pen] == math.inf
    assert one.region[pen] != one.region[here] == one.region[there]
    with pytest.raises(ValueError, match="no way leads there: ask for nodes of one region"):
        one.way(here, pen)
    assert one.node_at(np.array((4.0, 0.0)), int(one.region[here])) not in (pen, -1)
    assert one.node_at(np.array((4.0, 0.0)), 10_000) == -1  # there is no such region


def test_what_was_forgotten_is_found_again(ways):
    one = ways()
    first = one.node_at(np.array((0.0, 0.0)))
    before = one.costs(first)
    assert one.costs(first) is before
    one.forget()
    assert one.costs(first) is not before
    np.testing.assert_array_equal(one.costs(first), before)


def test_nodes_stand_where_the_robot_can(ways):
    one = ways()
    assert one.grid.clear_of(one.nodes).min() >= ROOM
    assert one.straight(np.array([-1.0, 2.0]), np.array([2.0, 2.0]))
    assert not one.straight(np.array([0.0, 0.0]), np.array([2.0, 0.0]))


@pytest.mark.parametrize("seed", range(4))
def test_a_tour_goes_everywhere_once_and_is_nearly_the_shortest(seed):
    places = np.random.default_rng(seed).uniform(0.0, 10.0, (7, 2))
    costs = np.linalg.norm(places[:, None] - places, axis=2)

    def cost(order):
        return sum(costs[a, b] for a, b in itertools.pairwise(order))

    found = tour(costs)
    assert found[0] == 0 and sorted(found) == list(range(7))
    best = min(cost((0, *rest)) for rest in itertools.permutations(range(1, 7)))
    assert best - 1e-9 <= cost(found) <= 1.1 * best


def test_a_tour_that_began_greedily_is_untangled():
    # On a line at 0, -1, 1.5, -4: the nearest neighbour each time goes to and fro.
    at = np.array([0.0, -1.0, 1.5, -4.0])
    order = tour(np.abs(at[:, None] - at))
    assert order == [0, 2, 1, 3]
    assert tour(np.zeros((1, 1))) == [0]
