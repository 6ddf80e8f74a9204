"""The BARN worlds: what the file says is what stands there, cylinder by cylinder, read and built in a second."""

import gzip
import time
from xml.etree import ElementTree

import numpy as np
import pytest

from flysim.geometry.frames import Pose2
from flysim.sim.simulation import Simulation
from flysim.truth.gap import touching_groups
from flysim.truth.truth import Truth
from flysim.worlds.sdf.reader import read_world
from flysim.worlds.shapes import Cylinder
from flysim.worlds.surface.dress import dress


@pytest.fixture(scope="module")
def files(made):
    found = sorted((made.data / "barn").glob("*.world.gz"))
    if not found:
        pytest.skip(f"no BARN worlds in {made.data}; FLYSIM_DATA names their folder")
    return found


def in_the_file(path):
    """Name -> (x, y, z, radius, length) of each cylinder outside <state>, read another way than flysim does."""
    world = ElementTree.fromstring(gzip.decompress(path.read_bytes())).find("world")
    found = {}
    for model in world.findall("model"):
        for cylinder in model.iterfind("link/collision/geometry/cylinder"):
            x, y, z = (float(v) for v in model.findtext("pose").split()[:3])
            size = float(cylinder.findtext("radius")), float(cylinder.findtext("length"))
            found[model.get("name")] = (x, y, z, *size)
    return found


def test_the_truth_is_the_files(files):
    counts = []
    for path in files:
        expected, world = in_the_file(path), read_world(path)
        bodies = {link.model: link for link in world.links if not link.structure}
        assert bodies.keys() == expected.keys()
        for name, (x, y, z, radius, length) in expected.items():
            (part,) = bodies[name].collisions
            assert part.shape == Cylinder(radius, length) == Cylinder(0.075, 1.0)
            assert (bodies[name].T_world_link @ part.T_link_part)[:3, 3].tolist() == [x, y, z]
        counts.append(len(expected))
        if path not in files[::6]:
            continue
        truth = Truth.of(world, [], max_range=4.0).obstacles
        assert sorted(i for one in truth for i in one.links) == [
            i for i, link in enumerate(world.links) if not link.structure
        ]
        middles = np.array([world.links[i].T_world_link[:2, 3] for i in range(len(world.links))])
        for one in truth:
            assert one.size[2] == pytest.approx(0.5)  # half a metre is in the ground
            others = np.setdiff1d([i for t in truth for i in t.links], one.links)
            off = np.linalg.norm(middles[list(one.links)][:, None] - middles[others][None], axis=2)
            assert off.min(initial=np.inf) > 0.15 + 0.05
    if len(files) == 30:
        assert (min(counts), max(counts)) == (181, 365)


def test_each_is_read_and_built_in_a_second(made, files):
    spent = []
    for path in files[::6]:
        began = time.process_time()
        world = read_world(path)
        with Simulation(world, made.rover(), Pose2(0.5, -1.5, 0.0)):
            spent.append(time.process_time() - began)
    assert min(spent) < 1.0, spent


def test_a_dressed_one_shares_its_textures(files):
    began = time.process_time()
    world = dress(read_world(files[0]))
    assert time.process_time() - began < 6.0  # 1 s on a machine of its own
    textures = [visual.material.texture for link in world.links for visual in link.visuals]
    assert None not in textures
    assert len(set(textures)) <= 40


def test_thousands_of_bodies_are_grouped_in_seconds():
    place = [np.eye(4) for _ in range(3000)]
    for k, T in enumerate(place):
        T[:2, 3] = 0.5 * (k % 100), 0.5 * (k // 100) - 0.4 * (k // 100 % 2)
    began = time.process_time()
    groups = touching_groups([[(Cylinder(0.05, 1.0), T)] for T in place], 0.05)
    assert time.process_time() - began < 10.0
    assert len(groups) == 1500
