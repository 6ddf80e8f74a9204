"""What a user may name: files, folders, patterns, pictures side by side, videos; 8 and 16 bits."""

import cv2
import numpy as np
import pytest
from PIL import Image

from flysim.errors import FlysimError
from flysim.foreign.picture import eight_bits, read_picture
from flysim.photographs.album import album

LEFT, RIGHT = (np.random.default_rng(k).integers(0, 256, (24, 32, 3), np.uint8) for k in (0, 1))


def save(path, picture):
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(picture).save(path)
    return path


def read(found):
    pairs = list(found.pairs())
    assert not [pair for _, pair in pairs if isinstance(pair, FlysimError)]
    return pairs


@pytest.mark.parametrize("ending", ["png", "bmp", "ppm", "tif"])
def test_two_files_of_any_format(tmp_path, ending):
    files = save(tmp_path / f"a.{ending}", LEFT), save(tmp_path / f"b.{ending}", RIGHT)
    ((name, (left, right)),) = read(album(*files))
    assert name == "a"
    assert np.array_equal(left, LEFT) and np.array_equal(right, RIGHT)


def test_one_picture_side_by_side(tmp_path):
    ((_, (left, right)),) = read(album(save(tmp_path / "both.png", np.hstack([LEFT, RIGHT]))))
    assert np.array_equal(left, LEFT) and np.array_equal(right, RIGHT)
    with pytest.raises(FlysimError, match="32x24 px are no two pictures side by side"):
        raise next(album(save(tmp_path / "one.png", LEFT)).pairs())[1]


@pytest.mark.parametrize(
    ("eyes", "names"),
    [
        (("im0.png", "im1.png"), ["FOLDER"]),
        (("image_2/{}.png", "image_3/{}.png"), ["2", "10"]),
        (("image_02/data/{}.png", "image_03/data/{}.png"), ["2", "10"]),
        (("left{}.png", "right{}.png"), ["left2", "left10"]),
    ],
)
def test_a_folder_of_pairs_is_read_as_those_who_publish_it_lay_it_out(tmp_path, eyes, names):
    for k in (2, 10):
        for eye, picture in zip(eyes, (LEFT, RIGHT), strict=True):
            save(tmp_path / eye.format(k), picture)
    pairs = read(album(tmp_path))
    assert [name for name, _ in pairs] == [name.replace("FOLDER", tmp_path.name) for name in names]
    assert all(np.array_equal(pair[0], LEFT) and np.array_equal(pair[1], RIGHT) for _, pair in pairs)


def test_patterns_are_paired_by_their_order_or_by_their_names(tmp_path):
    for k in (1, 2, 3):
        save(tmp_path / "l" / f"{k}.png", LEFT)
    save(tmp_path / "r" / "2.png", RIGHT)
    found = album(str(tmp_path / "l" / "*.png"), tmp_path / "r")
    assert [name for name, _ in found.pairs()] == ["2"]
    save(tmp_path / "x" / "other.png", RIGHT)
    with pytest.raises(FlysimError, match=r"has 3 pictures, .* 1, and their names do not say"):
        album(tmp_path / "l", tmp_path / "x")
    with pytest.raises(FlysimError, match="no picture there"):
        album(str(tmp_path / "*.jpg"), tmp_path / "r")


def deep(path, values):
    Image.fromarray(values).save(path)
    return path


@pytest.mark.parametrize("ending", ["png", "tif", "pgm"])
def test_sixteen_bits_lose_what_no_pixel_uses(tmp_path, ending):
    ramp = np.tile(np.arange(32, dtype=np.uint16) * 100, (24, 1))  # a camera of 12 bits
    read_back = read_picture(deep(tmp_path / f"a.{ending}", ramp))
    assert read_back.dtype == np.uint16 and np.array_equal(read_back, ramp)
    (eight,) = eight_bits(read_back)
    assert eight.shape == (24, 32, 3)
    assert eight[0, :, 0].tolist() == (ramp[0] >> 4).tolist()


def test_bytes_in_the_wrong_order_are_told(tmp_path):
    ramp = np.tile(np.linspace(1000, 60000, 200).astype(np.uint16), (50, 1))
    with pytest.raises(FlysimError, match="in the wrong order"):
        read_picture(deep(tmp_path / "a.png", ramp.byteswap()))


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "none of PNG"),
        (b"P6\n100000 1000\n255\n", "100000x1000 px; at most 30000000"),
        (b"II*\0" + bytes(40), "pict"),
    ],
)
def test_what_is_no_picture_is_told_in_one_line(tmp_path, data, says, capfd):
    (tmp_path / "a.png").write_bytes(data)
    with pytest.raises(FlysimError, match=says):
        read_picture(tmp_path / "a.png")
    assert capfd.readouterr().err == ""


def filmed(path, pictures, code="MJPG"):
    height, width = pictures[0].shape[:2]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*code), 10.0, (width, height))
    for picture in pictures:
        writer.write(picture[..., ::-1])
    writer.release()
    return path


def test_a_video_of_pairs_and_one_that_ends_in_the_middle(tmp_path, capfd):
    both = np.hstack([LEFT, RIGHT]).repeat(4, axis=0).repeat(4, axis=1)
    path = filmed(tmp_path / "film.avi", [both] * 6)
    found = album(path)
    assert found.planned == 6 and found.sequence
    pairs = read(found)
    assert [name for name, _ in pairs] == [f"film-{k:05d}" for k in range(1, 7)]
    assert np.abs(pairs[5][1][1].astype(int) - RIGHT.repeat(4, axis=0).repeat(4, axis=1)).mean() < 40.0
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    *good, (_, error) = album(path).pairs()
    assert 0 < len(good) < 6
    assert isinstance(error, FlysimError) and "ends in the middle" in str(error)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("data", [b"", b"#EXTM3U\nother.mp4\n", b"\0\0\0 ftypisom" + bytes(100)])
def test_what_is_no_video_is_told_in_one_line(tmp_path, data, capfd):
    (tmp_path / "a.mp4").write_bytes(data)
    with pytest.raises(FlysimError, match=r"a\.mp4: (no|cannot read the) video"):
        album(tmp_path / "a.mp4")
    assert capfd.readouterr().err == ""
