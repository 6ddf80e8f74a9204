"""README and CONTRIBUTING are held to what they say: commands, snippets, files, keys."""

import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import typer
from PIL import Image

from flysim.cli.app import app
from flysim.common import catalogue as assets
from flysim.geometry.frames import Pose2
from flysim.render.choose import open_renderer
from flysim.render.look import look
from flysim.robots.robot import read_robot
from flysim.runs.run import run
from flysim.runs.scenario import read_scenario
from flysim.sim.simulation import Simulation
from flysim.worlds.sdf.reader import read_world

ROOT = Path(__file__).resolve().parents[1]
TEXTS = {name: (ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "CONTRIBUTING.md")}
README = TEXTS["README.md"]
TARGETS = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))


def blocks(text, language):
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.M | re.S)


def prose(text):
    return re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)


def commands(program):
    """Word lists of every command of a program: in shell blocks and between backticks."""
    found = []
    for text in TEXTS.values():
        lines = [line for block in blocks(text, "sh") for line in block.splitlines()]
        for line in [*lines, *re.findall(r"`([^`\n]+)`", prose(text))]:
            words = shlex.split(line, comments=True)
            while words:
                end = words.index("&&") if "&&" in words else len(words)
                if words[0] == program and len(words) > 1:
                    found.append(words[1:end])
                words = words[end + 1 :]
    return found


def named(table_head):
    """The words between backticks in the first column of a table."""
    rows = README.split(table_head, 1)[1].split("\n\n", 1)[0].splitlines()[2:]
    return [word for row in rows for word in re.findall(r"`([^`]+)`", row.split("|")[1])]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "run"
    stops = "stops=[{x = 1.629, y = -1.224, yaw_deg = 65}, {x = 1.735, y = -0.997, yaw_deg = 65}]"
    report = run("paper_c", out=folder, overrides=[stops, "flies.population=1000", "flies.max_iterations=8"])
    return folder, report.to_json()


@pytest.mark.parametrize("words", commands("flysim"), ids=" ".join)
def test_every_flysim_command_is_one(words, tmp_path):
    group = typer.main.get_command(app)
    command, *arguments = words
    assert command in group.commands
    if isinstance(group.commands[command], typer.core.TyperGroup):
        group, (command, *arguments) = group.commands[command], arguments
        assert command in group.commands
    if {"NAME", "FILE", "my/scenario.toml"} & set(arguments):
        return
    # Parsing refuses what is no option, and values of a wrong type.
    given = group.commands[command].make_context(command, list(arguments)).params
    scenarios = given.get("scenarios") or ()
    for scenario in scenarios.split(",") if isinstance(scenarios, str) else scenarios:
        read_scenario(scenario, given.get("overrides") or ())
    if given.get("world") is not None:
        assert given["world"] in assets.names("worlds")


def test_there_are_commands_of_every_kind():
    assert {words[0] for words in commands("flysim")} == {
        *("list", "run", "show", "view", "preview", "table1", "bench", "world", "compare", "suite", "nav", "train"),
        *("study", "sensors", "new", "see", "check", "calibrate", "export", "score"),
    }
    assert {words[0] for words in commands("pip")} == {"install"}


def test_every_make_target_is_one():
    asked = {word for words in commands("make") for word in words if "=" not in word}
    assert asked
    assert asked <= TARGETS


@pytest.mark.parametrize("name", TEXTS)
def test_every_file_it_names_is_there(name):
    text = TEXTS[name]
    links = re.findall(r"\]\(([^)#]+)\)", text)
    code = re.findall(r"`([\w./-]+\.(?:py|md|cff|txt|toml|urdf|sdf))`", prose(text))
    written_by_a_run_or_a_user = {"world.sdf", "README.md", "my/scenario.toml"}
    missing = [path for path in {*links, *code} - written_by_a_run_or_a_user if not (ROOT / path).exists()]
    assert not missing


def test_the_first_screen():
    first = README.splitlines()[:25]
    assert sum(line.startswith("![") for line in first) == 1
    assert any(line.startswith("make run") for line in first)
    assert any(line.startswith("pip install .") for line in first)
    assert any("is not" in line for line in first)


def test_the_scenario_it_shows_can_be_read(tmp_path):
    (text,) = blocks(README, "toml")
    tomllib.loads(text)
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    plan = read_scenario(str(tmp_path / "mine.toml"))
    assert plan.world_path.is_file() and plan.robot_path.is_file()


def test_a_run_folder_holds_what_it_says(recorded):
    folder, _ = recorded
    there = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert there == set(named("| file | what it holds |"))


def test_the_reports_keys_are_those_it_says(recorded):
    _, report = recorded
    assert set(report) == {word.removesuffix("[]") for word in named("| key | meaning |")}
    inner = {key for part in ("stops", "obstacles") for key in report[part][0]} | set(report["surface"])
    assert inner | set(report["time_s"]) <= set(re.findall(r"`(\w+)`", README))


def save_pair(folder):
    """The files that the snippets read: what the rover sees in `paper`."""
    plan = read_scenario("paper_a")
    world, robot = read_world(plan.world_path), read_robot(plan.robot_path)
    with Simulation(world, robot, Pose2(0.9, 0.0, 0.0), textured=True) as simulation:
        eyes = open_renderer("auto", simulation)
        pair, _ = look(simulation, eyes)
        eyes.close()
    Image.fromarray(pair.left).save(folder / "left.png")
    Image.fromarray(pair.right).save(folder / "right.png")
    K = "; ".join(" ".join(f"{value:.6f}" for value in row) for row in pair.rig.left.K)
    text = f"cam0=[{K}]\ncam1=[{K}]\ndoffs=0\nbaseline={1000 * pair.rig.baseline}\n"
    (folder / "calib.txt").write_text(text + f"width={pair.rig.left.width}\nheight={pair.rig.left.height}\n")


# Snippet by snippet: what a user finds in it. One that imports nothing of flysim goes on where the last one stopped.
FOUND = {
    "gym.make(": "assert info['path_length'] >= 0.0",
    "fs.run(": "assert (report.scenario, report.seed) == ('paper_c', 7)",
    "fs.read_pair(": "assert len(swarm.points) > 100\nassert np.isfinite(cloud.points).all()",
}


def programs():
    """README's snippets as programs that each run on their own."""
    found = []
    for snippet in blocks(README, "python"):
        if re.search(r"^import flysim", snippet, re.M):
            found.append(snippet)
        else:
            found[-1] += snippet
    return found


@pytest.mark.parametrize("what", FOUND)
def test_the_snippets_run_each_in_a_process_of_its_own(tmp_path, what):
    (program,) = (one for one in programs() if what in one)
    save_pair(tmp_path)
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program + FOUND[what]],
        **{"cwd": tmp_path, "env": {**os.environ, "PYTHONPATH": path}, "capture_output": True, "text": True},
        check=False,
        timeout=200,
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_there_is_a_program_for_each_of_them():
    assert len(programs()) == len(FOUND)
