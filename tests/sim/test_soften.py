import errno
import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flysim.errors import FlysimError
from flysim.sim.soften import BLUR, metres_per_texel, softened
from flysim.worlds.shapes import Box, Plane
from flysim.worlds.surface.mesh import surface_mesh


def image(path, pixels):
    Image.fromarray(np.asarray(pixels, np.uint8)).save(path)
    return path


def test_a_texel_by_hand():
    # 2 x 1 m under 200 x 100 texels: 1 cm each.
    assert metres_per_texel(surface_mesh(Plane((2.0, 1.0))), 200, 100) == pytest.approx(0.01)
    assert metres_per_texel(surface_mesh(Plane((2.0, 1.0))), 400, 50) == pytest.approx(0.01)


def test_a_white_stripe_spreads_by_the_blur():
    pixels = np.zeros((101, 101, 3), np.uint8)
    pixels[:, 48:53] = 255  # 5 mm wide: a variance of (25 - 1) / 12 mm^2 of its own
    mesh = surface_mesh(Plane((0.101, 0.101)))  # 1 mm a texel
    seen = softened(pixels, mesh)[50, :, 1].astype(float)
    at = np.arange(101) - 50.0
    assert seen.sum() == pytest.approx(5 * 255.0, rel=0.02)
    variance = (seen @ at**2) / seen.sum() - 2.0
    assert np.sqrt(variance) * 1e-3 == pytest.approx(BLUR, rel=0.05)


def test_a_plain_texture_stays_as_it_is_in_its_colours():
    pixels = np.full((8, 8, 3), (200, 30, 90), np.uint8)
    assert np.array_equal(softened(pixels, surface_mesh(Box((1.0, 1.0, 1.0)))), pixels)


def test_a_full_disk_is_told(tmp_path, made, monkeypatch):
    texture = image(tmp_path / "a.png", np.zeros((8, 8, 3)))

    def full(self, data):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(self))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(FlysimError, match="No space left on device"):
        made.simulation(made.link("box", Box((1, 1, 1)), (3, 0, 0.5, 0, 0, 0), texture=texture), textured=True)
