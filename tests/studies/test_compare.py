"""Engines on one drive: the same stops, each its own report."""

import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from flysim.engines.choose import ENGINES
from flysim.errors import EngineError
from flysim.evaluate.track import whole_track
from flysim.products.obstacle import Obstacle
from flysim.runs.run import run
from flysim.runs.scenario import read_scenario
from flysim.studies.compare.compare import compare
from flysim.studies.compare.figures import top_figure, write_comparison


@pytest.fixture
def comparison(short):
    return compare(read_scenario(str(short)), seed=3, renderer="tiny")


def timeless(report):
    data = report.to_json()
    for stop in data["stops"]:
        stop.pop("time_s")
    data.pop("time_s")
    return data


def test_every_engine_sees_the_same_and_the_flies_what_a_run_sees(short, comparison):
    assert tuple(comparison.reports) == ENGINES.builtin
    first = comparison.findings["flies"]
    for name, findings in comparison.findings.items():
        assert findings.engine == comparison.reports[name].engine == name
        assert [one.frame for one in findings.seen] == [one.frame for one in first.seen]
        assert len(findings.cloud.points) > 0
    alone = run(str(short), seed=3, renderer="tiny")
    assert timeless(alone) == timeless(comparison.reports["flies"])
    rival = run(str(short), seed=3, renderer="tiny", overrides=["engine=bm"])
    assert timeless(rival) == timeless(comparison.reports["bm"])


def test_the_json_has_all_figures_and_the_table_a_row_an_engine(comparison):
    data = json.loads(json.dumps(comparison.to_json(), allow_nan=False))
    assert {"scenario", "seed", "renderer", "stops", "engine"} <= data.keys()
    for figures in data["engine"].values():
        assert {
            *("f1", "precision", "recall", "center_error_m", "size_error_m", "size_error_rel", "surface_f"),
            *("ms_per_stop", "missed_big", "worst_obstacle"),
        } <= figures.keys()
        assert figures["ms_per_stop"] > 0.0
    sheet = comparison.sheet()
    assert [row[0] for row in sheet.rows] == list(ENGINES.builtin)
    assert all(len(row) == len(sheet.columns) for row in sheet.rows)


def test_the_folder(tmp_path, comparison):
    write_comparison(tmp_path, comparison)
    assert json.loads((tmp_path / "compare.json").read_text(encoding="utf-8")) == comparison.to_json()
    assert {path.stem for path in (tmp_path / "reports").iterdir()} == set(ENGINES.builtin)
    for name in ("top.png", "depth.png"):
        with Image.open(tmp_path / "figures" / name) as image:
            picture = np.asarray(image.convert("RGB"))
        assert min(picture.shape[:2]) > 300
        # True outlines are blue, believed ones orange; a point's depth has a colour.
        assert (np.ptp(picture.astype(int), axis=2) > 100).sum() > 200


def test_nonsense_is_refused(short):
    plan = read_scenario(str(short))
    with pytest.raises(EngineError, match="Did you mean 'flies'"):
        compare(plan, ("flise",))
    told = []
    with pytest.raises(EngineError, match="no module 'nowhere_at_all'"):  # and nobody has driven by then
        compare(plan, ("flies", "nowhere_at_all:see"), progress=lambda *step: told.append(step))
    assert not told
    for engines in ((), ("bm", "bm")):
        with pytest.raises(ValueError, match="engines must be named once each"):
            compare(plan, engines)


def test_from_above_what_is_round_is_round_and_the_way_is_the_one_that_was_driven(comparison):
    center, size, flies = np.array([1.5, 0.2, 0.25]), np.array([0.3, 0.3, 0.5]), np.zeros(0, np.int64)
    pillar = Obstacle(shape="cylinder", center=center, size=size, yaw=0.0, flies=flies)
    findings = replace(comparison.findings["flies"], obstacles=(pillar,))
    figure = top_figure(replace(comparison, findings={"flies": findings}))
    axes = figure.axes[0]
    (outline,) = (patch.get_xy() for patch in axes.patches if patch.get_linestyle() == "--")
    assert np.linalg.norm(outline - center[:2], axis=1) == pytest.approx(0.15, abs=0.002)
    way = whole_track(findings, comparison.truth).true
    driven = max(axes.lines, key=lambda line: len(line.get_xdata()))
    assert len(way) > len(comparison.truth.stops)
    assert np.array_equal(driven.get_xydata(), way[:, :2])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "y [m]")
    assert len(figure.legends[0].get_texts()) == 4
