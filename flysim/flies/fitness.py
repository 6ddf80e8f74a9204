"""How fit a fly is: eq. (1) of the paper, and other measures of how alike its two windows are.

A fly is a left pixel (u, v), the inverse depth q [1/m] at it, and the slopes (qu, qv) [1/m/px] of the inverse depth of
its surface: on a plane, inverse depth is affine in the pixel. A fly with slopes 0 is the paper's: its neighbourhood is
taken to face the camera.

Every measure is a plain function of one signature, `(gl, gr, n, sl, sr, sll, srr, slr) -> float`: both gradients
[grey levels / px], the number of samples of a window (pixels times colours), and the sums of L, R, L L, R R, L R over
them. None is negative: below 0 is the mark of a rejected fly.
"""

from __future__ import annotations

import math

import numpy as np

from flysim.compute.compiled import compiled, inlined
from flysim.stereo.windows import SCALE, gradient_left, gradient_right, squared_difference, sums

OUT_OF_VIEW = np.float32(-1.0)  # a fly out of either view is rejected, not scored 0
# [grey levels^2] added to the mean squared difference: 8-bit rounding of two images and the blur of one
# interpolation leave about this much on a perfect match, and eq. (1) has a pole there.
NOISE = 0.25
ENDLESS = 1 << 62  # a limit on a sum that it cannot reach


@inlined
def eq1(gl, gr, n, sl, sr, sll, srr, slr):
    """Eq. (1): both gradients over the mean squared difference. About 1 / e^2, e the misplacement in pixels."""
    return gl * gr / (max(sll + srr - 2.0 * slr, 0.0) / n + NOISE)


@inlined
def louchet(gl, gr, n, sl, sr, sll, srr, slr):
    """log(1 + eq. (1) with each window's mean taken off): blind to exposure, flat at the top (Louchet, 2001)."""
    zero_mean = sll + srr - 2.0 * slr - (sl - sr) ** 2 / n
    return math.log(1.0 + gl * gr / (max(zero_mean, 0.0) / n + NOISE))


@inlined
def zncc(gl, gr, n, sl, sr, sll, srr, slr):
    """Zero-mean normalised cross-correlation, at least 0; NOISE in both variances keeps plain windows down."""
    variances = ((sll - sl * sl / n) / n + NOISE) * ((srr - sr * sr / n) / n + NOISE)
    return max((slr - sl * sr / n) / n, 0.0) / math.sqrt(variances)


@inlined
def product(gl, gr, n, sl, sr, sll, srr, slr):
    """Eq. (1) times ZNCC: windows must be alike in value and in shape."""
    return eq1(gl, gr, n, sl, sr, sll, srr, slr) * zncc(gl, gr, n, sl, sr, sll, srr, slr)


# By the name a scenario gives it: the measure, and the fitness from which a fly counts as settled.
FORMS = {
    "epipolar": (eq1, 2.0),  # gradients along the epipolar line
    "paper": (eq1, 2.0),  # norms of the gradients, as eq. (1) is printed
    "louchet": (louchet, math.log(3.0)),
    "zncc": (zncc, 0.8),
    "product": (product, 1.6),
}
_LOUCHET, _ZNCC = (list(FORMS).index(name) for name in ("louchet", "zncc"))


def code(name: str) -> tuple[bool, int | None]:
    """(norm, other) by which the kernels know a measure: a function handed to them would be compiled at every start.

    `norm` takes the norms of the gradients. `other` is None for eq. (1), so that the others are compiled when one is
    asked for, and not before: numba leaves out the branches that the type None does not take.
    """
    return name == "paper", None if FORMS[name][0] is eq1 else list(FORMS).index(name)


@compiled
def evaluate(views, norm, other, u, v, w, half, needed):
    """Fitness of a fly in view; 0 where it cannot reach `needed`, which is found sooner. `norm, other`: by `code`."""
    gl, gr = gradient_left(views, u, v, norm), gradient_right(views, int(w[0] + 0.5), int(w[1] + 0.5), norm)
    n = 3 * (2 * half + 1) * (2 * half + 1)
    if other is None:
        most, enough = ENDLESS, 0.0
        if needed > 0.0:
            enough = gl * gr / needed - NOISE
            if enough < 0.0:
                return 0.0
            if enough < 65536.0:
                most = int(enough * n * SCALE * SCALE) + 1
        total = squared_difference(views, u, v, w, half, most)
        return gl * gr / (total / (n * SCALE * SCALE) + NOISE) if total <= most else 0.0  # eq. (1)
    else:
        sl, sr, sll, srr, slr = sums(views, u, v, w, half)
        if other == _LOUCHET:
            return louchet(gl, gr, n, sl, sr, sll, srr, slr)
        if other == _ZNCC:
            return zncc(gl, gr, n, sl, sr, sll, srr, slr)
        return product(gl, gr, n, sl, sr, sll, srr, slr)
