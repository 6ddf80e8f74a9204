"""The account of an episode: what a step earns, when it is over, and what is told of it."""

import math

import pytest

from flysim.common.catalogue import find_robot, find_world
from flysim.geometry.frames import Pose2
from flysim.nav.attempt import Attempt
from flysim.nav.settings import Settings
from flysim.paths.course import Course, Ground
from flysim.robots.robot import read_robot
from flysim.worlds.sdf.reader import read_world


class Told:
    """A drive that goes where it is told: each step to the next of the places."""

    def __init__(self, *places, hit_at=None):
        self.true, self.places, self.hit_at = Pose2(0.0, -1.5, 0.0), list(places), hit_at
        self.driven = self.seconds = 0.0

    def go(self, v, w):
        here, self.true = self.true, Pose2(*self.places.pop(0), 0.0)
        self.driven += here.distance(self.true)
        self.seconds += 0.1
        return "box" if len(self.places) == self.hit_at else None


@pytest.fixture(scope="module")
def ground():
    return Ground(read_world(find_world("paper")), read_robot(find_robot("rover")))


@pytest.fixture
def attempt(ground):
    def make(drive, **settings):
        course = Course(start=Pose2(0.0, -1.5, 0.0), goal=(2.0, -1.5), shortest=2.0)
        return Attempt(course, ground, drive, Settings.of(settings))

    return make


def test_a_step_earns_the_way_that_it_saves_less_its_time(attempt):
    one = attempt(Told((0.5, -1.5), (0.3, -1.5)))
    forth, back = one.go(0.5, 0.0), one.go(-0.5, 0.0)
    assert forth[0] == pytest.approx(0.5 - 0.01, abs=0.03)
    assert back[0] == pytest.approx(-0.2 - 0.01, abs=0.03)
    assert forth[1:] == back[1:] == (False, False)
    assert not one.over
    told = one.info()
    assert (told["success"], told["collisions"], told["spl"]) == (False, 0, 0.0)
    assert told["path_length"] == pytest.approx(0.7)
    assert told["distance"] == pytest.approx(1.7, abs=0.03)
    assert told["time"] == pytest.approx(0.2)
    assert tuple(told["position"]) == (0.3, -1.5, 0.0)


def test_arriving_ends_it_and_is_worth_ten(attempt):
    one = attempt(Told((1.0, -1.5), (1.75, -1.5)))
    assert one.go(1.0, 0.0)[1] is False
    reward, terminated, truncated = one.go(1.0, 0.0)
    assert reward == pytest.approx(0.75 - 0.01 + 10.0, abs=0.03)
    assert (terminated, truncated, one.over) == (True, False, True)
    assert one.info()["success"] is True
    assert one.info()["spl"] == 1.0  # 1.75 m driven, 2 m the shortest way
    assert attempt(Told((1.6, -1.5)), goal_radius=0.3).go(1.0, 0.0)[1] is False
    assert attempt(Told((1.6, -1.5)), goal_radius=0.5).go(1.0, 0.0)[1] is True


def test_touching_something_ends_it_costs_ten_and_is_no_success_even_at_the_goal(attempt):
    one = attempt(Told((1.9, -1.5), hit_at=0))
    reward, terminated, truncated = one.go(1.0, 0.0)
    assert reward == pytest.approx(1.9 - 0.01 - 10.0, abs=0.03)
    assert (terminated, truncated) == (True, False)
    told = one.info()
    assert (told["success"], told["collisions"], told["hit"], told["spl"]) == (False, 1, "box", 0.0)


def test_time_ends_it_but_who_arrives_in_the_last_moment_has_arrived(attempt):
    late = attempt(Told((0.1, -1.5), (0.2, -1.5)), time_limit=0.2)
    assert late.go(1.0, 0.0)[1:] == (False, False)
    assert late.go(1.0, 0.0)[1:] == (False, True)
    assert late.over
    just = attempt(Told((0.1, -1.5), (1.9, -1.5)), time_limit=0.2)
    just.go(1.0, 0.0)
    assert just.go(1.0, 0.0)[1:] == (True, False)


def test_the_clearance_is_the_least_so_far(attempt, ground):
    near, far = (1.4, 0.0), (0.0, -1.4)
    one = attempt(Told(near, far))
    one.go(1.0, 0.0)
    least = one.info()["clearance"]
    assert least == pytest.approx(ground.clearance(*near))
    one.go(1.0, 0.0)
    assert one.info()["clearance"] == least < ground.clearance(*far)
    assert math.isfinite(least)
