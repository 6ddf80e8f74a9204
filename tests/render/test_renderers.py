"""Both renderers against exact rays, and thereby against each other."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from flysim.geometry.camera import Camera
from flysim.geometry.frames import R_BODY_OPTICAL, inverse, rotation_rpy, se3, transform
from flysim.render.choose import open_renderer
from flysim.render.look import look
from flysim.render.optics import FAR, SKY
from flysim.worlds.model import Link, Part
from flysim.worlds.shapes import Box, Cylinder, Plane, Sphere

SQUARE = Camera.from_fov(640, 480, math.radians(65.0))
LOPSIDED = Camera(width=620, height=460, fx=520.0, fy=430.0, cx=250.3, cy=275.8)
CAMERAS = {"square": SQUARE, "lopsided": LOPSIDED}
# A plane with waves on it stands across the way, 2.4 m on a side.
SIDE, WAVE = 2.4, 0.12


def eye(x, y, z, roll=0.0, pitch=0.0, yaw=0.0):
    """`T_world_optical` of a camera that looks along the x axis of that pose."""
    return se3(rotation_rpy(roll, pitch, yaw) @ R_BODY_OPTICAL, (x, y, z))


EYES = (eye(0.4, 0.0, 0.8), eye(0.6, -0.8, 1.3, 0.1, 0.25, 0.4), eye(0.2, 0.7, 0.5, -0.2, -0.1, -0.3))


def waves(xy):
    """`[...]` brightness 0 to 1 at places on the plane [m]."""
    x, y = xy[..., 0], xy[..., 1]
    return 0.5 + 0.25 * np.sin(2 * math.pi * x / WAVE) + 0.25 * np.sin(2 * math.pi * y / (1.1 * WAVE) + 1.0)


def pixel_rays(camera):
    """`[H, W, 3]` points at depth 1 m behind each pixel's centre, optical frame."""
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    return camera.unproject(np.stack([u, v], axis=-1), np.ones(u.shape))


def plane_depth(camera, T_optical_plane):
    """`[H, W]` depth of an endless plane [m]."""
    normal, point = T_optical_plane[:3, 2], T_optical_plane[:3, 3]
    depth = (normal @ point) / (pixel_rays(camera) @ normal)
    return np.where(depth > 0.0, depth, np.inf)


def box_depth(camera, T_optical_box, size):
    """`[H, W]` depth at which each pixel's ray enters a box [m]; inf where it misses (slabs, Kay and Kajiya 1986)."""
    T = inverse(T_optical_box)
    directions, origin = pixel_rays(camera) @ T[:3, :3].T, T[:3, 3]
    with np.errstate(divide="ignore"):
        slabs = [(side * np.array(size) / 2.0 - origin) / directions for side in (-1.0, 1.0)]
    enter, leave = np.minimum(*slabs).max(axis=-1), np.maximum(*slabs).min(axis=-1)
    return np.where((enter <= leave) & (enter > 0.0), enter, np.inf)


def sphere_depth(camera, T_optical_sphere, radius):
    """`[H, W]` depth at which each pixel's ray enters a sphere [m]; inf where it misses."""
    d, c = pixel_rays(camera), T_optical_sphere[:3, 3]
    a, b = (d**2).sum(axis=-1), d @ c
    root = b**2 - a * (c @ c - radius**2)
    return np.where(root > 0.0, (b - np.sqrt(np.maximum(root, 0.0))) / a, np.inf)


@pytest.fixture(scope="module")
def wavy(made, tmp_path_factory):
    """A simulation of the plane with waves; what each renderer sees of it, by camera and eye."""
    texture = tmp_path_factory.mktemp("texture") / "waves.png"
    n = 4000  # 0.6 mm a texel, far under a pixel: TinyRenderer takes the nearest, and beats with coarser ones
    at = ((np.arange(n) + 0.5) / n - 0.5) * SIDE
    x, y = np.meshgrid(at, -at)  # rows run down
    image = np.round(waves(np.stack([x, y], axis=-1)) * 255.0).astype(np.uint8)
    Image.fromarray(np.repeat(image[..., None], 3, axis=2)).save(texture)
    plane = made.link("plane", Plane((SIDE, SIDE)), (2.4, 0, 1.0, 0, -math.pi / 2, 0), texture=texture)
    with made.simulation(plane, start=(-3, 0, 0), textured=True) as simulation:
        views = {}

        def view(renderer, camera, place):
            key = renderer, camera, place
            if key not in views:
                eyes = open_renderer(renderer, simulation)
                views[key] = eyes.view(CAMERAS[camera], EYES[place])
                eyes.close()
            return views[key]

        yield SimpleNamespace(view=view, T_world_plane=plane.T_world_link)


def shifts(image, camera, T_optical_plane, seen, block=60):
    """`[n, 2]` how far [px] each block of an image lies off the exact projection of the waves.

    A shift d of an image I changes it by -grad(I) d: d, a gain and an offset are fitted to each block.
    """
    depth = plane_depth(camera, T_optical_plane)
    on = transform(inverse(T_optical_plane), pixel_rays(camera) * depth[..., None])
    exact = waves(on)
    dv, du = np.gradient(exact)
    found = []
    for top in range(0, camera.height - block + 1, block):
        for left in range(0, camera.width - block + 1, block):
            window = np.s_[top : top + block, left : left + block]
            if not seen[window].all():
                continue
            columns = [exact[window], np.ones((block, block)), -du[window], -dv[window]]
            A = np.stack([column.ravel() for column in columns], axis=1)
            gain, _, *d = np.linalg.lstsq(A, image[window].ravel() / 255.0, rcond=None)[0]
            found.append(np.array(d) / gain)
    return np.array(found)


@pytest.mark.parametrize("place", range(len(EYES)))
@pytest.mark.parametrize("camera", CAMERAS)
def test_a_pattern_is_where_the_calibration_projects_it(wavy, renderer, camera, place):
    view = wavy.view(renderer, camera, place)
    T_optical_plane = inverse(EYES[place]) @ wavy.T_world_plane
    off = shifts(view.rgb[..., 1].astype(float), view.camera, T_optical_plane, view.link == 1)
    assert len(off) >= 8
    assert np.abs(off.mean(axis=0)).max() < 0.03
    assert np.abs(off).max() < 0.1


@pytest.mark.parametrize("place", range(len(EYES)))
@pytest.mark.parametrize("camera", CAMERAS)
def test_the_two_renderers_agree_within_a_tenth_of_a_pixel(gl, wavy, camera, place):
    T_optical_plane = inverse(EYES[place]) @ wavy.T_world_plane
    views = [wavy.view(name, camera, place) for name in ("gl", "tiny")]
    seen = (views[0].link == 1) & (views[1].link == 1)
    a, b = (shifts(v.rgb[..., 1].astype(float), v.camera, T_optical_plane, seen) for v in views)
    assert np.abs(a - b).max() < 0.1
    assert (views[0].link != views[1].link).mean() < 1e-3  # some pixels on an edge
    assert np.abs(views[0].rgb[seen].astype(float) - views[1].rgb[seen]).mean() < 6.0  # and they look alike


@pytest.mark.parametrize("camera", CAMERAS)
def test_depth_and_mask_are_those_of_exact_rays(made, renderer, camera):
    camera = CAMERAS[camera]
    box, ball = Box((0.5, 0.4, 0.6)), Sphere(0.3)
    links = (
        made.link("box", box, (2.2, -0.3, 0.5, 0.2, 0.3, 0.5)),
        made.link("ball", ball, (2.0, 0.5, 0.7, 0, 0, 0)),
    )
    T_world_optical = EYES[0]
    with made.simulation(*links, start=(-3, 0, 0), textured=True) as simulation:
        eyes = open_renderer(renderer, simulation)
        view = eyes.view(camera, T_world_optical)
        eyes.close()
    to_optical = inverse(T_world_optical)
    floor = plane_depth(camera, to_optical)
    on_floor = transform(T_world_optical, pixel_rays(camera) * np.where(np.isfinite(floor), floor, 0.0)[..., None])
    exact = np.stack(
        [
            np.where((np.abs(on_floor[..., :2]) <= 4.0).all(axis=-1), floor, np.inf),
            box_depth(camera, to_optical @ links[0].T_world_link, box.size),
            sphere_depth(camera, to_optical @ links[1].T_world_link, ball.radius),
        ]
    )
    link = np.where(np.isfinite(exact.min(axis=0)), exact.argmin(axis=0), -1)
    wrong = view.link != link
    assert wrong.mean() < 1e-3  # pixels that an edge runs through
    assert set(np.unique(view.link)) == {-1, 0, 1, 2}
    for index, typical, nearly_all in ((0, 2e-5, 1e-4), (1, 2e-5, 1e-4), (2, 2e-4, 2e-3)):  # a ball is drawn in facets
        same = (view.link == index) & (link == index)
        assert same.sum() > 2000
        error = np.abs(view.depth[same] - exact[index][same])
        assert np.median(error) < typical
        assert np.quantile(error, 0.99) < nearly_all


def test_the_sky_has_no_depth_and_no_body(made, renderer):
    # Once a clear colour leaked into the truth: the sky had a depth of 0.7 m and a link.
    with made.simulation(start=(-3, 0, 0), textured=True) as simulation:
        eyes = open_renderer(renderer, simulation)
        up = eyes.view(SQUARE, eye(0, 0, 1, 0, -1.2, 0))
        level = eyes.view(SQUARE, EYES[0])
        eyes.close()
    assert np.isinf(up.depth).all()
    assert (up.link == -1).all()
    assert (up.rgb == SKY).all()
    sky = level.link == -1
    assert 0.2 < sky.mean() < 0.8
    assert np.isinf(level.depth[sky]).all()
    assert (level.rgb[sky] == SKY).all()
    assert (level.depth[~sky] < FAR).all()
    assert (up.rgb.dtype, up.depth.dtype, up.link.dtype) == (np.uint8, np.float32, np.int32)


def test_the_robot_is_seen_and_is_no_body_of_the_world(made, renderer):
    with made.simulation(textured=True) as simulation:
        eyes = open_renderer(renderer, simulation)
        view = eyes.view(SQUARE, eye(-1.2, 0, 0.25))
        without = eyes.view(SQUARE, eye(-1.2, 0, 0.25, 0, 0, math.pi))
        eyes.close()
    robot = (view.link == -1) & np.isfinite(view.depth)
    assert robot.sum() > 5000
    assert 0.9 < np.median(view.depth[robot]) < 1.2
    assert not ((without.link == -1) & np.isfinite(without.depth)).any()


def test_only_what_is_visual_is_drawn(made, renderer):
    # pybullet draws a body's collision shapes where it has no visual one: a plane without end, boxes without texture.
    hidden = made.link("hidden", Box((0.5, 0.5, 0.5)), (2, 0, 0.6, 0, 0, 0))
    links = [
        Link(
            name="body",
            model=f"hidden_{static}",
            T_world_link=se3(np.eye(3), (2.0, -0.5 + static, 0.3)),
            visuals=(),
            collisions=hidden.collisions,
            static=static,
            structure=False,
        )
        for static in (True, False)
    ]
    with made.simulation(*links, start=(-3, 0, 0), textured=True) as simulation:
        eyes = open_renderer(renderer, simulation)
        view = eyes.view(SQUARE, EYES[0])
        beyond = eyes.view(SQUARE, eye(3.9, 0, 0.5, 0, 0.4, 0))  # the floor ends at 4 m
        eyes.close()
    assert set(np.unique(view.link)) == {-1, 0}
    assert (beyond.link == 0).mean() < 0.5


def test_two_renders_have_the_same_bytes(wavy, made, renderer):
    def bytes_of(eyes, place):
        view = eyes.view(SQUARE, EYES[place])
        return view.rgb.tobytes(), view.depth.tobytes(), view.link.tobytes()

    box = made.link("box", Box((0.5, 0.4, 0.6)), (2.2, -0.3, 0.5, 0.2, 0.3, 0.5))
    with (
        made.simulation(box, textured=True) as one,
        made.simulation(box, made.link("post", Cylinder(0.1, 1.0), (2, 0.5, 0.5, 0, 0, 0)), textured=True) as two,
    ):
        a, b = open_renderer(renderer, one), open_renderer(renderer, two)
        first, other = bytes_of(a, 0), bytes_of(b, 0)
        assert bytes_of(a, 0) == first  # after the other one has drawn
        assert bytes_of(b, 0) == other
        assert first != other
        a.view(LOPSIDED, EYES[1])  # another size in between
        assert bytes_of(a, 0) == first
        b.close()
        assert bytes_of(a, 0) == first
        a.close()
        again = open_renderer(renderer, one)
        assert bytes_of(again, 0) == first
        again.close()


def test_what_has_moved_is_drawn_where_it_is(made, renderer):
    ball = made.link("ball", Sphere(0.2), (2, 0, 2.4, 0, 0, 0), static=False)
    with made.simulation(ball, start=(-3, 0, 0), textured=True) as simulation:
        eyes = open_renderer(renderer, simulation)
        made.lift(simulation, 1, 1.2)
        heights = []
        for _ in range(3):
            view = eyes.view(SQUARE, EYES[0])
            T_world_ball = simulation.T_world_links()[1]
            exact = np.isfinite(sphere_depth(SQUARE, inverse(EYES[0]) @ T_world_ball, 0.2))
            assert exact.sum() > 10_000
            assert ((view.link == 1) != exact).sum() < 0.01 * exact.sum()
            heights.append(T_world_ball[2, 3])
            simulation.advance(0.0, 0.0, 32)
        eyes.close()
    assert heights[0] - heights[2] > 0.3


def test_a_link_of_several_parts_that_has_turned(made, renderer):
    parts = tuple(
        Part(name=f"p{i}", shape=Box((0.2, 0.2, 0.2)), T_link_part=se3(np.eye(3), (0.0, 0.3 * side, 0.1)))
        for i, side in enumerate((-1, 1))
    )
    link = Link(
        name="body",
        model="dumbbell",
        T_world_link=se3(rotation_rpy(0.4, 0, 0.3), (2.0, 0.0, 0.5)),
        visuals=parts,
        collisions=parts,
        static=False,
        structure=False,
    )
    with made.simulation(link, start=(-3, 0, 0), textured=True) as simulation:
        eyes = open_renderer(renderer, simulation)
        view = eyes.view(SQUARE, EYES[0])
        eyes.close()
        T = simulation.T_world_links()[1]
    depth = np.min(
        [box_depth(SQUARE, inverse(EYES[0]) @ T @ part.T_link_part, (0.2, 0.2, 0.2)) for part in parts], axis=0
    )
    exact = np.isfinite(depth)
    assert exact.sum() > 2000
    assert ((view.link == 1) != exact).sum() < 0.02 * exact.sum()
    both = (view.link == 1) & exact
    assert np.quantile(np.abs(view.depth[both] - depth[both]), 0.99) < 1e-3


def test_the_pair_is_taken_from_the_robots_own_eyes(made, renderer):
    wall = made.link("wall", Box((0.1, 6.0, 3.0)), (3, 0, 1.5, 0, 0, 0))
    with made.simulation(wall, start=(0.3, 0.2, 10), textured=True) as simulation:
        eyes = open_renderer(renderer, simulation)
        pair, (left, right) = look(simulation, eyes)
        eyes.close()
        T_world_left = simulation.T_world_base() @ made.rover.T_base_left
    assert np.array_equal(pair.left, left.rgb)
    assert np.array_equal(pair.right, right.rgb)
    assert left.T_world_optical == pytest.approx(T_world_left)
    # The right eye is 12 cm along the left one's x axis.
    assert transform(inverse(T_world_left), right.T_world_optical[:3, 3]) == pytest.approx((0.12, 0, 0), abs=1e-12)
    to_wall = inverse(T_world_left) @ se3(rotation_rpy(0, -math.pi / 2, 0), (2.95, 0, 1.5))
    seen = left.link == 1
    assert seen.mean() > 0.3
    assert np.abs(left.depth[seen] - plane_depth(SQUARE, to_wall)[seen]).max() < 2e-4
    assert not pair.left.flags.writeable
