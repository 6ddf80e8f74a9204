"""The arguments of the environment: each with its unit, its range and what it is for."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Literal, get_args

from flysim.common.ranges import ranged
from flysim.common.records import record_of
from flysim.engines.choose import ENGINES
from flysim.errors import EngineError, did_you_mean
from flysim.flies.parameters import FlyParams
from flysim.geometry.rig import StereoRig
from flysim.nav.agents.surroundings import SurroundingsParams
from flysim.nav.arguments import image_size, numbers, one_of
from flysim.render.choose import RendererName
from flysim.render.light import LightParams
from flysim.robots.robot import Mount, mount
from flysim.sensors.calibration import CalibrationParams
from flysim.sensors.cameras import Cameras
from flysim.sensors.parameters import SensorParams

ActionKind = Literal["continuous", "discrete"]
NO_ENGINE = ("truth", "pixels")  # observations that no engine makes


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """What an environment is made of. Refuses nonsense with a ValueError that names the figure.

    Attributes:
        world: name or file (SDF) of a world, or random-easy, random-medium, random-hard: another one at each reset.
        observation: what the agent is told: an engine's name ("flies", "sgbm", or a `module:object`), "pixels" for
            both images, "truth" for exact distances.
        actions: "continuous" or "discrete".
        robot: name or URDF of a robot.
        wheels: names of the joints of its left and right driven wheel; None: as its file says.
        cameras: "stereo" mounts the rover's pair on it; None: its own.
        models: folders in which models of the world are looked for besides; "env": those of Gazebo's variables.
        start: x, y [m], yaw [rad], world frame; None: drawn.
        goal: x, y [m], world frame; None: drawn.
        shortest: length [m] that SPL takes for the shortest way; None: found on the world's floor.
        texture: "speckle" dresses what has no texture; None leaves it bare.
        renderer: "gl", "tiny", or "auto": gl where a context opens.
        size: width and height of the images [px], 16 to 4096.
        flies: parameters of the engine; None: `seeing.defaults`.
        sensors: what the cameras do to a picture: a `SensorParams` or a dict of its fields; None: nothing. Pixels are
            those of `size`.
        calibration: how the cameras differ from what the robot believes: a `CalibrationParams` or a dict; None: not.
        light: in the world: a `LightParams` or a dict of its fields; None: a day's.
        surroundings: what of the points seen counts: a `SurroundingsParams` or a dict of its fields; None: as it is.
        v_max: largest speed that is commanded [m/s], up to 100.
        w_max: largest yaw rate that is commanded [rad/s], up to 100.
        goal_radius: the goal is reached within this of it [m], up to 1000.
        time_limit: of an episode, simulated [s], 0.1 to 1e6.
        memory: for how long what was seen counts [s], up to 1000.
        episodes_per_world: episodes in one random world until the next, >= 1; a reset with a seed draws one anyhow.
    """

    world: str = "yard"
    observation: str = "flies"
    actions: ActionKind = "continuous"
    robot: str = "rover"
    wheels: tuple[str, str] | None = None
    cameras: Mount | None = None
    models: tuple[str, ...] = ()
    start: tuple[float, float, float] | None = None
    goal: tuple[float, float] | None = None
    shortest: float | None = None
    texture: Literal["speckle"] | None = None
    renderer: RendererName = "auto"
    size: tuple[int, int] = (160, 120)
    flies: FlyParams | None = None
    sensors: SensorParams | dict[str, Any] | None = None
    calibration: CalibrationParams | dict[str, Any] | None = None
    light: LightParams | dict[str, Any] | None = None
    surroundings: SurroundingsParams | dict[str, Any] | None = None
    v_max: float = 0.5
    w_max: float = 1.5
    goal_radius: float = 0.3
    time_limit: float = 60.0
    memory: float = 6.0
    episodes_per_world: int = 1

    def __post_init__(self) -> None:
        observation(self.observation)
        one_of("actions", self.actions, get_args(ActionKind))
        one_of("renderer", self.renderer, get_args(RendererName))
        mount(self.cameras)
        _names("wheels", self.wheels or ("", ""), 2)
        _names("models", self.models, None)
        if self.texture is not None:
            one_of("texture", self.texture, ("speckle",))
        ranged(
            self,
            v_max=(1e-3, 100.0),
            w_max=(1e-3, 100.0),
            goal_radius=(1e-3, 1e3),
            time_limit=(0.1, 1e6),
            memory=(1e-3, 1e3),
            episodes_per_world=(1, 1_000_000),
        )
        if self.shortest is not None:
            ranged(self, shortest=(0.0, 1e6))
        image_size(self.size)
        record_of(SensorParams, "sensors", self.sensors)
        record_of(CalibrationParams, "calibration", self.calibration)
        record_of(LightParams, "light", self.light)
        record_of(SurroundingsParams, "surroundings", self.surroundings)
        numbers("start", self.start, 3)
        numbers("goal", self.goal, 2)

    def at_work(self, rig: StereoRig) -> Cameras:
        """The two cameras at work whose ideal is `rig`.

        Raises:
            FlysimError: a lens that folds the image.
        """
        sensors = record_of(SensorParams, "sensors", self.sensors)
        return Cameras(rig, sensors, record_of(CalibrationParams, "calibration", self.calibration))

    def lit(self) -> LightParams:
        """The light in the world."""
        return record_of(LightParams, "light", self.light)

    def counts(self) -> SurroundingsParams:
        """What of the points seen counts as an obstacle."""
        return record_of(SurroundingsParams, "surroundings", self.surroundings)

    @classmethod
    def of(cls, given: dict[str, Any]) -> Settings:
        """The settings of keywords.

        Raises:
            TypeError: a keyword that there is not; the message has the nearest one.
            ValueError: a value that cannot be.
        """
        known = [field.name for field in fields(cls)]
        for name in given:
            if name not in known:
                raise TypeError(f"the environment has no argument '{name}'. {did_you_mean(name, known)}")
        return cls(**given)


def _names(field: str, value: Any, count: int | None) -> None:
    if (
        not isinstance(value, tuple | list)
        or not all(isinstance(one, str) for one in value)
        or len(value) != (len(value) if count is None else count)
    ):
        raise ValueError(f"{field} must hold {'two names' if count == 2 else 'names of folders'}, got {value!r}")


def observation(name: str) -> str:
    """The name, if it is "pixels", "truth" or an engine's.

    Raises:
        ValueError: it is none of them; the message has the nearest one.
    """
    if name not in NO_ENGINE:
        try:
            ENGINES.check(name)
        except EngineError:
            raise ValueError(f"no observation {name!r}. {did_you_mean(name, (*ENGINES.names, *NO_ENGINE))}") from None
    return name
