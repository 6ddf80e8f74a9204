"""A trained policy: what it is shown, and a small network that runs without the library that trained it.

It corrects the agent `straight` instead of beginning at nothing: residual policy learning (Silver and others, 2018).
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flysim.common.catalogue import find_policy
from flysim.common.whole_file import whole_file
from flysim.errors import FlysimError
from flysim.foreign.arrays import read_npz
from flysim.foreign.data import parse_json
from flysim.nav.agents.agent import Observation, RobotLimits, towards
from flysim.nav.agents.surroundings import SECTORS
from flysim.plain import shown_path

FORMAT = 1  # of the features and the file; a policy of another one is refused
WIDE = 2  # sectors that are told as one: 10 degrees
TURN_GAIN = 2.0  # of a correction: it can turn a full turn to one side into one to the other
FAR = 3.0  # [m] what is farther off does not count
FEATURES = SECTORS // WIDE + 5
LARGEST_FILE = 1 << 20  # [bytes] unpacked
LARGEST = 1e6  # of its numbers, by size
MOST_LAYERS, MOST_UNITS = 8, 4096


def features(observation: Observation, limits: RobotLimits) -> NDArray[np.float32]:
    """`[FEATURES]` what a policy is shown, about -1 to 1, the same for robots of other sizes and speeds.

    Nearness of the nearest obstacle in each 10 degrees (1 touches the robot's circle, 0 is 3 m off or unknown),
    the goal's nearness, the cosine and sine of its bearing, speed and yaw rate as shares of the largest.
    """
    distance = np.asarray(observation["obstacles"], np.float64).reshape(-1, WIDE).min(axis=1)
    near = np.clip(1.0 - (distance - limits.radius) / FAR, 0.0, 1.0) ** 2
    away, bearing = (float(v) for v in observation["goal"])
    v, w = (float(v) for v in observation["velocity"])
    told = [np.exp(-away / 2.0), np.cos(bearing), np.sin(bearing), v / limits.v_max, w / limits.w_max]
    return np.concatenate([near, np.clip(told, -2.0, 2.0)]).astype(np.float32)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Policy:
    """Layers of a network with tanh between them.

    Attributes:
        weights: `[out, in]` of each layer, float32; the first takes `FEATURES`, the last gives two numbers.
        biases: `[out]` of each layer.
    """

    weights: tuple[NDArray[np.float32], ...]
    biases: tuple[NDArray[np.float32], ...]

    def __call__(self, shown: NDArray[np.float32]) -> NDArray[np.float32]:
        """`[2]` what the network says of `[FEATURES]`; `corrected` makes an action of it."""
        x = shown
        for k, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            x = weight @ (np.tanh(x) if k else x) + bias
        return x

    def save(self, path: Path) -> None:
        """Writes it whole or not at all."""
        with whole_file(path) as part:
            self.write(part)

    def write(self, path: Path) -> None:
        """Writes it: plain numbers, no pickle."""
        arrays = {f"weight_{k}": weight for k, weight in enumerate(self.weights)}
        arrays |= {f"bias_{k}": bias for k, bias in enumerate(self.biases)}
        about = np.frombuffer(json.dumps({"format": FORMAT, "layers": len(self.weights)}).encode(), np.uint8)
        with path.open("wb") as file:
            np.savez_compressed(file, about=about, **arrays)  # type: ignore[arg-type]


def corrected(observation: Observation, limits: RobotLimits, raw: NDArray) -> NDArray[np.float32]:
    """The environment's action: what `straight` would do, and a correction `raw` `[2]` of it in [-1, 1]."""
    v, w = towards(limits, float(observation["goal"][1]), limits.v_max)
    more = np.clip(np.asarray(raw, np.float32), -1.0, 1.0)
    return np.array([np.clip(v + more[0], 0.0, 1.0), np.clip(w + TURN_GAIN * more[1], -1.0, 1.0)], np.float32)


def load_policy(path: Path) -> Policy:
    """Reads what `Policy.save` wrote.

    Raises:
        FlysimError: it is no such file, or a policy of another version.
    """
    if not path.is_file():
        raise FlysimError(f"no policy file '{shown_path(path)}'. `flysim train ppo` writes one.")
    arrays = read_npz(path, "policy", LARGEST_FILE)
    try:
        about = parse_json(arrays["about"].tobytes().decode("utf-8"))
        if about["format"] != FORMAT:
            raise ValueError(f"its format is {about['format']}, this flysim reads {FORMAT}")
        count = about["layers"]
        if not isinstance(count, int) or not 1 <= count <= MOST_LAYERS:
            raise ValueError(f"it has {count} layers")
        layers = [(arrays[f"weight_{k}"], arrays[f"bias_{k}"]) for k in range(count)]
        units = FEATURES
        for weight, bias in layers:
            if weight.ndim != 2 or weight.shape[1] != units or bias.shape != weight.shape[:1]:
                raise ValueError("its layers do not fit each other")
            if weight.dtype.kind != "f" or bias.dtype.kind != "f":
                raise ValueError("its numbers are of another kind")
            if not ((np.abs(weight) <= LARGEST).all() and (np.abs(bias) <= LARGEST).all()):
                raise ValueError(f"it holds numbers that are not finite or beyond {LARGEST:g}")
            units = len(bias)
            if units > MOST_UNITS:
                raise ValueError(f"a layer has {units} units")
        if units != 2:
            raise ValueError(f"it gives {units} numbers, not speed and yaw rate")
    except (ValueError, LookupError, TypeError) as error:
        raise FlysimError(f"{shown_path(path)}: not a policy that flysim can use: {error}.") from None
    return Policy(
        weights=tuple(np.asarray(weight, np.float32) for weight, _ in layers),
        biases=tuple(np.asarray(bias, np.float32) for _, bias in layers),
    )


class PolicyAgent:
    """Drives by a trained policy, without chance."""

    def __init__(self, limits: RobotLimits, policy: Policy) -> None:
        self._limits, self._policy = limits, policy

    def begin(self, rng: np.random.Generator) -> None:
        """Forgets the last episode: a new one begins."""

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Shares of the largest speed and yaw rate."""
        return corrected(observation, self._limits, self._policy(features(observation, self._limits)))


def from_file(name: str) -> Callable[[RobotLimits], PolicyAgent]:
    """What makes agents of the policy of a name or a path.

    Raises:
        FlysimError: it cannot be used.
    """
    policy = load_policy(find_policy(name))
    return lambda limits: PolicyAgent(limits, policy)


def shipped(limits: RobotLimits) -> PolicyAgent:
    """The agent of the policy that comes with flysim."""
    return from_file("ppo")(limits)
