"""`flysim new`: what it writes runs, in an empty folder, by the command that it names."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def flysim(*words, folder):
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    command = [sys.executable, "-P", "-m", "flysim", *words]
    return subprocess.run(
        command, cwd=folder, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, check=False
    )


def told(*words, folder):
    done = flysim(*words, folder=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.parametrize("kind", ["scenario", "world", "robot", "engine", "agent"])
def test_it_runs_as_it_says(kind, tmp_path):
    said = told("new", kind, "mine", folder=tmp_path)
    command = said.splitlines()[-1].partition(": flysim ")[2].split()
    found = json.loads(told(*command, "--json", folder=tmp_path))
    if kind == "agent":
        assert found["agents"][0]["episodes"] == 1
        return
    (report,) = found
    assert report["status"] == "ok"
    assert report["recall"] == 1.0 and report["false_obstacles"] == 0
    if kind == "world":
        assert [one["name"] for one in report["obstacles"]] == ["box", "pillar", "ball"]
        assert report["warnings"] == []
    if kind == "engine":
        assert report["engine"] == "mine:See"


def test_nothing_is_written_over_and_a_name_is_a_name(tmp_path):
    for kind, name in (("scenario", "mine"), ("world", "ours"), ("robot", "its"), ("engine", "seen"), ("agent", "who")):
        told("new", kind, name, folder=tmp_path)
        before = sorted((path, path.stat().st_mtime_ns) for path in tmp_path.rglob("*"))
        again = flysim("new", kind, name, folder=tmp_path)
        assert again.returncode == 2 and "exists already: take another name" in again.stderr
        wrong = flysim("new", kind, "../up", folder=tmp_path)
        assert wrong.returncode == 2 and "'../up' is no name for it" in wrong.stderr
        assert sorted((path, path.stat().st_mtime_ns) for path in tmp_path.rglob("*")) == before
