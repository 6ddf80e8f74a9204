"""The benchmark itself, at sizes that take seconds: what it measures, and how it says so."""

import json
from types import SimpleNamespace

import numba
import pytest
from PIL import Image

from flysim.studies.bench import engine as module
from flysim.studies.bench.engine import bench_engine
from flysim.studies.bench.timing import Timed
from flysim.studies.table1.grid import Cell
from flysim.studies.table1.published import Published

# Of the issue: these stay from here on.
KEYS = {"machine", "ns_per_evaluation", "ms_per_generation", "cells", "sizes"}
SIZE_KEYS = {
    *("width", "height", "flies_ms", "evolve_ms", "sgbm_ms", "bm_ms", "coverage", "flies_within_0_5px"),
    *("flies_within_1px", "sgbm_within_0_5px", "sgbm_within_1px"),
}
CELL_KEYS = {"set", "population", "regions", "stop", "ms", "iterations", "paper_ms", "times_faster"}
CELLS = {Cell("A", 500, 2, 90): Published(37, 1096), Cell("C", 500, 4, 95): Published(23, 696)}


@pytest.fixture(scope="module")
def measured():
    shares = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "PUBLISHED", CELLS)
        result = bench_engine(
            repeats=1,
            sizes=((160, 120), (200, 120)),
            populations=(200, 300),
            reference=(160, 120),
            progress=lambda what, share: shares.append((what, share)),
        )
    return SimpleNamespace(result=result, data=result.to_json(), shares=shares)


def test_the_keys_are_those_that_were_promised(measured):
    assert measured.data.keys() >= KEYS
    assert all(size.keys() >= SIZE_KEYS for size in measured.data["sizes"])
    assert all(cell.keys() == CELL_KEYS for cell in measured.data["cells"])
    assert json.loads(json.dumps(measured.data, allow_nan=False))["repeats"] == 1


def test_what_is_measured_is_what_was_asked_for(measured):
    data = measured.data
    assert [(size["width"], size["height"]) for size in data["sizes"]] == [(160, 120), (200, 120)]
    assert set(data["ms_per_generation"]) == {"200", "300"}
    threads = {str(n) for n in (1, 2) if n <= numba.config.NUMBA_NUM_THREADS}
    assert set(data["ns_per_evaluation"]) == set(data["ms_per_generation_by_threads"]) == threads
    assert data["ms_per_generation"] == data["ms_per_generation_by_threads"][max(threads)]
    assert [(c["set"], c["population"], c["regions"], c["stop"], c["paper_ms"]) for c in data["cells"]] == [
        ("A", 500, 2, 90, 1096.0),
        ("C", 500, 4, 95, 696.0),
    ]
    for cell in data["cells"]:
        assert cell["times_faster"] == cell["paper_ms"] / cell["ms"]
    for size in data["sizes"]:
        assert size["flies_over_sgbm"] == size["flies_ms"] / size["sgbm_ms"]
        assert min(size[key] for key in ("flies_ms", "evolve_ms", "sgbm_ms", "bm_ms")) > 0.0


def test_flies_and_rivals_see_the_scene(measured):
    for size in measured.data["sizes"]:
        assert size["flies"] > 500
        assert 0.5 < size["flies_within_0_5px"] <= size["flies_within_1px"] <= 1.0
        assert 0.5 < size["sgbm_within_0_5px"] <= size["sgbm_within_1px"] <= 1.0
        assert 0.5 < size["bm_within_0_5px"] <= size["bm_within_1px"] <= 1.0
        assert 0.5 < size["coverage"] <= 1.0
        assert size["sgbm_density"] > 0.8
        (box,) = size["bodies"]
        assert box["name"] == "box"
        assert 0 < box["flies"] < size["flies"] / 4


def test_the_bar_never_runs_back(measured):
    shares = [share for _, share in measured.shares]
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)
    assert {what for what, _ in measured.shares} == {"draw the scene", "image sizes", "generations", "Table 1"}


def test_tables_have_a_cell_for_each_column(measured):
    sheets = measured.result.sheets()
    assert [len(sheet.rows) for sheet in sheets][1:] == [2, 2, 2]
    for sheet in sheets:
        assert all(len(row) == len(sheet.columns) for row in sheet.rows)


def test_it_is_written(measured, tmp_path):
    measured.result.write(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bench.json", "sizes.png"]
    assert json.loads((tmp_path / "bench.json").read_text(encoding="utf-8")) == json.loads(json.dumps(measured.data))
    with Image.open(tmp_path / "sizes.png") as picture:
        assert picture.size > (600, 300)


def evolutions(ms, counts):
    timed = Timed()
    timed.ms, timed.results = ms, [SimpleNamespace(iterations=count) for count in counts]
    return timed


def test_a_generation_is_what_more_of_them_take_longer():
    # 16 generations more in each round: 32, 48 and 800 ms more, of which the middle one counts.
    short, long = evolutions([10.0, 11.0, 12.0], [4, 4, 4]), evolutions([42.0, 59.0, 812.0], [20, 20, 20])
    assert module._slope(short, long, lambda swarm: swarm.iterations) == pytest.approx(48.0 / 16.0)
    # Both at an end after one generation: the whole time is its time.
    assert module._slope(evolutions([5.0], [1]), evolutions([6.0], [1]), lambda swarm: swarm.iterations) == 6.0


def test_what_it_refuses():
    with pytest.raises(ValueError, match="must not be empty"):
        bench_engine(repeats=1, sizes=())
    with pytest.raises(ValueError, match="repeats must be >= 1, got 0"):
        bench_engine(repeats=0, sizes=((160, 120),), reference=(160, 120))
