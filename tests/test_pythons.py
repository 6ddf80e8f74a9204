"""On every Python that the machine has and flysim has wheels for: installed as `make` does it, one report."""

import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SUPPORTED = ("3.11", "3.12", "3.13")
STOPS = "stops=[{x = 1.629, y = -1.224, yaw_deg = 65}, {x = 1.735, y = -0.997, yaw_deg = 65}]"


def pythons():
    """The first interpreter of each version: on the path, or where pyenv keeps those it does not put there."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    places = [*os.get_exec_path(), *map(str, sorted(pyenv.glob("versions/*/bin")))]
    found = {}
    for version in SUPPORTED:
        for place in places:
            path = shutil.which(f"python{version}", path=place)
            if path and version not in found and works(path):
                found[version] = path
    return found


def works(python):
    return subprocess.run([python, "-c", "import venv"], capture_output=True, check=False).returncode == 0


def installed(python, folder):
    """`flysim` in an environment of its own, made from a copy of the checkout; nothing of Bullet may be compiled."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode != 0:
        pytest.skip("no git checkout here: nothing tells what to copy")
    for name in filter(None, listed.stdout.split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)
    wheels = {"UV_NO_BUILD_PACKAGE": "pybullet pybullet-arm64", "PIP_ONLY_BINARY": "pybullet,pybullet-arm64"}
    env = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")} | wheels
    command = [python, "tools/install.py"]
    done = subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / ".venv/bin/flysim", env


def report(flysim, env, renderer, folder):
    """What a run says, without its times and versions; and the Bullet that it says it ran on."""
    words = ["run", "paper_c", "--renderer", renderer, "--json", "--set", STOPS, "--set", "flies.population=1000"]
    done = subprocess.run([flysim, *words], cwd=folder, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (told,) = json.loads(done.stdout)
    build = told["versions"]["pybullet"]
    return without_times(told), build


def without_times(value):
    if isinstance(value, dict):
        return {key: without_times(inner) for key, inner in value.items() if key not in ("time_s", "versions")}
    return [without_times(inner) for inner in value] if isinstance(value, list) else value


@pytest.mark.accuracy
@pytest.mark.timeout(1800)
def test_the_same_report_on_every_python(tmp_path):
    found = pythons()
    if len(found) < 2:
        pytest.skip(f"only one Python of {', '.join(SUPPORTED)} is here: {', '.join(found) or 'none'}")
    reports = {}
    for version, python in found.items():
        folder = tmp_path / version
        flysim, env = installed(python, folder)
        for renderer in ("gl", "tiny"):
            reports[version, renderer], build = report(flysim, env, renderer, folder)
            assert re.fullmatch(r"[\d.]+" if version == "3.11" else r"[\d.]+ \(pybullet-arm64\)", build)
        shutil.rmtree(folder / ".venv")
    for renderer in ("gl", "tiny"):
        first, *others = (reports[version, renderer] for version in found)
        assert all(other == first for other in others), renderer
    print(f"the same reports on {', '.join(found)}")
