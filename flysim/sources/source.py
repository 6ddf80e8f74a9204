"""What yields frames, and has their truth if anybody has it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from flysim.geometry.frames import Array
from flysim.geometry.rig import StereoRig
from flysim.products.frame import Frame, FrameSequence
from flysim.truth.truth import Truth


class Source(Protocol):
    """Yields frames once, in order. It knows what they were of when the last one is taken."""

    @property
    def rig(self) -> StereoRig:
        """The cameras of all frames, as the robot believes them."""
        ...

    @property
    def planned(self) -> int:
        """How many frames there are to be."""
        ...

    def frames(self) -> Iterator[Frame]:
        """Each frame as it is taken, glances too; fewer stops than planned where the way was blocked."""
        ...

    def stands(self, T_world_base: Array) -> None:
        """Tells it where the robot stood in the latest frame, `[4, 4]`, as found: a drive goes on from there."""
        ...

    def sequence(self) -> FrameSequence:
        """All frames that were taken, and what they are of."""
        ...

    def truth(self) -> Truth | None:
        """What truly was there; None where nobody knows."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Replayed:
    """A `Source` of frames that are there already: taken by another, or read from files. It can be seen many times.

    Attributes:
        of: the frames, and what they are of.
        rig: their cameras, as the robot believes them.
        known: their truth, where somebody knows it.
        taken: the frames with the glances between them; None: there are none.
    """

    of: FrameSequence
    rig: StereoRig
    known: Truth | None = None
    taken: tuple[Frame, ...] | None = None

    @property
    def planned(self) -> int:
        """How many frames there are: none is missing."""
        return len(self.of.frames)

    def frames(self) -> Iterator[Frame]:
        """Yields all frames, in order."""
        return iter(self.of.frames if self.taken is None else self.taken)

    def stands(self, T_world_base: Array) -> None:
        """Changes nothing: the frames are there already."""

    def sequence(self) -> FrameSequence:
        """The frames with what they are of: scenario, seed, renderer."""
        return self.of

    def truth(self) -> Truth | None:
        """What is known of them."""
        return self.known
