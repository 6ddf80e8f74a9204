import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flysim.evaluate.dimensions import compare
from flysim.products.obstacle import Obstacle
from flysim.truth.obstacles import TrueObstacle


def true_box(size=(0.6, 0.3, 0.4), yaw=0.0, symmetry="rectangle", points=None):
    return TrueObstacle(
        name="box",
        links=(0,),
        center=np.array([1.0, 2.0, size[2] / 2]),
        size=np.array(size),
        yaw=yaw,
        symmetry=symmetry,
        shape="box",
        visible_points=np.empty((0, 3)) if points is None else np.array(points, dtype=float),
        visible_pixels=0 if points is None else 1000,
    )


def box(size=(0.6, 0.3, 0.4), yaw=0.0, center=(1.0, 2.0)):
    return Obstacle(center=np.array([*center, size[2] / 2]), size=np.array(size), yaw=yaw, flies=np.zeros(0, np.int64))


def test_centre_error_is_on_the_ground():
    estimate = box(size=(0.6, 0.3, 1.0), center=(1.03, 2.04))
    assert compare(true_box(), estimate).center_error == pytest.approx(0.05)


def test_swapped_axes_and_a_quarter_turn_are_the_same_box():
    c = compare(true_box(), box(size=(0.3, 0.6, 0.4), yaw=-math.pi / 2 + 0.1))
    assert c.size_estimated == pytest.approx([0.6, 0.3, 0.4])
    assert c.yaw_error == pytest.approx(0.1)


def test_sizes_keep_their_axes_when_the_estimate_has_the_longer_side_across():
    # A true 40 x 39 cm box measured as 39 x 41: the errors are -1 and +2 cm, not swapped by sorting.
    c = compare(true_box(size=(0.40, 0.39, 0.2)), box(size=(0.39, 0.41, 0.2), yaw=0.02))
    assert c.size_estimated == pytest.approx([0.39, 0.41, 0.2])


@settings(deadline=None)
@given(st.floats(-math.pi / 2, math.pi / 2), st.floats(-math.pi / 2, math.pi / 2), st.integers(-4, 4))
def test_yaw_error_is_modulo_the_boxes_symmetry(true_yaw, yaw, turns):
    truth = true_box(yaw=true_yaw)
    size = (0.6, 0.3, 0.4) if turns % 2 == 0 else (0.3, 0.6, 0.4)
    a = compare(truth, box(yaw=yaw))
    b = compare(truth, box(size=size, yaw=yaw + turns * math.pi / 2))
    assert 0.0 <= a.yaw_error <= math.pi / 4 + 1e-9
    assert a.yaw_error == pytest.approx(b.yaw_error, abs=1e-9)
    if a.yaw_error < math.pi / 4 - 1e-6:
        assert a.size_estimated == pytest.approx(b.size_estimated)


def test_round_things_have_no_heading_and_take_the_estimates_axes():
    # Half of a post of 6 cm radius was seen, from -y: 12 cm wide along x, 6 deep along y.
    angle = np.linspace(math.pi, 2 * math.pi, 181)
    arc = np.stack([1.0 + 0.06 * np.cos(angle), 2.0 + 0.06 * np.sin(angle)], axis=1)
    points = [(x, y, z) for x, y in arc for z in (0.0, 0.5)]
    truth = true_box(size=(0.12, 0.12, 0.5), symmetry="round", points=points)
    along = compare(truth, box(size=(0.12, 0.06, 0.5), yaw=0.0, center=(1.0, 1.97)))
    assert along.yaw_error is None
    assert along.size_visible == pytest.approx([0.12, 0.06, 0.5])
    assert along.center_error == pytest.approx(0.03)
    assert along.center_visible_error == pytest.approx(0.0, abs=1e-9)
    across = compare(truth, box(size=(0.06, 0.12, 0.5), yaw=math.pi / 2))
    assert across.size_visible == pytest.approx([0.06, 0.12, 0.5])
    assert across.size_estimated == pytest.approx([0.06, 0.12, 0.5])


def test_nothing_visible_is_compared_with_nothing():
    c = compare(true_box(), box())
    assert c.size_visible is None
    assert c.center_visible_error is None
