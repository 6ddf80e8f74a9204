"""A camera that moved ahead: the epipole lies in the image, and what is near it tells little."""

import numpy as np
import pytest

from flysim.geometry.frames import pose6
from flysim.geometry.rig import StereoRig


@pytest.fixture(scope="module")
def ahead(stage):
    rig = StereoRig(left=stage.CAMERA, right=stage.CAMERA, T_right_left=pose6(0.0, 0.0, 0.27, 0.0, 0.0, 0.0))
    walls = [stage.Plane((0.0, 0.0, 1.0), 2.2), stage.Plane((0.0, 0.5, 0.9), 1.6, 2)]
    pair = stage.photograph(rig, walls)
    return rig, walls, stage.run(pair, population=2000)


def from_epipole(rig, swarm):
    return np.linalg.norm(swarm.uv - (rig.left.cx, rig.left.cy), axis=1)


def test_flies_lie_on_the_surfaces(stage, ahead):
    rig, walls, swarm = ahead
    error = stage.disparity_error(swarm, rig, walls)
    error = error[np.isfinite(error)]
    assert len(error) > 400
    assert np.median(error) < 0.06 and np.mean(error < 1.0) > 0.98


def test_near_the_epipole_there_are_few_and_they_say_how_unsure_they_are(ahead):
    rig, _, swarm = ahead
    radius = from_epipole(rig, swarm)
    # Measured, by their share of the area: 0.4 within 8 px; all alike in weight, 1.5, since any depth fits there.
    area = np.pi * 8.0**2 / (rig.left.width * rig.left.height)
    assert np.mean(radius < 8.0) < 0.8 * area
    # One standard deviation: 0.1 px over the parallax, which goes with the angle to the epipole.
    z = swarm.points[:, 2]
    told = np.linalg.norm(swarm.spread, axis=1) / np.linalg.norm(swarm.points, axis=1)
    q = 1.0 / z
    expected = 0.1 / (q * radius * 0.27 / (1.0 + 0.27 * q) ** 2)
    np.testing.assert_allclose(told, expected, rtol=0.02)
