import zlib

import numpy as np
import pytest
from PIL import Image

from flysim.errors import FlysimError
from flysim.geometry.read_pair import read_pair

CALIB = """cam0=[3997.684 0 16.5; 0 3997.684 11.25; 0 0 1]
cam1=[3997.684 0 20.75; 0 3997.684 11.25; 0 0 1]
doffs=4.25
baseline=193.001
width=32
height=24
ndisp=280
isint=0
vmin=31
vmax=257
"""


def write(folder, *, calib=CALIB, left_px=(32, 24), right_px=(32, 24), mode="RGB"):
    for name, (width, height) in (("left.png", left_px), ("right.png", right_px)):
        level = 60 if name == "left.png" else 80
        Image.new(mode, (width, height), (level,) * len(mode) if mode in ("RGB", "RGBA") else level).save(folder / name)
    (folder / "calib.txt").write_text(calib, encoding="utf-8")
    return folder / "left.png", folder / "right.png", folder / "calib.txt"


def read(folder, **change):
    left, right, calib = write(folder, **change)
    return read_pair(left, right, calib=calib)


def test_the_figures_of_a_middlebury_file_become_the_rig(tmp_path):
    pair = read(tmp_path)
    assert pair.rig.left.fx == pair.rig.left.fy == 3997.684
    assert (pair.rig.left.cx, pair.rig.right.cx, pair.rig.left.cy) == (16.5, 20.75, 11.25)
    assert pair.rig.baseline == pytest.approx(0.193001)  # the file is in millimetres
    assert pair.rig.rectified
    assert pair.left.shape == (24, 32, 3)
    assert (pair.left[0, 0, 0], pair.right[0, 0, 0]) == (60, 80)


def test_depth_follows_middleburys_own_formula(tmp_path):
    # Z = f baseline / (d + doffs), from their page: doffs is the difference of the two cx.
    rig = read(tmp_path).rig
    left, right = rig.project(np.array([[0.0, 0.0, 3.0]]))
    disparity = left[0, 0] - right[0, 0]
    assert 3997.684 * 0.193001 / (disparity + 4.25) == pytest.approx(3.0)


@pytest.mark.parametrize(
    "calib",
    [
        "\ufeff" + CALIB,
        CALIB.replace("\n", "\r\n"),
        "  " + CALIB.replace("\n", "\n\t "),
        CALIB.replace("=", "\t=  "),
    ],
    ids=["byte-order mark", "lines of another system", "indented", "spaced"],
)
def test_how_an_editor_left_it_does_not_matter(tmp_path, calib):
    rig = read(tmp_path, calib=calib).rig
    assert (rig.left.fx, rig.right.cx, rig.baseline) == (3997.684, 20.75, pytest.approx(0.193001))
    with pytest.raises(FlysimError, match="is for 64x24 px"):  # the size is read as well
        read(tmp_path, calib=calib.replace("32\n", "64\n").replace("32\r", "64\r"))


def test_names_may_be_given_as_text_and_spaces_do_not_matter(tmp_path):
    left, right, calib = write(tmp_path, calib=CALIB.replace("=", " = ").replace("; ", "\n"))
    assert read_pair(str(left), str(right), calib=str(calib)).rig.left.fx == 3997.684


@pytest.mark.parametrize("mode", ["L", "RGBA", "P"])
def test_other_8_bit_images_become_rgb(tmp_path, mode):
    assert read(tmp_path, mode=mode).left.shape == (24, 32, 3)


def test_a_grey_image_has_three_equal_colours(tmp_path):
    assert read(tmp_path, mode="L").left[0, 0].tolist() == [60, 60, 60]


@pytest.mark.parametrize(
    ("calib", "says"),
    [
        ("", "needs a line 'cam0="),
        (CALIB.replace("cam1", "cam7"), "needs a line 'cam1="),
        (CALIB.replace("3997.684 0 16.5", "many 0 16.5"), "needs a line 'cam0="),
        (CALIB.replace("3997.684 0 16.5", "nan 0 16.5"), "needs a line 'cam0="),
        (CALIB.replace("; 0 0 1]", "]"), "needs a line 'cam0="),
        (CALIB.replace("3997.684", "-1"), "focal lengths must be > 0 px"),
        (CALIB.replace("baseline=193.001", ""), "needs a line 'baseline="),
        (CALIB.replace("193.001", "wide"), "baseline must be a number of millimetres > 0, got 'wide'"),
        (CALIB.replace("193.001", "nan"), "baseline must be a number of millimetres > 0, got 'nan'"),
        (CALIB.replace("193.001", "0"), "baseline must be a number of millimetres > 0, got '0'"),
        (CALIB.replace("193.001", "-193.001"), "baseline must be a number of millimetres > 0"),
        (CALIB.replace("193.001", "1e999"), "baseline must be a number of millimetres > 0, got '1e999'"),
        (CALIB.replace("193.001", "1_0"), "baseline must be a number of millimetres > 0, got '1_0'"),
        (CALIB.replace("3997.684", "1e300"), "needs a line 'cam0="),
        (CALIB.replace("3997.684", "1e-300"), "focal lengths must be at least 0.001 px"),
        (
            CALIB.replace("width=32", "width=" + "9" * 5000),
            "width and height must be whole numbers of pixels, got '999",
        ),
        (CALIB.replace("height=24", "height=-24"), "width and height must be whole numbers of pixels, got '-24'"),
        (CALIB.replace("width=32\n", "").replace("height=24", "height=25"), r"is for \?x25 px"),
        (CALIB + "#" * 70_000, "cannot read the calibration: it is larger than 65536 bytes"),
        (CALIB.replace("width=32", "width=64"), r"is for 64x24 px, .*left\.png has 32x24"),
        (CALIB.replace("height=24", "height=48"), r"is for 32x48 px, .*left\.png has 32x24"),
    ],
)
def test_a_calibration_that_lacks_a_figure_is_refused_by_name(tmp_path, calib, says):
    with pytest.raises(FlysimError, match=says) as caught:
        read(tmp_path, calib=calib)
    assert str(tmp_path / "calib.txt") in str(caught.value)
    assert len(str(caught.value)) < 300
    assert str(caught.value).isprintable()


def test_the_size_lines_are_optional(tmp_path):
    assert read(tmp_path, calib=CALIB.replace("width=32\nheight=24\n", "")).left.shape == (24, 32, 3)


def test_images_of_two_sizes_are_refused_with_both(tmp_path):
    with pytest.raises(FlysimError, match=r"right\.png: 30x24 px, but .*left\.png has 32x24 px"):
        read(tmp_path, right_px=(30, 24))


@pytest.mark.parametrize("missing", ["left.png", "right.png", "calib.txt"])
def test_a_missing_file_is_named(tmp_path, missing):
    left, right, calib = write(tmp_path)
    (tmp_path / missing).unlink()
    with pytest.raises(FlysimError, match=f"{missing}: cannot read .*No such file"):
        read_pair(left, right, calib=calib)


@pytest.mark.parametrize("content", [b"", b"not an image", b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR"])
def test_a_file_that_is_no_image_is_refused(tmp_path, content):
    left, right, calib = write(tmp_path)
    left.write_bytes(content)
    with pytest.raises(FlysimError, match=r"left\.png: cannot read the image") as caught:
        read_pair(left, right, calib=calib)
    assert "\n" not in str(caught.value)


def test_an_image_cut_short_is_refused(tmp_path):
    left, right, calib = write(tmp_path, left_px=(32, 24))
    noise = np.random.default_rng(1).integers(0, 256, (24, 32, 3), dtype=np.uint8)
    Image.fromarray(noise).save(left)
    left.write_bytes(left.read_bytes()[:1000])
    with pytest.raises(FlysimError, match=r"left\.png: cannot read the image"):
        read_pair(left, right, calib=calib)


def test_a_16_bit_image_is_refused_and_not_clipped_to_white(tmp_path):
    left, right, calib = write(tmp_path)
    Image.fromarray(np.full((24, 32), 30000, np.uint16)).save(left)
    with pytest.raises(FlysimError, match=r"left\.png: .*16-bit.*8-bit"):
        read_pair(left, right, calib=calib)


def test_binary_calibration_is_refused(tmp_path):
    left, right, calib = write(tmp_path)
    calib.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FlysimError, match=r"calib\.txt: cannot read the calibration"):
        read_pair(left, right, calib=calib)


@pytest.mark.parametrize("side_px", [9_000, 10_000, 20_000])
def test_an_image_that_would_fill_the_memory_is_refused_unread(tmp_path, side_px):
    left, right, calib = write(tmp_path)
    header = bytearray(left.read_bytes())
    header[16:24] = side_px.to_bytes(4, "big") * 2  # IHDR's width and height; its checksum follows
    header[29:33] = zlib.crc32(header[12:29]).to_bytes(4, "big")
    left.write_bytes(bytes(header))
    with pytest.raises(FlysimError, match=rf"left\.png: {side_px}x{side_px} px|left\.png: cannot read the image"):
        read_pair(left, right, calib=calib)
