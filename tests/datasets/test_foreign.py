"""Sets without flysim.json, as others make them: calibration and poses are the format's, pictures are made level."""

import shutil

import cv2
import numpy as np
import pytest

from flysim.common.progress import silent
from flysim.datasets.euroc import sensor_text
from flysim.datasets.layout import save_picture
from flysim.datasets.source import DataSetSource, read_data_set
from flysim.errors import FlysimError
from flysim.geometry.frames import R_BODY_OPTICAL, inverse, rotation_rpy, se3
from flysim.runs.data import plan_of, see_data


def anonymous(taken, name, folder):
    taken.copy(name, folder)
    shutil.rmtree(folder / "truth")
    (folder / "flysim.json").unlink()
    return folder


@pytest.mark.parametrize("name", ["kitti", "euroc", "tum", "middlebury", "mcap"])
def test_what_the_format_says_is_what_was_believed(taken, tmp_path, name):
    data = read_data_set(anonymous(taken, name, tmp_path / "set"), height=0.25)
    assert (data.about, data.known, data.name) == (None, False, "set")
    assert data.rig.left == taken.rig.left and data.rig.right == taken.rig.right
    np.testing.assert_allclose(data.rig.T_right_left, taken.rig.T_right_left, atol=1e-12)
    frames = list(DataSetSource(data, seed=0).frames())
    for frame, before in zip(frames, taken.sequence.frames, strict=True):
        assert np.array_equal(frame.pair.left, before.pair.left) and np.array_equal(frame.pair.right, before.pair.right)
    moved = inverse(frames[0].T_world_left) @ frames[1].T_world_left
    if name == "middlebury":  # it tells no poses
        np.testing.assert_array_equal(moved, np.eye(4))
    elif name != "mcap":  # there poses are base_link's, which the pictures' calibration does not know
        before = [frame.T_world_left for frame in taken.sequence.frames]
        np.testing.assert_allclose(moved, inverse(before[0]) @ before[1], atol=1e-12)
    if name == "kitti":
        np.testing.assert_allclose(frames[0].T_world_left, se3(R_BODY_OPTICAL, (0.0, 0.0, 0.25)), atol=1e-12)


def test_it_is_seen_and_nobody_knows_its_truth(taken, tmp_path):
    data = read_data_set(anonymous(taken, "kitti", tmp_path / "set"), height=0.25)
    plan = plan_of(data, ["flies.population=400", "flies.max_iterations=6"])
    findings, truth = see_data(data, plan, "flies", progress=silent)
    assert truth is None and len(findings.cloud.points) > 50
    assert (findings.sequence.name, findings.sequence.renderer) == ("set", "none")


@pytest.mark.parametrize("name", ["kitti", "euroc", "middlebury"])
def test_the_floor_is_found_where_nobody_says_how_high_the_cameras_stand(taken, tmp_path, name):
    data = read_data_set(anonymous(taken, name, tmp_path / "set"))
    true = taken.sequence.frames[0].T_world_left
    findings, _ = see_data(data, plan_of(data, ["flies.population=1500"]), "flies", progress=silent)
    found = findings.seen[0].frame.T_world_left
    assert found[2, 3] == pytest.approx(true[2, 3], rel=0.03)
    # Up and down are the floor's too, where poses are told from the first one; else they are the poses'.
    np.testing.assert_allclose(found[2, :3], true[2, :3], atol=0.02)
    (note,) = [note for note in findings.sequence.notes if "floor" in note]
    assert f"{found[2, 3]:.3g} m below" in note


def test_a_height_that_is_given_is_taken(taken, tmp_path):
    data = read_data_set(anonymous(taken, "kitti", tmp_path / "set"), height=0.25)
    findings, _ = see_data(data, plan_of(data, ["flies.population=400"]), "flies", progress=silent)
    np.testing.assert_allclose(findings.seen[0].frame.T_world_left, se3(R_BODY_OPTICAL, (0.0, 0.0, 0.25)), atol=1e-12)


def test_where_no_floor_is_seen_that_is_said(taken, tmp_path):
    folder = anonymous(taken, "kitti", tmp_path / "set")
    for eye in ("image_2", "image_3"):
        for path in (folder / "sequences/00" / eye).glob("*.png"):
            save_picture(path, cv2.imread(str(path))[::-1, :, ::-1].copy())  # what was the floor is a ceiling
    findings, _ = see_data((data := read_data_set(folder)), plan_of(data), "flies", progress=silent)
    assert findings.seen[0].frame.T_world_left[2, 3] == 0.0
    assert any("no floor was found up to 4 m" in note for note in findings.sequence.notes)


def test_lenses_that_bend_and_cameras_that_squint_are_made_level(taken, tmp_path):
    """Pictures warped as such lenses would take them come back as they were, and the pose with them."""
    folder = anonymous(taken, "euroc", tmp_path / "set")
    rig, size = taken.rig, (160, 120)
    bend = np.array([-0.1, 0.02, 0.0, 0.0])
    turns = [rotation_rpy(0.01, 0.02, -0.015), rotation_rpy(-0.015, 0.01, 0.01)]  # lens <- level
    T_base = [taken.sequence.frames[0].T_base_left]
    T_base.append(T_base[0] @ inverse(rig.T_right_left))
    for camera, pinhole, turn, T in zip(("cam0", "cam1"), (rig.left, rig.right), turns, T_base, strict=True):
        text = sensor_text(pinhole, T @ se3(turn.T, np.zeros(3)), None)
        text = text.replace("coefficients: [0.0, 0.0, 0.0, 0.0]", f"coefficients: {bend.tolist()}")
        (folder / "mav0" / camera / "sensor.yaml").write_text(text)
        # Where each pixel of the lens looks in the level picture.
        u, v = np.meshgrid(np.arange(160.0), np.arange(120.0))
        straight = cv2.undistortPoints(
            np.stack([u.ravel(), v.ravel()], axis=1)[:, None], pinhole.K, bend, R=turn.T, P=pinhole.K
        ).reshape(120, 160, 2)
        for path in (folder / "mav0" / camera / "data").glob("*.png"):
            image = cv2.imread(str(path))[..., ::-1]
            x, y = (np.ascontiguousarray(straight[..., k], np.float32) for k in (0, 1))
            warped = cv2.remap(image, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
            save_picture(path, np.ascontiguousarray(warped))
    data = read_data_set(folder)
    assert data.rig.rectified and data.rig.baseline == pytest.approx(rig.baseline, rel=1e-6)
    frames = list(DataSetSource(data, seed=0).frames())
    frame, before = frames[0], taken.sequence.frames[0]
    # What the level left camera sees at a pixel, the true one sees at another: by rays, through the poses.
    uv = np.stack([g.ravel() for g in np.meshgrid(np.arange(40, 120, 4.0), np.arange(30, 90, 4.0))], axis=1)
    rays = data.rig.left.unproject(uv, np.full(len(uv), 1.0)) @ frame.T_world_left[:3, :3].T
    there = before.pair.rig.left.project(rays @ before.T_world_left[:3, :3])
    seen = cv2.remap(before.pair.left, *(there.astype(np.float32)[:, k : k + 1] for k in (0, 1)), cv2.INTER_LINEAR)
    got = frame.pair.left[uv[:, 1].astype(int), uv[:, 0].astype(int)]
    assert np.median(np.abs(seen[:, 0].astype(int) - got.astype(int))) <= 3.0
    assert size == (data.rig.left.width, data.rig.left.height)


def test_grey_pictures_and_a_sequence_alone(taken, tmp_path):
    folder = anonymous(taken, "kitti", tmp_path / "set") / "sequences/00"
    for colour, grey in (("image_2", "image_0"), ("image_3", "image_1")):
        for path in (folder / colour).glob("*.png"):
            (folder / grey).mkdir(exist_ok=True)
            cv2.imwrite(str(folder / grey / path.name), cv2.imread(str(path), cv2.IMREAD_GRAYSCALE))
        shutil.rmtree(folder / colour)
    data = read_data_set(folder)
    (first, _) = DataSetSource(data, seed=0).frames()
    assert np.ptp(first.pair.left, axis=2).max() == 0 and first.pair.left.std() > 10.0
    assert data.rig.baseline == pytest.approx(taken.rig.baseline)


DAMAGES = {
    "kitti": ("sequences/00/calib.txt", "P3: ", "P3: nan ", "must be"),
    "euroc": ("mav0/cam1/sensor.yaml", "intrinsics: [", "intrinsics: [nan, ", "intrinsics must be"),
    "tum": ("calibration.yml", "data: [ ", "data: [ .nan, ", "calibration.yml"),
    "middlebury": ("000000/calib.txt", "cam0=[", "cam0=[nan ", "cam0"),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_a_calibration_with_a_nan_is_one_line(taken, tmp_path, name):
    folder = anonymous(taken, name, tmp_path / "set")
    where, old, new, why = DAMAGES[name]
    path = folder / where
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(FlysimError) as refused:
        read_data_set(folder)
    assert why in str(refused.value) and "\n" not in str(refused.value)


def test_without_a_calibration_it_is_told(taken, tmp_path):
    folder = anonymous(taken, "tum", tmp_path / "set")
    (folder / "calibration.yml").unlink()
    with pytest.raises(FlysimError, match="no calibration of rectified pictures"):
        read_data_set(folder)
