"""Bodies come to rest before a path is planned round them, and before a robot sets out."""

import numpy as np
import pytest

from flysim.common.catalogue import find_robot
from flysim.errors import WorldError
from flysim.geometry.frames import Pose2
from flysim.robots.robot import read_robot
from flysim.runs.planned import world_scenario
from flysim.sim.rest import at_rest
from flysim.sim.simulation import Simulation
from flysim.worlds.sdf.reader import read_world


def part(geometry):
    return "".join(f'<{tag} name="c"><geometry>{geometry}</geometry></{tag}>' for tag in ("collision", "visual"))


GROUND = f"<model name='g'><static>true</static><link name='l'>{part('<plane><size>9 9</size></plane>')}</link></model>"


def write(folder, z, extra=""):
    box = part("<box><size>0.4 0.4 0.4</size></box>")
    body = f"<model name='crate'><pose>2 0 {z} 0 0 0</pose><link name='l'>{box}</link></model>"
    path = folder / "w.sdf"
    path.write_text(f"<sdf version='1.9'><world name='w'>{extra}{GROUND}{body}</world></sdf>")
    return path


def test_what_is_put_above_the_floor_falls_on_it(tmp_path):
    rested = at_rest(read_world(write(tmp_path, 1.5)))
    assert rested.links[1].T_world_link[:3, 3] == pytest.approx([2.0, 0.0, 0.2], abs=0.01)


def test_what_rests_and_what_cannot_move_stays_to_the_bit(tmp_path):
    world = read_world(write(tmp_path, 0.2))
    assert np.array_equal(at_rest(world).links[1].T_world_link, world.links[1].T_world_link)
    assert at_rest(read_world(write(tmp_path, 0.2, "<!-- -->"))).links[0] is not None


def test_a_robot_sets_out_when_what_falls_has_come_to_rest(tmp_path):
    world = read_world(write(tmp_path, 3.0))
    with Simulation(world, read_robot(find_robot("rover")), Pose2(0.0, 0.0, 0.0)) as simulation:
        assert simulation.T_world_links()[1][2, 3] == pytest.approx(0.2, abs=0.01)
        assert simulation.sim_time == 0.0


def test_without_gravity_nothing_drives(tmp_path):
    world = read_world(write(tmp_path, 0.2, "<gravity>0 0 0</gravity>"))
    with pytest.raises(WorldError, match="wheels do not drive without gravity, which is 0 m/s"):
        Simulation(world, read_robot(find_robot("rover")), Pose2(0.0, 0.0, 0.0))
    with pytest.raises(WorldError, match="wheels do not drive without gravity"):
        at_rest(world)


def test_planning_counts_in_the_time_of_a_run(tmp_path):
    plan = world_scenario(write(tmp_path, 0.2), path="frontal")
    assert 0.0 < plan.planning_s < 60.0
    assert "planning_s" not in plan.model_dump()
