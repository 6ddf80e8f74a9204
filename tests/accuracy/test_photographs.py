"""Photographs whose depths are known: flies beside block and semi-global matching, by the same scores."""

from pathlib import Path

import pytest

from flysim.studies.photographs.pairs import known_pairs
from flysim.studies.photographs.photographs import run_photographs

pytestmark = pytest.mark.accuracy
DATA = Path(__file__).parents[3] / "shared" / "data" / "stereo"


def test_flies_are_nearer_to_the_truth_than_block_and_semi_global_matching():
    if not DATA.is_dir():
        pytest.skip(f"the photographs are not here: {DATA}")
    scores = run_photographs("photographs", known_pairs(None, DATA), ("flies", "bm", "sgbm"), seed=41).pairs
    assert set(scores) == {"cones", "teddy", "motorcycle_q", "tsukuba"}
    for name, by_engine in scores.items():
        flies = by_engine["flies"]
        assert flies.seen.within_1px > by_engine["bm"].seen.within_1px, name
        assert flies.seen.within_1px > by_engine["sgbm"].seen.within_1px, name
        assert flies.matches > 1100 and flies.coverage > 0.65, name
    assert scores["motorcycle_q"]["flies"].seen.median_m < 0.006
