"""What of a robot's file was read, approximated and left out, as plain data: for whoever checks a file."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from flysim.geometry.camera import Camera
from flysim.robots.account import CONSTRUCTS
from flysim.robots.robot import Mount, Robot, read_with_account


def told(path: Path, wheels: tuple[str, str] | None = None, cameras: Mount | None = None) -> dict[str, Any]:
    """What became of a robot's file, ready for JSON; lengths in m, masses in kg.

    Args:
        path: as `read_robot`.
        wheels: as `read_robot`.
        cameras: as `read_robot`.

    Returns:
        `name`, `body`, `links`, `joints`, `mass`, `radius`, `height`; `shapes`: how many of each kind; `drive`: the
        wheels and where they stand; `eyes`: each with its size, field of view [degrees] and place, `baseline` of a
        pair; `notes`: `{construct, verdict, how, places}` of all that was approximated or left out.

    Raises:
        RobotError: as `read_robot`: what is refused is told by the error.
    """
    robot, account = read_with_account(path, wheels, cameras)
    kinds = Counter(
        f"{type(solid.shape).__name__.lower()} {kind}"
        for link in robot.links
        for kind, solids in (("visual", link.visuals), ("collision", link.collisions))
        for solid in solids
    )
    return {
        "name": robot.name,
        "body": robot.body,
        "links": len(robot.links),
        "joints": dict(Counter(joint.kind for joint in robot.joints)),
        "mass": round(sum(link.inertial.mass for link in robot.links if link.inertial is not None), 6),
        "radius": robot.radius,
        "height": robot.height,
        "shapes": dict(sorted(kinds.items())),
        "drive": {
            "wheels": [
                {"joint": wheel.joint, "side": "left" if wheel.left else "right", "turns": wheel.sense}
                for wheel in robot.wheels
            ],
            "radius": robot.wheel_radius,
            "track": robot.track,
        },
        "eyes": _eyes(robot),
        "baseline": None if robot.pair is None else robot.pair.baseline,
        "notes": [
            {"construct": CONSTRUCTS[key].name, "verdict": verdict, "how": CONSTRUCTS[key].how, "places": list(places)}
            for key, verdict, places in account.rows()
        ],
    }


def _eyes(robot: Robot) -> list[dict[str, Any]]:
    places = [robot.T_base_left]
    if robot.pair is not None:
        places.append(robot.T_base_left @ np.linalg.inv(robot.pair.T_right_left))
    return [
        {
            "size_px": [camera.width, camera.height],
            "fov_deg": _fov_deg(camera),
            "at": np.round(T[:3, 3], 6).tolist(),
            "down_deg": round(math.degrees(math.asin(float(np.clip(-T[2, 2], -1.0, 1.0)))), 3),
        }
        for camera, T in zip(robot.cameras, places, strict=True)
    ]


def _fov_deg(camera: Camera) -> float:
    return round(math.degrees(2.0 * math.atan(camera.width / 2.0 / camera.fx)), 3)
