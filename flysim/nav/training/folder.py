"""A training and the folder that it is kept in: whatever stops it, that holds one to resume, or none."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from flysim.common.held import PART, hold
from flysim.errors import FlysimError
from flysim.foreign.data import parse_json, read_json
from flysim.foreign.files import opened
from flysim.plain import shown_path

CHECKPOINT, POLICY, TRAINING, LOG = "checkpoint.pt", "policy.npz", "training.json", "tensorboard"
MAX_BYTES, MAX_CHECKPOINT_BYTES = 2**23, 2**26  # of what a training goes on from
MOST = 1e12  # steps, minutes or episodes
WINDOW = 100  # episodes over which success is told


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingTask:
    """What is trained, and how long.

    Attributes:
        worlds: name or file of a world, or random-easy, random-medium, random-hard.
        observation: what the policy sees: flies, sgbm or truth.
        steps: of all processes together, after which it ends.
        minutes: of wall-clock time after which it ends, those before a resumption counted in; None: no limit.
        processes: environments side by side.
        seed: of everything: with `minutes` None the same seed gives the same policy.
        renderer: auto, gl or tiny.
        settings: what else was set for the environment, as `asked_settings` gives it.
    """

    worlds: str
    observation: str
    steps: int
    minutes: float | None
    processes: int
    seed: int
    renderer: str
    settings: dict[str, Any] = field(default_factory=dict)


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
        """Share of the last episodes that reached the goal, with the chance that belongs to training."""
        return self.curve[-1][2] if self.curve else None


@contextlib.contextmanager
def training_folder(out: Path, *, resume: bool) -> Iterator[None]:
    """Holds the folder while it is trained in. What was made and holds no training at the end goes.

    Raises:
        FlysimError: there is something else in it, or somebody trains in it.
    """
    if resume and not (out / CHECKPOINT).is_file() and not (out / TRAINING).is_file():
        raise FlysimError(f"{out} holds no training to resume: leave --resume out to begin one.")
    if not resume and not _is_free(out):
        raise FlysimError(f"{out} exists already: go on with it by --resume, or name another folder with --out.")
    made = [folder for folder in (out, *out.parents) if not folder.exists()]
    log = (out / LOG).exists()
    out.mkdir(parents=True, exist_ok=True)
    try:
        held = hold(out.resolve())
    except BlockingIOError:
        raise FlysimError(f"{out}: another training writes it. Name another folder with --out.") from None
    try:
        yield
    except KeyboardInterrupt as stop:
        if (out / CHECKPOINT).exists():
            stop.add_note(f"the training is kept in {out}: the same command with --resume goes on")
        raise
    finally:
        if not log and not (out / CHECKPOINT).exists():
            shutil.rmtree(out / LOG, ignore_errors=True)
        for folder in made:  # what holds a training is not empty, and stays
            with contextlib.suppress(OSError):
                folder.rmdir()
        os.close(held)


def _is_free(out: Path) -> bool:
    """Whether a training may begin there: nothing is in it but what a killed one left before its first rollout."""
    if not out.exists():
        return True
    return out.is_dir() and all(one.name == LOG or one.name.endswith(PART) for one in out.iterdir())


def begun(out: Path, task: TrainingTask) -> tuple[Training, dict[str, Any]]:
    """The training in a folder, and the parameters of its network."""
    import torch

    path = out / CHECKPOINT
    with opened(path, "checkpoint", MAX_CHECKPOINT_BYTES) as stream:
        try:
            parameters = torch.load(stream, weights_only=True)  # numbers alone, nothing that would run
            told = parameters.pop(TRAINING, None)
        except Exception as error:  # torch and its unpickler raise whatever the damaged bytes lead them to
            reason = str(error).partition("\n")[0]
            raise FlysimError(f"{shown_path(path)}: not a checkpoint of this training: {reason}.") from None
    try:
        if told is None:  # an older checkpoint has the parameters alone
            path = out / TRAINING
            told = read_json(path, "training", MAX_BYTES)
        else:
            told = parse_json(told)
        training = Training(**told)
        training.check()
    except (ValueError, TypeError) as error:
        raise FlysimError(f"{shown_path(path)}: no training: {error}.") from None
    training.tasks.append({**asdict(task), "from_step": training.steps})
    return training, parameters
