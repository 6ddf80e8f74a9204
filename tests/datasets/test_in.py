"""Data sets read back: the same frames, the same truth, the same report; and whatever is wrong is one line."""

import json
import shutil

import numpy as np
import pytest
from PIL import Image

from flysim.common.progress import silent
from flysim.datasets.layout import FORMATS
from flysim.datasets.source import DataSetSource, read_data_set
from flysim.engines.choose import DEFAULT
from flysim.errors import FlysimError, ScenarioError
from flysim.evaluate.evaluator import evaluate
from flysim.foreign.disparity import pfm
from flysim.foreign.folder import inside
from flysim.runs.data import plan_of, see_data
from flysim.runs.see import see
from flysim.sources.source import Replayed


def timeless(report):
    data = report.to_json()
    del data["time_s"]
    for stop in data["stops"]:
        del stop["time_s"]
    return data


@pytest.fixture(scope="module")
def first(taken):
    """The report of the drive itself."""
    source = Replayed(of=taken.sequence, rig=taken.rig, known=taken.truth)
    return timeless(evaluate(see(source, DEFAULT, taken.plan.flies, taken.plan.obstacles, seed=3), taken.truth))


@pytest.mark.parametrize("name", FORMATS.builtin)
def test_what_was_exported_gives_the_same_report(taken, first, name):
    data = read_data_set(taken.folders[name])
    findings, truth = see_data(data, plan_of(data), DEFAULT, progress=silent)
    assert truth is not None
    assert timeless(evaluate(findings, truth)) == first
    assert first["calibration"] == {"row_shift_px": 0.5, "baseline_error": 0.01}
    for frame, before in zip(findings.sequence.frames, taken.sequence.frames, strict=True):
        assert np.array_equal(frame.pair.left, before.pair.left) and np.array_equal(frame.pair.right, before.pair.right)
        np.testing.assert_allclose(frame.T_world_left, before.T_world_left, atol=1e-12)
        assert (frame.index, frame.time) == (before.index, before.time)


def test_of_its_frames_one_in_so_many(taken):
    data = read_data_set(taken.folders["kitti"], every=2)
    source = DataSetSource(data, seed=0)
    (frame,) = source.frames()
    truth = source.truth()
    assert (frame.index, source.planned, len(truth.stops)) == (0, 1, 1)
    assert source.sequence().seed == 0


def test_settings_are_those_it_was_exported_with_unless_said_otherwise(taken):
    data = read_data_set(taken.folders["tum"])
    assert plan_of(data).flies == taken.plan.flies
    assert (plan_of(data).seed, plan_of(data, seed=8).seed) == (3, 8)
    assert plan_of(data, ["flies.population=500"]).flies.population == 500
    with pytest.raises(ScenarioError, match=r"--set world=yard: of a data set only flies.KEY and obstacles.KEY"):
        plan_of(data, ["world=yard"])
    with pytest.raises(ScenarioError, match=r"unknown key 'flies.populatoin'. Did you mean 'population'?"):
        plan_of(data, ["flies.populatoin=500"])


def test_a_set_without_truth_is_seen_all_the_same(taken, tmp_path):
    folder = taken.copy("euroc", tmp_path / "bare")
    shutil.rmtree(folder / "truth")
    data = read_data_set(folder)
    findings, truth = see_data(data, plan_of(data), "chance", progress=silent)
    assert truth is None and len(findings.seen) == 2


def files(folder, pattern):
    found = sorted(folder.glob(pattern))
    assert found, pattern
    return found


def cut(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def replaced(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def poses_short(path):
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:-1]))


def nan_in(path, column):
    lines = path.read_text().splitlines()
    separator = "," if "," in lines[-1] else " "
    words = lines[-1].split(separator)
    words[column] = "nan"
    path.write_text("\n".join([*lines[:-1], separator.join(words)]) + "\n")


def other_size(path):
    with Image.open(path) as image:
        small = image.resize((80, 60))
    small.save(path)


def nan_depth(path):
    depth = np.full((120, 160), 2.0, np.float32)
    depth[3, 4] = np.nan
    path.write_bytes(pfm(depth))


def many_links(path):
    Image.fromarray(np.full((120, 160), 999, np.uint16)).save(path)


def mirrored(path):
    data = json.loads(path.read_text())
    data["T_base_left"][0] = [-x for x in data["T_base_left"][0]]
    path.write_text(json.dumps(data))


DAMAGES = {
    "kitti: a picture that ends too soon": ("sequences/00/image_2/000001.png", cut, "cannot read the image"),
    "kitti: a picture that is missing": (
        "sequences/00/image_3/000001.png",
        lambda p: p.unlink(),
        "2 pictures in image_2, 1 in",
    ),
    "kitti: a pose too few": ("poses/00_believed.txt", poses_short, "2 pairs of pictures, but 1 poses"),
    "kitti: a time too few": ("sequences/00/times.txt", poses_short, "2 pairs of pictures, but 1 times"),
    "kitti: NaN in a pose": ("poses/00_believed.txt", lambda p: nan_in(p, 3), "line 2 is no row of 12 finite numbers"),
    "kitti: no rotation": (
        "poses/00_believed.txt",
        lambda p: p.write_text("1 2 3 4 5 6 7 8 9 1 2 3\n" * 2),
        "no rotation",
    ),
    "kitti: a picture of another size": (
        "sequences/00/image_2/000000.png",
        other_size,
        "frame 0: the left image is 80x60 px",
    ),
    "euroc: NaN in a pose": ("mav0/odometry0/data.csv", lambda p: nan_in(p, 2), "is no row of 8 or 17 finite numbers"),
    "euroc: a pose too few": ("mav0/odometry0/data.csv", poses_short, "no pose within 0.02 s of the picture at"),
    "euroc: out of the folder": (
        "mav0/cam0/data.csv",
        lambda p: replaced(p, ",00000", ",../../../../00000"),
        "leads out of the folder",
    ),
    "euroc: no pictures": ("mav0/cam1/data.csv", poses_short, "2 pictures in cam0, 1 in cam1"),
    "tum: out of the folder": (
        "left.txt",
        lambda p: replaced(p, "left/000000.png", "/etc/passwd"),
        "leads out of the folder",
    ),
    "tum: a quaternion of 0": (
        "groundtruth_believed.txt",
        lambda p: p.write_text("0 0 0 0 0 0 0 0\n9 0 0 0 0 0 0 1\n"),
        "quaternion of length 0",
    ),
    "middlebury: a calibration gone": ("000001/calib.txt", lambda p: p.unlink(), "flysim.json tells of 2 frames"),
    "middlebury: NaN in a calibration": (
        "000000/calib.txt",
        lambda p: replaced(p, "baseline=", "baseline=nan "),
        "baseline must",
    ),
    "mcap: a bag that ends too soon": ("bag/*.mcap", cut, "cannot read the bag"),
    "tum: a depth with a NaN": ("truth/depth_left/000001.pfm", nan_depth, "it has a NaN"),
    "tum: a depth that ends too soon": ("truth/depth_right/000000.pfm", cut, "bytes, not 160x120 numbers"),
    "tum: a mask of nothing": ("truth/mask_left/000000.png", many_links, "it has the value 999"),
    "tum: a mask that ends too soon": ("truth/mask_left/000000.png", cut, "cannot read the mask"),
    "tum: a frame's truth gone": ("truth/frames/000001.json", lambda p: p.unlink(), "cannot read the truth of a frame"),
    "tum: no JSON": ("truth/calibration.json", cut, "damaged"),
    "tum: NaN in JSON": (
        "truth/frames/000001.json",
        lambda p: replaced(p, '"sim_time": ', '"sim_time": NaN, "x": '),
        "NaN is no number",
    ),
    "tum: a mirror": ("flysim.json", lambda p: mirrored(p), "no rotation"),
    "tum: another version": ("flysim.json", lambda p: replaced(p, '"flysim": 1', '"flysim": 2'), "of version 2, not 1"),
    "tum: an unknown format": (
        "flysim.json",
        lambda p: replaced(p, '"tum"', '"tim"'),
        "no format 'tim'. Did you mean 'tum'?",
    ),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_whatever_is_damaged_is_one_line(taken, tmp_path, damage):
    pattern, harm, why = DAMAGES[damage]
    folder = taken.copy(damage.partition(":")[0], tmp_path / "set")
    harm(files(folder, pattern)[0])
    with pytest.raises(FlysimError) as refused:
        data = read_data_set(folder)
        source = DataSetSource(data, seed=0)
        list(source.frames())
        source.truth()
    assert why in str(refused.value) and "\n" not in str(refused.value)


def test_a_link_out_of_the_folder_is_not_followed(taken, tmp_path):
    folder = taken.copy("kitti", tmp_path / "set")
    secret = tmp_path / "secret.png"
    picture = folder / "sequences/00/image_2/000000.png"
    picture.rename(secret)
    picture.symlink_to(secret)
    with pytest.raises(FlysimError, match="leads out of the folder"):
        list(DataSetSource(read_data_set(folder), seed=0).frames())
    for name in ("../x", "/x", "a/../../x", "a\0b"):
        with pytest.raises(FlysimError, match="leads out of the folder"):
            inside(folder, name)
    assert inside(folder, "poses/../poses/00.txt").is_file()


def test_no_data_set_is_told(tmp_path):
    for folder, why in ((tmp_path, "no data set of a known format: kitti, euroc"), (tmp_path / "no", "no such folder")):
        with pytest.raises(FlysimError, match=why):
            read_data_set(folder)


def test_too_much_at_once_is_refused_with_what_to_do(taken, monkeypatch):
    monkeypatch.setattr("flysim.datasets.source.MAX_BYTES", 160 * 120 * 22 + 1)
    with pytest.raises(FlysimError, match=r"more than fits. Take one in 2: --every 2"):
        read_data_set(taken.folders["kitti"])
    assert len(read_data_set(taken.folders["kitti"], every=2).rows) == 1
