"""Photographs with known depth (Middlebury and Tsukuba): the share of flies within a pixel of the truth."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flysim.flies.evolution import evolve
from flysim.flies.parameters import FlyParams
from flysim.geometry.camera import Camera
from flysim.geometry.rig import ImagePair, StereoRig

PHOTOGRAPHS = Path(__file__).parents[3] / "shared" / "data" / "stereo"
FOCAL_PX, BASELINE = 1000.0, 0.1  # any: disparity is what is scored
LEAST_DISPARITY_PX = 3.0


def read(name):
    folder = PHOTOGRAPHS / name
    if not folder.is_dir():
        pytest.skip(f"the photographs are not here: {folder}")
    left, right = (np.asarray(Image.open(folder / f"{side}.png").convert("RGB")) for side in ("left", "right"))
    height, width = left.shape[:2]
    camera = Camera(width=width, height=height, fx=FOCAL_PX, fy=FOCAL_PX, cx=width / 2, cy=height / 2)
    pair = ImagePair(left=left, right=right, rig=StereoRig.parallel(camera, BASELINE))
    return pair, np.load(folder / "disp_gt.npy"), json.loads((folder / "calib.json").read_text())["ndisp"]


# Least of five seeds within 1 px: cones 0.965 of 1155 flies, teddy 0.942 of 1093, motorcycle_q 0.972 of 1024, tsukuba
# 0.981 of 987. SGBM's valid pixels: 0.94, 0.90, 0.90, 0.93.
@pytest.mark.parametrize(
    ("name", "within_1px", "within_3px", "flies"),
    [
        ("cones", 0.955, 0.975, 1000),
        ("teddy", 0.93, 0.96, 950),
        ("motorcycle_q", 0.96, 0.98, 900),
        ("tsukuba", 0.97, 0.985, 850),
    ],
)
def test_flies_settle_on_photographs(name, within_1px, within_3px, flies):
    pair, truth, ndisp = read(name)
    depth = FOCAL_PX * BASELINE
    params = FlyParams(population=5000, operators="C", min_depth=depth / ndisp, max_depth=depth / LEAST_DISPARITY_PX)
    swarm = evolve(pair, params, rng=np.random.default_rng(1))
    u, v = swarm.uv.astype(int).T
    error = np.abs(swarm.uv[:, 0] - swarm.uv_right[:, 0] - truth[v, u])
    error = error[np.isfinite(error)]
    assert len(error) > flies
    assert np.mean(error < 1.0) > within_1px
    assert np.mean(error < 3.0) > within_3px
