"""How episodes went, one by one and summed up with intervals, and as plain data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from flysim.common.statistics import mean_ci95, share_ci95
from flysim.errors import FlysimError
from flysim.nav.scores import BARN_MOST

# What of an episode lies between 0 and a greatest value: its name in a summary, and that value.
BOUNDED = {
    "success": ("success", 1.0),
    "collision": ("collision", 1.0),
    "timed_out": ("time_out", 1.0),
    "spl": ("spl", 1.0),
    "soft_spl": ("soft_spl", 1.0),
    "barn": ("barn", BARN_MOST),
}
FILM = "film"  # of an episode; it goes into a file of its own


@dataclass(frozen=True, slots=True, kw_only=True)
class Episode:
    """How one episode went; lengths in metres, times in simulated seconds.

    Attributes:
        barn: BARN's score of 2024 over the shortest way.
        recoveries: how often the agent says that it came no farther and led itself out; 0 of one that tells nothing.
        steps_per_second: steps of environment and agent, by the wall clock, the making of a film included.
        film: an animated WebP; None where none was asked for, or it is in its file by now.
    """

    agent: str
    world: str
    seed: int
    success: bool
    collision: bool
    timed_out: bool
    spl: float
    soft_spl: float
    barn: float
    clearance: float
    path_length: float
    shortest: float
    time: float
    hit: str
    steps: int
    steps_per_second: float
    recoveries: int = 0
    film: bytes | None = field(default=None, repr=False)


def summary(episodes: Sequence[Episode]) -> dict[str, Any]:
    """Means of one agent's episodes, each with its 95 % interval.

    Wilson's for what lies between 0 and a greatest value, Student's t for the others, as far as they can be.
    """
    n = len(episodes)
    found: dict[str, Any] = {"agent": episodes[0].agent, "episodes": n}
    for which, (name, most) in BOUNDED.items():
        share = min(float(np.mean([getattr(episode, which) for episode in episodes])) / most, 1.0)
        found[name], found[f"{name}_ci95"] = most * share, [most * end for end in share_ci95(share, n)]
    for name, least in (("clearance", -math.inf), ("steps_per_second", 0.0)):
        mean, half = mean_ci95([getattr(episode, name) for episode in episodes])
        found[name], found[f"{name}_ci95"] = mean, None if half is None else [max(mean - half, least), mean + half]
    return found


def to_json(observation: str, episodes: Sequence[Episode]) -> dict[str, Any]:
    """Plain data: `observation`, `agents[]` with means and intervals, `episodes[]`."""
    names = list(dict.fromkeys(episode.agent for episode in episodes))
    return {
        "observation": observation,
        "agents": [summary([e for e in episodes if e.agent == name]) for name in names],
        "episodes": [_row(episode) for episode in episodes],
    }


def _row(episode: Episode) -> dict[str, Any]:
    row = asdict(replace(episode, film=None))
    del row[FILM]
    return row


def read_episodes(data: dict[str, Any], path: Path) -> list[Episode]:
    """The episodes of what `to_json` gave, from a file.

    Raises:
        FlysimError: it holds something else.
    """
    try:
        return [Episode(**episode) for episode in data["episodes"]]
    except (KeyError, TypeError) as error:
        raise FlysimError(f"{path}: its episodes are no longer what flysim nav writes: {error}.") from None
