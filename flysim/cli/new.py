"""`flysim new`: a commented starting point that runs, of each thing that can be one's own."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from flysim.cli.terminal import say
from flysim.common import catalogue
from flysim.errors import FlysimError
from flysim.foreign.files import read_text
from flysim.plain import shown

TEMPLATES = Path(__file__).parent / "templates"
FINE, COARSE = 0.003, 0.008  # [m] a texel of an obstacle, and of what is structure
MOST = 1 << 20  # [bytes]
_TEXTURE = re.compile(r"<pbr>.*?</pbr>")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")

new = typer.Typer(help="Write a commented starting point that runs.", no_args_is_help=True)
Name = Annotated[str, typer.Argument(help="What it is called: letters, digits, underscores.")]


@new.command("scenario", epilog="Example: flysim new scenario mine")
def new_scenario(name: Name) -> None:
    """Write NAME.toml: a world, a robot, five stops."""
    file = Path(f"{_checked(name)}.toml")
    _write(file, _template("scenario.toml", name))
    say(file, f"run it: flysim run {file}")


@new.command("world", epilog="Example: flysim new world mine")
def new_world(name: Name) -> None:
    """Write NAME/world.sdf and its textures: a floor, a wall, a box, a pillar, a ball."""
    from flysim.common.whole_folder import whole_folder

    folder = _free(Path(_checked(name)))
    text = _template("world.sdf", name)
    with whole_folder(folder) as room:
        (room / "world.sdf").write_text(_TEXTURE.sub("", text), encoding="utf-8")
        _paint(room)
        (room / "world.sdf").write_text(text, encoding="utf-8")
    say(
        folder / "world.sdf",
        f"look at it: flysim preview {folder}/world.sdf",
        f"run it: flysim run --world {folder}/world.sdf --path frontal",
    )


@new.command("robot", epilog="Example: flysim new robot mine")
def new_robot(name: Name) -> None:
    """Write NAME/robot.urdf: the rover, to be changed."""
    from flysim.common.whole_folder import whole_folder

    folder = _free(Path(_checked(name)))
    text = read_text(catalogue.find_robot("rover"), "robot", MOST)
    text = text.replace('<robot name="rover">', f'<robot name="{name}">').replace("<!-- rover:", f"<!-- {name}:", 1)
    with whole_folder(folder) as room:
        (room / "robot.urdf").write_text(text, encoding="utf-8")
    say(folder / "robot.urdf", f"drive it: flysim run --world paper --path frontal --robot {folder}/robot.urdf")


@new.command("engine", epilog="Example: flysim new engine mine")
def new_engine(name: Name) -> None:
    """Write NAME.py: an engine, which sees for the robot."""
    file = Path(f"{_checked(name)}.py")
    _write(file, _template("engine.py.txt", name))
    say(file, f"run it: flysim run paper_a --engine {name}:See")


@new.command("agent", epilog="Example: flysim new agent mine")
def new_agent(name: Name) -> None:
    """Write NAME.py: an agent, which drives to a goal."""
    file = Path(f"{_checked(name)}.py")
    _write(file, _template("agent.py.txt", name))
    say(file, f"run it: flysim nav {name}:Agent")


def _checked(name: str) -> str:
    if not _NAME.fullmatch(name):
        raise FlysimError(f"{shown(name)} is no name for it: use letters, digits and underscores, as in my_robot.")
    return name


def _free(path: Path) -> Path:
    if path.exists():
        raise FlysimError(f"{path} exists already: take another name.")
    return path


def _write(path: Path, text: str) -> None:
    from flysim.common.whole_file import write_whole

    write_whole(_free(path), text)


def _template(file: str, name: str) -> str:
    return read_text(TEMPLATES / file, "template", MOST).format(name=name)


def _paint(room: Path) -> None:
    """Writes a texture for each model of the world in a folder, which names none yet."""
    import numpy as np

    from flysim.worlds.sdf.reader import read_world
    from flysim.worlds.surface.texture import speckle_shape, write_png

    (room / "textures").mkdir()
    for link in read_world(room / "world.sdf").links:
        (part,), large = link.visuals, link.structure
        image = speckle_shape(
            part.shape,
            np.random.default_rng(list(link.model.encode())),
            metres_per_texel=COARSE if large else FINE,
            colour=part.material.diffuse,
            chroma=0.15 if large else 0.5,
            cells=(0.3, 0.13, 0.064) if large else (0.09, 0.04, 0.016),
        )
        write_png(image, room / "textures" / f"{link.model}.png", colours=64, quick=True)
