"""What is done after each rollout of a training: counted, told, written, and ended in time."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

from stable_baselines3.common.callbacks import BaseCallback

from flysim.nav.training.folder import WINDOW, Training


class Rollouts(BaseCallback):
    """Keeps a `Training` up to date, and stops it when it is late."""

    def __init__(
        self,
        training: Training,
        share: Callable[[], float],
        late: Callable[[], bool],
        keep: Callable[[], None],
        progress: Callable[[str, float], None],
    ) -> None:
        super().__init__()
        self._training, self._share, self._late = training, share, late
        self._keep, self._progress = keep, progress
        self._before, self._began = training.minutes, time.perf_counter()
        self._ends: deque[tuple[float, float]] = deque(maxlen=WINDOW)

    def _on_step(self) -> bool:
        training, infos = self._training, self.locals["infos"]
        for end in (info["episode"] for info in infos if "episode" in info):
            training.episodes += 1
            self._ends.append((float(end["success"]), float(end["r"])))
        training.steps = self.num_timesteps
        training.minutes = self._before + (time.perf_counter() - self._began) / 60.0
        share = self._share()
        if training.steps % 64 < self.training_env.num_envs:
            rate = f", success {self._mean(0):.2f} of the last {len(self._ends)}" if self._ends else ""
            self._progress(f"{training.steps} steps{rate}", min(share, 1.0))
        return not self._late()  # PPO counts the steps itself, and learns from the last of them

    def _on_rollout_end(self) -> None:
        if self._ends:
            training, success, reward = self._training, self._mean(0), self._mean(1)
            training.curve.append((training.steps, round(training.minutes, 3), success, reward))
            self.logger.record("rollout/success_rate", success)
        self._keep()

    def _mean(self, which: int) -> float:
        return sum(end[which] for end in self._ends) / len(self._ends)
