"""What a command line sets for an environment and its agents: `--robot`, `--texture`, `--set TABLE.KEY=VALUE`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any

from flysim.common.catalogue import find_robot
from flysim.common.overrides import override
from flysim.errors import FlysimError, did_you_mean
from flysim.nav.settings import Settings
from flysim.robots.robot import mount
from flysim.worlds.sdf.folder import model_folders

# Tables of a scenario that an environment has as well; of `drive` these keys.
TABLES = ("flies", "sensors", "calibration", "light", "drive")
DRIVE = ("v_max", "w_max")


def asked_settings(
    overrides: Sequence[str],
    agents: Sequence[str] = (),
    *,
    robot: str | None = None,
    texture: str | None = None,
    wheels: Sequence[str] | None = None,
    cameras: str | None = None,
    models: Sequence[str] = (),
) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """Plain data of what was set: for the environment, and by agent for its parameters.

    Args:
        overrides: `TABLE.KEY=VALUE` each; a table is one of `TABLES`, or an agent.
        agents: that drive.
        robot: name or URDF.
        texture, wheels, cameras, models: as the environment's.

    Raises:
        FlysimError: there is no such table, robot, texture, pair of cameras or folder.
    """
    given: dict[str, Any] = {}
    for one in overrides:
        override(given, one)
    for name, value in given.items():
        if not isinstance(value, dict):
            raise FlysimError(f"--set {name}: write TABLE.KEY=VALUE, as in --set vfh.look=1.2 or light.level=0.3.")
        if name not in TABLES and name not in agents:
            raise FlysimError(f"--set {name}: no table and no agent that drives. {did_you_mean(name, _known(agents))}")
    if texture not in (None, "speckle"):
        raise FlysimError(f"--texture {texture}: agents drive in worlds as they are, or dressed in speckle.")
    settings: dict[str, Any] = {name: value for name, value in given.items() if name in TABLES}
    if robot is not None:
        find_robot(robot)
        settings["robot"] = robot
    mount(cameras)
    model_folders(models)
    plain = {"texture": texture, "wheels": wheels and list(wheels), "cameras": cameras, "models": list(models) or None}
    settings |= {name: value for name, value in plain.items() if value is not None}
    return settings, {name: value for name, value in given.items() if name not in TABLES}


def arguments_of(settings: Mapping[str, Any], observation: str) -> dict[str, Any]:
    """Arguments of the environment, of the plain data that `asked_settings` gave.

    Raises:
        FlysimError: a key that there is not, or a value that cannot be.
    """
    from flysim.nav.seeing import defaults

    found = {name: value for name, value in settings.items() if name not in ("drive", "flies")}
    for key, value in settings.get("drive", {}).items():
        if key not in DRIVE:
            raise FlysimError(f"drive has no '{key}' here. {did_you_mean(key, DRIVE)}")
        found[key] = value
    try:
        if "flies" in settings:
            found["flies"] = _changed(defaults(observation), settings["flies"], "flies")
        Settings.of({"observation": observation, **found})
    except (TypeError, ValueError) as error:
        raise FlysimError(f"--set: {str(error).rstrip('.')}.") from None
    return found


def _changed(record: Any, given: Mapping[str, Any], name: str) -> Any:
    """A record of parameters with some of them changed, those in records of its own too."""
    known = [field.name for field in fields(record)]
    changes: dict[str, Any] = {}
    for key, value in given.items():
        if key not in known:
            raise FlysimError(f"{name} has no '{key}'. {did_you_mean(key, known)}")
        old = getattr(record, key)
        if is_dataclass(old) and isinstance(value, Mapping):
            value = _changed(old, value, f"{name}.{key}")
        changes[key] = tuple(value) if isinstance(value, list) else value
    return replace(record, **changes)


def _known(agents: Sequence[str]) -> list[str]:
    return [*TABLES, *agents]
