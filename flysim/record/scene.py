"""What a view of a run needs beside the data: where to look from, plain colours, and a robot to draw."""

from __future__ import annotations

import functools

import numpy as np

from flysim.errors import WorldError
from flysim.foreign.image import read_texture
from flysim.geometry.frames import Array, pose6
from flysim.products.findings import Findings
from flysim.record import colours
from flysim.truth.truth import Truth
from flysim.worlds.model import Material, Part
from flysim.worlds.shapes import Box, Cylinder


def extent(findings: Findings, truth: Truth | None) -> tuple[Array, float]:
    """Where to look, and from how far [m]: path and obstacles fill the view."""
    if truth is None:
        spots = [frame.T_world_base[None, :3, 3] * (1.0, 1.0, 0.0) for frame in findings.sequence.frames]
        spots += [obstacle.center[None] for obstacle in findings.obstacles]
    else:
        spots = [np.array([[stop.true.x, stop.true.y, 0.0] for stop in truth.stops]).reshape(-1, 3)]
        links = zip(truth.world.links, truth.motion.last, strict=True)
        spots += [T[None, :3, 3] for link, T in links if not link.structure]
    points = np.concatenate([np.zeros((0, 3)), *spots])
    if not len(points):
        return np.zeros(3), 3.0
    low, high = points.min(axis=0), points.max(axis=0)
    return np.append((low + high)[:2] / 2.0, 0.2), float(np.linalg.norm(high - low)) + 1.0


@functools.lru_cache(maxsize=256)
def plain_colour(material: Material) -> colours.RGB:
    """The material's colour, or its texture's mean."""
    if material.texture is not None:
        try:
            r, g, b = np.round(read_texture(material.texture).mean(axis=(0, 1))).astype(int).tolist()
            return r, g, b
        except WorldError:  # gone since the world was read: the plain colour does
            pass
    r, g, b = (round(255 * min(max(channel, 0.0), 1.0)) for channel in material.diffuse)
    return r, g, b


def plain_rover(findings: Findings) -> tuple[Part, ...]:
    """A chassis on two wheels, and a mast that bears the cameras."""
    r, g, b = (channel / 255.0 for channel in colours.ROBOT)
    shapes: dict[str, tuple[Box | Cylinder, Array]] = {
        "chassis": (Box((0.28, 0.22, 0.08)), pose6(0.0, 0.0, 0.09, 0.0, 0.0, 0.0)),
        "left wheel": (Cylinder(0.05, 0.024), pose6(0.0, 0.13, 0.05, np.pi / 2.0, 0.0, 0.0)),
        "right wheel": (Cylinder(0.05, 0.024), pose6(0.0, -0.13, 0.05, np.pi / 2.0, 0.0, 0.0)),
    }
    if findings.seen:
        x, _, z = findings.seen[0].frame.T_base_left[:3, 3]
        if z > 0.15:
            shapes["mast"] = (Cylinder(0.01, z - 0.13), pose6(x, 0.0, (z + 0.13) / 2.0, 0.0, 0.0, 0.0))
    return tuple(
        Part(name=name, shape=shape, T_link_part=T, material=Material(diffuse=(r, g, b)))
        for name, (shape, T) in shapes.items()
    )
