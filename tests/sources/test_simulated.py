"""One drive, seen by whoever likes: what a source yields is what the robot believes, and the truth is made once."""

import numpy as np
import pytest

from flysim.evaluate.evaluator import evaluate
from flysim.products.frame import Frame, FrameSequence
from flysim.runs.run import driven, errand, travel
from flysim.runs.scenario import read_scenario
from flysim.runs.see import see
from flysim.sources.simulated import simulated
from flysim.sources.source import Replayed


@pytest.fixture(scope="module")
def plan():
    plan = read_scenario("paper_a", ["flies.population=200", "flies.max_iterations=5"])
    return plan.model_copy(update={"stops": plan.stops[:2]})


@pytest.fixture(scope="module")
def drive(plan):
    return driven(plan, seed=4, renderer="tiny")


def timeless(report):
    data = report.to_json()
    del data["time_s"]
    for stop in data["stops"]:
        del stop["time_s"]
    return data


def test_a_drive_that_is_seen_later_gives_what_it_gave_when_it_was_seen_at_once(plan, drive):
    frames, truth = drive
    at_once = evaluate(*travel(plan, seed=4, renderer="tiny"))
    for _ in range(2):  # and it can be seen again
        later = evaluate(see(frames, "flies", plan.flies, plan.obstacles, seed=4), truth)
        assert timeless(later) == timeless(at_once)


def test_its_frames_are_what_the_robot_believes(plan, drive):
    frames, truth = drive
    assert (frames.of.name, frames.of.seed, frames.of.renderer, frames.of.planned) == ("paper_a", 4, "tiny", 2)
    assert [frame.index for frame in frames.frames()] == [stop.index for stop in truth.stops] == [0, 1]
    for frame, stop in zip(frames.frames(), truth.stops, strict=True):
        np.testing.assert_array_equal(frame.T_world_base, stop.odometry.matrix)
        assert frame.time == stop.sim_time
        np.testing.assert_array_equal(frame.pair.left, stop.views[0].rgb)
    assert truth.stops[1].odometry != truth.stops[1].true
    assert frames.of.seconds >= sum(stop.drive_s + stop.render_s for stop in truth.stops)


def test_frames_come_while_it_drives(plan):
    with simulated(errand(plan), "tiny") as source:
        some = source.frames()
        assert next(some).index == 0
        assert len(source.sequence().frames) == 1
        assert (source.planned, source.rig.baseline) == (2, pytest.approx(errand(plan).robot.rig.baseline))
        assert len(source.truth().stops) == 1


def test_the_truth_reads_bodies_together_as_the_scenario_says(plan):
    near = plan.model_copy(update={"truth": plan.truth.model_copy(update={"merge_gap": 10.0}), "world": "yard"})
    _, together = driven(near.model_copy(update={"stops": plan.stops[:1]}), seed=0, renderer="tiny")
    _, apart = driven(plan.model_copy(update={"world": "yard", "stops": plan.stops[:1]}), seed=0, renderer="tiny")
    assert len(together.obstacles) == 1 < len(apart.obstacles)


def test_frames_without_a_truth_are_a_source_like_any_other(drive):
    frames, _ = drive
    pair = frames.of.frames[0].pair
    alone = Replayed(
        of=FrameSequence(name="photograph", frames=(Frame.alone(pair, height=0.4),), planned=1), rig=pair.rig
    )
    findings = see(alone, "bm", seed=1)
    assert alone.truth() is None
    assert len(findings.seen) == 1 and len(findings.seen[0].swarm.points) > 100
    assert findings.engine == "bm" and findings.sequence.name == "photograph"


def test_a_source_of_no_frame_has_findings_too(drive):
    frames, _ = drive
    none = Replayed(of=FrameSequence(name="nothing", frames=(), planned=3), rig=frames.rig)
    findings = see(none, "flies")
    assert (findings.seen, findings.obstacles, len(findings.cloud.points)) == ((), (), 0)
