"""Where the bodies of a world come to rest before a robot is there: what is put above the floor falls on it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from flysim.common.scratch import Scratch
from flysim.geometry.frames import Array, se3
from flysim.sim.bodies import build_link
from flysim.sim.bullet import pybullet as p
from flysim.worlds.ground import refuse_weightless
from flysim.worlds.model import World

STEP_S = 1.0 / 240.0
CHUNK = 24  # physics steps between two looks at what still moves
MOST_S = 10.0  # simulated seconds
STILL = 0.01  # [m/s, rad/s] what moves no faster than this, over two looks, rests
MOVED = 0.01  # [m, rad] a body that comes to rest nearer to where its file has it is left there
FALLING = 0.05  # [m/s] a body that moves faster than this is on its way
LOST = -5.0  # [m] what falls below this falls for ever


def at_rest(world: World) -> World:
    """The world with its bodies where they come to rest; itself where nothing can move, or nothing does.

    Raises:
        WorldError: the world has no gravity, or pybullet refuses it.
    """
    refuse_weightless(world)
    moving = [i for i, link in enumerate(world.links) if not link.static]
    if not moving:
        return world
    poses = _settled(world, moving)
    links = list(world.links)
    for i, T in poses.items():
        if np.abs(T - links[i].T_world_link).max() > MOVED:
            links[i] = replace(links[i], T_world_link=T)
    return replace(world, links=tuple(links))


def _settled(world: World, moving: list[int]) -> dict[int, Array]:
    scratch = Scratch()
    client = p.connect(p.DIRECT)
    try:
        p.setGravity(0, 0, world.gravity, physicsClientId=client)
        p.setPhysicsEngineParameter(deterministicOverlappingPairs=1, enableFileCaching=0, physicsClientId=client)
        meshes = (Path(scratch.name) / f"mesh_{i}.obj" for i in itertools.count())
        bodies = [build_link(link, client, meshes, textured=False) for link in world.links]
        own = {i: bodies[i][0] for i in moving}
        calm = 0
        for _ in range(round(MOST_S / STEP_S / CHUNK)):
            for _ in range(CHUNK):
                p.stepSimulation(physicsClientId=client)
            calm = calm + 1 if all(_rests(body, client) for body in own.values()) else 0
            if calm == 2:
                break
        return {i: _pose_of(body, client) for i, body in own.items()}
    finally:
        p.disconnect(physicsClientId=client)
        scratch.cleanup()


def falling(bodies: Sequence[int], client: int) -> bool:
    """Whether one of these bodies is still on its way to where it will lie."""
    return any(
        math.dist(p.getBaseVelocity(body, physicsClientId=client)[0], (0.0, 0.0, 0.0)) > FALLING
        and p.getBasePositionAndOrientation(body, physicsClientId=client)[0][2] > LOST
        for body in bodies
    )


def _rests(body: int, client: int) -> bool:
    linear, angular = p.getBaseVelocity(body, physicsClientId=client)
    if p.getBasePositionAndOrientation(body, physicsClientId=client)[0][2] < LOST:
        return True
    return float(np.abs([linear, angular]).max()) < STILL


def _pose_of(body: int, client: int) -> Array:
    position, q = p.getBasePositionAndOrientation(body, physicsClientId=client)
    return se3(np.reshape(p.getMatrixFromQuaternion(q), (3, 3)), position)
