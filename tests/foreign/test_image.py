import io
import zlib

import numpy as np
import pytest
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from flysim.errors import FlysimError
from flysim.foreign.image import FORMATS, check_texture, read_image

NOISE = np.random.default_rng(1).integers(0, 256, (12, 16, 3), dtype=np.uint8)


def chunk(kind, data):
    return len(data).to_bytes(4, "big") + kind + data + zlib.crc32(kind + data).to_bytes(4, "big")


def png(**more):
    sink = io.BytesIO()
    Image.fromarray(NOISE).save(sink, "PNG", **more)
    return sink.getvalue()


def refusal(path, data):
    path.write_bytes(data)
    with pytest.raises(FlysimError) as caught:
        read_image(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert len(str(caught.value)) < 300
    assert str(caught.value).isprintable()
    return str(caught.value)


@pytest.mark.parametrize("format", FORMATS)
def test_the_formats_that_are_read(tmp_path, format):
    Image.fromarray(NOISE).save(tmp_path / "i", format)
    image = read_image(tmp_path / "i")
    assert (image.shape, image.dtype) == (NOISE.shape, np.uint8)
    assert format == "JPEG" or np.array_equal(image, NOISE)


@pytest.mark.parametrize("format", ["EPS", "GIF", "TIFF", "PDF", "ICO", "WEBP", "PCX"])
def test_formats_that_are_not_are_not_even_tried(tmp_path, format):
    sink = io.BytesIO()
    Image.fromarray(NOISE).save(sink, format)
    assert "it is none of PNG, JPEG, PPM, BMP" in refusal(tmp_path / "i.png", sink.getvalue())


@pytest.mark.parametrize(
    "extra",
    [
        chunk(b"zTXt", b"a\0\0" + zlib.compress(bytes(2**21))),  # a bomb of text: ValueError
        chunk(b"zTXt", b"a\0\x09x"),  # SyntaxError
        chunk(b"tRNS", b""),
        chunk(b"iCCP", b"a\0\0" + zlib.compress(bytes(2**21))),
        chunk(b"IHDR", b""),
        b"\xff\xff\xff\xff" + b"IDAT",
        b"\0\0\0\0\0\0\0\0",
    ],
    ids=range(7),
)
def test_chunks_that_break_the_decoder_are_one_line(tmp_path, extra):
    good = png()
    (tmp_path / "i.png").write_bytes(good[:33] + extra + good[33:])
    try:
        assert np.array_equal(read_image(tmp_path / "i.png"), NOISE)  # some decoders read past it
    except FlysimError as error:
        assert str(error).startswith(f"{tmp_path / 'i.png'}: cannot read the image: ")


def test_a_bomb_of_text_is_refused(tmp_path):
    bomb = chunk(b"zTXt", b"a\0\0" + zlib.compress(bytes(2**21)))
    assert "cannot read the image: Decompressed data too large" in refusal(
        tmp_path / "i.png", png()[:33] + bomb + png()[33:]
    )
    with pytest.raises(ValueError, match="ValueError"):
        check_texture(png()[:33] + bomb + png()[33:])


def test_a_large_picture_in_digits_is_refused(tmp_path):
    assert "plain text of such a size" in refusal(tmp_path / "i.ppm", b"P3 9000 900 255\n" + b"0 " * 2**21 + b"1")


def test_damage_anywhere_is_a_picture_or_one_line(tmp_path):
    info = PngInfo()
    info.add_text("a", "b" * 40, zip=True)
    rng, path = np.random.default_rng(2), tmp_path / "i.png"
    sink = io.BytesIO()
    Image.fromarray(NOISE).save(sink, "JPEG", quality=30)
    for good in (png(pnginfo=info), sink.getvalue()):
        for _ in range(100):
            data = bytearray(good)
            for _ in range(rng.integers(1, 4)):
                data[rng.integers(len(data))] = rng.integers(256)
            path.write_bytes(data)
            try:
                read_image(path)
            except FlysimError as error:
                assert str(error).startswith(f"{path}: ")
