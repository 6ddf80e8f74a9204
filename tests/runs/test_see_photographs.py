"""Two photographs, drawn by hand arithmetic, through `see`: floor, things, scores, and what is refused."""

import json

import numpy as np
import photographed
import pyarrow.parquet as pq
import pytest
import reader
from PIL import Image
from typer.testing import CliRunner

import flysim as fs
from flysim.cli.app import app
from flysim.errors import FlysimError
from flysim.flies.parameters import FlyParams


@pytest.fixture(scope="module")
def standing(tmp_path_factory):
    folder = tmp_path_factory.mktemp("standing")
    left, right, disparity = photographed.room()
    files = photographed.save(folder, left, right)
    np.save(folder / "truth.npy", disparity)
    return files, folder / "truth.npy"


@pytest.fixture(scope="module")
def seen(standing):
    (left, right, calib), truth = standing
    return fs.see(left, right, calib=calib, truth=truth, params=fs.SeeParams(engines=("flies", "sgbm", "bm")))


def test_the_floor_is_found_and_not_typed(seen):
    assert seen.floor is not None
    assert seen.floor.height == pytest.approx(0.5, abs=0.002)
    assert seen.floor.pitch_deg == pytest.approx(20.0, abs=0.2)
    assert seen.floor.roll_deg == pytest.approx(0.0, abs=0.2)


def test_what_stands_reaches_down_to_the_floor(seen):
    (thing,) = [one for one in seen.things if one.obstacle.center[0] < 1.4]  # behind it is the wall
    assert not thing.afloat
    low = thing.obstacle.center[2] - thing.obstacle.size[2] / 2.0
    assert low == pytest.approx(0.0, abs=1e-9)
    assert thing.obstacle.size[[0, 2]] == pytest.approx(0.3, abs=0.005)
    assert thing.obstacle.center[0] == pytest.approx(1.2, abs=0.02)


def test_more_flies_see_the_same_things(standing, seen):
    (left, right, calib), _ = standing
    many = fs.see(left, right, calib=calib, params=fs.SeeParams(flies=FlyParams(population=20_000)))
    assert len(many.findings.cloud.points) > 1.8 * len(seen.findings.cloud.points)
    assert len(many.things) == len(seen.things)


def test_what_hangs_has_a_box_of_its_own_height(tmp_path):
    left, right, _ = photographed.room(box=((-0.15, 0.15), (0.0, 0.2), 1.2), hang=0.2)
    files = photographed.save(tmp_path, left, right)
    found = fs.see(*files[:2], calib=files[2])
    assert found.floor is not None
    (thing,) = [one for one in found.things if one.obstacle.center[0] < 1.4]
    assert thing.afloat
    assert thing.obstacle.size[2] == pytest.approx(0.2, abs=0.02)
    assert thing.obstacle.center[2] == pytest.approx(0.3, abs=0.02)


def test_without_a_floor_everything_has_a_box_of_its_own_height(tmp_path):
    left, right, _ = photographed.room(floor=False, hang=0.2)
    files = photographed.save(tmp_path, left, right)
    found = fs.see(*files[:2], calib=files[2])
    assert found.floor is None
    assert all(thing.afloat for thing in found.things)
    (thing,) = [one for one in found.things if one.obstacle.center[0] < 1.4]
    assert thing.obstacle.size[[0, 2]] == pytest.approx((0.3, 0.3), abs=0.04)  # seen from 20 degrees above, no more


def test_all_engines_are_judged_by_the_same_truth(seen):
    flies, sgbm = seen.scores["flies"], seen.scores["sgbm"]
    assert flies.seen.within_1px > 0.97
    assert flies.density is None and sgbm.density > 0.8
    assert flies.seen.median_m < 0.01
    assert set(seen.scores) == {"flies", "sgbm", "bm"}


def test_the_command_writes_what_a_person_looks_at(standing, tmp_path):
    (left, right, calib), truth = standing
    words = ["see", str(left), str(right), "--calib", str(calib), "--truth", str(truth), "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, [*words, "--json"])
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert told["floor"]["height_m"] == pytest.approx(0.5, abs=0.002)
    assert told["scores"]["flies"]["within_1px"] > 0.97
    for name in ("depth.png", "things.png", "above.png"):
        with Image.open(tmp_path / "out" / name) as picture:
            assert picture.size[0] > 300
    for name in ("see.json", "flies.ply", "flies.parquet", "recording.rrd"):
        assert (tmp_path / "out" / name).stat().st_size > 1000


def test_a_folder_is_seen_pair_by_pair_and_a_bad_one_costs_no_other(standing, tmp_path):
    (left, right, calib), _ = standing
    for k in range(3):
        for side, path in (("left", left), ("right", right)):
            data = path.read_bytes()
            (tmp_path / f"{side}{k}.png").write_bytes(data[: len(data) // 2] if k == 1 else data)
    words = ["see", str(tmp_path), "--calib", str(calib), "--out", str(tmp_path / "out"), "--json"]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 2
    assert [one["name"] for one in json.loads(done.stdout)["pairs"]] == ["left0", "left2"]
    assert len(done.stderr.splitlines()) == 1 and "left1.png: cannot read the picture" in done.stderr
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["00000-left0", "00001-left2", "see.json"]
    kept = json.loads((tmp_path / "out" / "see.json").read_text())
    assert len(kept["pairs"]) == 2 and "left1.png" in kept["refused"][0]


def test_without_a_calibration_it_works_in_pixels_and_says_so(standing):
    (left, right, _), truth = standing
    found = fs.see(left, right, truth=truth)
    told = found.to_json()
    assert not told["metric"] and told["floor"] is None and told["depths_m"] is None
    assert "no calibration" in told["remarks"][0]
    assert found.headline()[1].startswith("searched ") and " m (" not in found.headline()[1]
    assert found.scores["flies"].seen.within_1px > 0.97  # the range of disparities is the pictures' own
    assert found.scores["flies"].seen.median_m is None


def test_files_without_a_calibration_name_no_metres(standing, tmp_path):
    (left, right, calib), _ = standing
    from rerun.chunk import RrdReader

    sizes = {}
    for name, more in (("metres", ["--calib", str(calib)]), ("pixels", [])):
        folder = tmp_path / name
        done = CliRunner().invoke(app, ["see", str(left), str(right), *more, "--out", str(folder), "--json"])
        assert done.exit_code == 0, done.output
        labels = [
            label
            for chunk in RrdReader(folder / "recording.rrd").store().stream()
            if str(chunk.entity_path) == "/world/estimated/names"
            for label in chunk.to_record_batch().column("Points3D:labels").to_pylist()[0]
        ]
        unit = pq.read_schema(folder / "flies.parquet").field("x").metadata[b"unit"].decode()
        comment = (folder / "flies.ply").read_bytes().split(b"end_header")[0].decode()
        sizes[name] = any("cm" in label for label in labels), unit, "metres" in comment
    assert sizes == {"metres": (True, "m", True), "pixels": (False, "1", False)}


def test_the_snippet_of_the_page_runs(standing, tmp_path, monkeypatch, capsys):
    (tmp_path / "folder").mkdir()
    for folder in (tmp_path, tmp_path / "folder"):
        for path in standing[0]:
            (folder / path.name).write_bytes(path.read_bytes())
    monkeypatch.chdir(tmp_path)
    (program,) = reader.blocks(reader.text_of("docs/photographs.md"), "python")
    exec(program, {})
    first, second = capsys.readouterr().out.splitlines()[:2]
    assert first.startswith("Floor(up=") and second.startswith("Sighting(photograph=")


def two(folder, left, right, **more):
    return photographed.save(folder, left, right, **more)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda left, right: (right, left), "left and right are swapped"),
        (lambda left, right: (left, np.roll(right, 9, axis=0)), "rows are [89].. px apart: it is not rectified"),
        (lambda left, right: (left, left), "both pictures are the same"),
        (lambda left, right: (left, np.zeros_like(right)), "the right picture is of one colour"),
        (lambda left, right: (left, right[:-10]), "left picture has 320x240 px, the right one 320x230"),
        (lambda left, right: (left[:200], right[:200]), "calib.txt: is for 320x240 px, left has 320x200 px"),
    ],
)
def test_a_pair_that_cannot_be_seen_is_told_in_one_line(tmp_path, change, says):
    left, right, _ = photographed.room()
    files = two(tmp_path, *change(left, right))
    done = CliRunner().invoke(
        app, ["see", *map(str, files[:2]), "--calib", str(files[2]), "--out", str(tmp_path / "o")]
    )
    assert done.exit_code == 2
    assert not (tmp_path / "o").exists()
    with pytest.raises(FlysimError, match=says):
        fs.see(*files[:2], calib=files[2])


def refused(words, says, out):
    done = CliRunner().invoke(app, ["see", *map(str, words), "--out", str(out)])
    assert done.exit_code == 2, done.output
    (line,) = done.stderr.splitlines()
    assert says in line, line
    assert not out.exists()


def test_files_that_are_not_what_they_should_be_are_told_in_one_line(standing, tmp_path):
    (left, right, calib), truth = standing
    nan = tmp_path / "nan.txt"
    nan.write_text(calib.read_text().replace("baseline=100.0", "baseline=nan"), encoding="utf-8")
    refused([left, right, "--calib", nan], "baseline must be a number of millimetres > 0, got 'nan'", tmp_path / "o")
    huge = tmp_path / "huge.ppm"
    huge.write_bytes(b"P6\n10000 10000\n255\n")
    refused([huge, right, "--calib", calib], "10000x10000 px; at most 30000000 are read", tmp_path / "o")
    disparity = np.load(truth)
    wrong = tmp_path / "wrong.pfm"
    wrong.write_bytes(b"Pf\n320 240\n-1.0\n" + np.ascontiguousarray(disparity[::-1], ">f4").tobytes())
    words = [left, right, "--calib", calib, "--truth", wrong]
    refused(words, "are its bytes in the wrong order?", tmp_path / "o")
    right_way = tmp_path / "right.pfm"
    right_way.write_bytes(b"Pf\n320 240\n1.0\n" + np.ascontiguousarray(disparity[::-1], ">f4").tobytes())
    assert fs.see(left, right, calib=calib, truth=right_way).scores["flies"].seen.within_1px > 0.97
    refused([left, right, "--fx", "300"], "needs --fx [px] and --baseline [m]", tmp_path / "o")
    refused([left, right, "--calib", calib, "--depths", "near"], "write NEAREST:FARTHEST in metres", tmp_path / "o")
    refused([left, right, "--depths", "1:3"], "--depths are metres, and without a calibration", tmp_path / "o")
    refused([left, right, "--truth-scale", "4"], "--mask and --truth-scale go with --truth FILE", tmp_path / "o")
    refused([left, right, "--calib", calib, "--engines", "flise"], "Did you mean 'flies'?", tmp_path / "o")
    refused([tmp_path / "none.png", right], "none.png: cannot read the picture", tmp_path / "o")


def test_a_calibration_by_hand_gives_metres(standing, tmp_path):
    (left, right, _), _ = standing
    words = ["--fx", photographed.FOCAL, "--baseline", photographed.BASELINE, "--out", tmp_path / "o", "--json"]
    found = CliRunner().invoke(app, ["see", *map(str, (left, right, *words))])
    assert json.loads(found.stdout)["floor"]["height_m"] == pytest.approx(0.5, abs=0.003)
