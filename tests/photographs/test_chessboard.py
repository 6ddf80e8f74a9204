"""A thing of known size in photographs: a chessboard, by two cameras with bent lenses."""

from pathlib import Path

import cv2
import numpy as np
import pytest

import flysim as fs

DATA = Path(__file__).parents[3] / "shared" / "data" / "chessboards"
SIDE = 0.03  # [m] a square is taken to have, here and in the calibration
# What cv2.stereoCalibrate makes of the 14 pairs (deviation 0.22 px).
CALIBRATION = {
    "M1": [[532.813, 0.0, 341.758], [0.0, 532.971, 234.081], [0.0, 0.0, 1.0]],
    "D1": [[-0.282425, 0.044019, 0.0011195, -0.00027302, 0.1266068]],
    "M2": [[537.159, 0.0, 326.923], [0.0, 536.738, 249.124], [0.0, 0.0, 1.0]],
    "D2": [[-0.298764, 0.1560105, -0.00078168, 0.00020326, -0.0720936]],
    "R": [
        [0.99998611760, 0.00375356634, 0.00369801845],
        [-0.00372792387, 0.99996912993, -0.00691677421],
        [-0.00372386686, 0.00690289226, 0.99996924097],
    ],
    "T": [[-0.09983067], [0.00112957], [0.00036659]],
}


def board_plane(points, rng):
    """Middle and normal of the plane that most flies lie on: on a chessboard some sit a square beside."""
    best = np.zeros(len(points), bool)
    for _ in range(400):
        a, b, c = points[rng.choice(len(points), 3, replace=False)]
        n = np.cross(b - a, c - a)
        n /= max(np.linalg.norm(n), 1e-12)
        on = np.abs((points - a) @ n) < 0.003 * points[:, 2]
        best = on if on.sum() > best.sum() else best
    middle = points[best].mean(axis=0)
    return middle, np.linalg.svd(points[best] - middle)[2][2]


@pytest.mark.parametrize("number", ["02", "05", "13"])
def test_the_width_of_a_board_is_right_to_one_percent(tmp_path, number):
    if not DATA.is_dir():
        pytest.skip(f"the chessboards are not here: {DATA}")
    storage = cv2.FileStorage(str(tmp_path / "stereo.yml"), cv2.FILE_STORAGE_WRITE)
    for name, value in CALIBRATION.items():
        storage.write(name, np.array(value))
    storage.release()
    left, right = DATA / f"left{number}.jpg", DATA / f"right{number}.jpg"
    seen = fs.see(left, right, calib=tmp_path / "stereo.yml", params=fs.SeeParams(depths=(0.2, 1.0)))
    pair, swarm = seen.photograph.pair, seen.findings.seen[0].swarm
    found, corners = cv2.findChessboardCorners(cv2.cvtColor(pair.left, cv2.COLOR_RGB2GRAY), (9, 6))
    assert found
    corners = np.reshape(corners, (-1, 2)).astype(np.float32)
    outline = cv2.convexHull(corners)
    on = np.array([cv2.pointPolygonTest(outline, (float(u), float(v)), False) >= 0 for u, v in swarm.uv])
    middle, n = board_plane(swarm.points[on].astype(float), np.random.default_rng(0))
    rays = pair.rig.left.unproject(corners.astype(float), np.ones(len(corners)))
    places = (rays * ((middle @ n) / (rays @ n))[:, None]).reshape(6, 9, 3)
    width = np.linalg.norm(places[:, 8] - places[:, 0], axis=1).mean()
    assert width == pytest.approx(8.0 * SIDE, rel=0.01)
