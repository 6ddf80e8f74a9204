"""Which images belong together, and what is wrong with a set in one line that names the image."""

import re
import shutil

import numpy as np
import pytest
from boards import BOARD
from PIL import Image

from flysim.calibration.board import Board
from flysim.calibration.images import image_sets, look_at
from flysim.errors import FlysimError


@pytest.fixture
def some(album, tmp_path):
    """Four pairs that a test may damage."""
    folder = tmp_path / "some"
    folder.mkdir()
    for path in sorted(album.iterdir()):
        if path.stem[-2:] <= "04":
            shutil.copy(path, folder)
    return folder


def refused(work):
    with pytest.raises(FlysimError) as caught:
        work()
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_names_tell_the_eyes_apart(some):
    for given in ([str(some)], [f"{some}/*.png"], [f"{some}/left*", f"{some}/right*"]):
        left, right = image_sets(given)
        assert [path.name for path in left] == ["left01.png", "left02.png", "left03.png", "left04.png"]
        assert [path.name for path in right] == ["right01.png", "right02.png", "right03.png", "right04.png"]
    (alone,) = image_sets([f"{some}/left*.png"])
    assert len(alone) == 4


def test_folders_tell_the_eyes_apart_and_so_does_the_option(some, tmp_path):
    for side in ("left", "right"):
        (tmp_path / "eyes" / side).mkdir(parents=True)
        for k, path in enumerate(sorted(some.glob(f"{side}*"))):
            shutil.copy(path, tmp_path / "eyes" / side / f"{k + 9}.png")
    left, right = image_sets([str(tmp_path / "eyes")])
    assert [path.name for path in left] == [path.name for path in right] == ["9.png", "10.png", "11.png", "12.png"]
    assert image_sets([str(tmp_path / "eyes/left")], [str(tmp_path / "eyes/right")]) == (left, right)


def test_an_image_without_a_board_is_named_and_left_out(some):
    Image.new("RGB", (320, 240), (90, 90, 90)).save(some / "right02.png")
    views = look_at(image_sets([str(some)]), BOARD)
    assert views.left_out == ("right02.png",)
    assert views.shots[1][1] is None and views.shots[1][0] is not None
    Image.new("RGB", (320, 240), (91, 90, 90)).save(some / "left02.png")
    assert look_at(image_sets([str(some)]), BOARD).names == ("left01.png", "left03.png", "left04.png")


def test_what_is_wrong_is_told(some):
    def look(board=BOARD):
        look_at(image_sets([str(some)]), board)

    assert "none of 4 images shows a chessboard 6x9" in refused(lambda: look(Board(columns=6, rows=9, square=0.05)))
    whole = np.asarray(Image.open(some / "left03.png"))
    Image.fromarray(whole[:200]).save(some / "left03.png")
    assert re.search(r"left03\.png: 320x200 px, the images before it 320x240", refused(look))
    shutil.copy(some / "left01.png", some / "left03.png")
    assert re.search(r"left03\.png: the same image as .*left01\.png", refused(look))
    (some / "left03.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"x" * 50)
    assert "left03.png: cannot read the image" in refused(look)
    (some / "left03.png").unlink()
    assert "3 images of the left eye and 4 of the right one" in refused(look)
    shutil.copy(some / "left01.png", some / "left13.png")
    assert "each needs its other" in refused(look)
    shutil.copy(some / "left01.png", some / "other.png")
    assert "is it the left eye's or the right one's?" in refused(look)


def test_nothing_to_read_is_told(tmp_path):
    assert "no image in it" in refused(lambda: image_sets([str(tmp_path)]))
    assert "no file is called" in refused(lambda: image_sets([f"{tmp_path}/*.png"]))
    assert "nowhere.png: cannot read the image" in refused(lambda: look_at(image_sets(["nowhere.png"]), BOARD))
