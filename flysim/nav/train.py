"""A policy trained by PPO (Schulman and others, 2017), from stable-baselines3: an extra, `flysim-testbed[rl]`."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from flysim.errors import FlysimError
from flysim.foreign.data import read_json
from flysim.foreign.files import opened
from flysim.nav.agents import Body
from flysim.nav.drive import PERIOD_S
from flysim.nav.env import FlyNavEnv
from flysim.nav.policy import FEATURES, Policy, corrected, features
from flysim.plain import shown_path

CHECKPOINT, POLICY, TRAINING, LOG = "checkpoint.pt", "policy.npz", "training.json", "tensorboard"
ROLLOUT = 256  # steps of each process between two updates
MAX_BYTES, MAX_CHECKPOINT_BYTES = 2**23, 2**26  # of what a training goes on from
MOST = 1e12  # steps, minutes or episodes
WINDOW = 100  # episodes over which success is told
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
UNITS, LOG_STD = [64, 64], -1.2
REWARD = 0.2  # of the environment's: values of about 1, which the network learns faster
EPISODES_PER_WORLD = 10  # a new world takes as long as a hundred steps

Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """What is trained, and how long.

    Attributes:
        worlds: name or file of a world, or random-easy, random-medium, random-hard.
        observation: what the policy sees: flies, sgbm or truth.
        steps: of all processes together, after which it ends.
        minutes: of wall-clock time after which it ends, those before a resumption counted in; None: no limit.
        processes: environments side by side.
        seed: of everything: with `minutes` None the same seed gives the same policy.
        renderer: auto, gl or tiny.
    """

    worlds: str
    observation: str
    steps: int
    minutes: float | None
    processes: int
    seed: int
    renderer: str


@dataclass(slots=True, kw_only=True)
class Training:
    """How far a training has come: what is written beside the policy.

    Attributes:
        tasks: what was asked for: at the start, and at each resumption, with the step it went on from.
        settings: of PPO and the network.
        steps: done, of all processes together.
        minutes: taken.
        episodes: ended.
        curve: `(steps, minutes, success, mean reward as PPO sees it)` after each rollout, over the last 100 episodes.
    """

    tasks: list[dict[str, Any]]
    settings: dict[str, Any]
    steps: int = 0
    minutes: float = 0.0
    episodes: int = 0
    curve: list[tuple[int, float, float, float]] = field(default_factory=list)

    def check(self) -> None:
        """Refuses, with a ValueError, what no training can have come to."""
        for name in ("steps", "minutes", "episodes"):
            value = getattr(self, name)
            if not isinstance(value, int if name != "minutes" else int | float) or not 0 <= value <= MOST:
                raise ValueError(f"{name} must be a number from 0 to {MOST:g}, got {value!r}")
        if not isinstance(self.tasks, list) or not isinstance(self.settings, dict):
            raise ValueError("tasks must be a list and settings a table")
        for row in self.curve if isinstance(self.curve, list) else (None,):
            if not isinstance(row, list) or [isinstance(v, int | float) for v in row] != [True] * 4:
                raise ValueError(f"curve must be rows of four numbers, got {row!r}")

    @property
    def success(self) -> float | None:
        """Of the last episodes, with the chance that belongs to training."""
        return self.curve[-1][2] if self.curve else None


class PolicyView(gym.Wrapper[NDArray[np.float32], NDArray[np.float32], Any, Any]):
    """The environment as a policy has it: features for observations, corrections for actions, smaller rewards."""

    def __init__(self, env: FlyNavEnv) -> None:
        super().__init__(env)  # type: ignore[arg-type]
        self._body = Body(radius=env.radius, v_max=env.v_max, w_max=env.w_max, period=PERIOD_S)
        self.observation_space = spaces.Box(-2.0, 2.0, (FEATURES,), np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begins an episode."""
        self._seen, info = self.env.reset(seed=seed, options=options)
        return features(self._seen, self._body), info  # type: ignore[arg-type]

    def step(self, action: NDArray[np.float32]) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """One period."""
        action = corrected(self._seen, self._body, action)  # type: ignore[arg-type]
        self._seen, reward, terminated, truncated, info = self.env.step(action)
        return features(self._seen, self._body), REWARD * float(reward), terminated, truncated, info  # type: ignore


def train(task: Task, out: Path, *, resume: bool = False, progress: Progress | None = None) -> Training:
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
    try:
        import torch
        from stable_baselines3 import PPO
        from stable_baselines3.common.vec_env import SubprocVecEnv, VecMonitor
    except ImportError as error:
        raise FlysimError(
            f"training needs stable-baselines3 ({error}). Install it: `make rl` in a checkout, elsewhere "
            "`pip install 'flysim-testbed[rl]'`."
        ) from None
    from flysim.nav.rollouts import Rollouts

    with closing(_env(task)) as env:  # a world's or renderer's mistake is told here, not by a process that dies
        env.reset(seed=task.seed)
    training = _begun(out, task) if resume else _new(out, task)
    if _share(training, task) >= 1.0:
        raise FlysimError(
            f"{out} has done its {training.steps} steps in {training.minutes:.1f} minutes: raise --steps."
        )
    torch.set_num_threads(1)  # the environments have the cores; so small a network gains nothing
    kinds = [partial(_env, task) for _ in range(task.processes)]
    envs = VecMonitor(SubprocVecEnv(kinds, start_method="spawn"), info_keywords=("success",))  # type: ignore[arg-type]
    try:
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
        if resume:
            _restore(model, out / CHECKPOINT)
            model.num_timesteps = training.steps

        def keep() -> None:
            _whole(out / CHECKPOINT, lambda path: torch.save(model.get_parameters(), path))
            policy_of(model).save(out / POLICY)
            _whole(out / TRAINING, lambda path: path.write_text(json.dumps(asdict(training), indent=1) + "\n"))

        watch = Rollouts(
            training,
            lambda: _share(training, task),
            lambda: task.minutes is not None and training.minutes >= task.minutes,
            keep,
            progress or (lambda _what, _share: None),
        )
        left = task.steps - training.steps
        model.learn(left, callback=watch, reset_num_timesteps=not resume, tb_log_name="ppo", log_interval=1)
        keep()
    finally:
        envs.close()
    return training


def policy_of(model: Any) -> Policy:
    """The network of a stable-baselines3 model that has `PolicyView`'s spaces, without the library."""
    layers = [layer for layer in model.policy.mlp_extractor.policy_net if hasattr(layer, "weight")]
    layers.append(model.policy.action_net)
    numbers = [(layer.weight.detach().cpu().numpy(), layer.bias.detach().cpu().numpy()) for layer in layers]
    return Policy(weights=tuple(w.copy() for w, _ in numbers), biases=tuple(b.copy() for _, b in numbers))


def _env(task: Task) -> PolicyView:
    return PolicyView(
        FlyNavEnv(
            world=task.worlds,
            observation=task.observation,  # type: ignore[arg-type]
            renderer=task.renderer,  # type: ignore[arg-type]
            episodes_per_world=EPISODES_PER_WORLD,
        )
    )


def _share(training: Training, task: Task) -> float:
    by_time = 0.0 if task.minutes is None else training.minutes / task.minutes
    return max(training.steps / task.steps, by_time)


def _new(out: Path, task: Task) -> Training:
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise FlysimError(f"{out} exists already: go on with it by --resume, or name another folder with --out.")
    out.mkdir(parents=True, exist_ok=True)
    return Training(tasks=[{**asdict(task), "from_step": 0}], settings={**SETTINGS, "units": UNITS, "log_std": LOG_STD})


def _begun(out: Path, task: Task) -> Training:
    path = out / TRAINING
    if not path.exists():
        raise FlysimError(f"{shown_path(out)} holds no training to resume: leave --resume out to begin one.")
    try:
        training = Training(**read_json(path, "training", MAX_BYTES))
        training.check()
    except (ValueError, TypeError) as error:
        raise FlysimError(f"{shown_path(path)}: no training: {error}.") from None
    training.tasks.append({**asdict(task), "from_step": training.steps})
    return training


def _restore(model: Any, path: Path) -> None:
    """Gives a model the numbers of a checkpoint: numbers alone, nothing that would run."""
    import torch

    with opened(path, "checkpoint", MAX_CHECKPOINT_BYTES) as stream:
        try:
            model.set_parameters(torch.load(stream, weights_only=True))
        except Exception as error:  # torch and its unpickler raise whatever the damaged bytes lead them to
            reason = str(error).partition("\n")[0]
            raise FlysimError(f"{shown_path(path)}: not a checkpoint of this training: {reason}.") from None


def _whole(path: Path, write: Callable[[Path], Any]) -> None:
    """A file written whole or not at all: a training may be stopped at any moment."""
    scratch = path.with_name(f".{path.name}.part")
    try:
        write(scratch)
        scratch.replace(path)
    finally:
        scratch.unlink(missing_ok=True)
