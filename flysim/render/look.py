"""The robot's eyes: one stereo pair from where it truly stands."""

from __future__ import annotations

from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, inverse
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.render.choose import Renderer
from flysim.sim.simulation import Simulation
from flysim.worlds.view import TrueView


def look(
    simulation: Simulation, renderer: Renderer, rig: StereoRig | None = None
) -> tuple[ImagePair, tuple[TrueView, TrueView]]:
    """The pair the robot's two cameras see now, and the truth behind each image.

    Args:
        simulation: where the robot stands.
        renderer: bound to that simulation.
        rig: cameras to look through in place of the robot's own; its left one stands where the robot's does.
    """
    rig = simulation.robot.rig if rig is None else rig
    left, right = (renderer.view(camera, T) for camera, T in _eyes(simulation, rig))
    return ImagePair(left=left.rgb, right=right.rgb, rig=rig), (left, right)


def glance(simulation: Simulation, renderer: Renderer, rig: StereoRig) -> ImagePair:
    """The pair alone, which is drawn faster than its truth; arguments as of `look`."""
    left, right = renderer.pictures(_eyes(simulation, rig))
    return ImagePair(left=left, right=right, rig=rig)


def _eyes(simulation: Simulation, rig: StereoRig) -> list[tuple[Camera, Array]]:
    """Each camera of a rig on the robot, and its `T_world_optical`."""
    T_world_left = simulation.T_world_base() @ simulation.robot.T_base_left
    return [(rig.left, T_world_left), (rig.right, T_world_left @ inverse(rig.T_right_left))]
