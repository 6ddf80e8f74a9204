"""The rerun recording of a run, frame by frame; what stands still in it is `recording_world`'s.

Three timelines: `stop`, `sim_time`, and `generation`, which counts the generations of all stops one after the
other. A stop's images stand at its first generation and its flies at its last, so that playing `generation`
shows the search and playing `sim_time` the drive.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flysim.common.plain_data import plain_data
from flysim.errors import RecordError
from flysim.geometry.frames import inverse
from flysim.products.findings import Findings, Seen
from flysim.record import colours
from flysim.record.blueprint import blueprint
from flysim.record.document import report_markdown
from flysim.record.recording_world import link_entity, log_boxes, log_robot, log_world, placed
from flysim.truth.truth import Truth
from flysim.worlds.model import Part

if TYPE_CHECKING:
    from rerun import RecordingStream

APPLICATION = "flysim"
CAMERAS = ("left", "right")
_JPEG_QUALITY = 85
_HALF_PIXEL = 0.5  # rerun has the first pixel's centre at 0.5, flysim at 0
CURVES = {"best": "Best fitness", "mean": "Mean fitness", "settled": "Settled share"}


def write_recording(
    path: Path,
    findings: Findings,
    truth: Truth | None,
    report: Mapping[str, Any] | None,
    *,
    robot_parts: Sequence[Part] = (),
    config: Mapping[str, Any] | None = None,
    metric: bool = True,
) -> None:
    """Write a recording that opens as designed: world, images, curves, report and log.

    It holds no wall-clock time: the same seed gives the same recording. Without truth there is neither world nor true
    path, and the robot stands where it believes to stand.

    Args:
        path: the `.rrd` file.
        findings: what an engine found.
        truth: of the same frames, or None.
        report: `Report.to_json()`, or None.
        robot_parts: the robot's visuals in base_link; a plain rover where there are none.
        config: all parameters of the run.
        metric: whether lengths are in metres; else no size is named.

    Raises:
        RecordError: rerun is switched off by its environment variable.
        OSError: the disk is full or refuses.
    """
    import rerun as rr

    settings: dict[str, Any] = plain_data(config or {})
    rec = rr.RecordingStream(APPLICATION, recording_id=recording_id(findings, settings), send_properties=False)
    if not rec.is_enabled():
        raise RecordError("the environment variable RERUN switches recordings off: unset it, or set RERUN=on")
    rec.set_log_time_enabled(False)
    rec.set_log_tick_enabled(False)
    # In memory, then to disk: rerun's own file sink never returns from a full disk.
    memory = rec.memory_recording()
    sequence = findings.sequence
    rec.send_blueprint(blueprint(findings, truth, CAMERAS, CURVES))
    rec.send_recording_name(f"{sequence.name}, seed {sequence.seed}")
    rec.send_property("run", rr.AnyValues(**_properties(findings, truth, report or {}, settings)))
    if report is not None:
        rec.log("report", rr.TextDocument(report_markdown(report), media_type=rr.MediaType.MARKDOWN), static=True)
    log_world(rec, truth)
    log_boxes(rec, findings, truth, metric=metric)
    log_robot(rec, findings, truth, robot_parts)
    first = 0
    for k, one in enumerate(findings.seen):
        _log_place(rec, one, truth, k, first)
        _log_eyes(rec, one)
        first = _log_seen(rec, findings, one, first)
        _log_words(rec, _told(findings, one, truth, k))
    _log_words(rec, sequence.blocked or "the whole path was driven", warn=bool(sequence.blocked))
    for warning in () if truth is None else truth.world.warnings:
        _log_words(rec, warning, warn=True)
    rec.flush()
    data = memory.drain_as_bytes()
    rec.disconnect()
    path.write_bytes(data)


def load() -> None:
    """Import rerun, which takes a second."""
    import_module("rerun.blueprint")


def recording_id(findings: Findings, config: Mapping[str, Any]) -> str:
    """The same for the same run and another for any other: the viewer merges recordings of one id."""
    digest = hashlib.blake2b(json.dumps(plain_data(config), sort_keys=True).encode(), digest_size=4).hexdigest()
    sequence = findings.sequence
    return f"{sequence.name}-s{sequence.seed}-{findings.engine}-{sequence.renderer}-{digest}"


def _properties(
    findings: Findings, truth: Truth | None, report: Mapping[str, Any], config: Mapping[str, Any]
) -> dict[str, Any]:
    scores = {key: report[key] for key in ("status", "precision", "recall", "f1") if report.get(key) is not None}
    return {
        "scenario": findings.sequence.name,
        "seed": findings.sequence.seed,
        "engine": findings.engine,
        "renderer": findings.sequence.renderer,
        **({} if truth is None else {"world": truth.world.name}),
        **scores,
        "config": json.dumps(config, sort_keys=True),
    }


def _set_times(rec: RecordingStream, one: Seen, generation: int) -> None:
    rec.set_time("stop", sequence=one.frame.index)
    rec.set_time("sim_time", duration=one.frame.time)
    rec.set_time("generation", sequence=generation)


def _log_place(rec: RecordingStream, one: Seen, truth: Truth | None, k: int, first: int) -> None:
    """Where the robot is at frame `k`, which begins at generation `first`, and all that can be moved."""
    _set_times(rec, one, first)
    if truth is None:
        rec.log("world/robot", placed(one.frame.T_world_base))
        return
    rec.log("world/robot", placed(truth.framed[k].T_world_base))
    for index, link in enumerate(truth.world.links):
        if not link.static:
            rec.log(link_entity(index, link), placed(truth.framed[k].T_world_links[index]))


def _log_eyes(rec: RecordingStream, one: Seen) -> None:
    """Both cameras and their images, as yet without flies."""
    import rerun as rr

    frame, rig = one.frame, one.frame.pair.rig
    poses = (frame.T_base_left, frame.T_base_left @ inverse(rig.T_right_left))
    views = zip(CAMERAS, (frame.pair.left, frame.pair.right), (rig.left, rig.right), poses, strict=True)
    for name, image, camera, T_base_camera in views:
        entity = f"world/robot/{name}"
        pinhole = rr.Pinhole(
            focal_length=[camera.fx, camera.fy],
            principal_point=[camera.cx + _HALF_PIXEL, camera.cy + _HALF_PIXEL],
            width=camera.width,
            height=camera.height,
            camera_xyz=rr.ViewCoordinates.RDF,
            image_plane_distance=0.25,
        )
        rec.log(entity, placed(T_base_camera), pinhole)
        rec.log(f"{entity}/image", rr.Image(image, color_model="RGB").compress(jpeg_quality=_JPEG_QUALITY))
        rec.log(f"{entity}/flies", rr.Points2D(np.zeros((0, 2))))


def _log_seen(rec: RecordingStream, findings: Findings, one: Seen, first: int) -> int:
    """The flies of a frame and how they came about, from generation `first` on; returns where the next begins."""
    import rerun as rr

    swarm, cloud = one.swarm, findings.cloud
    after = first + max(swarm.iterations, 1)
    _set_times(rec, one, after - 1)
    colour = colours.by_fitness(swarm.fitness)
    for name, uv in zip(CAMERAS, (swarm.uv, swarm.uv_right), strict=True):
        points = rr.Points2D(uv + _HALF_PIXEL, colors=colour, radii=rr.Radius.ui_points(1.5))
        rec.log(f"world/robot/{name}/flies", points)
    mine = cloud.stop == one.frame.index
    colour = colours.by_fitness(cloud.fitness[mine])
    rec.log("world/flies", rr.Points3D(cloud.points[mine], colors=colour, radii=rr.Radius.ui_points(1.5)))
    rec.log("curves/iterations", rr.Scalars(swarm.iterations))
    if swarm.history:
        for name in CURVES:
            values = [getattr(generation, name) for generation in swarm.history]
            rec.send_columns(
                f"curves/{name}",
                indexes=[rr.TimeColumn("generation", sequence=range(first, after))],
                columns=rr.Scalars.columns(scalars=values),
            )
            # Once more for the timelines that know stops alone: there a history would be a vertical line.
            rec.disable_timeline("generation")
            rec.log(f"curves/{name}", rr.Scalars(values[-1]))
            _set_times(rec, one, after - 1)
    return after


def _told(findings: Findings, one: Seen, truth: Truth | None, k: int) -> str:
    """What the log says of a frame."""
    swarm, mine = one.swarm, int((findings.cloud.stop == one.frame.index).sum())
    text = f"stop {one.frame.index}: {swarm.iterations} generations, {len(swarm.points)} flies in the images, "
    text += f"{mine} on surfaces"
    if truth is not None:
        stop = truth.framed[k]
        text += f", odometry off by {100.0 * stop.true.distance(stop.odometry):.1f} cm"
    return f"{text}. {swarm.reason}"


def _log_words(rec: RecordingStream, text: str, *, warn: bool = False) -> None:
    import rerun as rr

    rec.log("log", rr.TextLog(text, level=rr.TextLogLevel.WARN if warn else rr.TextLogLevel.INFO))
