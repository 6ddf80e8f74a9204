"""`flysim check` of robots."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from flysim.cli.app import app

STYLES = Path(__file__).parents[1] / "robots" / "styles"


def check(*words):
    return CliRunner().invoke(app, ["check", *map(str, words)])


def test_a_robot_is_told_with_what_is_left_out_of_it():
    done = check(STYLES / "large_square.urdf")
    assert done.exit_code == 0
    assert "wheel_left_joint, wheel_right_joint: radius 0.033 m, track 0.288 m" in done.stdout
    assert "the only eye" in done.stdout
    assert "Robot: sensors are left out: 'lds' (ray)." in done.stderr
    assert max(len(line.rstrip()) for line in done.stdout.splitlines() if not line.startswith("file")) <= 80


def test_wheels_and_cameras_may_be_given(tmp_path):
    text = (STYLES / "vacuum.urdf").read_text().replace("ros2_control", "no_control").replace("wheel_joint", "motor")
    (tmp_path / "robot.urdf").write_text(text)
    told = ["--wheels", "left_motor", "right_motor", "--cameras", "stereo", "--json"]
    data = json.loads(check(tmp_path / "robot.urdf", *told).stdout)
    assert [wheel["joint"] for wheel in data["drive"]["wheels"]] == ["left_motor", "right_motor"]
    assert (data["kind"], len(data["eyes"]), data["baseline"]) == ("robot", 2, pytest.approx(0.12))
    assert {note["verdict"] for note in data["notes"]} == {"approximated", "left out"}
    assert len(data["left_out"]) == len(data["notes"])
    for words, said in (
        ([], "no driven wheels"),
        (told[:3], "no camera sensor: --cameras stereo mounts a pair"),
        (["--cameras", "mono"], "no cameras 'mono'. Known: stereo."),
    ):
        done = check(tmp_path / "robot.urdf", *words)
        assert done.exit_code == 2
        assert said in done.stderr
