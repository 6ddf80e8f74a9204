"""Pictures as bent lenses take them come out as pinholes see them; sizes that do not fit are refused."""

import cv2
import numpy as np
import photographed as ph
import pytest

from flysim.errors import FlysimError
from flysim.geometry.calibration.calibration import Calibration, LevelPair, RawCamera
from flysim.geometry.frames import rotation_rpy, se3
from flysim.photographs.level import Leveller
from flysim.photographs.matches import matches

K = np.array([[ph.FOCAL, 0.0, ph.CX], [0.0, ph.FOCAL, ph.CY], [0.0, 0.0, 1.0]])
BENT = np.array([-0.25, 0.08, 0.001, -0.001, 0.0])
R = rotation_rpy(0.02, -0.01, 0.015)
T = se3(R, R @ (-ph.BASELINE, 0.0, 0.0))
LENSES = (RawCamera(K=K, distortion=BENT, size=(320, 240)), RawCamera(K=K, distortion=BENT, size=(320, 240)))


def as_taken(picture, turn):
    """The picture that a turned camera with a bent lens takes of what a level pinhole sees."""
    v, u = np.mgrid[:240, :320].astype(np.float32)
    rays = cv2.undistortPoints(np.stack([u, v], axis=-1).reshape(-1, 1, 2), K, BENT).reshape(-1, 2)
    seen = np.column_stack([rays, np.ones(len(rays))]) @ turn
    at = (seen[:, :2] / seen[:, 2:] * ph.FOCAL + (ph.CX, ph.CY)).astype(np.float32)
    return cv2.remap(picture, at[:, 0].reshape(240, 320), at[:, 1].reshape(240, 320), cv2.INTER_LINEAR)


@pytest.fixture(scope="module")
def taken():
    left, right, _ = ph.room()
    return as_taken(left, np.eye(3)), as_taken(right, R)


def rows_apart(pair):
    return float(np.median(np.abs(matches(pair.left, pair.right).agreeing().lower)))


def test_bent_and_turned_pictures_become_level(taken):
    before = matches(*taken).agreeing()
    assert float(np.median(np.abs(before.lower))) > 3.0
    made = Leveller(Calibration(name="x", lenses=LENSES, T_right_left=T))("pair", *taken)
    assert made.rectified_here and made.pair.rig.rectified
    assert made.pair.rig.baseline == pytest.approx(np.linalg.norm(T[:3, 3]))
    assert rows_apart(made.pair) < 0.5


def test_as_is_makes_lenses_straight_and_leaves_cameras_as_they_stand(taken):
    made = Leveller(Calibration(name="x", lenses=LENSES, T_right_left=T), as_is=True)("pair", *taken)
    assert not made.pair.rig.rectified
    assert np.allclose(made.pair.rig.T_right_left, T)


def test_pictures_that_are_rectified_already_are_used_as_they_are(taken):
    level = LevelPair(left=K, right=K, baseline=0.1, size=(310, 230), turns=(np.eye(3), np.eye(3)))
    known = Calibration(name="x", lenses=LENSES, T_right_left=T, level=level)
    small = [np.ascontiguousarray(one[:230, :310]) for one in taken]
    made = Leveller(known)("pair", *small)  # by their size
    assert not made.rectified_here and np.array_equal(made.pair.left, small[0])
    assert not Leveller(known, rectified=True)("pair", *small).rectified_here
    assert Leveller(known)("pair", *taken).rectified_here


def test_pictures_of_another_size_are_refused(taken):
    known = Calibration(name="x", lenses=LENSES, T_right_left=T)
    with pytest.raises(FlysimError, match=r"file: is for 320x240 px, pair has 160x120 px"):
        Leveller(known, "file")("pair", *[np.ascontiguousarray(one[::2, ::2]) for one in taken])


def test_cameras_the_wrong_way_round_are_refused(taken):
    turned = se3(np.eye(3), (0.1, 0.0, 0.0))
    with pytest.raises(FlysimError, match="not to the right of the left one"):
        Leveller(Calibration(name="x", lenses=LENSES, T_right_left=turned), "file")("pair", *taken)
    above = se3(np.eye(3), (-0.01, 0.1, 0.0))
    with pytest.raises(FlysimError, match="one camera is above the other"):
        Leveller(Calibration(name="x", lenses=LENSES, T_right_left=above), "file")("pair", *taken)
