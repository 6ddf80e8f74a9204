"""What a robot believes it saw: one stereo pair with its place in the world, and a sequence of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flysim.geometry.frames import R_BODY_OPTICAL, Array, frozen, se3
from flysim.geometry.rig import ImagePair


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frame:
    """A stereo pair, and where the robot believes it was taken. What truly was is `flysim.truth`'s.

    Attributes:
        index: its number in its sequence, from 0.
        time: [s] since the sequence began; simulated seconds where a robot was simulated.
        pair: both images, with the rig as the robot believes it.
        T_world_base: `[4, 4]` pose of base_link (on the floor between the wheels), by odometry or whatever tells it.
        T_base_left: `[4, 4]` where the left camera is mounted: its optical frame in base_link.
        other: index of the stop whose picture the right one is; None: two cameras took both here.
        other_time: [s] when that one was taken; None where both were now.
        glance: it was taken on the way, to find that, and is no stop: nothing of it is kept.
    """

    index: int
    time: float
    pair: ImagePair
    T_world_base: Array
    T_base_left: Array
    other: int | None = None
    other_time: float | None = None
    glance: bool = False

    def __post_init__(self) -> None:
        for name in ("T_world_base", "T_base_left"):
            object.__setattr__(self, name, frozen(getattr(self, name), np.float64))

    @classmethod
    def alone(cls, pair: ImagePair, *, height: float = 0.0, index: int = 0, time: float = 0.0) -> Frame:
        """A pair without a robot, as two photographs are: level, at the world's origin, looking along its x axis.

        Args:
            pair: both images and their rig.
            height: of the left camera above the floor [m].
            index: its number in its sequence.
            time: [s] since the sequence began.
        """
        T_base_left = se3(R_BODY_OPTICAL, (0.0, 0.0, height))
        return cls(index=index, time=time, pair=pair, T_world_base=np.eye(4), T_base_left=T_base_left)

    @property
    def T_world_left(self) -> Array:
        """`[4, 4]` left optical frame in the world, as believed."""
        return self.T_world_base @ self.T_base_left


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrameSequence:
    """Frames in the order they were taken, and what they are of.

    Attributes:
        name: of the scenario or of the data.
        seed: of all that was random about it; 0 where nothing was.
        renderer: what drew the images: "gl", "tiny", or "none" where cameras took them.
        frames: those that were taken.
        planned: how many were to be taken; more than there are if the way was blocked.
        blocked: None, or what the robot ran into, as "blocked at stop 3 of 8 by box_2".
        texture: "speckle" where a bare world was dressed, else None.
        notes: what a reader of the figures should know, one sentence each.
        seconds: wall-clock seconds that driving, drawing or reading took.
    """

    name: str
    frames: tuple[Frame, ...]
    planned: int
    seed: int = 0
    renderer: str = "none"
    blocked: str | None = None
    texture: str | None = None
    notes: tuple[str, ...] = ()
    seconds: float = 0.0
