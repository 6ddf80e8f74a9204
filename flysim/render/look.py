"""The robot's eyes: one stereo pair from where it truly stands, and all that a stop is."""

from __future__ import annotations

import time

from flysim.geometry.frames import Array, Pose2, frozen, inverse
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.render.choose import Renderer
from flysim.sim.simulation import Simulation
from flysim.truth.stop import Stop
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


def stop_here(
    simulation: Simulation, renderer: Renderer, *, index: int, commanded: Pose2, track: Array, drive_s: float
) -> Stop:
    """What the robot brings home from where it stands now; the arguments are `Stop`'s, of the way here."""
    began = time.perf_counter()
    pair, views = look(simulation, renderer)
    return Stop(
        index=index,
        commanded=commanded,
        odometry=simulation.odometry.pose,
        true=simulation.true_pose(),
        pair=pair,
        T_base_left=simulation.robot.T_base_left,
        T_world_base=frozen(simulation.T_world_base()),
        views=views,
        T_world_links=frozen(simulation.T_world_links()),
        sim_time=simulation.sim_time,
        track=frozen(track),
        drive_s=drive_s,
        render_s=time.perf_counter() - began,
    )
