import contextlib
import json
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flysim.foreign.data import MAX_DEPTH, parse_json, parse_toml

WORDS = st.text("[]{}\"'\\#\n=,. ab1", max_size=60)


@pytest.mark.parametrize("parse", [parse_json, parse_toml])
@pytest.mark.parametrize("opening", ["[", '{"a":', "{a=", '["]",['])
def test_depth_is_counted_before_anything_is_parsed(parse, opening):
    text = ("" if parse is parse_json else "x = ") + opening * 100_000
    with pytest.raises(ValueError, match="nested deeper than 32"):
        parse(text)


def test_as_deep_as_it_may_be():
    assert parse_json("[" * MAX_DEPTH + "]" * MAX_DEPTH)
    assert parse_toml("x = " + "[" * MAX_DEPTH + "]" * MAX_DEPTH)
    assert parse_toml(".".join("a" * MAX_DEPTH) + " = 1")


def test_brackets_and_dots_inside_strings_and_comments_are_text():
    text = "[" * 100 + "a." * 100
    assert parse_json(json.dumps({"a": text, "b": '"' + text + "\\"})) == {"a": text, "b": '"' + text + "\\"}
    for quote in ('"', "'", '"""', "'''"):
        assert parse_toml(f"x = {quote}{text}{quote} # {text}\ny = 1") == {"x": text, "y": 1}
    assert parse_toml(f'x = """a""{text}\\""""""')["x"] == f'a""{text}"""'


def test_nothing_hides_depth_from_the_count():
    deep = "[" * 100
    for text in (
        f'x = "\\\\"\ny = {deep}',
        f"x = '\\'\ny = {deep}",
        f"#'''\ny = {deep}",
        f'x = """\\\\"""\ny = {deep}',
    ):
        with pytest.raises(ValueError, match="nested deeper than 32"):
            parse_toml(text)
    with pytest.raises(ValueError, match="nested deeper than 32"):
        parse_json('["\\\\", ' + deep)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("NaN", "NaN is no number"),
        ("[-Infinity]", "-Infinity is no number"),
        ("[1e999]", "'1e999' is larger than any number can be"),
        ('{"a": [{"b": 9223372036854775808}]}', "a.0.b: a whole number of more than 64 bits"),
        ('{"a": "' + "b" * 10_001 + '"}', "a: a text of 10001 characters"),
        ("1" * 5000, "Exceeds the limit"),
    ],
)
def test_values_that_no_reader_could_use_are_named(text, says):
    with pytest.raises(ValueError, match=says):
        parse_json(text)


@pytest.mark.parametrize(
    "text",
    [
        "a." * 200_000 + "a = 1",
        '"a" . ' * 60_000 + "a = 1",
        "a" * 400_000,
        '"' * 400_001,
        "x = '" + "a" * 400_000,
        'x = "' + '\\"' * 200_000,
        "#" * 400_000,
        "x = " + "{}," * 100_000,
        "- " * 200_000,
    ],
    ids=range(9),
)
def test_a_large_file_of_anything_takes_a_second(text):
    began = time.process_time()
    with contextlib.suppress(ValueError):
        parse_toml(text)
    assert time.process_time() - began < 3.0


@given(WORDS)
def test_any_text_is_read_or_refused_and_nothing_else(text):
    for parse in (parse_json, parse_toml):
        try:
            parse(text)
        except ValueError as error:
            assert not isinstance(error, UnicodeError)
