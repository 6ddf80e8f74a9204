"""How far belief and truth of the robot's own way are apart, by the field's two figures, as evo has them.

The absolute error (APE) is of each pose in the world, nothing aligned: both begin in one place. The relative one (RPE)
is of each hop from one stop to the next (J. Sturm et al., IROS 2012).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from flysim.evaluate.track import Track, whole_track
from flysim.geometry.frames import Array
from flysim.products.findings import Findings
from flysim.truth.stop import Stop
from flysim.truth.truth import Truth


def whereabouts(findings: Findings, truth: Truth) -> dict[str, Any]:
    """What the report says of the way; empty where wheels were as they should be and nobody else was asked.

    `odometry` and, where somebody was asked, `located` have `ape_m` and `ape_deg` (root mean squares over the whole
    way), `ape_max_m`, `rpe_m` and `rpe_deg` (over the hops). With `located` come `by`, `hops`, `loops`, `glances`,
    `lost` (numbers of stops, from 1), `seconds`, and `stops` with the pose of each and one standard deviation of it.
    """
    located = findings.located
    if located is None and not truth.disturbed.get("odometry"):
        return {}
    track = whole_track(findings, truth)
    stops = _poses(truth.stops)
    told: dict[str, Any] = {"odometry": _errors(track, track.believed, stops[:, 0], stops[:, 1])}
    if located is None or track.located is None:
        return told
    heard_of = [stop for stop in truth.stops if stop.index in located.numbers]
    at_stops = located.poses[list(located.stops)]
    deviations = np.sqrt(np.diagonal(located.covariance[list(located.stops)], axis1=1, axis2=2))
    return {
        **told,
        "located": _errors(track, track.located, at_stops, _poses(heard_of)[:, 1]),
        "by": located.by,
        "hops": located.hops,
        "loops": located.loops,
        "glances": len(located.poses) - len(located.stops),
        "lost": [k + 1 for k in located.lost],
        "seconds": located.seconds,
        "stops": [
            {
                "index": stop.index,
                "pose": [float(v) for v in pose],
                "deviation_m": [float(v) for v in deviation[:2]],
                "deviation_deg": math.degrees(deviation[2]),
            }
            for stop, pose, deviation in zip(heard_of, at_stops, deviations, strict=True)
        ],
    }


def warning(findings: Findings) -> tuple[str, ...]:
    """One sentence about places that were lost, if any were."""
    located = findings.located
    if located is None or not located.lost:
        return ()
    lost = ", ".join(str(k + 1) for k in located.lost[:10])
    more = f" and {len(located.lost) - 10} more" if len(located.lost) > 10 else ""
    return (
        f"localisation: the {located.by} lost the place on the way to stop {lost}{more} of {len(located.stops)}: "
        f"nothing was seen again there, and that way is odometry's; all {located.hops} hops that were found are kept.",
    )


def _poses(stops: Sequence[Stop]) -> Array:
    """`[n, 2, 3]` of stops, as odometry told and as it was."""
    return np.array([[(p.x, p.y, p.yaw) for p in (stop.odometry, stop.true)] for stop in stops]).reshape(-1, 2, 3)


def _errors(track: Track, believed: Array, at_stops: Array, true_at_stops: Array) -> dict[str, float | None]:
    assert track.true is not None  # of a drive
    if not len(track.times):
        return dict.fromkeys(("ape_m", "ape_deg", "ape_max_m", "rpe_m", "rpe_deg"))
    off = np.hypot(*(believed - track.true)[:, :2].T)
    hops = _hops(at_stops), _hops(true_at_stops)
    # What is left of a hop when the true one is undone is as long as their difference: both begin in one pose.
    rpe, turn = np.hypot(*(hops[0] - hops[1])[:, :2].T), _wrapped(hops[0] - hops[1])[:, 2]
    return {
        "ape_m": _rms(off),
        "ape_deg": math.degrees(_rms(_wrapped(believed - track.true)[:, 2])),
        "ape_max_m": float(off.max()),
        "rpe_m": _rms(rpe) if len(rpe) else None,
        "rpe_deg": math.degrees(_rms(turn)) if len(rpe) else None,
    }


def _hops(poses: Array) -> Array:
    """`[n - 1, 3]` each pose as seen from the one before."""
    d, yaw = np.diff(poses, axis=0), poses[:-1, 2]
    c, s = np.cos(yaw), np.sin(yaw)
    return np.column_stack([c * d[:, 0] + s * d[:, 1], c * d[:, 1] - s * d[:, 0], d[:, 2]])


def _wrapped(poses: Array) -> Array:
    return (poses + np.pi) % (2.0 * np.pi) - np.pi


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
