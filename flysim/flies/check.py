"""Tests that a user's measure or operator gets for nothing, as flysim's own have them: compiled against plain numpy."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flysim.compute.randomness import stream
from flysim.flies import fitness, operators
from flysim.flies.measure import Measure
from flysim.flies.operator import Genes, Kind
from flysim.flies.parameters import FlyParams
from flysim.flies.rules import rules_of
from flysim.geometry.camera import Camera
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.stereo.views import prepare
from flysim.stereo.windows import warp

# A pixel is an eighth of 1/m, which a float holds exactly: windows at whole disparities need no interpolation.
_LENS = Camera(width=64, height=48, fx=64.0, fy=64.0, cx=31.5, cy=23.5)
_RIG = StereoRig.parallel(_LENS, 0.125)
_GAIN = 8.0
_TRUE_PX = 6


def check_measure(name: str, *, rng: np.random.Generator, tries: int = 200) -> None:
    """Holds a measure of fitness against what it says, on windows of pairs of noise and of nearly equal ones.

    Compiled and in plain Python on numpy's sums it must give the same, nothing below 0 and nothing that is not finite;
    what it calls enough must be enough; and a right match must be fitter than a wrong one, in the median.

    Args:
        name: as in `FlyParams.fitness`.
        rng: draws images and places.
        tries: places that are looked at.

    Raises:
        AssertionError: it does not; the message has the figures.
        FlysimError: there is no such measure.
    """
    plugged = fitness.plugged(name)
    measure: Measure = plugged.what
    right, wrong = [], []
    for k in range(tries):
        pair = _pair(rng, alike=k % 4 != 0)
        views, half = prepare(pair).record[0], int(rng.integers(1, 5))
        u, v = int(rng.integers(28, 54)), int(rng.integers(6, 42))
        px = _TRUE_PX if k % 2 else int(rng.integers(2, 20))
        w = warp(views, u, v, px / _GAIN, 0.0, 0.0)
        expected = float(measure(*_arguments(measure, pair, u, v, px, half)))
        found = float(fitness.evaluate(views, measure.norm, plugged, u, v, w, half, 0.0))
        where = f"{name} at gradients and windows of try {k}"
        assert math.isfinite(found) and found >= 0.0, f"{where}: {found}; it must be finite and not below 0"
        assert math.isclose(found, expected, rel_tol=1e-4, abs_tol=1e-6), f"{where}: compiled {found}, plain {expected}"
        enough = float(fitness.evaluate(views, measure.norm, plugged, u, v, w, half, 0.99 * found))
        assert enough == found, f"{where}: {enough} where {0.99 * found} was needed, {found} where nothing was"
        if k % 4:
            (right if px == _TRUE_PX else wrong).append(found)
    assert np.median(right) > np.median(wrong), (
        f"{name}: right matches have {np.median(right)}, wrong {np.median(wrong)}"
    )


def check_operator(kind: Kind, name: str, *, rng: np.random.Generator, tries: int = 200) -> None:
    """Holds an operator to what breeding needs: the same child of the same draws, other children of other draws.

    Args:
        kind: "crossover" or "mutation".
        name: as in `FlyParams.crossover` or `FlyParams.mutation`.
        rng: draws the parents.
        tries: children.

    Raises:
        AssertionError: it does not, or a child has a gene that is no number; the message has the figures.
        FlysimError: there is no such operator.
    """
    born = operators.heir if kind == "crossover" else operators.mutant
    plugged = operators.plugged(kind, name)
    views = prepare(_pair(rng, alike=True)).record[0]
    rules = rules_of(FlyParams(), norm=False, settled=2.0, cell=4, gain=_GAIN).view(np.recarray)[0]
    children = set()
    for k in range(tries):
        parents = [_fly(np.random.default_rng(s)) for s in rng.integers(0, 2**32, 2 if kind == "crossover" else 1)]
        for _ in range(2):
            state = np.uint64(stream(np.uint64(7), 0, k))
            child = Genes(*born(plugged, views, rules, *parents, state, 1))
            assert all(map(math.isfinite, child)), f"{name}: {child} of {parents}"
            children.add(child)
    assert len(children) <= tries, f"{name}: the same parents and draws have given different children"
    assert len(children) > tries / 2, f"{name}: {tries} pairs of parents and draws have {len(children)} children"


def _fly(rng: np.random.Generator) -> Genes:
    return Genes(float(rng.integers(8, 56)), float(rng.integers(8, 40)), float(rng.uniform(0.3, 1.5)), 0.0, 0.0)


def _pair(rng: np.random.Generator, *, alike: bool) -> ImagePair:
    """A wall `_TRUE_PX` away with a little noise, or two images that have nothing to do with each other."""
    left = rng.integers(0, 256, (_LENS.height, _LENS.width, 3)).astype(float)
    left = (left + np.roll(left, 1, 0) + np.roll(left, 1, 1)) / 3.0
    right = np.roll(left, -_TRUE_PX, axis=1) + rng.normal(0.0, 2.0, left.shape) if alike else np.roll(left, 17, axis=0)
    return ImagePair(left=left.astype(np.uint8), right=right.clip(0, 255).astype(np.uint8), rig=_RIG)


def _arguments(measure: Measure, pair: ImagePair, u: int, v: int, px: int, half: int) -> tuple[float, ...]:
    """What the measure takes, by numpy alone."""
    gl, gr = (_gradient(image, x, v, measure.norm) for image, x in ((pair.left, u), (pair.right, u - px)))
    rows = slice(v - half, v + half + 1)
    one = pair.left[rows, u - half : u + half + 1].astype(float)
    other = pair.right[rows, u - px - half : u - px + half + 1].astype(float)
    if measure.of == "difference":
        return gl, gr, float(((one - other) ** 2).mean())
    sums = (one.sum(), other.sum(), (one**2).sum(), (other**2).sum(), (one * other).sum())
    return gl, gr, float(one.size), *map(float, sums)


def _gradient(image: NDArray[np.uint8], u: int, v: int, norm: bool) -> float:
    """Sobel's at a pixel, root mean square over the colours [grey levels / px]; along the row, or its norm."""
    box = image[v - 1 : v + 2, u - 1 : u + 2].astype(float)
    smooth = np.array([1.0, 2.0, 1.0])
    across = np.einsum("v,vuc,u->c", smooth, box, np.array([-1.0, 0.0, 1.0])) / 8.0
    down = np.einsum("v,vuc,u->c", np.array([-1.0, 0.0, 1.0]), box, smooth) / 8.0
    return float(np.sqrt((across**2 + (down**2 if norm else 0.0)).mean()))
