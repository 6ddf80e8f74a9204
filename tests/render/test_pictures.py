"""Pictures without truth, as an agent gets them: what a report's renderer sees, from two eyes, world after world."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flysim.common.catalogue import find_world
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Pose2, inverse, transform
from flysim.geometry.rig import StereoRig
from flysim.render import gl_world
from flysim.render.choose import open_renderer
from flysim.render.gl import GlRenderer
from flysim.render.look import glance, look
from flysim.render.optics import SKY
from flysim.sim.simulation import Simulation
from flysim.worlds.sdf.reader import read_world
from flysim.worlds.shapes import Box, Cylinder, Plane, Sphere

SMALL = Camera.from_fov(160, 120, 1.2)
BASELINE = 0.12  # [m]
RIG = StereoRig.parallel(SMALL, BASELINE)
POSES = (Pose2(0.0, 0.0, 0.0), Pose2(0.3, 0.1, 0.7), Pose2(0.2, -0.1, -2.5))
AT = (1.8, -0.1, 0.2)  # [m] of a ball before the rover


@pytest.fixture(scope="module")
def yard():
    return read_world(find_world("yard"))


def middle(picture):
    """u, v of the middle of what is not sky."""
    v, u = np.nonzero((picture != SKY).any(axis=-1))
    assert len(u) > 100
    return np.array([u.mean(), v.mean()])


def same(one, other):
    np.testing.assert_array_equal(one.left, other.left)
    np.testing.assert_array_equal(one.right, other.right)


def test_the_right_eye_sees_a_ball_where_the_baseline_puts_it(made, renderer):
    floor = replace(made.link("floor", Plane((8.0, 8.0)), structure=True), visuals=())
    ball = made.link("ball", Sphere(0.12), (*AT, 0, 0, 0))
    with made.simulation(floor, ball, floor=False, textured=True) as simulation:
        eyes = open_renderer(renderer, simulation)
        pair = glance(simulation, eyes, RIG)
        eyes.close()
        T_left_world = inverse(simulation.T_world_base() @ made.rover.T_base_left)
    left, right = middle(pair.left), middle(pair.right)
    at = transform(T_left_world, AT)
    # A ball's image is an ellipse whose middle lies a little farther out than the ball's.
    assert left == pytest.approx(SMALL.project(at), abs=0.5)
    assert left[0] - right[0] == pytest.approx(SMALL.fx * BASELINE / at[2], abs=0.1)
    assert left[1] - right[1] == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize("pose", POSES)
def test_an_agent_sees_the_pixels_of_a_report(gl, made, yard, pose):
    with Simulation(yard, made.rover, pose) as simulation:
        eyes, quick = GlRenderer(simulation), GlRenderer(simulation, rig=RIG)
        pair, _ = look(simulation, eyes, RIG)
        same(pair, glance(simulation, eyes, RIG))
        other = glance(simulation, quick, RIG)
        for a, b in ((pair.left, other.left), (pair.right, other.right)):
            assert np.abs(a.astype(int) - b).mean() < 0.1  # round shapes have fewer corners
        eyes.close()
        quick.close()


def test_chords_are_as_fine_as_the_image_can_tell(gl, made):
    post = made.link("post", Cylinder(0.4, 1.0), (2.0, 0, 0.5, 0, 0, 0))
    off = []
    with made.simulation(post) as simulation:
        for scale in (1, 4):
            camera = Camera.from_fov(160 * scale, 120 * scale, 1.2)
            rig = StereoRig.parallel(camera, BASELINE)
            eyes, quick = GlRenderer(simulation), GlRenderer(simulation, rig=rig)
            a, b = (glance(simulation, one, rig).left.astype(int) for one in (eyes, quick))
            off.append(np.abs(a - b).max(axis=-1) > 10)
            eyes.close()
            quick.close()
    assert all(some.sum() <= 0.2 * some.shape[0] for some in off)  # along its two edges, a pixel in ten rows


def test_what_is_left_out_was_not_in_view(gl, made, yard, monkeypatch):
    for pose in POSES:
        with Simulation(yard, made.rover, pose) as simulation:
            eyes = GlRenderer(simulation)
            pair, views = look(simulation, eyes)
            with monkeypatch.context() as for_now:
                for_now.setattr(gl_world, "_seen", lambda corners: np.ones(len(corners), bool))
                other, all_of = look(simulation, eyes)
            eyes.close()
        same(pair, other)
        for a, b in zip(views, all_of, strict=True):
            np.testing.assert_array_equal(a.depth, b.depth)
            np.testing.assert_array_equal(a.link, b.link)


def test_pictures_of_any_size_one_after_the_other(gl, made):
    box = made.link("box", Box((0.4, 0.4, 0.4)), (1.8, 0, 0.2, 0, 0, 0))
    large = Camera.from_fov(320, 200, 1.0)
    rigs = (RIG, StereoRig.parallel(large, BASELINE), replace(RIG, right=large), replace(RIG, left=large), RIG)
    with made.simulation(box) as simulation:
        eyes = GlRenderer(simulation)
        for rig in rigs:
            pair = glance(simulation, eyes, rig)
            fresh = GlRenderer(simulation)
            same(pair, glance(simulation, fresh, rig))
            same(pair, look(simulation, eyes, rig)[0])
            fresh.close()
        eyes.close()


def test_another_simulation_is_drawn_and_its_world_uploaded_once(gl, made, yard):
    with Simulation(yard, made.rover, POSES[0]) as one, Simulation(yard, made.rover, POSES[1]) as two:
        eyes, fresh = GlRenderer(one, rig=RIG), GlRenderer(two, rig=RIG)
        first, uploaded = glance(one, eyes, RIG), eyes._world
        eyes.bind(two)
        assert eyes._world is uploaded
        same(glance(two, eyes, RIG), glance(two, fresh, RIG))
        eyes.bind(one)
        same(glance(one, eyes, RIG), first)
        with made.simulation() as bare:
            eyes.bind(bare)
            assert eyes._world is not uploaded
            glance(bare, eyes, RIG)
        eyes.bind(one)
        same(glance(one, eyes, RIG), first)
        for one_of_them in (eyes, fresh, eyes):  # closed twice
            one_of_them.close()


def test_what_moves_is_drawn_where_it_is_in_the_simulation_that_is_bound(gl, made):
    world = made.world(made.link("ball", Sphere(0.2), (2.0, 0, 8.0, 0, 0, 0), static=False))
    with Simulation(world, made.rover, POSES[0]) as one, Simulation(world, made.rover, POSES[0]) as two:
        made.lift(one, 1, 2.0)
        fallen = two.T_world_links()[1][2, 3]
        eyes, fresh = GlRenderer(one), GlRenderer(two)
        assert one.T_world_links()[1][2, 3] - fallen > 0.1
        before, after = glance(one, eyes, RIG), glance(two, fresh, RIG)
        eyes.bind(two)
        same(glance(two, eyes, RIG), after)
        assert (before.left != after.left).any()
        eyes.close()
        fresh.close()


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is read from /proc")
def test_many_worlds_leave_nothing_behind(gl, made, tmp_path):
    texture = tmp_path / "grey.png"
    Image.fromarray(np.full((512, 512, 3), 99, np.uint8)).save(texture)
    box = made.link("box", Box((0.4, 0.4, 0.4)), (1.8, 0, 0.2, 0, 0, 0), texture=texture)

    def held():
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")

    with made.simulation(box) as one, made.simulation(box) as two:
        eyes = GlRenderer(one, rig=RIG)
        for turn in range(80):
            now = (one, two)[turn % 2]
            eyes.bind(now)
            glance(now, eyes, RIG)
            if turn == 20:
                before = held()
        eyes.close()
    assert held() - before < 20e6  # [bytes]; what is left of one texture is 1.4e6, 60 times
