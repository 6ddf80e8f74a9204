"""Which stops of one camera make a pair, by what is believed of them."""

import math

import numpy as np
import pytest

from flysim.geometry.camera import Camera
from flysim.geometry.frames import R_BODY_OPTICAL, Pose2, inverse, se3
from flysim.products.shot import Shot
from flysim.sources.pairing import Pairing, PairRule, Refusal, partner

CAMERA = Camera.from_fov(80, 60, math.radians(65.0))
MOUNTED = se3(R_BODY_OPTICAL, (0.0, 0.0, 0.5))
NEAR = PairRule(consecutive=False, least=0.25, most=0.65)


def shot(index, x=0.0, y=0.0, yaw_deg=0.0):
    image = np.full((60, 80, 3), index, np.uint8)
    base = Pose2(x, y, math.radians(yaw_deg)).matrix
    return Shot(index=index, time=float(index), image=image, camera=CAMERA, T_world_base=base, T_base_left=MOUNTED)


def paired(rule, *places):
    """(later, earlier) stop of each pair of a drive, and what is said of the others."""
    pairing = Pairing(rule, 4.0)
    frames = [pairing.add(shot(k, *place)) for k, place in enumerate(places)]
    return [(one.index, one.other) for one in frames if one is not None], pairing.notes()


def test_each_stop_makes_a_pair_with_the_one_before():
    assert paired(PairRule(), (0, 0), (0, -0.4), (0.3, -0.4), (0.3, -0.6, 20)) == ([(1, 0), (2, 1), (3, 2)], ())


def test_or_with_the_last_one_at_a_distance_in_range():
    way = [(0.1 * k, 0.0) for k in range(6)]
    found, notes = paired(NEAR, *way)
    assert found == [(3, 0), (4, 1), (5, 2)]  # 0.3 m, never 0.2 or 0.4
    assert "stop 2 (0.100 m from stop 1: less than 0.25 m); stop 3 (0.100 m from stop 2" in notes[0]


def test_turning_on_the_spot_makes_none_and_is_looked_past_by_nobody():
    found, notes = paired(PairRule(), (0, 0), (0, 0, 30), (0, 0.4, 30))
    assert found == [(2, 1)]
    assert notes == ("1 of 3 stops makes no pair: stop 2 (0.000 m from stop 1: no parallax). 1 pair is kept.",)


def test_stops_three_metres_apart_make_none():
    found, notes = paired(PairRule(), (0, 0), (0, 0.4), (0, 3.4), (0, 3.8))
    assert found == [(1, 0), (3, 2)]
    assert notes == ("1 of 4 stops makes no pair: stop 3 (3.00 m from stop 2, more than 2 m). 2 pairs are kept.",)


def test_stops_that_look_elsewhere_make_none():
    found, notes = paired(PairRule(), (0, 0), (0, 0.3, 120), (0, 0.6, 125))
    assert found == [(2, 1)]
    assert "stop 2 (it sees nothing of what stop 1 saw)" in notes[0]


def test_no_sentence_names_more_than_five():
    _, notes = paired(PairRule(), *[(0, 0, k) for k in range(9)])
    assert notes[0].startswith("8 of 9 stops make no pair: ") and "; and 3 more. 0 pairs are kept." in notes[0]


def test_the_later_picture_is_the_left_one_and_the_rig_is_odometrys():
    pairing = Pairing(PairRule(), 4.0)
    first, second = shot(0, 0.0, 0.0), shot(1, 0.27, 0.0, 3.0)
    pairing.add(first)
    frame = pairing.add(second)
    assert (frame.index, frame.other, frame.time) == (1, 0, 1.0)
    assert frame.pair.left.max() == 1 and frame.pair.right.max() == 0
    np.testing.assert_array_equal(frame.T_world_base, second.T_world_base)
    # What the later camera has at the origin of the world, the earlier one has there too.
    origin = inverse(second.T_world_left) @ [0, 0, 0, 1]
    there = inverse(first.T_world_left) @ [0, 0, 0, 1]
    np.testing.assert_allclose(frame.pair.rig.T_right_left @ origin, there, atol=1e-12)
    assert frame.pair.rig.baseline == pytest.approx(0.27)


def test_a_path_is_asked_before_it_is_driven():
    path = [one.T_world_left for one in (shot(0), shot(1, 0.0, 0.4), shot(2, 0.0, 5.0))]
    assert partner(PairRule(), CAMERA, path[:2], 4.0) == 0
    assert partner(PairRule(), CAMERA, path, 4.0) == Refusal(index=2, why="4.60 m from stop 2, more than 2 m")
    assert isinstance(partner(PairRule(), CAMERA, path[:1], 4.0), Refusal)


@pytest.mark.parametrize("least, most", [(0.0, 1.0), (0.5, 0.5), (0.6, 0.1), (-1.0, 1.0), (0.1, math.inf)])
def test_a_range_that_is_none_is_refused(least, most):
    with pytest.raises(ValueError, match="two numbers 0 < least < most"):
        PairRule(least=least, most=most)
