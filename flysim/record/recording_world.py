"""What stands still in a recording: the world, the boxes, the robot's body and its paths."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from flysim.evaluate.track import whole_track
from flysim.geometry.frames import Array, quaternion_xyzw
from flysim.products.findings import Findings
from flysim.record import colours
from flysim.record.outline import visible_parts
from flysim.record.scene import extent, plain_colour, plain_rover
from flysim.truth.truth import Truth
from flysim.worlds.model import Link, Part
from flysim.worlds.shapes import Box, Cylinder, Plane, Sphere

if TYPE_CHECKING:
    from rerun import RecordingStream, Transform3D

_PATH_STEP = 0.05  # [s] the robot moves in the recording at most so often
_MOST_LABELS = 4  # estimates that show their dimensions; more would hide each other


def log_world(rec: RecordingStream, truth: Truth | None) -> None:
    """What stands there, each body in one colour."""
    import rerun as rr

    rec.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for index, link in enumerate(() if truth is None else truth.world.links):
        if link.static:
            rec.log(link_entity(index, link), placed(link.T_world_link), static=True)
        for part in visible_parts(link):
            _log_part(rec, [*link_entity(index, link), part.name], part)


def link_entity(index: int, link: Link) -> list[object]:
    """Where the recording has a link of the world, which may move."""
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
    rec.log(entity, placed(part.T_link_part), body, static=True)


def log_boxes(rec: RecordingStream, findings: Findings, truth: Truth | None, *, metric: bool) -> None:
    """The true and the estimated boxes, named above them, with their sizes where lengths are `metric`.

    Static: the estimate is fused after the drive.
    """
    import rerun as rr

    true_obstacles = () if truth is None else truth.obstacles
    sizes = (" x ".join(f"{100.0 * side:.1f}" for side in obstacle.size) for obstacle in findings.obstacles)
    names = {
        "true": [o.name for o in true_obstacles],
        "estimated": [f"{i}: {size} cm" if metric else str(i) for i, size in enumerate(sizes)],
    }
    few = len(findings.obstacles) <= _MOST_LABELS
    for entity, colour, boxes, above, shown in (
        ("true", colours.TRUE, true_obstacles, 0.04, True),
        ("estimated", colours.BELIEVED, findings.obstacles, 0.10, few),
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
        tops = centers + box_sizes * (0.0, 0.0, 0.5) + (0.0, 0.0, above * extent(findings, truth)[1])
        words = rr.Points3D(tops, labels=names[entity], radii=thin, colors=paint, show_labels=shown)
        rec.log(["world", entity, "names"], words, static=True)


def log_robot(rec: RecordingStream, findings: Findings, truth: Truth | None, parts: Sequence[Part]) -> None:
    """The robot's body, its way while it drives, and both its paths."""
    import rerun as rr

    for index, part in enumerate(parts or plain_rover(findings)):
        _log_part(rec, ["world", "robot", "body", f"{index}-{part.name}"], part)
    track = whole_track(findings, truth)
    paths = (("true", colours.TRUE, track.true, 3.0), ("odometry", colours.BELIEVED, track.believed, 1.5))
    for name, colour, poses, thick in paths:
        if poses is None:
            continue
        line = np.c_[poses[:, :2], np.full(len(poses), 0.03 / thick)]  # the thinner line on top
        strips = [line] if len(line) > 1 else []
        drawn = rr.LineStrips3D(strips, colors=[colour] * len(strips), radii=rr.Radius.ui_points(thick))
        rec.log(["world", "path", name], drawn, static=True)
    if len(track.times):
        step = np.floor(track.times / _PATH_STEP)
        last = np.append(np.diff(step) > 0, True)
        x, y, yaw = (track.believed if track.true is None else track.true)[last].T
        zero = np.zeros(len(x))
        rec.send_columns(
            "world/robot",
            indexes=[rr.TimeColumn("sim_time", duration=track.times[last])],
            columns=rr.Transform3D.columns(
                translation=np.stack([x, y, zero], axis=1),
                quaternion=np.stack([zero, zero, np.sin(yaw / 2.0), np.cos(yaw / 2.0)], axis=1),
            ),
        )


def placed(T_parent_child: Array) -> Transform3D:
    """A pose as rerun has it."""
    import rerun as rr

    q = rr.Quaternion(xyzw=quaternion_xyzw(T_parent_child[:3, :3]))
    return rr.Transform3D(translation=T_parent_child[:3, 3], quaternion=q)
