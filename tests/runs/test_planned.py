"""`flysim run --world`: anybody's world through the command line, and what it refuses in one line."""

import gzip
import json

import pytest
from typer.testing import CliRunner

from flysim.cli.app import app
from flysim.errors import ScenarioError
from flysim.evaluate.report import Report
from flysim.runs.planned import world_scenario
from flysim.runs.scenario import make_scenario

GROUND = (
    '<model name="ground"><static>1</static><link name="l">{}<visual name="v"><geometry><plane><normal>0 0 1</normal>'
    "<size>100 100</size></plane></geometry></visual></link></model>"
).format(
    '<collision name="c"><geometry><plane><normal>0 0 1</normal><size>100 100</size></plane></geometry></collision>'
)
BOX = "<box><size>0.4 0.3 0.4</size></box>"
QUICK = ("--set", "flies.population=300", "--set", "flies.max_iterations=4", "--renderer", "tiny")


def body(name, shape, pose):
    geometry = f"<geometry>{shape}</geometry>"
    return (
        f'<model name="{name}"><static>1</static><pose>{pose}</pose><link name="l"><collision name="c">{geometry}'
        f'</collision><visual name="v">{geometry}</visual></link></model>'
    )


def written(folder, *models, name="mine.world"):
    text = f'<sdf version="1.6"><world name="w">{"".join(models)}</world></sdf>'
    path = folder / name
    path.write_bytes(gzip.compress(text.encode()) if name.endswith(".gz") else text.encode())
    return path


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def typed(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments], prog_name="flysim")


def refused(*arguments):
    result = typed(*arguments)
    assert (result.exit_code, result.stdout) == (2, ""), result.output
    assert result.stderr.count("\n") == 1
    return result.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "name scenarios (flysim list), or give --world FILE in their place: one of the two."),
        (["paper_a", "--world", "paper"], "or give --world FILE in their place: one of the two."),
        (["paper_a", "--path", "orbit"], "and --models go with --world; a scenario has its own robot"),
        (["--world", "paper", "--path", "orbt"], "no path 'orbt'. Did you mean 'orbit'?"),
        (["--world", "papr"], "no world 'papr'. Did you mean 'paper'?"),
        (["--world", "none.world.gz"], "no world file 'none.world.gz'."),
        (["--world", "paper", "--robot", "rovr"], "no robot 'rovr'. Did you mean 'rover'?"),
        (
            ["--world", "paper", "--texture", "spekle"],
            "texture: Input should be 'speckle', 'tiles' or 'blinds', got 'spekle'.",
        ),
        (["paper_a", "--texture", "spekle"], "texture: Input should be 'speckle', 'tiles' or 'blinds', got 'spekle'."),
        (["--world", "paper", "--set", "stops=[]"], "--set stops: the path is planned"),
        (["--world", "paper", "--set", "flies.populaton=3"], "unknown key 'flies.populaton'. Did you mean"),
    ],
)
def test_a_mistake_is_one_line(here, arguments, said):
    assert said in refused("run", *arguments)
    assert not list(here.iterdir())


@pytest.mark.parametrize(
    ("models", "said"),
    [
        ([], "the robot can stand nowhere: it has no floor"),
        ([GROUND, body("ball", "<sphere><radius>0</radius></sphere>", "2 0 1 0 0 0")], "a size must be from 0.0001"),
        ([GROUND, "<gravity>0 0 0</gravity>"], "wheels do not drive without gravity"),
    ],
)
def test_a_world_that_cannot_be_driven_in_is_one_line(here, models, said):
    assert said in refused("run", "--world", written(here, *models))


def test_a_bare_gzipped_world_is_driven_dressed_and_said_so(here):
    plugin = '<plugin name="p" filename="libfoo.so"/>'
    inside = body("b", "<sphere><radius>0.1</radius></sphere>", "2 0 0.2 0 0 0")  # all of it in the box
    path = written(here, plugin, GROUND, body("a", BOX, "2 0 0.2 0 0 0"), inside, name="mine.world.gz")
    result = typed("run", "--world", path, "--path", "frontal", "--texture", "speckle", "--json", *QUICK, "--out", "o")
    assert result.exit_code == 0, result.output
    (report,) = json.loads(result.stdout)
    assert report["scenario"] == "mine-frontal"
    assert (report["status"], report["texture"]) == ("ok", "speckle")
    assert [obstacle["name"] for obstacle in report["obstacles"]] == ["a+b"]
    assert report["warnings"] == ["<plugin> is not read: 'p' in the world."]
    assert result.stderr == "flysim: warning: <plugin> is not read: 'p' in the world.\n"
    assert "dressed in speckle" in str(Report.from_json(report))
    assert Report.from_json(report).to_json() == report
    config = json.loads((here / "o/config.json").read_text(encoding="utf-8"))["scenario"]
    assert len(config["stops"]) == report["stops_planned"]
    assert make_scenario(config).stops == world_scenario(path, path="frontal").stops  # the file is a scenario again


def test_a_world_of_structure_alone_has_a_figure(here):
    path = written(here, GROUND, body("partition", "<box><size>0.1 3 0.5</size></box>", "3 0 0.25 0 0 0"))
    result = typed("run", "--world", path, "--json", *QUICK, "--out", "o")
    assert result.exit_code == 0, result.output
    (report,) = json.loads(result.stdout)
    assert (report["stops_planned"], report["obstacles"], report["texture"]) == (6, [], None)
    assert "the world has no obstacle: in place of path orbit a look once round from the start." in result.stderr


def test_points_on_the_way_are_driven_through():
    from flysim.runs.run import travel

    stops = [{"x": 0.0, "y": 0.0}, {"x": 0.6, "y": 0.0, "via": [[0.3, 0.3]]}]
    plan = make_scenario({"world": "paper", "stops": stops, "flies": {"population": 100, "max_iterations": 2}})
    _, truth = travel(plan, seed=0, renderer="tiny")
    assert len(truth.stops) == 2
    track = truth.stops[1].track
    assert abs(track[:, 1:3] - (0.3, 0.3)).max(axis=1).min() < 0.02
    assert (track[1:, 0] > track[:-1, 0]).all() or (abs(track[1:, 0] - track[:-1, 0]) < 1e-9).sum() < 3


def test_a_planned_scenario_says_what_it_is():
    plan = world_scenario("yard", overrides=["flies.population=700"])
    assert (plan.name, plan.flies.population, plan.flies.operators, plan.texture) == ("yard-orbit", 700, "C", None)
    with pytest.raises(ScenarioError, match="no path 'round'"):
        world_scenario("yard", path="round")
