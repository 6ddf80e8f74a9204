"""Bare worlds in speckle: what gets a texture, what keeps its own, how many there are, when they go away."""

import gc
import itertools

import numpy as np
import pytest
from PIL import Image

from flysim.common.catalogue import find_world
from flysim.worlds.model import Link, Material, Part, World
from flysim.worlds.sdf.reader import read_world
from flysim.worlds.shapes import Box, Cylinder, Mesh, Plane, Shape, Sphere
from flysim.worlds.surface import dress as module
from flysim.worlds.surface.dress import dress


def link(name: str, shape: Shape, x: float = 0.0, colour=(0.7, 0.2, 0.2)) -> Link:
    T = np.eye(4)
    T[0, 3] = x
    part = Part(name="v", shape=shape, T_link_part=np.eye(4), material=Material(diffuse=colour))
    return Link(name="l", model=name, T_world_link=T, visuals=(part,), collisions=(part,), static=True, structure=False)


def world(*links):
    return World(name="w", path=find_world("paper"), links=links)


def pixels(visual):
    with Image.open(visual.material.texture) as image:
        return np.asarray(image.convert("RGB"), dtype=float)


def test_every_shape_gets_a_speckle_in_its_own_colour():
    mesh = Mesh(
        vertices=np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.5]], float),
        faces=np.array([[0, 1, 2]]),
        uv=np.array([[0.0, 0.0], [9.0, 0.0], [0.0, 9.0]]),  # of a picture that repeats
        path=find_world("paper"),
    )
    bare = world(*(link(str(k), s) for k, s in enumerate((Box((1, 1, 1)), Cylinder(0.2, 1), Sphere(0.3), mesh))))
    dressed = dress(bare)
    for made in dressed.links:
        red, green, blue = pixels(made.visuals[0]).reshape(-1, 3).mean(axis=0)
        assert red > green + 30.0
        assert abs(green - blue) < 15.0
        assert pixels(made.visuals[0]).std() > 20.0
    assert dressed.links[3].visuals[0].shape.uv is None


def test_what_has_a_texture_keeps_it():
    paper = read_world(find_world("paper"))
    for before, after in zip(paper.links, dress(paper).links, strict=True):
        for a, b in zip(before.visuals, after.visuals, strict=True):
            assert a.material == b.material
            assert a.shape is b.shape


def test_a_plane_is_cut_to_where_things_stand_and_lies_where_it_lay():
    T = np.eye(4)
    T[:3, 3] = 7.0, 3.0, 0.0
    plane = Part(name="v", shape=Plane((100.0, 100.0)), T_link_part=T, material=Material())
    ground = Link(
        name="l", model="ground", T_world_link=np.eye(4), visuals=(plane,), collisions=(), static=True, structure=True
    )
    dressed = dress(world(ground, link("box", Box((1.0, 1.0, 1.0)), x=5.0)))
    made = dressed.links[0].visuals[0]
    # From x = 0, where robots start, to 5.5, and 4 m more on every side.
    assert made.shape.size == pytest.approx((5.5 + 8.0, 1.0 + 8.0))
    assert made.T_link_part[:3, 3] == pytest.approx((2.75, 0.0, 0.0))
    height, width, _ = pixels(made).shape
    assert 0.5e6 < height * width < 1.1e6


def test_like_things_share_in_turns_and_neighbours_differ():
    made = dress(world(*(link(f"c{k}", Cylinder(0.075, 1.0), x=0.2 * k) for k in range(100))))
    textures = [one.visuals[0].material.texture for one in made.links]
    assert len(set(textures)) == module.VARIANTS
    assert all(a != b for a, b in itertools.pairwise(textures))
    first, second = (pixels(made.links[k].visuals[0]) for k in range(2))
    assert abs(np.corrcoef(first.ravel(), second.ravel())[0, 1]) < 0.3


def test_many_different_things_share_as_well():
    rng = np.random.default_rng(0)
    sizes = rng.uniform(0.1, 0.5, (1000, 3)).tolist()
    made = dress(world(*(link(str(k), Box(tuple(size))) for k, size in enumerate(sizes))))
    textures = [one.visuals[0].material.texture for one in made.links]
    assert None not in textures
    assert len(set(textures)) <= module.MAX_TEXTURES


@pytest.mark.parametrize("shape", [Box((60.0, 60.0, 1.0)), Sphere(20.0), Cylinder(0.01, 80.0)])
def test_huge_things_get_coarse_texels(shape):
    dressed = dress(world(link("huge", shape)))
    image = pixels(dressed.links[0].visuals[0])
    assert image.shape[0] * image.shape[1] < 1.2e6
    assert image.std() > 20.0


def test_the_same_world_is_dressed_the_same_way():
    bare = world(link("a", Box((0.4, 0.3, 0.2))), link("b", Sphere(0.2)))
    one, other = dress(bare), dress(bare)
    for a, b in zip(one.links, other.links, strict=True):
        assert a.visuals[0].material.texture.read_bytes() == b.visuals[0].material.texture.read_bytes()
    renamed = dress(world(link("c", Box((0.4, 0.3, 0.2)))))
    assert (pixels(renamed.links[0].visuals[0]) != pixels(one.links[0].visuals[0])).any()


def test_the_textures_go_with_the_world():
    made = dress(world(link("a", Box((0.4, 0.3, 0.2)))))
    folder = made.links[0].visuals[0].material.texture.parent
    assert folder.is_dir()
    del made
    gc.collect()
    assert not folder.exists()


def test_white_and_black_leave_room_for_blotches():
    for colour in ((1.0, 1.0, 1.0), (0.0, 0.0, 0.0)):
        made = dress(world(link("a", Box((1.0, 1.0, 1.0)), colour=colour)))
        assert pixels(made.links[0].visuals[0]).std() > 25.0
