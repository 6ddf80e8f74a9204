"""Whatever engine sees for an agent: points where something stands, in the robot's own frame, and none elsewhere."""

import numpy as np
import pytest

from flysim.common.catalogue import find_robot, find_world
from flysim.flies.parameters import FlyParams
from flysim.geometry.frames import Pose2
from flysim.nav.seeing import Seeing
from flysim.nav.settings import Settings
from flysim.nav.stage import Stage
from flysim.robots.robot import read_robot
from flysim.worlds.sdf.reader import read_world

HERE = Pose2(0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def rover():
    return read_robot(find_robot("rover"))


@pytest.fixture(scope="module")
def view(rover):
    """What the rover sees of `paper` from its origin, and its small cameras."""
    rig = rover.rig.resized(160, 120)
    stage = Stage("paper", rover, rig, "tiny", dressed=False)
    stage.set_up(HERE)
    yield stage.pair(), rig
    stage.close()


@pytest.mark.parametrize("name", ["flies", "sgbm", "bm"])
def test_every_engine_tells_an_agent_where_the_box_stands(rover, view, name):
    pair, rig = view
    seeing, rng = Seeing(name, rover, rig), np.random.default_rng(0)
    seeing.begin()
    for look in range(6):  # flies grow in number from look to look
        points = seeing.see(pair, HERE, 0.1 * look, rng)
    assert len(points) > 50
    assert (points[:, 2] > 0.05).all() and (points[:, 2] < rover.height).all()
    box = next(link for link in read_world(find_world("paper")).links if link.model == "box")
    near = np.linalg.norm(points[:, :2] - box.T_world_link[:2, 3], axis=1) < 0.4
    assert near.sum() >= 5


def test_an_episode_begins_with_nothing_seen(rover, view):
    pair, rig = view
    seeing = Seeing("flies", rover, rig)
    first = []
    for _ in range(2):
        seeing.begin()
        rng = np.random.default_rng(3)
        first.append([seeing.see(pair, HERE, 0.1 * look, rng) for look in range(2)])
    for one, again in zip(*first, strict=True):
        np.testing.assert_array_equal(one, again)
    assert len(first[0][1]) > len(first[0][0])  # the second look breeds from the first


def test_flies_of_ones_own_are_taken(rover, view):
    pair, rig = view
    few = Seeing("flies", rover, rig, FlyParams(population=100, max_iterations=1, min_depth=0.3, max_depth=5.0))
    few.begin()
    assert len(few.see(pair, HERE, 0.0, np.random.default_rng(0))) < 100


@pytest.mark.parametrize(
    ("given", "error", "said"),
    [
        ({"observation": "flise"}, ValueError, "no observation 'flise'. Did you mean 'flies'"),
        ({"goal_radious": 0.2}, TypeError, "no argument 'goal_radious'. Did you mean 'goal_radius'"),
        ({"v_max": 0.0}, ValueError, "v_max must be a number in"),
        ({"start": (0.0, 1.0)}, ValueError, "start must be 3 finite numbers"),
        ({"episodes_per_world": 0}, ValueError, "episodes_per_world must be a whole number in"),
        ({"episodes_per_world": 1.5}, ValueError, "episodes_per_world must be a whole number in"),
        ({"shortest": -1.0}, ValueError, "shortest must be a number in"),
        ({"shortest": float("nan")}, ValueError, "shortest must be a number in"),
        ({"time_limit": "a"}, ValueError, "time_limit must be a number in .* got 'a'"),
        ({"surroundings": {"backd": 1}}, ValueError, "surroundings has no 'backd'. Did you mean 'backed'"),
        ({"surroundings": {"cell": 0.0}}, ValueError, "surroundings: cell must be a number in"),
        ({"size": 160}, ValueError, "size must be two whole numbers"),
    ],
)
def test_nonsense_is_refused_before_a_world_is_read(given, error, said):
    with pytest.raises(error, match=said):
        Settings.of(given)
