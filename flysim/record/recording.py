"""The rerun recording of a run: the only file that knows rerun.

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

from flysim.errors import RecordError
from flysim.geometry.frames import Array, inverse, quaternion_xyzw
from flysim.journey import Journey, Look
from flysim.record import colours
from flysim.record.document import report_markdown
from flysim.record.files import plain, whole_track
from flysim.record.outline import visible_parts
from flysim.record.scene import extent, plain_colour, plain_rover
from flysim.worlds.model import Link, Part
from flysim.worlds.shapes import Box, Cylinder, Plane, Sphere

if TYPE_CHECKING:
    from rerun import RecordingStream, Transform3D
    from rerun.blueprint import Blueprint

    from flysim.truth.obstacles import TrueObstacle

APPLICATION = "flysim"
CAMERAS = ("left", "right")
_JPEG_QUALITY = 85
_PATH_STEP = 0.05  # [s] the robot moves in the recording at most so often
_HALF_PIXEL = 0.5  # rerun has the first pixel's centre at 0.5, flysim at 0
_MOST_LABELS = 4  # estimates that show their dimensions; more would hide each other
_CURVES = {"best": "Best fitness", "mean": "Mean fitness", "settled": "Settled share"}


def write_recording(
    path: Path,
    journey: Journey,
    report: Mapping[str, Any],
    true_obstacles: Sequence[TrueObstacle],
    *,
    robot_parts: Sequence[Part] = (),
    config: Mapping[str, Any] | None = None,
) -> None:
    """Write a recording that opens as designed: world, images, curves, report and log.

    It holds no wall-clock time: the same seed gives the same recording.

    Args:
        path: the `.rrd` file.
        journey: the finished drive.
        report: `Report.to_json()`.
        true_obstacles: what stands in the world.
        robot_parts: the robot's visuals in base_link; a plain rover where there are none.
        config: all parameters of the run.

    Raises:
        RecordError: rerun is switched off by its environment variable.
        OSError: the disk is full or refuses.
    """
    import rerun as rr

    settings: dict[str, Any] = plain(config or {})
    rec = rr.RecordingStream(APPLICATION, recording_id=recording_id(journey, settings), send_properties=False)
    if not rec.is_enabled():
        raise RecordError("the environment variable RERUN switches recordings off: unset it, or set RERUN=on")
    rec.set_log_time_enabled(False)
    rec.set_log_tick_enabled(False)
    # In memory, then to disk: rerun's own file sink never returns from a full disk.
    memory = rec.memory_recording()
    rec.send_blueprint(_blueprint(journey))
    rec.send_recording_name(f"{journey.scenario}, seed {journey.seed}")
    rec.send_property("run", rr.AnyValues(**_properties(journey, report, settings)))
    rec.log("report", rr.TextDocument(report_markdown(report), media_type=rr.MediaType.MARKDOWN), static=True)
    _log_world(rec, journey)
    _log_boxes(rec, journey, true_obstacles)
    _log_robot(rec, journey, robot_parts)
    first = 0
    for look in journey.looks:
        first = _log_stop(rec, journey, look, first)
    _log_words(rec, journey.blocked or "the whole path was driven", warn=bool(journey.blocked))
    for warning in journey.world.warnings:
        _log_words(rec, warning, warn=True)
    rec.flush()
    data = memory.drain_as_bytes()
    rec.disconnect()
    path.write_bytes(data)


def load() -> None:
    """Import rerun, which takes a second."""
    import_module("rerun.blueprint")


def recording_id(journey: Journey, config: Mapping[str, Any]) -> str:
    """The same for the same run and another for any other: the viewer merges recordings of one id."""
    digest = hashlib.blake2b(json.dumps(plain(config), sort_keys=True).encode(), digest_size=4).hexdigest()
    return f"{journey.scenario}-s{journey.seed}-{journey.engine}-{journey.renderer}-{digest}"


def _properties(journey: Journey, report: Mapping[str, Any], config: Mapping[str, Any]) -> dict[str, Any]:
    scores = {key: report[key] for key in ("status", "precision", "recall", "f1") if report.get(key) is not None}
    return {
        "scenario": journey.scenario,
        "seed": journey.seed,
        "engine": journey.engine,
        "renderer": journey.renderer,
        "world": journey.world.name,
        **scores,
        "config": json.dumps(config, sort_keys=True),
    }


def _blueprint(journey: Journey) -> Blueprint:
    import rerun.blueprint as rrb

    center, reach = extent(journey)
    eye = rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=center + reach * np.array([-0.5, -0.55, 0.6]),
        look_target=center,
        eye_up=(0.0, 0.0, 1.0),
    )
    scene = ["/world/**", *(f"- /world/robot/{camera}/flies" for camera in CAMERAS)]
    start, end = rrb.TimeRangeBoundary.infinite(), rrb.TimeRangeBoundary.cursor_relative(seq=0)
    past = rrb.VisibleTimeRanges(
        [rrb.VisibleTimeRange(name, start=start, end=end) for name in ("generation", "stop", "sim_time")]
    )

    def space(name: str, overrides: Any) -> rrb.Spatial3DView:
        background = rrb.Background(kind=rrb.BackgroundKind.SolidColor, color=(247, 247, 247))
        return rrb.Spatial3DView(
            origin="/world",
            contents=scene,
            name=name,
            overrides=overrides,
            background=background,
            line_grid=False,
            eye_controls=eye,
        )

    images = (
        rrb.Spatial2DView(origin=f"/world/robot/{camera}", name=f"{camera.title()} image with its flies")
        for camera in CAMERAS
    )
    curves = [rrb.TimeSeriesView(origin=f"/curves/{key}", name=name) for key, name in _CURVES.items()]
    curves.append(rrb.TimeSeriesView(origin="/curves/iterations", name="Generations a stop"))
    words = rrb.Tabs(
        rrb.TextDocumentView(origin="/report", name="Report"),
        rrb.TextLogView(origin="/log", name="Log"),
        active_tab=0,
    )
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.Tabs(space("World so far", {"/world/flies": past}), space("This stop alone", {}), active_tab=0),
                rrb.Horizontal(*curves),
                row_shares=[3.0, 1.0],
            ),
            rrb.Vertical(rrb.Horizontal(*images), words, row_shares=[1.0, 1.6]),
            column_shares=[1.3, 1.0],
        ),
        rrb.TimePanel(state="collapsed", timeline="generation", fps=15.0, play_state="following"),
        collapse_panels=True,
    )


def _log_world(rec: RecordingStream, journey: Journey) -> None:
    import rerun as rr

    rec.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for index, link in enumerate(journey.world.links):
        if link.static:
            rec.log(_link_entity(index, link), _place(link.T_world_link), static=True)
        for part in visible_parts(link):
            _log_part(rec, [*_link_entity(index, link), part.name], part)


def _link_entity(index: int, link: Link) -> list[object]:
    return ["world", "scene", f"{index:03d}-{link.model}-{link.name}"]


def _log_part(rec: RecordingStream, entity: list[object], part: Part) -> None:
    """One solid shape in one colour: flies show on it, which they would not on its texture."""
    import rerun as rr

    shape, paint, solid = part.shape, plain_colour(part.material), rr.components.FillMode.Solid
    if isinstance(shape, Box):
        body = rr.Boxes3D(sizes=[shape.size], colors=[paint], fill_mode=solid)
    elif isinstance(shape, Cylinder):
        body = rr.Cylinders3D(lengths=[shape.length], radii=[shape.radius], colors=[paint], fill_mode=solid)
    elif isinstance(shape, Sphere):
        body = rr.Ellipsoids3D(half_sizes=[[shape.radius] * 3], colors=[paint], fill_mode=solid)
    elif isinstance(shape, Plane):
        body = rr.Mesh3D(vertex_positions=shape.outline(), triangle_indices=[[0, 1, 2], [0, 2, 3]], albedo_factor=paint)
    else:
        body = rr.Mesh3D(vertex_positions=shape.vertices, triangle_indices=shape.faces, albedo_factor=paint)
    rec.log(entity, _place(part.T_link_part), body, static=True)


def _log_boxes(rec: RecordingStream, journey: Journey, true_obstacles: Sequence[TrueObstacle]) -> None:
    """The true and the estimated boxes, named above them. Static: the estimate is fused after the drive."""
    import rerun as rr

    sizes = (" x ".join(f"{100.0 * side:.1f}" for side in obstacle.size) for obstacle in journey.obstacles)
    names = {
        "true": [o.name for o in true_obstacles],
        "estimated": [f"{i}: {size} cm" for i, size in enumerate(sizes)],
    }
    few = len(journey.obstacles) <= _MOST_LABELS
    for entity, colour, boxes, above, shown in (
        ("true", colours.TRUE, true_obstacles, 0.04, True),
        ("estimated", colours.BELIEVED, journey.obstacles, 0.10, few),
    ):
        centers = np.reshape([box.center for box in boxes], (-1, 3))
        box_sizes = np.reshape([box.size for box in boxes], (-1, 3))
        turns = [[0.0, 0.0, np.sin(box.yaw / 2.0), np.cos(box.yaw / 2.0)] for box in boxes]
        paint, thin = [colour] * len(boxes), rr.Radius.ui_points(1.5)
        drawn = rr.Boxes3D(
            centers=centers,
            sizes=box_sizes,
            quaternions=[rr.Quaternion(xyzw=turn) for turn in turns],
            colors=paint,
            radii=thin,
        )
        rec.log(["world", entity], drawn, static=True)
        # Two labels in the middle of two nearly equal boxes would cover each other.
        tops = centers + box_sizes * (0.0, 0.0, 0.5) + (0.0, 0.0, above * extent(journey)[1])
        words = rr.Points3D(tops, labels=names[entity], radii=thin, colors=paint, show_labels=shown)
        rec.log(["world", entity, "names"], words, static=True)


def _log_robot(rec: RecordingStream, journey: Journey, parts: Sequence[Part]) -> None:
    """The robot's body, its way while it drives, and both its paths."""
    import rerun as rr

    for index, part in enumerate(parts or plain_rover(journey)):
        _log_part(rec, ["world", "robot", "body", f"{index}-{part.name}"], part)
    track = whole_track(journey)
    paths = (("true", colours.TRUE, (4, 5), 3.0), ("odometry", colours.BELIEVED, (1, 2), 1.5))
    for name, colour, columns, thick in paths:
        line = np.c_[track[:, columns], np.full(len(track), 0.03 / thick)]  # the thinner line on top
        strips = [line] if len(line) > 1 else []
        drawn = rr.LineStrips3D(strips, colors=[colour] * len(strips), radii=rr.Radius.ui_points(thick))
        rec.log(["world", "path", name], drawn, static=True)
    if len(track):
        step = np.floor(track[:, 0] / _PATH_STEP)
        moves = track[np.append(np.diff(step) > 0, True)]
        zero, half = np.zeros(len(moves)), moves[:, 6] / 2.0
        rec.send_columns(
            "world/robot",
            indexes=[rr.TimeColumn("sim_time", duration=moves[:, 0])],
            columns=rr.Transform3D.columns(
                translation=np.stack([moves[:, 4], moves[:, 5], zero], axis=1),
                quaternion=np.stack([zero, zero, np.sin(half), np.cos(half)], axis=1),
            ),
        )


def _log_stop(rec: RecordingStream, journey: Journey, look: Look, first: int) -> int:
    """Everything of one stop, which begins at generation `first`; returns where the next begins."""
    import rerun as rr

    stop, swarm = look.stop, look.swarm
    after = first + max(swarm.iterations, 1)

    def at(generation: int) -> None:
        rec.set_time("stop", sequence=stop.index)
        rec.set_time("sim_time", duration=stop.sim_time)
        rec.set_time("generation", sequence=generation)

    at(first)
    rec.log("world/robot", _place(stop.T_world_base))
    for index, link in enumerate(journey.world.links):
        if not link.static:
            rec.log(_link_entity(index, link), _place(stop.T_world_links[index]))
    rig = stop.pair.rig
    poses = (stop.T_base_left, stop.T_base_left @ inverse(rig.T_right_left))
    views = zip(CAMERAS, (stop.pair.left, stop.pair.right), (rig.left, rig.right), poses, strict=True)
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
        rec.log(entity, _place(T_base_camera), pinhole)
        rec.log(f"{entity}/image", rr.Image(image, color_model="RGB").compress(jpeg_quality=_JPEG_QUALITY))
        rec.log(f"{entity}/flies", rr.Points2D(np.zeros((0, 2))))
    at(after - 1)
    colour = colours.by_fitness(swarm.fitness)
    for name, uv in zip(CAMERAS, (swarm.uv, swarm.uv_right), strict=True):
        points = rr.Points2D(uv + _HALF_PIXEL, colors=colour, radii=rr.Radius.ui_points(1.5))
        rec.log(f"world/robot/{name}/flies", points)
    mine = journey.cloud.stop == stop.index
    colour = colours.by_fitness(journey.cloud.fitness[mine])
    rec.log("world/flies", rr.Points3D(journey.cloud.points[mine], colors=colour, radii=rr.Radius.ui_points(1.5)))
    rec.log("curves/iterations", rr.Scalars(swarm.iterations))
    count = f"{swarm.iterations} generations, {len(swarm.points)} flies in the images, {mine.sum()} on surfaces"
    off = 100.0 * stop.true.distance(stop.odometry)
    _log_words(rec, f"stop {stop.index}: {count}, odometry off by {off:.1f} cm. {swarm.reason}")
    if swarm.history:
        for name in _CURVES:
            values = [getattr(generation, name) for generation in swarm.history]
            rec.send_columns(
                f"curves/{name}",
                indexes=[rr.TimeColumn("generation", sequence=range(first, after))],
                columns=rr.Scalars.columns(scalars=values),
            )
            # Once more for the timelines that know stops alone: there a history would be a vertical line.
            rec.disable_timeline("generation")
            rec.log(f"curves/{name}", rr.Scalars(values[-1]))
    at(after - 1)
    return after


def _log_words(rec: RecordingStream, text: str, *, warn: bool = False) -> None:
    import rerun as rr

    rec.log("log", rr.TextLog(text, level=rr.TextLogLevel.WARN if warn else rr.TextLogLevel.INFO))


def _place(T_parent_child: Array) -> Transform3D:
    import rerun as rr

    q = rr.Quaternion(xyzw=quaternion_xyzw(T_parent_child[:3, :3]))
    return rr.Transform3D(translation=T_parent_child[:3, 3], quaternion=q)
