import sys
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from flysim.record import colours, figures
from flysim.record.canvas import drawn
from flysim.record.figures import images_figure, path_figure, planes_figure, write_figures
from flysim.record.outline import box_corners, hull, inside_box, placed_parts

NAMES = ("path.png", "planes.png", "flies_on_image.png", "flies_on_images.png")


@pytest.fixture(scope="module")
def pictures(tmp_path_factory, findings, truth):
    folder = tmp_path_factory.mktemp("figures")
    write_figures(folder, findings, truth)
    return {name: np.asarray(Image.open(folder / name)).astype(int) for name in NAMES}


def pixels(picture, colour, tolerance=30) -> int:
    return int((np.abs(picture - np.array(colour)).max(axis=2) <= tolerance).sum())


@pytest.mark.parametrize("name", NAMES)
def test_each_figure_is_a_picture_of_a_sensible_size(pictures, name):
    height, width, channels = pictures[name].shape
    assert channels == 3 and 300 < width < 1700 and 150 < height < 1300
    assert len(np.unique(pictures[name] @ (1, 256, 65536))) > 20


def test_walls_are_grey_and_no_obstacle(pictures, findings, truth):
    assert pixels(pictures["path.png"], colours.STRUCTURE, tolerance=5) > 3000
    labels = path_figure(findings, truth).axes[0].get_legend_handles_labels()[1]
    assert labels.count("wall") == 1 and labels.count("obstacle, true") == 4  # box_1, post, ball, ramp


@pytest.mark.parametrize("name", ["path.png", "planes.png"])
def test_truth_estimate_and_flies_are_all_drawn(pictures, name):
    for colour in (colours.TRUE, colours.BELIEVED):
        assert pixels(pictures[name], colour) > 300
    assert pixels(pictures[name], colours.FLY) > 100


def test_the_flies_are_drawn_on_the_image_in_viridis(pictures, tmp_path, findings):
    bare = replace(findings.seen[-1].swarm, uv=np.full((1, 2), np.nan, np.float32), fitness=np.ones(1, np.float32))
    seen = (*findings.seen[:-1], replace(findings.seen[-1], swarm=bare))
    write_figures(tmp_path, replace(findings, seen=seen), None)
    without = np.asarray(Image.open(tmp_path / "flies_on_image.png")).astype(int)
    inside = (slice(40, -40), slice(40, 700))
    changed = np.abs(pictures["flies_on_image.png"] - without).max(axis=2)[inside] > 40
    assert changed.sum() > 5 * len(findings.seen[-1].swarm.points)


def test_a_metre_is_as_long_in_every_direction_and_plane(findings, truth):
    scales = []
    for figure in (path_figure(findings, truth), planes_figure(findings, truth)):
        figure.canvas.draw()
        maps = [axes for axes in figure.axes if axes.get_xlabel()]
        for axes in maps:
            box = axes.get_window_extent()
            x, y = np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())
            assert box.width / x == pytest.approx(box.height / y, rel=1e-3)
            assert axes.get_xlabel().endswith("[m]") and axes.get_ylabel().endswith("[m]")
            scales.append(box.width / x)
    assert scales[1:] == pytest.approx([scales[1]] * 3, rel=1e-3)


def test_of_many_obstacles_each_has_a_view_from_the_side(findings, truth, monkeypatch):
    monkeypatch.setattr(figures, "_MOST_ASIDE", 1)
    assert len(truth.obstacles) == 2
    figure = planes_figure(findings, truth)
    figure.canvas.draw()
    above, *aside = [axes for axes in figure.axes if axes.get_xlabel()]
    assert [axes.get_title() for axes in aside] == [obstacle.name for obstacle in truth.obstacles]
    boxes = [axes.get_window_extent() for axes in aside]
    scales = [box.width / np.ptp(axes.get_xlim()) for box, axes in zip(boxes, aside, strict=True)]
    assert scales == pytest.approx([scales[0]] * 2, rel=1e-3)
    for box, axes, obstacle in zip(boxes, aside, truth.obstacles, strict=True):
        assert box.height / np.ptp(axes.get_ylim()) == pytest.approx(scales[0], rel=1e-3)
        assert axes.get_xlabel() == "x [m]" and axes.get_ylabel() == "z [m]"
        assert axes.get_xlim()[0] < obstacle.center[0] < axes.get_xlim()[1]
        assert axes.get_legend_handles_labels()[1].count("obstacle, true") >= 1
        assert not any(box.overlaps(other) for other in boxes if other is not box)
        assert not box.overlaps(above.get_window_extent())


def test_the_stops_have_a_colour_bar(findings):
    figure = images_figure(findings.seen)
    bar = figure.axes[-1]
    assert "less fit" in bar.get_xlabel() and bar.get_xlim() == (0.0, 1.0)


def test_path_and_obstacles_lie_within_the_figure_from_above(findings, truth):
    axes = path_figure(findings, truth).axes[0]
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    for stop in truth.stops:
        assert left < stop.true.x < right and low < stop.true.y < high
    for box in truth.obstacles:
        assert left < box.center[0] < right and low < box.center[1] < high
    assert [text.get_text() for text in axes.texts if text.get_text().isdigit()] == ["0", "1", "2", "3"]


def test_the_legend_covers_no_data(findings, truth):
    figure = path_figure(findings, truth)
    figure.canvas.draw()
    axes = figure.axes[0]
    assert axes.get_legend().get_window_extent().x0 >= axes.get_window_extent().x1
    assert axes.get_legend().get_window_extent().x1 <= figure.bbox.x1


def test_a_drive_without_stops_flies_or_obstacles_still_has_figures(tmp_path, make_drive):
    drive = make_drive(0)
    write_figures(tmp_path, drive.findings, drive.truth)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["path.png", "planes.png"]


def test_a_name_with_dollar_signs_is_no_mathematics(findings, truth):
    # matplotlib would read what stands between them as TeX, and end the run at the first mistake in it.
    figure = path_figure(replace(findings, sequence=replace(findings.sequence, name="a $\\frac$ \x1b$b$")), truth)
    drawn(figure)
    assert figure.axes[0].get_title().startswith(r"a \$\frac\$ ?\$b\$, seed")


def test_the_figures_leave_pyplot_alone(pictures):
    assert "matplotlib.pyplot" not in sys.modules or not sys.modules["matplotlib.pyplot"].get_fignums()


def test_outlines_have_the_right_area(truth):
    parts = {part.points.shape[0]: part for part in placed_parts(truth)}
    post = parts[144]  # a cylinder: two rings of 72
    x, y = post.outline((0, 1)).T
    area = 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
    assert area == pytest.approx(np.pi * 0.1**2, rel=2e-3)


def test_points_on_a_line_have_a_segment_for_a_hull():
    line = np.array([[0.0, 0.0], [1.0, 1.0], [0.5, 0.5]])
    assert sorted(map(tuple, hull(line))) == [(0.0, 0.0), (1.0, 1.0)]


def test_a_turned_boxs_corners_are_inside_it_and_no_farther_point_is():
    box = {"center": (1.0, 2.0, 0.3), "size": (0.4, 0.2, 0.6), "yaw": 0.7}
    corners = box_corners(**box)
    assert inside_box(corners, **box, margin=1e-9).all()
    outward = np.array(box["center"]) + 1.05 * (corners - box["center"])
    assert not inside_box(outward, **box, margin=0.0).any()
    assert inside_box(outward, **box, margin=0.05).all()
