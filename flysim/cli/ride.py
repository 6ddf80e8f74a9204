"""What the options of an agent's ride say, and what is told of the files that it names before anything drives."""

from __future__ import annotations

from typing import Any

from flysim.cli.options import Ride
from flysim.cli.study import tell_bare
from flysim.cli.terminal import warn


def ridden(ride: Ride) -> dict[str, Any]:
    """What of an environment the options say."""
    return {name: value for name, value in ride._asdict().items() if name != "overrides" and value is not None}


def tell_ride(worlds: str, observation: str, ride: Ride) -> None:
    """Warns of what is not read of a world's and a robot's file, and where there is nothing to see by."""
    from flysim.common.catalogue import find_robot, find_world
    from flysim.nav.worlds import find_difficulty
    from flysim.robots.robot import mount, read_robot
    from flysim.worlds.sdf.reader import read_world

    if ride.robot is not None:
        for sentence in read_robot(find_robot(ride.robot), ride.wheels, mount(ride.cameras)).warnings:
            warn(sentence)
    if worlds == "barn" or find_difficulty(worlds) is not None:
        return
    world, models = find_world(worlds), ride.models or ()
    for sentence in read_world(world, models).warnings:
        warn(sentence)
    if observation != "truth":
        tell_bare(world, ride.texture, models)
