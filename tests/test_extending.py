"""docs/extending.md as a reader follows it: each file saved, each thing used by its name, in an empty folder."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
SMALL = ["--set", "flies.population=300", "--set", "flies.max_iterations=4"]


@pytest.fixture
def folder(tmp_path):
    """The files that the page says to save."""
    for name, source in re.findall(r"Save as `(\w+\.py)`:\n\n```python\n(.*?)```", TEXT, re.S):
        (tmp_path / name).write_text(source, encoding="utf-8")
    assert {path.name for path in tmp_path.iterdir()} == {"my_engine.py", "my_agent.py", "my_suite.py"}
    return tmp_path


def flysim(*words, folder):
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    # As the installed command has it: without the folder one stands in on the path.
    command = [sys.executable, "-P", "-m", "flysim", *words]
    done = subprocess.run(
        command, cwd=folder, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads(done.stdout)


def test_the_engine_runs(folder, short):
    for name in ("my_engine:Patient", "my_engine:brief"):
        (report,) = flysim("run", str(short), "--engine", name, "--json", *SMALL, folder=folder)
        assert report["engine"] == name
    generations = [stop["iterations"] for stop in report["stops"]]
    assert max(generations) <= 5


def test_the_agent_drives(folder):
    words = ("nav", "my_agent:Shy", "--observation", "truth", "--episodes", "1", "--json")
    data = flysim(*words, folder=folder)
    assert [one["agent"] for one in data["agents"]] == ["my_agent:Shy"]


def test_the_names_of_a_package_are_found(folder):
    found = dict(re.findall(r'\[project\.entry-points\."([\w.]+)"\]\n(\w+ = "[\w:]+")', TEXT))
    info = folder / "mine-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    points = "".join(f"[{group}]\n{line.replace(chr(34), '')}\n" for group, line in found.items())
    (info / "entry_points.txt").write_text(points)
    source = (
        "import sys; sys.path.insert(0, '.')\n"
        "from flysim.engines.choose import ENGINES\n"
        "from flysim.nav.agents.choose import AGENTS\n"
        "from flysim.studies.suite.suites import SUITES, cases\n"
        "print(ENGINES.load('patient').__name__, AGENTS.load('shy').__name__, len(cases('corridors')))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", source],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout == "Patient Shy 3\n", done.stderr
