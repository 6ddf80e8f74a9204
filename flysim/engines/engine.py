"""What sees for a robot: frames in, one after the other, and for each the points on surfaces that are seen in it.

An engine has a state: `begin` is called once for a sequence of frames, `see` once a frame, in order. One without a
state is a plain function, `see(pair, params, *, rng) -> Swarm`; `Stateless` makes an engine of it. The same engines
serve `flysim run`, `compare`, `suite` and the gymnasium environment.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from flysim.flies.parameters import FlyParams
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.products.frame import Frame
from flysim.products.swarm import Swarm


class Engine(Protocol):
    """Sees the surfaces in frames."""

    def begin(self, rig: StereoRig, params: FlyParams) -> None:
        """A new sequence of frames begins; nothing has been seen.

        Args:
            rig: the cameras of all its frames, as the robot believes them.
            params: depths to search and flies to spend; which of them an engine reads its module tells.
        """
        ...

    def see(self, frame: Frame, *, rng: np.random.Generator) -> Swarm:
        """The surfaces seen in the next frame.

        Args:
            frame: the pair, and where the robot believes it was taken.
            rng: the only source of randomness for this frame; most engines but the flies take nothing from it.
        """
        ...


See = Callable[..., Any]  # Swarm of see(pair: ImagePair, params: FlyParams, *, rng: np.random.Generator)


class Stateless:
    """An engine that makes of each pair what a function makes of it, whatever came before."""

    def __init__(self, see: See) -> None:
        self._see = see

    def begin(self, rig: StereoRig, params: FlyParams) -> None:
        """A new sequence: remembers its rig and parameters."""
        self._params = params

    def see(self, frame: Frame, *, rng: np.random.Generator) -> Swarm:
        """What the function makes of the frame's pair."""
        return self._see(frame.pair, self._params, rng=rng)


def alone(engine: Engine, pair: ImagePair, params: FlyParams, *, rng: np.random.Generator) -> Swarm:
    """What an engine sees in a pair that nothing came before."""
    engine.begin(pair.rig, params)
    return engine.see(Frame.alone(pair), rng=rng)
