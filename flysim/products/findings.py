"""What an engine made of a sequence of frames. It needs no truth, and holds none."""

from __future__ import annotations

from dataclasses import dataclass

from flysim.products.cloud import FlyCloud
from flysim.products.frame import Frame, FrameSequence
from flysim.products.located import Located
from flysim.products.obstacle import Obstacle
from flysim.products.swarm import Swarm


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Seen:
    """A frame, the swarm that an engine saw in it, and the wall-clock seconds it took.

    `error` is one line where the engine failed at this frame, whose swarm is empty then; `missed` has one for each
    glance on the way to it that the engine failed at.
    """

    frame: Frame
    swarm: Swarm
    seconds: float
    error: str | None = None
    missed: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Findings:
    """All that an engine believes after a sequence.

    Attributes:
        engine: its name.
        sequence: the frames that it saw.
        seen: one a frame, in order.
        cloud: the flies of all frames in the world, as far as the frames' poses tell.
        obstacles: what they were fused to, the one with most flies first.
        obstacles_s: wall-clock seconds of clustering and fusion.
        max_range: [m] of depth along the left optical axis; nothing was looked for beyond it.
        located: where the frames were found to be taken; None where odometry was believed. The frames of `seen` are
            there, those of `sequence` where odometry has them.
    """

    engine: str
    sequence: FrameSequence
    seen: tuple[Seen, ...]
    cloud: FlyCloud
    obstacles: tuple[Obstacle, ...]
    obstacles_s: float
    max_range: float
    located: Located | None = None

    @property
    def failed(self) -> tuple[str, ...]:
        """What the engine failed at, one line a frame or glance: nothing of these is in the cloud."""
        lines = ((*one.missed, one.error) for one in self.seen)
        return tuple(line for of_frame in lines for line in of_frame if line is not None)

    @property
    def see_s(self) -> float:
        """Wall-clock seconds that the engine took for all frames."""
        return float(sum(one.seconds for one in self.seen))

    @property
    def total_s(self) -> float:
        """Wall-clock seconds of it all: the frames taken, seen, located and fused."""
        located_s = self.located.seconds if self.located else 0.0
        return self.sequence.seconds + self.see_s + located_s + self.obstacles_s
