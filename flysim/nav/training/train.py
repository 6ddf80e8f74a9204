"""A policy trained by PPO (Schulman and others, 2017), from stable-baselines3: an extra, `flysim-testbed[rl]`."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Iterator
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from flysim.common.scratch import Scratch
from flysim.common.whole_file import whole_file
from flysim.common.workers import follow_parent, started
from flysim.errors import FlysimError
from flysim.nav.agents.agent import RobotLimits
from flysim.nav.agents.policy import FEATURES, Policy, corrected, features
from flysim.nav.asked import arguments_of
from flysim.nav.drive import PERIOD_S
from flysim.nav.env import FlyNavEnv
from flysim.nav.training.folder import CHECKPOINT, LOG, POLICY, TRAINING, Training, TrainingTask, begun, training_folder
from flysim.plain import shown_path

ROLLOUT = 256  # steps of each process between two updates
# Of the learning rate at the end over the one at the start: small steps last, so that the last policy is a good one.
LEAST_RATE = 0.1
SETTINGS: dict[str, Any] = {
    "learning_rate": 5e-4,
    "batch_size": 256,
    "n_epochs": 8,
    "gamma": 0.98,
    "gae_lambda": 0.95,
    "ent_coef": 0.002,
    "clip_range": 0.2,
    "target_kl": 0.05,
}
TORCH_FOLDER = "TORCHINDUCTOR_CACHE_DIR"
UNITS, LOG_STD = [64, 64], -1.2
REWARD = 0.2  # of the environment's: values of about 1, which the network learns faster
EPISODES_PER_WORLD = 10  # a new world takes as long as a hundred steps

Progress = Callable[[str, float], None]


class PolicyView(gym.Wrapper[NDArray[np.float32], NDArray[np.float32], Any, Any]):
    """The environment as a policy has it: features for observations, corrections for actions, smaller rewards."""

    def __init__(self, env: FlyNavEnv) -> None:
        super().__init__(env)  # type: ignore[arg-type]
        self._body = RobotLimits(radius=env.radius, v_max=env.v_max, w_max=env.w_max, period=PERIOD_S)
        self.observation_space = spaces.Box(-2.0, 2.0, (FEATURES,), np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begins an episode; what the policy is shown of it first."""
        self._seen, info = self.env.reset(seed=seed, options=options)
        return features(self._seen, self._body), info  # type: ignore[arg-type]

    def step(self, action: NDArray[np.float32]) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Drives one period by an action, as gymnasium has it."""
        action = corrected(self._seen, self._body, action)  # type: ignore[arg-type]
        self._seen, reward, terminated, truncated, info = self.env.step(action)
        return features(self._seen, self._body), REWARD * float(reward), terminated, truncated, info  # type: ignore


def train(task: TrainingTask, out: Path, *, resume: bool = False, progress: Progress | None = None) -> Training:
    """Trains a policy; every rollout it writes `policy.npz`, `checkpoint.pt` and `training.json` to `out`.

    Args:
        task: what and how long.
        out: the folder; it must be new, or hold a training to resume. `tensorboard/` in it has the log.
        resume: go on where the folder's training stopped, up to the `steps` and `minutes` of this task; worlds and
            observation may be others than before: the cheap truth first, then flies.
        progress: called with how it goes and the share that is done.

    Raises:
        FlysimError: stable-baselines3 is missing, the folder does not fit, or a world or renderer cannot be used.
    """
    with _torch_tidy():
        with contextlib.closing(_env(task)) as env:  # a world's or renderer's mistake is told here, not by a worker
            env.reset(seed=task.seed)
        with training_folder(out, resume=resume):
            training, parameters = begun(out, task) if resume else (_new(task), None)
            if _share(training, task) >= 1.0:
                raise FlysimError(
                    f"{out} has done its {training.steps} steps in {training.minutes:.1f} minutes: raise --steps."
                )
            _train(task, out, training, parameters, progress or (lambda _what, _share: None))
    return training


@contextlib.contextmanager
def _torch_tidy() -> Iterator[None]:
    """Loads the libraries. torch makes itself a temporary folder as it is loaded, and leaves it: here it goes with us.

    Raises:
        FlysimError: they are not there.
    """
    scratch = Scratch()
    given = os.environ.get(TORCH_FOLDER)
    os.environ.setdefault(TORCH_FOLDER, scratch.name)
    try:
        try:
            import stable_baselines3
            import torch  # noqa: F401
        except ImportError as error:
            raise FlysimError(
                f"training needs stable-baselines3 ({error}). Install it: `make rl` in a checkout, elsewhere "
                "`pip install 'flysim-testbed[rl]'`."
            ) from None
        del stable_baselines3
        yield
    finally:
        if given is None:
            os.environ.pop(TORCH_FOLDER, None)
        scratch.cleanup()


def _train(
    task: TrainingTask, out: Path, training: Training, parameters: dict[str, Any] | None, progress: Progress
) -> None:
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import SubprocVecEnv, VecMonitor

    from flysim.nav.training.rollouts import Rollouts

    torch.set_num_threads(1)  # the environments have the cores; so small a network gains nothing
    kinds = [partial(_env_of_worker, task) for _ in range(task.processes)]
    with started(lambda: SubprocVecEnv(kinds, start_method="spawn")) as processes:  # type: ignore[arg-type]
        envs = VecMonitor(processes, info_keywords=("success",))
        model = PPO(
            "MlpPolicy",
            envs,
            n_steps=ROLLOUT,
            seed=task.seed,
            device="cpu",
            tensorboard_log=str(out / LOG),
            policy_kwargs={"net_arch": {"pi": UNITS, "vf": UNITS}, "log_std_init": LOG_STD},
            **{
                **SETTINGS,
                "learning_rate": lambda _left: (
                    SETTINGS["learning_rate"] * max(1.0 - _share(training, task), LEAST_RATE)
                ),
            },
        )
        if parameters is not None:
            _restore(model, parameters, out / CHECKPOINT)
            model.num_timesteps = training.steps

        def keep() -> None:
            _keep(out, training, model)

        watch = Rollouts(
            training,
            lambda: _share(training, task),
            lambda: task.minutes is not None and training.minutes >= task.minutes,
            keep,
            progress,
        )
        left, new = task.steps - training.steps, parameters is None
        model.learn(left, callback=watch, reset_num_timesteps=new, tb_log_name="ppo", log_interval=1)
        keep()
        envs.close()


def _keep(out: Path, training: Training, model: Any) -> None:
    """Writes all three files, and only then puts them in place, one right after the other.

    A kill between two of these leaves files of two moments: the checkpoint goes first and has the training in it, so
    that a resumption has one moment, and writes the others anew.
    """
    import torch

    told = asdict(training)
    with (
        whole_file(out / TRAINING) as training_part,
        whole_file(out / POLICY) as policy_part,
        whole_file(out / CHECKPOINT) as checkpoint_part,
    ):
        torch.save({**model.get_parameters(), TRAINING: json.dumps(told)}, checkpoint_part)
        policy_of(model).write(policy_part)
        training_part.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


def policy_of(model: Any) -> Policy:
    """The network of a stable-baselines3 model that has `PolicyView`'s spaces, without the library."""
    layers = [layer for layer in model.policy.mlp_extractor.policy_net if hasattr(layer, "weight")]
    layers.append(model.policy.action_net)
    numbers = [(layer.weight.detach().cpu().numpy(), layer.bias.detach().cpu().numpy()) for layer in layers]
    return Policy(weights=tuple(w.copy() for w, _ in numbers), biases=tuple(b.copy() for _, b in numbers))


def _env(task: TrainingTask) -> PolicyView:
    return PolicyView(
        FlyNavEnv(
            world=task.worlds,
            observation=task.observation,  # type: ignore[arg-type]
            renderer=task.renderer,  # type: ignore[arg-type]
            episodes_per_world=EPISODES_PER_WORLD,
            **arguments_of(task.settings, task.observation),
        )
    )


def _env_of_worker(task: TrainingTask) -> PolicyView:
    """The same in a process of its own, which ends with the one that trains."""
    follow_parent()
    return _env(task)


def _share(training: Training, task: TrainingTask) -> float:
    by_time = 0.0 if task.minutes is None else training.minutes / task.minutes
    return max(training.steps / task.steps, by_time)


def _new(task: TrainingTask) -> Training:
    return Training(tasks=[{**asdict(task), "from_step": 0}], settings={**SETTINGS, "units": UNITS, "log_std": LOG_STD})


def _restore(model: Any, parameters: dict[str, Any], path: Path) -> None:
    """Gives a model the numbers of a checkpoint."""
    try:
        model.set_parameters(parameters)
    except Exception as error:  # torch raises whatever numbers of another shape or kind lead it to
        reason = str(error).partition("\n")[0]
        raise FlysimError(f"{shown_path(path)}: not a checkpoint of this training: {reason}.") from None
