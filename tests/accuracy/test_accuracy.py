"""What the report of every scenario must hold, over seeds and renderers. `make accuracy` runs all, `make test` one."""

import pytest

from flysim.render.choose import gl_works
from flysim.runs.run import run

CENTER, SIZE, SURFACE = 0.01, 0.01, 0.01  # [m]
ONE_CAMERA_SIZE = 0.015  # [m]
SLIPPING = 0.02  # [m]
YARD_F1 = 0.9


@pytest.fixture
def assess(record_property):
    def assess(scenario, seed, renderer):
        if renderer == "gl" and not gl_works():
            pytest.skip("no OpenGL context opens on this machine")
        report = run(scenario, seed=seed, renderer=renderer)
        record_property("figures", figures(report))
        assert report.status == "ok", report.blocked
        return report

    return assess


def figures(report):
    sizes = [abs(axis) for each in report.obstacles for axis in each.size_visible_error or ()]
    values = (report.center_error.max, max(sizes, default=None), report.surface.accuracy_median)
    center, size, fly = ("-" if value is None else f"{100 * value:.2f}" for value in values)
    return (
        f"{report.scenario:<10}{report.seed:>4}  {report.renderer:<10}"
        f"{report.recall:>6.2f}{report.precision:>11.2f}{report.f1:>6.2f}"
        f"{center:>9}{size:>12}{fly:>8}{report.time['total']:>8.1f}"
    )


def holds_the_papers_figures(report, size=SIZE):
    assert (report.recall, report.precision) == (1.0, 1.0), str(report)
    for obstacle in report.obstacles:
        assert obstacle.center_error is not None and obstacle.center_error <= CENTER, str(report)
        assert obstacle.size_visible_error is not None
        assert max(map(abs, obstacle.size_visible_error)) <= size, str(report)
    assert report.surface.accuracy_median is not None
    assert report.surface.accuracy_median <= SURFACE, str(report)


def test_the_papers_first_path_once(assess):
    """The short one: it is not marked, so that every `make test` runs it."""
    holds_the_papers_figures(assess("paper_a", 0, "auto"))


@pytest.mark.accuracy
@pytest.mark.parametrize("renderer", ["gl", "tiny"])
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("scenario", ["paper_a", "paper_b", "paper_c"])
def test_the_papers_paths(scenario, seed, renderer, assess):
    holds_the_papers_figures(assess(scenario, seed, renderer))


@pytest.mark.accuracy
@pytest.mark.parametrize("renderer", ["gl", "tiny"])
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("scenario", ["paper_a_mono", "paper_b_mono", "paper_c_mono"])
def test_the_papers_paths_by_its_one_camera(scenario, seed, renderer, assess):
    holds_the_papers_figures(assess(scenario, seed, renderer), size=ONE_CAMERA_SIZE)


@pytest.mark.accuracy
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("scenario", ["paper_a_mono", "paper_b_mono", "paper_c_mono"])
def test_its_one_camera_finds_the_way_that_its_wheels_do_not_tell(scenario, seed):
    slip = ("odometry.distance_std=0.02", "odometry.yaw_std_deg_per_m=2", 'localisation="flies"')
    report = run(scenario, seed=seed, overrides=slip)
    assert report.recall == 1.0, str(report)
    for obstacle in report.obstacles:
        assert obstacle.center_error is not None and obstacle.center_error <= SLIPPING, str(report)
        assert obstacle.size_visible_error is not None
        assert max(map(abs, obstacle.size_visible_error)) <= SLIPPING, str(report)
    way = report.whereabouts
    assert way["located"]["ape_m"] <= 0.2 * way["odometry"]["ape_m"], str(report)


@pytest.mark.accuracy
@pytest.mark.parametrize("renderer", ["gl", "tiny"])
@pytest.mark.parametrize("seed", range(3))
def test_the_yard(seed, renderer, assess):
    report = assess("yard", seed, renderer)
    assert report.f1 >= YARD_F1, str(report)
