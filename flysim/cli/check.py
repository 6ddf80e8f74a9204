"""`flysim check`: what flysim makes of a world, a robot or a scenario, before anything drives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from flysim.cli.options import AsJson, Models
from flysim.cli.terminal import complain, say, say_json, show, warn
from flysim.common import catalogue
from flysim.errors import FlysimError, did_you_mean

if TYPE_CHECKING:
    from flysim.common.sheet import Sheet
    from flysim.runs.checked import Inspected


def _targets(incomplete: str) -> list[str]:
    known = {*catalogue.world_names(), *catalogue.names("robots"), *catalogue.names("runs")}
    return sorted(name for name in known if name.startswith(incomplete))


def check(
    target: Annotated[
        str,
        typer.Argument(
            metavar="WORLD|ROBOT|SCENARIO",
            help="Name or path; what is both a world's and a scenario's name is the world's.",
            autocompletion=_targets,
        ),
    ],
    kind: Annotated[str | None, typer.Option(help="world, robot or scenario. [what it is]")] = None,
    robot: Annotated[str, typer.Option(help="Who is to drive in a world: name or path.")] = "rover",
    models: Models = None,
    as_json: AsJson = False,
) -> None:
    """Tell what is read of a file, what is left out and why, and whether a robot can drive there.

    A world is told as it stands when what falls has come to rest. Ends with 2 where nothing can drive.
    """
    from flysim.runs.checked import KINDS, checked, kind_of

    known = next((one for one in KINDS if one == kind), None)
    if kind is not None and known is None:
        raise FlysimError(f"no kind '{kind}'. {did_you_mean(kind, KINDS)}")
    found = checked(target, known or kind_of(target), models=models or (), robot=robot)
    if as_json:
        say_json(found.to_json())
    else:
        show(_sheets(found))
        for sentence in found.left_out:
            warn(sentence)
        if not found.left_out:
            say("left out: nothing that makes a difference")
    for problem in found.problems:
        complain(problem)
    if found.problems:
        raise typer.Exit(2)


def _sheets(found: Inspected) -> list[Sheet]:
    data = found.data
    if found.kind == "world":
        return _world(data)
    if found.kind == "robot":
        return [_robot(data)]
    title = f"scenario {data['name']}: {data['stops']} stops, engine {data['engine']}"
    facts = {"world": data["world"]["path"], "robot": data["robot"]["path"]}
    return [_facts(title, facts), *_world(data["world"]), _robot(data["robot"])]


def _facts(title: str, facts: dict[str, str]) -> Sheet:
    from flysim.common.sheet import Sheet

    return Sheet(title=title, columns=("what", ""), rows=tuple(facts.items()), left=(0, 1))


def _world(data: dict[str, Any]) -> list[Sheet]:
    from flysim.common.sheet import Sheet

    floor, room = data["floor"], data["room"]
    facts = {
        "file": data["path"],
        "bodies": f"{data['bodies']}, of which {data['moving']} can move; gravity {data['gravity_m_s2']:g} m/s^2",
        "floor": "none" if floor is None else f"z = {floor['z_m']:.3f} m: {_named(floor['models'])}",
        "walls": _named(data["walls"]),
        "room": "none"
        if room is None
        else f"{room['robot']} can stand on {room['free_m2']:g} m^2 and reach {room['reached_m2']:g} m^2 from "
        f"{_place(room['start_m'])}, within {_place(room['low_m'])} to {_place(room['high_m'])}",
    }
    rows = tuple(
        (
            one["name"],
            one["shape"],
            " x ".join(f"{side:.2f}" for side in one["size_m"]),
            _place(one["center_m"]),
            ", ".join(_marks(one)) or "-",
        )
        for one in data["obstacles"]
    )
    bare = sum(not one["texture"] for one in data["obstacles"])
    obstacles = Sheet(
        title="1 obstacle" if len(rows) == 1 else f"{len(rows)} obstacles",
        columns=("obstacle", "shape", "size [m]", "middle [m]", "but"),
        rows=rows,
        left=(0, 1, 4),
        note=f"{bare} of {len(rows)} bare, without a texture: --texture speckle dresses them." if bare else "",
    )
    return [_facts(f"world {data['name']}", facts), obstacles]


def _marks(one: dict[str, Any]) -> list[str]:
    told = {
        "moves": one["moves"],
        "unseen": not one["seen"],
        "hits nothing": not one["hit"],
        "bare": not one["texture"],
    }
    return [word for word, so in told.items() if so]


def _robot(data: dict[str, Any]) -> Sheet:
    wheels, cameras = data["wheels"], data["cameras"]
    facts = {
        "file": data["path"],
        "size": f"radius {data['radius_m']:g} m, height {data['height_m']:g} m",
        "wheels": f"{', '.join(wheels['joints'])}: radius {wheels['radius_m']:g} m, track {wheels['track_m']:g} m",
        "cameras": f"{cameras['size_px'][0]} x {cameras['size_px'][1]} px, focal length {cameras['focal_px']:g} px, "
        f"{cameras['baseline_m']:g} m apart, the left one at {_place(cameras['at_m'])}",
        "parts": f"{data['links']} links, {data['joints']} joints",
    }
    return _facts(f"robot {data['name']}", facts)


def _named(names: list[str]) -> str:
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "") if names else "none"


def _place(values: list[float]) -> str:
    return f"({', '.join(f'{value:.2f}' for value in values)})"
