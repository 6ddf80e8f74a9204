"""Errors of known size, planted in a perfect estimate: each shows in its own figure, in full, in no other."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from flysim.evaluate.evaluator import evaluate
from flysim.worlds.shapes import Plane

BOX_1, BOX_2, POLE = range(3)


@pytest.fixture(scope="module")
def truth(yard):
    return yard.truth


def figures(report):
    return {
        "recall": report.recall,
        "precision": report.precision,
        "false": report.false_obstacles,
        "center": report.center_error.max,
        "size": report.size_error.max,
    }


PERFECT = {"recall": 1.0, "precision": 1.0, "false": 0, "center": 0.0, "size": 0.0}


def approx(**changed):
    return pytest.approx(PERFECT | changed, abs=1e-9)


def test_a_perfect_estimate_has_no_error(yard, truth):
    report = evaluate(yard.findings(), truth)
    assert figures(report) == approx()
    assert report.f1 == 1.0
    assert all(o.detected and o.visible for o in report.obstacles)
    assert [o.yaw_error_deg for o in report.obstacles] == [pytest.approx(0.0, abs=1e-9)] * 2 + [None]


def test_findings_of_another_drive_are_refused(yard, by_hand):
    with pytest.raises(ValueError, match="4 frames and the truth of 2 stops are not of one drive"):
        evaluate(yard.findings(), by_hand.truth(yard.world, yard.stops[:2]))


def test_a_box_moved_by_3_cm_reads_3_cm(yard, truth):
    moved = yard.changed(BOX_1, center=yard.exact[BOX_1].center + np.array([0.018, 0.024, 0.0]))
    report = evaluate(yard.findings(moved), truth)
    assert figures(report) == approx(center=0.03)
    assert report.obstacles[BOX_1].center_error == pytest.approx(0.03)
    assert report.obstacles[BOX_1].center_visible_error == pytest.approx(0.03, abs=0.01)
    assert report.center_error.median == pytest.approx(0.0, abs=1e-9)  # of three


def test_a_size_error_has_its_sign_and_its_axis(yard, truth):
    wrong = yard.changed(BOX_1, size=np.array([0.52, 0.27, 0.41]))
    report = evaluate(yard.findings(wrong), truth)
    assert figures(report) == approx(size=0.03)
    assert report.obstacles[BOX_1].size_error == pytest.approx((0.02, -0.03, 0.01))
    assert report.obstacles[BOX_1].size_visible_error == pytest.approx((0.02, -0.03, 0.01), abs=0.01)
    swapped = yard.changed(BOX_1, size=np.array([0.27, 0.52, 0.41]), yaw=0.5 - math.pi / 2)
    assert evaluate(yard.findings(swapped), truth).obstacles[BOX_1].size_error == pytest.approx((0.02, -0.03, 0.01))


def test_a_turned_box_reads_its_angle(yard, truth):
    turned = yard.changed(BOX_1, yaw=0.5 + math.radians(7.0))
    report = evaluate(yard.findings(turned), truth)
    assert figures(report) == approx()
    assert report.obstacles[BOX_1].yaw_error_deg == pytest.approx(7.0)


def test_a_missed_obstacle_lowers_recall_alone(yard, truth):
    report = evaluate(yard.findings(yard.exact[:2]), truth)
    assert figures(report) == approx(recall=2 / 3)
    pole = report.obstacles[POLE]
    assert not pole.detected
    assert pole.size_visible == pytest.approx((0.12, 0.12, 0.6), abs=0.012)
    assert (pole.center_error, pole.size_estimated, pole.size_error, pole.size_visible_error) == (None,) * 4


def test_a_doubled_obstacle_lowers_precision_alone(yard, truth):
    double = replace(yard.exact[BOX_2], center=yard.exact[BOX_2].center + np.array([0.1, 0.0, 0.0]))
    report = evaluate(yard.findings((double, *yard.exact)), truth)
    assert figures(report) == approx(precision=3 / 4, false=1)


def test_a_phantom_lowers_precision_alone(yard, truth, by_hand):
    report = evaluate(yard.findings((*yard.exact, by_hand.estimate(-1.0, 0.0, (0.3, 0.3, 0.3)))), truth)
    assert figures(report) == approx(precision=3 / 4, false=1)


def test_two_obstacles_merged_into_one_lower_recall_and_show_in_size(by_hand):
    world = by_hand.world(
        by_hand.body("floor", Plane((20.0, 20.0)), structure=True),
        by_hand.box("left", (0.3, 0.3, 0.3), 0.0, 0.2),
        by_hand.box("right", (0.3, 0.3, 0.3), 0.0, -0.2),
    )
    merged = by_hand.estimate(0.0, 0.0, (0.3, 0.7, 0.3))
    stops = by_hand.around(world)
    report = evaluate(by_hand.findings(stops, [merged]), by_hand.truth(world, stops))
    assert figures(report) == approx(recall=0.5, center=0.2, size=0.4)
    assert sum(o.detected for o in report.obstacles) == 1


def test_a_cluster_on_the_wall_changes_nothing_but_is_counted(yard, truth, by_hand):
    points = np.random.default_rng(0).uniform((3.44, -1.0, 0.2), (3.46, -0.6, 0.8), (60, 3))
    on_wall = by_hand.estimate(3.45, -0.8, (0.4, 0.02, 0.6), flies=range(60))
    report = evaluate(yard.findings((*yard.exact, on_wall), by_hand.cloud(points)), truth)
    assert figures(report) == approx()
    assert report.structure_obstacles == 1
    assert report.surface.accuracy_median < 0.01


def test_an_obstacle_nobody_could_see_is_reported_and_not_asked_for(yard, by_hand):
    world = by_hand.world(*yard.world.links, by_hand.box("hidden", (0.4, 0.4, 0.4), 4.5, 0.0))
    stops = by_hand.around(world, 4, 2.2)
    for estimates in (yard.exact, (*yard.exact, by_hand.estimate(4.53, 0.0, (0.4, 0.4, 0.4)))):
        report = evaluate(by_hand.findings(stops, estimates), by_hand.truth(world, stops))
        assert figures(report) == approx()
        hidden = report.obstacles[-1]
        assert (hidden.name, hidden.visible, hidden.size_visible) == ("hidden", False, None)
        assert hidden.detected == (len(estimates) == 4)


def test_times_and_stops_are_taken_over(yard, truth):
    report = evaluate(yard.findings(), truth)
    assert report.time | {"evaluate": 0.0} == {
        "total": 5.0 + 4 * 0.5 + 0.125,
        "drive": 4.0,
        "render": 1.0,
        "evolve": 2.0,
        "obstacles": 0.125,
        "evaluate": 0.0,
    }
    assert [stop.index for stop in report.stops] == [0, 1, 2, 3]
    assert report.stops[0].true == (-2.2, 0.0, 0.0)
    assert report.stops[0].time == {"render": 0.25, "evolve": 0.5, "obstacles": 0.125 / 4}


def test_the_same_findings_give_the_same_bytes(yard, by_hand):
    cloud = by_hand.cloud(np.random.default_rng(0).uniform(-1, 1, (500, 3)))
    written = []
    for _ in range(2):
        report = evaluate(yard.findings(cloud=cloud), yard.truth).to_json()
        del report["time_s"]
        written.append(json.dumps(report))
    assert written[0] == written[1]


def test_an_empty_world_and_a_drive_without_stops(by_hand):
    empty = by_hand.world()
    for stops in ([], [by_hand.stop(empty, 0.0, 0.0, 0.0)]):
        report = evaluate(by_hand.findings(stops), by_hand.truth(empty, stops))
        assert (report.recall, report.precision, report.f1, report.obstacles) == (1.0, 1.0, 1.0, ())
        assert report.center_error.median is None
        json.dumps(report.to_json(), allow_nan=False)
