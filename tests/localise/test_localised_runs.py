"""A robot whose wheels slip finds its way by its flies: what it then believes, writes and finds."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from flysim.cli.app import app
from flysim.engines.flies import Flies
from flysim.errors import EngineError, ScenarioError
from flysim.evaluate.report import Report
from flysim.localise.localiser import localiser_named
from flysim.runs.run import driven, run
from flysim.runs.scenario import read_scenario
from flysim.runs.see import see

DRIFT = ("odometry.distance_std=0.02", "odometry.yaw_std_deg_per_m=4", "flies.population=1500")


class Fails(Flies):
    """Sees nothing where `at` says so."""

    def see(self, frame, *, rng):
        if type(self).at(frame):
            raise EngineError(f"nothing seen at {frame.time:.1f} s")
        return super().see(frame, rng=rng)


class AtTheSecondStop(Fails):
    at = staticmethod(lambda frame: not frame.glance and frame.index == 1)


class OnTheWay(Fails):
    at = staticmethod(lambda frame: frame.glance)


class AtEveryStop(Fails):
    at = staticmethod(lambda frame: not frame.glance)


def plan_of(localisation):
    plan = read_scenario("paper_a", [*DRIFT, f'localisation="{localisation}"'])
    return plan.model_copy(update={"stops": plan.stops[:6:2]})


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("run") / "out"
    run(plan_of("flies"), seed=1, out=out, renderer="tiny")
    return out


def poses(folder, name):
    return np.loadtxt(folder / f"trajectory_{name}.tum")


def test_flies_say_where_the_robot_is(folder):
    report = Report.from_json(json.loads((folder / "report.json").read_text()))
    way = report.whereabouts
    assert way["by"] == "flies"
    assert (way["hops"] >= 2, way["lost"]) == (True, [])
    assert way["located"]["ape_m"] < 0.2 * way["odometry"]["ape_m"]
    assert way["located"]["rpe_deg"] < 0.2 * way["odometry"]["rpe_deg"]
    for stop, seen in zip(report.stops, way["stops"], strict=True):
        off = np.hypot(*(np.array(seen["pose"]) - stop.true)[:2])
        assert off < 0.005 + 4.0 * np.hypot(*seen["deviation_m"])
    assert "off by flies" in str(report)
    assert report.odometry == {"distance_std": 0.02, "yaw_std_deg_per_m": 4.0}
    assert "localise" in report.time


@pytest.mark.parametrize(("program", "key"), [("evo_ape", "ape_m"), ("evo_rpe", None)])
def test_evo_reads_all_three_trajectories(folder, tmp_path, program, key):
    found = shutil.which(program, path=str(Path(sys.executable).parent)) or shutil.which(program)
    if found is None:
        pytest.skip("evo is not installed")
    home = {"HOME": str(tmp_path), "PATH": str(Path(found).parent) + ":/usr/bin:/bin", "MPLBACKEND": "agg"}
    way, true = json.loads((folder / "report.json").read_text())["whereabouts"], poses(folder, "true")
    for name, told in (("flies", "located"),) if key else (("odom", "odometry"),):
        files = ["trajectory_true.tum", f"trajectory_{name}.tum"]
        done = subprocess.run([found, "tum", *files], cwd=folder, env=home, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stdout + done.stderr
        figures = {row.split()[0]: float(row.split()[1]) for row in done.stdout.splitlines() if "\t" in row}
        if key is not None:
            assert figures["rmse"] == pytest.approx(way[told][key], abs=2e-6)
            continue
        steps = [hops(track) for track in (true, poses(folder, name))]
        assert figures["rmse"] == pytest.approx(np.sqrt(((steps[1] - steps[0]) ** 2).sum(axis=1).mean()), abs=2e-6)


def hops(track):
    """`[n - 1, 2]` each place as seen from the pose before."""
    yaw, d = 2.0 * np.arctan2(track[:-1, 6], track[:-1, 7]), np.diff(track[:, 1:3], axis=0)
    return np.column_stack(
        [np.cos(yaw) * d[:, 0] + np.sin(yaw) * d[:, 1], np.cos(yaw) * d[:, 1] - np.sin(yaw) * d[:, 0]]
    )


@pytest.mark.parametrize("fails", [AtTheSecondStop, OnTheWay])
def test_a_robot_that_sees_nothing_once_drives_on_by_what_it_saw_before(fails):
    plan = plan_of("flies").model_copy(update={"engine": f"{__name__}:{fails.__name__}"})
    report = run(plan, seed=1, renderer="tiny")
    way = report.whereabouts
    assert way["located"]["ape_m"] < 0.3 * way["odometry"]["ape_m"] and way["hops"] >= 2
    assert len(way["stops"]) == len(report.stops) == 3
    if fails is OnTheWay:
        assert len(report.failed) == way["glances"] > 0
        assert all(line.startswith(("on the way to stop 2: ", "on the way to stop 3: ")) for line in report.failed)
    else:
        assert [line.startswith("nothing seen at") for line in report.failed] == [True]


THIRD_FAILS = """
import pathlib, sys
import cv2
import numpy as np
count = pathlib.Path(__file__).with_suffix(".count")
count.write_text(count.read_text() + "." if count.exists() else ".")
if len(count.read_text()) == 3:
    sys.exit("not this one")
left, right = (cv2.imread(name, cv2.IMREAD_GRAYSCALE) for name in sys.argv[1:3])
found = cv2.StereoSGBM_create(0, 128, 5).compute(left, right) / np.float32(16.0)
with open(sys.argv[3], "wb") as out:
    np.save(out, np.where(found > 0.0, found, np.nan).astype(np.float32))
"""


def test_a_program_that_fails_once_leaves_a_run_that_says_so(tmp_path):
    matcher, out = tmp_path / "matcher.py", tmp_path / "run"
    matcher.write_text(THIRD_FAILS)
    command = f"exec:{sys.executable} {matcher} {{left}} {{right}} {{out}}"
    words = [*(word for key in (*DRIFT, "localisation=flies") for word in ("--set", key)), "--renderer", "tiny"]
    done = CliRunner().invoke(app, ["run", "paper_a", "--engine", command, "--out", str(out), *words])
    assert done.exit_code == 2, done.output
    (said,) = done.stderr.strip().splitlines()
    assert said.endswith("ended with code 1: not this one.") and said.startswith("flysim: ")
    report = json.loads((out / "report.json").read_text())
    assert len(report["failed"]) == 1 and said == f"flysim: {report['failed'][0]}"
    way = report["whereabouts"]
    assert way["located"]["ape_m"] < 0.5 * way["odometry"]["ape_m"] and len(way["stops"]) == len(report["stops"]) == 7


def test_an_engine_that_fails_at_every_stop_has_found_nothing_whatever_it_saw_on_the_way():
    plan = plan_of("flies").model_copy(update={"engine": f"{__name__}:AtEveryStop"})
    with pytest.raises(EngineError, match="nothing seen at"):
        run(plan, seed=1, renderer="tiny")


def test_belief_and_truth_are_apart(folder):
    true, odometry, flies = (poses(folder, name) for name in ("true", "odom", "flies"))
    np.testing.assert_array_equal(true[:, 0], odometry[:, 0])
    np.testing.assert_array_equal(true[:, 0], flies[:, 0])
    np.testing.assert_allclose(true[0], odometry[0], atol=1e-6)
    assert np.hypot(*(odometry - true)[-1, 1:3]) > 5.0 * np.hypot(*(flies - true)[-1, 1:3])


def test_a_drive_is_the_same_for_every_engine_and_the_same_again():
    plan = plan_of("flies").model_copy(update={"stops": plan_of("flies").stops[:2]})
    frames, truth = driven(plan, seed=1, renderer="tiny")
    again, _ = driven(plan, seed=1, renderer="tiny")
    for one, other, stop in zip(frames.frames(), again.frames(), truth.stops, strict=True):
        np.testing.assert_array_equal(one.T_world_base, other.T_world_base)
        np.testing.assert_array_equal(one.T_world_base, stop.odometry.matrix)  # odometry stays what it is
    findings = see(frames, "flies", plan.flies, plan.obstacles, seed=1, localisation="flies")
    assert findings.located is not None
    for k, seen in enumerate(findings.seen):
        np.testing.assert_allclose(seen.frame.T_world_base[:2, 3], findings.located.poses[k, :2], atol=1e-9)


def test_what_is_no_localisation_is_refused():
    with pytest.raises(ScenarioError, match=r"no localisation 'flie'\. Did you mean 'flies'"):
        read_scenario("paper_a", ['localisation="flie"'])
    with pytest.raises(ScenarioError, match=r"odometry.*distance_stdd"):
        read_scenario("paper_a", ["odometry.distance_stdd=1"])
    with pytest.raises(EngineError, match="is no class with add"):
        localiser_named("types:SimpleNamespace", 0)
