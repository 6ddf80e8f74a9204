import math
import re
from xml.etree.ElementTree import parse

import numpy as np
import pytest

from flysim.common.catalogue import find_robot
from flysim.geometry.camera import Camera
from flysim.geometry.frames import R_BODY_OPTICAL, Pose2, pose6, se3
from flysim.render.tiny import TinyRenderer
from flysim.robots.robot import read_robot
from flysim.sim import simulation as room
from flysim.sim.bullet import pybullet as p
from flysim.sim.simulation import Simulation
from flysim.sim.urdf_write import number_of, write_urdf

# A robot with what a URDF may say beside what the shipped ones do.
EDITS = (
    ('"caster_joint" type="fixed">', '"caster_joint" type="revolute"><axis xyz="0 0.6 0.8"/><limit lower="-0.5"'),
    ("<limit lower", '<dynamics damping="0.1" friction="0.2"/><limit upper="0.7" effort="3" velocity="2" lower'),
    ('lower="-0.5"', 'lower="-0.5"/>'),
    ('"mast_joint" type="fixed">', '"mast_joint" type="prismatic"><axis xyz="0 0 1"/><limit upper="0.1"'),
    ('<limit upper="0.1"', '<limit upper="0.1" effort="30" velocity="1"/>'),
    ('ixy="0" ixz="0" iyy="0.01526"', 'ixy="0.0003" ixz="-0.0007" iyy="0.01526"'),
    ('<link name="left_wheel">', '<link name="left_wheel"><contact><rolling_friction value="0.002"/></contact>'),
    ('<material name="steel"/></visual>', '<material name="red"><color rgba="0.9 0.1 0.1 1"/></material></visual>'),
    ('rpy="0 0.2 0"', 'rpy="0.01 0.2 -0.02"'),
)


def edited(text):
    for old, new in EDITS:
        assert old in text
        text = text.replace(old, new, 1)
    return text


def seen(simulation):
    """All that pybullet tells of a robot, how it drives, and what it looks like, names left out."""
    client, body = simulation.client, simulation.body
    count = p.getNumJoints(body, physicsClientId=client)
    joints = [p.getJointInfo(body, j, physicsClientId=client) for j in range(count)]
    facts = [joint[0:1] + joint[2:12] + joint[13:] for joint in joints]
    facts += [p.getDynamicsInfo(body, j, physicsClientId=client) for j in range(-1, count)]
    facts += [p.getCollisionShapeData(body, j, physicsClientId=client) for j in range(-1, count)]
    facts += [shape[1:4] + shape[5:8] for shape in p.getVisualShapeData(body, physicsClientId=client)]
    view = TinyRenderer(simulation).view(
        Camera.from_fov(160, 120, 1.2),
        simulation.T_world_base() @ pose6(0.6, 0.2, 0.4, 0, 0.5, math.pi + 0.3) @ se3(R_BODY_OPTICAL, (0, 0, 0)),
    )
    poses = []
    for k in range(60):
        simulation.step(0.3 * math.sin(k / 10.0) + 0.1, 0.5 * math.cos(k / 20.0))
        poses.append(simulation.T_world_base())
    poses += [simulation.T_world_robot_link(name) for name in simulation.robot.T_base_links]
    return facts, np.array(poses), view.rgb


@pytest.mark.parametrize("name", ["rover", "barn_rover", "edited"])
def test_bullet_is_told_to_the_last_bit_what_the_file_says(made, tmp_path, monkeypatch, name):
    path = tmp_path / "robot.urdf"
    text = find_robot("rover" if name == "edited" else name).read_text(encoding="utf-8")
    path.write_text(edited(text) if name == "edited" else text, encoding="utf-8")
    robot = read_robot(path)
    with Simulation(made.world(), robot, Pose2(0.3, 0.1, 0.2), textured=True) as simulation:
        facts, poses, picture = seen(simulation)
    # The same by the file itself, which is ours here and harmless.
    joints = {joint.name: i for i, joint in enumerate(robot.joints)}
    monkeypatch.setattr(room, "write_urdf", lambda _links, _joints, place, **_: place.write_bytes(path.read_bytes()))
    monkeypatch.setattr(room, "number_of", lambda name: joints[name.decode()])
    with Simulation(made.world(), robot, Pose2(0.3, 0.1, 0.2), textured=True) as simulation:
        theirs = seen(simulation)
    assert facts == theirs[0]
    np.testing.assert_array_equal(poses, theirs[1])
    np.testing.assert_array_equal(picture, theirs[2])
    assert np.ptp(picture) > 50


def test_no_text_of_the_file_is_written(tmp_path):
    text = edited(find_robot("rover").read_text(encoding="utf-8"))
    for name in ("caster", "mast", "camera_bar", "red", "tyre"):
        text = text.replace(f'"{name}', f'"%n%s {name} &lt;&quot;&amp;é')
    text = text.replace('name="rover"', 'name="%n%n"').replace(
        '"0.025"', '" \N{ARABIC-INDIC DIGIT ZERO}.025 "'
    )  # a digit of another script
    path, own = tmp_path / "robot.urdf", tmp_path / "own.urdf"
    path.write_text(text, encoding="utf-8")
    robot = read_robot(path)
    write_urdf(robot.links, robot.joints, own)
    words = {word for element in parse(own).iter() for value in element.attrib.values() for word in value.split()}
    names = re.compile(r"(link|joint|material)_\d+(_\d+)?|robot|fixed|continuous|revolute|prismatic")
    assert [word for word in sorted(words) if not names.fullmatch(word) and not math.isfinite(float(word))] == []
    assert own.read_bytes().isascii()


def test_a_robot_of_odd_names_drives_and_its_links_are_found_by_them(made, tmp_path, capfd):
    odd = "%n%s {camera} [red]"
    text = find_robot("rover").read_text(encoding="utf-8").replace('"camera_left"', f'"{odd}"')
    text = text.replace('"caster"', '"world"').replace('"caster_joint"', '"%n%n%n%s%s%s"')
    path = tmp_path / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    robot = read_robot(path)
    assert robot.friction == {"world": 0.0}
    with Simulation(made.world(), robot, Pose2(0.5, 0.2, 1.5)) as simulation:
        link = simulation.link_index["world"]
        assert p.getDynamicsInfo(simulation.body, link, physicsClientId=simulation.client)[1] == 0.0
        eye = simulation.T_world_robot_link(odd)
        assert eye[:3, 3] == pytest.approx((simulation.T_world_base() @ robot.T_base_left)[:3, 3], abs=1e-5)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("moments", [(2e-4, 1e-4, 1e-4), (1e-4, 1e-4, 2e-4 * (1 + 5e-7)), (1e-3, 1e-3, 1e-12)])
def test_an_inertia_at_the_edge_of_what_is_possible_is_not_lost(made, tmp_path, capfd, moments):
    old = re.search(r'<mass value="0.12"/><inertia [^>]*>', find_robot("rover").read_text(encoding="utf-8"))
    assert old is not None
    c, s = math.cos(0.4), math.sin(0.4)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    for turn in (np.eye(3), R):
        I = turn @ np.diag(moments) @ turn.T  # noqa: E741
        entries = " ".join(f'i{"xyz"[i]}{"xyz"[j]}="{float(I[i, j])!r}"' for i in range(3) for j in range(i, 3))
        path = tmp_path / "robot.urdf"
        text = find_robot("rover").read_text(encoding="utf-8")
        path.write_text(text.replace(old.group(), f'<mass value="0.12"/><inertia {entries}/>'), encoding="utf-8")
        with Simulation(made.world(), read_robot(path), Pose2(0.0, 0.0, 0.0)) as simulation:
            link = simulation.link_index["mast"]
            got = p.getDynamicsInfo(simulation.body, link, physicsClientId=simulation.client)[2]
        assert sorted(got) == pytest.approx(sorted(moments), abs=2e-5 * max(moments))
        assert capfd.readouterr() == ("", "")  # Bullet says "setting inertia to zero"


def test_numbers_of_names():
    assert [number_of(name) for name in (b"joint_0", b"link_12")] == [0, 12]
