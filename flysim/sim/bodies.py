"""World links to pybullet bodies: exact collision shapes and, for TinyRenderer, textured meshes.

Two shapes collide otherwise than they look, as they do in Gazebo: a plane has no end, whatever its size, and a mesh on
a body that moves is its convex hull.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from flysim.errors import WorldError
from flysim.foreign.image import read_texture
from flysim.geometry.frames import Array, quaternion_xyzw
from flysim.sim.bullet import pybullet as p
from flysim.sim.soften import softened
from flysim.worlds.model import Link, Part
from flysim.worlds.shapes import Box, Cylinder, Mesh, Plane, Sphere
from flysim.worlds.surface.mesh import surface_mesh, write_obj

MAX_COMPOUND = 16  # shapes that pybullet takes for one body
INVISIBLE = (1.0, 1.0, 1.0, 0.0)


def build_link(link: Link, client: int, meshes: Iterator[Path], *, textured: bool) -> list[int]:
    """Creates a link's bodies and returns their ids: one a part if it is static, one in all if it moves.

    Args:
        link: the link.
        client: pybullet's physics client.
        meshes: paths for generated OBJ files, in a folder that must outlive the client. Their names are flysim's own:
            no name out of a world file reaches pybullet.
        textured: also build the visual shapes, which only TinyRenderer needs.
    """
    if not link.static and any(isinstance(part.shape, Plane) for part in link.collisions):
        raise WorldError(f"model '{link.model}', link '{link.name}': a plane cannot move. Make it static, or a box.")
    collisions = [_collision(part, meshes) for part in link.collisions]
    visuals = [_visual(part, meshes) for part in link.visuals if textured]
    if not link.static:
        return [_dynamic(link, collisions, visuals, client, textured=textured)]
    bodies = []
    for part, shape in zip(link.collisions, collisions, strict=True):
        index = p.createCollisionShape(**shape, physicsClientId=client)
        bodies.append(_body(link, index, -1, link.T_world_link @ part.T_link_part, client))
        if textured:
            hide(bodies[-1], -1, client)
    for part, shape in zip(link.visuals, visuals, strict=False):
        index = p.createVisualShape(**shape, physicsClientId=client)
        bodies.append(_body(link, -1, index, link.T_world_link @ part.T_link_part, client))
    return bodies


def _body(link: Link, collision: int, visual: int, T_world_part: Array, client: int) -> int:
    if collision < 0 and visual < 0:
        raise WorldError(f"model '{link.model}', link '{link.name}': pybullet refuses its shape.")
    return p.createMultiBody(
        0.0,
        collision,
        visual,
        basePosition=T_world_part[:3, 3].tolist(),
        baseOrientation=quaternion_xyzw(T_world_part[:3, :3]).tolist(),
        physicsClientId=client,
    )


def hide(body: int, link: int, client: int) -> None:
    """Keeps TinyRenderer from drawing a link's collision shapes, which it does where there is nothing else."""
    p.changeVisualShape(body, link, rgbaColor=INVISIBLE, physicsClientId=client)


def _dynamic(
    link: Link, collisions: list[dict[str, Any]], visuals: list[dict[str, Any]], client: int, *, textured: bool
) -> int:
    for kind, shapes in (("collisions", collisions), ("visuals", visuals)):
        if len(shapes) > MAX_COMPOUND:
            raise WorldError(
                f"model '{link.model}', link '{link.name}': {len(shapes)} {kind} on a body that moves; "
                f"at most {MAX_COMPOUND} are simulated. Make it static or split it."
            )
    collision = visual = -1
    if collisions:
        collision = p.createCollisionShapeArray(
            **_columns(collisions), **_frames(link.collisions, "collision"), physicsClientId=client
        )
    if visuals:
        visual = p.createVisualShapeArray(
            **_columns(visuals), **_frames(link.visuals, "visual"), physicsClientId=client
        )
    body = p.createMultiBody(
        link.mass,
        collision,
        visual,
        basePosition=link.T_world_link[:3, 3].tolist(),
        baseOrientation=quaternion_xyzw(link.T_world_link[:3, :3]).tolist(),
        physicsClientId=client,
    )
    if link.inertia is not None:
        p.changeDynamics(body, -1, localInertiaDiagonal=list(link.inertia), physicsClientId=client)
    if textured and not visuals:
        hide(body, -1, client)
    return body


def _frames(parts: tuple[Part, ...], kind: str) -> dict[str, list[list[float]]]:
    return {
        f"{kind}FramePositions": [part.T_link_part[:3, 3].tolist() for part in parts],
        f"{kind}FrameOrientations": [quaternion_xyzw(part.T_link_part[:3, :3]).tolist() for part in parts],
    }


# What the array calls of pybullet name each argument, and what they take where a shape has none.
_PLURAL: dict[str, tuple[str, Any]] = {
    "shapeType": ("shapeTypes", p.GEOM_BOX),
    "halfExtents": ("halfExtents", [0.0, 0.0, 0.0]),
    "radius": ("radii", 0.0),
    "height": ("lengths", 0.0),
    "fileName": ("fileNames", ""),
}


def _columns(shapes: list[dict[str, Any]]) -> dict[str, list[Any]]:
    """One dict of lists from a list of dicts, as pybullet's array calls want it."""
    used = [name for name in _PLURAL if any(name in shape for shape in shapes)]
    return {_PLURAL[name][0]: [shape.get(name, _PLURAL[name][1]) for shape in shapes] for name in used}


def _collision(part: Part, meshes: Iterator[Path]) -> dict[str, Any]:
    match part.shape:
        case Box(size):
            return {"shapeType": p.GEOM_BOX, "halfExtents": [s / 2.0 for s in size]}
        case Cylinder(radius, length):
            return {"shapeType": p.GEOM_CYLINDER, "radius": radius, "height": length}
        case Sphere(radius):
            return {"shapeType": p.GEOM_SPHERE, "radius": radius}
        case Plane():
            return {"shapeType": p.GEOM_PLANE, "planeNormal": [0.0, 0.0, 1.0]}
        case Mesh():
            path = write_obj(surface_mesh(part.shape), None, part.material.diffuse, next(meshes))
            return {"shapeType": p.GEOM_MESH, "fileName": str(path), "flags": p.GEOM_FORCE_CONCAVE_TRIMESH}


def _visual(part: Part, meshes: Iterator[Path]) -> dict[str, Any]:
    mesh, texture = surface_mesh(part.shape), part.material.texture
    pixels = None if texture is None else softened(read_texture(texture), mesh)
    return {"shapeType": p.GEOM_MESH, "fileName": str(write_obj(mesh, pixels, part.material.diffuse, next(meshes)))}
