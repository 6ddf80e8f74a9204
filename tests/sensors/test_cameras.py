"""Cameras at work: nothing where all is off, the same noise wherever and whenever the same frame is taken."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from flysim.geometry.camera import Camera
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.sensors.calibration import CalibrationParams
from flysim.sensors.cameras import Cameras
from flysim.sensors.parameters import SensorParams

EVERYTHING = {
    **{"k1": -0.1, "p1": 0.005, "vignetting": 0.2, "uneven_right": 0.1, "defocus_left": 0.7, "motion_px": 2.5},
    **{"row_time_us": 100.0, "auto_exposure": 120.0, "gamma_right": 1.1, "shot_noise": 5000.0, "noise": 2.0},
    **{"bayer": True, "jpeg_quality": 80},
}


def test_off_is_the_same_pair(rig, texture):
    pair = ImagePair(left=texture, right=texture, rig=rig)
    assert Cameras(rig).take(pair, 3, turn_rate=1.0) is pair
    assert Cameras(rig, SensorParams(), CalibrationParams(), seed=9).take(pair, 0) is pair


def test_a_rig_that_is_wrongly_believed_leaves_the_images_alone(rig, texture):
    cameras = Cameras(rig, calibration=CalibrationParams(focal_error=0.1))
    pair = cameras.take(ImagePair(left=texture, right=texture, rig=cameras.drawn), 0)
    np.testing.assert_array_equal(pair.left, texture)
    assert pair.rig is cameras.believed and pair.rig.left.fx == pytest.approx(77.0)


def test_noise_depends_on_seed_frame_and_eye_alone(taken):
    def digest(**more):
        return [image.tobytes() for image in taken(128, noise=5.0, **more)]

    once = digest(seed=4, index=2)
    digest(seed=9, index=7)  # whatever was taken between
    np.random.default_rng(0).random(100)
    assert digest(seed=4, index=2) == once
    for other in (once[::-1], digest(seed=5, index=2), digest(seed=4, index=3)):
        assert all(a != b for a, b in zip(once, other, strict=True))


def digest(texture):
    camera = Camera(width=81, height=61, fx=70.0, fy=70.0, cx=40.0, cy=30.0)
    cameras = Cameras(StereoRig.parallel(camera, 0.12), SensorParams(**EVERYTHING), seed=11)
    drawn = cameras.drawn.left
    image = cv2.resize(texture, (drawn.width, drawn.height))
    pair = cameras.take(ImagePair(left=image, right=image, rig=cameras.drawn), 5, 0.7)
    return hashlib.sha256(pair.left.tobytes() + pair.right.tobytes()).hexdigest()


def test_the_same_frame_has_the_same_bytes_in_any_process_with_any_threads(texture, tmp_path):
    here = digest(texture)
    np.save(tmp_path / "texture.npy", texture)
    code = (
        "import sys, cv2, numpy as np; cv2.setNumThreads(int(sys.argv[2])); import test_cameras; "
        "print(test_cameras.digest(np.load(sys.argv[1])))"
    )
    folder = str(Path(__file__).parent)
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([folder, *sys.path])}
    for threads in ("1", "3"):
        arguments = [sys.executable, "-c", code, str(tmp_path / "texture.npy"), threads]
        done = subprocess.run(arguments, env=env, capture_output=True, text=True, check=True, timeout=120)
        assert done.stdout.strip() == here
