"""The engines by name: the flies, what one would reach for in their place, and whatever a user brings."""

from __future__ import annotations

import numpy as np

from flysim.common.registry import Registry
from flysim.engines.engine import Engine, Stateless, alone
from flysim.errors import EngineError
from flysim.flies.parameters import FlyParams
from flysim.geometry.camera import Camera
from flysim.geometry.rig import ImagePair, StereoRig

ENGINES = Registry(
    "engine",
    "flysim.engines",
    {
        "flies": "flysim.engines.flies:Flies",
        "sgbm": "flysim.engines.matchers:sgbm",
        "bm": "flysim.engines.matchers:bm",
        "exhaustive": "flysim.engines.exhaustive:exhaustive",
        "chance": "flysim.engines.chance:chance",
    },
    EngineError,
    schemes={"exec": "flysim.engines.program:Program", "onnx": "flysim.engines.network:Network"},
)
DEFAULT = "flies"


def engine(name: str) -> Engine:
    """A new engine of a name, or of a `module:object`: a class with `begin` and `see`, or a function.

    `exec:COMMAND` is a program (`program.Program`), `onnx:FILE` a network (`network.Network`).

    Raises:
        EngineError: there is none of that name, it cannot be imported, or it is neither.
    """
    found = ENGINES.load(name)
    if (scheme := ENGINES.scheme(name)) is not None:
        return found(scheme[1])
    if isinstance(found, type):
        made = found()
        if callable(getattr(made, "begin", None)) and callable(getattr(made, "see", None)):
            return made
    elif callable(found):
        return Stateless(found)
    raise EngineError(
        f"engine '{name}' is neither a class with begin(rig, params) and see(frame, rng) nor a function "
        "see(pair, params, rng): see docs/extending.md."
    )


def warm(name: str) -> None:
    """Lets an engine see a tiny pair, so that what it loads and compiles once is not counted as time of a stop.

    Not a program or a network: the one loads anew each time, the other is of its own instance.
    """
    if ENGINES.scheme(name) is not None:
        return
    camera = Camera(width=96, height=64, fx=80.0, fy=80.0, cx=47.5, cy=31.5)
    image = np.random.default_rng(0).integers(0, 256, (64, 96, 3), np.uint8)
    pair = ImagePair(left=image, right=np.roll(image, -8, axis=1), rig=StereoRig.parallel(camera, 0.1))
    alone(engine(name), pair, FlyParams(population=200, max_iterations=2), rng=np.random.default_rng(0))
