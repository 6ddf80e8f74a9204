"""What an agent is told of a moment: by hand for the truth, through cameras and a memory for the rest."""

import math

import numpy as np
import pytest

from flysim.common.catalogue import find_robot
from flysim.geometry.frames import Pose2
from flysim.nav.agents.surroundings import RANGE, exact_distances
from flysim.nav.drive import Drive
from flysim.nav.senses import Senses
from flysim.nav.settings import Settings
from flysim.nav.spaces import TOP_FLIES
from flysim.nav.stage import Stage
from flysim.robots.robot import read_robot

GOAL = (3.0, 4.0)


@pytest.fixture
def placed(world):
    """Makes the senses of a rover that stands at a pose in the room, with what they are asked with."""
    stages, robot = [], read_robot(find_robot("rover"))

    def one(pose=Pose2(0.0, 0.0, 0.0), **settings):
        given = Settings.of({"world": world, "renderer": "tiny", **settings})
        senses = Senses(given, robot)
        looks = given.observation != "truth"
        stages.append(Stage(world, robot, senses.rig, given.renderer, dressed=True, looks=looks))
        return senses, stages[-1], Drive(stages[-1].set_up(pose))

    yield one
    for stage in stages:
        stage.close()


def told(senses, stage, drive, seed=0, looks=1):
    """The last of some looks from one place, in a new episode."""
    rng = np.random.default_rng(seed)
    senses.begin(rng)
    for _ in range(looks):
        found = senses.observe(stage, drive, GOAL, rng)
    return found


def test_the_goal_is_told_from_the_heading(placed):
    found = told(*placed(Pose2(0.0, 0.0, math.pi / 2.0), observation="truth"))
    away, bearing = found["goal"]
    assert away == pytest.approx(5.0, abs=0.01)
    assert bearing == pytest.approx(math.atan2(4.0, 3.0) - math.pi / 2.0, abs=0.01)
    assert found["velocity"].tolist() == [0.0, 0.0]


def test_the_truth_is_that_of_the_outlines_all_round(placed):
    senses, stage, drive = placed(observation="truth")
    found = told(senses, stage, drive)
    assert found.keys() == {"goal", "velocity", "obstacles"}
    np.testing.assert_array_equal(found["obstacles"], exact_distances(stage.ground.outline, drive.true))
    assert found["obstacles"][36] == pytest.approx(1.8, abs=0.02)  # the box 2 m ahead is 0.4 m deep


def test_pixels_are_what_the_cameras_take(placed):
    senses, stage, drive = placed(observation="pixels")
    found = told(senses, stage, drive)
    pair = stage.pair()
    np.testing.assert_array_equal(found["left"], pair.left)
    np.testing.assert_array_equal(found["right"], pair.right)
    assert found["left"].flags.writeable  # the agent's own


def test_a_disturbed_camera_takes_its_noise_from_the_episode(placed):
    noisy = placed(observation="pixels", sensors={"noise": 8.0})
    one, again, other = (told(*noisy, seed=seed)["left"] for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert (one != other).mean() > 0.5
    assert (one != noisy[1].pair().left).mean() > 0.5


def test_what_was_seen_is_remembered_until_the_next_episode(placed):
    senses, stage, drive = placed(observation="sgbm")
    near = told(senses, stage, drive)["obstacles"]
    assert near[34:38].min() == pytest.approx(1.8, abs=0.25)
    pair, points, remembered = senses.seen(stage, drive)
    assert pair.left.shape == (120, 160, 3)
    assert 0 < len(remembered) <= 256 and len(points) >= len(remembered)
    stage.set_up(Pose2(0.0, 0.0, math.pi))  # turned away from everything, the memory stays
    away = Drive(stage.simulation)
    kept = senses.observe(stage, away, GOAL, np.random.default_rng(0))["obstacles"]
    assert kept[:3].min() < 2.2 or kept[-3:].min() < 2.2  # the box is behind it now
    assert (told(senses, stage, away)["obstacles"][[0, 1, -2, -1]] == RANGE).all()  # a new episode has not seen it


def test_the_fittest_flies_are_told_and_the_rest_of_the_rows_are_zeros(placed):
    found = told(*placed(observation="flies"), looks=4)
    flies = found["flies"]
    assert flies.shape == (TOP_FLIES, 3)
    rows = np.abs(flies).sum(axis=1) > 0.0
    assert rows[: rows.sum()].all()
    assert (flies[rows, 2] > 0.0).all()


def test_what_counts_as_an_obstacle_is_a_setting(placed):
    usual = told(*placed(observation="sgbm"))["obstacles"]
    strict = told(*placed(observation="sgbm", surroundings={"backed": 200}))["obstacles"]
    assert (usual < RANGE).sum() > 0
    assert (strict == RANGE).all()
