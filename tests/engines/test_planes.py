"""Planes through disparity maps whose slopes are known."""

import numpy as np
import pytest

from flysim.engines.planes import local_planes


def plane(du, dv, shape=(40, 60)):
    v, u = np.mgrid[: shape[0], : shape[1]]
    return (20.0 + du * u + dv * v).astype(np.float32)


@pytest.mark.parametrize("slopes", [(0.0, 0.0), (0.2, 0.0), (-0.1, 0.3), (0.0, -0.4)])
def test_the_slopes_of_a_plane(slopes):
    found, support = local_planes(plane(*slopes), np.array([[20, 20], [1, 1], [58, 38]]))
    # Damping takes a little of a slope.
    assert found == pytest.approx(np.tile(slopes, (3, 1)), abs=0.04)
    assert support[0] == 1.0


def test_what_stands_before_has_no_say():
    disparity = plane(0.0, 0.2)
    disparity[:, 30:] += 10.0
    found, support = local_planes(disparity, np.array([[29, 20], [30, 20]]))
    assert found == pytest.approx(np.array([(0.0, 0.2)] * 2), abs=0.04)
    assert support == pytest.approx(4 / 7, abs=0.01)


def test_few_neighbours_tell_no_slope():
    disparity = np.full((40, 60), np.nan, np.float32)
    disparity[20, 18:23] = 5.0 + 0.4 * np.arange(5)
    found, support = local_planes(disparity, np.array([[20, 20]]))
    assert (found == 0.0).all()
    assert support == pytest.approx(5 / 49)
