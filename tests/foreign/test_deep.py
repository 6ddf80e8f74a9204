"""Colours of 16 bits come back as they were written, whatever holds them; what is in doubt stays with Pillow."""

from struct import pack
from zlib import crc32

import cv2
import numpy as np
import photographed
import pytest

from flysim.errors import FlysimError
from flysim.foreign.deep import _png, _tiff, deep_colours
from flysim.foreign.image import MAX_PIXELS
from flysim.foreign.picture import eight_bits, read_picture
from flysim.runs.photographs import SeeParams, see

RAMP = (np.arange(24 * 32 * 3, dtype=np.uint16) * 28).reshape(24, 32, 3)  # RGB
ALPHA = np.dstack([RAMP, np.full((24, 32), 65535, np.uint16)])


def saved(path, rgb, flags=()):
    order = [2, 1, 0, 3][: rgb.shape[2]]
    assert cv2.imwrite(str(path), np.ascontiguousarray(rgb[..., order]), list(flags))
    return path


def tiff(rgb, order="<", width=None, tags=(), first=()):
    """An uncompressed TIFF of 16-bit colours, by hand."""
    height, wide = rgb.shape[:2]
    entries = {
        **{256: (4, width or wide), 257: (4, height), 258: (3, None), 259: (3, 1), 262: (3, 2), 273: (4, None)},
        **{277: (3, 3), 278: (4, height), 279: (4, rgb.size * 2), **dict(tags)},
    }
    rows = [*first, *sorted(entries.items())]
    after = 8 + 2 + 12 * len(rows) + 4
    found = (b"II*\0" if order == "<" else b"MM\0*") + pack(f"{order}IH", 8, len(rows))
    for tag, (kind, value) in rows:
        many = 3 if tag == 258 else 1
        value = {258: after, 273: after + 6}.get(tag, value)
        short = kind == 3 and many == 1
        found += pack(f"{order}HHI", tag, kind, many) + (
            pack(f"{order}HH", value, 0) if short else pack(f"{order}I", value)
        )
    return found + bytes(4) + pack(f"{order}3H", 16, 16, 16) + rgb.astype(f"{order}u2").tobytes()


@pytest.mark.parametrize("ending", ["png", "tif", "tiff", "ppm"])
@pytest.mark.parametrize("rgb", [RAMP, ALPHA], ids=["colours", "alpha"])
def test_all_sixteen_bits_are_read(tmp_path, ending, rgb):
    if ending == "ppm":
        rgb = RAMP
    read_back = read_picture(saved(tmp_path / f"a.{ending}", rgb))
    assert read_back.dtype == np.uint16 and np.array_equal(read_back, RAMP)


@pytest.mark.parametrize("order", ["<", ">"])
def test_a_tiff_of_either_order_of_bytes(tmp_path, order):
    (tmp_path / "a.tif").write_bytes(tiff(RAMP, order))
    assert np.array_equal(read_picture(tmp_path / "a.tif"), RAMP)


def test_levels_of_a_ppm_count_from_its_brightest(tmp_path):
    levels = np.array([[[0, 1023, 512], [2000, 1, 1022]]], ">u2")
    (tmp_path / "a.ppm").write_bytes(b"P6 # ten bits\n2 1\n1023\n" + levels.tobytes())
    assert read_picture(tmp_path / "a.ppm").tolist() == [[[0, 65535, 32799], [65535, 64, 65470]]]


def in_doubt():
    whole, moves = cv2.imencode(".png", RAMP)[1].tobytes(), b"acTL" + pack(">II", 1, 0)
    return {
        "a tag twice": tiff(RAMP, first=[(256, (4, 32))]),
        "turned": tiff(RAMP, tags={274: (3, 3)}),
        "a large tile": tiff(RAMP, tags={322: (4, 2**20), 323: (4, 2**20)}),
        "a tile of another type": tiff(RAMP, tags={322: (13, 2**20), 323: (13, 2**20)}),
        "many samples": tiff(RAMP, tags={277: (4, 2**31)}),
        "moving": whole[:33] + pack(">I", 8) + moves + pack(">I", crc32(moves)) + whole[33:],
        "8 bits": cv2.imencode(".png", RAMP.astype(np.uint8))[1].tobytes(),
    }


@pytest.mark.parametrize("doubt", in_doubt())
def test_what_is_in_doubt_is_not_handed_on(doubt):
    data = in_doubt()[doubt]
    assert deep_colours(data, (32, 24)) is None
    assert (_png(data) or _tiff(data)) is None  # or OpenCV was asked


def test_a_picture_that_pillow_finds_to_be_of_another_size_is_not_handed_on(monkeypatch):
    monkeypatch.setattr(cv2, "imdecode", lambda *_: pytest.fail("it was"))
    assert deep_colours(tiff(RAMP), (32, 25)) is None


@pytest.mark.parametrize(
    ("name", "data", "says"),
    [
        ("a.ppm", b"P6\n100000 1000\n65535\n", f"100000x1000 px; at most {MAX_PIXELS}"),
        ("a.ppm", b"P6\n32 24\n65535\n" + bytes(99), "cannot read the picture: it ends after 114 bytes"),
        ("a.png", None, "cannot read the picture"),
        ("a.tif", tiff(RAMP, width=2**20), "px; at most|cannot read the picture"),
    ],
)
def test_what_is_too_large_or_cut_is_one_line(tmp_path, capfd, name, data, says):
    if data is None:
        data = saved(tmp_path / "whole.png", RAMP).read_bytes()[:-600]
    (tmp_path / name).write_bytes(data)
    with pytest.raises(FlysimError, match=says) as refused:
        read_picture(tmp_path / name)
    assert "\n" not in str(refused.value) and capfd.readouterr().err == ""


def test_bytes_of_colours_in_the_wrong_order_are_told(tmp_path):
    ramp = np.tile(np.linspace(1000, 60000, 200).astype(np.uint16)[:, None], (50, 1, 3))
    with pytest.raises(FlysimError, match="in the wrong order"):
        read_picture(saved(tmp_path / "a.png", ramp.byteswap()))


@pytest.mark.parametrize("ending", ["png", "tif", "ppm"])
def test_flies_see_a_pair_that_is_dark_in_sixteen_bits(tmp_path, ending):
    left, right, disparity = photographed.room()
    files = [
        saved(tmp_path / f"{side}.{ending}", one.astype(np.uint16))
        for side, one in zip("lr", (left, right), strict=True)
    ]
    for file, eight in zip(files, (left, right), strict=True):
        assert read_picture(file).max() <= 255  # all there is stands in the lower byte
        assert np.array_equal(eight_bits(read_picture(file))[0], eight)
    np.save(tmp_path / "truth.npy", disparity)
    found = see(*files, truth=tmp_path / "truth.npy", params=SeeParams(seed=3))
    assert found.scores["flies"].seen.within_1px > 0.97
