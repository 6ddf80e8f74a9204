import json
import math
from dataclasses import replace

import pytest

from flysim.evaluate.evaluator import evaluate
from flysim.evaluate.report import Report
from flysim.evaluate.scores import Spread

# What other programs read. A key may be added, none may go.
TOP = (
    *(
        "scenario",
        "seed",
        "renderer",
        "engine",
        "status",
        "stops",
        "obstacles",
        "false_obstacles",
        "precision",
    ),
    *("recall", "f1", "center_error_m", "size_error_m", "surface", "time_s", "versions"),
)
BELOW = {
    "stops": {"index", "commanded", "odometry", "true", "iterations", "converged", "time_s"},
    "obstacles": {
        *("name", "detected", "center_error_m", "size_true_m", "size_visible_m", "size_estimated_m"),
        *("size_error_m", "size_visible_error_m", "yaw_error_deg"),
    },
    "center_error_m": {"median", "max"},
    "size_error_m": {"median", "max"},
    "surface": {"accuracy_median_m", "accuracy_p90_m", "precision", "completeness", "f_score"},
    "time_s": {"total", "drive", "render", "evolve", "obstacles"},
}


@pytest.fixture(scope="module")
def report(yard, by_hand):
    missed = yard.exact[:2]
    return evaluate(yard.findings(missed, by_hand.cloud([[3.45, 0.0, 0.5], [3.43, 0.1, 0.5]])), yard.truth)


def test_the_promised_keys_are_there(report):
    written = report.to_json()
    assert set(TOP) <= set(written)
    for key, keys in BELOW.items():
        entry = written[key]
        for one in entry if isinstance(entry, list) else [entry]:
            assert keys <= set(one), key
    assert list(written["surface"]["precision"]) == ["0.01", "0.02", "0.05"]
    assert set(written["stops"][0]["time_s"]) == {"render", "evolve", "obstacles"}
    assert set(written["versions"]) >= {"python", "numpy", "scipy"}


def test_the_json_survives_a_round_trip_to_the_byte(report):
    text = json.dumps(report.to_json(), allow_nan=False)
    again = Report.from_json(json.loads(text))
    assert json.dumps(again.to_json(), allow_nan=False) == text
    assert again.obstacles[0].size_error == pytest.approx(report.obstacles[0].size_error, abs=1e-6)
    assert isinstance(again.obstacles[0].size_error, tuple)


def test_what_is_not_finite_is_written_as_null_and_no_zero_has_a_sign(report):
    odd = replace(report, precision=math.nan, f1=-1e-12, center_error=Spread(median=math.inf, max=1.23456789))
    written = odd.to_json()
    assert written["precision"] is None
    assert str(written["f1"]) == "0.0"
    assert written["center_error_m"] == {"median": None, "p95": None, "max": 1.234568}


def test_a_missing_key_is_named(report):
    written = report.to_json()
    del written["surface"]
    with pytest.raises(KeyError, match="surface"):
        Report.from_json(written)


def test_the_table_says_what_a_person_asks(report):
    lines = str(report).splitlines()
    assert "seed 7" in lines[0]
    assert "4 of 4 stops" in lines[0]
    (box,) = [line for line in lines if line.startswith("box_1")]
    assert "50.0 x 30.0 x 40.0" in box
    (pole,) = [line for line in lines if line.startswith("pole")]
    assert pole.split()[1] == "no"
    assert "recall 0.67, precision 1.00" in str(report)
    assert max(len(line) for line in lines) <= 130
    assert "nan" not in str(report).lower()


def test_the_table_of_a_blocked_drive_without_stops(by_hand):
    findings = by_hand.findings([], planned=8, blocked="blocked at stop 1 of 8 by box_2")
    report = evaluate(findings, by_hand.truth(by_hand.world(), []))
    assert report.status == "blocked"
    assert "0 of 8 stops, blocked at stop 1 of 8 by box_2" in str(report)
    assert Report.from_json(report.to_json()).blocked == "blocked at stop 1 of 8 by box_2"
