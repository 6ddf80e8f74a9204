"""The studies by name: each turns one figure of the world or of the cameras from none of it to far too much."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from flysim.common.registry import Registry
from flysim.errors import ScenarioError

if TYPE_CHECKING:
    from flysim.runs.scenario import Scenario

_HERE = "flysim.studies.sweep.study"
STUDIES = Registry(
    "study",
    "flysim.studies",
    {
        "light": f"{_HERE}:LIGHT",
        "glare": f"{_HERE}:GLARE",
        "exposure": f"{_HERE}:EXPOSURE",
        "offset": f"{_HERE}:OFFSET",
        "noise": f"{_HERE}:NOISE",
        "blur": f"{_HERE}:BLUR",
        "defocus": f"{_HERE}:DEFOCUS",
        "jpeg": f"{_HERE}:JPEG",
        "contrast": f"{_HERE}:CONTRAST",
        "alignment": f"{_HERE}:ALIGNMENT",
        "roll": f"{_HERE}:ROLL",
        "calibration": f"{_HERE}:CALIBRATION",
        "calibration-images": f"{_HERE}:CALIBRATION_IMAGES",
        "texture": f"{_HERE}:TEXTURE",
        "floor": f"{_HERE}:FLOOR",
        "baseline": "flysim.studies.sweep.one_camera:BASELINE",
        "hop": "flysim.studies.sweep.one_camera:HOP",
        "odometry": "flysim.studies.sweep.drift:ODOMETRY",
        "localisation": "flysim.studies.sweep.drift:LOCALISATION",
    },
    ScenarioError,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """One disturbance and how much of it there is.

    Attributes:
        what: the disturbance, as a title has it: "right eye darker".
        unit: of a level.
        levels: from none of it to the most; what the first one gives is what the others are held against.
        settings: of a level, by the scenario's keys: `{"sensors.gain_right": 0.8}`.
        changed: the scenario of a level, where keys alone do not tell it.
        scenarios, engines: what is driven, and who sees, where nobody says otherwise.
        lengths: whether its picture shows errors [cm] in place of points and time.
    """

    what: str
    unit: str
    levels: tuple[float, ...]
    settings: Callable[[float], Mapping[str, Any]] = lambda level: {}
    changed: Callable[[Scenario, float], Scenario] = lambda plan, level: plan
    scenarios: tuple[str, ...] = ("paper_a", "paper_c", "yard")
    engines: tuple[str, ...] = ("flies", "sgbm", "bm")
    lengths: bool = False

    def __post_init__(self) -> None:
        if not self.levels or len(set(self.levels)) < len(self.levels):
            raise ValueError(f"levels must be given, each once, got {self.levels}")

    def overrides(self, level: float) -> list[str]:
        """`KEY=VALUE` of a level, as `--set` has them."""
        return [f"{key}={_toml(value)}" for key, value in self.settings(level).items()]


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f'"{value}"' if isinstance(value, str) else repr(value)


LIGHT = Study(
    what="light lost",
    unit="%",
    levels=(0.0, 50.0, 75.0, 90.0, 95.0, 98.0),
    settings=lambda level: {"light.level": round(1.0 - level / 100.0, 6)},
)
GLARE = Study(
    what="more light than the cameras can tell",
    unit="%",
    levels=(0.0, 25.0, 50.0, 100.0, 200.0),
    settings=lambda level: {"light.level": round(1.0 + level / 100.0, 6)},
)
EXPOSURE = Study(
    what="right eye darker",
    unit="%",
    levels=(0.0, 2.0, 5.0, 10.0, 20.0, 35.0, 50.0),
    settings=lambda level: {"sensors.gain_right": round(1.0 - level / 100.0, 6)},
)
OFFSET = Study(
    what="right eye brighter",
    unit="grey levels",
    levels=(0.0, 5.0, 10.0, 20.0, 40.0),
    settings=lambda level: {"sensors.offset_right": level},
)
NOISE = Study(
    what="noise of the reading, standard deviation",
    unit="grey levels",
    levels=(0.0, 2.0, 5.0, 10.0, 20.0),
    settings=lambda level: {"sensors.noise": level},
)
BLUR = Study(
    what="motion blur along the rows",
    unit="px",
    levels=(0.0, 3.0, 5.0, 9.0, 15.0),
    settings=lambda level: {"sensors.motion_px": level},
)
DEFOCUS = Study(
    what="right eye out of focus, sigma",
    unit="px",
    levels=(0.0, 0.5, 1.0, 1.5, 2.5),
    settings=lambda level: {"sensors.defocus_right": level},
)
JPEG = Study(
    what="JPEG, 100 less its quality (0: none)",
    unit="",
    levels=(0.0, 10.0, 30.0, 50.0, 70.0, 85.0),
    settings=lambda level: {"sensors.jpeg_quality": 0 if level == 0 else round(100 - level)},
)
CONTRAST = Study(
    what="contrast of both images lost",
    unit="%",
    levels=(0.0, 50.0, 75.0, 90.0, 95.0),
    settings=lambda level: {"sensors.contrast": round(1.0 - level / 100.0, 6)},
)
ALIGNMENT = Study(
    what="rows of the right eye too low",
    unit="px",
    levels=(0.0, 0.25, 0.5, 1.0, 2.0, 4.0),
    settings=lambda level: {"calibration.row_shift_px": level},
)
ROLL = Study(
    what="right eye rolled",
    unit="degrees",
    levels=(0.0, 0.1, 0.3, 0.5, 1.0, 2.0),
    settings=lambda level: {"calibration.right_roll_deg": level},
)
CALIBRATION = Study(
    what="focal length believed too long",
    unit="%",
    levels=(0.0, 0.5, 1.0, 2.0, 5.0),
    settings=lambda level: {"calibration.focal_error": round(level / 100.0, 6)},
)
# Whoever knows its cameras has no lens to take out. Below 4 images a calibration may fail.
CALIBRATION_IMAGES = Study(
    what="images of a board by which lenses are calibrated (0: no lens)",
    unit="",
    levels=(0.0, 60.0, 30.0, 15.0, 10.0, 7.0, 5.0, 4.0),
    settings=lambda level: (
        {
            **{"sensors.k1": -0.18, "sensors.k2": 0.04, "sensors.p1": 0.001, "sensors.p2": -0.0008},
            **{"sensors.noise": 1.0, "calibration": f"images:{round(level)}"},
        }
        if level
        else {}
    ),
)
TEXTURE = Study(
    what="contrast of all surfaces lost",
    unit="%",
    levels=(0.0, 50.0, 75.0, 90.0, 95.0, 100.0),
    settings=lambda level: {"texture_contrast": round(1.0 - level / 100.0, 6)},
)
FLOOR = Study(
    what="floor a mirror, of the light from above",
    unit="%",
    levels=(0.0, 5.0, 10.0, 20.0, 40.0),
    settings=lambda level: {"light.floor_shine": round(level / 100.0, 6)},
)
