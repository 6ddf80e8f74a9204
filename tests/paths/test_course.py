"""Courses of episodes and how far it still is: lengths that can be worked out by hand, in `paper` with its one box."""

import math

import numpy as np
import pytest

from flysim.geometry.frames import Pose2
from flysim.paths.course import NEAREST_GOAL, ROOMY, Ground, outlines
from flysim.paths.field import Field

BOX = (2.2, 0.0)  # centre [m] of the box, which is 40 by 30 cm and turned

# A way over cells, sideways, down and along diagonals, is at most so many times as long as the straight one.
OVER_CELLS = 1.0 / math.cos(math.pi / 8.0)


@pytest.fixture(scope="module")
def ground(made):
    return Ground(made.world("paper"), made.rover())


def test_a_way_in_the_open_is_straight(ground):
    course = ground.course(np.random.default_rng(0), Pose2(0.0, -1.5, 0.0), (2.0, -1.5))
    assert course.shortest == pytest.approx(2.0, abs=0.03)


def test_a_way_behind_the_box_goes_round_it(ground):
    start, goal = Pose2(1.2, 0.0, 0.0), (3.1, 0.0)
    course = ground.course(np.random.default_rng(0), start, goal)
    beyond = ground.robot.radius + 0.25  # the box's diagonal is half a metre
    assert 1.9 + 0.02 < course.shortest < 2.0 * math.hypot(0.95, beyond + 0.05)


def test_drawn_courses_keep_their_promises(ground):
    for seed in range(20):
        course = ground.course(np.random.default_rng(seed), None, None)
        assert ground.clearance(course.start.x, course.start.y) >= 0.0
        assert ground.clearance(*course.goal) >= ROOMY - 0.03
        assert course.shortest >= NEAREST_GOAL / OVER_CELLS - 0.05  # what is drawn by cells is then pulled straight
        assert course.shortest >= math.dist((course.start.x, course.start.y), course.goal) - 1e-9
    again = ground.course(np.random.default_rng(19), None, None)
    assert (again.start, again.goal, again.shortest) == (course.start, course.goal, course.shortest)


def test_clearance_is_that_of_the_robot_s_circle(ground):
    free = ground.clearance(0.2, 0.0)
    nearer = ground.clearance(0.5, 0.0)
    assert free - nearer == pytest.approx(0.3, abs=0.02)  # straight at the box
    assert ground.clearance(*BOX) < 0.0


def test_what_is_taken_is_refused(ground):
    with pytest.raises(ValueError, match=r"goal \(2.2, 0\) is taken"):
        ground.course(np.random.default_rng(0), Pose2(0.0, 0.0, 0.0), BOX)
    with pytest.raises(ValueError, match="start must be finite"):
        ground.course(np.random.default_rng(0), Pose2(math.nan, 0.0, 0.0), (0.0, 1.0))


def test_outlines_lie_on_what_stands_and_not_on_the_floor(ground):
    points = outlines(ground.world, ground.robot.height)
    about = points[np.linalg.norm(points - BOX, axis=1) < 0.5]
    radius = np.linalg.norm(about - BOX, axis=1)
    assert radius.min() == pytest.approx(0.15, abs=0.01)  # half its narrow side
    assert radius.max() == pytest.approx(0.25, abs=0.01)  # half its diagonal
    assert len(about) == pytest.approx(140, abs=8)  # a point a centimetre


def test_the_field_is_the_way_that_is_left(ground):
    goal = (3.1, 0.0)
    field = Field(ground, goal)
    assert field.at(*goal) == 0.0
    assert field.at(3.1, 0.05) == pytest.approx(0.05)
    for x, y in ((1.2, 0.0), (0.0, -1.5), (2.2, 1.2)):
        course = ground.course(np.random.default_rng(0), Pose2(x, y, 0.0), goal)
        assert course.shortest - 0.05 <= field.at(x, y) <= OVER_CELLS * course.shortest + 0.05
    # It falls by at most a metre a metre, and never below the straight line.
    rng = np.random.default_rng(3)
    for a, b in zip(rng.uniform((-0.5, -1.5), (3.2, 1.5), (50, 2)), rng.uniform(-0.1, 0.1, (50, 2)), strict=True):
        if min(ground.clearance(*a), ground.clearance(*(a + b))) > 0.05:
            assert abs(field.at(*a) - field.at(*(a + b))) <= OVER_CELLS * np.linalg.norm(b) + 0.02
            assert field.at(*a) >= math.dist(a, goal) - 0.02
