"""The folder of a run: what it is called, and how it is found and read back."""

from __future__ import annotations

import hashlib
import itertools
import re
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from flysim.errors import RecordError, did_you_mean
from flysim.foreign.data import read_json
from flysim.plain import shown_path

REPORT = "report.json"
LATEST = "latest"
LONGEST = 60  # characters of an engine's name in that of a file
MAX_BYTES = 2**22  # of a report: some five thousand obstacles


def default_folders(base: Path, scenario: str, seed: int | None, now: datetime | None = None) -> Iterator[Path]:
    """Names in `base` for `whole_folder.reserved`: `<scenario>-<utc time>-s<seed>`, then the same with `-2` and so on.

    What has no one seed, as a study over many, has None.
    """
    time = (now or datetime.now(UTC)).astimezone(UTC).strftime("%Y%m%dT%H%M%SZ")
    name = f"{re.sub(r'[^A-Za-z0-9_.-]+', '_', scenario).lstrip('.') or 'run'}-{time}" + (
        "" if seed is None else f"-s{seed}"
    )
    yield base / name
    for count in itertools.count(2):
        yield base / f"{name}-{count}"


def report_file(engine: str) -> str:
    """What the report of an engine is called beside those of others: by its name, as far as a file may have that."""
    name = re.sub(r"[^A-Za-z0-9_.:-]+", "_", engine)
    if name != engine or len(name) > LONGEST:
        name = f"{name[:LONGEST]}-{hashlib.sha256(engine.encode()).hexdigest()[:8]}"
    return f"{name}.json"


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
        raise RecordError(f"no run folder at {shown_path(folder)}: give one that `flysim run` wrote")
    if not path.exists():
        raise RecordError(f"{shown_path(folder)} is no run folder: it has no {REPORT}")
    report = read_json(path, "report", MAX_BYTES, RecordError)
    missing = [
        key for key in ("scenario", "seed", "status", "obstacles") if not isinstance(report, dict) or key not in report
    ]
    if missing:
        raise RecordError(f"{shown_path(path)} is no report of flysim: it lacks {', '.join(missing)}")
    return report


def _runs(base: Path) -> list[Path]:
    try:
        return [folder for folder in base.iterdir() if not folder.name.startswith(".") and (folder / REPORT).is_file()]
    except OSError:
        return []


def _scenario_of(name: str) -> str:
    return re.sub(r"-\d{8}T\d{6}Z-s-?\d+(-\d+)?$", "", name)
