"""`flysim check`: what is read of a file, what is left out, and whether a robot can drive there."""

import json

import pytest
from typer.testing import CliRunner

from flysim.cli.app import app

GROUND = '<model name="ground"><static>true</static><link name="l">{}{}</link></model>'.format(
    *(
        f'<{tag} name="c"><geometry><plane><size>20 20</size></plane></geometry></{tag}>'
        for tag in ("collision", "visual")
    )
)


def body(name, geometry, pose, tags=("collision", "visual"), extra=""):
    parts = "".join(f'<{tag} name="c"><geometry>{geometry}</geometry>{extra}</{tag}>' for tag in tags)
    return f'<model name="{name}"><static>true</static><pose>{pose}</pose><link name="l">{parts}</link></model>'


CRATE = "<box><size>0.4 0.4 0.4</size></box>"


@pytest.fixture
def asked(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def ask(inside, *words):
        (tmp_path / "w.sdf").write_text(f'<sdf version="1.9"><world name="w">{inside}</world></sdf>')
        return CliRunner().invoke(app, ["check", "w.sdf", *words])

    return ask


def test_a_world_is_told_with_what_was_left_out(asked):
    inside = (
        GROUND
        + body("crate", CRATE, "2 0 0.2 0 0 0.3")
        + body("screen", "<box><size>0.1 4 1</size></box>", "4 0 0.5 0 0 0")
        + body("lamp", "<mesh><uri>lamp.dae</uri></mesh>", "1 1 0 0 0 0", ("visual",))
    )
    found = asked(inside, "--json")
    assert found.exit_code == 0, found.output
    data = json.loads(found.stdout)
    assert data["kind"] == "world"
    assert data["floor"] == {"z_m": 0.0, "models": ["ground"]}
    assert data["walls"] == ["screen"]
    (crate,) = data["obstacles"]
    assert (crate["name"], crate["size_m"], crate["yaw_deg"], crate["texture"]) == ("crate", [0.4] * 3, 17.19, False)
    assert data["room"]["start_m"] == [0.0, 0.0]
    (said,) = data["left_out"]
    assert "'lamp.dae: does not exist'" in said
    text = asked(inside)
    assert "crate" in text.stdout
    assert "0.40 x 0.40 x 0.40" in text.stdout
    assert "z = 0.000 m: ground" in text.stdout
    assert "1 of 1 bare" in text.stdout
    assert "warning: a mesh cannot be read" in text.stderr


@pytest.mark.parametrize(
    ("inside", "said"),
    [
        (GROUND + "<gravity>0 0 0</gravity>", "wheels do not drive without gravity"),
        (body("crate", CRATE, "2 0 0.2 0 0 0"), "it has no floor"),
    ],
)
def test_where_nothing_can_drive_it_says_why(asked, inside, said):
    found = asked(inside, "--json")
    assert found.exit_code == 2
    assert said in found.stderr and said in " ".join(json.loads(found.stdout)["problems"]), found.output


def test_warnings_are_told_with_the_error(asked):
    found = asked(GROUND + "<include><uri>https://example.org/tree</uri></include><gravity>0 0</gravity>")
    assert found.exit_code == 2
    first, second = found.stderr.strip().splitlines()
    assert "an included model is not at hand and is left out: 'https://example.org/tree" in first
    assert "must hold 3 numbers" in second


def test_the_floor_is_told_with_its_height(asked):
    slab = body("slab", "<box><size>8 8 0.1</size></box>", "0 0 -0.016 0 0 0")
    data = json.loads(asked(slab + body("crate", CRATE, "2 0 0.234 0 0 0"), "--json").stdout)
    assert data["floor"]["z_m"] == 0.034
    assert data["obstacles"][0]["center_m"][2] == pytest.approx(0.2)
    assert "the floor is at z = 0.034" in data["left_out"][0]


def test_a_robot_and_a_scenario_are_told_too():
    robot = json.loads(CliRunner().invoke(app, ["check", "rover", "--json"]).stdout)
    assert (robot["kind"], robot["drive"]["radius"], robot["baseline"]) == ("robot", 0.05, pytest.approx(0.12))
    found = CliRunner().invoke(app, ["check", "paper_a", "--json"])
    assert found.exit_code == 0, found.output
    data = json.loads(found.stdout)
    assert (data["kind"], data["world"]["name"], data["robot"]["name"], data["problems"]) == (
        *("scenario", "paper", "rover"),
        [],
    )


def test_an_unknown_name_is_one_line():
    found = CliRunner().invoke(app, ["check", "yrad"])
    assert found.exit_code == 2
    assert "Did you mean 'yard'?" in found.stderr
