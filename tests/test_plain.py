import pickle

import pytest

from flysim.errors import FlysimError, did_you_mean
from flysim.plain import one_line, plain, shortened, shown, shown_path


@pytest.mark.parametrize(
    "character",
    [
        "\x1b",
        "\n",
        "\r",
        "\t",
        "\0",
        "\x7f",
        "\x9b",
        "\u202e",
        "\u2066",
        "\u200b",
        "\u200d",
        "\ufeff",
        "\ud800",
        "\u2028",
        "\xa0",
    ],
    ids=ascii,
)
def test_what_is_not_printable_is_a_question_mark(character):
    assert plain(f"a{character}b") == "a?b"
    assert shown(f"a{character}b") == "'a?b'"
    assert str(FlysimError(f"a{character}b")) == "a?b"


def test_what_people_write_stays():
    text = "Möbel [final] 木箱 :smile: ½ m²"
    assert plain(text) == text


def test_a_long_text_keeps_both_ends():
    assert shortened("abc", 3) == "abc"
    assert shortened("0123456789", 9) == "0123...89"
    assert len(shortened("x" * 5000)) == 290
    assert shown_path("/a/" + "b" * 500 + "/world.sdf").endswith("bb/world.sdf")
    assert len(shown_path("b" * 500)) == 120


def test_an_error_has_less_than_300_characters_and_keeps_its_file():
    error = FlysimError(f"/home/me/world.sdf: {'x' * 9000} is no number. Correct it.")
    assert str(error).startswith("/home/me/world.sdf: xxx")
    assert str(error).endswith("xxx is no number. Correct it.")
    assert len(f"flysim: {FlysimError('word ' * 1000)}\n") < 300
    assert str(pickle.loads(pickle.dumps(error))) == str(error)  # as it comes from another process
    assert one_line(str(error)) == str(error)


def test_what_is_known_is_told_as_far_as_a_line_goes():
    many = [f"name_{k:03}" for k in range(100)]
    assert did_you_mean("zzz", many).startswith("Known: name_000, name_001, ")
    assert did_you_mean("zzz", many).endswith(" and 85 more.")
    assert did_you_mean("name_07", many[:10]) == "Did you mean 'name_007'?"
    assert did_you_mean("x", ["a", "b"]) == "Known: a, b."
