"""xacro files: expanded in a closed process, or refused with the command that expands them."""

import subprocess
import sys

import pytest
from robot_text import URDF

from flysim.errors import RobotError
from flysim.robots import xacro
from flysim.robots.robot import read_robot

HEAD = '<robot name="rover" xmlns:xacro="http://www.ros.org/wiki/xacro">'
COMMAND = "expand it first: xacro FILE > robot.urdf."


def written(tmp_path, more, name="robot.urdf.xacro"):
    path = tmp_path / name
    path.write_text(URDF.replace('<robot name="rover">', HEAD + more), encoding="utf-8")
    return path


def test_without_the_package_the_error_has_the_command(tmp_path, monkeypatch):
    monkeypatch.setattr(xacro.importlib.util, "find_spec", lambda name: None)
    for more in (
        '<xacro:property name="r" value="0.05"/>',
        '<link name="${a}"/>',
        '<xacro:include filename="$(find a_description)/a.xacro"/>',
    ):
        for name in ("robot.urdf.xacro", "robot.urdf"):
            with pytest.raises(RobotError, match="this is a xacro file") as caught:
                read_robot(written(tmp_path, more, name))
            assert str(caught.value).endswith(COMMAND)
    bare = URDF.replace('<robot name="rover">', '<robot name="rover"><xacro:macro name="a"/>')  # a prefix undeclared
    (tmp_path / "bare.urdf").write_text(bare)
    with pytest.raises(RobotError, match="this is a xacro file"):
        read_robot(tmp_path / "bare.urdf")
    # What is expanded already often keeps the declaration.
    assert read_robot(written(tmp_path, "")).name == "rover"


def test_it_is_expanded_with_what_lies_in_its_package(tmp_path):
    pytest.importorskip("xacro", reason="pip install flysim-testbed[xacro]")
    package = tmp_path / "own_description"
    (package / "urdf").mkdir(parents=True)
    (package / "package.xml").write_text("<package/>")
    (package / "size.xacro").write_text(f'{HEAD}<xacro:property name="r" value="0.07"/></robot>')
    path = written(package / "urdf", '<xacro:include filename="$(find own_description)/size.xacro"/>')
    text = path.read_text().replace('<sphere radius="0.025"/>', '<sphere radius="${r / 2}"/>')
    path.write_text(text.replace('xyz="-0.13 0 0.025"', 'xyz="-0.13 0 ${r / 2}"'))
    caster = next(link for link in read_robot(path).links if link.name == "caster")
    assert caster.collisions[0].shape.radius == 0.035


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ('<xacro:include filename="/etc/hosts"/>', "'/etc/hosts' lies outside the robot's folder"),
        ('<xacro:include filename="../outside.xacro"/>', "outside.xacro' lies outside the robot's folder"),
        ("<link name=\"${xacro.load_yaml('/etc/hosts')}\"/>", "'/etc/hosts' lies outside the robot's folder"),
        ('<xacro:include filename="link.xacro"/>', "link.xacro' lies outside the robot's folder"),
        ('<xacro:include filename="$(find other)/a"/>', "package 'other' is not in the robot's folder"),
        ("<link name=\"${'a' * 10**11}\"/>", "this is a xacro file"),
        ('<link name="${().__class__}"/>', "this is a xacro file"),
        ("<xacro:none/>", "this is a xacro file"),
    ],
)
def test_it_reads_nothing_outside_and_takes_no_more_than_it_may(tmp_path, more, said):
    pytest.importorskip("xacro", reason="pip install flysim-testbed[xacro]")
    room = tmp_path / "room"
    room.mkdir()
    (tmp_path / "outside.xacro").write_text(f"{HEAD}</robot>")
    (room / "link.xacro").symlink_to(tmp_path / "outside.xacro")
    with pytest.raises(RobotError) as caught:
        read_robot(written(room, more))
    assert said in str(caught.value)
    assert str(caught.value).endswith(COMMAND)
    assert len(str(caught.value)) < 300


def test_the_closed_process_does_nothing_but_read(tmp_path):
    child = xacro.Path(xacro.__file__).with_name("xacro_child.py")
    for deed in (
        "open('/etc/hosts')",
        f"open({str(tmp_path / 'new')!r}, 'w')",
        "os.system('true')",
        "__import__('subprocess').run(['true'])",
        "__import__('socket').socket().connect(('127.0.0.1', 9))",
        f"os.remove({str(tmp_path)!r})",
    ):
        code = f"import runpy, os; runpy.run_path({str(child)!r})['guard']({str(tmp_path)!r}); {deed}"
        done = subprocess.run([sys.executable, "-I", "-c", code], capture_output=True, text=True, check=False)
        assert done.returncode != 0, deed
        assert "PermissionError" in done.stderr, deed
    assert list(tmp_path.iterdir()) == []
