import contextlib
import errno
import os

import numpy as np
import pytest
from PIL import Image

from flysim.common.catalogue import find_world
from flysim.errors import RecordError, RendererError, WorldError
from flysim.render.preview import HEIGHT, WIDTH, draw_preview


def test_a_picture_of_a_world(tmp_path, gl):
    out = tmp_path / "yard.png"
    out.write_bytes(b"an older one")
    draw_preview(find_world("yard"), out, "gl")
    with Image.open(out) as picture:
        assert picture.format == "PNG"
        assert picture.width == WIDTH and HEIGHT / 2 < picture.height <= HEIGHT
        pixels = np.asarray(picture.convert("RGB"), dtype=float)
    assert pixels.std() > 25.0
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 60
    assert out.stat().st_size < 1_000_000
    assert list(tmp_path.iterdir()) == [out]


@pytest.mark.parametrize("world", ["paper", "yard", "corridor"])
def test_it_shows_more_of_the_world_than_of_the_sky(world, tmp_path, gl):
    draw_preview(find_world(world), tmp_path / "a.png", "gl")
    with Image.open(tmp_path / "a.png") as picture:
        pixels = np.asarray(picture.convert("RGB"), dtype=int)
    sky = np.abs(pixels - pixels[1, 1]).sum(axis=2) < 12
    assert sky.mean() < 0.52
    for edge in (sky[-8:], sky[:, -8:], sky[:8]):
        assert edge.mean() > 0.4 or world == "paper"  # nothing of the world is cut off but a floor that goes on


def test_both_renderers_draw_it_alike(tmp_path, gl):
    pixels = []
    for renderer in ("gl", "tiny"):
        draw_preview(find_world("paper"), tmp_path / f"{renderer}.png", renderer)
        with Image.open(tmp_path / f"{renderer}.png") as picture:
            pixels.append(np.asarray(picture.convert("RGB"), dtype=float))
    assert np.abs(pixels[0] - pixels[1]).mean() < 8.0


@pytest.fixture
def drawn(monkeypatch):
    """Nothing is drawn: what is tested is where the picture goes."""
    from types import SimpleNamespace

    from flysim.render import preview

    view = SimpleNamespace(rgb=np.zeros((2 * HEIGHT, 2 * WIDTH, 3), np.uint8))
    eyes = SimpleNamespace(view=lambda *_: view, close=lambda: None)
    simulation = SimpleNamespace(bounds=lambda: np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 1.0]]))
    monkeypatch.setattr(preview, "drawn", lambda *_: contextlib.nullcontext((simulation, eyes)))


@pytest.mark.parametrize(
    ("name", "said"),
    [("no/such/place.png", "No such file or directory"), ("file/a.png", "Not a directory"), ("", "is a folder")],
)
def test_a_place_that_cannot_be_written(tmp_path, drawn, name, said):
    (tmp_path / "file").touch()
    with pytest.raises(RecordError, match=said) as caught:
        draw_preview(find_world("paper"), tmp_path / name, "gl")
    assert str(caught.value).isprintable()
    assert "--out" in str(caught.value)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_full_disk_leaves_the_older_picture_and_nothing_else(tmp_path, drawn, monkeypatch):
    def full(self, file, **_more):
        file.write_bytes(b"half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Image.Image, "save", full)
    out = tmp_path / "paper.png"
    out.write_bytes(b"an older one")
    with pytest.raises(RecordError, match=r"paper.png: cannot write the picture: No space left on device. Choose"):
        draw_preview(find_world("paper"), out, "gl")
    assert out.read_bytes() == b"an older one"
    assert list(tmp_path.iterdir()) == [out]


def test_what_cannot_be_drawn_is_said_and_nothing_written(tmp_path):
    with pytest.raises(RendererError):
        draw_preview(find_world("paper"), tmp_path / "a.png", "gll")
    (tmp_path / "bad.sdf").write_text("<sdf><world/>", encoding="utf-8")
    with pytest.raises(WorldError):
        draw_preview(tmp_path / "bad.sdf", tmp_path / "a.png", "tiny")
    assert not (tmp_path / "a.png").exists()
