"""Another algorithm's results on a data set: what is right scores as right, what is wrong by how much it is wrong."""

import json

import data_sets
import numpy as np
import pytest
from typer.testing import CliRunner

from flysim.cli.app import app
from flysim.datasets.middlebury import disparities
from flysim.datasets.source import read_data_set
from flysim.errors import FlysimError
from flysim.foreign.disparity import pfm, png16
from flysim.geometry.frames import transform
from flysim.products.tables import ply
from flysim.runs.data import plan_of
from flysim.studies.score.score import score


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return data_sets.take(tmp_path_factory.mktemp("whole"), ["kitti"])


@pytest.fixture(scope="module")
def exact(tmp_path_factory, whole):
    """A data set whose rig is as believed, and the true disparities of its frames."""
    folder = tmp_path_factory.mktemp("exact")
    true = [disparities(*stop.views, 1) for stop in whole.truth.stops]
    for kind in ("pfm", "png", "npy", "ply", "world"):
        (folder / kind).mkdir()
    for k, (disparity, stop) in enumerate(zip(true, whole.truth.stops, strict=True)):
        known = np.where(np.isfinite(disparity), disparity, 0.0).astype(np.float32)
        (folder / "pfm" / f"{k}.pfm").write_bytes(pfm(disparity))
        png16(np.rint(known * 256.0).astype(np.uint16)).save(folder / "png" / f"{k}.png")
        np.save(folder / "npy" / f"{k}.npy", known)
        view = stop.views[0]
        v, u = np.nonzero(np.isfinite(view.depth) & (view.link >= 0))
        points = view.camera.unproject(np.stack([u, v], axis=1), view.depth[v, u])
        x, y, z = points.astype(np.float32).T
        (folder / "ply" / f"{k}.ply").write_bytes(ply({"x": x, "y": y, "z": z}))
        world = transform(whole.sequence.frames[k].T_world_left, points[::7])
        np.savetxt(folder / "world" / f"{k}.xyz", world)
    return folder


def scored(whole, kind, *files, **more):
    data = read_data_set(whole.folder)
    return score(data, plan_of(data, ["flies.population=4000"]), kind, list(files), **more)


@pytest.mark.parametrize(("kind", "off"), [("pfm", 1e-4), ("npy", 1e-4), ("png", 0.5 / 256.0 + 1e-4)])
def test_the_truth_itself_is_right(whole, exact, kind, off):
    found = scored(whole, "disparity", exact / kind, name="truth")
    told = found.to_json()
    assert told["disparity"]["within_0_5px"] == 1.0 and told["disparity"]["median_px"] <= off
    assert (told["disparity"]["density"], told["disparity"]["d1"]) == (1.0, 0.0)
    assert told["disparity"]["count"] == sum(sight.seen.sum() for sight in whole.truth.sights)
    assert told["report"]["engine"] == "truth"
    assert told["report"]["surface"]["accuracy_median_m"] < 0.002
    assert told["pooled"]["recall"] == 1.0


def test_what_is_off_is_off_by_that(whole, exact, tmp_path):
    for k in range(2):
        known = np.load(exact / "npy" / f"{k}.npy")
        known[known > 0.0] += np.float32(0.75)
        known[:60] = 0.0
        np.save(tmp_path / f"{k}.npy", known)
    told = scored(whole, "disparity", tmp_path / "*.npy").to_json()["disparity"]
    assert told["median_px"] == pytest.approx(0.75, abs=1e-4)
    assert (told["within_0_5px"], told["within_1px"]) == (0.0, 1.0)
    assert 0.3 < told["density"] < 0.9


@pytest.mark.parametrize(("kind", "frame"), [("ply", "left"), ("world", "world")])
def test_points_by_a_file_a_frame(whole, exact, kind, frame):
    told = scored(whole, "points", exact / kind, frame=frame).to_json()
    assert told["report"]["surface"]["precision"]["0.02"] > 0.9
    assert "disparity" not in told
    wrong = scored(whole, "points", exact / kind, frame="left" if frame == "world" else "world").to_json()
    assert wrong["report"]["surface"]["precision"]["0.02"] < 0.3


def test_obstacles_by_one_file(whole, tmp_path):
    true = next(one for one in whole.truth.obstacles if one.visible)
    center, size = true.visible_extent()
    rows = [
        {"center": center.tolist(), "size": [size[1], size[0], size[2]], "yaw_deg": np.degrees(true.yaw) + 90.0},
        {"center": [9.0, 9.0, 0.1], "size": [0.2, 0.2, 0.2], "shape": "cylinder"},
    ]
    path = tmp_path / "found.json"
    path.write_text(json.dumps(rows))
    told = scored(whole, "obstacles", path).to_json()
    (box,) = [one for one in told["report"]["obstacles"] if one["name"] == true.name]
    assert box["detected"] and box["size_visible_error_m"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)
    assert told["report"]["false_obstacles"] == 1 and told["report"]["surface"] is None


def test_what_is_no_result_is_one_line(whole, exact, tmp_path):
    (tmp_path / "few").mkdir()
    (tmp_path / "few" / "0.pfm").write_bytes(pfm(np.ones((120, 160), np.float32)))
    (tmp_path / "none").mkdir()
    (tmp_path / "small").mkdir()
    for k in range(2):
        (tmp_path / "small" / f"{k}.pfm").write_bytes(pfm(np.ones((12, 16), np.float32)))
    texts = {
        "no.json": "{}", "nan.json": '[{"center": [0, 0, NaN], "size": [1, 1, 1]}]', "two.xyz": "1 2\n",
        "short.json": '[{"center": [0, 0], "size": [1, 1, 1]}]', "kind.json": '[{"center": [0, 0, 0]}]',
    }  # fmt: skip
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    for kind, path, why in (
        ("disparity", tmp_path / "few", "1 files for 2 frames"),
        ("disparity", tmp_path / "none", "no file that ends with .pfm, .png, .npy"),
        ("disparity", tmp_path / "small", "16x12 px, the left picture has 160x120 px"),
        ("disparity", tmp_path / "gone.pfm", "1 files for 2 frames"),
        ("points", [tmp_path / "two.xyz"] * 2, "line 1 is no x y z: '1 2'"),
        ("points", [tmp_path / "gone.ply"] * 2, "cannot read the points: No such file"),
        ("obstacles", tmp_path / "no.json", "no list of at most"),
        ("obstacles", tmp_path / "nan.json", "NaN is no number"),
        ("obstacles", tmp_path / "short.json", "obstacle 1: center, size or yaw_deg is not finite, or has not three"),
        ("obstacles", tmp_path / "kind.json", "obstacle 1: 'size'. Give center and size"),
    ):  # fmt: skip
        with pytest.raises(FlysimError) as refused:
            scored(whole, kind, *(path if isinstance(path, list) else [path]))
        assert why in str(refused.value) and "\n" not in str(refused.value)


def test_the_command(whole, exact, tmp_path):
    arguments = ["score", str(whole.folder), "--disparity", str(exact / "pfm"), "--name", "mine"]
    done = CliRunner().invoke(app, [*arguments, "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.output)["disparity"]["within_1px"] == 1.0
    done = CliRunner().invoke(app, arguments)
    assert "mine" in done.output and "seen by both" in done.output
    done = CliRunner().invoke(app, ["score", str(whole.folder)])
    assert (done.exit_code, "give one of --points, --disparity, --obstacles" in done.output) == (2, True)
