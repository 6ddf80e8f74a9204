import math
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flysim.geometry.frames import inverse, pose6, transform
from flysim.truth.gap import closer_than, solids, touching_groups
from flysim.worlds.shapes import Box, Cylinder, Mesh, Plane, Sphere

EYE = np.eye(4)


def distance(a, b):
    """The distance that `closer_than` decides about, by bisection."""
    (one,), (two,) = solids(*a), solids(*b)
    low, high = 0.0, 20.0
    while high - low > 1e-6:
        middle = (low + high) / 2
        low, high = (low, middle) if closer_than(middle, one, two) else (middle, high)
    return high


def at(x=0.0, y=0.0, z=0.0, roll=0.0, pitch=0.0, yaw=0.0):
    return pose6(x, y, z, roll, pitch, yaw)


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [
        ((Box((1, 1, 1)), EYE), (Box((1, 1, 1)), at(x=1.3)), 0.3),
        ((Box((1, 1, 1)), EYE), (Box((1, 1, 1)), at(1.3, 1.4)), 0.5),  # edge to edge: 3-4-5
        ((Box((1, 1, 1)), EYE), (Box((1, 1, 1)), at(x=0.5)), 0.0),  # overlap
        ((Box((1, 1, 1)), EYE), (Box((1, 1, 1)), EYE), 0.0),  # the same box
        ((Sphere(0.2), EYE), (Sphere(0.3), at(0.3, 0.4, 1.2)), 0.8),  # centres 1.3 apart
        ((Cylinder(0.1, 1.0), EYE), (Cylinder(0.2, 1.0), at(0.3, 0.4)), 0.2),
        ((Cylinder(0.1, 1.0), EYE), (Sphere(0.1), at(z=0.9)), 0.3),
        (
            (Cylinder(0.1, 2.0), EYE),
            (Box((0.2, 0.2, 0.2)), at(x=0.3, yaw=math.pi / 4)),
            0.2 - math.sqrt(0.02),
        ),
        ((Plane((1, 1)), EYE), (Box((0.2, 0.2, 0.2)), at(z=0.4)), 0.3),
        # Long and thin, crossing like an X one above the other: only their middles are close.
        ((Box((4, 0.1, 0.1)), EYE), (Box((4, 0.1, 0.1)), at(z=0.14, yaw=math.pi / 2)), 0.04),
        # Long and thin side by side, far from each other's corners and centres.
        ((Box((4, 0.1, 0.1)), EYE), (Box((0.1, 0.1, 0.1)), at(x=0.7, y=0.13)), 0.03),
    ],
)
def test_distances_by_hand(a, b, expected):
    assert distance(a, b) == pytest.approx(expected, abs=1e-5)
    assert distance(b, a) == pytest.approx(expected, abs=1e-5)


shapes = st.one_of(
    st.tuples(*[st.floats(0.05, 1.5)] * 3).map(Box),
    st.builds(Cylinder, st.floats(0.05, 0.5), st.floats(0.05, 2.0)),
    st.builds(Sphere, st.floats(0.05, 0.5)),
)
poses = st.tuples(*[st.floats(-1.5, 1.5)] * 6).map(lambda p: pose6(*p))


def nearest_in(shape, T, point):
    """The point of a shape nearest to `point`, by clamping: the other way to the same truth."""
    p = transform(inverse(T), point[None])[0]
    if isinstance(shape, Box):
        p = np.clip(p, -np.array(shape.size) / 2, np.array(shape.size) / 2)
    elif isinstance(shape, Sphere):
        p = p * min(1.0, shape.radius / max(np.linalg.norm(p), 1e-12))
    else:
        p[:2] *= min(1.0, shape.radius / max(math.hypot(p[0], p[1]), 1e-12))
        p[2] = np.clip(p[2], -shape.length / 2, shape.length / 2)
    return transform(T, p[None])[0]


@settings(max_examples=40, deadline=None)
@given(shapes, poses, shapes, poses)
def test_the_decision_agrees_with_alternating_projections(a, T_a, b, T_b):
    p = T_a[:3, 3]
    for _ in range(60):  # Cheney and Goldstein, 1959: converges to a nearest pair; every pair is an upper bound
        q = nearest_in(b, T_b, p)
        p = nearest_in(a, T_a, q)
    above = float(np.linalg.norm(q - p))
    (one,), (two,) = solids(a, T_a), solids(b, T_b)
    assert closer_than(above + 1e-6, one, two)
    if above > 1e-3:  # a plane across the pair parts the outlines by at most the distance
        across = (q - p) / above
        below = (transform(T_b, b.outline()) @ across).min() - (transform(T_a, a.outline()) @ across).max()
        assert below <= 0.01 or not closer_than(below - 0.01, one, two)  # outlines are 5 degrees coarse


def test_groups_hang_together_over_others_and_keep_the_order():
    def cube(x):
        return [(Box((0.2, 0.2, 0.2)), at(x=x))]

    bodies = [cube(0.0), cube(2.0), cube(0.48), cube(0.24), cube(2.26)]
    assert touching_groups(bodies, 0.05) == [[0, 2, 3], [1], [4]]  # gaps of 4 cm, and of 6 cm
    assert touching_groups(bodies, 0.061) == [[0, 2, 3], [1, 4]]
    assert touching_groups([], 0.05) == []


def test_a_mesh_is_as_close_as_its_triangles_are():
    # An arch: two legs; a ball between them is inside its convex hull but touches nothing.
    legs = np.array([[0, 0, 0], [0, 0.1, 0], [0, 0, 1], [1, 0, 0], [1, 0.1, 0], [1, 0, 1]], dtype=float)
    arch = Mesh(legs, np.array([[0, 1, 2], [3, 4, 5]]), None, Path("arch.obj"))
    assert touching_groups([[(arch, EYE)], [(Sphere(0.1), at(0.5, 0.0, 0.5))]], 0.05) == [[0], [1]]
    assert touching_groups([[(arch, EYE)], [(Sphere(0.1), at(0.86, 0.0, 0.5))]], 0.05) == [[0, 1]]


def test_three_hundred_cylinders_take_less_than_a_second():
    lattice = [(0.15 * i, 0.15 * j) for i in range(20) for j in range(15)]
    bodies = [[(Cylinder(0.075, 1.0), at(x, y))] for x, y in lattice]
    began = time.process_time()
    assert touching_groups(bodies, 0.05) == [list(range(300))]
    assert time.process_time() - began < 1.0
