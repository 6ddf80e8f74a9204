"""Surfaces as a study wants them: what repeats on all of them, less contrast, nothing at all."""

import gc

import numpy as np
import pytest
from PIL import Image

from flysim.common.catalogue import find_world
from flysim.errors import FlysimError
from flysim.runs.scenario import read_scenario
from flysim.worlds.sdf.reader import read_world
from flysim.worlds.surface.atlas import atlas_size
from flysim.worlds.surface.finish import JOINT, SLAT, TILE, finished


@pytest.fixture(scope="module")
def paper():
    return read_world(find_world("paper"))


def pixels(part):
    with Image.open(part.material.texture) as image:
        return np.asarray(image.convert("RGB"), dtype=float)


def visuals(world):
    return [part for link in world.links for part in link.visuals]


def test_nothing_asked_for_is_the_world_itself(paper):
    assert finished(paper, None) is paper
    assert finished(paper, None, 1.0) is paper


@pytest.mark.parametrize("contrast", [0.5, 0.1, 0.0])
def test_less_contrast_draws_every_texel_towards_the_mean(paper, contrast):
    made = finished(paper, None, contrast)
    for before, after in zip(visuals(paper), visuals(made), strict=True):
        assert after.shape is before.shape
        was, now = pixels(before), pixels(after)
        mean = was.mean(axis=(0, 1))
        np.testing.assert_allclose(now, mean + contrast * (was - mean), atol=0.51)
        if contrast == 0.0:
            assert np.ptp(now, axis=(0, 1)).max() == 0.0


def test_tiles_are_all_alike_and_as_large_as_they_say(paper):
    made = finished(paper, "tiles")
    for before, after in zip(visuals(paper), visuals(made), strict=True):
        image = pixels(after)
        np.testing.assert_allclose(image.max(axis=(0, 1)), pixels(before).mean(axis=(0, 1)).clip(76.5, 229.5), atol=1.0)
        width = (after.shape.size if type(after.shape).__name__ == "Plane" else atlas_size(after.shape))[0]
        texel = width / image.shape[1]
        row = image[image[..., 0].max(axis=1).argmax(), :, 0]  # through the middle of tiles
        joints = np.diff((row < row.max() / 2).astype(int)) == 1
        apart = np.diff(np.flatnonzero(joints)) * texel
        assert len(apart) < 2 or np.abs(apart - TILE).max() <= 2 * texel
        assert (row < row.max() / 2).mean() == pytest.approx(JOINT / TILE, abs=0.1)


def test_slats_run_along_the_ground(paper):
    made = finished(paper, "blinds")
    for part in visuals(made):
        image = pixels(part)
        assert np.ptp(image, axis=1).max() == 0.0  # a row has one colour
        texel = atlas_size(part.shape)[1] / image.shape[0] if type(part.shape).__name__ == "Box" else None
        if texel:
            edges = np.flatnonzero(np.diff((image[:, 0, 0] > image[..., 0].mean()).astype(int)) == 1)
            assert np.abs(np.diff(edges) * texel - SLAT).max() <= 2 * texel


def test_a_repeat_and_less_contrast_go_together_and_their_files_go_with_the_world(paper):
    made = finished(paper, "tiles", 0.5)
    folder = visuals(made)[0].material.texture.parent
    whole = finished(paper, "tiles")
    strong, faint = (np.ptp(pixels(visuals(one)[0])[..., 0]) for one in (whole, made))
    assert faint == pytest.approx(strong / 2, abs=1.0)
    assert folder.is_dir()
    del made
    gc.collect()
    assert not folder.exists()


def test_a_scenario_says_so_and_refuses_what_there_is_not():
    plan = read_scenario("paper_a", ["texture=tiles", "texture_contrast=0.25"])
    assert plan.surfaces == "tiles, contrast 0.25"
    assert read_scenario("paper_a").surfaces is None
    with pytest.raises(FlysimError, match=r"texture: .*'speckle', 'tiles' or 'blinds', got 'tile'"):
        read_scenario("paper_a", ["texture=tile"])
    with pytest.raises(FlysimError, match=r"texture_contrast: .* 1, got 1.5"):
        read_scenario("paper_a", ["texture_contrast=1.5"])
