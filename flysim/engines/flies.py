"""The flies as an engine: a swarm evolved on each frame, which may begin with flies of the frame before."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace

import numpy as np

from flysim.engines.standing import standing
from flysim.flies.carry import Carried, carried
from flysim.flies.compared import Compared, compare
from flysim.flies.evolution import evolve
from flysim.flies.parameters import FlyParams
from flysim.geometry.frames import Array, inverse, transform
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.products.frame import Frame
from flysim.products.swarm import Swarm
from flysim.stereo.alignment import WORTH_PX, Misalignment, misalignment
from flysim.stereo.sharpness import Softening, softening

ROUNDS = 3  # of evolving, asking whether rows meet, and correcting them, in the first frame of a sequence
SCOUTS = 800  # of them some 270 settle; what is told follows 160 matches at least
TRUSTED_PX = 0.3  # what rows are told to lie apart by at first; taken from them, it need not be asked about again
ASKED = 3  # frames of a sequence that are asked where the first one's rows do not meet; else it alone is


class _Levels:
    """A pair with its rows as they were found to lie, made ready for flies: once for all who evolve on it so."""

    def __init__(self, pair: ImagePair, params: FlyParams) -> None:
        self._pair, self._params = pair, params
        self._made: tuple[Misalignment, ImagePair, Compared] | None = None

    def of(self, off: Misalignment) -> tuple[ImagePair, Compared]:
        """What flies evolve on where rows lie so far apart."""
        if self._made is None or self._made[0] != off:
            level = self._pair
            if off != Misalignment():
                level = replace(level, right=off.levelled(level.right, level.rig))
            self._made = off, level, compare(level, self._params)
        return self._made[1:]


class Flies:
    """The fly algorithm, frame by frame.

    With `FlyParams.carry_below` above 0 flies outlive the picture (Louchet's dynamic flies): those that sit on what
    stands are carried along by the believed motion of the camera, and the next frame's first generation breeds from
    them. With 0 each frame is seen for itself.

    Where `FlyParams.align` says so, the flies of the first frames tell whether the rows of both eyes meet. What they
    lie apart is taken from the right picture from then on, and said in every swarm (`Swarm.rows_px`, `roll_deg`).
    Where one eye of the first frame is out of focus, and more flies settle so, the other one is softened alike from
    then on.
    """

    def begin(self, rig: StereoRig, params: FlyParams) -> None:
        """A new sequence: no flies, and rows that meet."""
        self._params = params
        self._last: tuple[Array, Array, Array] | None = None  # points, normals, and the T_world_left they belong to
        self._off = Misalignment()
        self._soft: Softening | None = None if params.align else Softening()  # None: to be found
        self._to_ask = ASKED if params.align and rig.rectified else 0

    def see(self, frame: Frame, *, rng: np.random.Generator) -> Swarm:
        """The flies that settled in a frame, fittest first."""
        T_world_left, before = frame.T_world_left, None
        if self._last is not None:
            points, normals, T_world_before = self._last
            before = carried(points, normals, frame.pair.rig.left, inverse(T_world_left) @ T_world_before)
        if frame.other is None:
            swarm = self._aligned(frame.pair, before, rng)
        else:  # one eye is not out of focus against itself, and its rows lie wherever it went
            compared = compare(frame.pair, self._params)
            swarm = evolve(frame.pair, self._params, rng=rng, compared=compared, carried=before)
        if self._params.carry_below > 0.0:
            points, normals = swarm.points.astype(np.float64), swarm.normals.astype(np.float64)
            stands = standing(transform(frame.T_base_left, points), self._params.carry_below)
            self._last = points[stands], normals[stands], T_world_left
        return swarm

    def _confirmed(self, soft: Softening, pair: ImagePair, rng: np.random.Generator) -> Softening:
        """What the spectra tell, if it lets more flies settle: one eye may as well see what the other does not."""
        if soft == Softening():
            return soft
        counts = [
            len(evolve(p, self._params, rng=deepcopy(rng), compared=compare(p, self._params)).points)
            for p in (pair, soft.pair(pair))
        ]
        return soft if counts[1] > counts[0] else Softening()

    def _scouted(self, pair: ImagePair, levels: _Levels, rng: np.random.Generator) -> bool:
        """Whether a few flies, sent ahead and forgotten, tell that rows meet, at once or when they are corrected."""
        few = replace(self._params, population=min(self._params.population, SCOUTS))
        # What a large misplacement leaves was told by matches that were still wrong: asked about until it is small.
        for enough in (TRUSTED_PX, *[WORTH_PX] * (ROUNDS - 2)):
            level, compared = levels.of(self._off)
            apart = self._ask(pair, compared, evolve(level, few, rng=deepcopy(rng), compared=compared, exact=False))
            if apart is not None and apart <= enough:
                return True
        return False

    def _ask(self, pair: ImagePair, compared: Compared, swarm: Swarm) -> float | None:
        """By how much a swarm tells that rows do not meet [px]; they are corrected where that is worth it.

        None where it tells nothing.
        """
        views = compared.views
        found = misalignment(views.grey_left, views.grey_right, swarm.uv, swarm.uv_right, pair.rig)
        if found is None:
            return None
        apart = found.misplaced(pair.rig.right.width)
        if apart > WORTH_PX:
            self._off = found.after(self._off)
        return apart

    def _aligned(self, pair: ImagePair, before: Carried | None, rng: np.random.Generator) -> Swarm:
        """The swarm on a pair whose rows were made to meet, as far as is known by then."""
        if self._soft is None:
            self._soft = self._confirmed(softening(pair.left, pair.right), pair, rng)
        pair = self._soft.pair(pair)
        levels, first = _Levels(pair, self._params), self._to_ask == ASKED
        asks = self._to_ask > 0 and not (first and self._scouted(pair, levels, rng))
        for left in reversed(range(ROUNDS if first else 1)):
            level, compared = levels.of(self._off)
            swarm = evolve(level, self._params, rng=rng, compared=compared, carried=before)
            apart = self._ask(pair, compared, swarm) if asks else None
            if left == 0 or apart is None or apart <= WORTH_PX:
                break
        self._to_ask = max(self._to_ask - 1, 0) if self._off != Misalignment() else 0
        swarm = replace(swarm, softened_left_px=self._soft.left_px, softened_right_px=self._soft.right_px)
        if not (self._params.align and pair.rig.rectified):
            return swarm
        said = replace(swarm, rows_px=self._off.rows_px, roll_deg=self._off.roll_deg)
        if self._off == Misalignment():
            return said
        uv_right = self._off.corrected(pair.rig).project(swarm.points.astype(np.float64))[1]
        return replace(said, uv_right=uv_right.astype(np.float32))
