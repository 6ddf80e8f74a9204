"""Temporary folders: gone with their maker, or with the next process if that was killed."""

import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from flysim.common import scratch as module
from flysim.common.scratch import Scratch, clear, sweep_scratch

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_it_is_there_and_it_goes(place):
    one, other = Scratch(), Scratch()
    (Path(one.name) / "a").write_text("a")
    assert {path.stat().st_mode & 0o777 for path in place.iterdir()} == {0o700}
    one.cleanup()
    one.cleanup()
    assert [str(path) for path in place.iterdir()] == [other.name]
    clear()
    assert not list(place.iterdir())
    del other
    Scratch()  # kept by nobody
    assert not list(place.iterdir())


def open_files():
    return len(list(Path("/proc/self/fd").iterdir()))


def test_a_thousand_leave_no_file_open():
    before = open_files()
    kept = [Scratch() for _ in range(3)]
    for _ in range(1000):
        Scratch().cleanup()
    assert open_files() == before + len(kept)
    clear()
    assert open_files() == before


LEFT = (
    "from flysim.common.scratch import Scratch; import os, sys; one = Scratch(); open(one.name + '/a', 'w').close()\n"
)


def elsewhere(place, more, code=0):
    environment = os.environ | {"PYTHONPATH": str(ROOT), "TMPDIR": str(place)}
    done = subprocess.run([sys.executable, "-c", LEFT + more], env=environment, check=False, timeout=60)
    assert done.returncode == code


def test_what_a_killed_process_left_goes_and_nothing_else(place):
    elsewhere(place, f"os.kill(os.getpid(), {signal.SIGKILL:d})", -signal.SIGKILL)
    mine = Scratch()  # another place for temporary files is swept as well
    assert [str(path) for path in place.iterdir()] == [mine.name]
    elsewhere(place, "os._exit(0)")
    for name in ("flysim-results", "flysim-0123456789ab", "else-0123456789ab.scratch"):
        (place / name).mkdir()
    (place / "flysim-0123456789ab.scratch").symlink_to(place / "flysim-results")
    before = set(place.iterdir())
    left = {path for path in before if path.is_dir() and list(path.iterdir())}
    assert len(left) == 1
    sweep_scratch()
    assert set(place.iterdir()) == before - left
    mine.cleanup()


def test_a_live_one_is_nobody_elses(place):
    mine = Scratch()
    elsewhere(place, "sys.exit(len(os.listdir(os.path.dirname(one.name))))", 2)
    mine.cleanup()
    assert not list(place.iterdir())


def test_a_forked_child_takes_nothing_away():
    mine = Scratch()
    pid = os.fork()
    if pid == 0:
        mine.cleanup()
        os._exit(0)
    assert os.waitpid(pid, 0)[1] == 0
    assert Path(mine.name).is_dir()
    sweep_scratch()
    assert Path(mine.name).is_dir()


def test_where_there_are_no_locks_nothing_is_swept(place, monkeypatch):
    def without(*_args):
        raise OSError(95, "not supported")

    monkeypatch.setattr("fcntl.flock", without)
    mine = Scratch()
    sweep_scratch()
    assert Path(mine.name).is_dir()


def test_one_that_is_swept_before_it_is_held_is_made_again(place, monkeypatch):
    held, tried = module.held_folder, []

    def quick(path, mode):
        tried.append(path)
        if len(tried) == 1:
            path.mkdir()
            path.rmdir()
            return None
        return held(path, mode)

    monkeypatch.setattr(module, "held_folder", quick)
    assert Scratch().name and len(tried) == 2
