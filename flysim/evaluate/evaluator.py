"""A journey in, a report out: every estimate beside the truth."""

from __future__ import annotations

import math
import platform
import time
from collections.abc import Iterable, Sequence
from importlib import metadata

import numpy as np
from numpy.typing import ArrayLike

from flysim import __version__
from flysim.evaluate.dimensions import compare
from flysim.evaluate.matching import Matching, match
from flysim.evaluate.report import TAUS, ObstacleReport, Report, Spread, StopReport, SurfaceReport, Triple
from flysim.evaluate.surface import SurfaceScore, score_surface
from flysim.geometry.frames import Pose2
from flysim.journey import Journey, Look
from flysim.products.obstacle import Obstacle
from flysim.truth.motion import Motion
from flysim.truth.obstacles import TrueObstacle, true_obstacles
from flysim.truth.sight import sights

# What the figures depend on: distribution -> the name a reader knows it by.
PACKAGES = {
    "numpy": "numpy",
    "scipy": "scipy",
    "numba": "numba",
    "pybullet": "pybullet",
    "moderngl": "moderngl",
    "opencv-python-headless": "opencv",
    "opencv-python": "opencv",
}


def evaluate(journey: Journey, truth: Sequence[TrueObstacle] | None = None) -> Report:
    """Compares the obstacles and the flies of a journey with what stands in its world.

    Args:
        journey: the finished drive.
        truth: the true obstacles, where they are known already (`truth_of`).
    """
    began = time.perf_counter()
    world, stops = journey.world, [look.stop for look in journey.looks]
    seen = sights(stops, journey.max_range)
    if truth is None:
        truth = true_obstacles(world, stops, max_range=journey.max_range, seen=seen)
    motion = Motion.of(world, stops)
    matching = match(truth, journey.obstacles, world=world, motion=motion, cloud=journey.cloud)
    surface = score_surface(world, motion, seen, journey.cloud)
    obstacles = _obstacles(truth, journey.obstacles, matching)
    judged = [o for o in obstacles if o.visible and o.detected]
    spent = time.perf_counter() - began
    return Report(
        scenario=journey.scenario,
        seed=journey.seed,
        renderer=journey.renderer,
        engine=journey.engine,
        world=world.name,
        status="blocked" if journey.blocked else "ok",
        blocked=journey.blocked,
        stops_planned=journey.planned,
        stops=tuple(_stop(look, journey.obstacles_s / len(journey.looks)) for look in journey.looks),
        obstacles=obstacles,
        false_obstacles=len(matching.false),
        structure_obstacles=len(matching.on_structure),
        precision=matching.precision,
        recall=matching.recall,
        f1=matching.f1,
        center_error=_spread([o.center_error] for o in judged),
        center_visible_error=_spread([o.center_visible_error] for o in judged),
        size_error=_spread(o.size_error for o in judged),
        size_visible_error=_spread(o.size_visible_error for o in judged),
        surface=_surface(surface),
        time={
            "total": journey.total_s,
            "drive": float(sum(stop.drive_s for stop in stops)),
            "render": float(sum(stop.render_s for stop in stops)),
            "evolve": float(sum(look.evolve_s for look in journey.looks)),
            "obstacles": journey.obstacles_s,
            "evaluate": spent,
        },
        versions=versions(),
        texture=journey.texture,
        warnings=(*journey.world.warnings, *journey.notes),
    )


def versions() -> dict[str, str]:
    """The Python and the packages that made the figures, those that are installed."""
    found = {"python": platform.python_version(), "flysim": __version__}
    for distribution, name in PACKAGES.items():
        try:
            found[name] = metadata.version(distribution)
        except metadata.PackageNotFoundError:
            continue
    return found


def _obstacles(
    truth: Sequence[TrueObstacle], estimates: Sequence[Obstacle], matching: Matching
) -> tuple[ObstacleReport, ...]:
    reports = []
    for i, true in enumerate(truth):
        size_true, seen = _triple(true.size), true.visible_extent()
        if i not in matching.pairs:
            reports.append(
                ObstacleReport(
                    name=true.name,
                    detected=False,
                    visible=true.visible,
                    shape_true=true.shape,
                    shape_estimated=None,
                    center_error=None,
                    center_visible_error=None,
                    size_true=size_true,
                    size_visible=_triple(seen[1]) if seen else None,
                    size_estimated=None,
                    size_error=None,
                    size_visible_error=None,
                    yaw_error_deg=None,
                )
            )
            continue
        estimate = estimates[matching.pairs[i]]
        c = compare(true, estimate)
        reports.append(
            ObstacleReport(
                name=true.name,
                detected=True,
                visible=true.visible,
                shape_true=true.shape,
                shape_estimated=estimate.shape,
                center_error=c.center_error,
                center_visible_error=c.center_visible_error,
                size_true=size_true,
                size_visible=None if c.size_visible is None else _triple(c.size_visible),
                size_estimated=_triple(c.size_estimated),
                size_error=_triple(c.size_estimated - true.size),
                size_visible_error=None if c.size_visible is None else _triple(c.size_estimated - c.size_visible),
                yaw_error_deg=None if c.yaw_error is None else math.degrees(c.yaw_error),
            )
        )
    return tuple(reports)


def _stop(look: Look, obstacles_s: float) -> StopReport:
    stop = look.stop
    return StopReport(
        index=stop.index,
        commanded=_pose(stop.commanded),
        odometry=_pose(stop.odometry),
        true=_pose(stop.true),
        iterations=look.swarm.iterations,
        converged=bool(look.swarm.converged),
        time={"render": stop.render_s, "evolve": look.evolve_s, "obstacles": obstacles_s},
    )


def _surface(score: SurfaceScore) -> SurfaceReport:
    return SurfaceReport(
        accuracy_median=score.accuracy_median,
        accuracy_p90=score.accuracy_p90,
        precision=dict(zip(TAUS, score.precision, strict=True)),
        completeness=dict(zip(TAUS, score.completeness, strict=True)),
        f_score=dict(zip(TAUS, score.f_score, strict=True)),
    )


def _spread(errors: Iterable[Iterable[float | None] | None]) -> Spread:
    flat = [abs(e) for group in errors if group is not None for e in group if e is not None]
    return Spread(median=float(np.median(flat)), max=max(flat)) if flat else Spread(median=None, max=None)


def _pose(pose: Pose2) -> Triple:
    return (float(pose.x), float(pose.y), float(pose.yaw))


def _triple(values: ArrayLike) -> Triple:
    x, y, z = np.asarray(values, dtype=np.float64).tolist()
    return (x, y, z)
