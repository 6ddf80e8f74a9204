"""A scene whose every figure can be told by hand, and one small run of Table 1 for all tests here."""

from types import SimpleNamespace

import numpy as np
import pytest

from flysim.flies.parameters import FlyParams
from flysim.geometry.camera import Camera
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.studies.bench.scene import Scene, SceneBody, true_disparity
from flysim.studies.table1.grid import Cell
from flysim.studies.table1.pair import render_pair
from flysim.studies.table1.table1 import run_table1

# One cell that reaches its criterion, one larger, and the paper's favourite; out of order on purpose.
SMALL = (Cell("C", 3000, 4, 90), Cell("A", 500, 2, 90), Cell("A", 500, 4, 95))


def stripes(width, height, amplitude):
    """Columns that alternate about grey 100 by an amplitude: their standard deviation along a row is that."""
    columns = np.where(np.arange(width) % 2, 100 + amplitude, 100 - amplitude)
    return np.broadcast_to(columns[None, :, None], (height, width, 3)).astype(np.uint8).copy()


def scene(left, depth, seen=None, link=None):
    """A scene of f B = 12 px m from a left image, `[H, W]` depths [m] and what both see (default: all)."""
    height, width = left.shape[:2]
    camera = Camera(width=width, height=height, fx=100.0, fy=100.0, cx=(width - 1) / 2, cy=(height - 1) / 2)
    rig = StereoRig.parallel(camera, 0.12)
    depth = np.broadcast_to(np.asarray(depth, np.float32), (height, width))
    return Scene(
        pair=ImagePair(left=left, right=left, rig=rig),
        disparity=true_disparity(rig, depth),
        depth=depth,
        link=np.zeros((height, width), np.int32) if link is None else link,
        seen=np.ones((height, width), bool) if seen is None else seen,
        bodies=(SceneBody(name="box", link=1, distance=2.0, width=0.4),),
    )


def flies(*rows):
    """A swarm of flies (u, v, disparity), of which only that is asked."""
    u, v, disparity = np.array(rows, np.float32).reshape(-1, 3).T
    return SimpleNamespace(uv=np.stack([u, v], 1), uv_right=np.stack([u - disparity, v], 1))


@pytest.fixture(scope="session")
def made():
    return SimpleNamespace(stripes=stripes, scene=scene, flies=flies)


@pytest.fixture(scope="session")
def rendered():
    return render_pair()


@pytest.fixture(scope="session")
def base():
    return FlyParams(settled_fitness=0.3, max_iterations=30)  # easily settled: some generations, not the limit


@pytest.fixture(scope="session")
def table(rendered, base):
    return run_table1(seeds=2, grid=SMALL, base=base, rendered=rendered)
