"""Which pictures of a drive with one camera make a pair, and why some make none.

The paper's robot "has monocular vision (one camera system)": two of its stops are its two eyes. The later picture is
the left one of the pair, since the robot is there now; where it drove ahead, the earlier one sees all that it shows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, inverse, transform
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.products.frame import Frame
from flysim.products.shot import Shot

# [m] of the baseline of two stops one after the other: a camera that stands beside the axis it is turned about moves by
# less, and in `yard` hops of 1.5 m tell half of what is there.
LEAST, MOST = 0.06, 2.0
SHARED = 0.1  # share of the later picture that the earlier one sees as well, at the depth at which it sees most
DEPTHS = (0.25, 0.5, 1.0)  # of the farthest that is searched
GRID = 12  # places along each side of a picture at which that is asked
TOLD = 5  # stops without a pair that a sentence names


@dataclass(frozen=True, slots=True, kw_only=True)
class PairRule:
    """Which of the earlier stops is a stop's other eye. Refuses nonsense with a ValueError that names the figure.

    Attributes:
        consecutive: the one before, and no other; else the last one whose distance is in range.
        least, most: range of the believed baseline [m].
    """

    consecutive: bool = True
    least: float = LEAST
    most: float = MOST

    def __post_init__(self) -> None:
        if not (0.0 < self.least < self.most and math.isfinite(self.most)):
            raise ValueError(
                f"a baseline must be two numbers 0 < least < most [m], got [{self.least:g}, {self.most:g}]"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Refusal:
    """A stop that makes no pair, and why not."""

    index: int
    why: str


def partner(rule: PairRule, camera: Camera, path: Sequence[Array], max_range: float) -> int | Refusal:
    """The place in `path` of the last pose's other eye, or why there is none.

    Args:
        rule: which may be one.
        camera: at all places.
        path: `[4, 4]` optical frames in the world, in order.
        max_range: depth of the farthest that is searched [m].
    """
    now, last = len(path) - 1, None
    for k in range(now - 1, -1, -1):
        T = inverse(path[k]) @ path[now]
        baseline = float(np.linalg.norm(T[:3, 3]))
        if baseline < rule.least:
            little = "no parallax" if baseline < LEAST else f"less than {rule.least:g} m"
            why = f"{baseline:.3f} m from stop {k + 1}: {little}"
        elif baseline > rule.most:
            why = f"{baseline:.2f} m from stop {k + 1}, more than {rule.most:g} m"
        elif shared(camera, T, max_range) < SHARED:
            why = f"it sees nothing of what stop {k + 1} saw"
        else:
            return k
        last = last or why
        if rule.consecutive:
            break
    return Refusal(index=now, why=last or "there is no stop before it")


def shared(camera: Camera, T_right_left: Array, max_range: float) -> float:
    """Share of the left picture that the right camera sees, at the depth up to `max_range` [m] at which it is most."""
    u, v = np.meshgrid(np.linspace(0, camera.width - 1, GRID), np.linspace(0, camera.height - 1, GRID))
    pixels, seen = np.column_stack([u.ravel(), v.ravel()]), []
    for depth in DEPTHS:
        points = transform(T_right_left, camera.unproject(pixels, np.full(len(pixels), depth * max_range)))
        ahead = points[points[:, 2] > 1e-6]
        seen.append(camera.contains(camera.project(ahead)).sum() / len(pixels))
    return float(max(seen))


class Pairing:
    """Makes pairs of the pictures of a drive as they come."""

    def __init__(self, rule: PairRule, max_range: float) -> None:
        """Before the first picture.

        Args:
            rule: which make a pair.
            max_range: depth of the farthest that is searched [m].
        """
        self._rule, self._max_range = rule, max_range
        self._shots: list[Shot] = []
        self._refusals: list[Refusal] = []
        self._pairs = 0

    def add(self, shot: Shot) -> Frame | None:
        """The pair that a picture makes with an earlier one; None: it makes none, and is kept for those to come."""
        self._shots.append(shot)
        found = partner(self._rule, shot.camera, [one.T_world_left for one in self._shots], self._max_range)
        if isinstance(found, Refusal):
            if len(self._shots) > 1:
                self._refusals.append(found)
            return None
        self._pairs += 1
        return pair_of(shot, self._shots[found])

    def notes(self) -> tuple[str, ...]:
        """One sentence about the stops that made no pair; none where all but the first did."""
        return refused(self._refusals, len(self._shots), self._pairs)


def refused(refusals: Sequence[Refusal], stops: int, pairs: int) -> tuple[str, ...]:
    """One sentence about stops that make no pair, and what is kept."""
    if not refusals:
        return ()
    named = "; ".join(f"stop {one.index + 1} ({one.why})" for one in refusals[:TOLD])
    more = f"; and {len(refusals) - TOLD} more" if len(refusals) > TOLD else ""
    make, kept = "makes" if len(refusals) == 1 else "make", "pair is" if pairs == 1 else "pairs are"
    return (f"{len(refusals)} of {stops} stops {make} no pair: {named}{more}. {pairs} {kept} kept.",)


def pair_of(later: Shot, earlier: Shot) -> Frame:
    """Both pictures as a pair: the later one is the left one, where the robot is."""
    T_right_left = inverse(earlier.T_world_left) @ later.T_world_left
    rig = StereoRig(left=later.camera, right=earlier.camera, T_right_left=T_right_left)
    return Frame(
        index=later.index,
        time=later.time,
        pair=ImagePair(left=later.image, right=earlier.image, rig=rig),
        T_world_base=later.T_world_base,
        T_base_left=later.T_base_left,
        other=earlier.index,
        other_time=earlier.time,
    )
