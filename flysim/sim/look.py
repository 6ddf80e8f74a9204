"""The robot's eyes: one stereo pair from where it truly stands."""

from __future__ import annotations

from flysim.geometry.frames import inverse
from flysim.geometry.rig import ImagePair
from flysim.sim.renderer import Renderer
from flysim.sim.simulation import Simulation
from flysim.world.view import TrueView


def look(simulation: Simulation, renderer: Renderer) -> tuple[ImagePair, tuple[TrueView, TrueView]]:
    """The pair the robot's two cameras see now, and the truth behind each image."""
    robot = simulation.robot
    T_world_left = simulation.T_world_base() @ robot.T_base_left
    T_world_right = T_world_left @ inverse(robot.rig.T_right_left)
    left = renderer.view(robot.rig.left, T_world_left)
    right = renderer.view(robot.rig.right, T_world_right)
    return ImagePair(left=left.rgb, right=right.rgb, rig=robot.rig), (left, right)
