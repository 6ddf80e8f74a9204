"""The kinds of obstacles a generated world holds: each drawn in whole millimetres, standing on its model's origin."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from flysim.worlds.random.recipe import Body, Colour, height_of
from flysim.worlds.shapes import Box, Cylinder, Shape, Sphere

Span = tuple[int, int]  # [mm] least and greatest


class Look(NamedTuple):
    """How the bodies of one obstacle look."""

    colour: Colour
    contrast: float


def box(rng: np.random.Generator, look: Look) -> tuple[Body, ...]:
    """A box: 0.2-0.8 m long, as wide or less, 0.16-1 m high."""
    length = _even(rng, (200, 800))
    width, height = _even(rng, (200, length)), _even(rng, (160, 1000))
    return (_on_floor("body", _box(length, width, height), look),)


def cylinder(rng: np.random.Generator, look: Look) -> tuple[Body, ...]:
    """A cylinder: radius 0.08-0.3 m, 0.16-1 m high."""
    return (_on_floor("body", Cylinder(_mm(rng, (80, 300)) / 1000, _even(rng, (160, 1000)) / 1000), look),)


def sphere(rng: np.random.Generator, look: Look) -> tuple[Body, ...]:
    """A sphere on the floor: radius 0.12-0.3 m."""
    return (_on_floor("body", Sphere(_mm(rng, (120, 300)) / 1000), look),)


def post(rng: np.random.Generator, look: Look) -> tuple[Body, ...]:
    """A thin cylinder: radius 0.03-0.06 m, 0.6-1.2 m high."""
    return (_on_floor("body", Cylinder(_mm(rng, (30, 60)) / 1000, _even(rng, (600, 1200)) / 1000), look),)


def kerb(rng: np.random.Generator, look: Look) -> tuple[Body, ...]:
    """A long low box: 0.6-1.2 m long, 0.1-0.2 m wide, 0.08-0.12 m high."""
    size = _even(rng, (600, 1200)), _even(rng, (100, 200)), _even(rng, (80, 120))
    return (_on_floor("body", _box(*size), look),)


def corner(rng: np.random.Generator, look: Look) -> tuple[Body, ...]:
    """An L of two boxes that touch: arms of 0.4-0.8 m, 0.16-0.26 m wide, 0.16-0.9 m high, each for itself."""
    long, short = _even(rng, (400, 800)), _even(rng, (200, 500))
    widths = _even(rng, (160, 260)), _even(rng, (160, 260))
    heights = _even(rng, (160, 900)), _even(rng, (160, 900))
    side = 1 if rng.integers(2) else -1
    # The second arm goes off one end of the first, face on face.
    x, y = long // 2 - widths[1] // 2, side * (widths[0] // 2 + short // 2)
    return (
        _on_floor("arm_1", _box(long, widths[0], heights[0]), look),
        _on_floor("arm_2", _box(widths[1], short, heights[1]), look, x, y),
    )


def overhang(rng: np.random.Generator, look: Look) -> tuple[Body, ...]:
    """A slab on two legs, or on one post in its middle, with 0.25-0.5 m of air below it."""
    length, width, thick = _even(rng, (500, 800)), _even(rng, (240, 400)), _even(rng, (60, 120))
    under = _even(rng, (250, 500))
    slab = _body("slab", _box(length, width, thick), look, 0, 0, under + thick // 2)
    if rng.integers(2):
        leg = _even(rng, (60, 120))
        x = (length - leg) // 2
        legs = [_on_floor(f"leg_{i}", _box(leg, width, under), look, at, 0) for i, at in ((1, -x), (2, x))]
        return (slab, *legs)
    return (slab, _on_floor("post", Cylinder(_mm(rng, (40, 60)) / 1000, under / 1000), look))


KINDS: dict[str, Callable[[np.random.Generator, Look], tuple[Body, ...]]] = {
    "box": box,
    "cylinder": cylinder,
    "sphere": sphere,
    "post": post,
    "kerb": kerb,
    "corner": corner,
    "overhang": overhang,
}


def _mm(rng: np.random.Generator, span: Span) -> int:
    return int(rng.integers(span[0], span[1], endpoint=True))


def _even(rng: np.random.Generator, span: Span) -> int:
    """An even number of millimetres: half of it, where a middle lies, is a whole one."""
    return 2 * _mm(rng, (span[0] // 2, span[1] // 2))


def _box(length: int, width: int, height: int) -> Box:
    return Box((length / 1000, width / 1000, height / 1000))


def _on_floor(name: str, shape: Shape, look: Look, x: int = 0, y: int = 0) -> Body:
    """A body at x, y [mm] of the model."""
    return _body(name, shape, look, x, y, round(height_of(shape) * 500))


def _body(name: str, shape: Shape, look: Look, x: int, y: int, z: int) -> Body:
    return Body(name, shape, (x / 1000, y / 1000, z / 1000, 0.0, 0.0, 0.0), look.colour, look.contrast)
