"""A small world that costs little: a room of two boxes, read from a file."""

import pytest

BOX = """<model name="{name}"><static>true</static><pose>{pose}</pose><link name="l">
<collision name="c"><geometry><box><size>{size}</size></box></geometry></collision>
<visual name="v"><geometry><box><size>{size}</size></box></geometry></visual></link></model>"""
FLOOR = """<model name="floor"><static>true</static><link name="l">
<collision name="c"><geometry><plane><normal>0 0 1</normal><size>8 8</size></plane></geometry></collision>
<visual name="v"><geometry><plane><normal>0 0 1</normal><size>8 8</size></plane></geometry></visual></link></model>"""


def room(*boxes):
    """The text of a world: a floor, and boxes of (name, pose, size)."""
    models = FLOOR + "".join(BOX.format(name=name, pose=pose, size=size) for name, pose, size in boxes)
    return f'<sdf version="1.9"><world name="room">{models}</world></sdf>'


@pytest.fixture(scope="session")
def world(tmp_path_factory):
    """The path of a world: a box 2 m ahead of the origin, another to the left of it."""
    path = tmp_path_factory.mktemp("room") / "room.sdf"
    boxes = ("ahead", "2.0 0 0.25 0 0 0", "0.4 0.6 0.5"), ("aside", "1.0 2.0 0.25 0 0 0", "0.4 0.4 0.5")
    path.write_text(room(*boxes), encoding="utf-8")
    return str(path)


@pytest.fixture
def make(world):
    """Makes environments in that world, and closes them."""
    import gymnasium

    made = []

    def one(**more):
        env = gymnasium.make("flysim/FlyNav-v0", **{"world": world, "texture": "speckle", **more})
        made.append(env)
        return env

    import flysim.nav  # noqa: F401

    yield one
    for env in made:
        env.close()
