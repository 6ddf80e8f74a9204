"""One view under each disturbance, as a grid of pairs: how strong a figure of `[sensors]` is to the eye."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from flysim.common.records import changed
from flysim.common.whole_file import whole_file
from flysim.errors import ScenarioError
from flysim.geometry.rig import ImagePair
from flysim.render.choose import RendererName, renderer_here
from flysim.render.light import LightParams
from flysim.render.look import look
from flysim.render.studio import drawn
from flysim.runs.run import check, errand
from flysim.runs.scenario import Scenario
from flysim.sensors.calibration import CalibrationParams
from flysim.sensors.cameras import Cameras
from flysim.sensors.parameters import SensorParams

TURN_RATE = 1.0  # [rad/s] of the robot in the picture: without a turn a rolling shutter does nothing
GL_ALONE = {"lamp", "shadows", "floor_shine"}  # what `tiny` cannot draw of a light
COLUMNS, GAP, CAPTION, FONT = 3, 4, 16, 12  # [px] but for the columns


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """What one cell of the grid shows: figures of the three tables, by name."""

    sensors: dict[str, Any] = field(default_factory=dict)
    calibration: dict[str, Any] = field(default_factory=dict)
    light: dict[str, Any] = field(default_factory=dict)

    @property
    def words(self) -> str:
        """The cell's caption."""
        tables = {**self.sensors, **self.calibration, **self.light}
        return ", ".join(f"{key} {value}" for key, value in tables.items())


# Each stronger than a decent camera has it: it is to be seen. Those of a rig's belief change no image.
ALL = (
    *(
        Effect(sensors=one)
        for one in (
            {"k1": -0.18},
            {"k1": 0.3, "p1": 0.03},
            {"vignetting": 0.6},
            {"uneven_right": 0.6},
            {"defocus_right": 1.5},
            {"motion_px": 9.0},
            {"row_time_us": 400.0},
            {"auto_exposure": 60.0},
            {"gain_right": 0.6},
            {"gamma_right": 2.0},
            {"offset_right": 50.0},
            {"contrast": 0.3},
            {"shot_noise": 200.0},
            {"noise": 20.0},
            {"bayer": True},
            {"jpeg_quality": 8},
        )
    ),
    *(
        Effect(calibration=one)
        for one in (
            {"right_roll_deg": 8.0},
            {"right_pitch_deg": 5.0},
            {"right_yaw_px": 24.0},
            {"row_shift_px": 16.0},
        )
    ),
    *(
        Effect(light=one)
        for one in (
            {"level": 0.3},
            {"level": 2.2},
            {"level": 0.1, "lamp": 1.5},
            {"direction": (-0.3, 1.0, 0.4), "ambient": 0.3},
            {"colour": (1.0, 0.75, 0.5)},
            {"shadows": True},
            {"floor_shine": 0.4},
        )
    ),
)


def effects_of(plan: Scenario) -> tuple[Effect, ...]:
    """What a scenario disturbs, figure by figure and, if there are several, all at once; of a perfect one `ALL`."""
    sensors, calibration, light = changed(plan.sensors), changed(plan.calibration), changed(plan.light)
    if not sensors and not calibration and not light:
        return ALL
    exposure = {"auto_exposure": plan.sensors.auto_exposure}
    found = [
        Effect(sensors={**(exposure if key == "exposure_lag" else {}), key: value}) for key, value in sensors.items()
    ]
    found += [Effect(calibration={key: value}) for key, value in calibration.items()]
    found += [Effect(light={key: value}) for key, value in light.items()]
    together = Effect(sensors=sensors, calibration=calibration, light=light)
    return (*found, together) if len(found) > 1 else tuple(found)


def draw_effects(
    plan: Scenario, out: Path, *, stop: int = 1, width: int = 320, seed: int = 0, renderer: RendererName = "auto"
) -> tuple[str, ...]:
    """Writes a PNG of the pair at one stop: as it is drawn, then under each effect.

    Args:
        plan: whose world, robot, stop and disturbances they are; where it has none, every effect is shown, but for
            those that `tiny` cannot draw where that is who draws.
        out: the PNG to write.
        stop: which of its stops, from 1.
        width: of an eye's image [px]; figures in pixels are of such an image.
        seed: of the noise.
        renderer: "gl", "tiny", or "auto": gl where an OpenGL context opens.

    Returns:
        The captions, in the order of the picture.

    Raises:
        FlysimError: there is no such stop, or its world, robot or renderer cannot be used.
        OSError: the picture cannot be written.
    """
    if not 1 <= stop <= len(plan.stops):
        raise ScenarioError(f"{plan.name} has stops 1 to {len(plan.stops)}, no stop {stop}.")
    plan = plan.model_copy(update={"stops": (plan.stops[stop - 1],)})
    check(plan)
    effects = (Effect(), *effects_of(plan))
    if effects[1:] == ALL and renderer_here(renderer) == "tiny":
        effects = tuple(effect for effect in effects if not GL_ALONE & effect.light.keys())
    here = errand(plan)
    own = here.robot.rig
    rig = own.resized(width, round(width * own.left.height / own.left.width))
    cells: dict[int, ImagePair] = {}
    lights = {repr(effect.light): effect.light for effect in effects}
    for key, light in lights.items():  # a renderer has one light
        with drawn(here.world, here.robot, plan.stops[0].pose, renderer, LightParams(**light)) as (simulation, eyes):
            for k, effect in enumerate(effects):
                if repr(effect.light) == key:
                    sensors, calibration = SensorParams(**effect.sensors), CalibrationParams(**effect.calibration)
                    cameras = Cameras(rig, sensors, calibration, seed=seed)
                    pair, _ = look(simulation, eyes, cameras.drawn)
                    cells[k] = cameras.take(pair, 0, TURN_RATE)
    captions = tuple(effect.words or f"{plan.name}, stop {stop}, as drawn" for effect in effects)
    with whole_file(out) as part:
        grid([cells[k] for k in range(len(effects))], captions).save(part, format="PNG", optimize=True)
    return captions


def grid(pairs: Sequence[ImagePair], captions: Sequence[str]) -> Image.Image:
    """The pairs of equal size, pixel by pixel, each under its caption."""
    height, width = pairs[0].left.shape[0], pairs[0].left.shape[1] + GAP + pairs[0].right.shape[1]
    columns = min(COLUMNS, len(pairs))
    rows = math.ceil(len(pairs) / columns)
    size = columns * (width + 2 * GAP), rows * (height + CAPTION + GAP)
    sheet = Image.new("RGB", size, "white")
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(FONT)
    for k, (pair, words) in enumerate(zip(pairs, captions, strict=True)):
        x, y = k % columns * (width + 2 * GAP) + GAP, k // columns * (height + CAPTION + GAP)
        pen.text((x, y), _fitting(words, width, font), fill="black", font=font)
        sheet.paste(Image.fromarray(_beside(pair)), (x, y + CAPTION))
    return sheet  # in full colours: a palette would draw steps where light falls off


def _beside(pair: ImagePair) -> NDArray[np.uint8]:
    between = np.full((pair.left.shape[0], GAP, 3), 255, np.uint8)
    return np.concatenate([pair.left, between, pair.right], axis=1)


def _fitting(words: str, width: float, font: Any) -> str:
    """The words, cut where the cell ends."""
    if font.getlength(words) <= width:
        return words
    while words and font.getlength(words + "...") > width:
        words = words[:-1]
    return words + "..."
