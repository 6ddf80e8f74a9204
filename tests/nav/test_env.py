"""The environment keeps what gymnasium's users count on, and says what is wrong as they expect it."""

import copy
import os
import pickle
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

import cloudpickle
import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError, InvalidAction, ResetNeeded
from gymnasium.utils.env_checker import check_env

from flysim.errors import FlysimError, WorldError
from flysim.nav.env import FlyNavEnv
from flysim.render.tiny import TinyRenderer

AHEAD, STILL = np.array([1.0, 0.0], np.float32), np.zeros(2, np.float32)
START, BEYOND = (0.0, 0.0, 0.0), (3.5, 0.0)
FREE = (0.0, -1.5)


def drive(env, seed, steps):
    """Every number of a rollout."""
    observation, info = env.reset(seed=seed)
    env.action_space.seed(seed)
    found = [observation, info]
    for _ in range(steps):
        observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
        found += [observation, reward, terminated, truncated, info]
        if terminated or truncated:
            found += env.reset()
    return found


def same(a, b):
    if isinstance(a, dict):
        assert a.keys() == b.keys()
        for key in a:
            same(a[key], b[key])
    else:
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("observation", ["flies", "pixels", "truth", "sgbm"])
@pytest.mark.parametrize("actions", ["continuous", "discrete"])
def test_gymnasium_s_checker_has_nothing_to_say(make, observation, actions):
    env = make(observation=observation, actions=actions)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)


def test_twins_do_the_same_for_fifty_steps(make):
    a, b = drive(make(), 7, 50), drive(make(), 7, 50)
    assert len(a) == len(b)
    for one, other in zip(a, b, strict=True):
        same(one, other)


def test_an_episode_does_not_depend_on_those_before_it(make):
    used, new = make(), make()
    drive(used, 1, 5)
    for one, other in zip(drive(used, 2, 10), drive(new, 2, 10), strict=True):
        same(one, other)


def test_a_random_world_lasts_as_many_episodes_as_asked_for():
    env = FlyNavEnv(world="random-easy", observation="truth", episodes_per_world=2)
    try:
        worlds, starts = [], []
        for seed in (4, None, None, 4):
            env.reset(seed=seed)
            worlds.append(env.stage.world.name)
            starts.append(env.course.start)
    finally:
        env.close()
    assert worlds[0] == worlds[1] == worlds[3] != worlds[2]
    assert starts[0] == starts[3] != starts[1]


def test_straight_into_a_box_ends_the_episode(make):
    env = make(start=START, goal=BEYOND)
    observation, info = env.reset(seed=0)
    assert observation["obstacles"][35:37].min() == pytest.approx(1.8, abs=0.1)  # what the flies see of it
    assert info["clearance"] == pytest.approx(1.8 - env.unwrapped._robot.radius, abs=0.01)
    assert 3.5 < info["shortest"] < 3.9
    rewards, way = [], info["distance"]
    for _ in range(80):
        observation, reward, terminated, truncated, info = env.step(AHEAD)
        rewards.append(reward)
        if terminated:
            break
    assert terminated
    assert not truncated
    assert (info["hit"], info["collisions"], info["success"], info["spl"]) == ("ahead", 1, False, 0.0)
    assert info["clearance"] < 0.1
    # It touches with its front, 0.12 m before its axis.
    assert info["path_length"] == pytest.approx(1.8 - 0.12, abs=0.06)
    assert rewards[-1] < -9.0
    # The formula of the docstring: progress, time and the collision.
    assert sum(rewards) == pytest.approx(way - info["distance"] - 0.01 * len(rewards) - 10.0, abs=0.05)
    with pytest.raises(ResetNeeded):
        env.unwrapped.step(AHEAD)


def test_reaching_the_goal_is_success(make):
    env = make(start=START, goal=(1.2, 0.0), observation="truth")
    env.reset(seed=0)
    for _ in range(80):
        *_, reward, terminated, truncated, info = env.step(AHEAD)
        if terminated:
            break
    assert (terminated, truncated, info["success"], info["collisions"]) == (True, False, True, 0)
    assert info["path_length"] == pytest.approx(0.9, abs=0.06)
    assert info["spl"] == info["soft_spl"] == 1.0
    assert reward > 9.0


def test_out_of_time_is_truncation(make):
    env = make(start=START, goal=BEYOND, time_limit=0.5, observation="truth")
    env.reset(seed=0)
    ends = [env.step(STILL)[2:4] for _ in range(5)]
    assert ends == [(False, False)] * 4 + [(False, True)]


def test_flies_tell_what_the_truth_tells(make):
    by_flies, exact = (make(observation=kind, start=START, goal=BEYOND) for kind in ("flies", "truth"))
    a, b = by_flies.reset(seed=3)[0], exact.reset(seed=3)[0]
    for _ in range(10):
        a, b = by_flies.step(STILL)[0], exact.step(STILL)[0]
    seen = (a["obstacles"] < 5.0) & (b["obstacles"] < 5.0)
    assert seen[34:38].all()  # the box ahead, 18 degrees wide
    assert np.abs(a["obstacles"] - b["obstacles"])[seen].max() < 0.12
    top = a["flies"][np.abs(a["flies"]).sum(axis=1) > 0.0]
    assert len(top) > 20
    assert top[:, 2].min() > 0.05  # none of the floor


def test_what_was_seen_is_remembered_behind_the_robot(make):
    env = make(start=(0.8, 0.0, 0.0), goal=BEYOND, memory=20.0)
    env.reset(seed=0)
    for _ in range(30):
        observation = env.step(np.array([0.0, 1.0], np.float32))[0]
        if abs(observation["goal"][1]) > 2.6:
            break
    behind = np.r_[observation["obstacles"][:8], observation["obstacles"][-8:]]
    assert behind.min() == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("action", [[np.nan, 0.0], [1.1, 0.0], [0.1, -2.0], [-0.1, 0.0], [0.1], "left", None])
def test_a_bad_action_is_an_invalid_action(make, action):
    env = make(observation="truth").unwrapped
    env.reset(seed=0)
    with pytest.raises(InvalidAction, match="got"):
        env.step(action)
    env.step(STILL)  # and nothing has happened


@pytest.mark.parametrize("action", [8, -1, 1.5, np.nan])
def test_a_bad_discrete_action_is_an_invalid_action(make, action):
    env = make(observation="truth", actions="discrete").unwrapped
    env.reset(seed=0)
    with pytest.raises(InvalidAction):
        env.step(action)


def test_step_comes_after_reset(make):
    env = make(observation="truth")
    with pytest.raises(ResetNeeded):
        env.step(STILL)
    with pytest.raises(ResetNeeded):
        env.unwrapped.step(STILL)


def test_a_goal_inside_an_obstacle_is_refused(make):
    env = make(observation="truth")
    with pytest.raises(ValueError, match=r"goal \(2, 0\) is taken"):
        env.reset(seed=0, options={"goal": (2.0, 0.0)})
    with pytest.raises(ValueError, match=r"start \(2, 0\) is taken"):
        env.reset(seed=0, options={"start": (2.0, 0.0, 0.0)})
    with pytest.raises(ResetNeeded):
        env.unwrapped.step(STILL)
    env.reset(seed=0)


@pytest.mark.parametrize(
    ("arguments", "error", "what"),
    [
        ({"world": "yrad"}, WorldError, "Did you mean 'yard'"),
        ({"world": "random-medum"}, WorldError, "Did you mean 'medium'"),
        ({"observation": "fly"}, ValueError, "no observation 'fly'"),
        ({"actions": "both"}, ValueError, "no actions"),
        ({"v_max": 0.0}, ValueError, "v_max must be"),
        ({"time_limit": float("nan")}, ValueError, "time_limit must be"),
        ({"size": (8, 8)}, ValueError, "size must be"),
        ({"robot": "rovr"}, FlysimError, "Did you mean 'rover'"),
    ],
)
def test_nonsense_is_refused_at_birth(world, arguments, error, what):
    with pytest.raises(error, match=what):
        FlyNavEnv(**{"world": world, **arguments})


@pytest.mark.parametrize("options", [{"start": (0.0, 0.0)}, {"goal": (0.0, np.nan)}, {"gaol": (1.0, 1.0)}])
def test_bad_options_are_refused(make, options):
    with pytest.raises(ValueError, match=r"must be|may hold"):
        make(observation="truth").reset(options=options)


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, pickle.dumps, cloudpickle.dumps])
def test_a_copy_is_refused_and_a_second_one_is_made_by_its_spec(make, copied):
    env = make(observation="pixels")
    env.reset(seed=0)
    stage = env.unwrapped.stage
    with pytest.raises(TypeError, match=r"a FlyNavEnv cannot be copied or pickled: .* env.spec.make\(\)"):
        copied(env.unwrapped)
    for one in filter(None, (stage.simulation, stage.studio._quick, TinyRenderer(stage.simulation))):
        with pytest.raises(TypeError, match="make another one"):
            copied(one)
    env.step(STILL)
    other = copy.deepcopy(env.spec).make()
    same(other.reset(seed=3)[0], env.reset(seed=3)[0])
    other.close()
    env.step(STILL)


def test_close_frees_the_client(make):
    import pybullet

    env = make().unwrapped
    env.reset(seed=0)
    client = env._stage.simulation.client
    assert pybullet.isConnected(client)
    env.close()
    env.close()
    assert not pybullet.isConnected(client)
    for call in (env.reset, lambda: env.step(STILL)):
        with pytest.raises(ClosedEnvironmentError):
            call()


def test_environments_do_not_disturb_each_other(make, world):
    alone = drive(make(), 5, 8)
    mixed = make()
    others = [make(renderer="tiny"), make(world="paper", texture=None), make(observation="sgbm")]
    observation, info = mixed.reset(seed=5)
    mixed.action_space.seed(5)
    found = [observation, info]
    for other in others:
        other.reset(seed=1)
    for _ in range(8):
        found += mixed.step(mixed.action_space.sample())
        for other in others:
            other.step(STILL)
    for one, other in zip(alone, found, strict=True):
        same(one, other)


def test_a_picture_shows_the_eye_beside_a_map(make):
    env = make(render_mode="rgb_array", start=START, goal=BEYOND)
    with pytest.raises(ResetNeeded):
        env.unwrapped.render()
    env.reset(seed=0)
    for _ in range(5):
        env.step(AHEAD)
    picture = env.render()
    assert picture.dtype == np.uint8
    assert picture.shape == (360, 480 + 360, 3)
    orange = (picture[:, 480:] == (220, 70, 30)).all(axis=2)
    assert orange.sum() > 50  # flies on the map
    # They are ahead of the robot, which stands in the middle and looks to the right.
    assert np.nonzero(orange)[1].mean() > 180 + 20


def test_rerun_gets_every_step(make, tmp_path):
    import rerun

    rerun.init("test", spawn=False)
    rerun.save(tmp_path / "live.rrd")
    env = make(render_mode="rerun", start=START, goal=BEYOND)
    env.reset(seed=0)
    env.step(AHEAD)
    rerun.disconnect()
    assert (tmp_path / "live.rrd").stat().st_size > 10_000


def test_the_checker_passes_in_every_mode_without_a_viewer_on_the_path_or_a_screen(tmp_path, world):
    code = (
        "import gymnasium, flysim\n"
        "from gymnasium.utils.env_checker import check_env\n"
        f"env = gymnasium.make('flysim/FlyNav-v0', world={world!r}, observation='truth', texture='speckle')\n"
        "check_env(env.unwrapped)\n"
        "env.close()"
    )
    bare = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True, text=True, cwd=tmp_path, env={**bare, "PATH": "/usr/bin:/bin"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("WARN") == 1, done.stderr
    assert "shows nothing: there is no screen" in done.stderr


def test_memory_stays_where_it_is(world, tmp_path):
    assert growth(tmp_path, 40, world=world, texture="speckle") < 0.05


def test_a_world_s_pictures_go_with_it():
    """moderngl keeps 40 kB of each context that is closed: one serves all worlds."""
    env = FlyNavEnv(world="random-easy", observation="pixels")
    try:
        opened, held = set(), []
        for seed in range(3):
            env.reset(seed=seed)
            if env.stage.studio._quick is None:
                pytest.skip("no OpenGL context opens here")
            opened.add(id(env.stage.studio._quick._context))
            held.append(env.stage.studio._quick._world._held)
    finally:
        env.close()
    assert len(opened) == 1
    assert [bool(some) for some in held[:-1]] == [False, False]  # what a world held on the graphics card is freed


@pytest.mark.endurance
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("world", ["yard", "random-medium"])
@pytest.mark.parametrize("observation", ["flies", "pixels", "truth"])
def test_memory_stays_where_it_is_for_a_thousand_episodes(tmp_path, world, observation):
    assert growth(tmp_path, 1000, world=world, observation=observation) < 0.05


def growth(tmp_path, resets, **settings):
    """How much larger a process is after so many resets than after the first tenth of them.

    Its files and threads stay as many, and its temporary folder is left empty.
    """
    code = f"""
import gymnasium, numpy, psutil, flysim.nav
env = gymnasium.make("flysim/FlyNav-v0", **{settings!r})
def drive(n):
    for k in range(n):
        env.reset(seed=k)
        env.step(numpy.array([0.3, 0.1], numpy.float32))
    me = psutil.Process()
    return me.memory_info().rss, me.num_fds(), me.num_threads()
a, *first = drive({max(10, resets // 10)})
b, *last = drive({resets})
assert first == last, (first, last)
env.close()
print(b / a - 1.0)
"""
    folder = tempfile.mkdtemp(dir=tmp_path)
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, "TMPDIR": folder}
    )
    assert done.returncode == 0, done.stderr
    assert list(Path(folder).iterdir()) == []
    return float(done.stdout)
