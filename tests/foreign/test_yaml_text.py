import contextlib
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flysim.foreign.data import MAX_DEPTH
from flysim.foreign.yaml_text import parse_yaml


def test_plain_data_is_read():
    assert parse_yaml("a: 1\nb: [1.5, 'x', true]\n") == {"a": 1, "b": [1.5, "x", True]}
    assert parse_yaml("") is None


def test_a_matrix_of_opencv_is_read():
    text = "%YAML:1.0\n---\nM: !!opencv-matrix\n   rows: 1\n   dt: d\n   data: [ 1., 2. ]\n"
    assert parse_yaml(text) == {"M": {"rows": 1, "dt": "d", "data": [1.0, 2.0]}}


def test_as_deep_as_it_may_be():
    assert parse_yaml("[" * MAX_DEPTH + "]" * MAX_DEPTH)
    for deep in ("[" * (MAX_DEPTH + 1) + "]" * (MAX_DEPTH + 1), "[" * 60_000, "- " * 20_000 + "x", "{a: " * 10_000):
        began = time.process_time()
        with pytest.raises(ValueError, match=r"nested deeper than 32|not YAML"):
            parse_yaml(deep)
        assert time.process_time() - began < 3.0


@pytest.mark.parametrize("text", ["a: &x 1\nb: *x", "a: *x", "&a [*a]"])
def test_nothing_stands_for_something_else(text):
    with pytest.raises(ValueError, match="anchors and aliases"):
        parse_yaml(text)


@pytest.mark.parametrize("text", ["a: 2020-13-45", "a: " + "9" * 5000, "{[1]: 2}", "a: b: c", "a\x00", "--- 1\n--- 2"])
def test_what_is_damaged_is_a_value_error(text):
    with pytest.raises(ValueError):
        parse_yaml(text)


@given(st.text("[]{}:-!&*#'\"%,?|> \nab1.~<=", max_size=60))
def test_whatever_is_in_it_nothing_else_goes_wrong(text):
    with contextlib.suppress(ValueError):
        parse_yaml(text)
