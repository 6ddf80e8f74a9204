"""The order and the count of timed calls; no test asks how long they took."""

import gc

import pytest

from flysim.flies.threads import lanes, limited
from flysim.studies.bench.timing import interleaved


def test_works_are_called_in_turn_and_the_first_round_does_not_count():
    calls, shares = [], []

    def work(name):
        def call(turn):
            calls.append((name, turn))
            assert not gc.isenabled()
            return f"{name}{turn}"

        return call

    timed = interleaved({"a": work("a"), "b": work("b")}, 2, shares.append)
    assert calls == [("a", 0), ("b", 0), ("a", 0), ("b", 0), ("a", 1), ("b", 1)]
    assert timed["a"].results == ["a0", "a1"]
    assert len(timed["b"].ms) == 2
    assert min(timed["b"].ms) >= 0.0
    assert shares == [k / 6 for k in range(1, 7)]
    assert gc.isenabled()


def test_a_failure_leaves_the_collector_on():
    with pytest.raises(ZeroDivisionError):
        interleaved({"a": lambda turn: 1 / turn}, 1)
    assert gc.isenabled()


def test_no_round_is_no_measurement():
    with pytest.raises(ValueError, match="repeats must be >= 1, got 0"):
        interleaved({"a": lambda turn: turn}, 0)


def test_threads_are_given_back():
    before = lanes()
    with pytest.raises(RuntimeError), limited(1):
        assert lanes() == 1
        raise RuntimeError
    assert lanes() == before
