"""What shapes cover of the floor, by hand arithmetic."""

import math

import numpy as np
import pytest

from flysim.geometry.frames import pose6
from flysim.paths.footprint import Disc, Points, Polygon, footprint, heights
from flysim.worlds.shapes import Box, Cylinder, Mesh, Sphere

LOW, HIGH = 0.02, 0.5


def covers(one, x, y):
    return bool(one.covers(np.array([x]), np.array([y]), 0.0)[0])


def cut(shape, pose, low=LOW, high=HIGH):
    return footprint(shape, pose6(*pose), low, high, 0.01, solid=False)


def test_a_sphere_is_the_widest_circle_between_the_heights():
    assert cut(Sphere(0.3), (1, 2, 0.3, 0, 0, 0)) == Disc(1.0, 2.0, 0.3)
    above = cut(Sphere(0.3), (0, 0, 0.6, 0, 0, 0))  # its middle is 0.1 m over the robot
    assert above.radius == pytest.approx(math.sqrt(0.3**2 - 0.1**2))
    assert cut(Sphere(0.3), (0, 0, 0.8, 0, 0, 0)) is None


def test_a_turned_box_is_its_rectangle():
    one = cut(Box((2.0, 1.0, 0.4)), (0, 0, 0.2, 0, 0, math.pi / 2))
    assert isinstance(one, Polygon)
    assert one.bounds() == pytest.approx((-0.5, -1.0, 0.5, 1.0))
    assert covers(one, 0.49, 0.99)
    assert not covers(one, 0.51, 0.0)
    assert not covers(one, 0.0, 1.01)
    assert cut(Box((2.0, 1.0, 0.4)), (0, 0, 0.8, 0, 0, 0)) is None  # hangs over the robot
    assert cut(Box((2.0, 1.0, 0.02)), (0, 0, 0.0, 0, 0, 0)) is None  # the robot drives over it


def test_a_box_that_leans_is_cut_at_the_heights():
    """A ramp up along x at 45 degrees: only what is below 0.5 m is in the way."""
    one = cut(Box((4.0, 1.0, 0.01)), (0, 0, 0, 0, -math.pi / 4, 0))
    x0, _, x1, _ = one.bounds()
    assert x0 == pytest.approx(0.02, abs=0.02)
    assert x1 == pytest.approx(0.5, abs=0.02)


def test_a_mesh_is_its_surface_or_its_hull():
    gate = np.array([[0, -1, 0], [0, -0.8, 0], [0, -0.8, 1], [0, 0.8, 0], [0, 1, 0], [0, 0.8, 1]], float)
    mesh = Mesh(vertices=gate, faces=np.array([[0, 1, 2], [3, 4, 5]]), uv=None, path=None)
    surface = footprint(mesh, np.eye(4), LOW, HIGH, 0.01, solid=False)
    assert isinstance(surface, Points)
    assert (np.abs(surface.xy[:, 1]) >= 0.8 - 1e-9).all()  # open between the posts
    assert covers(footprint(mesh, np.eye(4), LOW, HIGH, 0.01, solid=True), 0.0, 0.0)


@pytest.mark.parametrize("shape", [Box((0.3, 0.2, 0.4)), Cylinder(0.1, 0.4)])
@pytest.mark.parametrize("roll", [0.0, 1e-2, math.pi / 2])
def test_heights_are_those_of_the_outline(shape, roll):
    T = pose6(1, 2, 0.5, roll, 0, 0.3)
    z = (shape.outline() @ T[:3, :3].T + T[:3, 3])[:, 2]
    assert heights(shape, T) == pytest.approx((z.min(), z.max()))
