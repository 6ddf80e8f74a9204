"""Jobs on processes that may die."""

import multiprocessing
import os
import subprocess
import sys
from pathlib import Path

from flysim.workers import Died, finished


def double(job):
    if job == "die":
        os._exit(7)
    return os.environ["NUMBA_NUM_THREADS"], 2 * job


def test_a_process_that_dies_takes_its_own_job_alone():
    jobs = [1, "die", 3, "die", 5]
    with finished(double, jobs, 2) as found:
        results = dict(found)
    assert {i: results[i] for i in (0, 2, 4)} == {0: ("1", 2), 2: ("1", 6), 4: ("1", 10)}
    for i in (1, 3):
        assert isinstance(results[i], Died)
        assert "exit code 7" in str(results[i])
    with finished(double, [], 2) as found:
        assert list(found) == []


def test_whoever_stops_listening_leaves_no_process():
    with finished(double, list(range(8)), 2) as found:
        next(found)
    assert multiprocessing.active_children() == []


ORPHAN = """
import multiprocessing, os, signal, sys, time
from flysim import scratch
from flysim.workers import follow_parent

def work(pipe):
    scratch.clear = lambda: time.sleep(1.0)  # its end takes so long that the broken pipe is noticed before
    follow_parent()
    sys.stderr.write("heard\\n")
    pipe.send("ready")
    pipe.recv()  # breaks when the parent is gone, and would be a traceback

if __name__ == "__main__":
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    context.Process(target=work, args=(theirs,)).start()
    ours.recv()
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_worker_whose_parent_was_killed_has_nothing_to_say(tmp_path):
    program = tmp_path / "orphan.py"
    program.write_text(ORPHAN, encoding="utf-8")
    root = Path(__file__).resolve().parents[1]
    given = {**os.environ, "PYTHONPATH": os.pathsep.join([str(root), os.environ.get("PYTHONPATH", "")])}
    with subprocess.Popen([sys.executable, program], env=given, stderr=subprocess.PIPE, text=True) as process:
        _, error = process.communicate(timeout=60)  # until the worker too has let go of it
    assert (process.returncode, error) == (-9, "heard\n")
