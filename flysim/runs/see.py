"""An engine let loose on a source: its frames seen one by one, the flies gathered and fused to obstacles."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flysim.common.progress import Progress, silent
from flysim.engines.choose import engine, warm
from flysim.engines.points import points_swarm
from flysim.errors import EngineError
from flysim.flies.parameters import FlyParams
from flysim.localise.localiser import DEFAULT as ODOMETRY
from flysim.localise.localiser import localiser_named, paired
from flysim.obstacles.find import find_obstacles
from flysim.obstacles.gather import gather
from flysim.obstacles.parameters import ObstacleParams
from flysim.products.findings import Findings, Seen
from flysim.products.frame import FrameSequence
from flysim.products.located import Located
from flysim.sources.source import Source

HOPELESS = 3  # looks, the first ones, that an engine may fail at before nobody waits for it to do better


def see(
    source: Source,
    name: str,
    flies: FlyParams | None = None,
    obstacles: ObstacleParams | None = None,
    *,
    seed: int = 0,
    localisation: str = ODOMETRY,
    warmed: bool = False,
    keep: bool = False,
    progress: Progress = silent,
) -> Findings:
    """What an engine finds in the frames of a source.

    Frame k draws its random numbers from child k of the seed, whoever else sees the same frames, and how often.

    Args:
        source: of the frames.
        name: of the engine, or a `module:object`.
        flies: depths to search and flies to spend; the defaults where None.
        obstacles: how flies become obstacles; the defaults where None.
        seed: of the engine's randomness.
        localisation: who says where the frames were taken.
        warmed: whether what the engine loads and compiles once is loaded before the first frame, and not counted.
        keep: whether what was seen is kept where the engine fails at some frames (`Findings.failed`).
        progress: called with a word and a share after each frame.

    Raises:
        EngineError: there is no such engine or localisation; or the engine failed: at a frame, or where the others are
            kept, at the first HOPELESS, or at all.
    """
    flies, obstacles = flies or FlyParams(), obstacles or ObstacleParams()
    if warmed:
        warm(name)
    seen, located = look_on(source, name, flies, seed=seed, localisation=localisation, keep=keep, progress=progress)
    if located is not None:
        place = dict(zip(located.numbers, located.stops, strict=True))
        seen = [
            replace(one, frame=replace(frame, T_world_base=located.moved(place[frame.index], frame.T_world_base)))
            for one, frame in ((one, one.frame) for one in seen)
        ]
    return gathered(name, source.sequence(), seen, obstacles, max_range=flies.max_depth, located=located)


def gathered(
    name: str,
    sequence: FrameSequence,
    seen: Sequence[Seen],
    obstacles: ObstacleParams,
    *,
    max_range: float,
    located: Located | None = None,
) -> Findings:
    """What the swarms of a sequence come to: one cloud, and the obstacles in it.

    Args:
        name: of the engine.
        sequence: the frames.
        seen: the swarm of each.
        obstacles: how flies become obstacles.
        max_range: [m] nothing was looked for beyond it.
        located: where the frames were found to be taken, which those of `seen` know already.
    """
    mark = time.perf_counter()
    swarms = [(one.frame, one.swarm) for one in seen]
    cloud = gather(swarms, obstacles)
    found = find_obstacles(cloud, obstacles, swarms)
    return Findings(
        engine=name,
        sequence=sequence,
        seen=tuple(seen),
        cloud=cloud,
        obstacles=found,
        obstacles_s=time.perf_counter() - mark,
        max_range=max_range,
        located=located,
    )


def look_on(
    source: Source,
    name: str,
    flies: FlyParams,
    *,
    seed: int = 0,
    localisation: str = ODOMETRY,
    keep: bool = False,
    progress: Progress = silent,
) -> tuple[list[Seen], Located | None]:
    """What an engine sees in each frame of a source, and where somebody finds the frames to be taken.

    The source is told so after each frame: a robot that is driven drives by it. Arguments are those of `see`.

    Raises:
        EngineError: as `see`.
    """
    eyes, rng = engine(name), np.random.default_rng(seed)
    localiser = localiser_named(localisation, seed)
    eyes.begin(source.rig, flies)
    seen: list[Seen] = []
    errors: list[str | None] = []  # of every look, those on the way to a stop too
    missed: list[str] = []
    for taken in source.frames():
        frame = paired(localiser, taken)
        mark = time.perf_counter()
        error = None
        try:
            swarm = eyes.see(frame, rng=rng.spawn(1)[0])
        except EngineError as failure:
            if not keep:
                raise
            swarm, error = points_swarm(frame.pair, flies, (), name=name), str(failure)
        errors.append(error)
        if len(errors) == HOPELESS:
            _refuse_hopeless(errors)
        if not frame.glance:
            spent = time.perf_counter() - mark
            seen.append(Seen(frame=frame, swarm=swarm, seconds=spent, error=error, missed=tuple(missed)))
            missed.clear()
        elif error is not None:
            missed.append(f"on the way to stop {len(seen) + 1}: {error}")
        if localiser is not None:
            source.stands(localiser.add(frame, swarm))
        progress(f"stop {len(seen)} of {source.planned}", len(seen) / source.planned)
    _refuse_hopeless([one.error for one in seen])
    return seen, localiser.located() if localiser is not None and seen else None


def _refuse_hopeless(errors: Sequence[str | None]) -> None:
    """Raises what the engine failed at first, if it failed at every look."""
    failed = [error for error in errors if error is not None]
    if failed and len(failed) == len(errors):
        raise EngineError(failed[0])
