"""Every construct of docs/robots.md: the table is the code's, and one file of each kind is what the table says."""

import re
from pathlib import Path

import pytest
from robot_text import BLIND, CUBE, NAMED, PLUGIN, URDF, cameras, inside, turned

from flysim.errors import RobotError
from flysim.foreign.data import parse_toml
from flysim.robots.account import CONSTRUCTS
from flysim.robots.robot import read_with_account
from flysim.robots.told import told
from flysim.runs.scenario import make_scenario

PAGE = Path(__file__).resolve().parents[2] / "docs" / "robots.md"
JOINT = '<joint name="left_wheel_joint" type="continuous">'
WHEEL = '<cylinder radius="0.05" length="0.004"/>'
BARE = '<link name="x">{}</link><joint name="j" type="fixed"><parent link="base_link"/><child link="x"/></joint>'
BALL = "<collision><geometry><sphere radius='0.01'/></geometry></collision>"
POINT = "<inertial><mass value='0.1'/><inertia ixx='0' ixy='0' ixz='0' iyy='0' iyz='0' izz='0'/></inertial>"
IMAGE = "<camera><horizontal_fov>1</horizontal_fov><image><width>64</width><height>48</height></image>{}</camera>"
REAR = f'<gazebo reference="base_link"><sensor name="rear" type="camera">{IMAGE}</sensor></gazebo>'

SPOKES = f"<collision><geometry>{WHEEL}</geometry></collision>"
WIDE = '<visual><geometry><cylinder radius="0.05" length="0.024"/></geometry><material name="tyre"/></visual>'
NOTED = {  # a file in which nothing but this is approximated or left out
    "collision mesh": URDF.replace(
        '<collision><geometry><sphere radius="0.025"/>',
        '<collision><geometry><mesh filename="cube.obj" scale="0.025 0.025 0.025"/>',
    ),
    "wheel mesh": URDF.replace(WIDE, "").replace(SPOKES, SPOKES.replace("collision", "visual")),
    "tyre": URDF.replace(WHEEL, WHEEL.replace("0.004", "0.024"), 1),
    "capsule": URDF.replace('<sphere radius="0.025"/>', '<capsule radius="0.02" length="0.01"/>'),
    "massless": inside(URDF, BARE.format(BALL)),
    "point mass": inside(URDF, BARE.format(POINT)),
    "depth camera": inside(BLIND, REAR.replace('"camera"', '"depth"').format("")),
    "sense": URDF.replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 -1"/>', 1),
    "swapped": cameras("my_right", "my_left"),
    "behind": inside(BLIND, REAR.replace("{}", "<pose>0 0 0 0 0 3</pose>")),
    "turned base": turned(0.5),
    "low": URDF.replace('<sphere radius="0.025"/>', '<sphere radius="0.05"/>'),
    "plugin sizes": inside(
        NAMED,
        PLUGIN.format(l="left_joint", r="right_joint").replace(
            "</plugin>", "<wheel_separation>0.4</wheel_separation><wheel_diameter>0.1</wheel_diameter></plugin>"
        ),
    ),
    "mu2": URDF.replace("<mu2>0</mu2>", "<mu2>0.5</mu2>"),
    "transparency": URDF.replace('rgba="0.6 0.6 0.62 1"', 'rgba="0.6 0.6 0.62 0.5"'),
    "mounted": BLIND,
    "lost mesh": URDF.replace(
        '<visual><geometry><sphere radius="0.025"/>', '<visual><geometry><mesh filename="none.dae"/>'
    ),
    "picture": URDF.replace(
        '<material name="steel"/>', '<material name="steel"><texture filename="a.png"/></material>'
    ),
    "plugins": inside(URDF, '<gazebo><plugin name="imu" filename="libimu.so"/></gazebo>'),
    "sensors": inside(URDF, '<gazebo reference="mast"><sensor name="scan" type="ray"/></gazebo>'),
    "cameras": inside(URDF, REAR.format("")),
    "lens": URDF.replace("<clip>", "<noise><type>gaussian</type></noise><clip>"),
    "clip": URDF.replace("<near>0.05</near>", "<near>0.3</near>"),
    "joint extras": URDF.replace(JOINT, JOINT + '<mimic joint="right_wheel_joint"/>'),
    "gazebo tags": inside(URDF, '<gazebo reference="mast"><selfCollide>true</selfCollide></gazebo>'),
    "unknown": inside(URDF, "<gripper/>"),
}
REFUSED = {
    "entities": "<!DOCTYPE robot><robot/>",
    "floating": URDF.replace('"mast_joint" type="fixed"', '"mast_joint" type="planar"'),
    "no tree": URDF.replace('<child link="mast"/>', '<child link="caster"/>'),
    "mass": URDF.replace('<mass value="2.16"/>', '<mass value="0"/>'),
    "names": URDF.replace('<link name="mast">', '<link name="caster">'),
    "numbers": URDF.replace('radius="0.025"', 'radius="-1"'),
    "no wheels": NAMED,
    "skid": inside(
        NAMED, PLUGIN.format(l="left_joint", r="right_joint").replace("</p", "<left_joint>c</left_joint></p")
    ),
    "wheel shape": URDF.replace(WHEEL, '<cylinder radius="0.06" length="0.004"/>', 1),
    "no camera": BLIND,
    "size": "<robot>" + "".join(f'<link name="l{i}"/>' for i in range(200)) + "</robot>",
    "xacro": '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="$(find a)/b"/></robot>',
}


def written(tmp_path, text):
    (tmp_path / "cube.obj").write_text(CUBE)
    path = tmp_path / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_page_has_the_constructs_of_the_code():
    rows = re.findall(r"^\| (.+?) \| (read|approximated|left out|refused) \| (.+?) \|$", PAGE.read_text("utf-8"), re.M)
    assert rows == [(one.name, one.verdict, one.how) for one in CONSTRUCTS.values()]
    assert {key for key, one in CONSTRUCTS.items() if one.verdict in ("approximated", "left out")} == set(NOTED)
    assert {key for key, one in CONSTRUCTS.items() if one.verdict == "refused"} == set(REFUSED)


def test_the_scenario_of_the_page_is_one():
    block = re.search(r"```toml\n(.+?)```", PAGE.read_text("utf-8"), re.S)
    assert block is not None
    plan = make_scenario(parse_toml(block[1]))
    assert (plan.wheels, plan.cameras) == (("left_motor", "right_motor"), "stereo")


@pytest.mark.parametrize("key", NOTED)
def test_what_is_approximated_or_left_out_is_told(tmp_path, key):
    path = written(tmp_path, NOTED[key])
    more = "stereo" if key == "mounted" else None
    robot, account = read_with_account(path, cameras=more)
    assert [(row[0], row[1]) for row in account.rows()] == [(key, CONSTRUCTS[key].verdict)]
    (sentence,) = robot.warnings
    assert sentence.startswith(f"Robot: {CONSTRUCTS[key].said}: ")
    assert len(sentence) < 300
    (note,) = told(path, cameras=more)["notes"]
    assert note["construct"] == CONSTRUCTS[key].name
    assert note["places"]


@pytest.mark.parametrize("key", REFUSED)
def test_what_is_refused_is_refused(tmp_path, key):
    with pytest.raises(RobotError):
        read_with_account(written(tmp_path, REFUSED[key]))


def test_of_many_places_a_sentence_names_the_first(tmp_path):
    text = URDF
    for i in range(9):
        text = inside(text, f'<gazebo><plugin name="p{i}" filename="x"/></gazebo>')
    robot, account = read_with_account(written(tmp_path, text))
    assert robot.warnings == ("Robot: plugins are left out: 'p0', 'p1', 'p2' and 6 more.",)
    assert len(account.rows()[0][2]) == 9
