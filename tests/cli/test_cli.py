"""The command line in this process. What needs a process of its own is in test_cli_process.py."""

import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

import flysim
from flysim.cli.app import app
from flysim.common.catalogue import find_policy, find_robot, find_world, names
from flysim.common.provenance import versions
from flysim.record import scribe
from flysim.worlds.sdf.reader import read_world

STOP = "stops = [{ x = 0, y = 0 }]\n"
COMMANDS = (
    "run",
    "list",
    "show",
    "view",
    "preview",
    "sensors",
    "table1",
    "bench",
    "bench engine",
    "bench stop",
    "bench env",
    "calibrate",
    "nav",
    "new",
    "new world",
    "world",
    "world random",
)
# Of the issue: these stay from here on.
REPORT_KEYS = {
    *("scenario", "seed", "renderer", "engine", "status", "stops", "obstacles", "false_obstacles", "precision"),
    *("recall", "f1", "center_error_m", "size_error_m", "surface", "time_s", "versions"),
}
STOP_KEYS = {"index", "commanded", "odometry", "true", "iterations", "converged", "time_s"}
OBSTACLE_KEYS = {
    *("name", "detected", "center_error_m", "size_true_m", "size_visible_m", "size_estimated_m", "size_error_m"),
    *("size_visible_error_m", "yaw_error_deg"),
}


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    """An empty folder to be in."""
    folder = tmp_path / "here"
    folder.mkdir()
    monkeypatch.chdir(folder)
    for name in ("FORCE_COLOR", "PY_COLORS", "GITHUB_ACTIONS"):
        monkeypatch.delenv(name, raising=False)
    return folder


def typed(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments], prog_name="flysim")


def refused(*arguments):
    """The one line that a mistake gets, without its "flysim: "."""
    result = typed(*arguments)
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert result.stderr.startswith("flysim: ")
    assert result.stderr.endswith("\n")
    assert result.stderr[:-1].isprintable(), result.stderr  # one line, no escapes
    assert len(result.stderr) <= 300
    assert "Traceback" not in result.stderr
    return result.stderr.removeprefix("flysim: ")


def scenario(folder, text, name="mine.toml"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["run", "papr_a"], "no scenario 'papr_a'. Did you mean 'paper_a'?"),
        (["run", "paper_a", "papr_b"], "no scenario 'papr_b'. Did you mean 'paper_b'?"),
        (["run", "none/such.toml"], "no scenario file 'none/such.toml'. Give a path that exists, or a name: "),
        (["run", "paper_a", "--set", 'world="yrad"'], "no world 'yrad'. Did you mean 'yard'?"),
        (["run", "paper_a", "--set", "robot=rovr"], "no robot 'rovr'. Did you mean 'rover'?"),
        (["run", "paper_a", "--set", "flies.populaton=3"], "unknown key 'flies.populaton'. Did you mean 'population'?"),
        (["run", "paper_a", "--set", "flies.population"], "--set flies.population: write KEY=VALUE, as in"),
        (["run", "paper_a", "--set", "flies.population=nan"], "flies.population: Input should be a finite number, got"),
        (["run", "paper_a", "--set", "stops=[{x=nan,y=0}]"], "stops.0.x: Input should be a finite number, got nan."),
        (["run", "paper_a", "--renderer", "gll"], "no renderer 'gll'. Did you mean 'gl'?"),
        (["run", "paper_a", "paper_a", "--out", "o"], "two scenarios have one name and would share a folder in --out"),
        (["preview", "yrad"], "no world 'yrad'. Did you mean 'yard'?"),
        (["preview", "yard", "--renderer", "tinny"], "no renderer 'tinny'. Did you mean 'tiny'?"),
        (["bench", "engine", "--renderer", "tinny"], "no renderer 'tinny'. Did you mean 'tiny'?"),
        (["bench", "engine", "--out", "/dev/null"], "/dev/null"),
        (["bench", "stop", "yrad"], "no scenario 'yrad'. Did you mean 'yard'?"),
        (["world", "random", "--difficulty", "hrad"], "no difficulty 'hrad'. Did you mean 'hard'?"),
        (["world", "random", "--seed", "-1"], "--seed must be from 0 to 2^63 - 1, got -1."),
        (["run", "paper_a", "--seed", "-1"], "--seed must be from 0 to 2^63 - 1, got -1."),
        (["run", "paper_a", "--seed", "9" * 4000], "--seed must be from 0 to 2^63 - 1, got 999"),
        (["compare", "paper_a", "--seed", str(2**63)], "--seed must be from 0 to 2^63 - 1, got 9223372036854775808."),
        (["world", "random", "--seed", str(10**30)], "--seed must be from 0 to 2^63 - 1, got 1000"),
        (["nav", "vfh", "--seed", str(2**63)], "--seed must be from 0 to"),
        (["nav", "vfh", "--episodes", "0"], "--episodes must be from 1 to 100,000, got 0."),
        (["nav", "vfh", "--episodes", "1000000000"], "--episodes must be from 1 to 100,000, got 1000000000."),
        (["nav", "vfh", "--processes", "100000"], "--processes must be from 1 to 256, got 100000."),
        (["train", "ppo", "--seed", str(2**31)], "--seed must be from 0 to 2,147,483,647, got 2147483648."),
        (["train", "ppo", "--minutes", "nan"], "--minutes must be > 0 and at most 1,000,000, got nan."),
        (["train", "ppo", "--minutes", "inf"], "--minutes must be > 0 and at most 1,000,000, got inf."),
        (["train", "ppo", "--steps", str(10**20)], "--steps must be from 1 to"),
        (["bench", "env", "--steps", str(10**20)], "--steps must be from 20 to"),
        (["bench", "engine", "--repeats", str(10**20)], "--repeats must be from 1 to"),
        (["table1", "--seeds", str(10**20)], "--seeds must be from 1 to"),
        (
            ["suite", "paper", "--seeds", "0:99999999999"],
            "--seeds 0:99999999999: 99,999,999,999 seeds, at most 100,000",
        ),
        (["suite", "paper", "--seeds=-3:2"], "--seeds -3:2: seeds are from 0 to 2^63 - 1."),
        (["suite", "paper", "--seeds", f"{10**30}"], ": seeds are from 0 to 2^63 - 1."),
        (["suite", "paper", "--seeds", "0:" + "9" * 5000], ": write A:B for the seeds A to B - 1"),
        (["suite", "paper", "--seeds", "0:100000"], "3 worlds by 100000 seeds are more than 100,000 runs"),
        (["world", "random", "--out", "/dev/null"], "/dev/null is a file: name another folder with `--out DIR`"),
        (["show", "latest"], "no run 'latest': runs/out holds none yet. Start with `flysim run paper_a`"),
        (["show", "none"], "no run 'none': runs/out holds none yet."),
        (["view", "none"], "no run 'none': runs/out holds none yet."),
        (["view", "none", "--web"], "no run 'none'"),
        (["show", "."], ". is no run folder: it has no report.json."),
    ],
)
def test_a_mistake_is_one_line_and_exit_code_2(place, arguments, said):
    assert said in refused(*arguments)
    assert not list(place.iterdir())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("world = [", "not TOML: "),
        ('"a\\n\\u001b[31mb" = 1\n' + STOP, "unknown key 'a??[31mb'."),
        ('wolrd = "paper"\n' + STOP, "unknown key 'wolrd'. Did you mean 'world'?"),
        ('world = "paper"\n', "'stops' is missing. Add it."),
        (
            'world = "paper"\nstops = [{ x = 0, y = 0 }, { x = 2.2, y = 0.0 }]',
            "stop 2 of 2 at (2.2, 0) stands in 'box'",
        ),
        ('world = "paper"\nstops = [{ x = 2.2, y = 0.1 }]', "stop 1 of 1 at (2.2, 0.1) stands in 'box'"),
        ('world = "none.sdf"\n' + STOP, "no world file '"),
        ('world = "paper"\nrobot = "none.urdf"\n' + STOP, "no robot file '"),
    ],
)
def test_a_scenario_that_cannot_be_run(place, text, said):
    assert said in refused("run", scenario(place, text))
    assert [path.name for path in place.iterdir()] == ["mine.toml"]


SDF = '<sdf version="1.9"><world name="w">{}</world></sdf>'
FLOOR = '<model name="floor"><static>1</static><link name="l"><collision name="c">{0}</collision>{1}</link></model>'
PLANE = "<geometry><plane><normal>0 0 1</normal><size>8 8</size></plane></geometry>"
TEXTURED = (
    f"<visual name='v'>{PLANE}<material><pbr><metal><albedo_map>none.png</albedo_map></metal></pbr></material></visual>"
)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<sdf><world>", "is not well-formed UTF-8 XML"),
        ('<!DOCTYPE d [<!ENTITY a "b">]><sdf>&a;</sdf>', "declares a DTD or entities, which are not read"),
        (SDF.format(""), "nothing carries the robot at (0, 0): it falls. Give the world a floor"),
        (SDF.format(FLOOR.format(PLANE.replace("8 8", "nan 8"), "")), "<size> must hold 2 numbers"),
    ],
)
def test_a_world_that_cannot_be_used(place, text, said):
    (place / "w.sdf").write_text(text, encoding="utf-8")
    assert said in refused("run", scenario(place, 'world = "w.sdf"\n' + STOP))
    assert sorted(path.name for path in place.iterdir()) == ["mine.toml", "w.sdf"]


@pytest.mark.parametrize("uri", ["none.png", "../../etc/passwd"])
def test_a_picture_that_cannot_be_had_is_named_and_its_surface_bare(place, uri):
    (place / "w.sdf").write_text(SDF.format(FLOOR.format(PLANE, TEXTURED.replace("none.png", uri))), encoding="utf-8")
    result = typed("preview", "w.sdf", "--out", "w.png")
    assert result.exit_code == 0 and f"a texture cannot be read and its visual is bare: '{uri}: " in result.stderr


def test_a_robot_that_cannot_be_used(place):
    rover = find_robot("rover").read_text(encoding="utf-8")
    for old, new, said in (
        ('xyz="0.005 -0.06 0"', 'xyz="0.005 0.06 0"', "r.urdf: its stereo pair: the baseline must be > 0 m, got 0"),
        ("</robot>", "", "r.urdf: not a readable URDF: no element found"),
        ('<mass value="2.16"/>', '<mass value="nan"/>', "r.urdf: mass of link 'base_link' must be a finite number"),
    ):
        (place / "r.urdf").write_text(rover.replace(old, new), encoding="utf-8")
        assert said in refused("run", scenario(place, 'world = "paper"\nrobot = "r.urdf"\n' + STOP))


@pytest.mark.parametrize(
    ("out", "said"),
    [
        ("full", "full exists and is not empty: name another folder with `--out DIR`, or empty it"),
        ("file", "file is a file: name another folder with `--out DIR`"),
        ("file/run", "cannot write file/run: not a directory"),
        ("/proc/run", "cannot write /proc/run: "),
        (".", ". is in use and cannot be replaced: name a new folder in it, `--out run`"),
        ("x" * 300, "file name too long"),
    ],
)
def test_a_folder_that_cannot_be_written_is_told_before_the_drive(place, monkeypatch, out, said):
    (place / "full").mkdir()
    (place / "full" / "thing").touch()
    (place / "file").touch()
    if out == ".":
        monkeypatch.chdir(place / "full")
        (place / "full" / "thing").unlink()
    assert said in refused("run", "paper_a", "--out", out)
    assert sorted(path.name for path in place.iterdir()) == ["file", "full"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["qqqq"], "flysim has no command 'qqqq'. Known: bench, calibrate, check, compare, export, list, "),
        (["rnu"], "flysim has no command 'rnu'. Did you mean 'run'?"),
        (["bench", "engin"], "flysim bench has no command 'engin'. Did you mean 'engine'?"),
        (["--sed"], "flysim has no option '--sed'. See: flysim -h"),
        (["run", "paper_a", "--sed", "3"], "flysim run has no option '--sed'. Did you mean '--seed'?"),
        (["nav", "vfh", "--episode", "3"], "flysim nav has no option '--episode'. Did you mean '--episodes'?"),
        (["run", "--qqqq"], "flysim run has no option '--qqqq'. See: flysim run -h"),
        (["run", "paper_a", "--seed", "x"], "--seed must be a whole number, got 'x'."),
        (["run", "paper_a", "--seed", "9" * 9000], "--seed must be a whole number, got '9999"),
        (["train", "ppo", "--minutes", "x"], "--minutes must be a number, got 'x'."),
        (["run", "paper_a", "--seed"], "--seed needs a value after it. See: flysim run -h"),
        (["list", "--json=3"], "--json takes no value. See: flysim list -h"),
        (["show"], "flysim show needs RUN. Example: flysim show latest"),
        (["compare"], "flysim compare needs SCENARIOS. Example: flysim compare paper_b yard --engines flies,sgbm,bm"),
        (["show", "a", "b"], "flysim show takes no 'b'. Example: flysim show latest"),
    ],
)
def test_what_typer_refuses_is_one_line(arguments, said):
    assert refused(*arguments).startswith(said)


@pytest.mark.parametrize("arguments", [[], ["bench"], ["train"]])
def test_a_command_without_a_word_after_it_shows_its_help(arguments):
    result = typed(*arguments)
    assert result.exit_code == 2
    assert "Usage: flysim" in result.output
    assert "flysim: " not in result.stderr


def test_the_second_scenario_is_checked_before_the_first_one_drives(place, short):
    bad = scenario(short.parent, 'world = "paper"\nstops = [{ x = 2.2, y = 0.0 }]', "bad.toml")
    assert "scenario 'bad': stop 1 of 1" in refused("run", short, bad, "--out", "both")
    assert not list(place.iterdir())


def test_two_scenarios_as_one_json_array_and_then_the_record(place, short):
    second = scenario(short.parent, short.read_text(encoding="utf-8"), "second.toml")
    result = typed("run", short, second, "--seed", 3, "--out", "both", "--json", "--set", "flies.population=300")
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    reports = json.loads(result.stdout)
    assert [report["scenario"] for report in reports] == ["short", "second"]
    for report in reports:
        assert report.keys() >= REPORT_KEYS
        assert (report["seed"], report["status"], report["engine"]) == (3, "ok", "flies")
        assert len(report["stops"]) == 2
        assert all(stop.keys() >= STOP_KEYS for stop in report["stops"])
        assert all(stop["time_s"].keys() == {"render", "evolve", "obstacles"} for stop in report["stops"])
        assert [obstacle["name"] for obstacle in report["obstacles"]] == ["box"]
        assert report["obstacles"][0].keys() >= OBSTACLE_KEYS
        assert report["surface"].keys() == {
            "accuracy_median_m",
            "accuracy_p90_m",
            "precision",
            "completeness",
            "f_score",
        }
        assert report["time_s"].keys() >= {"total", "drive", "render", "evolve", "obstacles"}
    assert sorted(path.name for path in (place / "both").iterdir()) == ["second", "short"]
    config = json.loads((place / "both/short/config.json").read_text(encoding="utf-8"))
    assert config["scenario"]["flies"]["population"] == 300

    shown = typed("show", "both/short")
    assert shown.exit_code == 0
    assert "short" in shown.stdout
    assert "both/short/figures/path.png" in shown.stdout
    assert json.loads(typed("show", "both/short", "--json").stdout) == reports[0]

    text = (place / "both/short/report.json").read_text(encoding="utf-8")
    for old, new in (('"precision"', '"precisoin"'), ('"stops": [', '"stops": [3, ')):
        (place / "both/short/report.json").write_text(text.replace(old, new), encoding="utf-8")
        assert "its report is damaged or another version's" in refused("show", "both/short")
    (place / "both/short/report.json").write_text(text.replace('"seed": 3', '"seed": NaN'), encoding="utf-8")
    assert "it is damaged in a value: NaN is no number" in refused("show", "both/short", "--json")
    (place / "both/short/report.json").write_text("[" * 100_000, encoding="utf-8")
    assert "both/short/report.json: no report: it is damaged in a value: lists" in refused("show", "both/short")
    evil = "a\\u001b]0;PWN\\u0007[final]\\u202e\\nflysim: fake"
    told = text.replace('"scenario": "short"', f'"scenario": "{evil}"').replace('"name": "box"', f'"name": "{evil}"')
    (place / "both/short/report.json").write_text(told, encoding="utf-8")
    shown = typed("show", "both/short").stdout
    assert shown.count("a?]0;PWN?[final]??flysim: fake") == 2
    assert shown.isprintable() or all(line.isprintable() for line in shown.split("\n"))
    assert typed("show", "both/short", "--json").stdout.isascii()
    (place / "both/short/report.json").write_text(text[:100], encoding="utf-8")
    assert "is damaged at line" in refused("show", "both/short")


def test_a_run_without_a_folder_goes_to_runs_out_and_is_found_again(place, short):
    result = typed("run", short, "--renderer", "tiny")
    assert result.exit_code == 0, result.output
    assert "\x1b" not in result.output
    assert "Traceback" not in result.output
    (folder,) = (place / "runs/out").iterdir()
    assert re.fullmatch(r"short-\d{8}T\d{6}Z-s0", folder.name)
    assert f"run folder: runs/out/{folder.name}" in result.stdout
    for name in ("latest", "short", folder.name):
        assert str(folder.relative_to(place)) in typed("show", name).stdout
    assert "Did you mean 'short'?" in refused("show", "shrot")


WALL = (
    '<model name="box_2"><static>1</static><pose>1.2 0 0.3 0 0 0</pose><link name="l">'
    "<collision name='c'>{0}</collision><visual name='v'>{0}</visual></link></model>"
)


def test_a_blocked_robot_keeps_what_it_saw_and_says_by_what(place, short):
    wall = WALL.format("<geometry><box><size>0.1 3 0.6</size></box></geometry>")
    (short.parent / "w.sdf").write_text(SDF.format(FLOOR.format(PLANE, "") + wall), encoding="utf-8")
    text = short.read_text(encoding="utf-8").replace('"paper"', '"w.sdf"')
    stops = "stops = [{ x = 0, y = 0 }, { x = 0.3, y = 0 }, { x = 2, y = 0 }, { x = 2.5, y = 0 }]"
    short.write_text(re.sub(r"stops = .*", stops, text), encoding="utf-8")
    result = typed("run", short, "--out", "run", "--json")
    assert result.exit_code == 0, result.output
    (report,) = json.loads(result.stdout)
    assert report["status"] == "blocked"
    assert report["blocked"] == "blocked at stop 3 of 4 by box_2"
    assert [stop["index"] for stop in report["stops"]] == [0, 1]
    assert (place / "run/flies.parquet").is_file()
    assert "blocked at stop 3 of 4 by box_2" in typed("show", "run").stdout


def test_a_full_disk_leaves_nothing(place, short, monkeypatch):
    full = (
        "import errno, os, flysim.record.figures as figures\n"
        "def write_figures(folder, *_args):\n"
        "    (folder / 'path.png').write_text('{')\n"
        "    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(folder / 'planes.png'))\n"
        "figures.write_figures = write_figures\n"
    )
    monkeypatch.setattr(scribe, "_idle", [])
    monkeypatch.setattr(scribe, "_START", scribe._START.replace("from flysim", full + "from flysim"))
    assert "disk full while writing run: free some space, or name another folder" in refused(
        "run", short, "--out", "run"
    )
    assert not list(place.iterdir())


def cv2_out_of_memory():
    with pytest.raises(cv2.error) as caught:
        cv2.resize(np.zeros((1, 1), np.uint8), (2**31 - 1, 2**20))
    return caught.value


@pytest.mark.parametrize("error", [MemoryError, cv2_out_of_memory])
def test_out_of_memory_is_one_line(monkeypatch, error):
    def small(*_args):
        raise error()

    monkeypatch.setattr("flysim.runs.planned.read_scenario", small)
    assert "out of memory. Use a smaller population, image or world." in refused("run", "paper_a")


def test_the_version_is_told_by_the_command_and_the_package():
    assert typed("--version").output == f"flysim {flysim.__version__}\n"
    assert re.fullmatch(r"\d+\.\d+\.\d+\S*", flysim.__version__)
    assert versions()["flysim"] == flysim.__version__


def test_a_world_that_includes_itself_is_one_line(place):
    model = "<model name='q'><model name='n'><include><uri>s.sdf</uri></include></model></model>"
    (place / "s.sdf").write_text(f"<sdf>{model}</sdf>", encoding="utf-8")
    (place / "w.sdf").write_text(SDF.format("<include><uri>s.sdf</uri></include>"), encoding="utf-8")
    assert "include 's.sdf': 's.sdf' includes itself" in refused("preview", "w.sdf", "--out", "w.png")


def test_a_damaged_policy_is_one_line(place):
    good = find_policy("ppo").read_bytes()
    for data in (good[:900], good[:500] + bytes(40) + good[540:], b"PK\x05\x06" + bytes(18), b""):
        (place / "p.npz").write_bytes(data)
        assert "p.npz: " in refused("nav", "p.npz", "--worlds", "yard", "--observation", "truth")


def test_the_list():
    listed = json.loads(typed("list", "--json").stdout)
    assert [row["name"] for row in listed["scenarios"]] == names("runs")
    assert (listed["worlds"], listed["robots"]) == (names("worlds"), names("robots"))
    assert {"name": "paper_a", "world": "paper", "robot": "rover", "stops": 7}.items() <= listed["scenarios"][1].items()
    text = typed("list").stdout
    assert "\x1b" not in text
    assert all(name in text for name in (*names("runs"), *names("worlds"), *names("robots")))


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_every_command_shows_an_example(command):
    result = typed(*command.split(), "--help")
    assert result.exit_code == 0
    assert f"Example: flysim {command}" in result.stdout
    assert "\x1b" not in result.stdout


def test_the_help_names_every_command():
    result = typed("--help")
    assert result.exit_code == 0
    assert all(command.split()[0] in result.stdout for command in COMMANDS)
    assert all(command in typed("bench", "--help").stdout for command in ("engine", "stop"))
    assert typed("-h").stdout == result.stdout


def test_the_example_of_run_is_right():
    text = re.search(r"Example: flysim (run .*?)\s*$", typed("run", "--help").stdout, re.M)
    assert text is not None
    _, name, *options = text[1].split()
    assert name in names("runs")
    assert options == ["--seed", "7", "--set", "flies.population=3000"]


def test_a_preview_is_written_where_it_is_asked_for(place, monkeypatch):
    drawn = []
    monkeypatch.setattr("flysim.render.preview.draw_preview", lambda *arguments: drawn.append(arguments) or ())
    assert typed("preview", "yard").stdout == "yard.png\n"
    assert typed("preview", "yard", "--out", "a/b.png", "--renderer", "tiny").stdout == "a/b.png\n"
    assert drawn == [
        (find_world("yard"), Path("yard.png"), "auto", ()),
        (find_world("yard"), Path("a/b.png"), "tiny", ()),
    ]


def test_a_random_world_is_written_and_described(place):
    result = typed("world", "random", "--seed", "4", "--difficulty", "easy", "--json")
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    assert (told["path"], told["seed"], told["difficulty"]) == ("random-easy-4/world.sdf", 4, "easy")
    world = read_world(place / told["path"])
    assert [o["name"] for o in told["obstacles"]] == [link.model for link in world.links if not link.structure]
    for obstacle, link in zip(told["obstacles"], (k for k in world.links if not k.structure), strict=True):
        assert obstacle["shape"] == link.model.rpartition("_")[0]
        assert (obstacle["x_m"], obstacle["y_m"]) == pytest.approx(link.T_world_link[:2, 3])
    assert "random-easy-4 exists and is not empty" in refused("world", "random", "--seed", "4", "--difficulty", "easy")
    said = typed("world", "random", "--seed", "4", "--difficulty", "easy", "--out", "mine").stdout.splitlines()
    assert said == ["mine/world.sdf", "look at it: flysim preview mine/world.sdf"]


def test_help_shows_what_stands_in_brackets():
    """rich takes brackets for orders, and would leave out what an option is where nobody sets it."""
    shown = CliRunner().invoke(app, ["suite", "--help"], env={"COLUMNS": "120"}).output
    for words in ("[one a core]", "flysim-testbed[cluster]", "[runs/out/suite-NAME-...]"):
        assert words in shown


BARE = """<sdf version="1.9"><world name="bare">
<model name="floor"><static>true</static><link name="f">
<collision name="c"><geometry><plane><normal>0 0 1</normal><size>8 8</size></plane></geometry></collision>
<visual name="v"><geometry><plane><normal>0 0 1</normal><size>8 8</size></plane></geometry></visual></link></model>
<model name="box"><static>true</static><pose>2 0 0.2 0 0 0</pose><link name="b">
<collision name="c"><geometry><box><size>0.4 0.3 0.4</size></box></geometry></collision>
<visual name="v"><geometry><box><size>0.4 0.3 0.4</size></box></geometry></visual></link></model></world></sdf>
"""


def test_a_bare_world_says_so_before_the_drive_and_how_to_dress_it(place, short, monkeypatch):
    (place / "bare.sdf").write_text(BARE, encoding="utf-8")
    text = short.read_text(encoding="utf-8").replace('"paper"', f'"{place}/bare.sdf"')
    bare = scenario(short.parent, text, "bare.toml")
    driven = []
    monkeypatch.setattr("flysim.runs.run.run_into", lambda *_, **__: driven.append(1) or 1 / 0)
    told = typed("run", bare, "--out", "one")
    assert "bare.sdf: nothing in it has a texture" in told.stderr and "give --texture speckle" in told.stderr
    assert driven == [1]
    assert "texture" not in typed("run", bare, "--out", "two", "--texture", "speckle").stderr
    assert "texture" not in typed("run", short, "--out", "three").stderr
