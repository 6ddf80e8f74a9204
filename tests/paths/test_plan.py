"""What a user may rely on of a planned path: stops and legs are free, obstacles are seen, the same every time."""

import itertools
import math

import numpy as np
import pytest

from flysim.errors import WorldError
from flysim.geometry.frames import Pose2
from flysim.paths.plan import plan_stops
from flysim.runs.scenario_parts import StopPlan
from flysim.sim.simulation import Simulation
from flysim.sources.simulated import drive
from flysim.worlds.sdf.reader import read_world

WORLDS = ("yard", "corridor", "world_0")


@pytest.mark.parametrize(
    ("name", "kind"),
    [("yard", "orbit"), ("yard", "sweep"), ("yard", "frontal"), ("corridor", "orbit"), ("world_0", "orbit")],
)
def test_every_stop_and_every_leg_is_free(made, name, kind):
    plan = made.planned(name, kind)
    assert 1 < len(plan.stops) <= 60
    assert plan.stops[0].via == ()
    with Simulation(made.world(name), made.rover(), Pose2(plan.stops[0].x, plan.stops[0].y, 0.0)) as simulation:
        for stop in plan.stops:
            assert simulation.occupied(Pose2(stop.x, stop.y, stop.yaw)) is None
        here = (plan.stops[0].x, plan.stops[0].y)
        for stop in plan.stops[1:]:
            for point in (*stop.via, (stop.x, stop.y)):
                for share in np.linspace(0.0, 1.0, max(2, round(math.dist(here, point) / 0.2))):
                    x, y = (a + share * (b - a) for a, b in zip(here, point, strict=True))
                    assert simulation.occupied(Pose2(x, y, 0.0)) is None, f"on the way to ({stop.x}, {stop.y})"
                here = point


@pytest.mark.parametrize("name", WORLDS)
def test_the_robot_drives_it_on_its_wheels(made, name):
    """The first stops of each world: a whole tour takes half a minute."""
    plan = made.planned(name, "orbit")
    first = plan.stops[0]
    with Simulation(made.world(name), made.rover(), Pose2(first.x, first.y, first.yaw)) as simulation:
        for stop in plan.stops[1:4]:
            asked = StopPlan(x=stop.x, y=stop.y, yaw_deg=math.degrees(stop.yaw), via=stop.via)
            leg = drive(simulation, asked)
            assert leg.blocked is None
            assert simulation.true_pose().distance(Pose2(stop.x, stop.y, 0.0)) < 0.02


def test_an_orbit_sees_every_side_that_has_room_before_it(made):
    assert made.planned("yard", "orbit").covered == 1.0
    assert made.planned("paper", "orbit").covered == 1.0
    assert made.planned("corridor", "orbit").covered > 0.8  # boxes stand before its walls
    assert made.planned("yard", "orbit").warnings == ()
    assert len(made.planned("yard", "orbit").stops) <= 40


def test_a_barn_world_is_seen_for_the_most_part(made):
    assert made.planned("world_0", "orbit").covered > 0.8


def test_frontal_stays_on_the_side_of_the_start(made):
    plan = made.planned("paper", "frontal")
    assert 2 <= len(plan.stops) <= 4
    for stop in plan.stops:
        assert stop.x < 2.2  # the middle of the box
        assert abs(stop.yaw if stop.yaw < math.pi else stop.yaw - math.tau) < math.radians(60.0)


def test_a_sweep_looks_along_and_across(made):
    plan = made.planned("yard", "sweep")
    axes = [round(stop.yaw / (math.pi / 2.0)) % 4 for stop in plan.stops]
    assert {k % 2 for k in axes} == {0, 1}
    assert all(abs(stop.yaw / (math.pi / 2.0) - round(stop.yaw / (math.pi / 2.0))) < 1e-9 for stop in plan.stops)


def test_the_same_world_gives_the_same_path(made):
    for kind in ("orbit", "sweep", "frontal"):
        assert plan_stops(made.world("paper"), made.geometry(), kind) == made.planned("paper", kind)


def test_the_path_starts_at_the_origin_or_near(made, tmp_path):
    assert (made.planned("yard", "orbit").stops[0].x, made.planned("yard", "orbit").stops[0].y) == (0.0, 0.0)
    world = read_world(made.write(tmp_path / "w.sdf", made.body("on_it", made.box(0.4, 0.4, 0.4), "0 0 0.2 0 0 0")))
    first = plan_stops(world, made.geometry(), "orbit").stops[0]
    assert 0.35 < math.hypot(first.x, first.y) < 0.6


def test_what_cannot_be_seen_is_named(made, tmp_path):
    hut = [
        made.body(f"side_{k}", made.box(2.0, 0.1, 1.0), f"{3 + dx} {dy} 0.5 0 0 {turn}")
        for k, (dx, dy, turn) in enumerate([(0, 1, 0), (0, -1, 0), (1, 0, math.pi / 2), (-1, 0, math.pi / 2)])
    ]
    hidden = made.body("hidden", made.box(0.3, 0.3, 0.3), "3 0 0.15 0 0 0")
    world = read_world(made.write(tmp_path / "w.sdf", *hut, hidden))
    (warning,) = plan_stops(world, made.geometry(), "orbit").warnings
    assert warning == "path orbit sees nothing of 'hidden': no free place that can be reached shows them."


def test_a_far_wall_does_not_take_every_stop(made, tmp_path):
    wall = made.body("long", made.box(0.2, 30.0, 0.5), "6 0 0.25 0 0 0")
    small = made.body("small", made.box(0.3, 0.3, 0.3), "2 0 0.15 0 0 0")
    plan = plan_stops(read_world(made.write(tmp_path / "w.sdf", wall, small)), made.geometry(), "orbit")
    near_small = sum(math.dist((s.x, s.y), (2.0, 0.0)) < 1.8 for s in plan.stops)
    assert near_small >= 4


def test_nothing_to_look_at_is_a_look_round(made, tmp_path):
    plan = plan_stops(read_world(made.write(tmp_path / "w.sdf")), made.geometry(), "orbit")
    assert [round(math.degrees(stop.yaw)) for stop in plan.stops] == [0, 60, 120, 180, 240, 300]
    assert plan.warnings == ("the world has no obstacle: in place of path orbit a look once round from the start.",)


def test_nowhere_to_stand_is_refused(made, tmp_path):
    world = read_world(made.write(tmp_path / "w.sdf", ground=False))
    with pytest.raises(WorldError, match="the robot can stand nowhere: it has no floor"):
        plan_stops(world, made.geometry(), "orbit")


def test_a_floor_of_boxes_ends_where_it_ends(made, tmp_path):
    floor = made.body("floor", made.box(4.0, 2.0, 0.1), "1.5 0 -0.05 0 0 0")
    thing = made.body("thing", made.box(0.2, 0.2, 0.3), "2.5 0 0.15 0 0 0")
    plan = plan_stops(read_world(made.write(tmp_path / "w.sdf", floor, thing, ground=False)), made.geometry(), "orbit")
    assert len(plan.stops) > 2
    for stop in plan.stops:
        assert abs(stop.y) <= 1.0 - made.rover().radius
        assert -0.5 + made.rover().radius <= stop.x <= 3.5 - made.rover().radius


def test_bodies_nearer_than_the_gap_are_looked_at_as_one(made, tmp_path):
    pair = [made.body(f"b{k}", made.box(0.3, 0.3, 0.3), f"2 {0.17 * (2 * k - 1)} 0.15 0 0 0") for k in range(2)]
    world = read_world(made.write(tmp_path / "w.sdf", *pair))
    apart = plan_stops(world, made.geometry(), "frontal", merge_gap=0.0)
    together = plan_stops(world, made.geometry(), "frontal", merge_gap=0.1)
    assert len(together.stops) <= len(apart.stops)


def test_stops_are_apart(made):
    for a, b in itertools.pairwise(made.planned("yard", "orbit").stops):
        assert (a.x, a.y, a.yaw) != (b.x, b.y, b.yaw)
