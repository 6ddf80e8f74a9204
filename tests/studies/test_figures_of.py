"""Pooled figures by hand arithmetic."""

from dataclasses import replace

import numpy as np
import pytest

from flysim.common.statistics import bootstrap_ci95
from flysim.evaluate.report import Report
from flysim.evaluate.scores import TAUS, ObstacleReport, Spread, StopReport, SurfaceReport
from flysim.studies.compare.figures_of import interval, missed_big, pooled, worst_obstacle


def obstacle(name="box", *, detected=True, visible=True, center=0.01, sizes=(0.4, 0.3, 0.2), errors=(0.01, -0.02, 0.0)):
    found = detected and visible
    return ObstacleReport(
        name=name,
        detected=detected,
        visible=visible,
        shape_true="box",
        shape_estimated="box" if detected else None,
        center_error=2 * center if detected else None,
        center_visible_error=center if found else None,
        size_true=sizes,
        size_visible=sizes if visible else None,
        size_estimated=sizes if detected else None,
        size_error=tuple(2 * e for e in errors) if detected else None,
        size_visible_error=errors if found else None,
        yaw_error_deg=None,
    )


def report(*obstacles, false=0, evolve=(0.1, 0.3), surface=0.5):
    stops = tuple(
        StopReport(
            index=i, commanded=(0, 0, 0), odometry=(0, 0, 0), true=(0, 0, 0), iterations=1, converged=True,
            time={"render": 9.0, "evolve": seconds, "obstacles": 0.02},
        )
        for i, seconds in enumerate(evolve)
    )  # fmt: skip
    none, by_tau = Spread(median=None, max=None), dict.fromkeys(TAUS, surface)
    return Report(
        scenario="s", seed=0, renderer="tiny", engine="flies", world="w", status="ok", blocked=None,
        stops_planned=len(stops), stops=stops, obstacles=obstacles, false_obstacles=false, structure_obstacles=0,
        precision=0.0, recall=0.0, f1=0.0, center_error=none, center_visible_error=none, size_error=none,
        size_visible_error=none, time={},
        surface=SurfaceReport(
            accuracy_median=None, accuracy_p90=None, precision=by_tau, completeness=by_tau, f_score=by_tau
        ),
    )  # fmt: skip


def test_counts_are_pooled_before_they_are_divided():
    reports = [
        report(obstacle(), obstacle(), obstacle(detected=False), false=2, surface=0.4),
        report(obstacle(), obstacle(visible=False), surface=0.8),
    ]
    figures = pooled(reports)
    assert (figures["found"], figures["visible"], figures["false"]) == (3, 4, 2)
    assert figures["recall"] == pytest.approx(3 / 4)
    assert figures["precision"] == pytest.approx(3 / 5)
    assert figures["f1"] == pytest.approx(2 * 0.75 * 0.6 / 1.35)
    assert figures["surface_f"] == pytest.approx(dict.fromkeys(TAUS, 0.6))


def test_medians_are_over_every_single_error_of_what_was_found():
    figures = pooled(
        [
            report(obstacle(center=0.01, errors=(0.01, -0.02, 0.03)), obstacle(detected=False)),
            report(obstacle(center=0.05, errors=(0.05, 0.06, -0.07), sizes=(0.5, 0.6, 0.7)), obstacle(visible=False)),
        ]
    )
    assert figures["center_error_m"] == pytest.approx(0.03)
    assert figures["size_error_m"] == pytest.approx((0.03 + 0.05) / 2)
    assert figures["size_error_rel"] == pytest.approx((0.1 + 0.1) / 2)  # .025 .0667 .15 .1 .1 .1
    assert figures["center_error_full_m"] == pytest.approx(0.06)
    assert figures["size_error_full_m"] == pytest.approx(0.08)


def test_the_tails_and_the_heights_are_told_apart():
    errors = [(0.0, 0.0, -0.01 * k) for k in range(21)]
    figures = pooled([report(*(obstacle(center=0.001 * k, errors=e) for k, e in enumerate(errors)))])
    assert figures["height_error_m"] == pytest.approx(0.1)
    assert figures["height_error_p95_m"] == pytest.approx(0.19)
    assert figures["height_error_max_m"] == figures["size_error_max_m"] == pytest.approx(0.2)
    assert figures["size_error_m"] == 0.0  # heights are a third of the sizes: their median hides them
    assert figures["center_error_p95_m"] == pytest.approx(0.019)


def test_shapes_are_a_share_of_what_was_found():
    wrong = replace(obstacle(), shape_estimated="cylinder")
    reports = [report(obstacle(), wrong, obstacle(detected=False)), report(obstacle(), obstacle())]
    assert pooled(reports)["shape_accuracy"] == pytest.approx(3 / 4)
    assert pooled([report(obstacle(detected=False))])["shape_accuracy"] is None


def test_overlaps_are_means_over_all_that_was_visible():
    many = replace(report(*[obstacle()] * 3), iou_plan=0.9, iou_3d=0.8)
    one = replace(report(obstacle()), iou_plan=0.5, iou_3d=0.4)
    none = report(obstacle(visible=False))
    assert pooled([many, one, none])["iou_plan"] == pytest.approx((3 * 0.9 + 0.5) / 4)
    assert pooled([none])["iou_3d"] is None


def test_time_is_the_engines_and_the_clusterers_and_never_the_drawing():
    figures = pooled([report(evolve=(0.1, 0.3)), report(evolve=(0.2,))])
    assert figures["ms_per_stop"] == pytest.approx(220.0)


def test_nothing_to_see_and_nothing_claimed_is_right():
    figures = pooled([report()])
    assert (figures["f1"], figures["center_error_m"], figures["missed_big"]) == (1.0, None, 0)
    assert pooled([report(false=1)])["f1"] == 0.0
    assert pooled([])["ms_per_stop"] is None


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"detected": False, "sizes": (0.151, 0.1, 0.1)}, True),
        ({"detected": False, "sizes": (0.1, 0.1, 0.151)}, True),
        ({"detected": False, "sizes": (0.149, 0.1, 0.1)}, False),
        ({"sizes": (0.5, 0.5, 0.5)}, False),
        ({"detected": False, "visible": False, "sizes": (0.5, 0.5, 0.5)}, False),
    ],
)
def test_a_big_one_missed(given, expected):
    assert missed_big(obstacle(**given)) is expected
    assert pooled([report(obstacle(**given))])["missed_big"] == expected


def test_the_worst_obstacle_is_a_missed_one_or_the_one_most_off():
    small, large = obstacle("small", detected=False, sizes=(0.1,) * 3), obstacle("large", detected=False)
    assert worst_obstacle(report(small, obstacle(), large))["name"] == "large"
    off = obstacle("off", errors=(0.0, 0.0, -0.5))
    assert worst_obstacle(report(obstacle(), off, obstacle("hidden", visible=False)))["name"] == "off"
    assert worst_obstacle(report()) is None


def test_intervals_hold_the_figure_and_medians_need_two_runs():
    runs = [report(obstacle(center=0.001 * k), obstacle(detected=k % 3 > 0), false=k % 2) for k in range(12)]
    figures = pooled(runs)
    for figure in ("f1", "precision", "recall", "center_error_m", "size_error_m", "size_error_rel"):
        low, high = interval(runs, figure, np.random.default_rng(0))
        assert low <= figures[figure] <= high
        if figure.endswith(("_m", "_rel")):  # of one run alone nobody knows how much runs differ
            assert interval(runs[:1], figure, np.random.default_rng(0)) is None
    low, high = interval(runs, "recall", np.random.default_rng(0))
    assert 0.0 < high - low < 0.4


def test_no_failure_is_no_certainty():
    for count in (1, 12):
        runs = [report(obstacle(), obstacle())] * count
        for figure in ("f1", "precision", "recall"):
            low, high = interval(runs, figure, np.random.default_rng(0))
            assert high == 1.0 and low == pytest.approx(1.0 / (1.0 + 1.959964**2 / (2 * count)))  # Wilson, all hit
        low, high = interval(runs, "well_f1", np.random.default_rng(0))
        assert low == 0.0 < high
    assert interval([report()], "f1", np.random.default_rng(0)) is None


def test_the_bootstrap_of_a_mean_is_its_standard_error():
    values = np.random.default_rng(1).normal(0.0, 1.0, 400)
    low, high = bootstrap_ci95(400, lambda drawn: float(values[drawn].mean()), np.random.default_rng(2))
    assert high - low == pytest.approx(2 * 1.96 / np.sqrt(400), rel=0.15)
    assert bootstrap_ci95(5, lambda drawn: None, np.random.default_rng(0)) is None
