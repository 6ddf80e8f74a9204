"""Pictures whose edges stand further apart than a window is wide, and what is said where no fly is left."""

import numpy as np
import pytest

import flysim as fs
from flysim.flies.finish import GOOD, HALF_EMPTY, MISFIT, OUT_OF_VIEW, Finished, judge
from flysim.flies.tuning import RefineParams
from flysim.geometry.camera import Camera
from flysim.geometry.rig import ImagePair, StereoRig

RIG = StereoRig.parallel(Camera(width=320, height=240, fx=300, fy=300, cx=159.5, cy=119.5), 0.1)
DISPARITY = 12  # [px]


def pair_of(wide):
    """A wall at 2.5 m with `[240, 332]` of grey levels."""
    rgb = np.repeat(wide.astype(np.uint8)[..., None], 3, axis=2)
    return ImagePair(left=rgb[:, :320].copy(), right=rgb[:, DISPARITY : 320 + DISPARITY].copy(), rig=RIG)


def dots(side, seed):
    rng = np.random.default_rng(seed)
    cells = rng.integers(0, 2, (-(-240 // side), -(-332 // side))) * 120 + 60
    return np.kron(cells, np.ones((side, side)))[:240, :332]


@pytest.mark.parametrize("side", [2, 4, 8, 24])
def test_random_dots_of_any_size_gather_flies(side):
    swarm = fs.evolve(pair_of(dots(side, 5)), fs.FlyParams(), rng=np.random.default_rng(6))
    off = np.abs(RIG.left.fx * RIG.baseline / swarm.points[:, 2] - DISPARITY)
    assert len(off) > 400
    assert np.mean(off < 0.5) > 0.98
    assert np.median(off) < 0.15


def test_flies_that_were_dropped_are_counted_by_what_dropped_them():
    swarm = fs.evolve(pair_of(dots(8, 5)), fs.FlyParams(), rng=np.random.default_rng(6))
    assert swarm.dropped["uniqueness"] > 100  # one edge is like another
    settled = len(swarm.points) + sum(swarm.dropped.values())
    assert f"; of {settled} dropped: {swarm.dropped['uniqueness']} by uniqueness" in swarm.reason
    lenient = fs.evolve(pair_of(dots(8, 5)), fs.FlyParams(uniqueness=0.0), rng=np.random.default_rng(6))
    assert "uniqueness" not in lenient.dropped
    assert len(lenient.points) > len(swarm.points)


def test_where_all_flies_are_dropped_the_reason_says_so():
    blinds = np.tile(np.repeat([60, 180], 3), 56)[None, :332].repeat(240, axis=0)  # repeats every 6 px
    # So few that none sits at the image's border, where a rival would be out of view.
    swarm = fs.evolve(pair_of(blinds), fs.FlyParams(population=100), rng=np.random.default_rng(6))
    assert len(swarm.points) == 0
    assert swarm.reason.startswith(f"all {sum(swarm.dropped.values())} flies that settled were dropped: ")
    assert f"{swarm.dropped['uniqueness']} by uniqueness" in swarm.reason


def test_where_no_fly_settles_the_reason_is_the_true_one():
    for flat in (np.full((240, 332), 90), np.arange(240)[:, None].repeat(332, axis=1)):  # rows are the epipolar lines
        swarm = fs.evolve(pair_of(flat), fs.FlyParams(max_iterations=3), rng=np.random.default_rng(6))
        assert len(swarm.points) == 0
        assert swarm.reason.endswith(" in 3 generations: the left image holds no contrast along the epipolar lines")
    left, right = (pair_of(dots(4, seed)).left for seed in (1, 2))
    strangers = ImagePair(left=left, right=np.zeros_like(right), rig=RIG)
    swarm = fs.evolve(strangers, fs.FlyParams(max_iterations=3), rng=np.random.default_rng(6))
    assert len(swarm.points) == 0
    assert swarm.reason == (
        "no fly settled in 3 generations: slopes along the epipolar lines reach 60 grey levels a pixel, but none has "
        "its like in the right image at a depth of 0.5 to 4 m"
    )


def test_an_empty_half_counts_only_where_most_windows_are_full():
    own, total = np.zeros(10, np.float32), np.full(10, 100.0, np.float32)

    def verdicts(empty, own=own):
        least = np.full(10, 100.0 * RefineParams().empty_half * 1.01, np.float32)
        least[:empty] = 100.0 * RefineParams().empty_half * 0.99
        found = np.full(10, GOOD, np.int8)
        found[9] = OUT_OF_VIEW
        judge(Finished(np.empty(0), own, np.stack([total, least], axis=1), found), 0.3, RefineParams())
        return found.tolist()

    assert verdicts(5) == [HALF_EMPTY] * 5 + [GOOD] * 4 + [OUT_OF_VIEW]
    assert verdicts(6) == [GOOD] * 9 + [OUT_OF_VIEW]
    bad = own.copy()
    bad[[0, 9]] = 1e3
    assert verdicts(6, bad) == [MISFIT] + [GOOD] * 8 + [OUT_OF_VIEW]
