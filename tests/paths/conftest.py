"""Worlds and paths that several tests look at; each is planned once."""

import functools
import gzip
import os
from pathlib import Path
from types import SimpleNamespace

import pytest

from flysim.common.catalogue import find_robot, find_world
from flysim.paths.outlook import RobotGeometry
from flysim.paths.plan import plan_stops
from flysim.robots.robot import read_robot
from flysim.worlds.sdf.reader import read_world

ROOT = Path(__file__).resolve().parents[2]
# Public data is no part of this repository: it is looked for beside it.
DATA = Path(os.environ.get("FLYSIM_DATA", ROOT.parent / "shared/data"))
GROUND = (
    '<model name="ground"><static>1</static><link name="l"><collision name="c"><geometry><plane><normal>0 0 1</normal>'
    "<size>100 100</size></plane></geometry></collision></link></model>"
)


@functools.cache
def rover():
    return read_robot(find_robot("rover"))


def geometry():
    robot = rover()
    return RobotGeometry(
        radius=robot.radius, height=robot.height, rig=robot.rig, T_base_left=robot.T_base_left, max_range=4.0
    )


@functools.cache
def world_named(name):
    return read_world(barn_file(name) if name.startswith("world_") else find_world(name))


@functools.cache
def planned(name, kind):
    return plan_stops(world_named(name), geometry(), kind)


def barn_file(name):
    path = DATA / "barn" / f"{name}.world.gz"
    if not path.is_file():
        pytest.skip(f"no BARN worlds in {DATA}; FLYSIM_DATA names their folder")
    return path


def body(name, shape, pose, static=True):
    """A model of one shape, such as `<sphere><radius>0.2</radius></sphere>`, at x y z roll pitch yaw."""
    geometry = f"<geometry>{shape}</geometry>"
    return (
        f'<model name="{name}"><static>{int(static)}</static><pose>{pose}</pose><link name="l">'
        f'<collision name="c">{geometry}</collision><visual name="v">{geometry}</visual></link></model>'
    )


def box(x, y, z):
    return f"<box><size>{x} {y} {z}</size></box>"


def write(path, *models, ground=True):
    """An SDF world of those models; gzipped where the name ends so."""
    text = f'<sdf version="1.6"><world name="w">{GROUND if ground else ""}{"".join(models)}</world></sdf>'
    path.write_bytes(gzip.compress(text.encode()) if path.suffix == ".gz" else text.encode())
    return path


@pytest.fixture(scope="session")
def made():
    return SimpleNamespace(
        rover=rover, geometry=geometry, world=world_named, planned=planned, body=body, box=box, write=write, data=DATA
    )
