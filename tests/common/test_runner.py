"""Jobs by processes and by a real Ray: the same results, whoever dies in the middle."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from flysim.common.runner import runner
from flysim.errors import FlysimError

ROOT = Path(__file__).resolve().parents[2]
needs_ray = pytest.mark.skipif(importlib.util.find_spec("ray") is None, reason="Ray is not installed (flysim[cluster])")

# Ray is started in a process of its own: it leaves threads and warnings behind that are not ours.
SCRIPT = """
import json, os, signal, sys, time
from pathlib import Path
from flysim.common.runner import runner
from flysim.common.workers import Died

def main(ray):
    import the_work
    jobs = [(k, sys.argv[2]) for k in range(6)]
    with runner(2, ray)(the_work.work, jobs) as found:
        got = {k: f"died: {result}" if isinstance(result, Died) else result for k, result in found}
    print("RESULT", json.dumps(got, sort_keys=True))

if __name__ == "__main__":
    main(sys.argv[1] or None)
"""
WORK = """
import os, signal
from pathlib import Path

def work(job):
    number, folder = job
    seen = Path(folder) / f"ran-{number}"
    with seen.open("a") as file:
        file.write(f"{os.getpid()} {os.environ['OMP_NUM_THREADS']}\\n")
    if number == 2 and len(seen.read_text().splitlines()) == 1:
        os.kill(os.getpid(), signal.SIGKILL)  # the first to take it is killed in the middle
    if number == 4 and (Path(folder) / "fatal").exists():
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number
"""


def results(tmp_path, ray, *, name="a", fatal=False):
    folder = tmp_path / name
    folder.mkdir()
    (tmp_path / "the_work.py").write_text(WORK, encoding="utf-8")
    (tmp_path / "script.py").write_text(SCRIPT, encoding="utf-8")
    if fatal:
        (folder / "fatal").touch()
    done = subprocess.run(
        [sys.executable, "script.py", ray, str(folder)],
        cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join((str(ROOT), str(tmp_path)))},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    (line,) = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    return {int(k): value for k, value in json.loads(line.removeprefix("RESULT ")).items()}, folder


@needs_ray
def test_a_worker_of_ray_that_is_killed_costs_no_result(tmp_path):
    got, folder = results(tmp_path, "local", fatal=True)
    assert {k: got[k] for k in (0, 1, 2, 3, 5)} == {0: 0, 1: 1, 2: 4, 3: 9, 5: 25}
    assert got[4].startswith("died: its workers died 4 times")
    again = (folder / "ran-2").read_text().splitlines()
    assert len(again) == 2 and again[0] != again[1]  # another process did it again
    assert {line.split()[1] for line in again} == {"1"}  # with one thread, as the local processes
    assert len({(folder / f"ran-{k}").read_text().split()[0] for k in range(6)}) >= 2  # two worked at once


def test_a_process_that_is_killed_costs_its_own_result_alone(tmp_path):
    got, _ = results(tmp_path, "")
    assert {k: got[k] for k in (0, 1, 3, 4, 5)} == {0: 0, 1: 1, 3: 9, 4: 16, 5: 25}
    assert got[2].startswith("died: its process died with exit code -9")


@needs_ray
def test_no_cluster_at_an_address_is_one_line():
    no_cluster = pytest.raises(FlysimError, match=r"^--ray 127.0.0.1:1: no Ray cluster there: .*ray start --head")
    with no_cluster, runner(ray="127.0.0.1:1")(print, [1]):
        pass


def test_without_ray_it_says_what_to_install(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(FlysimError, match=r"--ray needs Ray: pip install 'flysim-testbed\[cluster\]'"):
        runner(ray="local")
