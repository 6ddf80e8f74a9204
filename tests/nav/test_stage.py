"""Who draws is chosen before anything is built, and whoever draws, the simulation that is driven stays the one."""

import os
import subprocess
import sys
import threading

import moderngl
import numpy as np
import pytest

from flysim.errors import FlysimError, RendererError
from flysim.nav.env import FlyNavEnv
from flysim.render import gl_context, gl_world, shading
from flysim.render.choose import gl_works

AHEAD = np.array([0.6, 0.1], np.float32)


@pytest.fixture
def no_context(monkeypatch):
    def refuse(*_args, **_more):
        raise OSError("no driver")

    monkeypatch.setattr(gl_context.moderngl, "create_context", refuse)
    gl_works.cache_clear()
    yield
    gl_works.cache_clear()


@pytest.fixture
def refused(monkeypatch):
    monkeypatch.setattr(shading, "FRAGMENT", "#version 330\nnonsense\n")


def pictures(env, steps=3):
    """Of an episode: each step's images."""
    found = [env.reset(seed=4)[0]]
    found += [env.step(AHEAD)[0] for _ in range(steps)]
    return np.stack([np.stack([one["left"], one["right"]]) for one in found])


@pytest.mark.parametrize("reason", ["no_context", "refused"])
@pytest.mark.parametrize("where", ["room", "random-easy"])
def test_auto_drives_on_by_tiny(make, world, request, reason, where):
    settings = {"world": world if where == "room" else where, "observation": "pixels"}
    expected = pictures(make(renderer="tiny", **settings))
    request.getfixturevalue(reason)
    env = make(**settings)
    for _ in range(2):
        np.testing.assert_array_equal(pictures(env), expected)
        assert env.unwrapped.stage.studio.drawn_by == "tiny"
    assert np.ptp(expected) > 50


def test_a_random_world_that_the_driver_refuses_is_drawn_by_tiny_and_the_next_one_by_gl(make, monkeypatch):
    if not gl_works():
        pytest.skip("no OpenGL context opens here")

    def refuse(*_):
        raise moderngl.Error("too large")

    settings = {"world": "random-easy", "observation": "pixels"}
    expected = pictures(make(**settings))
    env = make(**settings)
    for _ in range(2):
        env.reset(seed=1)
        assert env.unwrapped.stage.studio.drawn_by == "gl"
        with monkeypatch.context() as for_now:
            for_now.setattr(gl_world.GlWorld, "_texture", refuse)
            env.reset(seed=2)
            env.step(AHEAD)
            assert env.unwrapped.stage.studio.drawn_by == "tiny"
    np.testing.assert_array_equal(pictures(env), expected)  # nothing is left of the worlds before


@pytest.mark.parametrize("reason", ["no_context", "refused"])
def test_gl_is_gl_or_one_line(make, request, reason):
    request.getfixturevalue(reason)
    env = make(observation="pixels", renderer="gl")
    with pytest.raises(RendererError, match="OpenGL") as caught:
        env.reset(seed=0)
    assert str(caught.value).isprintable()


def test_who_does_not_look_opens_nothing(make, monkeypatch):
    def refuse(*_args, **_more):
        raise AssertionError("nobody looks")

    monkeypatch.setattr(gl_context.moderngl, "create_context", refuse)
    env = make(observation="truth")
    env.reset(seed=0)
    env.step(AHEAD)
    with pytest.raises(FlysimError, match='render_mode="rgb_array"'):
        env.unwrapped.seen()


def test_the_command_drives_without_a_driver(world):
    done = subprocess.run(
        [
            *(sys.executable, "-m", "flysim", "nav", "straight", "--worlds", world, "--episodes", "1"),
            *("--observation", "sgbm", "--texture", "speckle", "--json"),
        ],
        capture_output=True,
        text=True,
        env={**os.environ, "__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent"},
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert '"episodes": 1' in done.stdout


def test_pictures_are_the_same_in_whatever_thread_they_are_drawn(world):
    alone, found = {}, {}

    def drive(env, seed):
        found[seed] = [env.reset(seed=seed)[0]["left"], *(env.step(AHEAD)[0]["left"] for _ in range(4))]

    def in_thread(*work):
        threads = [threading.Thread(target=one, args=more, daemon=True) for one, *more in work]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60.0)
        assert not any(thread.is_alive() for thread in threads)

    envs = [FlyNavEnv(world=world, observation="pixels", texture="speckle") for _ in range(3)]
    try:
        for seed in range(3):
            drive(envs[0], seed)
        alone.update(found)
        found.clear()
        in_thread(*((drive, env, seed) for seed, env in enumerate(envs)))  # the first one's context is this thread's
        for seed, images in alone.items():
            np.testing.assert_array_equal(found[seed], images)
        in_thread((envs[1].close,))
        drive(envs[2], 2)
        np.testing.assert_array_equal(found[2], alone[2])
    finally:
        for env in envs:
            env.close()
