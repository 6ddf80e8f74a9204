"""Agents are scored over the same episodes, and the command line shows it."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from flysim.cli.app import app
from flysim.common.runner import runner
from flysim.common.statistics import share_ci95
from flysim.errors import FlysimError
from flysim.nav import trial
from flysim.nav.agents.agent import RobotLimits
from flysim.nav.agents.choose import AGENTS, make_agent
from flysim.nav.agents.surroundings import RANGE, SECTORS
from flysim.nav.agents.vfh import free_run
from flysim.nav.episode import Episode, summary
from flysim.nav.scores import barn_score, soft_spl, spl
from flysim.nav.trial import Task, drive, drive_all, tasks_for
from flysim.nav.worlds import barn_length, barn_worlds

BARN = Path(__file__).resolve().parents[3] / "shared/data/barn"
BODY = RobotLimits(radius=0.19, v_max=0.5, w_max=1.5, period=0.1)


def task(agent, world, **more):
    settings = {"world": world, "texture": "speckle", "observation": "truth", "start": (0.0, 0.0, 0.0)}
    return Task(agent=agent, world="room", seed=1, settings={**settings, "goal": (3.5, 0.0), **more})


@pytest.mark.parametrize("agent", ["vfh", "dwa", "warning"])
def test_who_looks_gets_round_the_box_that_stops_who_does_not(world, agent):
    blind, sees = drive(task("straight", world)), drive(task(agent, world))
    assert (blind.success, blind.collision, blind.hit) == (False, True, "ahead")
    assert (sees.success, sees.collision, sees.timed_out) == (True, False, False)
    assert sees.spl > 0.8
    assert sees.clearance > 0.0
    assert sees.recoveries == blind.recoveries == 0


def test_flies_are_enough_to_get_round_it(world):
    episode = drive(task("vfh", world, observation="flies"))
    assert episode.success
    assert episode.spl > 0.8


def test_every_agent_keeps_to_the_action_space():
    rng = np.random.default_rng(0)
    for name in AGENTS.builtin:
        agent = make_agent(name, BODY)
        agent.begin(rng)
        for _ in range(5):
            observation = {
                "obstacles": rng.uniform(0.2, RANGE, SECTORS).astype(np.float32),
                "goal": np.array([rng.uniform(0.1, 20.0), rng.uniform(-math.pi, math.pi)], np.float32),
                "velocity": np.array([0.2, 0.1], np.float32),
            }
            v, w = agent.act(observation)
            assert 0.0 <= v <= 1.0, name
            assert -1.0 <= w <= 1.0, name


def test_scores_by_hand():
    assert spl(True, 4.0, 5.0) == pytest.approx(0.8)
    assert spl(True, 4.0, 3.8) == 1.0  # a goal has a radius
    assert spl(False, 4.0, 4.0) == 0.0
    assert soft_spl(1.0, 4.0, 6.0) == pytest.approx(0.75 * 4.0 / 6.0)
    # 12 m are 6 s at 2 m/s: half the score up to 12 s, an eighth from 48 s on.
    assert [barn_score(True, t, 12.0) for t in (3.0, 12.0, 24.0, 99.0)] == [0.5, 0.5, 0.25, 0.125]
    assert barn_score(False, 12.0, 12.0) == 0.0


def test_no_interval_leaves_what_a_score_can_be():
    def episode(k, success, score):
        return Episode(
            agent="a", world="w", seed=k, success=success, collision=not success, timed_out=False, spl=score,
            soft_spl=score, barn=score / 2.0, clearance=0.1 * k, path_length=1.0, shortest=1.0, time=1.0, hit="",
            steps=1, steps_per_second=90.0 if k else 1.0,
        )  # fmt: skip

    for scores in ((0.99, 0.98, 1.0, 0.0, 0.97, 1.0), (0.0, 0.0, 0.0, 0.9), (1.0, 1.0), (0.3,)):
        found = summary([episode(k, score > 0.0, score) for k, score in enumerate(scores)])
        for key, most in {"success": 1, "collision": 1, "time_out": 1, "spl": 1, "soft_spl": 1, "barn": 0.5}.items():
            low, high = found[f"{key}_ci95"]
            assert 0.0 <= low <= found[key] <= high <= most, key
        assert found["steps_per_second_ci95"] is None or found["steps_per_second_ci95"][0] >= 0.0
        assert found["spl"] == pytest.approx(np.mean(scores))
        assert found["barn"] == pytest.approx(np.mean(scores) / 2.0)
        assert found["barn_ci95"] == pytest.approx([end / 2.0 for end in found["spl_ci95"]])
    assert found["clearance_ci95"] is None  # one episode tells nothing of that


def test_a_circle_runs_until_it_touches():
    points = np.array([[1.0, 0.0], [0.0, 0.3]])
    run = free_run(points, np.array([0.0, math.pi / 2.0, math.pi]), 0.2, 1.5)
    assert run == pytest.approx([0.8, 0.1, 1.5])


def test_processes_share_the_work_and_change_nothing(world):
    tasks = [task(name, world) for name in ("straight", "vfh")]
    alone, together = drive_all(tasks), drive_all(tasks, run=runner(2))
    for one, other in zip(alone, together, strict=True):
        assert (one.agent, one.path_length, one.time) == (other.agent, other.path_length, other.time)
    assert summary(alone[:1])["success"] == 0.0
    assert summary(alone[1:])["success_ci95"] == pytest.approx(list(share_ci95(1.0, 1)))


def test_the_command_prints_one_json_object(world, tmp_path):
    result = CliRunner().invoke(
        app,
        [
            "nav",
            "straight",
            "--worlds",
            world,
            "--episodes",
            "2",
            "--processes",
            "1",
            "--observation",
            "truth",
            "--json",
        ],
    )
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    (agent,) = data["agents"]
    assert agent["agent"] == "straight"
    assert agent["episodes"] == len(data["episodes"]) == 2
    for key in ("success", "spl", "soft_spl", "collision", "time_out", "clearance", "barn", "steps_per_second"):
        assert key in agent
        assert f"{key}_ci95" in agent
    arguments = ["nav", "straight", "--worlds", world, "--processes", "1", "--observation", "truth"]
    table = CliRunner().invoke(app, [*arguments, "--picture", str(tmp_path / "scores.png")])
    assert (tmp_path / "scores.png").read_bytes().startswith(b"\x89PNG")
    assert "SPL" in table.stdout
    assert "straight" in table.stdout


def test_episodes_that_were_driven_are_kept_and_not_driven_again(world, tmp_path, monkeypatch):
    arguments = ["nav", "straight", "--worlds", world, "--episodes", "3", "--processes", "1", "--observation", "truth"]
    out, drive_one, driven = tmp_path / "out", trial.drive, []

    def drive_two(one):
        if len(driven) == 2:
            raise KeyboardInterrupt
        driven.append(one.seed)
        return drive_one(one)

    monkeypatch.setattr(trial, "drive", drive_two)
    stopped = CliRunner().invoke(app, [*arguments, "--out", str(out)])
    assert stopped.exit_code == 130
    data = json.loads((out / "nav.json").read_text())
    assert (data["complete"], data["done"], data["of"], len(data["episodes"])) == (False, 2, 3, 2)
    refused = CliRunner().invoke(app, [*arguments, "--out", str(out)])
    assert (refused.exit_code, "go on with it by --resume" in refused.stderr) == (2, True)
    other = CliRunner().invoke(app, [*arguments, "--out", str(out), "--resume", "--seed", "5"])
    assert (other.exit_code, "begun with seed 0, not 5" in other.stderr) == (2, True)
    driven.clear()
    done = CliRunner().invoke(app, [*arguments, "--out", str(out), "--resume", "--json"])
    assert (done.exit_code, driven) == (0, [2])
    whole = json.loads((out / "nav.json").read_text())
    assert whole["complete"] and [episode["seed"] for episode in whole["episodes"]] == [0, 1, 2]
    assert json.loads(done.stdout).items() <= whole.items()
    assert sorted(path.name for path in out.iterdir()) == ["episodes.parquet", "nav.json"]
    assert CliRunner().invoke(app, [*arguments, "--resume"]).exit_code == 2


def test_what_goes_wrong_in_a_process_is_told_here(world):
    tasks = [task("straight", world, goal=(99.0, 0.0)), task("straight", world, goal=(98.0, 0.0))]
    with pytest.raises(ValueError, match=r"goal .* is taken") as error:
        drive_all(tasks, run=runner(2))
    assert "in drive" in error.value.__notes__[0]


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (["vhf"], "Did you mean 'vfh'"),
        (["vfh", "--worlds", "yrad"], "Did you mean 'yard'"),
        (["vfh", "--observation", "fly"], "Did you mean 'flies'"),
        (["vfh", "--worlds", "barn", "--barn", "nowhere"], "no BARN worlds"),
        (["vfh", "--picture", "nowhere/scores.png"], "no folder nowhere"),
        (["mine.npz"], "no policy file"),
    ],
)
def test_mistakes_are_one_line(arguments, what):
    result = CliRunner().invoke(app, ["nav", *arguments])
    assert result.exit_code == 2
    assert what in result.stderr
    assert result.stderr.count("\n") == 1


def test_an_unknown_agent_is_refused_before_anything_is_driven():
    with pytest.raises(FlysimError, match="no agent 'vhf'"):
        tasks_for(["vhf"], "yard", episodes=1, observation="truth")


def test_barn_paths_are_as_long_as_the_notes_say(tmp_path):
    assert barn_length(np.array([[15, 0], [15, 10]])) == pytest.approx(
        math.hypot(0.075, 2.075) + 1.5 + math.hypot(0.075, 6.425)
    )
    if not BARN.is_dir():
        pytest.skip("the BARN worlds are not here")
    worlds = barn_worlds(BARN)
    assert len(worlds) == 30
    assert all(10.3 < one.length < 13.7 for one in worlds)
