"""`flysim calibrate`: cameras by images of a board, or a simulated robot's own, beside the truth."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flysim.cli.options import MAX_SEED, AsJson, Renderer, within
from flysim.cli.study import renderer_named, reserved_folder
from flysim.cli.terminal import Bar, say, say_json, show
from flysim.errors import FlysimError

if TYPE_CHECKING:
    from flysim.calibration.board import Board
    from flysim.calibration.result import BoardCalibration
    from flysim.common.progress import Progress
    from flysim.robots.robot import Robot
    from flysim.sensors.parameters import SensorParams
    from flysim.studies.calibration.beside import Beside

IMAGES = 15  # of a board that is shown to a simulated robot
REAL_BOARD, SHOWN_BOARD = ("9x6", 0.025), ("11x8", 0.05)
# What a lens and a chip do to the simulated images, unless --set says otherwise.
FLAWS = {"k1": -0.18, "k2": 0.04, "p1": 0.001, "p2": -0.0008, "noise": 1.0}
Count = Annotated[
    int | None,
    typer.Option(help="With --simulate: pairs of images to take. [15]", callback=within("--count", 1, 200)),
]
Seed = Annotated[
    int | None, typer.Option(help="With --simulate: of all randomness. [0]", callback=within("--seed", 0, MAX_SEED))
]


def _robots(incomplete: str) -> list[str]:
    from flysim.common import catalogue

    return [name for name in catalogue.names("robots") if name.startswith(incomplete)]


def calibrate(
    images: Annotated[
        list[str] | None,
        typer.Argument(help="Images of a board: files, folders, patterns. Names with left and right make a pair."),
    ] = None,
    right: Annotated[
        list[str] | None, typer.Option(help="Images of the right eye, where names do not say so; may be repeated.")
    ] = None,
    board: Annotated[
        str | None, typer.Option(help="Inner corners of the board, COLUMNSxROWS. [9x6; with --simulate 11x8]")
    ] = None,
    square: Annotated[float | None, typer.Option(help="Side of a square [m]. [0.025; with --simulate 0.05]")] = None,
    charuco: Annotated[
        bool, typer.Option("--charuco", help="A ChArUco board: marks of 4x4 cells, 3/4 of a square.")
    ] = False,
    simulate: Annotated[
        str | None, typer.Option(help="A robot whose cameras are shown a board.", autocompletion=_robots)
    ] = None,
    count: Count = None,
    overrides: Annotated[
        list[str] | None, typer.Option("--set", help="With --simulate: sensors.KEY=VALUE; may be repeated.")
    ] = None,
    seed: Seed = None,
    renderer: Renderer = "auto",
    out: Annotated[Path | None, typer.Option(help="Folder to write. [runs/out/calibration-...]")] = None,
    as_json: AsJson = False,
) -> None:
    """Find a camera's figures, or a pair's, by images of a board; write what ROS tools and a scenario read.

    A run takes them by --set calibration=FOLDER, in place of what its robot's file says.
    """
    if bool(images) == (simulate is not None):
        raise FlysimError("give images of a board, or --simulate ROBOT in their place: one of the two.")
    if images and (overrides or seed is not None or count is not None):
        raise FlysimError("--set, --seed and --count go with --simulate.")
    if simulate is not None and right:
        raise FlysimError("--right goes with images; --simulate takes its own.")
    usual = REAL_BOARD if simulate is None else SHOWN_BOARD
    shape = _board(usual[0] if board is None else board, usual[1] if square is None else square, charuco)
    drawn_by = renderer_named(renderer)
    with reserved_folder(out, "calibration", seed) as place, place.writing() as room:
        if simulate is None:
            with Bar("calibrate", quiet=as_json) as bar:
                found, apart = _by_images(images or [], right or [], shape, bar), None
        else:
            robot, sensors = _robot(simulate), _sensors(overrides or [])
            with Bar(f"calibrate {robot.name}", quiet=as_json) as bar:
                found, apart = _by_simulation(
                    robot, shape, sensors, room, images=count or IMAGES, seed=seed or 0, renderer=drawn_by, progress=bar
                )
        from flysim.studies.calibration.folder import write_calibration

        more = {} if apart is None else {"beside_the_truth": apart.to_json()}
        write_calibration(room, found, more)
    if as_json:
        say_json({**found.to_json(), **more, "folder": str(place.out)})
        return
    show([*found.sheets(), *([] if apart is None else [apart.sheet()])])
    files = "; ".join([*(f"{name}.yaml" for name in found.infos), "calibration.json", "residuals.png"])
    say(f"folder: {place.out}   ({files})")


def _by_images(images: list[str], right: list[str], board: Board, progress: Progress) -> BoardCalibration:
    from flysim.calibration.images import image_sets, look_at
    from flysim.calibration.result import calibrated

    return calibrated(board, look_at(image_sets(images, right), board, progress))


def _by_simulation(
    robot: Robot, board: Board, sensors: SensorParams, room: Path, **how: Any
) -> tuple[BoardCalibration, Beside]:
    from flysim.runs.calibrated import simulated, true_infos
    from flysim.studies.calibration.beside import beside
    from flysim.studies.calibration.folder import write_infos

    found, true = simulated(robot, board, sensors, **how), true_infos(robot.rig, sensors)
    (room / "truth").mkdir()
    write_infos(room / "truth", dict(zip(("left", "right"), true, strict=True)))
    return found, beside(list(found.infos.values()), true)


def _board(text: str, square: float, charuco: bool) -> Board:
    from flysim.calibration.board import parse_board

    try:
        return parse_board(text, square, charuco=charuco)
    except ValueError as error:
        raise FlysimError(f"{error}.") from error


def _robot(name: str) -> Robot:
    from flysim.common.catalogue import find_robot
    from flysim.robots.robot import read_robot

    return read_robot(find_robot(name))


def _sensors(overrides: list[str]) -> SensorParams:
    from flysim.common.overrides import override
    from flysim.runs.scenario import make_scenario

    data: dict[str, Any] = {"sensors": dict(FLAWS)}
    for one in overrides:
        override(data, one)
    if set(data) != {"sensors"}:
        raise FlysimError(f"--set {min(set(data) - {'sensors'})}: a board is shown with sensors.KEY=VALUE alone.")
    return make_scenario({**data, "world": "paper", "stops": [{"x": 0.0, "y": 0.0}]}, "--set").sensors
