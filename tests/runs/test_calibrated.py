"""A robot that believes its calibration in place of its file."""

import numpy as np
import pytest

from flysim.errors import FlysimError, ScenarioError
from flysim.geometry.camera_info import write_camera_info
from flysim.robots.robot import read_robot
from flysim.runs.calibrated import BOARD, simulated, true_infos
from flysim.runs.run import check, errand, run
from flysim.runs.scenario import make_scenario, read_scenario
from flysim.sensors.parameters import SensorParams
from flysim.sources.eyes import TwoEyes
from flysim.studies.calibration.beside import beside

LENS = ("sensors.k1=-0.15", "sensors.p1=0.002")


@pytest.fixture
def calibrated(short):
    """The short scenario's cameras as they are, as a folder of files beside it."""
    plan = read_scenario(str(short), LENS)
    robot = read_robot(plan.robot_path)
    folder = short.parent / "cal"
    folder.mkdir()
    for side, info in zip(("left", "right"), true_infos(robot.rig, plan.sensors), strict=True):
        write_camera_info(folder / f"{side}.yaml", info)
    return folder


@pytest.mark.parametrize("name", ["truth", "cal", "cal/left.yaml", "cal/right.yaml"])
def test_a_scenario_takes_a_calibration_by_its_name(short, calibrated, name):
    plan = read_scenario(str(short), (*LENS, f"calibration={name}"))
    robot = read_robot(plan.robot_path)
    eyes = errand(plan).eyes()
    np.testing.assert_allclose(eyes.rig.T_right_left, robot.rig.T_right_left, atol=1e-6)
    assert eyes.rig.left.cx == pytest.approx(robot.rig.left.cx)
    assert isinstance(eyes, TwoEyes) and eyes.true.left == robot.rig.left  # what is drawn is what truly is


def test_a_run_undoes_the_lens_and_says_so(short, calibrated, tmp_path):
    keys = (*LENS, "calibration=cal")
    assert run(str(short), overrides=keys, renderer="tiny", seed=2).calibration == {"by": "cal"}
    elsewhere = tmp_path / "elsewhere"
    kept = read_scenario(str(short), keys).kept(elsewhere, 2)
    assert kept["calibrated_by"] == str(calibrated)
    assert errand(make_scenario({**kept, "folder": elsewhere})).measured is not None


def test_a_calibration_may_be_wrong_beside(short, calibrated):
    plan = read_scenario(str(short), (*LENS, "calibrated_by=cal", "calibration.baseline_error=0.1"))
    assert errand(plan).eyes().rig.baseline == pytest.approx(1.1 * 0.12)


def test_what_is_no_calibration_is_one_line(short, calibrated):
    def refused(name):
        with pytest.raises(FlysimError) as caught:
            check(read_scenario(str(short), (f"calibration={name}",)))
        assert "\n" not in str(caught.value)
        return str(caught.value)

    assert "no calibration 'nowhere'" in refused("nowhere")
    assert "write images:N" in refused("images:many")
    assert "write images:N" in refused("images:0")
    (calibrated / "right.yaml").rename(calibrated / "camera.yaml")
    assert "right.yaml" in refused("cal/left.yaml")
    assert "one camera's" in refused("cal/camera.yaml")
    text = (calibrated / "left.yaml").read_text()
    (calibrated / "left.yaml").write_text(text.replace("image_width: 160", "image_width: 640"))
    (calibrated / "right.yaml").write_text(text)
    assert "the robot's images have 160x120 px" in refused("cal")
    (calibrated / "left.yaml").write_text("image_width: 160\n")
    assert "left.yaml: no camera_info of ROS" in refused("cal")


def test_a_calibration_that_names_nothing_is_a_mistake_of_the_scenario(short):
    with pytest.raises(ScenarioError, match="calibrated_by"):
        read_scenario(str(short), ("calibration=" + "x" * 2000,))


def test_a_robot_that_is_shown_a_board_finds_its_own_cameras(short):
    robot = read_robot(read_scenario(str(short)).robot_path)  # images of 160x120 px: four times as coarse
    sensors = SensorParams(k1=-0.15, noise=1.0)
    found = simulated(robot, BOARD, sensors, images=8, seed=5, renderer="tiny")
    apart = beside(list(found.infos.values()), true_infos(robot.rig, sensors))
    assert all(abs(eye.focal) < 0.01 and eye.principal_px < 1.0 for eye in apart.eyes)
    assert abs(apart.baseline_m) < 0.002
    assert found.solved.rms < 0.2
