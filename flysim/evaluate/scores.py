"""The parts of a report: how far each obstacle, the flies and each stop are from the truth."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

TAUS = ("0.01", "0.02", "0.05")  # [m] keys of the surface figures

WHOLE = 1.0  # share of what was found as a whole

Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """Median, 95 % quantile and greatest of some errors; None where there are none."""

    median: float | None
    max: float | None
    p95: float | None = None


NO_SPREAD = Spread(median=None, max=None)


@dataclass(frozen=True, slots=True, kw_only=True)
class StopReport:
    """One stop: poses are (x, y, yaw) in m and rad.

    Attributes:
        time: [s] by part: render, evolve, obstacles. Obstacles are found once over all stops; a stop has an
            equal share.
    """

    index: int
    commanded: Triple
    odometry: Triple
    true: Triple
    iterations: int
    converged: bool
    time: dict[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class ObstacleReport:
    """One true obstacle and the estimate that stands for it, lengths in m; None where there is none.

    Attributes:
        shape_true, shape_estimated: "box", "cylinder", "sphere" or "other".
        visible: both cameras saw enough of it; if not, it counts neither as found nor as missed.
        center_error: distance of the centres on the ground, to the whole obstacle's.
        center_visible_error: the same to the centre of what was visible of it.
        size_true: length, width, height above the ground; the other sizes are along the same axes.
        size_visible: of what was visible.
        size_error: estimated - true.
        size_visible_error: estimated - visible.
        yaw_error_deg: in [0, 45]; None for what is round.
        found_well: visible, detected, and right to 3 cm in its centre and to 3 cm or 5 % in each dimension, of what was
            visible of it; of a long structure, at least 95 % of it.
        share: of it that was found: 1 where it was detected, 0 where not; between them where it is a long structure.
        pieces: how many estimates stand for it; more than one for long structures alone, which are then compared by the
            box round all of them.
    """

    name: str
    detected: bool
    visible: bool
    shape_true: str
    shape_estimated: str | None
    center_error: float | None
    center_visible_error: float | None
    size_true: Triple
    size_visible: Triple | None
    size_estimated: Triple | None
    size_error: Triple | None
    size_visible_error: Triple | None
    yaw_error_deg: float | None
    found_well: bool = False
    share: float = WHOLE
    pieces: int = 1

    def __post_init__(self) -> None:
        if not self.detected:
            object.__setattr__(self, "share", 0.0)
            object.__setattr__(self, "pieces", 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceReport:
    """Flies against the visible true surface [m]; the dicts are by threshold."""

    accuracy_median: float | None
    accuracy_p90: float | None
    precision: dict[str, float]
    completeness: dict[str, float]
    f_score: dict[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Scores:
    """All figures of a run.

    Attributes:
        blocked: None, or where and by what the drive was ended early.
        false_obstacles: estimates that stand for nothing, those on ground or walls apart.
        structure_obstacles: estimates that lie on ground or walls.
        center_error, center_visible_error: over the visible obstacles that were detected.
        size_error, size_visible_error: over all axes of those, without sign.
        height_error, height_visible_error: of their heights alone, which `size_error` pools with the rest.
        shape_accuracy: share of those whose shape was told; None where there are none.
        iou_plan, iou_3d: intersection over union with the visible part, seen from above and in space, the mean over all
            visible obstacles, 0 for what was not found (`overlap`); None where nothing was visible.
        time: [s] by part.
        versions: of the packages that made the figures.
        well: "precision", "recall" and "f1" where only obstacles that were found well count as found.
        texture: what the surfaces were given: "speckle" where what had no texture was dressed in one, "tiles",
            "contrast 0.5"; else None.
        warnings: what was skipped of the world's file and left out of the path, one sentence each.
        failed: the stops that the engine failed at and why, one line each; it has seen nothing there.
        sensors: what the cameras did to the images, by name; only what was not off.
        calibration: how the true rig and the believed one differed, by name; only what was not 0.
        light: in the world, by name; only what was not a day's.
        odometry: what was wrong with the wheels and what they tell, by name.
        whereabouts: how far from the truth the robot believed itself (`whereabouts.whereabouts`); empty where its
            wheels were as they should be and nobody else was asked.
        alignment: how much lower the engine found the right picture to lie than the rig says, "row_shift_px", and how
            far that camera to be rolled, clockwise as it looks, "right_roll_deg", both to be held against those of
            `[calibration]`; and how much less sharp than the left one the picture is, "right_blur_px" (below 0:
            sharper). None where it did not ask.
        plain: share of the pictures in which the engine says that nothing can be matched, such as a sky, a bare wall or
            slats along the rows: what stands there is not seen. None where it did not ask.
        explained: how much of the errors a wrong calibration alone explains (`explained.explanation`); empty where the
            calibration is right.
    """

    scenario: str
    seed: int
    renderer: str
    engine: str
    world: str
    status: str
    blocked: str | None
    stops_planned: int
    stops: tuple[StopReport, ...]
    obstacles: tuple[ObstacleReport, ...]
    false_obstacles: int
    structure_obstacles: int
    precision: float
    recall: float
    f1: float
    center_error: Spread
    center_visible_error: Spread
    size_error: Spread
    size_visible_error: Spread
    surface: SurfaceReport
    time: dict[str, float]
    well: dict[str, float] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)
    texture: str | None = None
    warnings: tuple[str, ...] = ()
    failed: tuple[str, ...] = ()
    sensors: dict[str, Any] = field(default_factory=dict)
    calibration: dict[str, Any] = field(default_factory=dict)
    light: dict[str, Any] = field(default_factory=dict)
    odometry: dict[str, Any] = field(default_factory=dict)
    whereabouts: dict[str, Any] = field(default_factory=dict)
    alignment: dict[str, float] | None = None
    explained: dict[str, Any] = field(default_factory=dict)
    plain: float | None = None
    height_error: Spread = NO_SPREAD
    height_visible_error: Spread = NO_SPREAD
    shape_accuracy: float | None = None
    iou_plan: float | None = None
    iou_3d: float | None = None
