import json
import os
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import flysim as fs
from flysim.errors import FlysimError, RendererError, ScenarioError, WorldError
from flysim.runs.run import check, run, travel
from flysim.runs.scenario import make_scenario, read_scenario

ROOT = Path(__file__).resolve().parents[2]
HEAVY = {
    "gymnasium",
    "numpy",
    "pybullet",
    "rerun",
    "matplotlib",
    "sklearn",
    "numba",
    "cv2",
    "moderngl",
    "pyarrow",
    "trimesh",
    "pydantic",
}


def timeless(report):
    """A report's JSON without what differs between two runs of one seed."""
    report = json.loads(json.dumps(report))
    assert report.pop("time_s")["total"] > 0.0
    for stop in report["stops"]:
        assert stop.pop("time_s").keys() == {"render", "evolve", "obstacles"}
    return report


@pytest.fixture
def empty(tmp_path, monkeypatch):
    folder = tmp_path / "here"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return folder


def python(source, *arguments, folder, **environment):
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    return subprocess.run(
        [sys.executable, "-c", source, *map(str, arguments)],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": path} | environment,
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
    )


@pytest.mark.parametrize("renderer", ["gl", "tiny"])
def test_the_same_seed_and_renderer_give_the_same_report_and_nothing_is_written(empty, short, renderer):
    try:
        first, second = (timeless(run(short, seed=5, renderer=renderer).to_json()) for _ in range(2))
    except RendererError as error:
        pytest.skip(str(error))
    assert first == second
    assert (first["seed"], first["renderer"]) == (5, renderer)
    assert not list(empty.iterdir())
    other = timeless(run(str(short), seed=6, renderer=renderer).to_json())
    assert other["surface"] != first["surface"]


def test_one_thread_and_two_give_the_same_report(empty, short):
    source = (
        "import json, sys, flysim as fs\n"
        "json.dump(fs.run(sys.argv[1], seed=5, overrides=['flies.population=1500']).to_json(), sys.stdout)"
    )
    reports = []
    for threads in ("1", "2"):
        done = python(source, short, folder=empty, NUMBA_NUM_THREADS=threads)
        assert (done.returncode, done.stderr) == (0, "")
        reports.append(timeless(json.loads(done.stdout)))
    assert reports[0] == reports[1]


def test_import_flysim_is_fast_and_brings_nothing_along(tmp_path):
    source = (
        "import sys\nimport flysim\n"
        f"print(*sorted({HEAVY!r} & set(sys.modules)))\n"
        "print(flysim.FlysimError.__name__, 'run' in dir(flysim))"
    )
    seconds = []
    for _ in range(5):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = python(source, folder=tmp_path)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        assert done.stdout == "\nFlysimError True\n", done.stderr
        # Time of the processor, not of the clock: others may be at work here.
        seconds.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    assert min(seconds) < 0.3


def test_every_name_of_the_package_is_there():
    for name in fs.__all__:
        assert getattr(fs, name).__name__ == name
    with pytest.raises(AttributeError, match="module 'flysim' has no attribute 'rnu'"):
        _ = fs.rnu


def test_a_run_tells_how_far_it_is_and_writes_its_folder(empty, short):
    told = []
    report = run(short, out="mine", progress=lambda what, share: told.append((what, share)))
    words, shares = zip(*told, strict=True)
    assert words[0] == "build the world"
    assert {"stop 1 of 2", "stop 2 of 2", "evaluate", "written"} <= set(words)
    assert list(shares) == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    assert json.loads((empty / "mine/report.json").read_text(encoding="utf-8")) == report.to_json()
    config = json.loads((empty / "mine/config.json").read_text(encoding="utf-8"))
    assert config["scenario"]["flies"]["population"] == 200
    assert config["seed"] == 0
    assert [path.name for path in empty.iterdir()] == ["mine"]


def test_a_scenario_made_in_python(empty, short):
    plan = read_scenario(str(short))
    report = run(plan, seed=1, renderer="tiny")
    assert (report.scenario, report.seed, report.status, report.blocked) == ("short", 1, "ok", None)
    assert [stop.index for stop in report.stops] == [0, 1]
    with pytest.raises(ValueError, match="overrides need a scenario's name or path"):
        run(plan, overrides=["flies.population=300"])


def test_nonsense_from_python_is_refused(empty):
    with pytest.raises(ValueError, match="seed must be >= 0, got -1"):
        run("paper_a", seed=-1)
    with pytest.raises(RendererError, match="no renderer 'gll'"):
        run("paper_a", renderer="gll")  # type: ignore[arg-type]
    with pytest.raises(ScenarioError, match="no scenario 'papr_a'"):
        fs.run("papr_a")
    with pytest.raises(FlysimError, match="cannot write /proc/x"):
        run("paper_a", out="/proc/x")
    assert not list(empty.iterdir())


def test_a_stop_inside_an_obstacle_is_told_before_the_drive():
    stops = [{"x": 0.0, "y": 0.0}, {"x": 2.2, "y": 0.0}]
    plan = make_scenario({"name": "mine", "world": "paper", "stops": stops})
    for refuse in (check, lambda plan: travel(plan, seed=0, renderer="tiny")):
        with pytest.raises(
            ScenarioError, match=r"scenario 'mine': stop 2 of 2 at \(2.2, 0\) stands in 'box': move it; "
        ):
            refuse(plan)
    check(plan.model_copy(update={"stops": plan.stops[:1]}))
    with pytest.raises(WorldError, match="no world 'papr'"):
        check(plan.model_copy(update={"world": "papr"}))


def test_what_was_seen_before_a_block_is_kept(short, monkeypatch):
    from flysim.sim.driving import Leg
    from flysim.sources import way as pipeline

    drive_to = pipeline.drive_to
    legs = []

    def blocked_at_the_second(simulation, target, params):
        legs.append(target)
        leg = drive_to(simulation, target, params)
        return leg if len(legs) == 1 else Leg(blocked="without progress", track=leg.track)

    monkeypatch.setattr(pipeline, "drive_to", blocked_at_the_second)
    findings, truth = travel(read_scenario(str(short)), seed=0, renderer="tiny")
    assert findings.sequence.blocked == "blocked at stop 2 of 2 without progress"
    assert [one.frame.index for one in findings.seen] == [stop.index for stop in truth.stops] == [0]
    assert (findings.sequence.planned, len(findings.cloud.points) > 0) == (2, True)


def test_a_drive_blocked_before_it_saw_anything_has_a_report(short, monkeypatch):
    from flysim.sim.driving import Leg
    from flysim.sources import way as pipeline

    monkeypatch.setattr(pipeline, "drive_to", lambda simulation, *_: Leg(blocked="by ball", track=[[0.0] * 7]))
    report = run(short, renderer="tiny")
    assert (report.status, report.blocked) == ("blocked", "blocked at stop 1 of 2 by ball")
    assert report.stops == ()
    assert (report.recall, report.false_obstacles) == (1.0, 0)  # of all that it could see, which is nothing
    assert "blocked at stop 1 of 2 by ball" in str(report)


def test_one_seed_gives_each_stop_its_own_flies(short):
    findings, _ = travel(read_scenario(str(short)), seed=0, renderer="tiny")
    first, second = (one.swarm.uv for one in findings.seen)
    assert first.shape != second.shape or not (first == second).all()


@pytest.mark.parametrize("part", ["stops", "odometry"])
def test_a_stop_has_its_three_poses(short, part):
    findings, truth = travel(read_scenario(str(short)), seed=0, renderer="tiny")
    stop, frame = truth.stops[1], findings.seen[1].frame
    np.testing.assert_array_equal(frame.T_world_base, stop.odometry.matrix)
    assert stop.commanded.distance(stop.odometry) < 0.01
    assert stop.commanded.distance(stop.true) < 0.01
    assert stop.odometry != stop.true
    assert stop.commanded.x == pytest.approx(1.1)
    assert stop.T_world_base[:3, 3] == pytest.approx((stop.true.x, stop.true.y, 0.0), abs=1e-3)
