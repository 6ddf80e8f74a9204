"""Processes that end with the one that started them, even where that is killed."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
GUARDED = """
import time; from flysim.common.lifeline import Lifeline
line = Lifeline()
process = line.start_guarded(["sh", "-c", "sleep 100 & echo $! ; wait"])
time.sleep(100)
"""
FOLLOWER = """
import os, sys; sys.path.insert(0, sys.argv[2])
from flysim.common.lifeline import follow; from flysim.common.scratch import Scratch; import time
follow(int(sys.argv[1])); one = Scratch(); print(os.getpid(), flush=True); time.sleep(100)
"""
FOLLOWED = f"""
import sys, time; from flysim.common.lifeline import Lifeline
line = Lifeline()
line.start([sys.executable, "-c", {FOLLOWER!r}, str(line.theirs), {str(ROOT)!r}])
time.sleep(100)
"""
POOL = """
import time; from flysim.common.workers import finished
import work
with finished(work.tell, [0, 1], 2) as found: list(found)
"""
THEIRS = """
import multiprocessing, time; from flysim.common.workers import started
import work
def make():
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    context.Process(target=work.loop, args=(theirs,), daemon=True).start()
    ours.poll(100)  # and what it says stays unread: it gets a reset, not an end
    return ours
if __name__ == "__main__":
    with started(make): time.sleep(100)
"""
WORK = """
import os, sys, time; from flysim.common.scratch import Scratch
def tell(job):
    one = Scratch(); os.write(1, b"%d\\n" % os.getpid()); time.sleep(100)  # whole: two of them write
def loop(pipe):
    from flysim.common import workers
    workers.follow_parent(); pipe.send("unread"); os.write(1, b"%d\\n" % os.getpid()); pipe.recv()
"""


def alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="there is no /proc here")
@pytest.mark.parametrize(
    ("code", "count"), [(GUARDED, 1), (FOLLOWED, 1), (POOL, 2), (THEIRS, 1)], ids=("guard", "follow", "pool", "theirs")
)
def test_a_killed_parent_leaves_no_process_and_no_words(tmp_path, code, count):
    (tmp_path / "work.py").write_text(WORK)
    (tmp_path / "tmp").mkdir()
    path = os.pathsep.join((str(ROOT), str(tmp_path)))
    with subprocess.Popen(
        [sys.executable, "-c", code],
        env=os.environ | {"PYTHONPATH": path, "TMPDIR": str(tmp_path / "tmp")},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as parent:
        assert parent.stdout is not None
        children = [int(parent.stdout.readline()) for _ in range(count)]
        for pid in children if code != GUARDED else ():
            for one in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):  # a group's signals are the parent's to obey
                os.kill(pid, one)
        assert all(map(alive, children))
        parent.kill()
        _, words = parent.communicate(timeout=60)
    until = time.monotonic() + 30.0
    while any(map(alive, children)) and time.monotonic() < until:
        time.sleep(0.02)
    assert not any(map(alive, children))
    assert words == ""
    assert not list((tmp_path / "tmp").iterdir())


def test_a_guard_ends_as_the_program_did():
    from flysim.common.lifeline import Lifeline

    for command, code in ((["sh", "-c", "exit 7"], 7), (["sh", "-c", "kill -9 $$"], 128 + 9), (["true"], 0)):
        line = Lifeline()
        assert line.start_guarded(command).wait(timeout=60) == code
        line.cut()
        line.cut()
    line = Lifeline()
    process = line.start_guarded(["sleep", "100"])
    line.cut()
    assert process.wait(timeout=60) == -signal.SIGKILL
    line = Lifeline()
    with pytest.raises(FileNotFoundError):
        line.start(["/nowhere/to/be/found"])
