"""What is left of settled flies: each at sub-pixel depth, tested, placed once more by grey levels, told as a swarm."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flysim.flies.compared import Compared, levels
from flysim.flies.finish import GOOD, MISFIT, TESTS, Finished, finish, judge, most_columns, refined
from flysim.flies.parameters import FlyParams
from flysim.flies.threads import lanes, share
from flysim.geometry.frames import inverse
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.products.swarm import Swarm
from flysim.stereo.plane import normals
from flysim.stereo.told import speeds
from flysim.stereo.views import Views, prepare

# On derivatives, of the misfit. Measured on `corridor`: tops seen at a low angle keep their flies (without it one
# box in six falls in two), and photographs lose 0.1 % of precision and gain 3 % of flies.
LEEWAY = 1.2
NEAR_PX = 0.7  # [px] that levels may move a fly which derivatives have placed


def survivors(
    pair: ImagePair,
    compared: Compared,
    params: FlyParams,
    rules: NDArray[np.void],
    pixels: NDArray[np.int32],
    genes: NDArray[np.floating],
    fitnesses: NDArray[np.float32],
    *,
    exact: bool = True,
) -> tuple[Swarm, NDArray[np.bool_]]:
    """A swarm, without a history, of those of N settled flies that hold.

    Args:
        pair, compared: what they have settled on.
        params: how they evolved.
        rules: `[1]` of `rules.RULES`.
        pixels: `[N, 2]` u, v.
        genes: `[N, 3]` inverse depth [1/m] and its slopes [1/m/px].
        fitnesses: `[N]`.
        exact: place them once more by grey levels.

    Returns:
        The swarm, in the order of the flies; and `[N]` which they are.
    """
    rig, record = pair.rig, compared.views.record.view(np.ndarray)
    done = _unfinished(genes)
    back = prepare(_exchanged(compared.views, rig), fast=False) if params.left_right > 0.0 else None
    scratch = np.empty((lanes(), most_columns(record, rules)), np.float32)
    share(
        finish, np.zeros(1, np.int64), record, back and back.record.view(np.ndarray), rules, scratch,
        pixels, done, params.uniqueness, params.left_right,
    )  # fmt: skip
    # Derivatives of what leans are a little less alike in both eyes than its levels are.
    judge(done, params.misfit * (LEEWAY if compared.blur else 1.0), params.refine)
    if exact:
        _refine_on_levels(pair, compared, rules, pixels, done)
    good = done.verdict == GOOD
    counts = np.bincount(done.verdict, minlength=len(TESTS))
    pixels, placed = pixels[good], done.genes[good]
    points = rig.left.unproject(pixels, 1.0 / placed[:, 0])
    spread = points * (params.refine.disparity_std_px / (speeds(rig, pixels, placed[:, 0])[:, None] * placed[:, :1]))
    swarm = Swarm(
        points=points.astype(np.float32),
        normals=normals(rig.left, pixels, placed),
        spread=spread.astype(np.float32),
        fitness=fitnesses[good],
        uv=pixels.astype(np.float32),
        uv_right=rig.project(points)[1].astype(np.float32),
        region=np.zeros(len(pixels), np.int32),
        age=np.zeros(len(pixels), np.int32),
        history=(),
        converged=True,
        reason="",
        plain=compared.plain,
        residual=float(np.median(done.own / np.maximum(done.energy[:, 0], 1e-6))) if len(done.own) else 0.0,
        dropped={test: int(count) for test, count in zip(TESTS[1:], counts[1:], strict=True) if count},
    )
    return swarm, good


def _refine_on_levels(
    pair: ImagePair, compared: Compared, rules: NDArray[np.void], pixels: NDArray[np.int32], done: Finished
) -> None:
    """Once more from there, on the grey levels; a fly that they would move further fits but one of the two."""
    good = np.flatnonzero(done.verdict == GOOD)
    views = levels(pair, compared, pixels[good], done.genes[good])
    if views is None:
        return
    genes, moved = done.genes[good], np.empty(len(good))
    share(refined, np.zeros(1, np.int64), views.record.view(np.ndarray), rules, pixels[good], genes, moved)
    near = moved < NEAR_PX
    done.genes[good[near]] = genes[near]
    done.verdict[good[~near]] = MISFIT


def _unfinished(genes: NDArray[np.floating]) -> Finished:
    """What `finish` fills, of flies that are where `genes` says; a copy, since it is refined in place."""
    n = len(genes)
    return Finished(
        genes=np.array(genes, np.float64),
        own=np.empty(n, np.float32),
        energy=np.empty((n, 2), np.float32),
        verdict=np.empty(n, np.int8),
    )


def _exchanged(views: Views, rig: StereoRig) -> ImagePair:
    there = StereoRig(left=rig.right, right=rig.left, T_right_left=inverse(rig.T_right_left))
    return ImagePair(left=views.right, right=views.left, rig=there)
