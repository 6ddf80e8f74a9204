"""The genetic operators of section 3.1: barycentric crossover, Gaussian mutation, immigration."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from flysim.flies.fitness import project_right, visible
from flysim.flies.randomness import gaussian, stream, uniform

CROSSOVER, MUTATION, IMMIGRATION = 0, 1, 2
TRIES = 32  # draws before a child becomes an immigrant, and an immigrant is given up
DRAWS_A_TRY = 8


@njit(cache=True)
def crossed(u1, v1, q1, u2, v2, q2, share):
    """(u, v, q) of the heir OF = share OF1 + (1 - share) OF2, taken in metric space, as the paper's vectors are."""
    z1, z2 = 1.0 / q1, 1.0 / q2
    z = share * z1 + (1.0 - share) * z2
    # A pixel times its depth is linear in the 3-D point, so the barycentre can be taken there.
    u = (share * u1 * z1 + (1.0 - share) * u2 * z2) / z
    v = (share * v1 * z1 + (1.0 - share) * v2 * z2) / z
    return u, v, 1.0 / z


@njit(cache=True, parallel=True)
def breed(
    seed, generation, kinds, regions, parents, parent_start, parent_stop, rects, u, v, q, out_u, out_v, out_q,
    first, to_right, shift, half, size, right_size, q_near, q_far, disparity_gain, K, metric, mutation,
):  # fmt: skip
    """Fills slots `[first:]` of (out_u, out_v, out_q) with children, each inside its region and both views.

    Parents are drawn uniformly from the region's survivors. A child that leaves its region, the searched depths or a
    view is drawn again; after TRIES it becomes an immigrant. Left pixels are whole: a fly on a pixel's ray is as good
    a 3-D point as one between, and the left window needs no interpolation.
    """
    width, height = size
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    for i in prange(first, len(kinds)):
        state = stream(seed, generation, i)
        r = regions[i]
        u0, u1, v0, v1 = rects[r, 0], rects[r, 1], rects[r, 2], rects[r, 3]
        u0, v0 = max(u0, half), max(v0, half)
        u1, v1 = min(u1, width - half), min(v1, height - half)
        count = parent_stop[r] - parent_start[r]
        kind = kinds[i] if count > 0 else IMMIGRATION
        cu, cv, cq = -1, -1, np.float32(0.0)
        for attempt in range(2 * TRIES):
            if attempt == TRIES:
                kind = IMMIGRATION
            n = attempt * DRAWS_A_TRY
            if kind == IMMIGRATION:
                cu = u0 + int(uniform(state, n) * (u1 - u0))
                cv = v0 + int(uniform(state, n + 1) * (v1 - v0))
                cq = np.float32(q_far + uniform(state, n + 2) * (q_near - q_far))  # uniform in disparity
            else:
                a = parents[parent_start[r] + int(uniform(state, n) * count)]
                if kind == CROSSOVER:
                    b = parents[parent_start[r] + int(uniform(state, n + 1) * count)]
                    x, y, z = crossed(u[a], v[a], q[a], u[b], v[b], q[b], uniform(state, n + 2))
                elif metric:
                    depth = 1.0 / q[a] + mutation * gaussian(state, n + 1)
                    if depth <= 0.0:
                        continue
                    # x / z moves by the fly's own step and by the change of depth.
                    x = cx + ((u[a] - cx) / q[a] + fx * mutation * gaussian(state, n + 3)) / depth
                    y = cy + ((v[a] - cy) / q[a] + fy * mutation * gaussian(state, n + 5)) / depth
                    z = 1.0 / depth
                else:
                    x = u[a] + mutation * gaussian(state, n + 1)
                    y = v[a] + mutation * gaussian(state, n + 3)
                    z = q[a] + mutation / disparity_gain * gaussian(state, n + 5)
                cu, cv, cq = int(np.floor(x + 0.5)), int(np.floor(y + 0.5)), np.float32(z)
            if u0 <= cu < u1 and v0 <= cv < v1 and q_far <= cq <= q_near:
                ur, vr = project_right(cu, cv, cq, to_right, shift)
                if visible(ur, vr, right_size[0], right_size[1], half):
                    break
        # After the last try the child stays where it is; its evaluation rejects it if it is out of view.
        out_u[i], out_v[i], out_q[i] = cu, cv, cq
