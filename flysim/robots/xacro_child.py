"""Expands one xacro file: a program that `flysim.robots.xacro` runs by itself, `xacro_child.py FILE FOLDER LIMIT`.

It reads below FOLDER and in Python's own folders, writes to its standard output, and may do nothing else.
"""

from __future__ import annotations

import os
import resource
import sys
from pathlib import Path
from typing import Any

SHORT = 40  # characters of a path that is told whole
MEMORY, SECONDS = 2 * 2**30, 20  # [bytes], [s] of processor time
# What Python does to import a module and to read a file; whatever else touches the machine is refused.
REFUSED: list[str] = []  # in words: xacro catches what it can, and then says something else
HARMLESS = ("os.listdir", "os.scandir", "os.fspath")
GUARDED = (
    *("os.", "subprocess.", "socket.", "ctypes.", "shutil.", "urllib.", "pty.", "fcntl.", "mmap.", "signal."),
    *("tempfile.", "webbrowser.", "http.", "ftplib.", "smtplib.", "sqlite3.", "syslog.", "gc.", "resource."),
)


def guard(folder: str) -> None:
    """From here on this process reads below `folder` and in Python's own folders, and does nothing else."""
    homes = [os.path.realpath(place) for place in (folder, sys.prefix, sys.base_prefix)]

    def audit(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            place, _, flags = arguments
            writes = isinstance(flags, int) and flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
            if isinstance(place, int):
                return
            real = os.path.realpath(os.fsdecode(place))
            if writes or not any(real == home or real.startswith(home + os.sep) for home in homes):
                name = os.fsdecode(place)
                name = name if len(name) <= SHORT else f".../{Path(name).name}"
                REFUSED.append(f"{name!r} lies outside the robot's folder")
                raise PermissionError(REFUSED[-1])
        elif event.startswith(GUARDED) and event not in HARMLESS:
            REFUSED.append(f"xacro may not do this ({event})")
            raise PermissionError(REFUSED[-1])

    sys.addaudithook(audit)


def find(folder: str, package: str) -> str:
    """What `$(find package)` stands for: the robot's own package."""
    root = Path(folder)
    if package == root.name:
        return folder
    if os.sep not in package and package not in ("", ".", "..") and (root / package).is_dir():
        return str(root / package)
    REFUSED.append(f"package {package!r} is not in the robot's folder")
    raise LookupError(REFUSED[-1])


def main(path: str, folder: str, limit: str) -> None:
    """Writes what the file at `path` stands for to the standard output."""
    import xacro
    import xacro.substitution_args as substitution
    import yaml  # noqa: F401 (xacro loads it in the middle of its work)

    substitution._eval_find = lambda package: find(folder, package)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
    guard(folder)
    document: Any = xacro.process_file(path)
    text = document.toprettyxml(indent="  ", encoding="utf-8")
    if len(text) > int(limit):
        raise ValueError(f"it expands to more than {limit} bytes")
    sys.stdout.buffer.write(text)


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
        sys.stdout.buffer.flush()
    except BaseException as error:
        said = REFUSED[0] if REFUSED else " ".join(str(error).split()) or type(error).__name__
        sys.stderr.write(f"\n{said}\n")
        sys.stderr.flush()
        os._exit(1)
