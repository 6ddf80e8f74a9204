"""The robot's eyes: one stereo pair from where it truly stands."""

from __future__ import annotations

from flysim.geometry.frames import inverse
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
    T_world_left = simulation.T_world_base() @ simulation.robot.T_base_left
    T_world_right = T_world_left @ inverse(rig.T_right_left)
    left, right = renderer.view(rig.left, T_world_left), renderer.view(rig.right, T_world_right)
    return ImagePair(left=left.rgb, right=right.rgb, rig=rig), (left, right)
