"""An engine at work for an agent: from each pair of images to the points that the robot would run into."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flysim.engines.choose import engine
from flysim.engines.standing import standing
from flysim.flies.parameters import FlyParams
from flysim.flies.threads import limited
from flysim.geometry.frames import Array, Pose2, transform
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.products.frame import Frame
from flysim.robots.robot import Robot

NEAR, FAR = 0.3, 5.0  # [m] of depth searched
# Few flies and few generations, ten times a second: flies on what stands outlive the picture, immigrants look for more.
FLIES = FlyParams(
    population=1000,
    operators=(0.3, 0.1, 0.2, 0.4),
    regions=1,
    max_iterations=3,
    min_depth=NEAR,
    max_depth=FAR,
    window=7,
    uniqueness=1.1,
)
# Other engines are asked for 1200 points: of those some 270 stand in `yard`, as many as flies are there.
OTHERS = replace(FLIES, population=4000)


def defaults(name: str) -> FlyParams:
    """The parameters of an engine that nobody set."""
    return FLIES if name == "flies" else OTHERS


class Seeing:
    """An engine, the robot that it sees for, and how many frames it has seen of an episode."""

    def __init__(self, name: str, robot: Robot, rig: StereoRig, params: FlyParams | None = None) -> None:
        """Loads the engine.

        Args:
            name: of the engine, or a `module:object`.
            robot: whose cameras they are, and what it would run into.
            rig: its cameras in the size of the images.
            params: None takes `defaults`. Flies are carried from frame to frame, whatever they say of it, since an
                agent looks ten times a second.

        Raises:
            EngineError: there is no such engine.
        """
        self._engine, self._robot, self._rig = engine(name), robot, rig
        params = defaults(name) if params is None else params
        self._params = params if params.carry_below > 0.0 else replace(params, carry_below=robot.height)

    def begin(self) -> None:
        """A new episode: nothing has been seen."""
        self._engine.begin(self._rig, self._params)
        self._frames = 0

    def see(self, pair: ImagePair, pose: Pose2, time: float, rng: np.random.Generator) -> Array:
        """`[n, 3]` points [m, base_link] above the floor and no higher than the robot, surest first.

        Args:
            pair: what the two cameras see.
            pose: of base_link, as odometry has it.
            time: [s] since the episode began.
            rng: the engine's source of randomness.
        """
        frame = Frame(
            index=self._frames,
            time=time,
            pair=pair,
            T_world_base=pose.matrix,
            T_base_left=self._robot.T_base_left,
        )
        self._frames += 1
        with limited(1):  # environments run side by side, one a core
            swarm = self._engine.see(frame, rng=rng)
        base = transform(self._robot.T_base_left, swarm.points.astype(np.float64))
        return base[standing(base, self._robot.height)]
