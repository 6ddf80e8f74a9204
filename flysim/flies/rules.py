"""What of the parameters the kernels read, as a record in their units."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flysim.flies.parameters import FlyParams

RULES = np.dtype(
    [
        ("norm", np.int64),  # the gradients of the measure are norms
        ("half", np.int64),  # of the window [px]
        ("q_near", np.float64),  # [1/m]
        ("q_far", np.float64),  # [1/m]
        ("beyond", np.float64),  # how far a crossover may lie beyond its parents, as a share of their distance
        ("contest", np.int64),  # a parent is the fitter of two
        ("metric", np.int64),  # mutate in space rather than in the image
        ("heavy", np.int64),  # mutations have heavy tails
        ("mutation", np.float64),  # standard deviation of a mutation [m or px]
        ("mutation_q", np.float64),  # standard deviation of an image mutation in inverse depth [1/m]
        ("mutation_slope", np.float64),  # and in slope [1/m/px], of those that do not fold
        ("fold_share", np.float64),  # of mutations that step over an edge onto a face with another slant
        ("steepest", np.float64),  # slope of inverse depth [1/m/px]; 0 for flies that all face the camera
        ("polish", np.int64),  # Gauss-Newton steps on a promising child
        ("promising", np.float64),  # fitness from which a child is polished
        ("sharp", np.float64),  # fitness from which there is nothing left to polish
        ("most_step", np.float64),  # of Gauss-Newton [px]
        ("done", np.float64),  # step below which there is no other [px]
        ("slope_damping", np.float64),  # of Gauss-Newton's slopes, as a share of what tells depth
        ("steps", np.int64),  # of the last refinement
        ("rival_steps", np.int64),  # of the refinement of another place on the epipolar line
        ("same_match", np.float64),  # places nearer than this belong to one match [px]
        ("empty_half", np.float64),  # share of a window's gradient energy that each half holds
    ]
)


def rules_of(params: FlyParams, *, norm: bool, settled: float, cell: int, gain: float) -> NDArray[np.void]:
    """`[1]` of RULES.

    Args:
        params: how a swarm evolves.
        norm: of the measure of fitness.
        settled: fitness from which a fly is settled.
        cell: side of a sharing cell [px].
        gain: of `views.RECORD`.
    """
    search, refine = params.search, params.refine
    steepest = params.slant / gain
    rules = {
        "norm": norm,
        "half": params.window // 2,
        "q_near": 1.0 / params.min_depth,
        "q_far": 1.0 / params.max_depth,
        "beyond": 0.5 if params.crossover == "extrapolate" else 0.0,
        "contest": params.parents == "tournament",
        "metric": params.mutation == "metric",
        "heavy": params.tails == "heavy",
        "mutation": float(params.mutation_m if params.mutation == "metric" else params.mutation_px or cell),
        "mutation_q": params.mutation_disparity_px / gain,
        "mutation_slope": search.mutation_slant * steepest,
        "fold_share": search.fold_share,
        "steepest": steepest,
        "polish": params.polish,
        "promising": search.promising * settled,
        "sharp": search.sharp * settled,
        "most_step": refine.max_step_px,
        "done": refine.done_px,
        "slope_damping": refine.slope_damping,
        "steps": refine.steps,
        "rival_steps": refine.rival_steps,
        "same_match": refine.same_match_px,
        "empty_half": refine.empty_half,
    }
    return np.array([tuple(rules[name] for name in RULES.names or ())], RULES)
