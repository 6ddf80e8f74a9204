"""Where the worlds, robots and scenarios that travel with flysim are, by name."""

from __future__ import annotations

import os
from pathlib import Path

from flysim.errors import FlysimError, RobotError, ScenarioError, WorldError, did_you_mean
from flysim.plain import shown, shown_path

# In a wheel they are package data; in a checkout they stand beside the package.
_INSTALLED = Path(__file__).parents[1] / "assets"
ROOT = _INSTALLED if _INSTALLED.is_dir() else Path(__file__).parents[2]

BARN = "FLYSIM_BARN"  # environment variable: the folder of BARN's worlds
BARN_BESIDE = Path("../shared/data/barn")


def names(kind: str) -> list[str]:
    """The names of all assets of a kind: "worlds", "robots", "runs" or "policies"."""
    pattern = {"worlds": "*/world.sdf", "robots": "*/robot.urdf", "runs": "*.toml", "policies": "*/policy.npz"}[kind]
    found = (ROOT / kind).glob(pattern)
    return sorted(path.stem if kind == "runs" else path.parent.name for path in found)


def find_world(name: str, beside: Path | None = None) -> Path:
    """The world file of a name or a path; a relative path is taken from the folder `beside`, then from here."""
    return _find("world", "worlds", name, ROOT / "worlds" / name / "world.sdf", WorldError, beside)


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
    candidates = [Path(name)] if beside is None else [beside / name, Path(name)]
    looks_like_path = "/" in name or Path(name).suffix != ""
    if looks_like_path:
        for path in candidates:
            if _is_file(path):
                return path
        place = shown_path(candidates[0])
        raise error(f"no {what} file '{place}'. Give a path that exists, or a name: {', '.join(names(kind))}.")
    raise error(f"no {what} {shown(name)}. {did_you_mean(name, names(kind))}")


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name too long, a folder that may not be entered
        return False
