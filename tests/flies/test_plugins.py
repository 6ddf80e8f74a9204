"""Measures and operators that a user brings: found, refused in a line, compiled anew when their files change."""

import math
import sys
import time

import numpy as np
import pytest

import flysim as fs
from flysim.compute.plugged import sources_digest
from flysim.errors import FlysimError
from flysim.flies.check import check_measure, check_operator
from flysim.flies.fitness import plugged
from flysim.flies.measure import MEASURES, Measure, find_measure, measure
from flysim.flies.operator import KINDS, Operator

MINE = """
import math
from flysim.flies.measure import measure
from flysim.flies.operator import Genes, crossover, mutation
from nearby import NOISE

@measure(settled=math.log(3.0))
def calm(gl, gr, n, sl, sr, sll, srr, slr):
    zero_mean = sll + srr - 2.0 * slr - (sl - sr) ** 2 / n
    return math.log(1.0 + gl * gr / (max(zero_mean, 0.0) / n + NOISE))

@measure(settled=2.0, of="difference", limit=lambda gl, gr, needed: gl * gr / needed - 0.25)
def plain(gl, gr, difference):
    return gl * gr / (difference + 0.25)

@measure(settled=1.0)
def negative(gl, gr, n, sl, sr, sll, srr, slr):
    return -1.0

@measure(settled=1.0, of="difference", limit=lambda gl, gr, needed: 0.0)
def hasty(gl, gr, difference):
    return gl * gr / (difference + 1.0)

@measure(settled=1.0)
def backwards(gl, gr, n, sl, sr, sll, srr, slr):
    return max((sll + srr - 2.0 * slr) / n, 0.0)

@measure(settled=1.0)
def broken(gl, gr, n, sl, sr, sll, srr, slr):
    return gl + nowhere

def bare(gl, gr, n, sl, sr, sll, srr, slr):
    return gl

@mutation
def still(views, rules, one, state, n):
    return one

@mutation
def torn(views, rules, one, state, n):
    return Genes(math.nan, one.v, one.q, one.qu, one.qv)
"""


@pytest.fixture
def mine(tmp_path, monkeypatch):
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "nearby.py").write_text("NOISE = 0.25\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    for name in ("mine", "nearby"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    plugged.cache_clear()
    yield tmp_path
    plugged.cache_clear()


@pytest.mark.parametrize("name", MEASURES.builtin)
def test_flysims_own_measures_hold_what_they_say(name):
    check_measure(name, rng=np.random.default_rng(3))


@pytest.mark.parametrize("name", KINDS)
def test_flysims_own_operators_breed(name):
    check_operator(KINDS[name], name, rng=np.random.default_rng(4))


def test_a_measure_of_ones_own_gives_the_swarm_of_the_same_built_in(mine, stage, facing):
    for own, built_in in (("mine:calm", "louchet"), ("mine:plain", "epipolar")):
        swarms = [stage.run(facing.pair, fitness=name, max_iterations=5) for name in (own, built_in)]
        np.testing.assert_array_equal(swarms[0].points, swarms[1].points)
        assert len(swarms[0].points) > 100


def test_a_measure_of_ones_own_takes_no_longer(mine, stage, facing):
    def seconds(name):
        begun = time.perf_counter()
        stage.run(facing.pair, fitness=name, population=3000, max_iterations=8)
        return time.perf_counter() - begun

    for own, built_in in (("mine:calm", "louchet"), ("mine:plain", "epipolar")):
        both = [(seconds(own), seconds(built_in)) for _ in range(9)][1:]
        assert min(one for one, _ in both) < 1.2 * min(other for _, other in both)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("mine:bare", "function, not a measure: write @measure"),
        ("mine:nothing", "no 'nothing' in mine"),
        ("nowhere:calm", "no module 'nowhere'"),
        ("epipola", "got 'epipola'. Did you mean 'epipolar'?"),
    ],
)
def test_what_is_no_measure_is_refused_where_it_is_named(mine, name, message):
    with pytest.raises(ValueError, match=r"fitness|measure") as refused:
        fs.FlyParams(fitness=name)
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


def test_what_numba_cannot_compile_is_one_line(mine):
    with pytest.raises(FlysimError, match=r"measure 'mine:broken' \(line \d+\): .*nowhere") as refused:
        plugged("mine:broken")
    assert "\n" not in str(refused.value) and "\x1b" not in str(refused.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"of": "colours"}, "of 'sums' or of 'difference', got 'colours'"),
        ({"of": "difference"}, "takes the 3 arguments gl, gr, difference; <lambda> takes a"),
        ({"settled": -1.0}, "at least 0, got -1.0"),
        ({"settled": math.nan}, "at least 0, got nan"),
    ],
)
def test_nonsense_is_refused_when_a_measure_is_made(change, message):
    given = {"settled": 1.0, "of": "sums", **change}
    function = (lambda a: a) if change == {"of": "difference"} else find_measure("zncc").function
    with pytest.raises(ValueError, match="measure") as refused:
        measure(**given)(function)
    assert message in str(refused.value)
    with pytest.raises(ValueError, match="a limit belongs to a measure of the difference"):
        Measure(function=find_measure("zncc").function, settled=1.0, limit=lambda gl, gr, needed: 0.0)
    with pytest.raises(ValueError, match="a mutation takes the 5 arguments"):
        Operator(function=lambda a: a, kind="mutation")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("mine:negative", "must be finite and not below 0"),
        ("mine:hasty", "was needed"),
        ("mine:backwards", "right matches have"),
    ],
)
def test_the_check_finds_a_measure_that_does_not_hold_what_it_says(mine, name, message):
    with pytest.raises(AssertionError, match=message):
        check_measure(name, rng=np.random.default_rng(0))


def test_the_check_finds_an_operator_that_breeds_no_flies(mine):
    with pytest.raises(AssertionError, match="nan"):
        check_operator("mutation", "mine:torn", rng=np.random.default_rng(0))
    check_operator("mutation", "mine:still", rng=np.random.default_rng(0))


@pytest.mark.parametrize(("kind", "name"), [("crossover", "image"), ("mutation", "mine:calm"), ("crossover", "midle")])
def test_an_operator_of_the_other_kind_is_refused(mine, kind, name):
    with pytest.raises(ValueError, match=kind):
        fs.FlyParams(**{kind: name})


def test_a_digest_is_of_the_file_and_of_what_lies_beside_it(mine):
    before = sources_digest(find_measure("mine:calm").function)
    (mine / "nearby.py").write_text("NOISE = 0.5\n")
    after = sources_digest(find_measure("mine:calm").function)
    (mine / "other.py").write_text("X = 1\n")  # nothing imports it
    assert before != after == sources_digest(find_measure("mine:calm").function)
    assert sources_digest(find_measure("zncc").function) == "flysim"
