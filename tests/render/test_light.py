"""Light on a floor and a box, held against what can be worked out by hand for each pixel."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from flysim.errors import FlysimError, RendererError
from flysim.geometry.frames import transform
from flysim.nav.env import FlyNavEnv
from flysim.render.choose import open_renderer
from flysim.render.gl import GlRenderer
from flysim.render.light import LightParams, lamp_position
from flysim.render.look import glance, look
from flysim.render.optics import SKY
from flysim.runs.run import run
from flysim.runs.scenario import read_scenario
from flysim.worlds.shapes import Box

NEAR, FAR, HALF, TOP = 1.3, 1.7, 0.2, 0.4  # [m] of the box: x from and to, y to both sides, z


@pytest.fixture(scope="module")
def stand(made):
    """A rover that looks along x at a box on a floor."""
    box = made.link("box", Box((FAR - NEAR, 2 * HALF, TOP)), ((NEAR + FAR) / 2, 0, TOP / 2, 0, 0, 0))
    with made.simulation(box, textured=True) as simulation:
        yield simulation


def seen(simulation, renderer="gl", **light):
    """The left view of a light, with where in the world each pixel lies, and which lie on floor and box."""
    eyes = open_renderer(renderer, simulation, LightParams(**light))
    try:
        _, (view, _) = look(simulation, eyes)
    finally:
        eyes.close()
    camera = view.camera
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], axis=-1)
    hit = np.isfinite(view.depth)
    depth = np.where(hit, view.depth, 1.0)[..., None]
    return SimpleNamespace(
        view=view,
        rgb=view.rgb.astype(float),
        at=transform(view.T_world_optical, rays * depth),
        eye=view.T_world_optical[:3, 3],
        floor=hit & (view.link == 0),
        box=hit & (view.link == 1),
        sky=~hit,
    )


def colour(simulation):
    """`[3]` of floor and box in the full light."""
    return seen(simulation, ambient=1.0).rgb[-1, 0]


@pytest.mark.parametrize("level", [0.5, 0.05, 0.0, 1.5])
def test_a_level_is_a_factor_of_everything(stand, renderer, level):
    day, other = seen(stand, renderer), seen(stand, renderer, level=level)
    tolerance = 1.0 if renderer == "gl" else 0.51 + 0.5 * level
    np.testing.assert_allclose(other.rgb, np.minimum(level * day.rgb, 255.0), atol=tolerance)
    np.testing.assert_array_equal(other.view.depth, day.view.depth)
    np.testing.assert_array_equal(other.view.link, day.view.link)


def test_a_colour_is_a_factor_of_each_channel(stand, renderer):
    day, warm = seen(stand, renderer), seen(stand, renderer, colour=(1.0, 0.5, 0.25))
    np.testing.assert_allclose(warm.rgb, day.rgb * (1.0, 0.5, 0.25), atol=1.0)
    np.testing.assert_allclose(warm.rgb[0, 0], np.array(SKY) * (1.0, 0.5, 0.25), atol=0.51)


def test_the_sun_falls_by_the_cosine_and_the_rest_from_everywhere(stand, gl):
    full, picture = colour(stand), seen(stand, direction=(-1.0, 0.0, 1.0), ambient=0.3)
    share = 0.3 + 0.7 * math.sqrt(0.5)  # floor and front alike, at 45 degrees
    for part in (picture.floor, picture.box & (np.abs(picture.at[..., 2] - TOP) > 0.01)):
        np.testing.assert_allclose(picture.rgb[part] / full, share, atol=0.008)


def test_a_shadow_lies_where_the_sun_does_not_reach(stand, gl):
    full, picture = colour(stand), seen(stand, direction=(1.0, 0.0, 1.0), ambient=0.4, shadows=True)
    x, y, _ = np.moveaxis(picture.at, 2, 0)
    inside = (x > NEAR - TOP + 0.02) & (x < NEAR - 0.02) & (np.abs(y) < HALF - 0.02)
    outside = (x < NEAR - TOP - 0.02) | (np.abs(y) > HALF + 0.02)
    near = np.hypot(x - NEAR, y) < 1.5  # not the robot's own
    dark, bright = (picture.rgb[picture.floor & near & part & (x > 0.6)] for part in (inside, outside))
    assert len(dark) > 1000 and len(bright) > 1000
    np.testing.assert_allclose(dark, 0.4 * np.broadcast_to(full, dark.shape), atol=1.5)
    np.testing.assert_allclose(bright, (0.4 + 0.6 * math.sqrt(0.5)) * np.broadcast_to(full, bright.shape), atol=1.5)
    np.testing.assert_allclose(picture.rgb[picture.box & (x < NEAR + 0.01)] / full, 0.4, atol=0.008)  # its own side


def test_a_mirror_shows_what_stands_on_it_upside_down(stand, gl):
    day, picture = seen(stand), seen(stand, floor_shine=1.0)
    ray = picture.at - picture.eye
    t = (NEAR - picture.at[..., 0]) / ray[..., 0]
    height = -ray[..., 2] * t  # where the ray from the floor meets the plane of the box's front
    side = picture.at[..., 1] + ray[..., 1] * t
    before = picture.floor & (picture.at[..., 0] < NEAR - 0.01)
    front = before & (height > 0.02) & (height < TOP - 0.02) & (np.abs(side) < HALF - 0.02)
    beside = before & (np.abs(side) > HALF + 0.2)
    face = day.rgb[day.box & (day.at[..., 0] < NEAR + 0.01)][0]
    assert front.sum() > 1000 and beside.sum() > 1000
    np.testing.assert_allclose(picture.rgb[front], np.broadcast_to(face, (front.sum(), 3)), atol=1.5)
    np.testing.assert_allclose(picture.rgb[beside], np.broadcast_to(SKY, (beside.sum(), 3)), atol=1.5)
    np.testing.assert_array_equal(picture.view.link, day.view.link)  # what truly stands there is the floor
    np.testing.assert_array_equal(picture.view.depth, day.view.depth)


def test_a_floor_that_shines_a_little_shines_more_towards_the_horizon(stand, gl):
    day, picture = seen(stand), seen(stand, floor_shine=0.1)
    part = picture.floor & (np.abs(picture.at[..., 1]) > 0.9)  # nothing but sky in it
    ray = (picture.at - picture.eye)[part]
    facing = -ray[:, 2] / np.linalg.norm(ray, axis=1)
    share = (0.1 + 0.9 * (1.0 - facing) ** 5)[:, None]
    np.testing.assert_allclose(picture.rgb[part], (1 - share) * day.rgb[part] + share * np.array(SKY), atol=1.5)


def test_a_lamp_falls_with_the_square_of_the_distance(stand, gl):
    full, picture = colour(stand), seen(stand, level=0.0, lamp=0.7)
    way = lamp_position(stand.T_world_base(), stand.robot) - picture.at
    distance = np.linalg.norm(way, axis=-1)
    floor = picture.floor & (picture.at[..., 0] > 0.5)
    expected = (0.7 * way[..., 2] / distance**3)[floor][:, None] * full
    np.testing.assert_allclose(picture.rgb[floor], np.minimum(expected, 255.0), atol=1.5)
    front = picture.box & (picture.at[..., 0] < NEAR + 0.01)
    expected = (0.7 * -way[..., 0] / distance**3)[front][:, None] * full
    np.testing.assert_allclose(picture.rgb[front], np.minimum(expected, 255.0), atol=1.5)
    assert picture.rgb[picture.sky].max() == 0.0  # darkness


@pytest.mark.parametrize(
    "light", [{}, {"level": 0.3, "lamp": 0.5}, {"shadows": True, "direction": (1, 0.2, 1)}, {"floor_shine": 0.3}]
)
def test_an_agent_and_a_report_see_one_light(made, stand, gl, light):
    eyes = open_renderer("gl", stand, LightParams(**light))
    pair, _ = look(stand, eyes)
    eyes.close()
    quick = GlRenderer(stand, LightParams(**light), stand.robot.rig)
    other, again = (glance(stand, quick, stand.robot.rig) for _ in range(2))
    quick.close()
    for a, b, c in ((pair.left, other.left, again.left), (pair.right, other.right, again.right)):
        off = np.abs(a.astype(int) - b)
        assert off.mean() < 0.1 and np.quantile(off, 0.99) <= 1
        np.testing.assert_array_equal(b, c)


def test_tiny_refuses_what_it_cannot_draw(stand):
    for light in ({"lamp": 1.0}, {"shadows": True}, {"floor_shine": 0.1}):
        with pytest.raises(RendererError, match="need the renderer gl"):
            open_renderer("tiny", stand, LightParams(**light))
    env = FlyNavEnv(world="yard", renderer="tiny", observation="pixels", light={"lamp": 1.0})
    with pytest.raises(RendererError, match="need the renderer gl"):
        env.reset(seed=1)
    env.close()


def test_nonsense_is_refused_by_name():
    for given, complaint in (
        ({"level": -1.0}, "level must be a number"),
        ({"ambient": 1.5}, "ambient must be"),
        ({"direction": (0.0, 0.0, 0.0)}, "direction must lead somewhere"),
        ({"direction": (1.0, 2.0)}, "direction must be three numbers"),
        ({"colour": (1.0, 2.0, 0.0)}, "colour must be three numbers"),
        ({"shadows": 1}, "shadows must be true or false"),
        ({"floor_shine": math.nan}, "floor_shine must be"),
    ):
        with pytest.raises(ValueError, match=complaint):
            LightParams(**given)
    with pytest.raises(FlysimError, match=r"light: level must be a number in \[0, 16\]"):
        read_scenario("paper_a", ["light.level=-1"])
    with pytest.raises(FlysimError, match=r"unknown key 'light.lamb'. Did you mean 'lamp'"):
        read_scenario("paper_a", ["light.lamb=1"])
    assert read_scenario("paper_a", ["light.colour=[1,0.5,0]"]).light.colour == (1.0, 0.5, 0.0)


def test_a_report_says_what_light_it_was(short):
    report = run(str(short), overrides=["light.level=0.5"], renderer="tiny")
    assert report.light == {"level": 0.5} and report.to_json()["light"] == {"level": 0.5}
    assert "disturbed: light.level 0.5" in str(report)
    assert "light" not in run(str(short), renderer="tiny").to_json()


def test_an_environment_has_its_light(renderer):
    means = []
    for light in (None, {"level": 0.3}):
        env = FlyNavEnv(world="yard", observation="pixels", renderer=renderer, light=light)
        observation, _ = env.reset(seed=3)
        means.append(np.mean([np.mean(observation[name]) for name in ("left", "right")]))
        env.close()
    assert means[1] == pytest.approx(0.3 * means[0], rel=0.03)
    with pytest.raises(ValueError, match=r"light has no 'lvel'. Did you mean 'level'"):
        FlyNavEnv(light={"lvel": 1})
