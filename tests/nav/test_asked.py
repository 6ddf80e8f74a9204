"""What a command line sets for an environment."""

import io
import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from PIL import Image
from robot_text import BLIND
from typer.testing import CliRunner

from flysim.cli.app import app
from flysim.errors import FlysimError
from flysim.flies.parameters import FlyParams
from flysim.nav.asked import arguments_of, asked_settings
from flysim.nav.film import Film
from flysim.nav.seeing import FLIES
from flysim.nav.settings import Settings
from flysim.nav.trial import tasks_for


def test_tables_go_to_the_environment_and_agents_have_their_own():
    words = ("flies.population=300", "light.level=0.3", "drive.v_max=0.4", "vfh.look=1.2")
    settings, params = asked_settings(words, ["vfh"], robot="barn_rover", texture="speckle")
    assert params == {"vfh": {"look": 1.2}}
    assert json.loads(json.dumps(settings)) == settings
    found = Settings.of(arguments_of(settings, "flies"))
    assert (found.robot, found.texture, found.v_max, found.light) == ("barn_rover", "speckle", 0.4, {"level": 0.3})
    assert isinstance(found.flies, FlyParams)
    assert (found.flies.population, found.flies.window) == (300, FLIES.window)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["lihgt.level=1"], r"--set lihgt: no table and no agent that drives. Did you mean 'light'\?"),
        (["light=1"], "--set light: write TABLE.KEY=VALUE"),
        (["flies.populaton=3"], r"flies has no 'populaton'. Did you mean 'population'\?"),
        (["flies.search.x=3"], "flies.search has no 'x'"),
        (["drive.speed=3"], "drive has no 'speed' here"),
        (["drive.v_max=-1"], "v_max"),
        (["sensors.nois=3"], r"sensors has no 'nois'. Did you mean 'noise'\?"),
    ],
)
def test_what_cannot_be_set_is_said(words, said):
    with pytest.raises(FlysimError, match=said):
        arguments_of(asked_settings(words, ["vfh"])[0], "flies")


def test_no_such_robot_or_texture():
    with pytest.raises(FlysimError, match=r"no robot 'rovr'. Did you mean 'rover'\?"):
        asked_settings((), robot="rovr")
    with pytest.raises(FlysimError, match="--texture tiles"):
        asked_settings((), texture="tiles")


def test_what_is_set_goes_before_what_barn_sets(tmp_path):
    (task,) = tasks_for(["vfh"], "yard", episodes=1, observation="truth", settings={"robot": "barn_rover"})
    assert task.settings["robot"] == "barn_rover" and not task.filmed


def test_a_film_plays_as_fast_as_was_driven():
    film, shown = Film(), 0
    for k in range(7):
        if film.wants():
            film.add(np.full((360, 840, 3), 30 * k, np.uint8))
            shown += 1
    picture = Image.open(io.BytesIO(film.done()))
    assert (shown, picture.n_frames, picture.size) == (4, 4, (560, 240))
    picture.load()
    assert picture.info["duration"] == 200


def test_nav_keeps_a_row_and_a_film_of_each_episode(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = [
        "nav",
        "straight",
        "--observation",
        "truth",
        "--episodes",
        "2",
        "--out",
        "here",
        "--processes",
        "1",
        "--json",
    ]
    done = CliRunner().invoke(app, [*words, "--videos", "--renderer", "tiny", "--set", "drive.v_max=0.3"])
    assert done.exit_code == 0, done.output
    told = json.loads((tmp_path / "here/nav.json").read_text(encoding="utf-8"))
    assert told["asked"]["settings"] == {"drive": {"v_max": 0.3}}
    assert pq.read_table(tmp_path / "here/episodes.parquet").to_pylist() == told["episodes"]
    assert len(told["episodes"]) == 2 and "film" not in told["episodes"][0]
    names = sorted(path.name for path in (tmp_path / "here/videos").iterdir())
    assert names == ["straight-yard-s0.webp", "straight-yard-s1.webp"]
    with Image.open(tmp_path / "here/videos" / names[0]) as picture:
        assert picture.n_frames >= told["episodes"][0]["steps"] // 2
    refused = CliRunner().invoke(app, ["nav", "straight", "--videos"])
    assert refused.exit_code == 2 and "--videos needs a folder to lie in: --out DIR." in refused.stderr


def test_nav_takes_models_wheels_and_cameras_and_says_what_is_left_out(tmp_path, monkeypatch, world):
    monkeypatch.chdir(tmp_path)
    crate = (
        '<model name="crate"><static>1</static><pose>-2 0 0.2 0 0 0</pose><link name="l"><collision name="c"><geometry>'
        "<box><size>.4 .4 .4</size></box></geometry></collision></link></model>"
    )
    away = "".join(f"<include><uri>model://{name}</uri></include>" for name in ("crate", "gone"))
    text = Path(world).read_text(encoding="utf-8")
    (tmp_path / "w.sdf").write_text(text.replace("</world>", f"{away}</world>"), encoding="utf-8")
    (tmp_path / "shelf/crate").mkdir(parents=True)
    (tmp_path / "shelf/crate/model.sdf").write_text(f"<sdf>{crate}</sdf>", encoding="utf-8")
    blind = BLIND.replace("left_wheel_joint", "left_joint").replace("right_wheel_joint", "right_joint")
    (tmp_path / "r.urdf").write_text(blind, encoding="utf-8")
    words = ["nav", "straight", "--worlds", "w.sdf", "--observation", "truth", "--robot", "r.urdf", "--processes", "1"]
    words += ["--out", "here", "--renderer", "tiny", "--json"]
    more = ["--models", "shelf", "--wheels", "left_joint", "right_joint", "--cameras", "stereo"]
    done = CliRunner().invoke(app, [*words, *more])
    assert done.exit_code == 0, done.output
    asked = json.loads((tmp_path / "here/nav.json").read_text(encoding="utf-8"))["asked"]["settings"]
    assert asked == {
        "robot": "r.urdf",
        "models": ["shelf"],
        "wheels": ["left_joint", "right_joint"],
        "cameras": "stereo",
    }
    assert "model://gone" in done.stderr and "model://crate" not in done.stderr
    assert "the rover's pair of cameras is mounted" in done.stderr
    for wrong, said in (
        (["--models", "nowhere"], "--models nowhere: there is no such folder"),
        (["--cameras", "stero"], "Did you mean 'stereo'?"),
        (["--wheels", "a", "b"], "no continuous joint 'a'"),
    ):
        refused = CliRunner().invoke(app, [*words[:-3], *wrong])
        assert refused.exit_code == 2 and said in refused.stderr


@pytest.mark.parametrize("wrong", [{"wheels": ("a",)}, {"models": "here"}, {"wheels": "ab"}])
def test_wheels_and_models_are_names(wrong):
    with pytest.raises(ValueError, match="must hold"):
        Settings(**wrong)
