"""Long structures count by the length that was found."""

import numpy as np
import pytest

from flysim.evaluate.evaluator import evaluate
from flysim.evaluate.lengths import whole
from flysim.geometry.frames import Pose2
from flysim.worlds.shapes import Plane

LENGTH, HEIGHT = 3.0, 0.4


def side(x0, x1, y=-0.05, step=0.02):
    """Flies on the side of a fence at y = 0.05 m that the robot looks at, every 2 cm."""
    x, z = np.meshgrid(np.arange(x0, x1 + 1e-9, step), np.arange(0.02, HEIGHT, step))
    return np.column_stack([x.ravel(), np.full(x.size, y), z.ravel()])


@pytest.fixture
def fenced(by_hand):
    """The report of estimates, as boxes (x0, x1), in a world with a fence from x = -1.5 to 1.5 m and nothing else."""
    floor = by_hand.body("floor", Plane((20.0, 20.0)), structure=True)

    def run(*spans, y=-0.05, length=LENGTH):
        world = by_hand.world(floor, by_hand.box("fence", (length, 0.1, HEIGHT), 0.0, 0.0))
        stop = by_hand.stop(world, 0.0, -2.5, np.pi / 2.0)
        points = [side(*span, y=y) for span in spans]
        ends = np.cumsum([0, *map(len, points)])
        estimates = [
            by_hand.estimate((a + b) / 2.0, y + 0.05, (b - a, 0.1, HEIGHT), flies=range(ends[k], ends[k + 1]))
            for k, (a, b) in enumerate(spans)
        ]
        cloud = by_hand.cloud(np.concatenate(points) if points else np.empty((0, 3)))
        return evaluate(by_hand.findings([stop], estimates, cloud), by_hand.truth(world, [stop]))

    return run


def test_a_fence_found_in_pieces_is_found_and_has_no_phantoms(fenced):
    report = fenced((-1.5, -0.5), (-0.45, 0.4), (0.45, 1.5))
    (fence,) = report.obstacles
    assert (fence.pieces, fence.share, report.false_obstacles) == (3, 1.0, 0)
    assert (report.recall, report.precision, report.f1) == (1.0, 1.0, 1.0)
    assert fence.size_estimated == pytest.approx((LENGTH, 0.1, HEIGHT), abs=1e-6)


def test_half_a_fence_is_half_found(fenced):
    report = fenced((-1.5, -0.8), (-0.7, 0.0))
    (fence,) = report.obstacles
    assert fence.share == pytest.approx(0.5, abs=0.06)  # up to 9 cm beyond the last fly, and a step of 5 cm
    assert report.recall == fence.share and report.precision == 1.0
    assert not fence.found_well


def test_what_stands_beside_a_fence_is_no_piece_of_it(fenced):
    report = fenced((-1.5, 1.5), (-0.5, 0.5), y=-0.2)
    assert (report.obstacles[0].share, report.obstacles[0].pieces) == (1.0, 1)
    assert report.false_obstacles == 1


def test_what_is_short_is_one_thing_however_it_was_found(fenced):
    report = fenced((-0.4, -0.1), (0.1, 0.4), length=0.9)
    assert report.obstacles[0].pieces == 1 and report.false_obstacles == 1


def test_pieces_together_are_the_box_round_all_of_them_along_the_true_heading(by_hand):
    world = by_hand.world(by_hand.box("fence", (3.0, 0.1, 0.4), 1.0, 2.0, 0.5))
    (true,) = by_hand.truth(world, []).obstacles
    pose = Pose2(1.0, 2.0, 0.5)
    ways = [np.array([along * np.cos(pose.yaw), along * np.sin(pose.yaw)]) for along in (-1.0, 1.0)]
    parts = [by_hand.estimate(pose.x + w[0], pose.y + w[1], (1.0, 0.1, 0.4), pose.yaw) for w in ways]
    both = whole(true, parts)
    assert both.center == pytest.approx([1.0, 2.0, 0.2]) and both.size == pytest.approx([3.0, 0.1, 0.4])
