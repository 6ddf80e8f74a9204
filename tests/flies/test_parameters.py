import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flysim.flies.parameters import OPERATOR_SETS, FlyParams


def test_the_sets_are_those_of_section_4_1():
    assert OPERATOR_SETS == {"A": (0.4, 0.1, 0.4, 0.1), "B": (0.5, 0.2, 0.2, 0.1), "C": (0.4, 0.2, 0.2, 0.2)}
    assert FlyParams(operators="B").shares == (0.5, 0.2, 0.2, 0.1)


def test_shares_of_ones_own():
    assert FlyParams(operators=(0.25, 0.25, 0.5, 0.0)).shares == (0.25, 0.25, 0.5, 0.0)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"population": 9}, r"population must be in \[10, .* flies, got 9"),
        ({"population": 10**7}, "got 10000000"),
        ({"operators": "D"}, "operators must be A, B, C or four shares, got 'D'"),
        ({"operators": (0.4, 0.2, 0.2, 0.3)}, r"sum to 1, got \(0\.4, 0\.2, 0\.2, 0\.3\)"),
        ({"operators": (0.5, 0.5)}, "four shares"),
        ({"operators": (0.6, 0.6, -0.2, 0.0)}, r"in \[0, 1\]"),
        ({"operators": (math.nan, 0.5, 0.3, 0.2)}, "got .*nan"),
        ({"operators": (0.0, 0.5, 0.3, 0.2)}, r"share of selection must be in \(0, 1\), got 0\.0"),
        ({"operators": (1.0, 0.0, 0.0, 0.0)}, r"share of selection must be in \(0, 1\), got 1\.0"),
        ({"regions": 3}, r"regions must be 1, 2, 4 or \(rows, columns\) up to 16, got 3"),
        ({"regions": (2, 17)}, r"regions must be .*got \(2, 17\)"),
        ({"regions": (2, 2, 2)}, "regions must be .*got"),
        ({"crossover": "both"}, "crossover must be one of interpolate, extrapolate, .*got 'both'"),
        ({"tails": "long"}, "tails must be one of gaussian, heavy, got 'long'"),
        ({"left_right": -1.0}, "left_right must be in .*got -1"),
        ({"fitness": "best"}, "fitness must be .*got 'best'"),
        ({"mutation": "cubic"}, "mutation must be .*got 'cubic'"),
        ({"window": 6}, "window must be odd, got 6 px"),
        ({"window": 1}, "window must be in .*got 1"),
        ({"sharing_cell": 0}, "sharing_cell must be in .*got 0"),
        ({"sharing_strength": -1.0}, "sharing_strength must be in .*got -1"),
        ({"mutation_px": 0.0}, "mutation_px must be in .*got 0"),
        ({"mutation_disparity_px": math.nan}, "mutation_disparity_px must be in .*got nan"),
        ({"mutation_m": 0.0}, "mutation_m must be in .* m, got 0"),
        ({"slant": -0.1}, "slant must be in .*got -0.1"),
        ({"polish": -1}, "polish must be in .*got -1"),
        ({"stop": 0.0}, "stop must be in .*got 0"),
        ({"stop": 1.01}, "stop must be in .*got 1.01"),
        ({"settled_fitness": math.inf}, "settled_fitness must be in .*got inf"),
        ({"max_iterations": 0}, "max_iterations must be in .*got 0"),
        ({"min_depth": 0.0}, "min_depth must be in .* m, got 0"),
        ({"min_depth": 2.0, "max_depth": 2.0}, r"max_depth must be > min_depth = 2\.0 m, got 2\.0 m"),
        ({"min_depth": 3.0, "max_depth": 2.0}, r"max_depth must be > min_depth = 3\.0 m, got 2\.0 m"),
        ({"max_depth": math.inf}, "max_depth must be in .*got inf"),
        ({"misfit": -1.0}, "misfit must be in .*got -1"),
        ({"uniqueness": math.nan}, "uniqueness must be in .*got nan"),
    ],
)
def test_nonsense_is_refused_at_birth_by_its_figure(change, says):
    with pytest.raises(ValueError, match=says):
        FlyParams(**change)


def test_an_unknown_parameter_is_refused():
    with pytest.raises(TypeError, match="populatoin"):
        FlyParams(populatoin=100)


@given(st.integers(10, 10_000), st.integers(50, 2000), st.integers(50, 2000), st.sampled_from("ABC"))
def test_there_is_about_one_sharing_cell_for_each_preserved_fly(population, width, height, operators):
    params = FlyParams(population=population, operators=operators)
    cell = params.cell(width, height)
    preserved = population * params.shares[0]
    assert cell == 2 or (cell - 0.51) ** 2 <= width * height / preserved <= (cell + 0.51) ** 2
    assert FlyParams(sharing_cell=13).cell(width, height) == 13


@pytest.mark.parametrize(
    ("name", "low", "high", "below", "above"),
    [
        ("population", 10, 1_000_000, 9, 1_000_001), ("window", 3, 31, 1, 33), ("sharing_cell", 1, 512, 0, 513),
        ("sharing_strength", 0.0, 100.0, -0.01, 100.1), ("mutation_px", 1e-3, 1e3, 0.9e-3, 1001.0),
        ("mutation_disparity_px", 0.0, 1e3, -0.01, 1001.0), ("mutation_m", 1e-6, 1e3, 0.9e-6, 1001.0),
        ("slant", 0.0, 10.0, -0.01, 10.1), ("polish", 0, 100, -1, 101), ("stop", 1e-6, 1.0, 0.9e-6, 1.01),
        ("settled_fitness", 0.0, 1e9, -0.01, 1.01e9), ("max_iterations", 1, 100_000, 0, 100_001),
        ("min_depth", 1e-3, 3.9, 0.9e-3, 1.01e4), ("max_depth", 0.51, 1e5, 0.49, 1.01e5),
        ("misfit", 0.0, 100.0, -0.01, 100.1), ("uniqueness", 0.0, 100.0, -0.01, 100.1),
        ("left_right", 0.0, 100.0, -0.01, 100.1), ("regions", (1, 1), (16, 16), (0, 1), (16, 17)),
        ("operators", (1e-3, 0.999, 0.0, 0.0), (0.999, 0.0, 0.0, 1e-3), (0.4, 0.4, 0.1, 0.09), (0.4, 0.4, 0.1, 0.11)),
    ],
)  # fmt: skip
def test_the_ends_of_a_range_are_allowed_and_what_is_beyond_is_not(name, low, high, below, above):
    for value in (low, high):
        assert getattr(FlyParams(**{name: value}), name) == value
    for value in (below, above):
        with pytest.raises(ValueError, match=name):
            FlyParams(**{name: value})


def test_a_sharing_cell_by_hand():
    # 300 x 200 px for 0.4 * 150 flies: 1000 px^2 each.
    assert FlyParams(population=150, operators="A").cell(300, 200) == 32
    assert FlyParams(population=1_000_000).cell(64, 48) == 2
