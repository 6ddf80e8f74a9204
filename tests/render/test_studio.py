"""One place sets up a simulation and what draws it: it chooses, falls back, starts over, and leaves nothing open."""

import moderngl
import numpy as np
import pytest

from flysim.errors import RendererError
from flysim.geometry.frames import Pose2
from flysim.render import choose, gl_world
from flysim.render.light import LightParams
from flysim.render.studio import Studio, drawn
from flysim.sim.bullet import pybullet
from flysim.worlds.shapes import Box

HERE, THERE = Pose2(0.2, 0.0, 0.0), Pose2(-0.3, 0.1, 0.5)


def clients():
    """Of pybullet, those that are open."""
    return [client for client in range(100) if pybullet.isConnected(client)]


@pytest.fixture
def studio():
    """Makes studios, and closes them."""
    made = []

    def make(*arguments, **more):
        made.append(Studio(*arguments, **more))
        return made[-1]

    yield make
    for one in made:
        one.close()


def test_a_new_start_frees_the_simulation_before_it(made, renderer, studio):
    world, one = made.world(), studio(made.rover, renderer, rig=made.rover.rig)
    first = one.set_up(world, HERE)
    before, number = one.pair(), len(clients())
    second = one.set_up(world, THERE)
    assert second is one.simulation is not first
    assert (second.true_pose().x, second.true_pose().y) == pytest.approx((-0.3, 0.1), abs=0.01)
    assert len(clients()) == number
    assert (one.pair().left != before.left).any()
    one.set_up(world, HERE)
    np.testing.assert_array_equal(one.pair().left, before.left)  # nothing of the second is left
    one.close()
    one.close()
    assert len(clients()) == number - 1


def test_another_world_is_drawn_once_it_stands(made, renderer, studio):
    one = studio(made.rover, renderer, rig=made.rover.rig)
    bare, full = made.world(), made.world(made.link("box", Box((0.3, 0.3, 0.6)), (1.5, 0.0, 0.3, 0, 0, 0)))
    pictures = []
    for world in (bare, full, bare):
        one.set_up(world, HERE)
        pictures.append(one.pair().left)
    assert (pictures[0] != pictures[1]).mean() > 0.01
    np.testing.assert_array_equal(pictures[2], pictures[0])


def test_what_the_driver_refuses_is_drawn_by_tiny_until_another_world_stands(gl, made, studio, monkeypatch):
    one, world, other = studio(made.rover, "auto", rig=made.rover.rig), made.world(), made.world()
    uploads = []

    def refuse(*_):
        uploads.append(1)
        raise moderngl.Error("too large")

    with monkeypatch.context() as for_now:
        for_now.setattr(gl_world.GlWorld, "_texture", refuse)
        for _ in range(2):  # asked once, not at every start
            one.set_up(world, HERE)
            assert one.drawn_by == "tiny"
            assert np.ptp(one.pair().left) > 0
    assert len(uploads) == 1
    one.set_up(world, HERE)
    assert one.drawn_by == "tiny"
    one.set_up(other, HERE)
    assert one.drawn_by == "gl"


def test_nobody_looks_and_it_drives_all_the_same(made, studio):
    one = studio(made.rover, None)
    assert one.set_up(made.world(), HERE).true_pose().x == pytest.approx(0.2, abs=0.01)
    assert one.drawn_by is None


@pytest.mark.parametrize("name", ["tiny", "auto"])
def test_a_light_that_tiny_cannot_draw_leaves_nothing_open(made, monkeypatch, name):
    monkeypatch.setattr(choose, "gl_works", lambda: False)
    before, light = clients(), LightParams(shadows=True)
    with pytest.raises(RendererError, match="need the renderer gl"), drawn(made.world(), made.rover, HERE, name, light):
        pass
    assert clients() == before


def test_a_block_that_fails_closes_what_it_had(made, renderer):
    before = clients()
    with pytest.raises(ZeroDivisionError), drawn(made.world(), made.rover, HERE, renderer) as (_, eyes):
        assert eyes.name == renderer
        raise ZeroDivisionError
    assert clients() == before
