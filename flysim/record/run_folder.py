"""The folder of a run: written whole or not at all, and read back."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
import shutil
import uuid
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from flysim.errors import RecordError, did_you_mean

REPORT = "report.json"
LATEST = "latest"
_FULL = (errno.ENOSPC, errno.EDQUOT)


def default_folder(base: Path, scenario: str, seed: int | None, now: datetime | None = None) -> Path:
    """A folder in `base` that does not exist yet: `<scenario>-<utc time>-s<seed>`, perhaps with `-2`.

    What has no one seed, as a study over many, has None.
    """
    time = (now or datetime.now(UTC)).astimezone(UTC).strftime("%Y%m%dT%H%M%SZ")
    name = f"{re.sub(r'[^A-Za-z0-9_.-]+', '_', scenario).lstrip('.') or 'run'}-{time}" + (
        "" if seed is None else f"-s{seed}"
    )
    folder, count = base / name, 1
    while os.path.lexists(folder):
        count += 1
        folder = base / f"{name}-{count}"
    return folder


def check_target(out: Path) -> None:
    """Refuse a folder that `run_folder` could not write to, before a long run instead of after it.

    Raises:
        RecordError: as `run_folder`.
    """
    target = _target(out)
    with _explained(out, target), _room_beside(target) as room:
        room.mkdir()
        room.rmdir()


@contextlib.contextmanager
def run_folder(out: Path) -> Iterator[Path]:
    """Yield a hidden folder beside `out` to write into. At the end it becomes `out`; on any error it goes.

    An interrupt counts as an error. What ends the process at once (SIGKILL, a power cut) may leave the hidden
    folder, `.<name>.<random>.part`, never a half-written `out`.

    Raises:
        RecordError: `out` exists and is no empty folder, its parent cannot be made or written, the disk is
            full.
    """
    target = _target(out)
    with _explained(out, target), _room_beside(target) as room:
        room.mkdir()
        yield room
        try:
            room.rename(target)
        except OSError as error:
            if error.errno in (errno.ENOTEMPTY, errno.EEXIST, errno.ENOTDIR):
                raise RecordError(f"{out} appeared while the run was written: {_CHOOSE}") from error
            raise


def find_run(name: str, base: Path) -> Path:
    """The run folder that a user means: a path, a name in `base`, a scenario's newest run, or `latest`.

    Raises:
        RecordError: there is none; the message names the nearest.
    """
    if name != LATEST:
        for folder in (Path(name), base / name):
            if (folder / REPORT).is_file():
                return folder
        if Path(name).is_dir():
            raise RecordError(f"{name} is no run folder: it has no {REPORT}. A run folder is what `flysim run` writes")
    runs = {folder.name: folder for folder in _runs(base)}
    if not runs:
        raise RecordError(f"no run '{name}': {base} holds none yet. Start with `flysim run paper_a`")
    ours = [folder for key, folder in runs.items() if name == LATEST or _scenario_of(key) == name]
    if ours:
        return max(ours, key=lambda folder: ((folder / REPORT).stat().st_mtime_ns, folder.name))
    raise RecordError(f"no run '{name}' in {base}. {did_you_mean(name, {*runs, *map(_scenario_of, runs), LATEST})}")


def read_report(folder: Path) -> dict[str, Any]:
    """The `report.json` of a run folder.

    Raises:
        RecordError: the folder or its report is missing or damaged.
    """
    path = folder / REPORT
    if not folder.is_dir():
        raise RecordError(f"no run folder at {folder}: give one that `flysim run` wrote")
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise RecordError(f"{folder} is no run folder: it has no {REPORT}") from error
    except (OSError, UnicodeDecodeError, RecursionError) as error:
        raise RecordError(f"cannot read {path}: {error}") from error
    except json.JSONDecodeError as error:
        raise RecordError(f"{path} is damaged at line {error.lineno}: {error.msg}. Run the scenario again") from error
    missing = [
        key for key in ("scenario", "seed", "status", "obstacles") if not isinstance(report, dict) or key not in report
    ]
    if missing:
        raise RecordError(f"{path} is no report of flysim: it lacks {', '.join(missing)}")
    return report


_CHOOSE = "name another folder with `--out DIR`"


def _target(out: Path) -> Path:
    """The absolute path of `out`, refused where a rename cannot put a folder."""
    try:
        target = out.expanduser().resolve()
        if target.is_dir():
            if any(target.iterdir()):
                raise RecordError(f"{out} exists and is not empty: {_CHOOSE}, or empty it")
            if target.is_mount() or target == Path.cwd():
                raise RecordError(
                    f"{out} is in use and cannot be replaced: name a new folder in it, `--out {out / 'run'}`"
                )
        elif target.exists():
            raise RecordError(f"{out} is a file: {_CHOOSE}")
    except (OSError, RuntimeError) as error:  # RuntimeError: no home folder, or a loop of links
        raise RecordError(f"cannot write {out}: {_reason(error)}; {_CHOOSE}") from error
    return target


@contextlib.contextmanager
def _room_beside(target: Path) -> Iterator[Path]:
    """A free hidden name beside `target`. What still bears it at the end goes, with parents made for it."""
    made: list[Path] = []
    room = target.with_name(f".{target.name[:200]}.{uuid.uuid4().hex[:8]}.part")
    try:
        for parent in reversed([target.parent, *target.parent.parents]):
            if not parent.exists():
                parent.mkdir()
                made.append(parent)
        yield room
    finally:
        if os.path.lexists(room):
            shutil.rmtree(room, ignore_errors=True)
        for parent in reversed(made):  # a parent that now holds the run is not empty, and stays
            with contextlib.suppress(OSError):
                parent.rmdir()


@contextlib.contextmanager
def _explained(out: Path, target: Path) -> Iterator[None]:
    """Turn the system's refusals into one line each."""
    try:
        yield
    except OSError as error:
        if error.errno in _FULL:
            raise RecordError(f"disk full while writing {out}: free some space, or {_CHOOSE}") from error
        about = Path(os.fsdecode(error.filename)) if isinstance(error.filename, (str, bytes)) else target
        if about.is_relative_to(target.parent) or target.is_relative_to(about):
            raise RecordError(f"cannot write {out}: {_reason(error)}; {_CHOOSE}") from error
        raise RecordError(f"cannot read or write {_reason(error)}") from error  # a file of the run, not of `out`


def _reason(error: Exception) -> str:
    """`permission denied (/the/path)`: the system's words in lower case, with the path they are about."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower() + (f" ({error.filename})" if error.filename else "")
    return str(error) or type(error).__name__


def _runs(base: Path) -> list[Path]:
    try:
        return [folder for folder in base.iterdir() if not folder.name.startswith(".") and (folder / REPORT).is_file()]
    except OSError:
        return []


def _scenario_of(name: str) -> str:
    return re.sub(r"-\d{8}T\d{6}Z-s-?\d+(-\d+)?$", "", name)
