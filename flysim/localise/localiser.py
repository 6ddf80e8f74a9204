"""Who says where the robot is, by name: nobody but odometry, the flies, and whatever a user brings."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import numpy as np

from flysim.common.registry import Registry
from flysim.errors import EngineError
from flysim.geometry.frames import Array
from flysim.products.frame import Frame
from flysim.products.located import Located
from flysim.products.swarm import Swarm


class Localiser(Protocol):
    """Is told of frame after frame, and says where each was taken. It has never heard of the truth."""

    def add(self, frame: Frame, swarm: Swarm) -> Array:
        """One more frame with what an engine saw in it; `[4, 4]` where base_link is thought to stand in the world."""
        ...

    def located(self) -> Located:
        """Where all frames were taken, by all that is known in the end."""
        ...


@runtime_checkable
class OfPairs(Protocol):
    """A `Localiser` that also says how one camera was moved between the pictures of a pair, before an engine looks."""

    def paired(self, frame: Frame) -> Frame:
        """The frame with its rig as found; as it is where nothing was."""
        ...


def paired(localiser: Localiser | None, frame: Frame) -> Frame:
    """A frame whose pair one camera took, its rig as a localiser finds it; every other frame as it is."""
    return localiser.paired(frame) if frame.other is not None and isinstance(localiser, OfPairs) else frame


Localisation = Callable[..., Localiser | None]  # of *, rng: np.random.Generator; None: odometry is believed
LOCALISATIONS = Registry(
    "localisation",
    "flysim.localisations",
    {"odometry": "flysim.localise.localiser:by_odometry", "flies": "flysim.localise.path:ByFlies"},
    EngineError,
)
DEFAULT = "odometry"
_GUESSES = 0x10C  # of the seed's random numbers: apart from those of the engine


def localiser_named(name: str, seed: int) -> Localiser | None:
    """A new localiser of a name or a `module:object`; None where odometry is to be believed.

    Args:
        name: of it.
        seed: of the run.

    Raises:
        EngineError: there is none of that name, it cannot be imported, or it is none.
    """
    made = LOCALISATIONS.load(name)
    found: Any = made(rng=np.random.default_rng([seed, _GUESSES])) if callable(made) else made
    if found is None or all(callable(getattr(found, method, None)) for method in ("add", "located")):
        return found
    raise EngineError(
        f"localisation '{name}' is no class with add(frame, swarm) and located() that is made by rng=...: "
        "flysim.localise.localiser.Localiser says what they do."
    )


def by_odometry(**_: object) -> None:
    """Nobody: frames were taken where they say."""
