"""An eye that the spectra tell to be out of focus is believed to be so where more flies settle for it."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from flysim.engines.flies import Flies
from flysim.flies.parameters import FlyParams
from flysim.products.frame import Frame
from flysim.stereo.sharpness import Softening

PARAMS = FlyParams(population=1500)


def softened(pair):
    """What a new engine says that it did to the eyes, and how many flies settled."""
    flies = Flies()
    flies.begin(pair.rig, PARAMS)
    swarm = flies.see(Frame.alone(pair, index=0, time=0.0), rng=np.random.default_rng(5))
    return swarm.softened_left_px, swarm.softened_right_px, len(swarm.points)


def test_spectra_that_lie_soften_nothing(scene, monkeypatch):
    """As where a thing that stands at the border of the view is in one eye's picture alone."""
    before = softened(scene.pair)
    monkeypatch.setattr("flysim.engines.flies.softening", lambda left, right: Softening(left_px=(1.8, 0.0)))
    assert softened(scene.pair) == before == ((0.0, 0.0), (0.0, 0.0), before[2])


@pytest.mark.parametrize("blur", [1.0, 1.2])
def test_an_eye_that_is_out_of_focus_is_found_to_be(scene, blur):
    pair = replace(scene.pair, right=cv2.GaussianBlur(scene.pair.right, (0, 0), blur))
    left, right, count = softened(pair)
    assert left == pytest.approx((blur, blur), abs=0.35) and not any(right)
    assert count > 0.6 * softened(scene.pair)[2]
