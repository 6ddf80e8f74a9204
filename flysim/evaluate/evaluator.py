"""Findings and their truth in, a report out: every estimate beside what truly is."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flysim.common.provenance import versions
from flysim.evaluate.dimensions import compare
from flysim.evaluate.explained import explanation
from flysim.evaluate.lengths import WELL_HELD, Pieces, whole
from flysim.evaluate.matching import Matching, match
from flysim.evaluate.overlap import overlap
from flysim.evaluate.report import Report
from flysim.evaluate.scores import NO_SPREAD, TAUS, WHOLE, ObstacleReport, Spread, StopReport, SurfaceReport, Triple
from flysim.evaluate.surface import SurfaceScore, score_surface
from flysim.evaluate.well import found_well, well
from flysim.evaluate.whereabouts import warning, whereabouts
from flysim.geometry.frames import Pose2
from flysim.products.findings import Findings, Seen
from flysim.products.obstacle import Obstacle
from flysim.truth.obstacles import TrueObstacle
from flysim.truth.stop import Stop
from flysim.truth.truth import Truth

ONE = Pieces(estimates=(0,), share=WHOLE)  # what is not long and was found, is found whole


def evaluate(findings: Findings, truth: Truth) -> Report:
    """Compares the obstacles and the flies that an engine found with what stands there.

    Args:
        findings: of an engine, on the frames of a sequence.
        truth: of the same sequence, with a stop for each of its frames.

    Raises:
        ValueError: the two are not of one sequence.
    """
    began = time.perf_counter()
    sequence, world = findings.sequence, truth.world
    if [one.frame.index for one in findings.seen] != [stop.index for stop in truth.framed]:
        raise ValueError(f"{len(findings.seen)} frames and the truth of {len(truth.framed)} stops are not of one drive")
    matching = match(truth.obstacles, findings.obstacles, world=world, motion=truth.motion, cloud=findings.cloud)
    surface = score_surface(world, truth.motion, truth.sights, findings.cloud)
    obstacles = _obstacles(truth.obstacles, findings.obstacles, matching)
    judged = [o for o in obstacles if o.visible and o.detected]
    spent = time.perf_counter() - began
    return Report(
        scenario=sequence.name,
        seed=sequence.seed,
        renderer=sequence.renderer,
        engine=findings.engine,
        world=world.name,
        status="blocked" if sequence.blocked else "ok",
        blocked=sequence.blocked,
        stops_planned=sequence.planned,
        stops=tuple(
            _stop(stop, one, findings.obstacles_s / len(findings.seen))
            for stop, one in zip(truth.framed, findings.seen, strict=True)
        ),
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
        height_error=_spread(o.size_error[2:] for o in judged if o.size_error),
        height_visible_error=_spread(o.size_visible_error[2:] for o in judged if o.size_visible_error),
        shape_accuracy=float(np.mean([o.shape_true == o.shape_estimated for o in judged])) if judged else None,
        **_overlaps(truth.obstacles, findings.obstacles, matching),
        surface=_surface(surface),
        time=_times(findings, truth, spent),
        well=well(obstacles, len(matching.false)),
        versions=versions(),
        texture=sequence.texture,
        failed=findings.failed,
        warnings=(*world.warnings, *sequence.notes, *warning(findings)),
        sensors=dict(truth.disturbed.get("sensors", {})),
        calibration=dict(truth.disturbed.get("calibration", {})),
        light=dict(truth.disturbed.get("light", {})),
        odometry=dict(truth.disturbed.get("odometry", {})),
        whereabouts=whereabouts(findings, truth),
        alignment=_alignment(findings),
        plain=_plain(findings),
        explained=_explained(findings, truth, matching),
    )


def _times(findings: Findings, truth: Truth, spent: float) -> dict[str, float]:
    """Wall-clock seconds of a run by what they were spent on; `spent` on the evaluation."""
    return {
        "total": findings.total_s,
        "drive": float(sum(stop.drive_s for stop in truth.stops)),
        "render": float(sum(stop.render_s for stop in truth.stops)),
        "evolve": findings.see_s,
        **({"localise": findings.located.seconds} if findings.located else {}),
        "obstacles": findings.obstacles_s,
        "evaluate": spent,
    }


def _plain(findings: Findings) -> float | None:
    """The mean share of the pictures in which the engine says that there is nothing to match."""
    told = [one.swarm.plain for one in findings.seen if one.swarm.plain is not None]
    return float(np.mean(told)) if told else None


def _explained(findings: Findings, truth: Truth, matching: Matching) -> dict[str, Any]:
    """What of the errors is the calibration's; nothing where that is as it should be."""
    if not truth.disturbed.get("calibration") or not findings.seen or findings.seen[0].frame.other is not None:
        return {}  # one camera has another rig in each frame
    pairs = [
        (true, _estimate(true, findings.obstacles, matching, i))
        for i, true in enumerate(truth.obstacles)
        if i in matching.pairs and true.visible
    ]
    return explanation(pairs, truth.sights, findings.seen[0].frame.pair.rig)


def _alignment(findings: Findings) -> dict[str, float] | None:
    """What the engine knew of the right camera at the end."""
    swarm = findings.seen[-1].swarm if findings.seen else None
    if swarm is None or swarm.rows_px is None or swarm.roll_deg is None:
        return None
    return {
        "row_shift_px": swarm.rows_px,
        # A camera that is rolled clockwise sees the world turned the other way; the names are those of [calibration].
        "right_roll_deg": 0.0 - swarm.roll_deg,
        "right_blur_px": max(swarm.softened_left_px) - max(swarm.softened_right_px),
    }


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
        held = matching.pieces.get(i, ONE)
        estimate = _estimate(true, estimates, matching, i)
        c = compare(true, estimate)
        size_visible = None if c.size_visible is None else _triple(c.size_visible)
        size_error = None if c.size_visible is None else _triple(c.size_estimated - c.size_visible)
        right = true.visible and found_well(c.center_visible_error, size_error, size_visible)
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
                size_visible=size_visible,
                size_estimated=_triple(c.size_estimated),
                size_error=_triple(c.size_estimated - true.size),
                size_visible_error=size_error,
                yaw_error_deg=None if c.yaw_error is None else math.degrees(c.yaw_error),
                found_well=right and held.share >= WELL_HELD,
                share=held.share,
                pieces=len(held.estimates),
            )
        )
    return tuple(reports)


def _estimate(true: TrueObstacle, estimates: Sequence[Obstacle], matching: Matching, i: int) -> Obstacle:
    """What stands for a true obstacle: an estimate, or all pieces of a long structure as one."""
    if i not in matching.pieces:
        return estimates[matching.pairs[i]]
    return whole(true, [estimates[j] for j in matching.pieces[i].estimates])


def _overlaps(truth: Sequence[TrueObstacle], estimates: Sequence[Obstacle], matching: Matching) -> dict[str, Any]:
    """`iou_plan` and `iou_3d`."""
    seen = [i for i, true in enumerate(truth) if true.visible]
    found = [
        overlap(truth[i], _estimate(truth[i], estimates, matching, i)) if i in matching.pairs else None for i in seen
    ]
    if not seen:
        return {"iou_plan": None, "iou_3d": None}
    plan, volume = (sum(one[k] for one in found if one is not None) / len(seen) for k in range(2))
    return {"iou_plan": float(plan), "iou_3d": float(volume)}


def _stop(stop: Stop, seen: Seen, obstacles_s: float) -> StopReport:
    return StopReport(
        index=stop.index,
        commanded=_pose(stop.commanded),
        odometry=_pose(stop.odometry),
        true=_pose(stop.true),
        iterations=seen.swarm.iterations,
        converged=bool(seen.swarm.converged),
        time={"render": stop.render_s, "evolve": seen.seconds, "obstacles": obstacles_s},
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
    if not flat:
        return NO_SPREAD
    return Spread(median=float(np.median(flat)), p95=float(np.quantile(flat, 0.95)), max=max(flat))


def _pose(pose: Pose2) -> Triple:
    return (float(pose.x), float(pose.y), float(pose.yaw))


def _triple(values: ArrayLike) -> Triple:
    x, y, z = np.asarray(values, dtype=np.float64).tolist()
    return (x, y, z)
