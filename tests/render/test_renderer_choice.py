import moderngl
import pytest

from flysim.errors import RendererError
from flysim.geometry.camera import Camera
from flysim.geometry.frames import R_BODY_OPTICAL, Pose2, se3
from flysim.render import gl_context, shading
from flysim.render.choose import gl_works, open_renderer
from flysim.render.studio import drawn
from flysim.render.tiny import TinyRenderer

T_WORLD_EYE = se3(R_BODY_OPTICAL, (0.3, 0.0, 0.8))


@pytest.fixture(params=[Exception("libEGL.so.1 not loaded"), OSError("(standalone)\nno driver"), ImportError("libGL")])
def no_context(request, monkeypatch):
    def refuse(*_args, **_more):
        raise request.param

    monkeypatch.setattr(gl_context.moderngl, "create_context", refuse)
    gl_works.cache_clear()
    yield
    gl_works.cache_clear()


def test_auto_takes_tiny_where_no_context_opens(made, no_context):
    assert not gl_works()
    with made.simulation(textured=True) as simulation:
        eyes = open_renderer("auto", simulation)
        assert isinstance(eyes, TinyRenderer)
        assert eyes.name == "tiny"
        eyes.close()


def test_a_machine_is_asked_once(monkeypatch):
    asked = []

    def refuse(*_args, **_more):
        asked.append(1)
        raise OSError("no driver")

    monkeypatch.setattr(gl_context.moderngl, "create_context", refuse)
    gl_works.cache_clear()
    assert not any(gl_works() for _ in range(3))
    gl_works.cache_clear()
    assert len(asked) == 1


def test_auto_draws_a_world_that_the_driver_refuses_by_tiny(gl, made, monkeypatch):
    monkeypatch.setattr(shading, "FRAGMENT", "#version 330\nnonsense\n")
    world, start = made.world(), Pose2(0.2, 0.0, 0.0)
    with drawn(world, made.rover, start, "auto") as (simulation, eyes):
        assert eyes.name == "tiny"
        view = eyes.view(Camera.from_fov(64, 48, 1.0), T_WORLD_EYE)
        assert (view.link == 0).any()  # the floor: it was built again, with what tiny draws
        assert simulation.true_pose().x == pytest.approx(0.2, abs=0.01)
    with pytest.raises(RendererError, match="OpenGL cannot draw this world"), drawn(world, made.rover, start, "gl"):
        pass


def test_gl_says_in_one_line_what_to_do_where_no_context_opens(made, no_context):
    with made.simulation() as simulation, pytest.raises(RendererError) as caught:
        open_renderer("gl", simulation)
    message = str(caught.value)
    assert message.startswith("no OpenGL context opens (")
    assert message.endswith("Install Mesa's libEGL, or use --renderer tiny.")
    assert message.isprintable()


def test_auto_takes_gl_where_a_context_opens(gl, made):
    assert gl_works()
    with made.simulation() as simulation:
        eyes = open_renderer("auto", simulation)
        assert eyes.name == "gl"
        eyes.close()


def test_an_unknown_renderer_names_the_nearest(made):
    with made.simulation() as simulation, pytest.raises(RendererError, match=r"no renderer 'gll'. Did you mean 'gl'\?"):
        open_renderer("gll", simulation)


def test_an_image_larger_than_the_driver_draws_is_one_line(gl, made):
    with made.simulation() as simulation:
        eyes = open_renderer("gl", simulation)
        with pytest.raises(RendererError, match=r"OpenGL cannot draw 200000x4 px \(.*\). Use --renderer tiny."):
            eyes.view(Camera.from_fov(200_000, 4, 1.0), T_WORLD_EYE)
        assert eyes.view(Camera.from_fov(64, 48, 1.0), T_WORLD_EYE).rgb.shape == (48, 64, 3)
        eyes.close()


def test_a_driver_that_refuses_the_shaders_is_one_line(gl, made, monkeypatch):
    monkeypatch.setattr(shading, "FRAGMENT", "#version 330\nnonsense\n")
    with (
        made.simulation() as simulation,
        pytest.raises(RendererError, match=r"^OpenGL cannot draw this world \(.*\). Use --renderer tiny.$") as caught,
    ):
        open_renderer("gl", simulation)
    assert str(caught.value).isprintable()
    assert isinstance(caught.value.__cause__, moderngl.Error)
