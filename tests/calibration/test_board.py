import numpy as np
import pytest

from flysim.calibration.board import Board, parse_board
from flysim.calibration.detect import find_corners


@pytest.mark.parametrize("charuco", [False, True])
def test_corners_are_found_where_the_picture_has_them(charuco):
    board = parse_board("9x6", 0.03, charuco=charuco)
    found = find_corners(board.picture(40), board)
    assert found is not None and sorted(found.ids) == list(range(54))
    # The border is a square wide, and a pixel's centre lies at an integer.
    expected = board.corners[:, :2] / board.square * 40 + 2 * 40 - 0.5
    uv = found.picked(np.arange(54))
    np.testing.assert_allclose(uv if uv[0, 0] < uv[-1, 0] else uv[::-1], expected, atol=0.02)  # from either end


def test_a_charuco_board_may_be_seen_in_part():
    board = Board(columns=9, rows=6, square=0.03, charuco=True)
    picture = board.picture(40)
    picture[:, :190] = 128
    found = find_corners(picture, board)
    assert found is not None and 20 <= len(found.ids) < 54
    expected = board.corners[found.ids, :2] / board.square * 40 + 2 * 40 - 0.5
    np.testing.assert_allclose(found.uv, expected, atol=0.02)


@pytest.mark.parametrize("charuco", [False, True])
def test_where_there_is_no_board_none_is_found(charuco):
    board = Board(columns=9, rows=6, square=0.03, charuco=charuco)
    noise = np.random.default_rng(0).integers(0, 256, (120, 160, 3)).astype(np.uint8)
    for image in (np.full((90, 120, 3), 200, np.uint8), noise, np.zeros((3, 5, 3), np.uint8)):
        assert find_corners(image, board) is None


@pytest.mark.parametrize(
    ("text", "square", "said"),
    [
        ("9x6", 0.0, "square must be > 0 m"),
        ("9x6", -0.025, "square must be > 0 m"),
        ("9x6", float("nan"), "square must be > 0 m"),
        ("9x6", 25.0, "at most 10 m"),
        ("9", 0.025, "such as 9x6"),
        ("9x6x2", 0.025, "such as 9x6"),
        ("2x6", 0.025, "3 to 40 inner corners"),
        ("99x99", 0.025, "3 to 40 inner corners"),
    ],
)
def test_a_board_that_cannot_be_is_refused(text, square, said):
    with pytest.raises(ValueError, match=said):
        parse_board(text, square)
