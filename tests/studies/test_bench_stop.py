"""The first stop by each renderer, on a scenario small enough for a test."""

import json

import pytest

from flysim.render.choose import gl_works
from flysim.runs.scenario import read_scenario
from flysim.studies.bench.stop import bench_stop


def test_every_renderer_of_this_machine_is_timed(short):
    shares = []
    result = bench_stop([read_scenario(str(short))], repeats=1, progress=lambda _what, share: shares.append(share))
    data = json.loads(json.dumps(result.to_json(), allow_nan=False))
    assert data.keys() == {"machine", "repeats", "stops"}
    assert [stop["renderer"] for stop in data["stops"]] == (["gl", "tiny"] if gl_works() else ["tiny"])
    for stop in data["stops"]:
        assert (stop["scenario"], stop["width"], stop["height"]) == ("short", 160, 120)
        assert stop["look_ms"] > 0.0
        assert stop["least_ms"] <= stop["stop_ms"] <= stop["most_ms"]
    (sheet,) = result.sheets()
    assert all(len(row) == len(sheet.columns) for row in sheet.rows)
    assert shares == sorted(shares) and shares[-1] == 1.0


def test_no_round_is_refused(short):
    with pytest.raises(ValueError, match="repeats must be >= 1"):
        bench_stop([read_scenario(str(short))], repeats=0)
