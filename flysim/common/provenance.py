"""Which code made a run: the git commit and the versions of what it stands on."""

from __future__ import annotations

import platform
import subprocess
from importlib import metadata
from pathlib import Path

from flysim import __version__

# What figures depend on: distribution -> the name a reader knows it by.
PACKAGES = {
    "numpy": "numpy",
    "scipy": "scipy",
    "numba": "numba",
    "pybullet": "pybullet",
    "pybullet-arm64": "pybullet",  # a fork under the same import, where PyPI's own has no wheel
    "moderngl": "moderngl",
    "opencv-python-headless": "opencv",
    "opencv-python": "opencv",
}
FORKS = {"pybullet-arm64"}


def versions() -> dict[str, str]:
    """Versions of Python, flysim and the packages that figures depend on; those not installed are left out.

    A fork of pybullet is told by its own name behind its version: `"3.2.8 (pybullet-arm64)"`.
    """
    found = {"python": platform.python_version(), "flysim": __version__}
    for distribution, name in PACKAGES.items():
        try:
            version = metadata.version(distribution)
        except metadata.PackageNotFoundError:
            continue
        found[name] = f"{version} ({distribution})" if distribution in FORKS else version
    return found


def git_commit(package: Path = Path(__file__).resolve().parent.parent) -> str | None:
    """The commit of the checkout that flysim runs from, with `-dirty` if its files differ from it.

    None where the package is no part of a checkout, as when it is installed in somebody else's repository.
    """
    try:
        _git(package, "ls-files", "--error-unmatch", "errors.py")
        commit = _git(package, "rev-parse", "HEAD")
        return commit + "-dirty" if _git(package, "status", "--porcelain", "-uno", ".") else commit
    except (OSError, subprocess.SubprocessError):
        return None


def _git(folder: Path, *arguments: str) -> str:
    done = subprocess.run(
        ["git", "-C", str(folder), *arguments], capture_output=True, text=True, check=True, timeout=5.0
    )
    return done.stdout.strip()
