"""Found well: a centre to 3 cm and every dimension to 3 cm or 5 %, of what was visible."""

from dataclasses import replace

import by_hand
import numpy as np
import pytest

from flysim.evaluate.evaluator import evaluate
from flysim.evaluate.well import found_well, well


@pytest.mark.parametrize(
    ("center", "error", "size", "right"),
    [
        (0.029, (0.0, 0.0, 0.0), (0.3, 0.3, 0.3), True),
        (0.031, (0.0, 0.0, 0.0), (0.3, 0.3, 0.3), False),
        (0.0, (0.029, -0.029, 0.029), (0.3, 0.3, 0.3), True),
        (0.0, (0.0, 0.0, -0.031), (0.3, 0.3, 0.3), False),
        (0.0, (0.0, 0.0, -0.049), (0.3, 0.3, 1.0), True),  # 5 % of a metre
        (0.0, (0.0, 0.0, 0.051), (0.3, 0.3, 1.0), False),
        (None, None, None, False),
    ],
)
def test_an_obstacle_is_found_well_to_3_cm_or_5_percent(center, error, size, right):
    assert found_well(center, error, size) == right


def test_what_is_found_but_not_well_is_a_miss_and_a_false_claim(yard):
    truth = yard.truth
    perfect = evaluate(yard.findings(), truth)
    n = sum(o.visible for o in perfect.obstacles)
    assert perfect.well == {"precision": 1.0, "recall": 1.0, "f1": 1.0}
    assert all(o.found_well for o in perfect.obstacles if o.visible)
    first, *others = yard.exact
    moved = replace(first, center=np.asarray(first.center) + np.array([0.04, 0.0, 0.0]))
    report = evaluate(yard.findings((moved, *others)), truth)
    assert report.f1 == 1.0 and not report.obstacles[0].found_well
    assert report.well == pytest.approx({"precision": (n - 1) / n, "recall": (n - 1) / n, "f1": (n - 1) / n})
    phantom = by_hand.estimate(-1.0, 0.0, (0.3, 0.3, 0.3))
    report = evaluate(yard.findings((moved, *others, phantom)), truth)
    assert report.well["precision"] == pytest.approx((n - 1) / (n + 1))
    assert report.to_json()["well"]["f1"] == pytest.approx(2 * (n - 1) / (2 * n + 1), abs=1e-6)
    assert f"{n - 1} of {n} to 3 cm" in str(report)


def test_nothing_to_find_and_nothing_found_is_perfect():
    assert well([], 0) == {"precision": 1.0, "recall": 1.0, "f1": 1.0}
    assert well([], 1) == {"precision": 0.0, "recall": 1.0, "f1": 0.0}
