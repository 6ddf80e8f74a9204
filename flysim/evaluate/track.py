"""The way that was driven: by odometry, in truth where that is known, and as flies tell it where they were asked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flysim.geometry.frames import Array, yaw_of
from flysim.products.findings import Findings
from flysim.truth.truth import Truth


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Track:
    """Poses of base_link on the floor, in the order of time, which increases strictly.

    Attributes:
        times: `[n]` [s] since the start, simulated where a robot was simulated.
        believed: `[n, 3]` x, y [m], yaw [rad], world frame, as odometry or the frames tell.
        true: the same as it was; None where nobody knows.
        located: the same as `Findings.located` has it; None where nobody asked.
    """

    times: Array
    believed: Array
    true: Array | None
    located: Array | None = None


def whole_track(findings: Findings, truth: Truth | None) -> Track:
    """The way of a whole drive, with a pose every tenth of a second and one a stop; without truth, one a frame."""
    if truth is None:
        frames = findings.sequence.frames
        poses = [[*frame.T_world_base[:2, 3], yaw_of(frame.T_world_base)] for frame in frames]
        rows = np.column_stack([[frame.time for frame in frames], np.reshape(poses, (-1, 3))]).reshape(-1, 4)
        rows = _in_time(rows)
        return _whole(findings, rows[:, 0], rows[:, 1:], None)
    samples, stops = [np.zeros((0, 7))], [np.zeros((0, 7))]
    for stop in truth.stops:
        o, t = stop.odometry, stop.true
        samples.append(np.reshape(np.asarray(stop.track, dtype=np.float64), (-1, 7)))
        stops.append(np.array([[stop.sim_time, o.x, o.y, o.yaw, t.x, t.y, t.yaw]]))
    rows = _in_time(np.concatenate([*samples, *stops]))
    return _whole(findings, rows[:, 0], rows[:, 1:4], rows[:, 4:7])


def _whole(findings: Findings, times: Array, believed: Array, true: Array | None) -> Track:
    bent = None if findings.located is None else findings.located.way(times, believed)
    return Track(times=times, believed=believed, true=true, located=bent)


def _in_time(rows: Array) -> Array:
    """Rows with the time first, sorted by it; of two at one time, as a sample and a stop, the later row stays."""
    rows = rows[np.isfinite(rows).all(axis=1)]
    rows[:, 0] = np.round(rows[:, 0], 6)
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    return rows[np.diff(rows[:, 0], append=np.inf) > 0.0]
