"""The picture of what each flaw of a camera looks like, and the command that draws it."""

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from flysim.cli.app import app
from flysim.record.document import report_markdown
from flysim.render.light import LightParams
from flysim.runs.scenario import read_scenario
from flysim.sensors.calibration import CalibrationParams
from flysim.sensors.parameters import SensorParams
from flysim.studies.compare.compare import compare
from flysim.studies.sensors.grid import ALL, draw_effects, effects_of

DOC = Path(__file__).resolve().parents[2] / "docs/sensors.md"
BELIEVED = {"focal_error", "baseline_error", "cx_error_px", "cy_error_px"}  # they change no image


def typed(*arguments):
    return CliRunner().invoke(app, ["sensors", *(str(a) for a in arguments)], prog_name="flysim")


def test_every_figure_that_changes_an_image_is_shown_for_a_scenario_that_has_none():
    shown = {key for effect in ALL for key in (*effect.sensors, *effect.calibration, *effect.light)}
    known = {key for kind in (SensorParams, CalibrationParams, LightParams) for key in kind.__dataclass_fields__}
    # Those of the left eye do what those of the right one do.
    twins = {"defocus_left", "gain_left", "gamma_left", "offset_left"}
    assert known - shown == BELIEVED | twins | {"k2", "p2", "exposure_lag"}
    assert effects_of(read_scenario("yard")) == ALL


def test_what_a_scenario_disturbs_is_shown_one_by_one_and_together():
    overrides = ["sensors.noise=5", "sensors.auto_exposure=90", "sensors.exposure_lag=2", "calibration.row_shift_px=2"]
    effects = effects_of(read_scenario("yard", overrides))
    assert [effect.words for effect in effects] == [
        "auto_exposure 90.0",
        "auto_exposure 90.0, exposure_lag 2",
        "noise 5.0",
        "row_shift_px 2.0",
        "auto_exposure 90.0, exposure_lag 2, noise 5.0, row_shift_px 2.0",
    ]
    assert len(effects_of(read_scenario("yard", ["sensors.noise=5"]))) == 1


def test_the_picture_holds_the_images_pixel_by_pixel(tmp_path):
    plan = read_scenario("paper_a", ["sensors.gain_right=0.5"])
    captions = draw_effects(plan, tmp_path / "some.png", width=64, renderer="tiny")
    assert captions == ("paper_a, stop 1, as drawn", "gain_right 0.5")
    with Image.open(tmp_path / "some.png") as picture:
        sheet = np.asarray(picture).astype(float)
    assert sheet.shape == (48 + 16 + 4, 2 * (64 + 4 + 64 + 8), 3)
    drawn, dim = (sheet[16:64, x : x + 132] for x in (4, 144))
    np.testing.assert_array_equal(drawn[:, :64], dim[:, :64])
    np.testing.assert_allclose(dim[:, 68:], 0.5 * drawn[:, 68:], atol=0.5)


def test_the_command_draws_all_effects(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = typed("paper_a", "--renderer", "tiny", "--width", 32, "--stop", 2)
    assert result.exit_code == 0, result.output
    assert result.stdout.strip() == "paper_a-sensors.png"
    with Image.open("paper_a-sensors.png") as sheet:
        assert sheet.size == (3 * (32 + 4 + 32 + 8), 9 * (24 + 16 + 4))  # tiny draws four of the seven lights


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("yrad",), "no scenario 'yrad'. Did you mean 'yard'?"),
        (("paper_a", "--stop", 99), "paper_a has stops 1 to 7, no stop 99."),
        (("paper_a", "--width", 5), "--width must be from 32 to 2,048, got 5."),
        (("paper_a", "--set", "sensors.nois=5"), "unknown key 'sensors.nois'. Did you mean 'noise'?"),
        (("paper_a", "--set", "sensors.k1=-0.4"), "folds the image of 640x480 px: take less."),
        (("paper_a", "--renderer", "gll"), "no renderer 'gll'. Did you mean 'gl'?"),
        (("paper_a", "--renderer", "tiny", "--width", 32, "--out", "nowhere/a.png"), "cannot read or write nowhere"),
    ],
)
def test_a_mistake_is_one_line(arguments, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = typed(*arguments)
    assert result.exit_code == 2
    assert result.stderr.startswith("flysim: ") and said in result.stderr and result.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_the_page_has_every_parameter_with_its_default_and_the_command_of_its_picture():
    text = DOC.read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `(\w+)` \| (?:[^|]*) \| (\S+) \|", text, re.M))
    for kind in (SensorParams, CalibrationParams, LightParams):
        for name in kind.__dataclass_fields__:
            default = getattr(kind(), name)
            texts = {bool: lambda it: str(it).lower(), tuple: lambda it: ",".join(f"{part:g}" for part in it)}
            assert rows.pop(name) == texts.get(type(default), "{:g}".format)(default)
    assert not rows
    (command,) = re.findall(r"^    flysim sensors (.*docs/sensors\.png)$", text, re.M)
    assert (DOC.parent / "sensors.png").is_file() and "--width" in command


def test_a_comparison_says_what_was_disturbed():
    plan = read_scenario("paper_a", ["sensors.noise=3"])
    plan = plan.model_copy(update={"stops": plan.stops[:1]})
    one = compare(plan, ["bm"], renderer="tiny")
    assert one.to_json()["sensors"] == {"noise": 3.0}
    assert one.sheet().title.endswith(", sensors.noise 3.0")
    page = report_markdown(one.reports["bm"].to_json())
    assert "Disturbed: sensors.noise 3.0." in page
