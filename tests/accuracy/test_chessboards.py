"""Photographs of a 9x6 board by a pair whose figures nobody knows: what is left over, and flies on the board."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from flysim.calibration.board import parse_board
from flysim.calibration.images import image_sets, look_at
from flysim.calibration.result import calibrated
from flysim.calibration.undistort import Straight
from flysim.flies.evolution import evolve
from flysim.flies.parameters import FlyParams
from flysim.foreign.image import read_image
from flysim.geometry.triangulate import triangulate

pytestmark = pytest.mark.accuracy
PHOTOGRAPHS = Path(__file__).parents[3] / "shared" / "data" / "chessboards"
BOARD = parse_board("9x6", 0.025)  # the true side is not stated


@pytest.fixture(scope="module")
def chessboards():
    if not PHOTOGRAPHS.is_dir():
        pytest.skip(f"the photographs are not here: {PHOTOGRAPHS}")
    sets = image_sets([str(PHOTOGRAPHS)])
    return sets, calibrated(BOARD, look_at(sets, BOARD))


def test_fourteen_pairs_leave_a_fifth_of_a_pixel(chessboards):
    _, found = chessboards
    assert len(found.views.names) == 14 and found.views.left_out == ()
    assert found.solved.rms < 0.25 and max(eye.rms for eye in found.solved.eyes) < 0.25
    assert found.solved.baseline / BOARD.square == pytest.approx(3.33, abs=0.03)
    assert found.solved.eyes[0].info.camera.fx == pytest.approx(533.6, abs=2.0)
    assert found.verdict == "good"


def test_flies_sit_on_the_board_of_straight_images(chessboards):
    (lefts, rights), found = chessboards
    left, right = found.solved.eyes
    straight = Straight(left.info, right.info)
    off = []
    for k in (1, 6, 10):
        corners = [
            cv2.undistortPoints(eye.used[k].uv.reshape(-1, 1, 2), eye.info.K, eye.info.D, P=camera.K).reshape(-1, 2)
            for eye, camera in ((left, straight.rig.left), (right, straight.rig.right))
        ]
        points = triangulate(straight.rig, *corners)
        middle = points.mean(axis=0)
        normal = np.linalg.svd(points - middle)[2][2]
        # Where the board is held is known to half a metre: a pattern repeats, and beyond that one square is another.
        params = FlyParams(population=5000, min_depth=0.2, max_depth=0.5)
        pair = straight.pair(read_image(lefts[k]), read_image(rights[k]))
        swarm = evolve(pair, params, rng=np.random.default_rng(7))
        hull = cv2.convexHull(corners[0].astype(np.float32))
        on = np.array([cv2.pointPolygonTest(hull, (float(u), float(v)), False) >= 0 for u, v in swarm.uv])
        camera = straight.rig.left
        rays = np.c_[(swarm.uv[on] - (camera.cx, camera.cy)) / (camera.fx, camera.fy), np.ones(on.sum())]
        _, expected = straight.rig.project(rays * ((middle @ normal) / (rays @ normal))[:, None])
        off.append(np.linalg.norm(swarm.uv_right[on] - expected, axis=1))
    off = np.concatenate(off)
    assert len(off) > 500
    assert np.mean(off < 1.0) > 0.85
