"""Eq. (1) as printed against its epipolar form, on edges that run along the baseline (notes: tiled floors)."""

import numpy as np
import pytest

from flysim.geometry.frames import pose6
from flysim.geometry.rig import ImagePair, StereoRig

# What the forms of the fitness gather is looked at before any test drops flies.
BARE = {"uniqueness": 0.0, "misfit": 0.0, "regions": 1}


@pytest.fixture(scope="module", params=["beside", "above"])
def half_striped(request, stage):
    """(pair, where flies lie on stripes): a textured wall, and stripes along the baseline that match at any depth."""
    plane = stage.Plane((0.0, 0.0, 1.0), 1.5)
    if request.param == "beside":
        rig, along = stage.RIG, False
    else:
        rig = StereoRig(left=stage.CAMERA, right=stage.CAMERA, T_right_left=pose6(0.0, -0.12, 0.0, 0.0, 0.0, 0.0))
        along = True
    pair = stage.photograph(rig, [plane])
    images = []
    for image in (pair.left.copy(), pair.right.copy()):
        if along:
            image[90:] = (np.arange(200) // 5 % 2 * 120 + 60)[None, :, None]
        else:
            image[:, 110:] = (np.arange(150) // 5 % 2 * 120 + 60)[:, None, None]
        images.append(image)
    from_px = 93 if along else 113  # a window from there on holds nothing but stripes
    return ImagePair(left=images[0], right=images[1], rig=rig), (lambda uv: uv[:, 1 if along else 0] >= from_px)


def test_as_printed_it_gathers_flies_on_edges_along_the_baseline_at_any_depth(stage, half_striped):
    pair, on_stripes = half_striped
    swarm = stage.run(pair, fitness="paper", **BARE)
    on = on_stripes(swarm.uv)
    assert on.mean() > 0.3  # measured: 0.6
    assert swarm.points[on, 2].std() > 0.5  # [m]


def test_the_epipolar_form_sees_nothing_in_them(stage, half_striped):
    pair, on_stripes = half_striped
    swarm = stage.run(pair, fitness="epipolar", **BARE)
    assert not on_stripes(swarm.uv).any()
    assert len(swarm.points) > 350
    assert np.median(np.abs(swarm.points[:, 2] - 1.5)) < 0.005


def test_stripes_across_the_baseline_serve_both_forms(stage):
    """One edge across each epipolar line is enough; irregular ones, so that none is like the next."""
    rng = np.random.default_rng(4)
    levels = np.repeat(rng.integers(30, 226, 60), rng.integers(4, 12, 60))[:260].astype(np.uint8)
    left = np.broadcast_to(levels[None, :200, None], (150, 200, 3))
    right = np.broadcast_to(levels[None, 15:215, None], (150, 200, 3))  # disparity 15 px
    pair = ImagePair(left=left, right=right, rig=stage.RIG)
    for fitness in ("paper", "epipolar"):
        # A lone edge fills no half of its window with contrast: the test against silhouettes would drop it.
        swarm = stage.run(pair, fitness=fitness, misfit=0.0)
        assert len(swarm.points) > 100
        disparity = swarm.uv[:, 0] - swarm.uv_right[:, 0]
        assert np.mean(np.abs(disparity - 15.0) < 0.5) > 0.95
