import re

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flysim.common.catalogue import find_robot
from flysim.errors import RobotError
from flysim.geometry.frames import Pose2
from flysim.robots.robot import read_robot
from flysim.robots.urdf import MAX_BYTES
from flysim.sim.simulation import Simulation

URDF = find_robot("rover").read_text(encoding="utf-8")


def refusal(path):
    with pytest.raises(RobotError) as caught:
        read_robot(path)
    message = str(caught.value)
    assert message.isprintable(), message  # one line, no escapes
    assert len(message) < 225 + len(str(path))
    assert str(path) in message
    return message


def written(tmp_path, text):
    path = tmp_path / "robot.urdf"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def without(start, end, text=URDF):
    i = text.index(start)
    return text[:i] + text[text.index(end, i) + len(end) :]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('xyz="0.005 -0.06 0"', 'xyz="0.005 0.06 0"', "its stereo pair: the baseline must be > 0 m"),
        ('<link name="base_link">', '<link name="chassis">', "joint 'left_wheel_joint' joins 'base_link', which is no"),
        ('name="left_wheel_joint" type="continuous"', 'name="left_wheel_joint" type="fixed"', "no continuous joint"),
        ('name="right_wheel_joint"', 'name="wheel"', "no continuous joint 'right_wheel_joint'"),
        ('<sensor name="right"', '<sensor name="left"', "two camera sensors are named 'left'"),
        ('<sensor name="left" type="camera">', '<sensor type="camera">', "<sensor> has no name="),
        ('reference="camera_left"', 'reference="camera_lefd"', "link 'camera_lefd', which there is none of"),
        ('xyz="0 0.15 0.05"', 'xyz="0 nan 0.05"', "the origin of joint 'left_wheel_joint', xyz, must be 3 finite"),
        ('xyz="0 0.15 0.05"', 'xyz="0 1e999 0.05"', "must be 3 finite numbers, got '0 1e999 0.05'"),
        ('xyz="0 0.15 0.05"', 'xyz="0 1_0 0.05"', "must be 3 finite numbers"),
        (
            'xyz="0 0.15 0.05"',
            'xyz="0.02 0.15 0.05"',
            "must turn about the line between the wheels, the robot's y axis",
        ),
        ('xyz="0 0.15 0.05"', 'xyz="0 0.15 0.06"', "the driven wheels must be equally high, their centres are at"),
        (
            'xyz="0 0.15 0.05"',
            'xyz="0 -0.35 0.05"',
            "got [0.05, 0.05] m and -0.2 m: the left wheel stands to the right",
        ),
        ('xyz="0 0.15 0.05"', 'xyz="0 -0.15 0.05"', "one radius and a positive track, got [0.05, 0.05] m and 0 m"),
        ('<axis xyz="0 0 1"/>', '<axis xyz="0 0 0"/>', "the axis of joint 'left_wheel_joint' must have a length, got"),
        (
            '<axis xyz="0 0 1"/>',
            "<axis/>",
            "the axis of joint 'left_wheel_joint' must be 3 finite numbers, got nothing",
        ),
        ('<axis xyz="0 0 1"/>', "", "wheel 'left_wheel' is not round about its axle: turn its collision, or the axis"),
        (
            '<cylinder radius="0.05" length="0.004"/>',
            '<box size="1 1 1"/>',
            "must be round: one collision, a cylinder or",
        ),
        ('<cylinder radius="0.05" length="0.004"/>', '<cylinder radius="0.06" length="0.004"/>', "one radius"),
        (
            '<sphere radius="0.025"/>',
            '<cone radius="1"/>',
            "visual 0 of link 'caster' must be a box, a cylinder, a sphere",
        ),
        ('<sphere radius="0.025"/>', "<mesh/>", "<mesh> has no filename=: add it"),
        ('<sphere radius="0.025"/>', '<mesh filename="a" scale="1 0 1"/>', "the scale of a mesh must not be 0, got"),
        (
            '<sphere radius="0.025"/>',
            '<sphere radius="-1"/>',
            "visual 0 of link 'caster': a sphere's radius must be > 0",
        ),
        ('<sphere radius="0.025"/>', "<sphere/>", "its radius, must be a finite number, got nothing"),
        (
            '<parent link="base_link"/>',
            '<parent link="chassis"/>',
            "joint 'left_wheel_joint' joins 'chassis', which is no link",
        ),
        ('<child link="mast"/>', '<child link="caster"/>', "link 'caster' has two parents"),
        (
            '"mast_joint" type="fixed">\n    <parent link="base_link"/><child link="mast"/>',
            f'"{"j" * 190}" type="fixed"><parent link="{"p" * 190}"/><child link="{"c" * 190}"/>',
            "pppp...', which is no link: correct the name.",
        ),
        ('<mass value="2.16"/>', '<mass value="0"/>', "mass of link 'base_link' must be > 0 kg, got 0"),
        ('<mass value="2.16"/>', '<mass value="NaN"/>', "mass of link 'base_link' must be a finite number, got 'NaN'"),
        ('ixx="0.00986"', 'ixx="0.9"', "inertia of link 'base_link': moments must be > 0, each at most the sum of the"),
        ('ixx="0.00986"', 'ixx="-1"', "inertia of link 'base_link': moments must be > 0"),
        ('ixx="0.00986" ', "", "ixx of link 'base_link' must be a finite number, got nothing"),
        ("<width>640</width>", "<width>0</width>", "camera 'left' has 0x480 px; whole numbers from 1 to"),
        ("<width>640</width>", "<width>640.5</width>", "camera 'left' has 640.5x480 px"),
        ("<width>640</width>", "<width>1e5</width>", "camera 'left' has 100000x480 px"),
        ("<width>640</width>", "", "camera 'left', its width, must be a finite number, got nothing"),
        ("<horizontal_fov>1.1344640137963142", "<horizontal_fov>3.2", "camera 'left': horizontal_fov must be in"),
        ('<gazebo reference="caster"><mu1>0', '<gazebo reference="castor"><mu1>0', "friction to 'castor', which is no"),
        (
            '<gazebo reference="caster"><mu1>0',
            '<gazebo reference="caster"><mu1>-1',
            "mu1 of link 'caster' must be >= 0",
        ),
        ('rgba="0.18 0.22 0.28 1"', 'rgba="1.8 0.22 0.28 1"', "the rgba of material 'body' must be in [0, 1]"),
        ('<link name="mast">', '<link name="caster">', "two links are named 'caster'"),
        ('name="mast_joint"', 'name="caster_joint"', "two joints are named 'caster_joint'"),
        ('<link name="mast">', '<link name="ma&#10;st">', "name='ma?st': it must be printable, not blank"),
        ('<link name="mast">', '<link name="">', "<link> has name='': it must be printable, not blank"),
        ('<link name="mast">', '<link name=" ">', "<link> has name=' ': it must be printable, not blank"),
        ('<link name="mast">', f'<link name="{"m" * 201}">', "and have at most 200 characters"),
        ('name="caster_joint"', 'name=""', "<joint> has name='': it must be printable, not blank"),
        ('name="caster_joint"', "", "<joint> has no name=: add it"),
        ('"caster_joint" type="fixed"', '"caster_joint"', "joint 'caster_joint' has no type=: add it"),
        ('"caster_joint" type="fixed"', '"caster_joint" type=""', "<joint> has type='': it must be printable, not"),
        (
            '"caster_joint" type="fixed"',
            '"caster_joint" type="%n%s"',
            "joint 'caster_joint' has type='%n%s'; simulated",
        ),
        ('"caster_joint" type="fixed"', '"caster_joint" type="floating"', "has type='floating'; simulated are fixed,"),
        ('<child link="caster"/>', "", "joint 'caster_joint' has no <child link=...>: add it"),
        ('<child link="caster"/>', "<child/>", "<child> has no link=: add it"),
        ('<robot name="rover">', '<robot name="ro&#10;ver">', "<robot> has name='ro?ver': it must be printable"),
        ('<link name="mast">', "<link>", "<link> has no name=: add it"),
        ("</robot>", '<link name="lost"/></robot>', "link 'lost' is not joined to base_link. Add a joint"),
        ('<robot name="rover">', '<robot name="rover"><!-- \x00 -->', "not a readable URDF"),
        ("<robot ", "<sdf ", "not a readable URDF: mismatched tag"),
    ],
)
def test_says_in_one_line_what_is_wrong(tmp_path, old, new, said):
    assert old in URDF
    assert said in refusal(written(tmp_path, URDF.replace(old, new, 1)))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "not a readable URDF: no element found"),
        (b"\x00\xff\xfe junk", "not a readable URDF"),
        ("<sdf/>", "the root element is <sdf>; a URDF has <robot>"),
        ("<robot/>", "no <link>: a robot has at least a body and two wheels"),
        ('<robot><link name="a"/></robot>', "no driven wheels: no diff_drive plugin, ros2_control or joint"),
        ('<?xml version="1.0" encoding="martian"?><robot/>', "not a readable URDF"),
        ("<robot>" + "<a>" * 100 + "</a>" * 100 + "</robot>", "nested deeper than 64"),
        ("<robot>" + "".join(f'<link name="l{i}"/>' for i in range(200)) + "</robot>", "at most 100 are simulated"),
        (URDF + " " * MAX_BYTES, "at most that much is read"),
        (
            '<!DOCTYPE r [<!ENTITY a "x"><!ENTITY b "&a;&a;&a;">]>' + URDF.removeprefix('<?xml version="1.0"?>'),
            "declares a DTD or entities, which are not read: remove the <!DOCTYPE",
        ),
        ("<!DOCTYPE robot><robot/>", "declares a DTD or entities"),
        ('<!DOCTYPE r [<!ENTITY f SYSTEM "file:///etc/passwd">]><robot name="&f;"/>', "declares a DTD or entities"),
    ],
)
def test_what_is_no_urdf(tmp_path, text, said):
    assert said in refusal(written(tmp_path, text))


AXIS = '<axis xyz="0 1 0"/>'
LIMIT = '<limit lower="-1" upper="1" effort="2" velocity="3"/>'


@pytest.mark.parametrize(
    ("kind", "inside", "said"),
    [
        ("fixed", '<axis xyz="nan 0 x"/>', "the axis of joint 'caster_joint' must be 3 finite numbers, got 'nan 0 x'"),
        ("continuous", '<axis xyz="%n%n 0 0"/>', "the axis of joint 'caster_joint' must be 3 finite numbers"),
        ("continuous", '<axis xyz="0 0 0"/>', "the axis of joint 'caster_joint' must have a length, got '0 0 0'"),
        ("continuous", '<axis xyz="0 1e-320 0"/>', "the axis of joint 'caster_joint' must have a length"),
        ("revolute", AXIS, "joint 'caster_joint' is revolute and has no <limit>: add it, with effort= and velocity="),
        ("prismatic", AXIS, "joint 'caster_joint' is prismatic and has no <limit>"),
        ("revolute", LIMIT.replace("-1", "low"), "the lower limit of joint 'caster_joint' must be a finite number"),
        ("revolute", LIMIT.replace("-1", "nan"), "the lower limit of joint 'caster_joint' must be a finite number"),
        ("revolute", LIMIT.replace("-1", "1.5"), "must be at most the upper one, got 1.5 and 1"),
        ("revolute", LIMIT.replace('"2"', '"-2"'), "the effort limit of joint 'caster_joint' must be >= 0, got -2"),
        ("prismatic", LIMIT.replace('"3"', '"-3"'), "the velocity limit of joint 'caster_joint' must be >= 0, got -3"),
        ("prismatic", LIMIT.replace(' effort="2"', ""), "the effort limit of joint 'caster_joint' must be a finite"),
        ("continuous", '<limit effort="much"/>', "the effort limit of joint 'caster_joint' must be a finite number"),
        ("continuous", '<dynamics damping="-1"/>', "damping of joint 'caster_joint' must be >= 0, got -1"),
        ("continuous", '<dynamics friction="x"/>', "friction of joint 'caster_joint' must be a finite number, got 'x'"),
    ],
)
def test_joints_that_are_none(tmp_path, kind, inside, said):
    text = URDF.replace('"caster_joint" type="fixed">', f'"caster_joint" type="{kind}">{inside}')
    assert said in refusal(written(tmp_path, text))


def test_contacts_and_masses_of_shapes_that_are_none(tmp_path):
    for inside, said in (
        ('<lateral_friction value="-1"/>', "lateral_friction of link 'mast' must be >= 0, got -1"),
        ("<restitution/>", "restitution of link 'mast' must be a finite number, got nothing"),
    ):
        text = URDF.replace('<link name="mast">', f'<link name="mast"><contact>{inside}</contact>')
        assert said in refusal(written(tmp_path, text))
    crowd = '<visual><geometry><sphere radius="1"/></geometry></visual>' * 501
    text = URDF.replace('<link name="camera_left">', f'<link name="camera_left">{crowd}')
    assert "513 visuals and collisions; at most 500 are simulated" in refusal(written(tmp_path, text))


def test_a_file_that_is_not_there(tmp_path):
    message = refusal(tmp_path / "none.urdf")
    assert "No such file" in message
    assert "Give the path of a URDF" in message
    assert "Is a directory" in refusal(tmp_path)


def test_a_body_without_mass_is_refused(tmp_path):
    bare = without('<inertial><mass value="0.25"/>', "</inertial>")
    assert "link 'left_wheel' has a body and no <inertial>" in refusal(written(tmp_path, bare))
    base = without("<inertial>", "</inertial>")
    robot = read_robot(written(tmp_path, base))  # what it carries rigidly has some
    assert (robot.body, robot.warnings) == ("mast", ("Robot: without a mass, they weigh nothing: link 'base_link'.",))
    for name in ("caster", "mast", "camera_bar", "camera_left", "camera_right"):
        start = base.index(f'<link name="{name}">')
        base = base[:start] + without("<inertial>", "</inertial>", base[start:])
    assert "link 'base_link' has a body and no <inertial>" in refusal(written(tmp_path, base))


TOKENS = re.findall(r"[A-Za-z_]+|[-\d.]+|\s+|.", URDF)
JUNK = st.sampled_from(
    ["", "0", "-1", "nan", "1e308", "base_link", "<", ">", '"', "/", "&", "\x00", "\n", "&#27;", "link", "joint", "é"]
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    edits=st.lists(st.tuples(st.integers(0, len(TOKENS) - 1), JUNK), min_size=1, max_size=4),
    cut=st.none() | st.integers(0, len(URDF)),
)
def test_a_mangled_urdf_is_driven_or_refused_and_nothing_else(made, tmp_path, edits, cut):
    tokens = list(TOKENS)
    for place, junk in edits:
        tokens[place] = junk
    path = written(tmp_path, "".join(tokens)[:cut])
    try:
        robot = read_robot(path)
        with Simulation(made.world(), robot, Pose2(0.0, 0.0, 0.0)) as simulation:
            simulation.advance(0.3, 0.1, 8)
            assert np.isfinite(simulation.T_world_base()).all()
    except RobotError as error:
        assert str(error).isprintable()
        assert str(path) in str(error)
    else:
        assert robot.track > 0.0
        assert robot.rig.baseline > 0.0


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(max_size=300))
def test_any_bytes_are_refused(tmp_path, data):
    assert refusal(written(tmp_path, data))
