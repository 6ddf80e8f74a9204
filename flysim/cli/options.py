"""Options that several commands have, and the numbers they may be: what is beyond is a typing error, told at once."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypeVar, get_type_hints

import typer

from flysim.errors import FlysimError

MAX_SEED = 2**63 - 1
MAX_EPISODES = 100_000
MAX_PROCESSES = 256
MAX_REPEATS = 10_000

Number = TypeVar("Number", int, float)


def within(name: str, low: Number, high: Number) -> Callable[[Number | None], Number | None]:
    """A callback that refuses, in one line, what is not from `low` to `high`; an option left out passes."""

    def check(value: Number | None) -> Number | None:
        if value is None or low <= value <= high:
            return value
        most = "2^63 - 1" if high == MAX_SEED else f"{high:,}" if isinstance(high, int) else f"{high:g}"
        raise FlysimError(f"{name} must be from {low} to {most}, got {value}.")

    return check


def minutes_of(value: float | None) -> float | None:
    """A callback for minutes: more than none, and finite."""
    if value is None or (math.isfinite(value) and 0.0 < value <= 1e6):
        return value
    raise FlysimError(f"--minutes must be > 0 and at most 1,000,000, got {value}.")


def parse_seeds(text: str | None) -> range | None:
    """Seeds of `A:B`, or of one number.

    Raises:
        FlysimError: it is neither, there are too many, or one is no seed.
    """
    if text is None:
        return None
    first, colon, end = text.partition(":")
    try:
        start = int(first)
        seeds = range(start, int(end) if colon else start + 1)
    except ValueError:
        raise FlysimError(f"--seeds {text}: write A:B for the seeds A to B - 1, as in --seeds 0:20.") from None
    if seeds.start < 0 or seeds.stop > MAX_SEED + 1:
        raise FlysimError(f"--seeds {text}: seeds are from 0 to 2^63 - 1.")
    if seeds.stop - seeds.start > MAX_EPISODES:
        raise FlysimError(f"--seeds {text}: {seeds.stop - seeds.start:,} seeds, at most {MAX_EPISODES:,} at a time.")
    return seeds


def _finishes(incomplete: str) -> list[str]:
    from flysim.worlds.surface.finish import FINISHES

    return [name for name in FINISHES if name.startswith(incomplete)]


OwnSeed = Annotated[
    int | None,
    typer.Option(help="Seed of all randomness. [the scenario's, or 0]", callback=within("--seed", 0, MAX_SEED)),
]
Processes = Annotated[
    int | None,
    typer.Option(help="Processes that share the work. [one a core]", callback=within("--processes", 1, MAX_PROCESSES)),
]
OnRay = Annotated[
    str | None,
    typer.Option("--ray", help="Address of a Ray cluster to work on, or local. Needs flysim-testbed[cluster]. [none]"),
]
Repeats = Annotated[
    int,
    typer.Option(help="Rounds that count, after one that does not.", callback=within("--repeats", 1, MAX_REPEATS)),
]
Renderer = Annotated[str, typer.Option(help="auto, gl or tiny.")]
ScenarioKeys = Annotated[
    list[str] | None, typer.Option("--set", help="KEY=VALUE for a scenario's key; may be repeated.")
]
Texture = Annotated[
    str | None, typer.Option(help="speckle: dress what has none; tiles, blinds: on all.", autocompletion=_finishes)
]
Models = Annotated[
    list[str] | None,
    typer.Option(
        "--models",
        help="A folder with models that the world includes; may be repeated. env: those of $GZ_SIM_RESOURCE_PATH "
        "and $GAZEBO_MODEL_PATH.",
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object, nothing else.")]


class Jobs(NamedTuple):
    """The options of every command that shares its work.

    Attributes:
        processes, ray: who does it.
        renderer: who draws.
        as_json: how it is told.
    """

    processes: Processes = None
    ray: OnRay = None
    renderer: Renderer = "auto"
    as_json: AsJson = False


DrivenWheels = Annotated[
    tuple[str, str] | None,
    typer.Option("--wheels", help="Joints of the robot's left and right driven wheel. [as its file says]"),
]
MountedCameras = Annotated[str | None, typer.Option("--cameras", help="stereo: mounts the rover's pair. [its own]")]


class Ride(NamedTuple):
    """The options of commands whose agents drive.

    Attributes:
        robot, wheels, cameras, models, texture: of the environment.
        overrides: `TABLE.KEY=VALUE` each.
    """

    robot: Annotated[str | None, typer.Option(help="Name or path of a robot. [rover; with barn barn_rover]")] = None
    wheels: DrivenWheels = None
    cameras: MountedCameras = None
    models: Models = None
    texture: Annotated[str | None, typer.Option(help="speckle: dress what has no texture. [none; with barn it]")] = None
    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="TABLE.KEY=VALUE of flies, sensors, calibration, light, drive, or an agent's; may be repeated.",
        ),
    ] = None


class Driver(NamedTuple):
    """The options of a command that sends a robot through a world.

    Attributes:
        robot: who drives.
        wheels: its driven joints.
        cameras: what it sees with.
        path: what kind of path is planned.
        models: folders in which models of the world are looked for besides.
    """

    robot: Annotated[str | None, typer.Option(help="With a world: name or path of a robot. [rover]")] = None
    wheels: DrivenWheels = None
    cameras: MountedCameras = None
    path: Annotated[str | None, typer.Option(help="With a world: orbit, sweep or frontal. [orbit]")] = None
    models: Models = None


class FromData(NamedTuple):
    """The options of a run that drives nothing: its frames are there already.

    Attributes:
        data: the data set's folder.
        every: of its frames, one in so many; None: all of them.
        height: of the left camera above the floor [m], where no file tells; None: the floor is found.
    """

    data: Annotated[
        Path | None, typer.Option(help="In place of scenarios: a data set, ours or KITTI's, EuRoC's, TUM's ...")
    ] = None
    every: Annotated[
        int | None,
        typer.Option(help="With --data: of its frames, one in so many. [1]", callback=within("--every", 1, 100_000)),
    ] = None
    height: Annotated[
        float | None,
        typer.Option(
            help="With --data: the left camera's height above the floor [m], where no file tells. [found]",
            callback=within("--height", 0.0, 1e3),
        ),
    ] = None


NO_JOBS, NO_RIDE, NO_DRIVER, NO_DATA = Jobs(), Ride(), Driver(), FromData()


def bundled(command: Callable[..., None]) -> Callable[..., None]:
    """A command whose parameters that are NamedTuples are options each, for typer, which knows no bundles."""
    hints = get_type_hints(command, include_extras=True)
    parameters: list[inspect.Parameter] = []
    bundles = {name: hint for name, hint in hints.items() if hasattr(hint, "_field_defaults")}
    for name, parameter in inspect.signature(command).parameters.items():
        bundle = bundles.get(name)
        fields = {name: hints[name]} if bundle is None else get_type_hints(bundle, include_extras=True)
        for field, hint in fields.items():
            default = parameter.default if bundle is None else bundle._field_defaults[field]
            parameters.append(
                inspect.Parameter(field, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=hint)
            )

    def typed(**given: Any) -> None:
        for name, bundle in bundles.items():
            given[name] = bundle(**{field: given.pop(field) for field in bundle._fields})
        command(**given)

    typed.__name__, typed.__doc__ = command.__name__, command.__doc__
    typed.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    typed.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    return typed
