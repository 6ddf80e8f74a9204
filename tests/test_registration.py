"""gymnasium knows the environment once flysim is imported, in whatever order, and in workers."""

import os
import subprocess
import sys

import pytest

KEYS = "['goal', 'obstacles', 'velocity']\n"


def python(*arguments, folder):
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, cwd=folder, env=os.environ)


def test_a_new_process_makes_it_by_its_id(tmp_path):
    code = (
        "import flysim\nimport gymnasium as gym\n"
        "env = gym.make('flysim/FlyNav-v0', observation='truth')\n"
        "print(sorted(env.reset(seed=7)[0]))\n"
        "env.close()"
    )
    done = python("-W", "error", "-c", code, folder=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, KEYS, "")


@pytest.mark.parametrize(
    ("code", "name"),
    [
        ("import flysim, gymnasium; made = gymnasium.spec({!r})", "flysim/FlyNav-v0"),
        ("import gymnasium, flysim; made = gymnasium.spec({!r})", "flysim/FlyNav-v0"),
        ("import flysim.nav, gymnasium; made = gymnasium.spec({!r})", "flysim/FlyNav-v0"),
        # gymnasium's own way for who imports nothing; `spec` has it not, `make` and `make_vec` ask this.
        ("from gymnasium.envs.registration import _find_spec; made = _find_spec({!r})", "flysim:flysim/FlyNav-v0"),
    ],
    ids=["flysim-first", "gymnasium-first", "its-room", "by-the-id-alone"],
)
def test_it_is_known_in_any_order(tmp_path, code, name):
    done = python("-W", "error", "-c", f"{code.format(name)}; print(made.entry_point)", folder=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "flysim.nav.env:FlyNavEnv\n", "")


def test_vectors_make_it_in_spawned_workers(tmp_path):
    (tmp_path / "script.py").write_text(
        "import flysim\nimport gymnasium as gym\n"
        "if __name__ == '__main__':\n"
        "    spawn = {'context': 'spawn'}\n"
        "    by_id = gym.make_vec('flysim/FlyNav-v0', 1, 'async', spawn, observation='truth')\n"
        "    apart = gym.vector.AsyncVectorEnv([lambda: gym.make('flysim/FlyNav-v0', observation='truth')], **spawn)\n"
        "    together = gym.make_vec('flysim/FlyNav-v0', 1, 'sync', observation='truth')\n"
        "    for envs in (by_id, apart, together):\n"
        "        print(envs.reset(seed=1)[0]['goal'].tolist())\n"
        "        envs.close()\n",
        encoding="utf-8",
    )
    done = python("script.py", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    first, *others = done.stdout.splitlines()
    assert others == [first, first]


def test_it_is_said_once_and_nobody_waits_any_more(tmp_path):
    code = (
        "import importlib, sys, flysim\n"
        "importlib.reload(flysim)\n"
        "def waiting(): return [one for one in sys.meta_path if 'flysim' in type(one).__module__]\n"
        "print(len(waiting()), 'gymnasium' in sys.modules)\n"
        "import gymnasium\n"
        "print(len(waiting()), [name for name in gymnasium.registry if 'FlyNav' in name])\n"
        "importlib.reload(flysim)\n"
        "print(len(waiting()))"
    )
    done = python("-W", "error", "-c", code, folder=tmp_path)
    assert (done.stdout, done.stderr) == ("1 False\n0 ['flysim/FlyNav-v0']\n0\n", "")


def test_without_gymnasium_the_rest_works(tmp_path):
    (tmp_path / "gymnasium.py").write_text("raise ImportError('none here')", encoding="utf-8")
    code = (
        "import flysim\n"
        "try:\n    import gymnasium\n"
        "except ImportError as error:\n    print(error)\n"
        "print(flysim.FlysimError.__name__)"
    )
    done = python("-c", code, folder=tmp_path)
    assert (done.stdout, done.stderr) == ("none here\nFlysimError\n", "")
