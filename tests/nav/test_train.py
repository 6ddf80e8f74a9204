"""A policy is trained by the real stable-baselines3, kept, resumed, and drives without it."""

import json
import multiprocessing
import shutil
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from flysim.cli.app import app
from flysim.errors import FlysimError
from flysim.nav.agents.agent import RobotLimits
from flysim.nav.agents.choose import make_agent
from flysim.nav.agents.policy import FEATURES, Policy, PolicyAgent, corrected, features, load_policy
from flysim.nav.agents.surroundings import SECTORS
from flysim.nav.training.folder import begun
from flysim.nav.training.train import PolicyView, TrainingTask, policy_of, train

BODY = RobotLimits(radius=0.2, v_max=0.5, w_max=1.5, period=0.1)
OPEN = {"obstacles": np.full(SECTORS, 5.0, np.float32), "velocity": np.zeros(2, np.float32)}


def seen(bearing, **more):
    return {**OPEN, "goal": np.array([2.0, bearing], np.float32), **more}


def policy(seed=0, scale=0.3):
    rng = np.random.default_rng(seed)
    sizes = ((16, FEATURES), (2, 16))
    return Policy(
        weights=tuple(rng.normal(0.0, scale, size).astype(np.float32) for size in sizes),
        biases=tuple(np.zeros(size[0], np.float32) for size in sizes),
    )


def test_features_tell_where_things_and_the_goal_are():
    wall = np.full(SECTORS, 5.0, np.float32)
    wall[36:38] = 0.7  # ahead, 0.5 m from the robot's circle
    shown = features(seen(0.5, obstacles=wall, velocity=np.array([0.25, -0.75], np.float32)), BODY)
    assert shown.shape == (FEATURES,)
    assert shown[18] == pytest.approx((1.0 - 0.5 / 3.0) ** 2, abs=1e-5)
    assert np.count_nonzero(shown[:36]) == 1
    np.testing.assert_allclose(shown[36:], [np.exp(-1.0), np.cos(0.5), np.sin(0.5), 0.5, -0.5], atol=1e-5)


def test_without_a_correction_it_drives_as_straight_does():
    straight = make_agent("straight", BODY)
    for bearing in (-2.0, -0.4, 0.0, 1.0):
        np.testing.assert_allclose(corrected(seen(bearing), BODY, np.zeros(2)), straight.act(seen(bearing)), atol=1e-6)
    # and a correction goes as far as the action space does
    assert corrected(seen(1.0), BODY, np.array([0.0, -1.0])).tolist()[1] == -1.0
    assert corrected(seen(0.0), BODY, np.array([-1.0, 9.0])).tolist() == [0.0, 1.0]


def test_a_policy_outlives_its_file(tmp_path):
    first = policy()
    first.save(tmp_path / "policy.npz")
    again = load_policy(tmp_path / "policy.npz")
    shown = np.random.default_rng(1).normal(size=FEATURES).astype(np.float32)
    np.testing.assert_array_equal(first(shown), again(shown))
    assert [path.name for path in tmp_path.iterdir()] == ["policy.npz"]


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (lambda p: replace(p, biases=(p.biases[0], np.zeros(3, np.float32))), "do not fit"),
        (lambda p: replace(p, weights=(p.weights[0][:, 1:], p.weights[1])), "do not fit"),
        (lambda p: replace(p, weights=(p.weights[0] * np.nan, p.weights[1])), "not finite"),
        (lambda p: Policy(weights=p.weights[:1], biases=p.biases[:1]), "gives 16 numbers"),
    ],
)
def test_a_policy_that_cannot_drive_is_refused(tmp_path, change, what):
    change(policy()).save(tmp_path / "policy.npz")
    with pytest.raises(FlysimError, match=what):
        load_policy(tmp_path / "policy.npz")


def test_a_file_that_is_no_policy_is_refused(tmp_path):
    path = tmp_path / "policy.npz"
    with pytest.raises(FlysimError, match="no policy file"):
        load_policy(path)
    path.write_text("hello")
    with pytest.raises(FlysimError, match=r"policy.npz: cannot read the policy: "):
        load_policy(path)
    np.savez_compressed(path, about=np.zeros(1 << 24, np.uint8))  # small on the disk, large in memory
    with pytest.raises(FlysimError, match="unpacks to more than"):
        load_policy(path)
    np.savez(path, about=np.array([{}], object))  # a pickle
    with pytest.raises(FlysimError, match="not that of an array of numbers"):
        load_policy(path)
    about = np.frombuffer(b'{"format": 1, "layers": 1}', np.uint8)
    for weight in (np.full((2, FEATURES), 1e30), np.full((2, FEATURES), np.nan), np.ones((2, FEATURES), int)):
        np.savez(path, about=about, weight_0=weight, bias_0=np.zeros(2))
        with pytest.raises(FlysimError, match=r"not finite or beyond|of another kind"):
            load_policy(path)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("[", "it is damaged at line 1"),
        ("[1]", "no training: "),
        ('{"tasks": [], "settings": {}, "steps": 1e999}', "larger than any number can be"),
        ('{"tasks": [], "settings": {}, "steps": -1}', "steps must be a number from 0"),
        ('{"tasks": 3, "settings": {}}', "tasks must be a list"),
        ('{"tasks": [], "settings": {}, "curve": [[1, 2, null, 4]]}', "curve must be rows of four numbers"),
        ('{"tasks": [], "settings": {}, "colour": 1}', "no training: "),
    ],
)
def test_a_damaged_training_is_not_gone_on_with(tmp_path, text, why):
    torch = pytest.importorskip("torch")
    torch.save({}, tmp_path / "checkpoint.pt")  # an older one, without the training in it
    (tmp_path / "training.json").write_text(text, encoding="utf-8")
    task = TrainingTask(worlds="yard", observation="truth", steps=9, minutes=None, processes=1, seed=0, renderer="tiny")
    with pytest.raises(FlysimError, match=why) as caught:
        begun(tmp_path, task)
    assert str(caught.value).startswith(f"{tmp_path}/training.json: ")


def test_the_shipped_policy_is_small_and_drives():
    from flysim.common.catalogue import find_policy

    assert find_policy("ppo").stat().st_size < 1 << 20
    assert isinstance(make_agent("ppo", BODY), PolicyAgent)


def test_no_torch_is_needed_to_drive(tmp_path):
    policy().save(tmp_path / "policy.npz")
    code = f"""
import sys
sys.modules["torch"] = sys.modules["stable_baselines3"] = None
from flysim.nav.agents.agent import RobotLimits
from flysim.nav.agents.choose import make_agent
make_agent({str(tmp_path / "policy.npz")!r}, RobotLimits(radius=0.2, v_max=0.5, w_max=1.5, period=0.1))
try:
    from pathlib import Path
    from flysim.nav.training.train import TrainingTask, train
    train(TrainingTask(worlds="yard", observation="truth", steps=1, minutes=None, processes=1, seed=0, renderer="auto"),
          Path({str(tmp_path / "out")!r}))
except Exception as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "pip install 'flysim-testbed[rl]'" in done.stdout
    assert not (tmp_path / "out").exists()


@pytest.fixture(scope="module")
def trained(world, tmp_path_factory):
    """A training of two rollouts, its folder and what was told on the way."""
    out, told = tmp_path_factory.mktemp("training") / "out", []
    task = TrainingTask(
        worlds=world, observation="truth", steps=512, minutes=None, processes=2, seed=3, renderer="auto"
    )
    return train(task, out, progress=lambda what, share: told.append((what, share))), out, told, task


def test_a_training_leaves_all_that_is_needed_to_go_on(trained):
    training, out, told, _ = trained
    assert {path.name for path in out.iterdir()} == {"policy.npz", "checkpoint.pt", "training.json", "tensorboard"}
    assert list((out / "tensorboard").rglob("events.*"))
    assert training.steps == 512
    assert training.episodes > 2
    shares = [share for _, share in told]
    assert shares == sorted(shares)
    assert shares[-1] <= 1.0
    kept = json.loads((out / "training.json").read_text())
    assert (kept["steps"], kept["tasks"][0]["seed"]) == (512, 3)


def test_a_training_can_be_resumed_on_other_eyes_and_not_begun_twice(trained):
    _, out, _, task = trained
    with pytest.raises(FlysimError, match="--resume"):
        train(task, out)
    with pytest.raises(FlysimError, match="raise --steps"):
        train(task, out, resume=True)
    before = load_policy(out / "policy.npz")
    more = train(replace(task, steps=1024), out, resume=True)
    assert more.steps == 1024
    assert [phase["from_step"] for phase in more.tasks] == [0, 512]
    assert not np.array_equal(before.weights[0], load_policy(out / "policy.npz").weights[0])
    with pytest.raises(FlysimError, match="no training to resume"):
        train(task, out.parent / "nowhere", resume=True)


def test_a_kill_between_the_files_leaves_a_training_that_resumes(trained, tmp_path):
    _, out, _, task = trained
    mixed = tmp_path / "mixed"
    shutil.copytree(out, mixed)
    old = json.loads((mixed / "training.json").read_text()) | {"steps": 17}
    (mixed / "training.json").write_text(json.dumps(old))
    steps = torch_load(out)["training.json"]
    with pytest.raises(FlysimError, match=f"has done its {json.loads(steps)['steps']} steps"):
        train(replace(task, steps=1), mixed, resume=True)
    (mixed / "checkpoint.pt").write_bytes(b"half")
    with pytest.raises(FlysimError, match=r"checkpoint.pt: not a checkpoint of this training"):
        train(task, mixed, resume=True)


def torch_load(out):
    import torch

    return torch.load(out / "checkpoint.pt", weights_only=True)


def test_a_training_that_is_stopped_leaves_one_that_resumes_or_nothing(world, tmp_path, monkeypatch):
    task = TrainingTask(
        worlds=world, observation="truth", steps=512, minutes=None, processes=1, seed=3, renderer="auto"
    )

    def stop(_what, share):
        if share >= after:
            raise KeyboardInterrupt

    after = 0.0
    with pytest.raises(KeyboardInterrupt):
        train(task, tmp_path / "deep" / "out", progress=stop)
    assert not list(tmp_path.iterdir()) and not multiprocessing.active_children()
    out = tmp_path / "out"
    (out / "tensorboard" / "ppo_1").mkdir(parents=True)  # what a kill leaves before the first rollout
    (out / ".policy.npz.0.flysim.part").touch()
    after = 0.6
    with pytest.raises(KeyboardInterrupt) as stopped:
        train(task, out, progress=stop)
    assert "--resume goes on" in stopped.value.__notes__[0]
    assert {path.name for path in out.iterdir()} == {"policy.npz", "checkpoint.pt", "training.json", "tensorboard"}
    assert json.loads((out / "training.json").read_text())["steps"] == 256
    assert json.loads(torch_load(out)["training.json"])["steps"] == 256
    with (
        pytest.raises(FlysimError, match="another training writes it"),
        monkeypatch.context() as patch,
    ):
        patch.setattr("flysim.nav.training.train._train", lambda *_: train(task, out, resume=True))
        train(task, out, resume=True)


def test_the_network_without_the_library_says_what_the_library_says(world):
    from stable_baselines3 import PPO

    from flysim.nav.env import FlyNavEnv

    env = PolicyView(FlyNavEnv(world=world, observation="truth"))
    try:
        model = PPO("MlpPolicy", env, device="cpu", n_steps=8, batch_size=8, seed=0)
        mine = policy_of(model)
        for shown in np.random.default_rng(0).uniform(-1.0, 1.0, (20, FEATURES)).astype(np.float32):
            theirs = model.predict(shown, deterministic=True)[0]
            np.testing.assert_allclose(np.clip(mine(shown), -1.0, 1.0), theirs, atol=1e-5)
    finally:
        env.close()


def test_the_policy_s_view_of_the_environment_is_sound(world):
    from stable_baselines3.common.env_checker import check_env

    from flysim.nav.env import FlyNavEnv

    env = PolicyView(FlyNavEnv(world=world, observation="truth"))
    check_env(env)
    env.close()


def test_the_command_trains_and_says_how_to_drive(world, tmp_path):
    arguments = ["train", "ppo", "--worlds", world, "--observation", "truth", "--steps", "256", "--processes", "1"]
    result = CliRunner().invoke(app, [*arguments, "--out", str(tmp_path / "mine")])
    assert result.exit_code == 0, result.output
    assert f"flysim nav {tmp_path / 'mine' / 'policy.npz'}" in result.output
    assert (tmp_path / "mine" / "curve.png").stat().st_size > 5000
    again = CliRunner().invoke(app, [*arguments, "--out", str(tmp_path / "mine")])
    assert again.exit_code == 2
    assert "--resume" in again.output
    assert CliRunner().invoke(app, ["train", "ppo", "--observation", "fly"]).exit_code == 2
