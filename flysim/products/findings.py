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

    `error` is one line where the engine failed at this frame, whose swarm is empty then.
    """

    frame: Frame
    swarm: Swarm
    seconds: float
    error: str | None = None


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
        """What the engine failed at, one line a frame: nothing of these frames is in the cloud."""
        return tuple(one.error for one in self.seen if one.error is not None)

    @property
    def see_s(self) -> float:
        """Wall-clock seconds that the engine took for all frames."""
        return float(sum(one.seconds for one in self.seen))

    @property
    def total_s(self) -> float:
        """Wall-clock seconds of it all: the frames taken, seen, located and fused."""
        located_s = self.located.seconds if self.located else 0.0
        return self.sequence.seconds + self.see_s + located_s + self.obstacles_s
