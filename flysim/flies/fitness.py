"""How fit a fly is: eq. (1) of the paper, and other measures of how alike its two windows are.

A fly is a left pixel (u, v), the inverse depth q [1/m] at it, and the slopes (qu, qv) [1/m/px] of the inverse depth of
its surface: on a plane, inverse depth is affine in the pixel. A fly with slopes 0 is the paper's: its neighbourhood is
taken to face the camera. What a measure's arguments are, `measure.Measure` says.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from flysim.compute.compiled import compiled
from flysim.compute.plugged import Plugged, by_plugged, callable_in_kernels, refuse_what_does_not_compile
from flysim.flies.measure import MEASURES, OF, Measure, find_measure, measure
from flysim.stereo.told import trust
from flysim.stereo.windows import SCALE, gradient_left, gradient_right, squared_difference, sums

OUT_OF_VIEW = np.float32(-1.0)  # a fly out of either view is rejected, not scored 0
# [grey levels^2] added to the mean squared difference: 8-bit rounding of two images and the blur of one
# interpolation leave about this much on a perfect match, and eq. (1) has a pole there.
NOISE = 0.25
ENDLESS = 1 << 62  # a limit on a sum that it cannot reach


def _most(gl, gr, needed):
    return gl * gr / needed - NOISE


@measure(settled=2.0, of="difference", limit=_most)
def epipolar(gl, gr, difference):
    """Eq. (1): both gradients over the mean squared difference. About 1 / e^2, e the misplacement in pixels."""
    return gl * gr / (difference + NOISE)


paper = replace(epipolar, norm=True)  # with the norms of the gradients, as eq. (1) is printed


@measure(settled=math.log(3.0))
def louchet(gl, gr, n, sl, sr, sll, srr, slr):
    """log(1 + eq. (1) with each window's mean taken off): blind to exposure, flat at the top (Louchet, 2001)."""
    zero_mean = sll + srr - 2.0 * slr - (sl - sr) ** 2 / n
    return math.log(1.0 + gl * gr / (max(zero_mean, 0.0) / n + NOISE))


@measure(settled=0.8)
def zncc(gl, gr, n, sl, sr, sll, srr, slr):
    """Zero-mean normalised cross-correlation, at least 0; NOISE in both variances keeps plain windows down."""
    variances = ((sll - sl * sl / n) / n + NOISE) * ((srr - sr * sr / n) / n + NOISE)
    return max((slr - sl * sr / n) / n, 0.0) / math.sqrt(variances)


_zncc = compiled(zncc.function)


@measure(settled=1.6)
def product(gl, gr, n, sl, sr, sll, srr, slr):
    """Eq. (1) times ZNCC: windows must be alike in value and in shape."""
    eq1 = gl * gr / (max(sll + srr - 2.0 * slr, 0.0) / n + NOISE)
    return eq1 * _zncc(gl, gr, n, sl, sr, sll, srr, slr)


@lru_cache(maxsize=64)
def plugged(name: str) -> Plugged:
    """The measure of a name or of a `module:object`, as kernels take it.

    Raises:
        FlysimError: of `measure.find_measure`.
    """
    found = Plugged(find_measure(name))
    if name not in MEASURES.builtin:
        refuse_what_does_not_compile(found, "measure", name, (1.0,) * len(OF[found.what.of]))
    return found


def _of_windows(plugged, views, gl, gr, u, v, w, half, needed):
    """The measure of both windows; any fitness below `needed`, and 0, is worth the same where there is a limit."""


@by_plugged(_of_windows)
def of_windows(one: Measure) -> Callable[..., Any]:
    """`_of_windows`, by the kind of the measure."""
    fitness = callable_in_kernels(one.function)
    if one.of == "sums":

        def of_sums(plugged, views, gl, gr, u, v, w, half, needed):
            sl, sr, sll, srr, slr = sums(views, u, v, w, half)
            return fitness(gl, gr, 3 * (2 * half + 1) * (2 * half + 1), sl, sr, sll, srr, slr)

        return of_sums
    if one.limit is None:

        def of_difference(plugged, views, gl, gr, u, v, w, half, needed):
            total = squared_difference(views, u, v, w, half, ENDLESS)
            return fitness(gl, gr, total / (3 * (2 * half + 1) * (2 * half + 1) * SCALE * SCALE))

        return of_difference
    limit = callable_in_kernels(one.limit)

    def of_limited_difference(plugged, views, gl, gr, u, v, w, half, needed):
        n = 3 * (2 * half + 1) * (2 * half + 1)
        most = ENDLESS
        if needed > 0.0:
            enough = limit(gl, gr, needed)
            if enough < 0.0:
                return 0.0
            if enough < 65536.0:
                most = int(enough * n * SCALE * SCALE) + 1
        total = squared_difference(views, u, v, w, half, most)
        return fitness(gl, gr, total / (n * SCALE * SCALE)) if total <= most else 0.0

    return of_limited_difference


@compiled
def evaluate(views, norm, measure, u, v, w, half, needed):
    """Fitness of a fly in view; 0 where it cannot reach `needed`, which is found sooner. `measure`: of `plugged`.

    Where a pair hardly tells depth, as near the epipole, it counts for less (`stereo.told.trust`).
    """
    weight = trust(views, w)
    if not weight > 0.0:
        return 0.0
    gl, gr = gradient_left(views, u, v, norm), gradient_right(views, int(w.u + 0.5), int(w.v + 0.5), norm)
    return weight * of_windows(measure, views, gl, gr, u, v, w, half, needed / weight)
