"""Small robots in the styles of public ones: each is driven, or refused in one line that says what to do."""

import math
from pathlib import Path

import pytest

from flysim.errors import RobotError
from flysim.geometry.frames import Pose2
from flysim.robots.robot import read_robot
from flysim.sim.driving import drive_to
from flysim.sim.simulation import Simulation

STYLES = Path(__file__).with_name("styles")
SKID = "it is a skid steer (ros2_control or a transmission drives 4 wheels)"
REFUSED = {"small_round": "--cameras stereo mounts a pair", "vacuum": "--cameras stereo mounts a pair"}
REFUSED |= {"outdoor_small": SKID, "outdoor_large": SKID}
DRIVEN = {  # cameras, wheel radius, track [m], the body
    "hobby": (1, 0.033, 0.297, "chassis"),
    "kit": (2, 0.0775, 0.28, "base_link"),
    "large_square": (1, 0.033, 0.288, "base_link"),
    "small_round": (2, 0.033, 0.16, "base_link"),
    "vacuum": (2, 0.03575, 0.233, "base_link"),
}


def test_every_style_is_here():
    assert {path.stem for path in STYLES.glob("*.urdf")} == {*REFUSED, *DRIVEN}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_driven_is_refused_in_one_line(name):
    with pytest.raises(RobotError) as caught:
        read_robot(STYLES / f"{name}.urdf")
    said = str(caught.value)
    assert REFUSED[name] in said
    assert said.isprintable()
    assert len(said) < 300


@pytest.mark.parametrize("name", DRIVEN)
def test_it_drives_and_odometry_follows_it(made, name):
    robot = read_robot(STYLES / f"{name}.urdf", cameras="stereo" if name in REFUSED else None)
    assert (len(robot.cameras), robot.wheel_radius, pytest.approx(robot.track), robot.body) == DRIVEN[name]
    with Simulation(made.world(), robot, Pose2(0.0, 0.0, 0.0)) as simulation:
        assert abs(simulation.T_world_base()[2, 3]) < 1e-3
        leg = drive_to(simulation, Pose2(0.3, 0.0, math.pi / 2))
        odometry, true = simulation.odometry.pose, simulation.true_pose()
    assert leg.blocked is None
    assert true.distance(odometry) < 0.004
    assert abs(true.yaw - odometry.yaw) < math.radians(0.2)
