"""The agents by name: those that come with flysim, trained policies, and whatever a user brings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import is_dataclass
from typing import Any, cast

from flysim.common.records import record_of
from flysim.common.registry import Registry
from flysim.errors import FlysimError
from flysim.nav.agents.agent import Agent, RobotLimits

AGENTS = Registry(
    "agent",
    "flysim.agents",
    {
        "straight": "flysim.nav.agents.simple:StraightAgent",
        "warning": "flysim.nav.agents.warning:WarningAgent",
        "vfh": "flysim.nav.agents.vfh:VfhAgent",
        "dwa": "flysim.nav.agents.dwa:DwaAgent",
        "ppo": "flysim.nav.agents.policy:shipped",
        "random": "flysim.nav.agents.simple:RandomAgent",
    },
)


def make_agent(name: str, limits: RobotLimits, params: Mapping[str, Any] | None = None) -> Agent:
    """An agent by name, a `module:object`, or the path of a policy file that `flysim train` wrote.

    Args:
        name: of the agent. What it stands for is called with the limits, and with the parameters if there are any.
        limits: of the robot that it drives.
        params: of the agent, by name; None: its own.

    Raises:
        FlysimError: there is none of that name, its policy cannot be used, or it has no such parameter.
    """
    made = _maker(name)
    if not callable(made):
        raise FlysimError(f"agent '{name}' is no class to be called with a robot's limits: see docs/extending.md.")
    make = cast("Callable[..., Agent]", made)
    return make(limits, _params(name, made, params)) if params else make(limits)


def _maker(name: str) -> Any:
    if name.endswith(".npz"):
        from flysim.nav.agents.policy import from_file

        return from_file(name)
    return AGENTS.load(name)


def _params(name: str, made: Any, given: Mapping[str, Any]) -> Any:
    record = getattr(made, "Params", None)
    if record is None:
        raise FlysimError(f"agent '{name}' has no parameters to set.")
    if not (isinstance(record, type) and is_dataclass(record)):
        raise FlysimError(f"agent '{name}': its Params must be a dataclass: see docs/extending.md.")
    try:
        return record_of(record, f"agent '{name}'", given)
    except ValueError as error:
        raise FlysimError(str(error)) from None
