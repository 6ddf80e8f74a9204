"""The shipped robot that is written as public ones are."""

import math

import numpy as np
import pytest

from flysim.common.catalogue import find_robot
from flysim.geometry.frames import Pose2
from flysim.robots.robot import read_robot
from flysim.robots.told import told
from flysim.sim.driving import drive_to
from flysim.sim.simulation import Simulation
from flysim.worlds.shapes import Mesh

COURIER = find_robot("courier")


@pytest.fixture(scope="module")
def courier():
    return read_robot(COURIER)


def test_it_goes_through_all_that_is_read(courier):
    (mesh,) = [link.collisions[0].shape for link in courier.links if link.name == "base_link"]
    assert isinstance(mesh, Mesh)
    assert [wheel.joint for wheel in courier.wheels] == ["wheel_left_joint", "wheel_right_joint"]
    assert (courier.wheel_radius, courier.track) == (0.06, pytest.approx(0.34))
    np.testing.assert_allclose(courier.T_base_links["base_footprint"], np.eye(4), atol=1e-12)
    assert courier.T_base_links["base_link"][2, 3] == pytest.approx(0.06)
    assert courier.rig.rectified
    assert courier.rig.baseline == pytest.approx(0.12)
    assert [note["verdict"] for note in told(COURIER)["notes"]] == ["approximated", "approximated", "left out"]
    assert len(courier.warnings) == 3


def test_it_stands_level_and_odometry_follows_it(made, courier):
    with Simulation(made.world(), courier, Pose2(0.0, 0.0, 0.0)) as simulation:
        T = simulation.T_world_base()
        assert abs(T[2, 3]) < 1e-3
        assert math.degrees(math.acos(min(T[2, 2], 1.0))) < 0.2
        leg = drive_to(simulation, Pose2(0.6, 0.3, 2.0))
        odometry, true = simulation.odometry.pose, simulation.true_pose()
    assert leg.blocked is None
    assert true.distance(odometry) < 0.003
    assert abs(true.yaw - odometry.yaw) < math.radians(0.1)


def test_its_file_is_what_xacro_makes(tmp_path, courier):
    pytest.importorskip("xacro", reason="pip install flysim-testbed[xacro]")
    expanded = read_robot(COURIER.with_name("robot.urdf.xacro"))
    assert expanded.links[0].name == "base_footprint"
    assert (expanded.joints, expanded.warnings) == (courier.joints, courier.warnings)
    assert [link.inertial for link in expanded.links] == [link.inertial for link in courier.links]
    assert np.array_equal(expanded.T_base_left, courier.T_base_left)
