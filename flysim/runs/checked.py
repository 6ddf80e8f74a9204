"""What flysim makes of a file: what was read, what was left out and why, and whether a robot can drive there."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from flysim.common import catalogue
from flysim.errors import FlysimError, did_you_mean
from flysim.foreign.files import opened

if TYPE_CHECKING:
    from flysim.robots.robot import Mount, Robot
    from flysim.truth.obstacles import TrueObstacle
    from flysim.worlds.model import Link, World

Kind = Literal["world", "robot", "scenario"]
KINDS: tuple[Kind, ...] = get_args(Kind)
HEAD = 65_536  # bytes of a file that say what it is
HEAD_LIMIT = 2**30  # bytes of a file that is looked into


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckUp:
    """What was found.

    Attributes:
        kind: of the file.
        data: what it holds, as JSON has it.
        left_out: what was not read, one sentence each.
        problems: why nothing can drive with it, one sentence each; empty where something can.
    """

    kind: Kind
    data: dict[str, Any]
    left_out: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """All of it."""
        return {"kind": self.kind, **self.data, "left_out": [*self.left_out], "problems": [*self.problems]}


def kind_of(target: str) -> Kind:
    """Whether a name or a path is that of a world, a robot or a scenario; a name of several is that of a world.

    Raises:
        FlysimError: it is none of them.
    """
    worlds, robots, scenarios = catalogue.world_names(), catalogue.names("robots"), catalogue.names("runs")
    if target in worlds:
        return "world"
    if target in robots:
        return "robot"
    if target in scenarios:
        return "scenario"
    path = Path(target)
    if path.suffix.lower() in (".toml", ".json"):
        return "scenario"
    if path.suffix.lower() in (".urdf", ".xacro"):
        return "robot"
    if not path.exists():
        every = {*worlds, *robots, *scenarios}
        raise FlysimError(f"no file and no name '{target}'. {did_you_mean(target, every)}")
    with opened(path, "file", HEAD_LIMIT) as stream:
        head = stream.read(HEAD)
    return "robot" if b"<robot" in head and b"<sdf" not in head else "world"


def checked(
    target: str,
    kind: Kind,
    *,
    models: Sequence[str] = (),
    robot: str = "rover",
    wheels: tuple[str, str] | None = None,
    cameras: str | None = None,
) -> CheckUp:
    """What flysim makes of a world, a robot or a scenario.

    Args:
        target: name or path.
        kind: of it.
        models: folders with models, as of `read_world`.
        robot: who is to drive in a world.
        wheels: of a robot: names of the driven joints, left and right.
        cameras: of a robot: "stereo" mounts a pair.

    Raises:
        FlysimError: it cannot be read.
    """
    from flysim.robots.robot import mount, read_robot

    if kind == "scenario":
        return _scenario(target)
    mounted = mount(cameras)
    if kind == "robot":
        return _robot(catalogue.find_robot(target), wheels, mounted)
    driver = read_robot(catalogue.find_robot(robot), wheels, mounted)
    return _world(catalogue.find_world(target).resolve(), models, driver)


def _world(path: Path, models: Iterable[str], robot: Robot) -> CheckUp:
    from flysim.sim.rest import at_rest
    from flysim.truth.motion import Motion
    from flysim.truth.obstacles import true_obstacles
    from flysim.worlds.ground import floor_level, grounded
    from flysim.worlds.sdf.reader import read_world

    read = read_world(path, models)
    level, problems = floor_level(read.links), []
    world = grounded(read)
    try:
        world = at_rest(world)
    except FlysimError as error:
        problems.append(str(error))
    room, why = _room(world, robot)
    problems += [why] if why else []
    floor, walls = (
        [*dict.fromkeys(link.model for link in world.links if link.structure and _rises(link) == rises)]
        for rises in (False, True)
    )
    data = {
        "name": read.name,
        "path": str(read.path),
        "gravity_m_s2": read.gravity,
        "bodies": len(read.links),
        "moving": sum(not link.static for link in read.links),
        "floor": None if level is None else {"z_m": round(level, 4), "models": floor},
        "walls": walls,
        "obstacles": [_obstacle(one, world) for one in true_obstacles(world, (), Motion.of(world, ()))],
        "room": room,
    }
    return CheckUp(kind="world", data=data, left_out=world.warnings, problems=tuple(problems))


def _rises(link: Link) -> bool:
    """Whether structure rises over the floor: a wall, not the floor."""
    from flysim.paths.footprint import heights
    from flysim.worlds.ground import STEP
    from flysim.worlds.shapes import Plane

    tops = [
        heights(part.shape, link.T_world_link @ part.T_link_part)[1]
        for part in link.visuals or link.collisions
        if not isinstance(part.shape, Plane)
    ]
    return max(tops, default=0.0) > STEP


def _obstacle(one: TrueObstacle, world: World) -> dict[str, Any]:
    links = [world.links[i] for i in one.links]
    visuals = [part for link in links for part in link.visuals]
    return {
        "name": one.name,
        "shape": one.shape,
        "size_m": np.round(one.size, 4).tolist(),
        "center_m": np.round(one.center, 4).tolist(),
        "yaw_deg": round(math.degrees(one.yaw), 2),
        "moves": any(not link.static for link in links),
        "seen": bool(visuals),
        "hit": any(link.collisions for link in links),
        "texture": any(part.material.texture is not None for part in visuals),
    }


def _room(world: World, robot: Robot) -> tuple[dict[str, Any] | None, str]:
    """Where a robot may stand, or why it can nowhere."""
    from flysim.paths.grid import survey
    from flysim.paths.plan import MARGIN, start_node
    from flysim.paths.route import Ways

    grid = survey(world, robot.height)
    ways = Ways(grid, robot.radius + MARGIN)
    try:
        start = start_node(ways, world)
    except FlysimError as error:
        return None, str(error)
    mine = ways.nodes[ways.region == ways.region[start]]
    area = float((grid.clearance >= ways.room).sum()) * grid.cell**2
    room = {
        "robot": robot.name,
        "start_m": np.round(ways.nodes[start], 3).tolist(),
        "low_m": np.round(mine.min(axis=0), 2).tolist(),
        "high_m": np.round(mine.max(axis=0), 2).tolist(),
        "free_m2": round(area, 1),
        "reached_m2": round(area * len(mine) / len(ways.nodes), 1),
    }
    return room, ""


def _robot(path: Path, wheels: tuple[str, str] | None, cameras: Mount | None) -> CheckUp:
    from flysim.robots.told import told

    data = told(path, wheels, cameras)
    return CheckUp(kind="robot", data=data, left_out=tuple(data.pop("warnings")))


def _scenario(target: str) -> CheckUp:
    from flysim.runs.robot_of import robot_of
    from flysim.runs.run import check
    from flysim.runs.scenario import read_scenario

    plan = read_scenario(target)
    world = _world(plan.world_path, plan.model_folders, robot_of(plan))
    body = _robot(plan.robot_path, plan.wheels, plan.cameras)
    problems = [*world.problems]
    try:
        check(plan)
    except FlysimError as error:
        problems += [str(error)] if str(error) not in problems else []
    data = {
        "name": plan.name,
        "stops": len(plan.stops),
        "engine": plan.engine,
        "world": world.to_json(),
        "robot": body.to_json(),
    }
    left_out = (*world.left_out, *body.left_out)
    return CheckUp(kind="scenario", data=data, left_out=left_out, problems=tuple(problems))
