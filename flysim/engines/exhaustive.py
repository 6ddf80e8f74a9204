"""Every disparity tried at every point of a grid, under the flies' own fitness: the best that any search could do.

What this finds and the flies do not, their search has missed; what this misses too is the fitness's own. Afterwards the
points go through what flies go through: Gauss-Newton, uniqueness, and the tests for a window that hangs over an edge.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flysim.compute.compiled import kernel
from flysim.compute.vectors import add
from flysim.flies.evolution import settled
from flysim.flies.finish import EVERY_ROW
from flysim.flies.fitness import evaluate
from flysim.flies.parameters import FlyParams
from flysim.geometry.rig import ImagePair
from flysim.products.swarm import Swarm
from flysim.stereo.descent import descend
from flysim.stereo.windows import visible, warp

STEP_PX = 0.5  # of disparity: Gauss-Newton reaches twice as far
BEST = 4  # places on an epipolar line that are polished, with each slant of `LEANS`
# Slants from which Gauss-Newton starts, as shares of the steepest: facing, and leaning each way.
LEANS = np.array([(0.0, 0.0), (0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5)])
# Grid points in the place that each preserved fly has to itself: a fly chooses where in it to sit.
DENSITY = 4
ARRAYS = ("points", "fitness", "uv", "normals", "spread", "uv_right", "region", "age")


def exhaustive(pair: ImagePair, params: FlyParams, *, rng: np.random.Generator) -> Swarm:
    """The best of all disparities at each point of a grid; takes nothing from `rng`.

    Of the points that hold as many are kept as flies may be preserved: the fittest of every cell, then the second of
    every cell, and so on, as sharing would have it.

    Raises:
        ValueError: the images are smaller than the window.
    """
    del rng
    width, height = pair.rig.left.width, pair.rig.left.height
    cell, margin = params.cell(width, height), params.window // 2 + 1
    step = max(1, round(cell / math.sqrt(DENSITY)))
    v, u = (at.ravel() for at in np.mgrid[margin : height - margin : step, margin : width - margin : step])
    pixels = np.stack([u, v], axis=1).astype(np.int32)
    swarm = settled(pair, params, search, pixels)
    columns, rows = (swarm.uv // cell).astype(np.int64).T
    places = max(round(params.population * params.shares[0]), 1)
    # They come fittest first, and so they stay among those of one rank.
    keep = np.sort(np.argsort(_ranks(rows * (width // cell + 1) + columns), kind="stable")[:places])
    arrays = {name: getattr(swarm, name)[keep] for name in ARRAYS}
    tried = len(pixels) * round(pair.rig.left.fx * pair.rig.baseline * (1 / params.min_depth - 1 / params.max_depth))
    reason = f"every disparity tried at {len(pixels)} pixels: {len(swarm.points)} hold, {len(keep)} are kept"
    return replace(swarm, **arrays, reason=reason, evaluations=round(tried / STEP_PX))


def _ranks(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """`[N]` how many came before in the same cell."""
    order = np.argsort(cells, kind="stable")
    _, first, counts = np.unique(cells[order], return_index=True, return_counts=True)
    ranks = np.empty(len(cells), np.int64)
    ranks[order] = np.arange(len(cells)) - np.repeat(first, counts)
    return ranks


@kernel
def search(lane, counters, all_views, all_rules, measure, pixels, genes, found):
    """Fills `genes` `[N, 3]` and `found` `[N]`, the fitness, with the best of each pixel of `pixels` `[N, 2]`.

    `counters[0]` counts the pixels that were taken.
    """
    step, leans = STEP_PX, LEANS
    views, rules = all_views[0], all_rules[0]
    count = int((rules.q_near - rules.q_far) * views.gain / step) + 1
    curve = np.empty(count + 2, np.float64)
    while True:
        n = add(counters, 0, 1)
        if n >= len(pixels):
            return
        u, v = np.int64(pixels[n, 0]), np.int64(pixels[n, 1])
        curve[0] = curve[count + 1] = -1.0
        for k in range(count):
            w = warp(views, u, v, rules.q_far + k * step / views.gain, 0.0, 0.0)
            curve[k + 1] = -1.0
            if visible(views, w, rules.half):
                curve[k + 1] = evaluate(views, rules.norm, measure, u, v, w, rules.half, 0.0)
        found[n] = 0.0
        genes[n, 0], genes[n, 1], genes[n, 2] = rules.q_far, 0.0, 0.0
        for _ in range(BEST):
            # The highest peak that is left: peaks alone, so that one broad peak does not take all the tries.
            peak, height = 0, 0.0
            for k in range(1, count + 1):
                if curve[k] > height and curve[k] >= curve[k - 1] and curve[k] >= curve[k + 1]:
                    peak, height = k, curve[k]
            if peak == 0:
                break
            curve[peak] = 0.0
            start = rules.q_far + (peak - 1) * step / views.gain
            for lean in range(len(leans)):
                if lean > 0 and not rules.steepest > 0.0:
                    break
                qu, qv = leans[lean, 0] * rules.steepest, leans[lean, 1] * rules.steepest
                q, qu, qv = descend(views, rules, u, v, start, qu, qv, rules.steps, EVERY_ROW)
                w = warp(views, u, v, q, qu, qv)
                if not visible(views, w, rules.half):
                    continue
                fitness = evaluate(views, rules.norm, measure, u, v, w, rules.half, found[n])
                if fitness > found[n]:
                    found[n] = fitness
                    genes[n, 0], genes[n, 1], genes[n, 2] = q, qu, qv
