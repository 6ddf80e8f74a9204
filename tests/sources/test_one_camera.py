"""A drive with one camera: frames of two stops, and their truth."""

from pathlib import Path

import numpy as np
import pytest

from flysim.errors import FlysimError, RobotError, ScenarioError
from flysim.evaluate.evaluator import evaluate
from flysim.geometry.frames import inverse
from flysim.runs.run import check, driven, errand, travel
from flysim.runs.scenario import make_scenario
from flysim.sources.filmed import FilmedDrive
from flysim.sources.simulated import simulated

ROBOT = (Path(__file__).resolve().parents[2] / "robots/monorover/robot.urdf").read_text(encoding="utf-8")
STOPS = (
    {"x": 1.1, "y": -0.3, "yaw_deg": 0},
    {"x": 1.1, "y": -0.3, "yaw_deg": 20},  # on the spot
    {"x": 1.1, "y": 0.0, "yaw_deg": 0},
    {"x": 1.3, "y": 0.0, "yaw_deg": 0},
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("one")
    small = ROBOT.replace("<width>640<", "<width>160<").replace("<height>480<", "<height>120<")
    (folder / "small.urdf").write_text(small, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def plan(folder):
    def plan(**change):
        flies = {"population": 300, "max_iterations": 6}
        data = {"world": "paper", "robot": "small.urdf", "stops": STOPS, "pairs": "consecutive", "flies": flies}
        return make_scenario({**data, "folder": folder, "name": "one", **change})

    return plan


@pytest.fixture(scope="module")
def drive(plan):
    return driven(plan(), seed=3, renderer="tiny")


def test_two_stops_are_its_two_eyes(drive):
    frames, truth = drive
    assert [(one.index, one.other) for one in frames.of.frames] == [(2, 1), (3, 2)]
    assert [stop.index for stop in truth.stops] == [0, 1, 2, 3]  # the way is known at all of them
    assert [stop.index for stop in truth.framed] == [2, 3] == [sight.stop.index for sight in truth.sights]
    for frame in frames.of.frames:
        here, there = truth.stops[frame.index], truth.stops[frame.other]
        np.testing.assert_array_equal(frame.pair.left, here.views[0].rgb)
        np.testing.assert_array_equal(frame.pair.right, there.views[0].rgb)
        np.testing.assert_array_equal(here.views[1].rgb, there.views[0].rgb)
        # By what odometry believes, which is not where it truly was.
        mounted = frame.T_base_left
        believed = inverse(there.odometry.matrix @ mounted) @ here.odometry.matrix @ mounted
        np.testing.assert_allclose(frame.pair.rig.T_right_left, believed, atol=1e-12)
        true = inverse(there.T_world_base @ mounted) @ here.T_world_base @ mounted
        assert 0.0 < np.abs(true - believed).max() < 0.01


def test_what_made_no_pair_is_said_once(drive):
    frames, _ = drive
    assert (frames.of.planned, len(frames.of.frames)) == (2, 2)
    (note,) = frames.of.notes
    assert note.startswith("1 of 4 stops makes no pair: stop 2 (0.0") and note.endswith(
        "from stop 1: no parallax). 2 pairs are kept."
    )


def test_what_both_pictures_saw_is_the_truth_of_a_pair(drive):
    _, truth = drive
    ahead = truth.sights[1]
    points = ahead.points()
    left, right = ahead.views
    for view in (left, right):
        optical = inverse(view.T_world_optical) @ np.column_stack([points, np.ones(len(points))]).T
        uv = view.camera.project(optical[:3].T)
        assert view.camera.contains(uv, -1.0).all()
    # Where it drove ahead, the earlier picture shows all of the later one, but for what is too near or too far.
    assert ahead.seen.sum() > 0.9 * ((left.depth > 0.0) & (left.depth <= 4.0)).sum()


def test_it_is_seen_and_judged_as_any_other(plan):
    report = evaluate(*travel(plan(), seed=3, renderer="tiny"))
    assert [stop.index for stop in report.stops] == [2, 3]
    assert report.stops_planned == 2
    assert report.warnings[-1].startswith("1 of 4 stops makes no pair")
    again = evaluate(*travel(plan(), seed=3, renderer="tiny"))
    assert again.surface == report.surface and again.obstacles == report.obstacles


def test_a_robot_with_two_has_its_left_one_do_the_same(plan):
    frames, truth = driven(plan(robot="rover", stops=STOPS[2:]), seed=0, renderer="tiny")
    (frame,) = frames.of.frames
    assert (frame.index, frame.other) == (1, 0)
    np.testing.assert_array_equal(frame.pair.right, truth.stops[0].views[0].rgb)


def test_its_pictures_are_disturbed_as_the_left_ones_of_two(plan):
    noisy = {"sensors": {"noise": 5.0}}
    frames, _ = driven(plan(**noisy, stops=STOPS[2:]), seed=0, renderer="tiny")
    clean, truth = driven(plan(stops=STOPS[2:]), seed=0, renderer="tiny")
    off = frames.of.frames[0].pair.left.astype(int) - clean.of.frames[0].pair.left
    assert 4.0 < off.std() < 6.0
    assert truth.disturbed == {}


@pytest.mark.parametrize(
    ("change", "kind", "words"),
    [
        ({"pairs": "stereo"}, RobotError, "robot 'monorover' has one camera"),
        ({"stops": STOPS[:1]}, ScenarioError, "one camera needs two stops"),
        ({"stops": STOPS[:2]}, ScenarioError, "no parallax). 0 pairs are kept. Move the stops"),
        ({"stops": (STOPS[0], {"x": 1.1, "y": 2.7})}, ScenarioError, "stop 2 (3.00 m from stop 1, more than 2 m)"),
        ({"pairs": {"baseline": [1.0, 2.0]}}, ScenarioError, "'one' has one camera and no pair: 3 of 4 stops"),
        ({"sensors": {"gain_right": 0.5}}, FlysimError, "sensors.gain_right is of a second camera"),
        ({"calibration": {"row_shift_px": 1.0}}, FlysimError, "calibration.row_shift_px is of a second camera"),
    ],
)
def test_what_cannot_be_is_told_before_it_sets_out(plan, change, kind, words):
    with pytest.raises(kind) as told:
        check(plan(**change))
    assert words in str(told.value) and "\n" not in str(told.value)


def test_no_data_set_is_written_of_pairs_that_have_no_one_rig(plan):
    with (
        pytest.raises(ScenarioError, match="'one' has pairs of stops, each with a rig of its own"),
        simulated(errand(plan()), "tiny", kind=FilmedDrive),
    ):
        pass
