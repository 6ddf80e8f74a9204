"""docs/extending.md as a reader follows it: each file saved, each thing used by its name, in an empty folder."""

import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from flysim.render.choose import gl_works

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
SMALL = ["--set", "flies.population=300", "--set", "flies.max_iterations=4"]


@pytest.fixture
def folder(tmp_path):
    """The files that the page says to save."""
    for name, source in re.findall(r"Save as `(\w+\.py)`:\n\n```python\n(.*?)```", TEXT, re.S):
        (tmp_path / name).write_text(source, encoding="utf-8")
    assert {path.name for path in tmp_path.iterdir()} == {
        f"my_{what}.py" for what in ("engine", "measure", "operator", "agent", "suite", "study", "world")
    }
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


def test_the_measures_are_compiled_once_and_hold_what_they_say(folder, short):
    (report,) = flysim("run", str(short), "--set", "flies.fitness=my_measure:soft", "--json", *SMALL, folder=folder)
    assert report["surface"]["precision"]["0.05"] > 0.9
    for name in ("calm", "soft"):
        assert checked(f"check_measure('my_measure:{name}', rng=np.random.default_rng(0))", folder) == ""
    # The other process has found all kernels that the first one compiled for `soft`.
    seen = "warm('my_measure:soft'); print(sum(generation.stats.cache_misses.values()))"
    assert checked(seen, folder) == "0\n"
    path = folder / "my_measure.py"
    path.write_text(
        path.read_text().replace("** 0.8 / (difference", f"** 0.7{time.time_ns()} / (difference")
    )  # as never before
    assert checked(seen, folder) == "1\n"


def test_the_operators_breed(folder, short):
    words = ("--set", "flies.crossover=my_operator:middle", "--set", "flies.mutation=my_operator:along_the_ray")
    (report,) = flysim("run", str(short), *words, "--json", *SMALL, folder=folder)
    assert report["surface"]["precision"]["0.05"] > 0.9
    for kind, name in (("crossover", "middle"), ("mutation", "along_the_ray")):
        assert checked(f"check_operator('{kind}', 'my_operator:{name}', rng=np.random.default_rng(0))", folder) == ""


def checked(code, folder):
    """What a process in the folder prints."""
    source = (
        "import numpy as np\n"
        "from flysim.engines.choose import ENGINES, alone, engine\n"
        "from flysim.flies.check import _RIG, _pair, check_measure, check_operator\n"
        "from flysim.flies.generation import generation\n"
        "from flysim.flies.parameters import FlyParams\n"
        "def warm(name):\n"
        "    rng = np.random.default_rng(0)\n"
        "    alone(engine('flies'), _pair(rng, alike=True), FlyParams(population=300, fitness=name), rng=rng)\n" + code
    )
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    done = subprocess.run(
        [sys.executable, "-c", source],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_agent_drives(folder):
    words = ("nav", "my_agent:Shy", "--observation", "truth", "--episodes", "1", "--json")
    data = flysim(*words, folder=folder)
    assert [one["agent"] for one in data["agents"]] == ["my_agent:Shy"]


@pytest.mark.skipif(not gl_works(), reason="no OpenGL context opens here, and tiny draws no lamp")
def test_the_study_runs(folder, short):
    words = ("study", "my_study:lamplight", "--scenarios", str(short), "--seeds", "1", "--engines", "chance", "--json")
    data = flysim(*words, folder=folder)
    assert [row["level"] for row in data["rows"]] == [0.0, 50.0, 90.0] and data["unit"] == "% of it lost"


def test_the_world_is_driven_through(folder):
    words = ("nav", "straight", "--worlds", "my_world:crowded", "--observation", "truth", "--json")
    (episode,) = flysim(*words, folder=folder)["episodes"]
    assert episode["world"] == "my_world:crowded" and (folder / "crowded" / "world.sdf").is_file()


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
        "from flysim.flies.measure import find_measure\n"
        "from flysim.flies.operator import find_operator\n"
        "from flysim.nav.agents.choose import AGENTS\n"
        "from flysim.studies.suite.suites import SUITES, cases\n"
        "from flysim.studies.sweep.study import STUDIES\n"
        "print(STUDIES.load('lamplight').unit)\n"
        "from flysim.common.catalogue import find_world, world_names\n"
        "one, other = find_world('crowded'), find_world('my_world:crowded')\n"
        "print(one.name, one == other, world_names()[-1])\n"
        "print(find_measure('calm').of, find_operator('crossover', 'middle').kind)\n"
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
    assert done.stdout == "% of it lost\nworld.sdf True crowded\nsums crossover\nPatient Shy 3\n", done.stderr
