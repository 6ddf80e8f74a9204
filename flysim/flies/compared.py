"""What flies compare of a pair: its grey levels as they are, or derived along the epipolar lines in the picture's unit."""

from __future__ import annotations

from dataclasses import dataclass

from flysim.flies.parameters import FlyParams
from flysim.flies.threads import share
from flysim.geometry.rig import ImagePair
from flysim.stereo.prefilter import prefiltered, read_off
from flysim.stereo.views import Views, epipoles, prepare


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Compared:
    """A pair made ready for flies.

    Attributes:
        views: what the kernels read.
        blur: standard deviation of the smoothing [px]; 0 where the pictures were taken as they are.
        noise: standard deviation of a pixel's noise [grey levels], the larger of both eyes; 0 where it was not asked.
    """

    views: Views
    blur: float = 0.0
    noise: float = 0.0


def compare(pair: ImagePair, params: FlyParams, *, blur: float | None = None) -> Compared:
    """Makes a pair ready for flies, as `FlyParams.prefilter` says; eq. (1) as printed takes pictures as they are.

    Args:
        pair: two 8-bit RGB images and their rig.
        params: how the swarm evolves.
        blur: in place of `FlyParams.blur_px` and of what the noise asks for [px].
    """
    if params.prefilter == "none" or params.fitness == "paper":
        return Compared(views=prepare(pair))
    images = (pair.left, pair.right)
    told = _each(read_off, images)
    blur = next((b for b in (blur, params.blur_px) if b is not None), max(one.blur for one in told))
    lines = (None, None) if _by_rows(pair) else epipoles(pair.rig)
    left, right = _each(lambda k: prefiltered(images[k], blur, lines[k]), range(2))
    noise = max(one.noise for one in told)
    return Compared(views=prepare(ImagePair(left=left, right=right, rig=pair.rig)), blur=blur, noise=noise)


def _by_rows(pair: ImagePair) -> bool:
    return pair.rig.rectified


def _each(function, things):
    """`[function(thing)]`, side by side: OpenCV lets go of Python's lock."""
    found, todo = [None] * len(things), list(enumerate(things))

    def lane(_, todo, found):
        while True:
            try:
                k, thing = todo.pop()
            except IndexError:
                return
            found[k] = function(thing)

    share(lane, todo, found)
    return found
