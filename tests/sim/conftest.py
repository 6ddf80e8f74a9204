"""Small worlds made of records, so that what a test says is all that stands in them."""

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from flysim.assets import find_robot
from flysim.errors import RendererError
from flysim.geometry.frames import Pose2, pose6
from flysim.sim.robot import read_robot
from flysim.sim.simulation import Simulation
from flysim.world.model import Link, Material, Part, World
from flysim.world.shapes import Plane

ROVER = read_robot(find_robot("rover"))


def link(model, shape, pose=(0, 0, 0, 0, 0, 0), *, static=True, structure=False, texture=None, **more):
    """A link of one shape at `pose` (x y z [m], roll pitch yaw [rad])."""
    part = Part(name="part", shape=shape, T_link_part=np.eye(4), material=Material(texture=texture))
    return Link(
        name="body",
        model=model,
        T_world_link=pose6(*pose),
        visuals=(part,),
        collisions=(part,),
        static=static,
        structure=structure,
        **more,
    )


def world(*links, floor=True):
    ground = (link("floor", Plane((8.0, 8.0)), structure=True),) if floor else ()
    return World(name="made-up", path=Path("made-up.sdf"), links=(*ground, *links))


def simulation(*links, start=(0.0, 0.0, 0.0), floor=True, **more):
    """A simulation of the rover among links; `start` is x, y [m], yaw [degrees]."""
    x, y, yaw_deg = start
    return Simulation(world(*links, floor=floor), ROVER, Pose2(x, y, math.radians(yaw_deg)), **more)


@pytest.fixture(scope="session")
def made():
    return SimpleNamespace(rover=ROVER, link=link, world=world, simulation=simulation)


@pytest.fixture(scope="session")
def gl():
    """Skips a test where no OpenGL context opens."""
    from flysim.sim.gl_context import open_context

    try:
        open_context().release()
    except RendererError as error:
        pytest.skip(str(error))


@pytest.fixture(params=["gl", "tiny"])
def renderer(request):
    """The name of each renderer in turn."""
    if request.param == "gl":
        request.getfixturevalue("gl")
    return request.param
