"""`flysim/FlyNav-v0`: a robot that sees by flies drives to a goal."""

from __future__ import annotations

from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from numpy.typing import NDArray

from flysim.common.catalogue import find_robot
from flysim.common.one_of_a_kind import OneOfAKind
from flysim.geometry.frames import Array, Pose2
from flysim.geometry.rig import ImagePair
from flysim.nav.arguments import numbers, one_of
from flysim.nav.attempt import Attempt
from flysim.nav.drive import PERIOD_S, Drive
from flysim.nav.screen import Screen
from flysim.nav.senses import Senses
from flysim.nav.settings import Settings
from flysim.nav.spaces import action_space, command, observation_space
from flysim.nav.stage import Stage
from flysim.paths.course import Course
from flysim.paths.field import Field
from flysim.robots.robot import read_robot


class FlyNavEnv(OneOfAKind, gym.Env[dict[str, NDArray[Any]], Any]):
    """Drive to a goal without touching anything, seeing by the fly algorithm.

    ## Action space
    `actions="continuous"`: `Box(2, float32)`, a command for 0.1 s. The wheels follow it at 0.8 m/s^2 and
    2.5 rad/s^2 and take curves at 0.8 m/s^2 at most: beyond that they would slip.

    | # | action | min | max | unit |
    |---|---|---|---|---|
    | 0 | speed v | 0 | 1 | `v_max` (0.5 m/s) |
    | 1 | yaw rate, left is positive | -1 | 1 | `w_max` (1.5 rad/s) |

    `actions="discrete"`: `Discrete(8)`, in the same units: 0 turn left (0, 1), 1 turn right (0, -1),
    2 ahead (1, 0), 3 (1, 0.5), 4 (1, -0.5), 5 (0.5, 1), 6 (0.5, -1), 7 stop (0, 0).

    ## Observation space
    A `Dict` of float32 boxes. Which keys there are depends on `observation`; another engine is told as sgbm is:

    | key | shape | min | max | unit | flies | sgbm | truth | pixels |
    |---|---|---|---|---|---|---|---|---|
    | `obstacles` | (72,) | 0 | 5 | m | yes | yes | yes | |
    | `goal` | (2,) | (0, -pi) | (100, pi) | m, rad | yes | yes | yes | yes |
    | `velocity` | (2,) | (-10, -20) | (10, 20) | m/s, rad/s | yes | yes | yes | yes |
    | `flies` | (64, 3) | -10 | 10 | m | yes | | | |
    | `left`, `right` (uint8) | (120, 160, 3) | 0 | 255 | RGB | | | | yes |

    - `obstacles`: from the robot's axis to the nearest obstacle in each sector of 5 degrees; sector 0 begins straight
      behind, sectors run counter-clockwise, sector 36 begins straight ahead. 5 where nothing is known. With "flies"
      and "sgbm" it is what was seen from nearer than 1.6 m in the last `memory` seconds, carried along by odometry, and
      from farther away in the last 5 looks, where points back each other; with "truth" the exact outlines, all round.
    - `goal`: distance and bearing from the heading, as odometry has it. `velocity`: v and yaw rate, the mean of the
      last period by odometry.
    - `flies`: x, y, z in base_link of the 64 fittest flies above the floor; rows of zeros where there are fewer.

    ## Reward
    `r = (g(t-1) - g(t)) - 0.01 - 10 [collision] + 10 [success]`, where g is the length of the shortest way to the goal
    in metres. What is gained by progress over an episode is thus the way at its start, less what is left.

    ## Start
    Start and goal are drawn among free places with a way of 2.5 m at least between them, the heading too; where there
    is room nothing stands within 0.35 m of the robot's circle at the start: its cameras do not see that. Or given:
    `start=(x, y, yaw)`, `goal=(x, y)`, here or in `reset(options=...)`. A world `random-easy`, `random-medium` or
    `random-hard` is another one at each reset. All of it follows from `reset(seed=...)`.

    ## End
    `terminated`: the axis is within `goal_radius` of the goal (success), or the robot touches something (collision).
    `truncated`: `time_limit` seconds of simulated time are over.

    ## Info
    `success` (bool), `spl`, `soft_spl` (0 to 1), `collisions` (0 or 1), `path_length` (m driven), `clearance` (m, the
    least so far between the robot's circle and anything), `shortest` (m from start to goal), `distance` (m still to
    go), `time` (s simulated), `position` (x, y, yaw of the truth, world frame), `hit` (what was touched, or "").

    ## Arguments
    | name | default | meaning |
    |---|---|---|
    | `world` | "yard" | name or file (SDF) of a world, or random-easy, random-medium, random-hard |
    | `observation` | "flies" | an engine (flies, sgbm, bm, ..., `module:object`), "pixels" or "truth" |
    | `actions` | "continuous" | "continuous" or "discrete" |
    | `robot` | "rover" | name or URDF of a robot |
    | `wheels` | None | names of its left and right driven wheel's joints; None: as its file says |
    | `cameras` | None | "stereo" mounts the rover's pair on it; None: its own |
    | `models` | () | folders with models that the world includes; "env": those of Gazebo's variables |
    | `start`, `goal` | None | (x, y, yaw [rad]) and (x, y) [m], world frame; None: drawn |
    | `shortest` | None | length [m] that SPL takes for the shortest way; None: found on the world's floor |
    | `texture` | None | "speckle" dresses what has no texture |
    | `renderer` | "auto" | "gl", "tiny", or "auto": gl where a context opens |
    | `size` | (160, 120) | width and height of the images [px] |
    | `flies` | None | a `FlyParams` for the engine; None: 1000 flies, 3 generations a look |
    | `sensors` | None | a `SensorParams` or a dict: what the cameras do to a picture (`docs/sensors.md`) |
    | `calibration` | None | a `CalibrationParams` or a dict: how they differ from what the robot believes |
    | `light` | None | a `LightParams` or a dict: the light in the world (`docs/sensors.md`) |
    | `surroundings` | None | a `SurroundingsParams` or a dict: what of the points seen counts as an obstacle |
    | `v_max`, `w_max` | 0.5, 1.5 | largest commands [m/s], [rad/s] |
    | `goal_radius` | 0.3 | [m] |
    | `time_limit` | 60 | [s] simulated |
    | `episodes_per_world` | 1 | episodes in one random world, until a reset with a seed |
    | `memory` | 6 | [s] for which what was seen counts |

    ## Errors
    `InvalidAction` (NaN, out of bounds), `ResetNeeded` (step before reset, or after the end), `ClosedEnvironmentError`,
    `ValueError` (an argument; a start or goal that is taken), `TypeError` (a copy), `FlysimError` (a world, robot or
    renderer that cannot be used).

    ## Version history
    - v0: first version.
    """

    metadata: ClassVar[dict[str, Any]] = {
        "render_modes": ["rgb_array", "rerun"],
        "render_fps": round(1.0 / PERIOD_S),
    }

    instead = "make another one by gym.make, or by env.spec.make()"

    def __init__(self, world: str = "yard", *, render_mode: str | None = None, **settings: Any) -> None:
        """The class's docstring has the arguments; `settings.Settings` checks them."""
        if render_mode is not None:
            one_of("render_mode", render_mode, self.metadata["render_modes"])
        given = self.settings = Settings.of({"world": world, **settings})
        self.render_mode, self._in_world = render_mode, 0
        self._robot = read_robot(find_robot(given.robot), given.wheels, given.cameras)
        self._senses = Senses(given, self._robot)
        self._stage: Stage | None = Stage(
            world,
            self._robot,
            self._senses.rig,
            given.renderer,
            light=given.lit(),
            dressed=given.texture is not None,
            models=given.models,
            looks=given.observation != "truth" or render_mode is not None,
        )
        self._attempt: Attempt | None = None  # until the first reset
        self._screen = Screen()
        self.action_space = action_space(given.actions)
        self.observation_space: spaces.Space[Any] = observation_space(given.observation, given.size)

    @property
    def stage(self) -> Stage:
        """The world, the simulation and the eyes."""
        return self._open()

    @property
    def course(self) -> Course:
        """The start, the goal and the shortest way of this episode."""
        return self._begun("asking for its course").course

    @property
    def field(self) -> Field:
        """How far it is from anywhere to this episode's goal."""
        return self._begun("asking for its field").field

    @property
    def v_max(self) -> float:
        """Largest speed that is commanded [m/s]."""
        return self.settings.v_max

    @property
    def w_max(self) -> float:
        """Largest yaw rate that is commanded [rad/s]."""
        return self.settings.w_max

    @property
    def radius(self) -> float:
        """[m] of the robot's circle."""
        return self._robot.radius

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Begins an episode.

        Args:
            seed: of the world, start, goal and flies of this episode and those after it.
            options: `start` and `goal` of this episode, as the arguments of these names.
        """
        super().reset(seed=seed)
        stage = self._open()
        unknown = set(options or {}) - {"start", "goal"}
        if unknown:
            raise ValueError(f"options may hold start and goal, got {sorted(unknown)}")
        self._attempt = None
        if seed is not None or self._in_world % self.settings.episodes_per_world == 0:
            stage.renew(self.np_random)
            self._in_world = 0
        self._in_world += 1
        given = {"start": self.settings.start, "goal": self.settings.goal, **(options or {})}
        start, goal = numbers("start", given["start"], 3), numbers("goal", given["goal"], 2)
        course = stage.ground.course(
            self.np_random, None if start is None else Pose2(*start), None if goal is None else (goal[0], goal[1])
        )
        if self.settings.shortest is not None:
            course = Course(start=course.start, goal=course.goal, shortest=self.settings.shortest)
        attempt = Attempt(course, stage.ground, Drive(stage.set_up(course.start)), self.settings)
        self._senses.begin(self.np_random)
        self._attempt = attempt
        return self._observe(stage, attempt), attempt.info()

    def step(self, action: Any) -> tuple[dict[str, NDArray[Any]], float, bool, bool, dict[str, Any]]:
        """Drives for 0.1 s and looks."""
        stage, attempt = self._open(), self._attempt
        if attempt is None or attempt.over:
            raise ResetNeeded("call reset() before step(), and again after the end of an episode")
        v, w = command(self.action_space, action)
        reward, terminated, truncated = attempt.go(v * self.settings.v_max, w * self.settings.w_max)
        return self._observe(stage, attempt), reward, terminated, truncated, attempt.info()

    def _open(self) -> Stage:
        if self._stage is None:
            raise ClosedEnvironmentError("this environment is closed: make another one")
        return self._stage

    def _begun(self, what: str) -> Attempt:
        if self._attempt is None:
            raise ResetNeeded(f"call reset() before {what}")
        return self._attempt

    def _observe(self, stage: Stage, attempt: Attempt) -> dict[str, NDArray[Any]]:
        observation = self._senses.observe(stage, attempt.drive, attempt.course.goal, self.np_random)
        if self.render_mode == "rerun":
            self.render()
        return observation

    def seen(self) -> tuple[ImagePair, Array, Array]:
        """For pictures: the pair, `[n, 3]` this look's points in base_link, `[m, 2]` all remembered, in odometry."""
        return self._senses.seen(self._open(), self._begun("seen()").drive)

    def render(self) -> NDArray[np.uint8] | None:  # type: ignore[override]
        """`rgb_array`: `[H, W, 3]`, what the left eye sees beside a map. `rerun`: logged."""
        if self.render_mode is None:
            gym.logger.warn("render() does nothing without a render_mode: give one to gym.make, such as 'rgb_array'.")
            return None
        stage = self._open()
        attempt = self._begun("render()")
        if self.render_mode == "rerun":
            self._screen.show(self.seen, attempt.drive, stage.ground, attempt.course)
            return None
        from flysim.nav.picture import draw

        pair, _, remembered = self.seen()
        return draw(pair, stage.ground.outline, attempt.course, attempt.drive, remembered, self._robot.radius)

    def close(self) -> None:
        """Frees the physics client, the renderer, the files, and ends the viewer. Safe to call twice."""
        self._screen.close()
        if self._stage is not None:
            self._stage.close()
            self._stage = None
