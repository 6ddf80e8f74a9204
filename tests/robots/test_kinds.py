"""Robots as other people write them: the rover, said otherwise, is the same robot."""

import math

import numpy as np
import pytest
from robot_text import BLIND, CUBE, LEFT, NAMED, PLUGIN, URDF, cameras, inside, turned

from flysim.common.catalogue import find_robot
from flysim.errors import RobotError
from flysim.geometry.frames import Pose2, inverse, pose6
from flysim.robots import mounted
from flysim.robots.robot import parts_in_base, read_robot
from flysim.sim.simulation import Simulation
from flysim.worlds.shapes import Cylinder, Mesh

ROVER = read_robot(find_robot("rover"))


def robot_of(tmp_path, text, **more):
    path = tmp_path / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    return read_robot(path, **more)


def below(text, root, xyz, rpy="0 0 0"):
    """The robot on a new root link, its base_link at a place in that."""
    return inside(
        text,
        f'<link name="{root}"/><joint name="{root}_joint" type="fixed"><parent link="{root}"/>'
        f'<child link="base_link"/><origin xyz="{xyz}" rpy="{rpy}"/></joint>',
    )


def same(robot):
    """That a robot is the rover in all that an engine or a path asks."""
    assert robot.track == pytest.approx(0.3, abs=1e-12)
    assert robot.radius == pytest.approx(ROVER.radius, abs=1e-9)
    assert robot.height == pytest.approx(ROVER.height, abs=1e-9)
    np.testing.assert_allclose(robot.T_base_left, ROVER.T_base_left, atol=1e-12)
    np.testing.assert_allclose(robot.rig.T_right_left, ROVER.rig.T_right_left, atol=1e-12)


def driven(made, robot):
    """`[n, 3]` where it is on the same commands."""
    with Simulation(made.world(), robot, Pose2(0.2, -0.1, 0.4)) as simulation:
        poses = []
        for k in range(40):
            simulation.advance(0.3, 0.5 - k / 40.0, 4)
            true = simulation.true_pose()
            poses.append((true.x, true.y, true.yaw))
    return np.array(poses)


@pytest.mark.parametrize("root", ["base_footprint", "chassis_frame", "odom"])
@pytest.mark.parametrize(("xyz", "rpy"), [("0 0 0", "0 0 0"), ("0.1 -0.2 0.3", "0 0 0"), ("1 2 0", "0 0 0.9")])
def test_a_root_above_base_link_changes_nothing(tmp_path, root, xyz, rpy):
    robot = robot_of(tmp_path, below(URDF, root, xyz, rpy))
    same(robot)
    assert robot.warnings == ()
    assert (robot.body, len(robot.joints)) == ("base_link", 8)
    turned = next(joint for joint in robot.joints if joint.name == f"{root}_joint")
    assert (turned.parent, turned.child) == ("base_link", root)


def test_it_drives_as_the_rover_does_whatever_its_root_is(made, tmp_path):
    right = driven(made, ROVER)
    for text in (
        below(URDF, "base_footprint", "0 0 0.1"),
        below(
            below(URDF, "a", "0.1 0.2 0").replace('<parent link="a"/>', '<parent link="mid"/>'), "b", "0 0 0", "0 0 0.5"
        )
        .replace('<parent link="b"/><child link="base_link"/>', '<parent link="b"/><child link="mid"/>')
        .replace('<link name="b"/>', '<link name="b"/><link name="mid"/>')
        .replace('<link name="a"/>', ""),
    ):
        robot = robot_of(tmp_path, text)
        np.testing.assert_allclose(driven(made, robot), right, atol=2e-4)


def test_base_link_in_the_middle_of_the_body_and_behind_the_axle(made, tmp_path):
    # Everything that hangs on base_link hangs 5 cm lower and 10 cm further on: base_link is at axle height, behind it.
    text = URDF
    for xyz in ("0 0.15 0.05", "0 -0.15 0.05", "-0.13 0 0.025", "-0.06 0 0.305", "-0.06 0 0.50", "-0.02 0 0.07"):
        x, y, z = map(float, xyz.split())
        text = text.replace(f'xyz="{xyz}"', f'xyz="{x + 0.1!r} {y!r} {z - 0.05!r}"')
    text = text.replace('xyz="-0.02 0 0.09"', f'xyz="0.08 0 {0.09 - 0.05!r}"')
    robot = robot_of(tmp_path, text)
    same(robot)
    np.testing.assert_allclose(robot.T_base_links["base_link"][:3, 3], (-0.1, 0.0, 0.05), atol=1e-12)
    np.testing.assert_allclose(driven(made, robot), driven(made, ROVER), atol=2e-4)
    with Simulation(made.world(), robot, Pose2(0.3, 0.1, 2.0)) as simulation:
        T_base = inverse(simulation.T_world_base()) @ simulation.T_world_robot_link("base_link")
    np.testing.assert_allclose(T_base, pose6(-0.1, 0, 0.05, 0, 0, 0), atol=1e-9)


def test_a_base_link_that_looks_aside_is_told(tmp_path):
    robot = robot_of(tmp_path, turned(0.5))
    assert robot.warnings == ("Robot: forward is across the axle, not along base_link's x axis: 29 degrees from it.",)
    assert math.atan2(*robot.T_base_links["base_link"][:2, 0][::-1]) == pytest.approx(-0.5)


@pytest.mark.parametrize(
    "tags", [("left_joint", "right_joint"), ("leftJoint", "rightJoint"), ("left_wheel_joint", "right_wheel_joint")]
)
def test_the_plugin_names_the_wheels(tmp_path, tags):
    left, right = tags
    if left == "left_wheel_joint":  # no tag of a plugin: by --wheels alone
        with pytest.raises(RobotError, match=r"no driven wheels: .* its continuous joints: 'a', 'b'\."):
            robot_of(tmp_path, NAMED)
        robot = robot_of(tmp_path, NAMED, wheels=("a", "b"))
    else:
        robot = robot_of(tmp_path, inside(NAMED, PLUGIN.format(l=left, r=right)))
    assert [wheel.joint for wheel in robot.wheels] == ["a", "b"]
    same(robot)


def test_ros2_control_and_transmissions_name_the_wheels_by_where_they_are(tmp_path):
    control = '<joint name="{}"><command_interface name="velocity"/></joint>'
    arm = '<joint name="caster_joint"><command_interface name="position"/></joint>'
    for more in (
        f'<ros2_control name="x" type="system">{control.format("b")}{control.format("a")}{arm}</ros2_control>',
        '<transmission name="1"><joint name="b"><hardwareInterface>hardware_interface/VelocityJointInterface'
        '</hardwareInterface></joint></transmission><transmission name="2"><joint name="a"/></transmission>',
    ):
        robot = robot_of(tmp_path, inside(NAMED, more))
        assert [(wheel.joint, wheel.left) for wheel in robot.wheels] == [("a", True), ("b", False)]
        same(robot)


def test_wheels_that_are_not_there_are_refused_with_those_that_are(tmp_path):
    for more, said in (
        (
            PLUGIN.format(l="left_joint", r="right_joint").replace(">a<", ">c<"),
            "no continuous joint 'c', which the diff",
        ),
        ("", "no driven wheels: no diff_drive plugin"),
    ):
        with pytest.raises(RobotError, match=said) as caught:
            robot_of(tmp_path, inside(NAMED, more))
        assert "by --wheels LEFT RIGHT; its continuous joints: 'a', 'b'." in str(caught.value)
    with pytest.raises(RobotError, match="are one joint, 'a': name two"):
        robot_of(tmp_path, NAMED, wheels=("a", "a"))


@pytest.mark.parametrize("sides", ["ab", "a", "b"])
def test_an_axis_that_points_right_turns_the_other_way_round(made, tmp_path, sides):
    text = NAMED
    for name in sides:
        start = text.index(f'<joint name="{name}"')
        end = text.index("</joint>", start)
        text = text[:start] + text[start:end].replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 -1"/>') + text[end:]
    robot = robot_of(tmp_path, text, wheels=("a", "b"))
    joints = ", ".join(f"joint '{name}'" for name in sides)
    assert robot.warnings == (f"Robot: wheels whose axis points right are turned the other way round: {joints}.",)
    np.testing.assert_allclose(driven(made, robot), driven(made, ROVER), atol=1e-5)


def test_more_than_two_driven_wheels_are_refused_as_a_skid_steer(tmp_path):
    plugin = PLUGIN.format(l="left_joint", r="right_joint").replace("</plugin>", "<left_joint>c</left_joint></plugin>")
    with pytest.raises(RobotError, match="it is a skid steer"):
        robot_of(tmp_path, inside(NAMED, plugin))


def test_sensors_without_mass_weigh_nothing_at_any_depth(made, tmp_path):
    link = (
        '<joint name="{0}_joint" type="fixed"><parent link="{1}"/><child link="{0}"/><origin xyz="0.05 0 0.1"/></joint>'
        '<link name="{0}">{2}<collision><geometry><cylinder radius="0.03" length="0.04"/></geometry></collision></link>'
    )
    nothing = '<inertial><mass value="0"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial>'
    robot = robot_of(
        tmp_path, inside(URDF, link.format("plate", "base_link", "") + link.format("lidar", "plate", nothing))
    )
    assert robot.warnings == ("Robot: without a mass, they weigh nothing: link 'plate', link 'lidar'.",)
    np.testing.assert_allclose(driven(made, robot), driven(made, ROVER), atol=1e-4)
    point = nothing.replace('value="0"', 'value="0.1"')
    robot = robot_of(tmp_path, inside(URDF, link.format("lidar", "base_link", point)))
    assert robot.warnings == ("Robot: an inertia that no body has is taken for a ball's: link 'lidar'.",)


def test_meshes_are_read_from_the_robots_package_and_no_farther(tmp_path):
    package = tmp_path / "rover_description"
    for folder in ("urdf", "meshes"):
        (package / folder).mkdir(parents=True)
    (package / "package.xml").write_text("<package/>")
    (package / "meshes" / "cube.obj").write_text(CUBE)
    (tmp_path / "outside.obj").write_text(CUBE)
    (package / "meshes" / "link.obj").symlink_to(tmp_path / "outside.obj")
    shape = '<box size="0.28 0.22 0.08"/>'
    for uri, read in (
        ("package://rover_description/meshes/cube.obj", True),
        ("package://another_name/meshes/cube.obj", True),
        ("model://rover_description/meshes/cube.obj", True),
        ("../meshes/cube.obj", True),
        (f"file://{package}/meshes/cube.obj", True),
        ("../../outside.obj", False),
        (f"file://{tmp_path}/outside.obj", False),
        ("package://rover_description/../outside.obj", False),
        ("package://rover_description/meshes/link.obj", False),
        ("http://example.org/cube.obj", False),
        ("package://rover_description/meshes/none.stl", False),
    ):
        text = URDF.replace(shape, f'<mesh filename="{uri}" scale="0.14 0.11 0.04"/>')
        robot = robot_of(package / "urdf", text)
        meshes = [part.shape for part in parts_in_base(robot) if isinstance(part.shape, Mesh)]
        assert len(meshes) == read, uri
        hulls = [solid.shape for link in robot.links for solid in link.collisions if isinstance(solid.shape, Mesh)]
        assert len(hulls) == read, uri
        if read:
            assert robot.radius == pytest.approx(ROVER.radius, abs=1e-9)
            assert robot.warnings == ("Robot: meshes collide as their convex hulls: collision 0 of link 'base_link'.",)
        else:
            assert "meshes that cannot be read are left out: visual 0 of link 'base_link'" in robot.warnings[0]
            assert uri[:60] in robot.warnings[0]


def test_a_robot_of_meshes_drives_as_one_of_boxes(made, tmp_path):
    (tmp_path / "cube.obj").write_text(CUBE)
    text = URDF.replace('<box size="0.28 0.22 0.08"/>', '<mesh filename="cube.obj" scale="0.14 0.11 0.04"/>')
    np.testing.assert_allclose(driven(made, robot_of(tmp_path, text)), driven(made, ROVER), atol=1e-5)


def test_a_wheel_that_is_a_mesh_rolls_on_a_cylinder(made, tmp_path):
    turns = np.linspace(0.0, math.tau, 48, endpoint=False)
    ring = [(0.05 * math.cos(a), 0.05 * math.sin(a)) for a in turns]
    lines = [f"v {x!r} {y!r} {z}" for z in (-0.002, 0.002) for x, y in ring]
    lines += [f"f {i + 1} {(i + 1) % 48 + 1} {(i + 1) % 48 + 49} {i + 49}" for i in range(48)]
    (tmp_path / "wheel.obj").write_text("\n".join(lines) + "\n")
    text = URDF.replace('<cylinder radius="0.05" length="0.004"/>', '<mesh filename="wheel.obj"/>')
    robot = robot_of(tmp_path, text)
    wheels = [link.collisions for link in robot.links if link.name.endswith("_wheel")]
    for (solid,) in wheels:
        assert isinstance(solid.shape, Cylinder)
        assert solid.shape.radius == pytest.approx(0.05)
        assert solid.shape.length == pytest.approx(0.004)
    np.testing.assert_allclose(driven(made, robot), driven(made, ROVER), atol=1e-5)
    lost = robot_of(tmp_path, text.replace("wheel.obj", "none.obj"))  # its visual is a cylinder
    assert lost.wheel_radius == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("left", "right"), [("front_left_camera", "front_right_camera"), ("stereo/LEFT", "stereo/RIGHT"), ("one", "two")]
)
def test_a_pair_by_any_names_or_by_where_it_is(tmp_path, left, right):
    same(robot_of(tmp_path, cameras(left, right)))
    swapped = robot_of(tmp_path, cameras(right, left))
    same(swapped)
    told = "Robot: eyes are called left and right by where they are, not by their names: "
    assert [told in warning for warning in swapped.warnings] == ([] if left == "one" else [True])


def test_a_multicamera_is_a_pair(tmp_path):
    start, end = URDF.index('<gazebo reference="camera_left">'), URDF.index("</robot>")
    one = URDF[URDF.index('<camera name="left">', start) : URDF.index("</camera>", start)]
    other = one.replace('"left"', '"right"') + "<pose>0 -0.12 0 0 0 0</pose>"
    both = f'<gazebo reference="camera_left"><sensor name="eyes" type="multicamera">{one}</camera>{other}</camera>'
    same(robot_of(tmp_path, URDF[:start] + both + "</sensor></gazebo>" + URDF[end:]))
    hack = f"{one}</camera>{one.replace('left', 'right')}</camera><plugin name='p'><hackBaseline>0.12</hackBaseline>"
    both = f'<gazebo reference="camera_left"><sensor name="eyes" type="multicamera">{hack}</plugin></sensor></gazebo>'
    same(robot_of(tmp_path, URDF[:start] + both + URDF[end:]))


def test_one_eye_is_one_eye(made, tmp_path):
    start = URDF.index('<gazebo reference="camera_right">')
    for kind in ("camera", "depth", "rgbd_camera"):
        text = (URDF[:start] + "</robot>").replace(LEFT, f'<sensor name="realsense" type="{kind}">')
        robot = robot_of(tmp_path, text)
        assert (robot.pair, len(robot.cameras)) == (None, 1)
        np.testing.assert_allclose(robot.T_base_left, ROVER.T_base_left, atol=1e-12)
        assert len(robot.warnings) == (kind != "camera")
    with pytest.raises(RobotError, match="has one camera, and no pair at any one place: give it a scenario with pairs"):
        _ = robot.rig
    assert driven(made, robot).shape == (40, 3)


def test_a_robot_without_cameras_is_refused_or_given_the_rovers_pair(tmp_path):
    with pytest.raises(RobotError, match="no camera sensor: --cameras stereo mounts a pair"):
        robot_of(tmp_path, BLIND)
    robot = robot_of(tmp_path, BLIND, cameras="stereo")
    (told,) = robot.warnings
    front = 0.12  # the chassis ends there
    assert told.startswith(
        "Robot: the rover's pair of cameras is mounted: 640x480 px and 65 degrees each, 0.12 m apart"
    )
    assert f"{front} m before the axle, 0.551 m high" in told
    rig, own = robot.rig, ROVER.rig
    assert (rig.left, rig.baseline) == (own.left, pytest.approx(own.baseline))
    np.testing.assert_allclose(robot.T_base_left[:3, 3], (front, mounted.BASELINE / 2.0, 0.551), atol=1e-3)
    np.testing.assert_allclose(robot.T_base_left[:3, :3], ROVER.T_base_left[:3, :3], atol=1e-12)


def test_what_readers_of_urdf_forgive_is_forgiven(tmp_path):
    text = URDF.replace("<robot", "<!-- wheels -- and more --->\n<robot", 1)
    same(robot_of(tmp_path, inside(text, '<gazebo><gz:more gz:on="1"/></gazebo>')))


def test_of_two_pairs_the_one_that_looks_ahead_counts(tmp_path):
    sensors = URDF[URDF.index('<gazebo reference="camera_left">') : URDF.index("</robot>")]
    rear = sensors
    for side in ("left", "right"):
        rear = rear.replace(f'reference="camera_{side}"', f'reference="rear_{side}"')
        rear = rear.replace(f'<sensor name="{side}"', f'<sensor name="rear_{side}"')
        sensors = sensors.replace(f'<sensor name="{side}"', f'<sensor name="front_{side}"')
    for side, y in (("left", -0.06), ("right", 0.06)):
        rear += f'<link name="rear_{side}"/><joint name="r{side}" type="fixed"><parent link="base_link"/>'
        rear += f'<child link="rear_{side}"/><origin xyz="-0.1 {y} 0.4" rpy="0 0 3.14159265"/></joint>'
    robot = robot_of(tmp_path, inside(inside(BLIND, rear), sensors))
    same(robot)
    assert "rear_left" in robot.warnings[0]
