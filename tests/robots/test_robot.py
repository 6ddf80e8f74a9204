import math

import numpy as np
import pytest

from flysim.common.catalogue import find_robot, names
from flysim.geometry.frames import Pose2, transform
from flysim.robots.robot import parts_in_base, read_robot
from flysim.sim.bullet import pybullet as p
from flysim.sim.simulation import Simulation
from flysim.sim.urdf_write import FRAME_MASS
from flysim.worlds.shapes import Cylinder

URDF = find_robot("rover").read_text(encoding="utf-8")


def test_the_rover_comes_with_flysim():
    assert "rover" in names("robots")
    assert read_robot(find_robot("rover")).name == "rover"


def test_wheels(made):
    assert made.rover.wheel_radius == 0.05
    assert made.rover.track == pytest.approx(0.30, abs=1e-12)
    told = [(wheel.joint, wheel.left, wheel.sense) for wheel in made.rover.wheels]
    assert told == [("left_wheel_joint", True, 1.0), ("right_wheel_joint", False, 1.0)]
    assert (made.rover.body, made.rover.warnings) == ("base_link", ())


def test_the_stereo_pair_by_hand(made):
    rig = made.rover.rig
    assert rig.rectified
    assert rig.baseline == pytest.approx(0.12, abs=1e-12)
    assert np.array_equal(rig.T_right_left[:3, :3], np.eye(3))
    assert rig.T_right_left[:3, 3] == pytest.approx((-0.12, 0.0, 0.0), abs=1e-12)
    f = 320.0 / math.tan(math.radians(65.0) / 2.0)  # 502.3 px
    for camera in (rig.left, rig.right):
        assert (camera.width, camera.height) == (640, 480)
        assert np.allclose(camera.K, [[f, 0.0, 319.5], [0.0, f, 239.5], [0.0, 0.0, 1.0]], atol=1e-9)


def test_the_left_eye_by_hand(made):
    # The bar is at (-0.06, 0, 0.5), pitched 0.2 rad down; the eye is at (0.005, 0.06, 0) of it.
    c, s = math.cos(0.2), math.sin(0.2)
    T = made.rover.T_base_left
    assert T[:3, 3] == pytest.approx((-0.06 + 0.005 * c, 0.06, 0.5 - 0.005 * s), abs=1e-12)
    right, down, forward = T[:3, :3].T
    assert right == pytest.approx((0.0, -1.0, 0.0), abs=1e-12)
    assert forward == pytest.approx((c, 0.0, -s), abs=1e-12)
    assert down == pytest.approx((-s, 0.0, -c), abs=1e-12)
    assert not T.flags.writeable


def test_the_circle_and_the_height_that_hold_the_body(made):
    # The farthest corner of the chassis is (-0.16, 0.11); the camera bar, pitched, is the highest.
    assert made.rover.radius == pytest.approx(math.hypot(0.16, 0.11), abs=1e-9)
    c, s = math.cos(0.2), math.sin(0.2)
    assert made.rover.height == pytest.approx(0.5 + 0.03 * s + 0.015 * c, abs=1e-9)


def test_parts_lie_where_the_links_are(made):
    tyres = [part for part in parts_in_base(made.rover) if part.shape == Cylinder(0.05, 0.024)]
    assert sorted(round(float(part.T_link_part[1, 3]), 6) for part in tyres) == [-0.15, 0.15]
    for part in tyres:
        axle = part.T_link_part[:3, 2]  # a cylinder's axis is its z
        assert np.abs(axle) == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)
        assert transform(part.T_link_part, np.zeros(3))[2] == pytest.approx(0.05)


def test_mass_and_inertia_in_pybullet_are_physical(made):
    with made.simulation() as simulation:
        masses = []
        for link in range(-1, p.getNumJoints(simulation.body, physicsClientId=simulation.client)):
            mass, _, moments, *_ = p.getDynamicsInfo(simulation.body, link, physicsClientId=simulation.client)
            masses.append(mass)
            assert mass > 0.0
            assert min(moments) > 0.0
            assert 2.0 * max(moments) <= sum(moments) * (1.0 + 1e-6)
    assert sum(masses) == pytest.approx(3.0, abs=1e-9)


def test_it_stands_level_on_its_wheels(made):
    with made.simulation() as simulation:
        T = simulation.T_world_base()
    assert abs(T[2, 3]) < 1e-3
    assert math.degrees(math.acos(T[2, 2])) < 0.2


def test_a_frame_without_mass_adds_no_weight_and_no_words(tmp_path, made, capfd):
    bare = URDF.replace('<inertial><mass value="0.02"/>', "<!-- -->", 1)
    start = bare.index("<!-- -->")
    bare = bare[:start] + bare[bare.index("</inertial>", start) + len("</inertial>") :]
    path = tmp_path / "robot.urdf"
    path.write_text(bare, encoding="utf-8")
    robot = read_robot(path)
    assert [link.name for link in robot.links if link.inertial is None] == ["camera_left"]
    with Simulation(made.world(), robot, Pose2(0.0, 0.0, 0.0)) as simulation:
        link = simulation.link_index["camera_left"]
        mass = p.getDynamicsInfo(simulation.body, link, physicsClientId=simulation.client)[0]
        assert simulation.true_pose().distance(Pose2(0.0, 0.0, 0.0)) < 1e-3
    assert mass == FRAME_MASS  # pybullet would take 1 kg, and say so
    assert capfd.readouterr() == ("", "")


def test_gazebos_sensor_pose_and_friction_are_read(tmp_path):
    moved = URDF.replace(
        '<sensor name="left" type="camera">', '<sensor name="left" type="camera"><pose>0 0.02 0 0 0 0</pose>'
    )
    path = tmp_path / "robot.urdf"
    path.write_text(moved, encoding="utf-8")
    robot = read_robot(path)
    assert robot.rig.baseline == pytest.approx(0.14, abs=1e-12)
    assert robot.friction == {"caster": 0.0}


def test_eyes_that_squint_are_no_rectified_pair(tmp_path):
    squint = URDF.replace('<origin xyz="0.005 0.06 0"/>', '<origin xyz="0.005 0.06 0" rpy="0 0 -0.1"/>')
    path = tmp_path / "robot.urdf"
    path.write_text(squint, encoding="utf-8")
    rig = read_robot(path).rig
    assert not rig.rectified
    assert rig.baseline == pytest.approx(0.12, abs=1e-12)
