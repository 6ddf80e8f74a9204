"""What `pip install` gives: the wheel is built, installed in a new environment and run from an empty folder."""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import venv
import zipfile
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def call(*command, cwd, env=None):
    done = subprocess.run(list(map(str, command)), cwd=cwd, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def travelling(kind, pattern):
    """Files of the checkout that the wheel must hold, by their name in it."""
    files = (path for path in (ROOT / kind).glob(pattern) if path.is_file())
    return {f"flysim/assets/{path.relative_to(ROOT).as_posix()}" for path in files}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Built from a copy, with litter in it that must not travel, and without git to say what is ignored."""
    source = tmp_path_factory.mktemp("source")
    skip = shutil.ignore_patterns("__pycache__", "out")
    for name in ("flysim", "worlds", "robots", "runs"):
        shutil.copytree(ROOT / name, source / name, ignore=skip)
    for name in ("pyproject.toml", PROJECT["readme"], *PROJECT["license-files"]):
        shutil.copy(ROOT / name, source)
    for litter in ("runs/out/a/report.json", "runs/out/old.toml", "flysim/__pycache__/x.nbc", "worlds/notes.txt"):
        (source / litter).parent.mkdir(parents=True, exist_ok=True)
        (source / litter).write_text("litter")
    pytest.importorskip("hatchling", reason="hatchling builds the wheel: make test installs it")
    out = tmp_path_factory.mktemp("dist")
    call(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", out, cwd=source)
    (built,) = out.glob("*.whl")
    return built


def test_worlds_robots_and_scenarios_travel_and_nothing_else(wheel):
    names = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    code = {path.relative_to(ROOT).as_posix() for path in (ROOT / "flysim").rglob("*.py")}
    code |= {path.relative_to(ROOT).as_posix() for path in (ROOT / "flysim/cli/templates").iterdir()}
    files = {
        name for kind in ("worlds", "robots") for name in travelling(kind, "*/**/*") if (ROOT / name[14:]).is_file()
    }
    scenarios = travelling("runs", "*.toml") | travelling("runs", "baselines/*.json")
    assert {"flysim/assets/worlds/yard/world.sdf", "flysim/assets/runs/paper_a.toml"} <= files | scenarios
    assert names == code | {name for name in files if "__pycache__" not in name} | scenarios


def test_the_wheel_has_its_licence_and_the_command(wheel):
    archive = zipfile.ZipFile(wheel)
    (points,) = (name for name in archive.namelist() if name.endswith("entry_points.txt"))
    assert "flysim = flysim.__main__:main" in archive.read(points).decode()
    assert any(name.endswith("licenses/LICENSE") for name in archive.namelist())


KNOWN = {"flysim", "__future__", "compression"}  # the last is the standard library's from Python 3.14 on


def test_what_flysim_imports_it_declares():
    extras = [each for name, some in PROJECT["optional-dependencies"].items() if name != "dev" for each in some]
    declared = {re.split(r"[<>=~!\[; ]", each)[0] for each in [*PROJECT["dependencies"], *extras]}
    owners, missing = packages_distributions(), set()
    for path in (ROOT / "flysim").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
                names = [node.module]
            for top in {name.split(".")[0] for name in names} - sys.stdlib_module_names - KNOWN:
                if not declared & {re.sub(r"[-_.]+", "-", owner).lower() for owner in owners.get(top, [top])}:
                    missing.add(f"{path.relative_to(ROOT)}: {top}")
    assert not missing


def test_nobody_is_told_to_install_a_strangers_package():
    # `flysim` on the index is somebody else's; ours has another name.
    assert PROJECT["name"] == "flysim-testbed"
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "flysim").rglob("*.py")]
    wrong = re.compile(r"pip install +['\"]?flysim(?!-testbed)\b|\bflysim\[rl")
    assert not [f"{path}: {hit[0]}" for path in pages for hit in wrong.finditer(path.read_text(encoding="utf-8"))]


@pytest.fixture(scope="module")
def environment(wheel, tmp_path_factory):
    """A new environment with the wheel; flysim's own dependencies are borrowed from the one that tests."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder, symlinks=True)
    python = folder / "bin" / "python"
    installers = [
        [Path(sys.executable).with_name("uv"), "pip", "install", "--offline", "--no-deps", "--python", python],
        *(
            [pip, "-m", "pip", "--python", python, "install", "--no-index", "--no-deps"]
            for pip in (sys.executable, getattr(sys, "_base_executable", sys.executable))
        ),
    ]
    for installer in installers:
        if Path(installer[0]).exists():
            done = subprocess.run([*map(str, installer), str(wheel)], capture_output=True, text=True, check=False)
            if done.returncode == 0:
                break
    else:
        pytest.skip("neither uv nor pip is here to install the wheel")
    # A plain path: the .pth files in there, which lead to the checkout, are not read.
    purelib = next((folder / "lib").glob("python3*")) / "site-packages"
    (purelib / "borrowed.pth").write_text("\n".join({sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}))
    return folder


@pytest.fixture
def run_there(environment, tmp_path):
    """Runs a program of the environment in an empty folder, with nothing else to lead to the checkout."""
    home = tmp_path / "home"
    home.mkdir()
    work = tmp_path / "empty"
    work.mkdir()
    kept = {key: value for key, value in os.environ.items() if key.startswith(("LD_", "LIBGL", "MESA", "NUMBA_NUM"))}
    env = {**kept, "HOME": str(home), "PATH": f"{environment / 'bin'}:/usr/bin:/bin"}
    return work, lambda name, *words: call(environment / "bin" / name, *words, cwd=work, env=env)


def test_flysim_runs_from_an_empty_folder(environment, run_there):
    work, run = run_there
    where = json.loads(run("python", "-c", "import flysim, json, sys; print(json.dumps([flysim.__file__, *sys.path]))"))
    assert Path(where[0]).is_relative_to(environment)
    assert not [path for path in where if Path(path or work).is_relative_to(ROOT) and "site-packages" not in path]

    listed = json.loads(run("flysim", "list", "--json"))
    assert listed["worlds"] == sorted(path.parent.name for path in (ROOT / "worlds").glob("*/world.sdf"))
    assert [one["name"] for one in listed["scenarios"]] == sorted(path.stem for path in (ROOT / "runs").glob("*.toml"))

    held = "from flysim.studies.regress.baseline import find_baselines; print(len(find_baselines([])))"
    assert int(run("python", "-c", held)) == len(list((ROOT / "runs" / "baselines").glob("*.json")))

    few = "stops=[{x = 1.629, y = -1.224, yaw_deg = 65}, {x = 1.735, y = -0.997, yaw_deg = 65}]"
    less = ("--set", few, "--set", "flies.population=300", "--set", "flies.max_iterations=5")
    (report,) = json.loads(run("flysim", "run", "paper_c", *less, "--json"))
    assert (report["scenario"], report["status"], len(report["stops"])) == ("paper_c", "ok", 2)
    (folder,) = (work / "runs" / "out").iterdir()
    assert json.loads((folder / "report.json").read_text(encoding="utf-8")) == report
    assert "paper_c" in run("flysim", "show", "latest")
    assert [path.name for path in work.iterdir()] == ["runs"]
