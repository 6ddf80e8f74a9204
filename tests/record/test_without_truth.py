"""What nobody knows the truth of is recorded all the same: two photographs, one frame, no world."""

import json
from dataclasses import replace

import numpy as np
import pytest

from flysim.evaluate.track import whole_track
from flysim.products.cloud import FlyCloud
from flysim.record.figures import path_figure
from flysim.record.recorder import record


@pytest.fixture(scope="module")
def folder(tmp_path_factory, findings):
    return record(findings, tmp_path_factory.mktemp("photographs") / "run", camera="by hand")


def test_all_is_written_that_needs_no_truth(folder):
    assert sorted(path.name for path in folder.iterdir()) == [
        *("config.json", "figures", "flies.parquet", "flies.ply", "obstacles.json", "recording.rrd"),
        "trajectory_odom.tum",
    ]
    assert {path.name for path in (folder / "figures").iterdir()} == {
        *("path.png", "planes.png", "flies_on_image.png", "flies_on_images.png")
    }
    config = json.loads((folder / "config.json").read_text(encoding="utf-8"))
    assert (config["camera"], config["seed"]) == ("by hand", 3)


def test_its_path_is_where_the_frames_believe_to_be(folder, findings):
    track = whole_track(findings, None)
    assert track.true is None
    assert track.times.tolist() == [frame.time for frame in findings.sequence.frames]
    expected = [frame.T_world_base[:2, 3] for frame in findings.sequence.frames]
    np.testing.assert_allclose(track.believed[:, :2], expected)
    lines = (folder / "trajectory_odom.tum").read_text(encoding="ascii").splitlines()
    assert len(lines) == 1 + len(expected)
    assert [float(x) for x in lines[2].split()[1:3]] == pytest.approx(expected[1].tolist(), abs=1e-6)


def test_no_picture_claims_to_know_what_is_true(findings, truth):
    labels = path_figure(findings, None).axes[0].get_legend_handles_labels()[1]
    assert {"obstacle, estimated", "flies", "path, odometry"} <= set(labels)
    assert not [label for label in labels if "true" in label]
    assert [label for label in path_figure(findings, truth).axes[0].get_legend_handles_labels()[1] if "true" in label]


def test_the_recording_shows_the_robot_where_it_believes_to_be(folder, findings):
    from rerun.chunk import RrdReader

    paths = {str(chunk.entity_path) for chunk in RrdReader(folder / "recording.rrd").store().stream()}
    assert {"/world/robot", "/world/robot/left/image", "/world/flies", "/world/estimated"} <= paths
    assert not [path for path in paths if path.startswith(("/world/scene", "/world/path/true", "/report"))]


def test_nothing_found_in_no_frame_is_recorded_too(tmp_path, findings):
    none = {name: getattr(findings.cloud, name)[:0] for name in FlyCloud.__slots__}
    empty = replace(
        findings, seen=(), cloud=FlyCloud(**none), obstacles=(), sequence=replace(findings.sequence, frames=())
    )
    folder = record(empty, tmp_path / "run")
    assert json.loads((folder / "obstacles.json").read_text(encoding="utf-8")) == []


def test_a_folder_that_is_there_is_kept(folder, findings):
    from flysim.errors import RecordError

    before = (folder / "config.json").read_bytes()
    with pytest.raises(RecordError):
        record(findings, folder)
    assert (folder / "config.json").read_bytes() == before
