"""Points, disparities or obstacles of another algorithm against the truth of a data set."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flysim.common.progress import Progress, silent
from flysim.common.sheet import Sheet, number, percent
from flysim.datasets.middlebury import disparities
from flysim.datasets.source import DataSet, DataSetSource
from flysim.engines.disparity import check_disparities, disparity_swarm
from flysim.engines.points import points_swarm
from flysim.errors import FlysimError
from flysim.evaluate.disparity_scores import Accuracy, DisparityTruth, score_map
from flysim.evaluate.evaluator import evaluate
from flysim.evaluate.report import Report
from flysim.foreign.disparity import read_map
from flysim.foreign.points import read_points
from flysim.geometry.frames import inverse, transform
from flysim.obstacles.gather import gather
from flysim.plain import shown_path
from flysim.products.findings import Findings, Seen
from flysim.products.frame import Frame
from flysim.products.swarm import Swarm
from flysim.runs.scenario import Scenario
from flysim.runs.see import gathered
from flysim.studies.compare.compare import COLUMNS, row
from flysim.studies.compare.figures_of import pooled
from flysim.studies.score.files import DISPARITIES, POINTS, found_files, one_a_frame, read_obstacles
from flysim.truth.truth import Truth

KINDS = ("points", "disparity", "obstacles")
FRAMES = ("left", "world")  # in which points may be told
SHARES = ("within_0_5px", "within_1px", "within_2px", "within_3px", "d1")
NOTE = "against the visible part; well: centre and sizes to 3 cm, or 5 % of a size; surface F at 2 cm"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scored:
    """What another algorithm's results are worth.

    Attributes:
        kind: of the results, one of `KINDS`.
        findings: what they come to.
        truth: of the same frames.
        report: how far they are from it; of obstacles alone, its surface says nothing.
        seen, everywhere: of disparities, over the pixels that both cameras see and over all; None of others.
        density: share of the pixels that both cameras see which have a disparity; None of others.
    """

    kind: str
    findings: Findings
    truth: Truth
    report: Report
    seen: Accuracy | None = None
    everywhere: Accuracy | None = None
    density: float | None = None

    def to_json(self) -> dict[str, Any]:
        """`report` as that of a run, `pooled` as a row of `flysim compare`, and `disparity` where there is one."""
        report, figures = self.report.to_json(), self._figures()
        if self.kind == "obstacles":
            report["surface"] = None
        told: dict[str, Any] = {"kind": self.kind, "frames": len(self.truth.stops), "pooled": figures, "report": report}
        if self.seen is not None and self.everywhere is not None:
            told["disparity"] = {
                **dataclasses.asdict(self.seen),
                "density": self.density,
                "all_pixels": dataclasses.asdict(self.everywhere),
            }
        return told

    def sheets(self) -> list[Sheet]:
        """A row of the figures over all; of disparities a second one of their pixels."""
        report = self.report
        title = f"{report.engine} on {report.scenario}: {len(self.truth.stops)} frames"
        sheets = [Sheet(title=title, columns=COLUMNS, rows=(row(report.engine, self._figures()),), note=NOTE)]
        if self.seen is not None and self.everywhere is not None:
            rows = tuple(
                (name, str(of.count), *(percent(getattr(of, share)) for share in SHARES), number(of.median_px, 3))
                for name, of in (("seen by both", self.seen), ("all", self.everywhere))
            )
            columns = ("pixels", "count", "0.5 px", "1 px", "2 px", "3 px", "D1", "median px")
            sheets.append(
                Sheet(title="disparities", columns=columns, rows=rows, note=f"density {percent(self.density)}")
            )
        return sheets

    def _figures(self) -> dict[str, Any]:
        """As a comparison pools them, without what these results do not tell."""
        figures = pooled([self.report])
        if self.kind == "obstacles":
            figures["surface_f"] = dict.fromkeys(figures["surface_f"])
        return {**figures, "ms_per_stop": None}


def score(
    data: DataSet,
    plan: Scenario,
    kind: str,
    files: Sequence[Path],
    *,
    name: str | None = None,
    frame: str = "left",
    progress: Progress = silent,
) -> Scored:
    """Judges results that another algorithm made of the frames of a data set.

    Points and disparities are thinned to as many as flies may be preserved, and become obstacles by flysim's clusterer,
    as those of every engine do; obstacles are taken as they are.

    Args:
        data: with its truth.
        plan: how it is seen: the settings of the clusterer.
        kind: one of `KINDS`.
        files: of the results: one a frame, a folder or a pattern of them; of obstacles one.
        name: of the algorithm.
        frame: of points: "left", each file in the left camera's optical frame, or "world".
        progress: called with a word and a share as the work goes on.

    Raises:
        FlysimError: the data set has no truth, or a file is missing, damaged, or of another size or count.
    """
    if not data.known:
        raise FlysimError(
            f"{shown_path(data.folder)}: has no truth to score by. flysim export writes sets that have one."
        )
    source = DataSetSource(data, seed=plan.seed)
    name = name or kind
    if kind == "obstacles":
        return _of_obstacles(source, plan, list(files), name)
    given = found_files(files, POINTS if kind == "points" else DISPARITIES)
    given = one_a_frame(given, data.rows, len(data.recorded.times))
    seen: list[Seen] = []
    maps = []
    for path, one in zip(given, source.frames(), strict=True):
        if kind == "points":
            swarm = _of_points(path, one, plan, name, frame)
        else:
            maps.append(_map(path, one))
            swarm = disparity_swarm(one.pair, plan.flies, maps[-1], name=name)
        seen.append(Seen(frame=one, swarm=swarm, seconds=0.0))
        progress(f"frame {len(seen)} of {len(given)}", 0.7 * len(seen) / len(given))
    findings = gathered(name, source.sequence(), seen, plan.obstacles, max_range=plan.flies.max_depth)
    progress("evaluate", 0.8)
    truth = source.truth()
    assert truth is not None
    report = evaluate(findings, truth)
    scored = Scored(kind=kind, findings=findings, truth=truth, report=report)
    return scored if kind == "points" else _with_pixels(scored, maps)


def _of_points(path: Path, frame: Frame, plan: Scenario, name: str, told_in: str) -> Swarm:
    points = read_points(path)
    if told_in == "world":
        points = transform(inverse(frame.T_world_left), points)
    return points_swarm(frame.pair, plan.flies, points, name=name)


def _map(path: Path, frame: Frame) -> np.ndarray:
    check_disparities(frame.pair.rig, "of the disparities")
    disparity, image = read_map(path, "disparity"), frame.pair.left
    if disparity.shape != image.shape[:2]:
        got, asked = ("x".join(map(str, shape[1::-1])) for shape in (disparity.shape, image.shape))
        raise FlysimError(f"{shown_path(path)}: {got} px, the left picture has {asked} px. Give one of its size.")
    return disparity


def _with_pixels(scored: Scored, maps: Sequence[np.ndarray]) -> Scored:
    """All pixels of all frames as one long picture."""
    true, seen = [], []
    for stop, sight in zip(scored.truth.stops, scored.truth.sights, strict=True):
        known = disparities(*stop.views, 1)
        true.append(np.where(np.isfinite(known), known, np.float32(np.nan)))
        seen.append(sight.seen)
    rig = scored.findings.seen[0].frame.pair.rig
    gain, offset = rig.left.fx * rig.baseline, rig.left.cx - rig.right.cx
    whole = DisparityTruth.of(np.concatenate(true), np.concatenate(seen))
    both, everywhere, density = score_map(np.concatenate(maps), whole, gain, offset)
    return dataclasses.replace(scored, seen=both, everywhere=everywhere, density=density)


def _of_obstacles(source: DataSetSource, plan: Scenario, files: list[Path], name: str) -> Scored:
    if len(files) != 1:
        raise FlysimError(f"--obstacles takes one file for all frames, got {len(files)}.")
    obstacles = read_obstacles(files[0])
    seen = [Seen(frame=frame, swarm=_nothing(), seconds=0.0) for frame in source.frames()]
    findings = Findings(
        engine=name,
        sequence=source.sequence(),
        seen=tuple(seen),
        cloud=gather([(one.frame, one.swarm) for one in seen], plan.obstacles),
        obstacles=obstacles,
        obstacles_s=0.0,
        max_range=plan.flies.max_depth,
    )
    truth = source.truth()
    assert truth is not None
    return Scored(kind="obstacles", findings=findings, truth=truth, report=evaluate(findings, truth))


def _nothing() -> Swarm:
    places, flat = np.empty((0, 3), np.float32), np.empty((0, 2), np.float32)
    return Swarm(
        points=places,
        fitness=np.empty(0, np.float32),
        uv=flat,
        normals=places,
        spread=places,
        uv_right=flat,
        region=np.empty(0, np.int32),
        age=np.empty(0, np.int32),
        history=(),
        converged=True,
        reason="obstacles were given, and no points",
    )
