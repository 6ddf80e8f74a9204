"""`pairs` of a scenario, and the same way with stops at other distances."""

import math

import pytest

from flysim.errors import ScenarioError
from flysim.runs.pairs import pair_rule
from flysim.runs.respaced import respaced
from flysim.runs.scenario import make_scenario, read_scenario
from flysim.sources.pairing import PairRule

STOPS = [{"x": 0.0, "y": 0.0}, {"x": 1.0, "y": 0.0, "yaw_deg": 90}, {"x": 1.0, "y": 0.5, "yaw_deg": 170}]


def made(**more):
    return make_scenario({"world": "paper", "stops": STOPS, **more}, "here.toml")


def test_who_says_nothing_has_two_eyes():
    assert pair_rule(made().pairs) is None
    assert pair_rule(made(pairs="consecutive").pairs) == PairRule()
    rule = pair_rule(made(pairs={"baseline": [0.1, 0.6]}).pairs)
    assert rule == PairRule(consecutive=False, least=0.1, most=0.6)


def test_it_is_kept_with_a_run_and_read_again(tmp_path):
    for pairs in ("consecutive", "{baseline=[0.1,0.6]}"):
        plan = read_scenario("paper_a_mono", [f"pairs={pairs}"])
        kept = plan.kept(tmp_path, 3)
        again = make_scenario({key: value for key, value in kept.items() if key != "name"})
        assert again.pairs == plan.pairs


@pytest.mark.parametrize(
    ("pairs", "words"),
    [
        ("consecutiv", "Did you mean 'consecutive'?"),
        ("both", "got 'both'. Known: consecutive, stereo."),
        ({"baselines": [0.1, 0.6]}, 'pairs = "stereo", "consecutive" or { baseline = [0.1, 0.6] }'),
        ({"baseline": [0.1]}, "baseline must be two numbers [m]"),
        ({"baseline": [0.1, "far"]}, "baseline must be two numbers [m]"),
        ({"baseline": [0.6, 0.1]}, "two numbers 0 < least < most [m], got [0.6, 0.1]"),
        (3, 'pairs = "stereo"'),
    ],
)
def test_what_it_cannot_be_is_one_line(pairs, words):
    with pytest.raises(ScenarioError) as told:
        made(pairs=pairs)
    said = str(told.value)
    assert said.startswith("here.toml: pairs: ") and words in said and "\n" not in said


def test_the_same_way_in_other_hops():
    stops = respaced(made(), 0.25).stops
    assert [(one.x, one.y) for one in stops] == [(0, 0), (0.25, 0), (0.5, 0), (0.75, 0), (1, 0), (1, 0.25), (1, 0.5)]
    assert [one.yaw_deg for one in stops] == pytest.approx([0, 22.5, 45, 67.5, 90, 130, 170])


def test_a_heading_turns_the_short_way_and_points_on_the_way_are_driven_over():
    stops = [{"x": 0, "y": 0, "yaw_deg": 170}, {"x": 1, "y": 1, "yaw_deg": -170, "via": [[1, 0]]}]
    found = respaced(made(stops=stops), 0.5).stops
    assert [(one.x, one.y) for one in found] == [(0, 0), (0.5, 0), (1, 0), (1, 0.5), (1, 1)]
    assert [math.cos(math.radians(one.yaw_deg)) < -0.98 for one in found] == [True] * 5
    assert found[2].yaw_deg == pytest.approx(-180.0)


@pytest.mark.parametrize("hop", [0.0, 1.6, 1e-4, -1.0])
def test_a_hop_that_does_not_fit_is_refused(hop):
    with pytest.raises(ScenarioError, match=r"its way is 1.5 m long, and hops must be from 0.0015 to 1.5 m"):
        respaced(made(), hop)
