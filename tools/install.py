"""Fills .venv with flysim and the versions that constraints.txt pins: `python3 tools/install.py [dev]`.

Needs nothing but Python and its pip. uv, itself pinned and installed by pip, does it in seconds; where uv cannot be
had or fails, pip does it in a minute or two.
"""

import ast
import os
import platform
import shutil
import subprocess
import sys
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
VENV = ROOT / ".venv"
PYTHON = VENV / "bin" / "python"
PINS = "constraints.txt"  # relative to ROOT: pip splits PIP_CONSTRAINT at spaces, which a checkout's path may have

# pip's settings that uv needs as well, and where uv reads them: uv does not read pip's configuration.
UV_VARIABLES = {
    "index-url": "UV_DEFAULT_INDEX",
    "extra-index-url": "UV_INDEX",
    "find-links": "UV_FIND_LINKS",
    "no-index": "UV_NO_INDEX",
    "trusted-host": "UV_INSECURE_HOST",
    "default-timeout": "UV_HTTP_TIMEOUT",
    "timeout": "UV_HTTP_TIMEOUT",
    "proxy": "ALL_PROXY",
    "cert": "SSL_CERT_FILE",
}


def install(*extras: str) -> None:
    """Makes .venv if there is none that works, and installs flysim in it, editable, with some of its extras."""
    if sys.version_info < (3, 11):
        sys.exit(f"flysim needs Python 3.11 or newer, got {sys.version.split()[0]}: make PYTHON=python3.11 ...")
    if not (has_wheels() or has_compiler()):
        have = f"Python {platform.python_version()} on {sys.platform} {platform.machine()}"
        sys.exit(
            f"flysim: pybullet has no wheel for {have}, and there is no C++ compiler: make PYTHON=python3.13 ..., "
            "or install one (Debian: g++)"
        )
    if not works(PYTHON, "-c", ""):
        venv.create(VENV, clear=True, symlinks=True)
    pip = pip_command()
    target = ["-c", PINS, "-e", f".[{','.join(extras)}]" if extras else "."]
    print("flysim: installing into .venv what constraints.txt pins", flush=True)
    if not with_uv(pip, target):
        print("flysim: uv could not do it; pip takes a minute or two", flush=True)
        pins = {"PIP_CONSTRAINT": PINS, "PIP_BUILD_CONSTRAINT": PINS}  # those that building flysim needs, too
        if not call(*pip, "install", "--quiet", *target, env={**os.environ, **pins}):
            sys.exit("flysim: pip could not install the packages; its own message is above")
    call(PYTHON, "-m", "compileall", "-q", "flysim")


def has_wheels() -> bool:
    """Whether pybullet, or the fork that pyproject.toml names for later Pythons, is to be had without compiling."""
    return (sys.platform, platform.machine()) == ("linux", "x86_64") and sys.version_info[:2] <= (3, 13)


def has_compiler() -> bool:
    """Whether something on the path can compile C++."""
    named = [os.environ[name].split()[0] for name in ("CXX", "CC") if os.environ.get(name, "").split()]
    return any(shutil.which(name) for name in (*named, "c++", "g++", "clang++"))


def pip_command() -> list[str | Path]:
    """This Python's pip, told to work on .venv; or, if it has none, one of .venv's own."""
    if works(sys.executable, "-m", "pip", "--version"):
        return [sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", PYTHON]
    if works(PYTHON, "-m", "pip", "--version") or works(PYTHON, "-m", "ensurepip"):
        return [PYTHON, "-m", "pip", "--disable-pip-version-check"]
    sys.exit(f"flysim: {sys.executable} has neither pip nor ensurepip: install one (Debian: python3-venv)")


def with_uv(pip: list[str | Path], target: list[str]) -> bool:
    """Whether uv is to be had and installed it all."""
    uv = VENV / "bin" / "uv"
    if not uv.exists() and not call(*pip, "install", "--quiet", "-c", PINS, "uv"):
        return False
    env = {**uv_variables(pip), **os.environ}  # what the user has set for uv stays
    # Pins are looked for in every index, as pip does.
    strategy = ("--index-strategy", "unsafe-best-match")
    # Compiled once, as pip does: where Python may not write bytecode itself, each start would take seconds longer.
    options = ("--quiet", "--compile-bytecode", "--build-constraints", PINS)
    return call(uv, "pip", "install", "--python", PYTHON, *strategy, *options, *target, env=env)


def uv_variables(pip: list[str | Path]) -> dict[str, str]:
    """What pip's configuration files and environment say, in uv's words."""
    listed = subprocess.run([*pip, "config", "list"], cwd=ROOT, capture_output=True, text=True, check=False).stdout
    settings: dict[tuple[str, str], str] = {}
    for line in listed.splitlines():
        place, _, value = line.partition("=")
        section, _, name = place.rpartition(".")
        if name in UV_VARIABLES and value:
            settings[section, name] = str(ast.literal_eval(value))
    found: dict[str, str] = {}
    for section in ("global", "install", ":env:"):  # the last one wins
        for name, variable in UV_VARIABLES.items():
            if (section, name) in settings:
                separator = "," if name == "find-links" else " "
                found[variable] = separator.join(settings[section, name].split())
    return found


def works(*command: str | Path) -> bool:
    """Whether a command ends well; silent."""
    try:
        return subprocess.run(command, cwd=ROOT, capture_output=True, check=False).returncode == 0
    except OSError:
        return False


def call(*command: str | Path, env: dict[str, str] | None = None) -> bool:
    """Whether a command ends well; what it says is shown."""
    try:
        return subprocess.run(command, cwd=ROOT, env=env, check=False).returncode == 0
    except OSError as error:
        print(f"flysim: {error}", file=sys.stderr)
        return False


if __name__ == "__main__":
    install(*sys.argv[1:])
