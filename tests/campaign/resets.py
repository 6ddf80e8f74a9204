"""Many resets of one environment in one process: memory, open files, and the folder for temporary files."""

from __future__ import annotations

import gc
import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """What a process held after some of the resets.

    Attributes:
        resets: counts at which it was looked at.
        memory: [MB] resident.
        files: open.
        temporary: entries of the folder for temporary files at the end, those of before not counted.
    """

    resets: list[int]
    memory: list[float]
    files: list[int]
    temporary: int

    @property
    def growth(self) -> float:
        """Of memory from the first tenth, when all is loaded, to the end, as a share."""
        settled = max(self.memory[: max(len(self.memory) // 10, 1)])
        return self.memory[-1] / settled - 1.0


def reset(count: int, told: Callable[[int], None], world: str = "yard", observation: str = "flies") -> Curve:
    """Resets an environment `count` times, with a step after each."""
    from flysim.nav.env import FlyNavEnv

    before = set(os.listdir(tempfile.gettempdir()))  # noqa: PTH208
    resets, memory, files = [], [], []
    env = FlyNavEnv(world=world, observation=observation)  # type: ignore[arg-type]
    for k in range(1, count + 1):
        env.reset(seed=k)
        env.step(env.action_space.sample())
        if k % max(count // 20, 1) == 0:
            gc.collect()
            resets.append(k)
            memory.append(int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20)
            files.append(len(os.listdir("/proc/self/fd")))  # noqa: PTH208
        told(k)
    env.close()
    after = set(os.listdir(tempfile.gettempdir())) - before  # noqa: PTH208
    return Curve(resets=resets, memory=memory, files=files, temporary=len([name for name in after if "flysim" in name]))
