"""What flies compare of a pair: its grey levels, or how they change along the rows in the picture's own unit."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.flies.parameters import FlyParams
from flysim.flies.threads import lanes, share
from flysim.geometry.rig import ImagePair
from flysim.stereo.exposure import MOST, levels_alike
from flysim.stereo.prefilter import LEAST_BLUR, plain_share, prefiltered, read_off, units
from flysim.stereo.views import Views, prepare, views_of

ALIKE = 2.5  # [grey levels] of the median difference of matched levels: by more, they tell a place less well


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Compared:
    """A pair made ready for flies.

    Attributes:
        views: what the kernels read.
        blur: standard deviation of the smoothing [px]; 0 where the pictures were taken as they are.
        noise: standard deviation of a pixel's noise [grey levels], the larger of both eyes; 0 where it was not asked.
        plain: share of the left picture that shows nothing to match; None where it was not asked.
    """

    views: Views
    blur: float = 0.0
    noise: float = 0.0
    plain: float | None = None


def compare(pair: ImagePair, params: FlyParams, *, blur: float | None = None) -> Compared:
    """Makes a pair ready for flies, as `FlyParams.prefilter` says; eq. (1) as printed takes pictures as they are.

    So does every pair whose rows do not meet: what a camera that moves ahead sees grows, and its derivatives shrink.

    Args:
        pair: two 8-bit RGB images and their rig.
        params: how the swarm evolves.
        blur: in place of `FlyParams.blur_px` and of what the noise asks for [px].
    """
    if params.prefilter == "none" or params.fitness == "paper" or not pair.rig.rectified:
        return Compared(views=prepare(pair))
    images = (pair.left, pair.right)
    told = _each(read_off, images)
    wanted = params.blur_px if blur is None else blur
    smoothed = max(one.blur for one in told) if wanted is None else wanted
    unit = units(images, told, smoothed)
    if pair.left.shape == pair.right.shape:
        left, right = prefiltered(images, smoothed, unit, share, lanes())
    else:
        left, right = (prefiltered([image], smoothed, [one])[0] for image, one in zip(images, unit, strict=True))
    views, plain = _each(lambda made: made(), (lambda: views_of(left, right, pair.rig), lambda: plain_share(left)))
    return Compared(views=views, blur=smoothed, noise=max(one.noise for one in told), plain=plain)


def levels(pair: ImagePair, compared: Compared, pixels: NDArray[np.int32], genes: NDArray[np.floating]) -> Views | None:
    """The grey levels themselves, the right eye's made like the left one's; None where they do not become alike.

    Levels tell a place more exactly than their derivatives do, which a slanted surface stretches.

    Args:
        pair: as it was seen.
        compared: of it, what the flies evolved on.
        pixels, genes: `[N, 2]` and `[N, 3]` of flies that have settled.
    """
    if not 0.0 < compared.blur <= LEAST_BLUR or len(pixels) == 0:  # levels were compared, or are mostly noise
        return None
    every = max(len(pixels) // MOST, 1)
    pixels, genes = pixels[::every], genes[::every]
    points = pair.rig.left.unproject(pixels, 1.0 / genes[:, 0])
    right, apart = levels_alike(pair.left, pair.right, pixels, pair.rig.project(points)[1])
    return views_of(pair.left, right, pair.rig) if apart < ALIKE else None


def _each(function: Callable[[Any], Any], things: Iterable[Any]) -> list[Any]:
    """`[function(thing)]`, side by side: kernels let go of Python's lock."""
    todo = list(enumerate(things))
    found: list[Any] = [None] * len(todo)

    def lane(_: int, todo: list[tuple[int, Any]], found: list[Any]) -> None:
        while True:
            try:
                k, thing = todo.pop()
            except IndexError:
                return
            found[k] = function(thing)

    share(lane, todo, found)
    return found
