import errno
import os
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flysim.errors import RecordError
from flysim.record.recording import recording_id, write_recording


def rerun(*arguments: object) -> subprocess.CompletedProcess[str]:
    program = shutil.which("rerun", path=str(Path(sys.executable).parent)) or "rerun"
    quiet = {**os.environ, "CI": "1"}
    return subprocess.run([program, *map(str, arguments)], env=quiet, capture_output=True, text=True, timeout=120)


@pytest.fixture(scope="module")
def recording(tmp_path_factory, findings, truth, report):
    path = tmp_path_factory.mktemp("recording") / "recording.rrd"
    write_recording(path, findings, truth, report, config={"flies": {"population": 3000}})
    return path


@pytest.fixture(scope="module")
def chunks(recording):
    from rerun.chunk import RrdReader

    found: dict[str, list] = {}
    for chunk in RrdReader(recording).store().stream():
        found.setdefault(str(chunk.entity_path), []).append(chunk.to_record_batch())
    return found


def rows(chunks, entity: str, component: str, timeline: str | None = None) -> int:
    """Rows of an entity that hold a component, on one timeline if asked."""
    count = 0
    for batch in chunks[entity]:
        names = [n for n in batch.schema.names if component in n]
        if names and (timeline is None or timeline in batch.schema.names):
            count += batch.num_rows - batch.column(names[0]).null_count
    return count


def test_rerun_verifies_the_file(recording):
    done = rerun("rrd", "verify", recording)
    assert done.returncode == 0
    assert "1 file verified" in done.stdout + done.stderr


def test_each_stop_has_its_images_its_flies_and_the_robots_pose(chunks, findings):
    stops = len(findings.seen)
    for camera in ("left", "right"):
        assert rows(chunks, f"/world/robot/{camera}/image", "EncodedImage:blob", "stop") == stops
        assert rows(chunks, f"/world/robot/{camera}", "Pinhole:image_from_camera", "stop") == stops
        assert rows(chunks, f"/world/robot/{camera}/flies", "Points2D:positions", "stop") == 2 * stops
    assert rows(chunks, "/world/flies", "Points3D:positions", "stop") == stops
    assert rows(chunks, "/world/robot", "Transform3D:translation", "stop") == stops
    assert rows(chunks, "/world/robot", "Transform3D:translation", "sim_time") > 3 * stops


def test_the_curves_hold_every_generation_and_one_value_a_stop(chunks, findings):
    generations = sum(one.swarm.iterations for one in findings.seen)
    for name in ("best", "mean", "settled"):
        assert rows(chunks, f"/curves/{name}", "Scalars:scalars", "generation") == generations
        assert rows(chunks, f"/curves/{name}", "Scalars:scalars", "stop") == len(findings.seen)
    assert rows(chunks, "/curves/iterations", "Scalars:scalars", "stop") == len(findings.seen)


def test_flies_lie_where_the_cloud_says_and_project_half_a_pixel_on(chunks, findings):
    points = [p for b in chunks["/world/flies"] for p in values(b, "Points3D:positions")]
    assert sum(map(len, points)) == len(findings.cloud.points)
    np.testing.assert_allclose(np.concatenate(points), findings.cloud.points, atol=1e-5)
    seen = [p for b in chunks["/world/robot/left/flies"] for p in values(b, "Points2D:positions") if len(p)]
    expected = np.concatenate([one.swarm.uv for one in findings.seen]) + 0.5
    np.testing.assert_allclose(np.concatenate(seen), expected, atol=1e-3)


def values(batch, component: str) -> list[np.ndarray]:
    names = [n for n in batch.schema.names if component in n]
    return [np.array(row) for row in batch.column(names[0]).to_pylist() if row is not None] if names else []


def test_the_world_is_there_shape_by_shape_and_boxes_true_and_estimated(chunks):
    scene = {entity.split("/")[3]: entity for entity in chunks if entity.startswith("/world/scene/")}
    kinds = {"ground": "Mesh3D", "wall": "Boxes3D", "box_1": "Boxes3D", "post": "Cylinders3D"}
    kinds |= {"ball": "Ellipsoids3D", "ramp": "Mesh3D"}
    for model, kind in kinds.items():
        part = next(e for e in chunks if e.startswith("/world/scene/") and model in e and e.endswith("visual"))
        assert any(kind in name for batch in chunks[part] for name in batch.schema.names), (model, scene)
    for name in ("true", "estimated"):
        assert len(values(chunks[f"/world/{name}"][0], "Boxes3D:half_sizes")[0]) == 2
    labels = values(chunks["/world/true/names"][0], "Points3D:labels")[0]
    assert list(labels) == ["box_1", "post"]


def test_what_moves_is_placed_at_each_stop(chunks, findings):
    ball = next(e for e in chunks if e.startswith("/world/scene/") and e.endswith("ball-link"))
    assert rows(chunks, ball, "Transform3D:translation", "stop") == len(findings.seen)


def test_report_and_log_are_in_words(chunks, findings):
    page = values(chunks["/report"][0], "TextDocument:text")[0][0]
    assert "made_up, seed 3" in page and "| box_1 | yes | 1.7 |" in page and "| ball | no | - |" in page
    said = [str(line[0]) for b in chunks["/log"] for line in values(b, "TextLog:text")]
    assert len(said) == len(findings.seen) + 2
    assert said[0].startswith("stop 0: 12 generations") and "a <light> was skipped" in said


def test_the_same_findings_give_the_same_recording(tmp_path, recording, findings, truth, report):
    again = tmp_path / "again.rrd"
    later = {**report, "time_s": {"total": 99.0}}  # another machine's clock
    write_recording(again, findings, truth, later, config={"flies": {"population": 3000}})
    tidy = []
    for path in (recording, again):
        tidy.append(tmp_path / f"tidy{len(tidy)}.rrd")
        assert rerun("rrd", "optimize", path, "-o", tidy[-1]).returncode == 0
    done = rerun("rrd", "compare", "--unordered", *tidy)
    assert done.returncode == 0, done.stdout + done.stderr


def test_another_seed_or_another_parameter_is_another_recording(findings):
    names = {
        recording_id(j, c)
        for j in (findings, replace(findings, sequence=replace(findings.sequence, seed=4)))
        for c in ({}, {"population": 1})
    }
    assert len(names) == 4


def test_eight_stops_are_written_fast_and_small(tmp_path, make_drive, report):
    drive = make_drive(8)
    start = time.perf_counter()
    write_recording(tmp_path / "r.rrd", drive.findings, drive.truth, report)
    assert time.perf_counter() - start < 3.0  # 0.2 s on a quiet machine
    assert (tmp_path / "r.rrd").stat().st_size < 2_000_000


def test_a_drive_blocked_before_its_first_stop_is_recorded(tmp_path, make_drive, report):
    drive = make_drive(0, blocked="blocked at stop 0 of 8 by box_2")
    write_recording(tmp_path / "r.rrd", drive.findings, drive.truth, report)
    assert "1 file verified" in rerun("rrd", "verify", tmp_path / "r.rrd").stderr


def test_nothing_is_said_on_stdout_or_stderr(tmp_path, findings, truth, report, capfd):
    write_recording(tmp_path / "r.rrd", findings, truth, report)
    assert capfd.readouterr() == ("", "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_a_full_disk_is_an_error_and_no_endless_wait(findings, truth, report):
    with pytest.raises(OSError) as error:
        write_recording(Path("/dev/full"), findings, truth, report)
    assert error.value.errno == errno.ENOSPC


def test_a_switched_off_rerun_is_told(tmp_path, findings, truth, report, monkeypatch):
    monkeypatch.setenv("RERUN", "off")
    with pytest.raises(RecordError, match="RERUN"):
        write_recording(tmp_path / "r.rrd", findings, truth, report)
