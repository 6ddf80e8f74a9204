"""A scenario for anybody's world: the path is planned from the world's file."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flysim.common.catalogue import find_robot, find_world
from flysim.common.overrides import override
from flysim.errors import FlysimError, ScenarioError, did_you_mean
from flysim.plain import shown
from flysim.runs.scenario import Scenario, make_scenario, read_scenario

if TYPE_CHECKING:
    from flysim.paths.plan import Plan
    from flysim.robots.robot import Robot
    from flysim.worlds.model import World


def asked(
    names: Sequence[str],
    world: str | None,
    robot: str | None,
    path: str | None,
    texture: str | None,
    overrides: Sequence[str],
    wheels: tuple[str, str] | None = None,
    cameras: str | None = None,
    models: Sequence[str] = (),
) -> list[Scenario]:
    """The scenarios that a command line asks for: those of `names`, or the planned one of `world`.

    Raises:
        ScenarioError: both or neither, or a robot or a path without a world.
    """
    if bool(names) == (world is not None):
        raise ScenarioError("name scenarios (flysim list), or give --world FILE in their place: one of the two.")
    if world is not None:
        named = robot or "rover"
        return [
            world_scenario(
                world, named, path or "orbit", texture, overrides, wheels=wheels, cameras=cameras, models=models
            )
        ]
    if (robot, path, wheels, cameras) != (None,) * 4 or models:
        raise ScenarioError(
            "--robot, --path, --wheels, --cameras and --models go with --world; a scenario has its own robot and stops."
        )
    keys = [*overrides, *([f"texture={texture}"] if texture is not None else [])]
    return [read_scenario(name, keys) for name in names]


def world_scenario(
    world: str | Path,
    robot: str = "rover",
    path: str = "orbit",
    texture: str | None = None,
    overrides: Iterable[str] = (),
    *,
    wheels: tuple[str, str] | None = None,
    cameras: str | None = None,
    models: Iterable[str] = (),
) -> Scenario:
    """The scenario of a planned path through any world.

    Args:
        world: name of a world, or the path of an SDF or `.world` file, gzipped or not.
        robot: name of a robot, or the path of a URDF.
        path: "orbit", "sweep" or "frontal".
        texture: as a scenario's: "speckle" dresses what has no texture; None leaves it bare.
        overrides: `KEY=VALUE` as for `read_scenario`.
        wheels: as a scenario's: names of the driven joints, left and right.
        cameras: as a scenario's: "stereo" mounts a pair.
        models: folders in which its models are looked for besides; "env": those of Gazebo's variables.

    Raises:
        FlysimError: no such path kind; a world or a robot that cannot be read; no place to stand.
    """
    from flysim.paths.plan import KINDS
    from flysim.robots.robot import CAMERAS
    from flysim.runs.robot_of import robot_of
    from flysim.sim.rest import at_rest
    from flysim.worlds.ground import grounded
    from flysim.worlds.sdf.folder import FROM_ENVIRONMENT
    from flysim.worlds.sdf.reader import read_world

    kind = next((kind for kind in KINDS if kind == path), None)
    if kind is None:
        raise ScenarioError(f"no path '{path}'. {did_you_mean(path, KINDS)}")
    if cameras is not None and cameras not in CAMERAS:
        raise ScenarioError(f"no cameras {shown(cameras)}. {did_you_mean(cameras, CAMERAS)}")
    world_path, robot_path = find_world(str(world)).resolve(), find_robot(robot).resolve()
    data: dict[str, Any] = {}
    if texture is not None:
        data["texture"] = texture
    data |= {key: value for key, value in (("wheels", wheels), ("cameras", cameras)) if value is not None}
    for one in overrides:
        override(data, one)
    fixed = {"world", "robot", "stops", "name", "folder", "notes"} & data.keys()
    if fixed:
        raise ScenarioError(f"--set {min(fixed)}: the path is planned for a world and a robot; use --world, --robot.")
    name = path_name(world_path)
    data |= {"name": f"{name}-{kind}", "description": f"World {name}, path {kind}.", "robot": str(robot_path)}
    data |= {"world": str(world_path), "stops": [{"x": 0.0, "y": 0.0}]}
    if models := tuple(models):
        data["models"] = [one if one == FROM_ENVIRONMENT else str(Path(one).resolve()) for one in models]
    draft = make_scenario(data, "scenario")  # every mistake before the planning
    began = time.perf_counter()
    read = read_world(world_path, draft.model_folders)
    with noted(read):
        plan = planned(at_rest(grounded(read)), robot_of(draft), kind, draft)
    stops = [
        {"x": round(s.x, 4), "y": round(s.y, 4), "yaw_deg": round(math.degrees(s.yaw), 3), "via": s.via}
        for s in plan.stops
    ]
    took = {"planning_s": time.perf_counter() - began}
    return make_scenario({**data, "stops": stops, "notes": plan.warnings, **took}, "scenario")


@contextmanager
def noted(world: World) -> Iterator[None]:
    """Puts a world's warnings into the notes of an error, so that they are told with it: they may be its cause."""
    try:
        yield
    except FlysimError as error:
        for warning in world.warnings:
            error.add_note(warning)
        raise


def planned(world: World, robot: Robot, kind: Any, plan: Scenario) -> Plan:
    """The stops for a robot in a world."""
    from flysim.paths.outlook import RobotGeometry
    from flysim.paths.plan import plan_stops

    geometry = RobotGeometry(
        radius=robot.radius,
        height=robot.height,
        rig=robot.rig,
        T_base_left=robot.T_base_left,
        max_range=plan.flies.max_depth,
    )
    return plan_stops(world, geometry, kind, merge_gap=plan.truth.merge_gap)


def path_name(path: Path) -> str:
    """What a world's file is called: its folder for a world.sdf, else its name without endings."""
    return path.parent.name if path.name == "world.sdf" else path.name.split(".")[0]
