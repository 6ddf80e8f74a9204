"""Clusters whose bodies stand close together are one obstacle, whatever part of them was seen."""

import numpy as np
import pytest

from flysim.obstacles.joined import _beside, _outline
from flysim.obstacles.shape import FittedShape, distance_to


def body(shape, x, y, size, yaw=0.0):
    return FittedShape(shape, np.array([x, y, size[2] / 2.0]), np.array(size), yaw)


NONE = np.empty((0, 3))
POST = (0.1, 0.1, 0.5)


@pytest.mark.parametrize("shape", ["cylinder", "box", "sphere"])
def test_the_outline_of_a_body_lies_on_it(shape):
    one = body(shape, 1.0, 2.0, (0.4, 0.4 if shape != "box" else 0.2, 0.4), 0.7)
    np.testing.assert_allclose(distance_to(_outline(one), one), 0.0, atol=1e-9)


@pytest.mark.parametrize(("gap", "together"), [(0.085, True), (0.095, False)])
def test_two_posts_are_one_obstacle_up_to_nine_centimetres_apart(gap, together):
    one = body("cylinder", 0.0, 0.0, POST)
    for shape in ("cylinder", "box"):
        other = body(shape, 0.1 + gap, 0.0, POST)
        assert _beside(NONE, one, NONE, other, 0.09) == together
        assert _beside(NONE, other, NONE, one, 0.09) == together


def test_of_what_is_no_body_its_flies_are_asked():
    post, hedge = body("cylinder", 0.0, 0.0, POST), body("other", 0.6, 0.0, (0.8, 0.4, 0.5))
    near, far = (np.array([[x, 0.01 * k, 0.2] for k in range(4)]) for x in (0.13, 0.15))
    assert _beside(NONE, post, near, hedge, 0.09) and _beside(near, hedge, NONE, post, 0.09)
    assert not _beside(NONE, post, far, hedge, 0.09)  # the empty corner of its box is nearer, and nothing is there
    assert not _beside(NONE, post, near[:3], hedge, 0.09)  # three flies may be astray
    assert not _beside(near, hedge, near, hedge, 0.09)  # of two hedges nobody knows where they end but by their flies
