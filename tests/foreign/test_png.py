import io
import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flysim.errors import WorldError
from flysim.foreign.image import check_texture, read_texture, texture_size

FLYSIM = Path(__file__).resolve().parents[2] / "flysim"


def encoded(pixels, mode=None, **more):
    image, stream = Image.fromarray(np.asarray(pixels, np.uint8)), io.BytesIO()
    (image.convert(mode) if mode else image).save(stream, **{"format": "PNG", **more})
    return stream.getvalue()


RGB = np.random.default_rng(3).integers(0, 256, (5, 7, 3))


@pytest.mark.parametrize("mode", ["RGB", "RGBA", "L", "LA", "1", "P"])
def test_pixels_are_rgb_whatever_the_file_holds(tmp_path, mode):
    data = encoded(RGB, mode)
    path = tmp_path / "t.png"
    path.write_bytes(data)
    with Image.open(io.BytesIO(data)) as image:
        expected = np.asarray(image.convert("RGB"))
    pixels = read_texture(path)
    assert pixels.shape == (5, 7, 3)
    assert pixels.dtype == np.uint8
    assert np.array_equal(pixels, expected)
    if mode in ("RGB", "RGBA"):
        assert np.array_equal(pixels, RGB)
    assert texture_size(data) == (7, 5)
    check_texture(data)


@pytest.mark.parametrize("form", ["JPEG", "GIF", "BMP", "WEBP", "PPM", "TGA"])
def test_a_texture_is_what_its_content_says(tmp_path, form):
    path, data = tmp_path / "t.png", encoded(RGB, format=form)
    path.write_bytes(data)
    assert texture_size(data) == (7, 5)
    with Image.open(io.BytesIO(data), formats=[form]) as image:
        assert np.array_equal(read_texture(path), np.asarray(image.convert("RGB")))


@pytest.mark.parametrize("form", ["TIFF", "EPS", "ICO"])
def test_no_other_decoder_is_asked(tmp_path, form):
    path = tmp_path / "t.png"
    path.write_bytes(encoded(RGB, format=form))
    with pytest.raises(WorldError, match=r"t.png: the texture is none of PNG, .*: convert it to an 8-bit PNG.$"):
        read_texture(path)


def test_a_texture_that_changed_since_the_world_was_read(tmp_path):
    path = tmp_path / "t.png"
    with pytest.raises(WorldError, match=r"t.png: cannot read the texture: No such file"):
        read_texture(path)
    data = encoded(RGB)
    path.write_bytes(data[:-30])
    with pytest.raises(WorldError, match=r"t.png: the texture is a damaged PNG file \(.*\): write it again.$"):
        read_texture(path)
    path.write_bytes(data.replace(data[50:54], bytes(4)))  # a checksum says so
    with pytest.raises(WorldError, match="damaged PNG"):
        read_texture(path)
    with path.open("wb") as stream:
        os.truncate(stream.fileno(), 2**26 + 1)
    with pytest.raises(WorldError, match="it is larger than 67108864 bytes"):
        read_texture(path)


def test_pictures_are_decoded_in_one_room():
    for path in FLYSIM.rglob("*.py"):
        source, place = path.read_text(encoding="utf-8"), path.relative_to(FLYSIM).as_posix()
        # A camera's JPEG is flysim's own, made and read in one breath; foreign/deep.py hands on what Pillow decoded.
        assert ("imdecode" in source) == (place in ("sensors/chip.py", "foreign/deep.py")), place
        assert "imread" not in source, place
        assert ("Image.open(" in source) == (place == "foreign/image.py"), place
