import numpy as np
import pytest

from flysim.evaluate.landing import LANDED, Landing
from flysim.geometry.frames import inverse, transform
from flysim.truth.sight import sights

MAX_RANGE = 6.0


@pytest.fixture(scope="module")
def stop(yard):
    return yard.stops[0]


@pytest.fixture(scope="module")
def ground(yard, stop):
    return Landing.of(yard.world, stop, MAX_RANGE)


def seen_from(stop, world, name, towards=(0.0, 0.0, 0.0)):
    """`[N, 3]` points that both cameras saw of a body, moved [m, world], in the left optical frame."""
    (link,) = [i for i, body in enumerate(world.links) if body.model == name]
    (sight,) = sights([stop], MAX_RANGE)
    points = sight.points(sight.seen & (stop.views[0].link == link)) + np.array(towards)
    assert len(points) > 50
    return transform(inverse(stop.views[0].T_world_optical), points)


def test_two_centimetres_is_as_far_as_landing_goes(yard, stop, ground):
    assert LANDED == 0.02
    over = np.array([0.2, -0.7, 0.3])  # the middle of box_2's upper face
    for off, landed in ((0.0, True), (0.019, True), (0.021, False), (0.1, False)):
        place = transform(inverse(stop.views[0].T_world_optical), over[None] + (0.0, 0.0, off))
        assert ground.on_object(place).tolist() == ground.on_anything(place).tolist() == [landed]


@pytest.mark.parametrize("name", ["floor", "wall"])
def test_floor_and_wall_are_something_to_land_on_and_no_object(yard, stop, ground, name):
    points = seen_from(stop, yard.world, name)
    assert ground.on_anything(points).all()
    assert ground.on_object(points).mean() < 0.02  # the floor within 2 cm of a foot


@pytest.mark.parametrize("name", ["box_1", "box_2", "pole"])
def test_every_body_that_is_no_structure_is_an_object(yard, stop, ground, name):
    assert ground.on_object(seen_from(stop, yard.world, name)).all()
    assert not ground.on_object(seen_from(stop, yard.world, name, towards=(0.0, 0.0, 1.0))).any()


def test_what_neither_camera_saw_is_no_place_to_land(yard, stop, ground):
    behind = np.array([[0.2 + 0.2, -0.7, 0.15]])  # on the far face of box_2
    placed = transform(inverse(stop.views[0].T_world_optical), behind)
    assert not ground.on_object(placed).any()
    nothing = Landing.of(yard.world, stop, 0.1)
    assert not nothing.on_anything(seen_from(stop, yard.world, "box_2")).any()


def test_no_flies_and_flies_that_are_not_finite(ground):
    assert ground.on_object(np.empty((0, 3))).shape == (0,)
    assert ground.on_anything([[np.nan, np.nan, np.nan]]).tolist() == [False]
