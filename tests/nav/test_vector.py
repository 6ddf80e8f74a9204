"""Many environments at once, as gymnasium makes them."""

import os
import signal
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv

import flysim.nav
from flysim.render.choose import gl_works

STILL = np.zeros((2, 2), np.float32)


class Maker:
    """What a spawned worker can be sent: it makes the same environment there."""

    def __init__(self, world, **more):
        self.arguments = {"world": world, "texture": "speckle", "time_limit": 0.3, **more}

    def __call__(self):
        flysim.nav.register_envs()
        return gym.make("flysim/FlyNav-v0", **self.arguments)


def rollout(envs):
    with_obstacles = [envs.reset(seed=3)[0]["obstacles"]]
    ends = []
    for _ in range(6):
        observation, _, terminated, truncated, _ = envs.step(STILL)
        with_obstacles.append(observation["obstacles"])
        ends.append((terminated | truncated).tolist())
    return np.stack(with_obstacles), ends


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_vectors_of_both_kinds_agree(world, mode):
    makers = [Maker(world), Maker(world)]
    sync = SyncVectorEnv(makers, autoreset_mode=mode)
    apart = AsyncVectorEnv(makers, autoreset_mode=mode, context="spawn", shared_memory=True)
    try:
        (a, ends), (b, others) = rollout(sync), rollout(apart)
    finally:
        sync.close()
        apart.close()
    np.testing.assert_array_equal(a, b)
    assert ends == others
    assert ends[:3] == [[False, False], [False, False], [True, True]]  # the third step is the end: 0.3 s
    # With NEXT_STEP the fourth call only resets, and the third step of the next episode comes one later.
    assert ends[5] == ([False, False] if mode == AutoresetMode.NEXT_STEP else [True, True])


def test_a_killed_worker_is_an_error_and_no_wait(world):
    envs = AsyncVectorEnv([Maker(world), Maker(world)], context="spawn")
    try:
        envs.reset(seed=0)
        os.kill(envs.processes[0].pid, signal.SIGKILL)
        envs.processes[0].join(10)
        with pytest.raises((EOFError, BrokenPipeError, ConnectionResetError)):
            envs.step(STILL)
    finally:
        envs.close(terminate=True)


@pytest.mark.parametrize("drawn", [False, True])
def test_a_fork_works_before_the_first_picture_and_says_what_to_do_after_it(world, drawn):
    code = f"""
import gymnasium, numpy
from flysim.nav.env import FlyNavEnv

def make():
    return FlyNavEnv(world={world!r}, texture="speckle", observation="pixels")

if {drawn}:
    first = make()
    first.reset(seed=1)
    first.close()
envs = gymnasium.vector.AsyncVectorEnv([make, make], context="fork")
try:
    envs.reset_async(seed=1)
    envs.reset_wait(timeout=30)
    print("steps")
except Exception as error:
    print(type(error).__name__, error)
finally:
    envs.close()
print("closed")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, env=os.environ)
    assert done.returncode == 0, done.stderr
    said, end = done.stdout.splitlines()
    assert end == "closed"
    if not drawn or not gl_works():
        assert said == "steps"
    else:
        assert said.startswith("FlysimError this process was forked") and 'context="spawn"' in said
