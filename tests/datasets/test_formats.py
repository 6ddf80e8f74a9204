"""Each format by its own client: what other programs find in an exported folder is what was taken and what was true."""

import csv
import json

import cv2
import numpy as np
import pytest

from flysim.datasets.layout import FORMATS, layout_of
from flysim.foreign.disparity import read_map
from flysim.geometry.frames import inverse, transform
from flysim.geometry.read_pair import read_pair


def rgb(path):
    image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    assert image is not None, path
    return image[..., ::-1]


def same_way(trajectory, poses):
    """Poses of evo against ours."""
    assert len(trajectory.poses_se3) == len(poses)
    for got, T in zip(trajectory.poses_se3, poses, strict=True):
        np.testing.assert_allclose(got, T, atol=1e-9)


def left_poses(taken):
    return (
        [frame.T_world_left for frame in taken.sequence.frames],
        [stop.views[0].T_world_optical for stop in taken.truth.stops],
    )


@pytest.mark.parametrize("name", FORMATS.builtin)
def test_a_folder_is_known_by_what_is_in_it(taken, name):
    assert layout_of(taken.folders[name]) == name


def test_kitti_as_pykitti_reads_it(taken):
    """Its files by pykitti's rules: `P2`, `P3` of calib.txt give focal length and baseline, pictures go by number."""
    sequence = taken.folders["kitti"] / "sequences" / "00"
    for name, rig in (("calib.txt", taken.rig), ("calib_true.txt", taken.true_rig)):
        lines = dict(line.split(":", 1) for line in (sequence / name).read_text().splitlines())
        P = {key: np.array(value.split(), float).reshape(3, 4) for key, value in lines.items()}
        assert P.keys() == {"P0", "P1", "P2", "P3", "Tr"}
        np.testing.assert_array_equal(P["P2"][:, :3], rig.left.K)
        assert -P["P3"][0, 3] / P["P3"][0, 0] == pytest.approx(rig.baseline)
        assert P["P3"][1, 2] == rig.right.cy
    assert taken.true_rig.right.cy - taken.rig.right.cy == 0.5
    assert taken.rig.baseline == pytest.approx(1.01 * taken.true_rig.baseline)
    times = np.loadtxt(sequence / "times.txt")
    assert times.tolist() == [frame.time for frame in taken.sequence.frames]
    for k, (frame, stop) in enumerate(zip(taken.sequence.frames, taken.truth.stops, strict=True)):
        assert np.array_equal(rgb(sequence / f"image_2/{k:06d}.png"), frame.pair.left)
        assert np.array_equal(rgb(sequence / f"image_3/{k:06d}.png"), frame.pair.right)
        depth = cv2.imread(str(sequence / f"depth_2/{k:06d}.png"), cv2.IMREAD_UNCHANGED)
        assert depth.dtype == np.uint16
        off = np.where(depth > 0, depth / 256.0 - stop.views[0].depth, 0.0)
        assert np.abs(off).max() <= 0.5 / 256.0 + 1e-6
        assert (depth > 0).mean() > 0.5


def test_kitti_poses_by_evo(taken):
    evo = pytest.importorskip("evo.tools.file_interface", reason="make test installs evo")
    for name, poses in zip(("00_believed", "00"), left_poses(taken), strict=True):
        trajectory = evo.read_kitti_poses_file(taken.folders["kitti"] / "poses" / f"{name}.txt")
        same_way(trajectory, [inverse(poses[0]) @ T for T in poses])


def test_euroc_by_evo_and_its_tables(taken):
    evo = pytest.importorskip("evo.tools.file_interface", reason="make test installs evo")
    mav = taken.folders["euroc"] / "mav0"
    true = [stop.T_world_base for stop in taken.truth.stops]
    believed = [frame.T_world_base for frame in taken.sequence.frames]
    for name, poses in (("state_groundtruth_estimate0", true), ("odometry0", believed)):
        trajectory = evo.read_euroc_csv_trajectory(mav / name / "data.csv")
        same_way(trajectory, poses)
        assert trajectory.timestamps == pytest.approx([f.time for f in taken.sequence.frames], abs=1e-9)
    for eye, side in (("cam0", "left"), ("cam1", "right")):
        with (mav / eye / "data.csv").open() as rows:
            listed = [row for row in csv.reader(rows) if not row[0].startswith("#")]
        for (stamp, name), frame in zip(listed, taken.sequence.frames, strict=True):
            assert int(stamp) == round(frame.time * 1e9)
            assert np.array_equal(rgb(mav / eye / "data" / name), getattr(frame.pair, side))
    yaml = pytest.importorskip("yaml")
    for name, rig in (("sensor.yaml", taken.rig), ("sensor_true.yaml", taken.true_rig)):
        told = [yaml.safe_load((mav / eye / name).read_text()) for eye in ("cam0", "cam1")]
        T = [np.array(one["T_BS"]["data"]).reshape(4, 4) for one in told]
        np.testing.assert_allclose(inverse(T[1]) @ T[0], rig.T_right_left, atol=1e-12)
        right = rig.right
        assert told[1]["intrinsics"] == [right.fx, right.fy, right.cx, right.cy]
        assert told[1]["resolution"] == [160, 120]


def test_tum_by_evo_and_opencv(taken):
    evo = pytest.importorskip("evo.tools.file_interface", reason="make test installs evo")
    folder = taken.folders["tum"]
    for name, poses in zip(("groundtruth_believed.txt", "groundtruth.txt"), left_poses(taken), strict=True):
        same_way(evo.read_tum_trajectory_file(folder / name), poses)
    for name, rig in (("calibration.yml", taken.rig), ("calibration_true.yml", taken.true_rig)):
        storage = cv2.FileStorage(str(folder / name), cv2.FILE_STORAGE_READ)
        for key, value in (("K1", rig.left.K), ("K2", rig.right.K), ("T", rig.T_right_left[:3, 3:])):
            np.testing.assert_array_equal(storage.getNode(key).mat(), value)
        assert storage.getNode("image_width").real() == 160
        assert storage.getNode("P2").empty() == (not rig.rectified)
        storage.release()
    rows = (folder / "left.txt").read_text().splitlines()[1:]
    for row, frame in zip(rows, taken.sequence.frames, strict=True):
        when, name = row.split()
        assert float(when) == frame.time
        assert np.array_equal(rgb(folder / name), frame.pair.left)
    depth = cv2.imread(str(folder / "depth/000000.png"), cv2.IMREAD_UNCHANGED) / 5000.0
    true = taken.truth.stops[0].views[0].depth
    assert np.abs(np.where(depth > 0, depth - true, 0.0)).max() <= 0.5 / 5000.0 + 1e-6


def test_middlebury_by_read_pair_and_opencv(taken):
    frame, stop = taken.sequence.frames[1], taken.truth.stops[1]
    scene = taken.folders["middlebury"] / "000001"
    pair = read_pair(scene / "im0.png", scene / "im1.png", calib=scene / "calib.txt")
    assert np.array_equal(pair.right, frame.pair.right)
    assert pair.rig.right == taken.rig.right and pair.rig.baseline == pytest.approx(taken.rig.baseline, rel=1e-15)
    read = cv2.imread(str(scene / "disp0.pfm"), cv2.IMREAD_UNCHANGED)
    ours = read_map(scene / "disp0.pfm", "disparity")
    assert np.array_equal(np.nan_to_num(np.where(np.isfinite(read), read, np.nan)), np.nan_to_num(ours))
    left, right = stop.views
    v, u = np.nonzero(left.link >= 0)
    points = left.camera.unproject(np.stack([u, v], axis=1), left.depth[v, u])
    there = right.camera.project(transform(inverse(right.T_world_optical) @ left.T_world_optical, points))
    np.testing.assert_allclose(read[v, u], u - there[:, 0], atol=1e-4)
    other = cv2.imread(str(scene / "disp1.pfm"), cv2.IMREAD_UNCHANGED)
    seen = taken.truth.sights[1].seen[v, u]
    back = other[np.rint(there[seen, 1]).astype(int), np.rint(there[seen, 0]).astype(int)]
    assert np.median(np.abs(back - read[v, u][seen])) < 0.05


def test_a_bag_by_the_mcap_package(taken):
    reader = pytest.importorskip("mcap.reader", reason="make test installs mcap")
    (path,) = (taken.folders["mcap"] / "bag").glob("*.mcap")
    with path.open("rb") as stream:
        counts = {}
        for schema, channel, _ in reader.make_reader(stream).iter_messages():
            counts.setdefault(channel.topic, [schema.name, 0])[1] += 1
    assert counts["/stereo/left/image"] == ["sensor_msgs/msg/Image", 2]
    assert counts["/ground_truth/obstacles"] == ["visualization_msgs/msg/MarkerArray", 2]
    assert counts["/tf_static"] == ["tf2_msgs/msg/TFMessage", 1]
    assert {topic for topic in counts if topic.startswith("/stereo/right")} == {
        *("/stereo/right/image", "/stereo/right/camera_info")
    }


def test_a_bag_by_rosbags(taken):
    rosbags = pytest.importorskip("rosbags.highlevel", reason="make test installs rosbags")
    frame, stop = taken.sequence.frames[0], taken.truth.stops[0]
    first = {}
    with rosbags.AnyReader([taken.folders["mcap"] / "bag"]) as reader:
        for connection, stamp, raw in reader.messages():
            if connection.topic not in first:
                first[connection.topic] = reader.deserialize(raw, connection.msgtype), stamp
    image, stamp = first["/stereo/left/image"]
    assert stamp == round(frame.time * 1e9)
    assert np.array_equal(image.data.reshape(120, 160, 3), frame.pair.left)
    depth = first["/ground_truth/left/depth"][0].data.view(np.float32).reshape(120, 160)
    assert np.array_equal(depth, stop.views[0].depth)
    masks = first["/ground_truth/left/instances"][0].data.view(np.uint16).reshape(120, 160)
    assert np.array_equal(masks.astype(int) - 1, stop.views[0].link)
    P = first["/stereo/right/camera_info"][0].p.reshape(3, 4)
    assert -P[0, 3] / P[0, 0] == pytest.approx(taken.rig.baseline)
    position = first["/ground_truth/odom"][0].pose.pose.position
    assert (position.x, position.y) == pytest.approx(stop.T_world_base[:2, 3])
    (box,) = [mark for mark in first["/ground_truth/obstacles"][0].markers if mark.text == "box"]
    true = next(one for one in taken.truth.obstacles if one.name == "box")
    assert (box.scale.x, box.scale.y, box.scale.z) == pytest.approx(true.size)


def test_a_picture_shows_what_is_in_it(taken):
    sheet = rgb(taken.folders["euroc"] / "preview.png")
    left, right = taken.sequence.frames[0].pair.left, taken.sequence.frames[0].pair.right
    assert sheet.shape == (2 * 120 + 4, 2 * 160 + 4, 3)
    assert np.array_equal(sheet[:120, :160], left) and np.array_equal(sheet[:120, -160:], right)
    link = taken.truth.stops[0].views[0].link
    colours = {tuple(np.unique(sheet[-120:, -160:][link == i], axis=0).ravel()) for i in np.unique(link)}
    assert len(colours) == len(np.unique(link)) and all(len(one) == 3 for one in colours)


def test_what_is_true_is_there_for_everybody(taken):
    """Depth by OpenCV, masks as a 16-bit PNG, obstacles with their dimensions: the same in every format."""
    folder = taken.folders["kitti"] / "truth"
    world = json.loads((folder / "world.json").read_text())
    for k, stop in enumerate(taken.truth.stops):
        for side, view in zip(("left", "right"), stop.views, strict=True):
            depth = cv2.imread(str(folder / f"depth_{side}" / f"{k:06d}.pfm"), cv2.IMREAD_UNCHANGED)
            assert np.array_equal(depth, view.depth)
            masks = cv2.imread(str(folder / f"mask_{side}" / f"{k:06d}.png"), cv2.IMREAD_UNCHANGED)
            assert np.array_equal(masks.astype(int) - 1, view.link)
        told = json.loads((folder / "frames" / f"{k:06d}.json").read_text())
        assert [one["name"] for one in told["obstacles"]] == [one.name for one in taken.truth.obstacles]
        for one, true in zip(told["obstacles"], taken.truth.obstacles, strict=True):
            assert (one["size"], one["shape"]) == (true.size.tolist(), true.shape)
            assert [world["links"][i]["model"] for i in one["links"]] == [
                taken.truth.world.links[i].model for i in true.links
            ]
        np.testing.assert_array_equal(told["T_world_left"], stop.views[0].T_world_optical)
    assert sum(one["visible_pixels"] for one in told["obstacles"]) > 50
