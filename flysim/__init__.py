"""flysim: a simulation testbed for the fly algorithm in robot navigation.

The names below load their rooms when first used, so that `import flysim` costs nothing. It makes the environment known
to gymnasium: `gym.make("flysim/FlyNav-v0")`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from flysim.registration import register

__version__ = "0.1.0"

if TYPE_CHECKING:
    from flysim.errors import FlysimError as FlysimError
    from flysim.evaluate.report import Report as Report
    from flysim.flies.evolution import evolve as evolve
    from flysim.flies.parameters import FlyParams as FlyParams
    from flysim.geometry.camera import Camera as Camera
    from flysim.geometry.read_pair import read_pair as read_pair
    from flysim.geometry.rig import ImagePair as ImagePair
    from flysim.geometry.rig import StereoRig as StereoRig
    from flysim.obstacles.find import find_obstacles as find_obstacles
    from flysim.obstacles.parameters import ObstacleParams as ObstacleParams
    from flysim.products.obstacle import Obstacle as Obstacle
    from flysim.products.swarm import Swarm as Swarm
    from flysim.runs.photographs import SeeParams as SeeParams
    from flysim.runs.photographs import see as see
    from flysim.runs.photographs import see_all as see_all
    from flysim.runs.run import run as run
    from flysim.runs.scenario import Scenario as Scenario
    from flysim.sensors.calibration import CalibrationParams as CalibrationParams
    from flysim.sensors.parameters import SensorParams as SensorParams

_HOME = {
    "CalibrationParams": "flysim.sensors.calibration",
    "Camera": "flysim.geometry.camera",
    "FlyParams": "flysim.flies.parameters",
    "FlysimError": "flysim.errors",
    "ImagePair": "flysim.geometry.rig",
    "Obstacle": "flysim.products.obstacle",
    "ObstacleParams": "flysim.obstacles.parameters",
    "Report": "flysim.evaluate.report",
    "Scenario": "flysim.runs.scenario",
    "SeeParams": "flysim.runs.photographs",
    "SensorParams": "flysim.sensors.parameters",
    "StereoRig": "flysim.geometry.rig",
    "Swarm": "flysim.products.swarm",
    "evolve": "flysim.flies.evolution",
    "find_obstacles": "flysim.obstacles.find",
    "read_pair": "flysim.geometry.read_pair",
    "run": "flysim.runs.run",
    "see": "flysim.runs.photographs",
    "see_all": "flysim.runs.photographs",
}
__all__ = [
    "CalibrationParams",
    "Camera",
    "FlyParams",
    "FlysimError",
    "ImagePair",
    "Obstacle",
    "ObstacleParams",
    "Report",
    "Scenario",
    "SeeParams",
    "SensorParams",
    "StereoRig",
    "Swarm",
    "evolve",
    "find_obstacles",
    "read_pair",
    "run",
    "see",
    "see_all",
]

register()


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'flysim' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
