"""What a wrong calibration does to an obstacle is told without asking an engine, and taken from its errors."""

import numpy as np
import pytest

from flysim.evaluate.evaluator import evaluate
from flysim.evaluate.explained import explained
from flysim.runs.run import run, travel
from flysim.runs.scenario import read_scenario


@pytest.fixture(scope="module")
def driven():
    """What becomes of `paper_a`'s first stops under one wrong belief."""
    made = {}

    def of(override):
        if override not in made:
            made[override] = travel(read_scenario("paper_a", [override]), seed=5, renderer="tiny")
        return made[override]

    return of


def alone(findings, truth):
    (true,) = [one for one in truth.obstacles if one.visible]
    return true, explained(true, truth.sights, findings.seen[0].frame.pair.rig, true.yaw)


def test_a_baseline_that_is_believed_longer_makes_all_larger_and_farther_away(driven):
    findings, truth = driven("calibration.baseline_error=0.02")
    true, found = alone(findings, truth)
    mean = np.mean([view.T_world_optical[:2, 3] for view in (stop.views[0] for stop in truth.stops)], axis=0)
    away = (true.visible_extent()[0][:2] - mean) / np.linalg.norm(true.visible_extent()[0][:2] - mean)
    assert found.center @ away == pytest.approx(0.02 * 1.1, abs=0.012)  # it is passed by at about a metre
    report = evaluate(findings, truth)
    assert report.explained["center_share"] > 0.5
    assert report.center_visible_error.max == pytest.approx(report.explained["obstacles"][0]["center_m"], rel=0.35)
    assert report.to_json()["explained"]["center_share"] > 0.5
    assert "calibration explains" in str(report)


def test_a_belief_that_is_right_explains_nothing_and_nothing_is_said(driven):
    findings, truth = driven("calibration.right_roll_deg=0.4")  # which is not the believed rig's to explain
    _, found = alone(findings, truth)
    assert np.linalg.norm(found.center) < 5e-4 and np.abs(found.size).max() < 1e-3
    assert evaluate(findings, truth).explained["center_share"] < 0.5


def test_a_perfect_rig_has_no_such_key(short):
    report = run(str(short), renderer="tiny")
    assert report.explained == {} and "explained" not in report.to_json() and "explains" not in str(report)


def test_an_obstacle_that_was_not_seen_is_not_explained(driven):
    findings, truth = driven("calibration.baseline_error=0.02")
    (true,) = [one for one in truth.obstacles if one.visible]
    assert explained(true, (), findings.seen[0].frame.pair.rig, true.yaw) is None
