"""Where a robot that finds its way by what it sees must look on the way to a stop, lest it lose the place.

Two frames that share nothing tell nothing of how they stand to each other. So a robot that is about to look where none
of its frames looked yet looks on the way as well, wherever the next view would otherwise share too little with those
before. The ways are driven as they are without: a look is a halt.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from flysim.geometry.frames import Pose2, wrap_angle
from flysim.sim.driving import DriveParams, direction
from flysim.sources.way import Halt

STEP_M, STEP_DEG = 0.05, 5.0  # of the way that is planned


@dataclass(frozen=True, slots=True, kw_only=True)
class Glance:
    """A look on the way, or what is left of the way to a stop: a `Halt`.

    Attributes:
        pose: where to halt, world frame.
        via: points x, y [m] that are driven through on the way there.
    """

    pose: Pose2
    via: tuple[tuple[float, float], ...]


def glances(start: Pose2, halt: Halt, known: Sequence[Pose2], params: DriveParams) -> list[Glance]:
    """The looks on the way to a stop, the fewest, and last the stop itself.

    Args:
        start: where the robot believes to stand.
        halt: the stop.
        known: of what was seen so far, where from.
        params: how far apart two looks may be.
    """
    seen, found, via = list(known), [], []
    before: tuple[Pose2, tuple[tuple[float, float], ...]] | None = None
    for pose, passed in _sampled(start, halt):
        if passed is not None:
            via.append(passed)
        if any(_shared(one, pose, params) for one in seen):
            before = pose, tuple(via)
        elif before is not None:
            found.append(Glance(pose=before[0], via=before[1]))
            seen.append(before[0])
            via = [point for point in via if point not in before[1]]
            before = (pose, tuple(via)) if _shared(seen[-1], pose, params) else None
    return [*found, Glance(pose=halt.pose, via=tuple(via))]


def _shared(one: Pose2, other: Pose2, params: DriveParams) -> bool:
    """Whether two views show enough of the same."""
    turn = abs(wrap_angle(one.yaw - other.yaw)) / math.radians(params.look_turn_deg)
    return math.hypot(one.distance(other) / params.look_way, turn) <= 1.0


def _sampled(start: Pose2, halt: Halt) -> Iterator[tuple[Pose2, tuple[float, float] | None]]:
    """The way to a stop pose by pose, as `drive` goes it, each with the point of the path that it passes."""
    x, y, yaw = start.x, start.y, start.yaw
    ends = [(px, py, None, (px, py)) for px, py in halt.via]
    for px, py, looks, passed in [*ends, (halt.pose.x, halt.pose.y, halt.pose.yaw, None)]:
        far = math.hypot(px - x, py - y)
        if far > STEP_M:
            bearing = math.atan2(py - y, px - x)
            ahead = direction(yaw, bearing, bearing if looks is None else looks)
            heading = bearing if ahead > 0.0 else wrap_angle(bearing + math.pi)
            yield from ((Pose2(x, y, one), None) for one in _turned(yaw, heading))
            steps = math.ceil(far / STEP_M)
            for k in range(1, steps + 1):
                yield Pose2(x + (px - x) * k / steps, y + (py - y) * k / steps, heading), passed if k == steps else None
            x, y, yaw = px, py, heading
        elif passed is not None:
            yield Pose2(x, y, yaw), passed
        if looks is not None:
            yield from ((Pose2(x, y, one), None) for one in _turned(yaw, looks))


def _turned(yaw: float, to: float) -> list[float]:
    """The headings of a turn, the last one included."""
    turn = wrap_angle(to - yaw)
    steps = math.ceil(abs(turn) / math.radians(STEP_DEG))
    return [wrap_angle(yaw + turn * k / steps) for k in range(1, steps + 1)]
