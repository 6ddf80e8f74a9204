import json
import math
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import trimesh

from flysim.common.plain_data import plain_data
from flysim.evaluate.track import whole_track
from flysim.record.files import write_files


@pytest.fixture(scope="module")
def folder(tmp_path_factory, findings, truth, report):
    folder = tmp_path_factory.mktemp("files")
    write_files(folder, findings, truth, report, {"seed": 3, "flies": {"population": 3000}, "path": Path("a/b")})
    return folder


def test_report_and_config_come_back_as_they_went_in(folder, report):
    assert json.loads((folder / "report.json").read_text()) == report
    config = json.loads((folder / "config.json").read_text())
    assert config == {"seed": 3, "flies": {"population": 3000}, "path": "a/b"}


def test_obstacles_have_their_dimensions_and_heading_in_degrees(folder, findings):
    obstacles = json.loads((folder / "obstacles.json").read_text())
    assert len(obstacles) == 2
    for written, obstacle in zip(obstacles, findings.obstacles, strict=True):
        assert list(written) == ["shape", "center", "size", "diameter", "yaw_deg", "flies"]
        assert written["center"] == pytest.approx(obstacle.center, abs=1e-6)
        assert written["size"] == pytest.approx(obstacle.size, abs=1e-6)
        assert math.radians(written["yaw_deg"]) == pytest.approx(obstacle.yaw, abs=1e-6)
        assert written["flies"] == len(obstacle.flies) > 0


def test_every_fly_is_in_the_parquet_file_with_its_units(folder, findings):
    table = pq.read_table(folder / "flies.parquet")
    assert table.column_names == [*"xyz", "fitness", "stop", "u", "v", "u_right", "v_right", *"rgb"]
    cloud = findings.cloud
    columns = {name: table[name].to_numpy() for name in table.column_names}
    np.testing.assert_array_equal(np.stack([columns[k] for k in "xyz"], 1), cloud.points)
    np.testing.assert_array_equal(np.stack([columns["u"], columns["v"]], 1), cloud.uv)
    np.testing.assert_array_equal(np.stack([columns["u_right"], columns["v_right"]], 1), cloud.uv_right)
    np.testing.assert_array_equal(np.stack([columns[k] for k in "rgb"], 1), cloud.rgb)
    np.testing.assert_array_equal(columns["fitness"], cloud.fitness)
    np.testing.assert_array_equal(columns["stop"], cloud.stop)
    units = {field.name: field.metadata[b"unit"].decode() for field in table.schema}
    assert units["x"] == "m" and units["u_right"] == "px" and units["stop"] == "1"
    assert table.schema.metadata[b"frame"] == b"world"


def test_another_program_reads_the_coloured_cloud(folder, findings):
    cloud = trimesh.load(folder / "flies.ply")
    np.testing.assert_allclose(cloud.vertices, findings.cloud.points, atol=1e-6)
    np.testing.assert_array_equal(np.asarray(cloud.colors)[:, :3], findings.cloud.rgb)


def read_tum(path: Path) -> np.ndarray:
    return np.loadtxt(path)


def test_trajectories_hold_every_stop_and_sample_at_the_same_increasing_times(folder, truth):
    true, odometry = read_tum(folder / "trajectory_true.tum"), read_tum(folder / "trajectory_odom.tum")
    np.testing.assert_array_equal(true[:, 0], odometry[:, 0])
    assert (np.diff(true[:, 0]) > 0).all()
    assert len(true) > sum(len(stop.track) for stop in truth.stops) * 0.9
    for stop in truth.stops:
        for rows, pose in ((true, stop.true), (odometry, stop.odometry)):
            row = rows[np.flatnonzero(rows[:, 0] == stop.sim_time)[0]]
            assert row[1:4] == pytest.approx([pose.x, pose.y, 0.0], abs=1e-6)
            assert row[4:8] == pytest.approx([0, 0, math.sin(pose.yaw / 2), math.cos(pose.yaw / 2)], abs=1e-8)


def test_evo_compares_the_two_trajectories(folder, findings, truth, tmp_path):
    program = shutil.which("evo_ape", path=str(Path(sys.executable).parent)) or shutil.which("evo_ape")
    if program is None:
        pytest.skip("evo is not installed")
    home = {"HOME": str(tmp_path), "PATH": str(Path(program).parent) + ":/usr/bin:/bin", "MPLBACKEND": "agg"}
    files = ["trajectory_true.tum", "trajectory_odom.tum"]
    done = subprocess.run([program, "tum", *files], cwd=folder, env=home, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    figures = {row.split()[0]: float(row.split()[1]) for row in done.stdout.splitlines() if "\t" in row}
    track = whole_track(findings, truth)
    error = np.hypot(*(track.believed - track.true)[:, :2].T)
    assert figures["rmse"] == pytest.approx(np.sqrt((error**2).mean()), abs=1e-5)
    assert figures["max"] == pytest.approx(error.max(), abs=1e-5)


def test_a_drive_that_reached_no_stop_still_leaves_readable_files(tmp_path, findings, truth, report):
    cloud = findings.cloud
    none = replace(
        cloud,
        points=cloud.points[:0],
        fitness=cloud.fitness[:0],
        stop=cloud.stop[:0],
        uv=cloud.uv[:0],
        uv_right=cloud.uv_right[:0],
        rgb=cloud.rgb[:0],
    )
    write_files(tmp_path, replace(findings, seen=(), cloud=none, obstacles=()), replace(truth, stops=()), report, {})
    assert pq.read_table(tmp_path / "flies.parquet").num_rows == 0
    assert (tmp_path / "flies.ply").read_bytes().endswith(b"end_header\n")
    assert json.loads((tmp_path / "obstacles.json").read_text()) == []


def test_json_holds_no_nan_and_no_numpy():
    value = {"a": np.float32(0.5), "b": [np.nan, np.inf, np.int64(3)], 4: np.array([True]), "c": (None, "x")}
    assert plain_data(value) == {"a": 0.5, "b": [None, None, 3], "4": [True], "c": [None, "x"]}
    json.dumps(plain_data(value), allow_nan=False)
