"""`flysim calibrate` in this process: what it writes, what it says, what it refuses."""

import json

import numpy as np
import pytest
from boards import BOARD, RIG, write_pairs
from PIL import Image
from typer.testing import CliRunner

from flysim.cli.app import app
from flysim.geometry.camera_info import read_camera_info, stereo_rig

SHAPE = ("--board", f"{BOARD.columns}x{BOARD.rows}", "--square", str(BOARD.square))


@pytest.fixture(scope="module")
def pairs(tmp_path_factory):
    return write_pairs(tmp_path_factory.mktemp("shots") / "pairs", 6)


@pytest.fixture
def flysim(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def call(*words, code=0):
        done = CliRunner().invoke(app, ["calibrate", *map(str, words)])
        assert done.exit_code == code, done.output
        return done

    return call


def refused(flysim, tmp_path, *words):
    """The one line; nothing was written."""
    before = sorted(tmp_path.rglob("*"))
    line = flysim(*words, "--out", "new", code=2).stderr
    assert line.startswith("flysim: ") and line.count("\n") == 1, line
    assert sorted(tmp_path.rglob("*")) == before
    return line


def test_a_pair_becomes_two_files_of_ros(flysim, pairs, tmp_path):
    said = json.loads(flysim(pairs, *SHAPE, "--out", "cal", "--json").stdout)
    left, right = (read_camera_info(tmp_path / "cal" / f"{side}.yaml") for side in ("left", "right"))
    rig = stereo_rig(left, right)
    assert rig.left.fx == pytest.approx(RIG.left.fx, rel=0.01)
    assert rig.baseline == pytest.approx(RIG.baseline, rel=0.01)
    assert said["baseline_m"] == pytest.approx(rig.baseline, rel=1e-6)
    assert (said["boards"], said["left_out"], len(said["images"])) == (6, [], 6)
    assert said["verdict"] in ("usable", "poor") and said["rms_px"] < 0.2
    assert json.loads((tmp_path / "cal/calibration.json").read_text())["cameras"]["left"]["fx"] == left.K[0, 0]
    with Image.open(tmp_path / "cal/residuals.png") as picture:
        assert picture.size[0] > 800


def test_one_camera_becomes_one_file_and_a_verdict(flysim, pairs, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    said = flysim(f"{pairs}/left*.png", *SHAPE, "--out", "cal").stdout
    assert "Verdict: " in said and "Only 6 boards" in " ".join(said.split()) and "left06.png" in said
    assert max(map(len, said.splitlines())) <= 80
    info = read_camera_info(tmp_path / "cal/camera.yaml")
    assert info.camera.fx == pytest.approx(RIG.left.fx, rel=0.01) and np.array_equal(info.R, np.eye(3))


def test_what_cannot_be_is_one_line_and_nothing_is_written(flysim, pairs, tmp_path):
    assert "one of the two" in refused(flysim, tmp_path)
    assert "square must be > 0 m" in refused(flysim, tmp_path, pairs, "--square", "0")
    assert "such as 9x6" in refused(flysim, tmp_path, pairs, "--board", "six")
    few = [pairs / f"left0{k}.png" for k in (1, 2)]
    assert "shows a chessboard 6x6" in refused(flysim, tmp_path, few[0], "--board", "6x6")
    assert "found in 2 images, a calibration needs 3" in refused(flysim, tmp_path, *few, *SHAPE)
    uneven = [*few, pairs / "right01.png"]
    assert "2 images of the left eye and 1 of the right" in refused(flysim, tmp_path, *uneven, *SHAPE)
    assert "go with --simulate" in refused(flysim, tmp_path, pairs, "--seed", "3")
    assert "go with --simulate" in refused(flysim, tmp_path, pairs, "--count", "3")
    assert "Did you mean 'rover'" in refused(flysim, tmp_path, "--simulate", "rovr")
    assert "sensors.KEY=VALUE alone" in refused(flysim, tmp_path, "--simulate", "rover", "--set", "light.level=2")
    assert "unknown key 'sensors.k3'" in refused(flysim, tmp_path, "--simulate", "rover", "--set", "sensors.k3=2")
