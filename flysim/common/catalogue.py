"""Where the worlds, robots and scenarios that travel with flysim are, by name."""

from __future__ import annotations

import os
import re
from pathlib import Path

from flysim.common.registry import Registry
from flysim.errors import FlysimError, RobotError, ScenarioError, WorldError, did_you_mean
from flysim.plain import shown, shown_path

# In a wheel they are package data; in a checkout they stand beside the package.
_INSTALLED = Path(__file__).parents[1] / "assets"
ROOT = _INSTALLED if _INSTALLED.is_dir() else Path(__file__).parents[2]

# Beside those: what packages add.
WORLDS = Registry("world", "flysim.worlds", {}, WorldError)
_OBJECT = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_][\w.]*")

BARN = "FLYSIM_BARN"  # environment variable: the folder of BARN's worlds
BARN_BESIDE = Path("../shared/data/barn")


def names(kind: str) -> list[str]:
    """The names of all assets of a kind: "worlds", "robots", "runs" or "policies"."""
    pattern = {"worlds": "*/world.sdf", "robots": "*/robot.urdf", "runs": "*.toml", "policies": "*/policy.npz"}[kind]
    found = (ROOT / kind).glob(pattern)
    return sorted(path.stem if kind == "runs" else path.parent.name for path in found)


def shipped_name(path: Path) -> str | None:
    """What a world's or a robot's file is called where it is one of flysim's own; None where it is not."""
    kinds = {"world.sdf": "worlds", "robot.urdf": "robots"}
    kind, path = kinds.get(path.name), path.resolve()
    return path.parent.name if kind is not None and path.parent.parent == (ROOT / kind).resolve() else None


def world_names() -> list[str]:
    """The names of all worlds: flysim's own, then those that packages add."""
    own = names("worlds")
    return [*own, *(name for name in WORLDS.names if name not in own)]


def find_world(name: str, beside: Path | None = None) -> Path:
    """The world file of a name, a path or a `module:object`.

    A relative path is taken from the folder `beside`, then from here. What a package adds under a name, or what is at
    `module:object`, is the path of an SDF file, or a function without arguments that gives it.

    Raises:
        WorldError: there is no such world, or what should give its path does not.
    """
    known = ROOT / "worlds" / name / "world.sdf"
    here = ("/" not in name and _is_file(known)) or any(_is_file(path) for path in _candidates(name, beside))
    if not here and (_OBJECT.fullmatch(name) or name in WORLDS.names):
        return _made(name)
    return _find("world", "worlds", name, known, WorldError, beside)


def _made(name: str) -> Path:
    found = WORLDS.load(name)
    try:
        path = found() if callable(found) else found
    except FlysimError:
        raise
    except Exception as error:  # a user's function may fail in any way
        raise WorldError(f"world {shown(name)}: it cannot be made: {type(error).__name__}: {error}.") from error
    if not isinstance(path, str | os.PathLike) or not _is_file(Path(os.fspath(path))):
        raise WorldError(f"world {shown(name)}: it must be, or give, the path of an SDF file; got {shown(str(path))}.")
    return Path(os.fspath(path)).absolute()


def find_robot(name: str, beside: Path | None = None) -> Path:
    """The URDF of a name or a path; a relative path is taken from the folder `beside`, then from here."""
    return _find("robot", "robots", name, ROOT / "robots" / name / "robot.urdf", RobotError, beside)


def find_policy(name: str) -> Path:
    """The file of a trained policy, of a name or a path."""
    return _find("policy", "policies", name, ROOT / "policies" / name / "policy.npz", FlysimError, None)


def barn_folder(given: Path | None = None) -> Path:
    """Where the worlds of the BARN benchmark are: as given, else $FLYSIM_BARN, else `../shared/data/barn` from here."""
    return given or (Path(os.environ[BARN]) if os.environ.get(BARN) else BARN_BESIDE)


def find_scenario(name: str) -> Path:
    """The scenario file of a name or a path."""
    return _find("scenario", "runs", name, ROOT / "runs" / f"{name}.toml", ScenarioError, None)


def _find(what: str, kind: str, name: str, known: Path, error: type[FlysimError], beside: Path | None) -> Path:
    if "/" not in name and "\\" not in name and _is_file(known):
        return known
    candidates = _candidates(name, beside)
    looks_like_path = "/" in name or Path(name).suffix != ""
    if looks_like_path:
        for path in candidates:
            if _is_file(path):
                return path
        place = shown_path(candidates[0])
        raise error(f"no {what} file '{place}'. Give a path that exists, or a name: {', '.join(names(kind))}.")
    raise error(f"no {what} {shown(name)}. {did_you_mean(name, world_names() if kind == 'worlds' else names(kind))}")


def _candidates(name: str, beside: Path | None) -> list[Path]:
    return [Path(name)] if beside is None else [beside / name, Path(name)]


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name too long, a folder that may not be entered
        return False
