"""What was seen in one pair of photographs: flies, floor, things, scores, and what is wrong with the pair."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from flysim.common.sheet import NOTHING, Sheet, number, percent
from flysim.evaluate.disparity_scores import MatchScores
from flysim.geometry.frames import Array, inverse, transform
from flysim.photographs.depths import Depths
from flysim.photographs.floor import Floor
from flysim.photographs.level import Photograph
from flysim.products.findings import Findings
from flysim.products.obstacle import Obstacle
from flysim.products.thing import Thing
from flysim.record.outline import box_corners


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sighting:
    """One pair, seen.

    Attributes:
        photograph: the pair as flies saw it.
        depths: that were searched.
        findings: of the first engine.
        floor: None where none was found.
        things: what stands or hangs there, the one with most flies first.
        remarks: what a user should know, one sentence each.
        scores: by engine, where the truth is known.
        seconds: wall-clock seconds from two pictures to here.
    """

    photograph: Photograph
    depths: Depths
    findings: Findings
    floor: Floor | None
    things: tuple[Thing, ...]
    remarks: tuple[str, ...]
    scores: dict[str, MatchScores] = field(default_factory=dict)
    seconds: float

    @property
    def name(self) -> str:
        """Of the pair."""
        return self.photograph.name

    def to_json(self) -> dict[str, Any]:
        """All of it but the flies themselves."""
        swarm, metric = self.findings.seen[0].swarm, self.photograph.metric
        camera = self.photograph.pair.rig.left
        return {
            "name": self.name,
            "width": camera.width,
            "height": camera.height,
            "calibration": self.photograph.calibration,
            "metric": metric,
            "rectified_here": self.photograph.rectified_here,
            "disparities_px": [round(one, 3) for one in self.depths.disparities],
            "depths_m": [round(self.depths.nearest, 4), round(self.depths.farthest, 4)] if metric else None,
            "depths_told_by": self.depths.told_by,
            "engine": self.findings.engine,
            "flies": len(swarm.points),
            "generations": swarm.iterations,
            "reason": swarm.reason,
            "floor": self._floor_json() if metric else None,
            "obstacles": [self._thing_json(one) for one in self.things],
            "remarks": list(self.remarks),
            "scores": {name: score.to_json() for name, score in self.scores.items()},
            "seconds": round(self.seconds, 3),
        }

    def _floor_json(self) -> dict[str, Any] | None:
        floor = self.floor
        if floor is None:
            return None
        return {
            "height_m": round(floor.height, 4),
            "pitch_deg": round(floor.pitch_deg, 3),
            "roll_deg": round(floor.roll_deg, 3),
            "share_of_flies": round(floor.share, 4),
            "spread_m": round(floor.spread, 5),
        }

    def _thing_json(self, thing: Thing) -> dict[str, Any]:
        one, metric = thing.obstacle, self.photograph.metric
        told: dict[str, Any] = {
            "shape": one.shape,
            "flies": len(one.flies),
            "rect_px": list(thing.rect_px),
            "disparity_px": round(thing.disparity_px, 3),
        }
        if metric:
            told |= {
                "center_m": [round(float(v), 4) for v in one.center],
                "size_m": [round(float(v), 4) for v in one.size],
                "yaw_deg": round(math.degrees(one.yaw), 2),
                "distance_m": round(thing.distance, 4),
                "stands_on": "nothing seen" if thing.afloat else "floor",
            }
        return told

    def sheets(self) -> list[Sheet]:
        """The things, and the scores where there are any."""
        return [self._things_sheet(), *([scores_sheet(self.scores)] if self.scores else [])]

    def headline(self) -> list[str]:
        """What was seen, in a few lines."""
        swarm, camera = self.findings.seen[0].swarm, self.photograph.pair.rig.left
        low, high = self.depths.disparities
        lines = [
            f"{self.name}: {camera.width}x{camera.height} px, calibration {self.photograph.calibration}, "
            f"{len(swarm.points)} {self.findings.engine if self.findings.engine != 'flies' else ''}".rstrip()
            + (" flies" if self.findings.engine == "flies" else " points"),
            f"searched {low:.0f} to {high:.0f} px"
            + (f", {self.depths.nearest:.2f} to {self.depths.farthest:.2f} m" if self.photograph.metric else "")
            + f" (told by {self.depths.told_by})",
        ]
        if self.photograph.metric:
            lines.append(self._floor_line())
        return [*lines, *(f"note: {one}" for one in self.remarks)]

    def _floor_line(self) -> str:
        floor = self.floor
        if floor is None:
            return "no floor found: each thing has a box of its own height"
        return (
            f"floor {floor.height:.3f} m below the camera, which looks down {floor.pitch_deg:+.1f} degrees and is "
            f"rolled {floor.roll_deg:+.1f}; {100.0 * floor.share:.0f} % of the flies lie on it"
        )

    def _things_sheet(self) -> Sheet:
        if not self.photograph.metric:
            rows = tuple(
                (str(k), one.obstacle.shape, f"{one.disparity_px:.1f}", " ".join(map(str, one.rect_px)),
                 str(len(one.obstacle.flies)))
                for k, one in enumerate(self.things)
            )  # fmt: skip
            columns = ("thing", "shape", "disparity [px]", "u v w h [px]", "flies")
            return Sheet(title="", columns=columns, rows=rows, left=(0, 1))
        rows = tuple(
            (
                str(k),
                one.obstacle.shape,
                number(one.distance, 2),
                " x ".join(f"{100.0 * side:.1f}" for side in one.obstacle.size),
                number(100.0 * float(one.obstacle.center[2] - one.obstacle.size[2] / 2.0), 1),
                "nothing" if one.afloat else "floor",
                str(len(one.obstacle.flies)),
            )
            for k, one in enumerate(self.things)
        )
        columns = ("thing", "shape", "away [m]", "l x w x h [cm]", "from [cm]", "on", "flies")
        return Sheet(title="", columns=columns, rows=rows, left=(0, 1))


def scores_sheet(scores: dict[str, MatchScores], title: str = "") -> Sheet:
    """Engines by the same scores, over pixels that both cameras see."""
    rows = []
    for name, one in scores.items():
        seen = one.seen
        rows.append(
            (
                name,
                *(percent(share) for share in (seen.within_0_5px, seen.within_1px, seen.within_3px)),
                number(seen.median_px, 3),
                percent(seen.d1),
                percent(one.coverage),
                NOTHING if seen.median_m is None else f"{1000.0 * seen.median_m:.1f}",
                str(one.matches),
                f"{one.ms:.0f}",
            )
        )
    columns = ("engine", "0.5 px", "1 px", "3 px", "median", "D1", "cells", "[mm]", "matches", "ms")
    note = "over pixels that both cameras see; cells: textured ones of 16 px that hold a match; [mm]: median of depth"
    return Sheet(title=title, columns=columns, rows=tuple(rows), note=note)


def thing_of(obstacle: Obstacle, afloat: bool, findings: Findings) -> Thing:
    """An obstacle with where it is in the picture."""
    frame, cloud = findings.seen[0].frame, findings.cloud
    corners = transform(inverse(frame.T_world_left), box_corners(obstacle.center, obstacle.size, obstacle.yaw))
    uv = cloud.uv[obstacle.flies].astype(np.float64)
    disparity = float(np.median(uv[:, 0] - cloud.uv_right[obstacle.flies][:, 0]))
    rect = _rect(corners, uv, findings)
    return Thing(
        obstacle=obstacle, afloat=afloat, distance=max(float(corners[:, 2].min()), 0.0), rect_px=rect,
        disparity_px=disparity,
    )  # fmt: skip


def _rect(corners: Array, uv: Array, findings: Findings) -> tuple[int, int, int, int]:
    camera = findings.seen[0].frame.pair.rig.left
    if corners[:, 2].min() > 1e-6:
        uv = camera.project(corners)
    low = np.clip(uv.min(axis=0), 0.0, (camera.width - 1, camera.height - 1))
    high = np.clip(uv.max(axis=0), 0.0, (camera.width - 1, camera.height - 1))
    u, v, w, h = (round(float(one)) for one in (*low, *(high - low)))
    return u, v, w, h
