"""Round bodies and the choice among bodies, figure by figure."""

import math

import numpy as np
import pytest

from flysim.obstacles.parameters import ObstacleParams
from flysim.obstacles.round import _arc, fit_circle, fit_sphere
from flysim.obstacles.shape import FittedShape, _mean, _sphere, distance_to, fit_solid


def arc(degrees, n=200, radius=0.3, lean=0.0, z=0.2):
    """(points, normals, spread) of flies on a part of an upright cylinder whose normals point up by `lean`."""
    turn = np.radians(np.linspace(2.0, degrees, n))
    out = np.stack([np.cos(turn), np.sin(turn), np.zeros(n)], axis=1)
    normals = out * math.sqrt(1.0 - lean**2) + (0.0, 0.0, lean)
    return radius * out + (1.0, 2.0, z), normals, np.full((n, 3), 0.001)


@pytest.mark.parametrize(("n", "fits"), [(12, True), (11, False)])
def test_twelve_flies_make_a_circle_and_a_sphere(n, fits):
    points, normals, spread = arc(340.0, n)
    assert (fit_circle(points, normals, spread) is not None) == fits
    rise, turn = np.linspace(-1.0, 1.0, n), 2.4 * np.arange(n)
    ball = np.stack([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)], axis=1)
    assert (fit_sphere(0.2 * ball, spread) is not None) == fits


@pytest.mark.parametrize(("degrees", "fits"), [(95.0, True), (88.0, False)])  # ten steps of ten degrees, and nine
def test_a_circle_of_which_less_than_a_hundred_degrees_are_seen_is_none(degrees, fits):
    assert (fit_circle(*arc(degrees)) is not None) == fits


def test_an_arc_is_counted_in_steps_of_ten_degrees():
    assert _arc(np.array([[1.0, 0.0]])) == 10.0
    for degrees in (100.0, 180.0, 350.0):
        turn = np.radians(np.arange(5.0, degrees, 2.0))
        assert _arc(np.stack([np.cos(turn), np.sin(turn)], axis=1)) == pytest.approx(degrees)
    turn = np.radians([-5.0, -1.0, 1.0, 5.0])
    assert _arc(np.stack([np.cos(turn), np.sin(turn)], axis=1)) == 20.0


@pytest.mark.parametrize(("lean", "side"), [(0.48, True), (0.52, False)])
def test_flies_that_lean_less_than_thirty_degrees_lie_on_a_side(lean, side):
    for sign in (-1.0, 1.0):
        assert (fit_circle(*arc(300.0, lean=sign * lean)) is not None) == side


@pytest.mark.parametrize(("radius", "fits"), [(0.014, False), (0.0155, True), (1.45, True), (1.55, False)])
def test_radii_are_from_a_centimetre_and_a_half_to_a_metre_and_a_half(radius, fits):
    found = fit_circle(*arc(300.0, radius=radius))
    assert (found is not None) == fits
    if found is not None:
        assert found.radius == pytest.approx(radius, rel=1e-3)
        np.testing.assert_allclose(found.center, (1.0, 2.0), atol=1e-3 * radius)


def test_the_pole_of_a_ball_is_no_part_of_its_arc():
    # Seen from above: all round near the pole, where a longitude is nothing, but only 90 degrees of the ball.
    turn = np.radians(np.linspace(0.0, 350.0, 100))
    for share, fits in ((0.25, False), (0.4, True)):
        cap = np.stack([share * np.cos(turn), share * np.sin(turn), np.full(100, math.sqrt(1 - share**2))], axis=1)
        side = np.radians(np.linspace(0.0, 80.0, 100))
        belt = np.stack([np.cos(side), np.sin(side), np.zeros(100)], axis=1)
        assert (fit_sphere(0.3 * np.concatenate([cap, belt]), np.full((200, 3), 0.001)) is not None) == fits


def test_a_few_flies_far_off_do_not_move_a_circle():
    points, normals, spread = arc(300.0)
    points[::20] *= 1.3
    found = fit_circle(points, normals, spread)
    assert found.radius == pytest.approx(0.3, abs=0.001)
    # Unsure ones count for less: a fly of 5 mm for half.
    points, normals, spread = arc(300.0)
    points[::2, :2] += 0.004 * (points[::2, :2] - (1.0, 2.0)) / 0.3
    sure = fit_circle(points, normals, spread).radius
    spread[::2] = 0.05
    assert fit_circle(points, normals, spread).radius < sure - 0.001


def test_five_millimetres_is_what_counts_for_less():
    # By soft L1, s = 5 mm: nine tenths at 0.3 m pull by e, a tenth 20 mm out by (20 - e) / sqrt(1 + ((20 - e) / s)^2).
    points, normals, spread = arc(359.0, 400)
    points[::10, :2] = (1.0, 2.0) + 0.32 / 0.3 * (points[::10, :2] - (1.0, 2.0))
    radius = fit_circle(points, normals, 0.0 * spread).radius
    assert 1000.0 * (radius - 0.3) == pytest.approx(0.54, abs=0.02)
    # A fly whose place is unsure by 5 mm weighs half as much, a quarter in the sum of squares.
    points, normals, spread = arc(359.0, 400)
    points[::2, :2] = (1.0, 2.0) + 0.301 / 0.3 * (points[::2, :2] - (1.0, 2.0))
    spread[:], spread[::2, 0] = 0.0, 0.005
    assert fit_circle(points, normals, spread).radius == pytest.approx(0.3002, abs=5e-6)


def test_of_many_flies_some_are_asked():
    for n in (500, 501, 1400):  # every one, every second, every third
        points, normals, spread = arc(300.0, n)
        points[1::2, :2] = (1.0, 2.0) + 1.1 * (points[1::2, :2] - (1.0, 2.0))
        radius = fit_circle(points, normals, spread).radius
        assert (radius == pytest.approx(0.3, abs=1e-4)) == (n == 501)


BOX = FittedShape("box", np.array([1.0, 2.0, 0.2]), np.array([0.6, 0.4, 0.4]), math.pi / 2.0)
POST = FittedShape("cylinder", np.array([1.0, 2.0, 0.2]), np.array([0.4, 0.4, 0.4]), 0.0)
BALL = FittedShape("sphere", np.array([1.0, 2.0, 0.2]), np.array([0.4, 0.4, 0.4]), 0.0)
SUNK = FittedShape("sphere", np.array([1.0, 2.0, 0.15]), np.array([0.4, 0.4, 0.3]), 0.0)  # its middle is 10 cm high


@pytest.mark.parametrize(
    ("body", "offset", "distance"),
    [
        (BOX, (0.2, 0.0, 0.0), 0.0), (BOX, (0.0, 0.3, 0.1), 0.0), (BOX, (0.0, 0.0, 0.2), 0.0),
        (BOX, (0.21, 0.0, 0.0), 0.01), (BOX, (0.19, 0.0, 0.0), 0.01), (BOX, (0.206, 0.308, 0.0), 0.01),
        (BOX, (0.0, 0.0, 0.0), 0.03), (BOX, (9.0, 0.0, 0.0), 0.03), (BOX, (0.0, 0.29, -0.18), 0.01),
        (POST, (0.2, 0.0, 0.0), 0.0), (POST, (0.0, 0.21, 0.0), 0.01), (POST, (0.0, -0.19, 0.0), 0.01),
        (POST, (0.0, 0.0, 0.21), 0.01), (POST, (0.206, 0.0, 0.208), 0.01), (POST, (0.1, 0.0, -0.185), 0.015),
        (BALL, (0.0, 0.2, 0.0), 0.0), (BALL, (0.12, 0.0, 0.16), 0.0), (BALL, (0.0, 0.0, 0.22), 0.02),
        (BALL, (0.0, 0.0, -0.185), 0.015), (SUNK, (0.2, 0.0, -0.05), 0.0), (SUNK, (0.0, 0.0, 0.15), 0.0),
        (SUNK, (0.0, 0.0, 0.16), 0.01),
    ],
)  # fmt: skip
def test_distances_to_a_body_by_hand_and_none_over_three_centimetres(body, offset, distance):
    assert _mean(distance_to(body.center + np.array([offset]), body), np.zeros(1)) == pytest.approx(distance, abs=1e-12)


def test_a_sphere_stands_on_the_floor_or_is_sunk_in_it():
    rise = np.linspace(-1.2, 1.2, 200)
    ball = np.stack([np.cos(rise) * np.cos(9 * rise), np.cos(rise) * np.sin(9 * rise), np.sin(rise)], axis=1)
    found = _sphere(0.2 * ball + (1.0, 2.0, 0.1), np.full((200, 3), 1e-4))
    np.testing.assert_allclose(found.size, (0.4, 0.4, 0.3), atol=1e-6)
    np.testing.assert_allclose(found.center, (1.0, 2.0, 0.15), atol=1e-6)
    assert _sphere(0.2 * ball - (0.0, 0.0, 0.21), np.full((200, 3), 1e-4)) is None  # under the floor


def fitted(flies, points, normals, **given):
    n = len(points)
    arms = np.repeat(points[:, None], 4, axis=1)
    parts = [(points, normals, np.full((n, 3), 1e-4), arms, 0 * arms, np.zeros((n, 4), bool))]
    return fit_solid(flies.cloud_of(parts), np.arange(n), ObstacleParams(**given))


@pytest.mark.parametrize(("off", "shape"), [(0.0114, "box"), (0.0126, "other")])
def test_flies_that_lie_more_than_twelve_millimetres_off_in_the_mean_lie_on_no_body(flies, off, shape):
    """Flies on the faces of a box, and as many twice that far inside: none of them is on any body."""
    rng = np.random.default_rng(0)
    parts, normals = [], []
    for axis in (0, 1):
        for sign in (-1.0, 1.0):
            for depth in (0.0, 2.0 * off):
                place = rng.uniform(-0.25, 0.25, (400, 3))
                place[:, axis] = sign * (0.3 - depth)
                place[:, 2] += 0.3
                parts.append(place)
                normals.append(np.tile(sign * np.eye(3)[axis] if depth == 0.0 else [0.0, 0.0, 1.0], (400, 1)))
    points, normals = np.concatenate(parts), np.concatenate(normals)
    normals[points[:, 2] > 0.5, 2] += 1e-9
    found = fitted(flies, points, normals)
    np.testing.assert_allclose(found.size[:2], 0.6, atol=0.003)
    mean = _mean(distance_to(points, found._replace(shape="box")), np.full(len(points), 1e-4))
    assert found.shape == ("box" if mean <= 0.012 else "other")
    assert (mean <= 0.012) == (shape == "box") and abs(mean - 0.012) < 0.0012


def test_a_round_body_is_preferred_unless_the_box_fits_by_a_twentieth_better(flies):
    """Between a cylinder and its box: the flies lie a share `flat` of the way out from the one to the other."""
    turn = np.linspace(-math.pi, math.pi, 721)[:-1]
    out = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    square = out / np.abs(out).max(axis=1, keepdims=True)
    normals = np.tile(np.column_stack([out, np.zeros(720)]), (3, 1))
    just = {"box": 0, "cylinder": 0}
    for flat in np.arange(0.3, 0.5, 0.02):
        plan = 0.2 * ((1.0 - flat) * out + flat * square)
        points = np.concatenate([np.column_stack([plan, np.full(720, z)]) for z in (0.1, 0.2, 0.3)])
        found, box = fitted(flies, points, normals), fitted(flies, points, normals, round=False)
        circle, height = fit_circle(points, normals, np.full_like(points, 1e-4)), found.size[2]
        size = np.array([2 * circle.radius, 2 * circle.radius, height])
        post = FittedShape("cylinder", np.array([*circle.center, height / 2]), size, 0.0)
        alike = np.full(len(points), 1e-4)
        ratio = _mean(distance_to(points, post), alike) / _mean(distance_to(points, box), alike)
        assert (found.shape == "cylinder") == (ratio < 1.05)
        just["cylinder" if found.shape == "cylinder" else "box"] += 0.95 < ratio < 1.15
    assert just["box"] and just["cylinder"]
