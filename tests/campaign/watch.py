"""A flysim process in an empty room of its own, and what it leaves behind there."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MARK = "FLYSIM_CAMPAIGN"  # environment variable by which processes of a room are found
OBEYED = 5.0  # [s] from a signal to the end


@dataclass
class Room:
    """A folder with its own folder for temporary files."""

    folder: Path
    mark: str = field(default_factory=lambda: uuid.uuid4().hex)

    def __post_init__(self) -> None:
        self.temporary.mkdir(parents=True, exist_ok=True)

    @property
    def temporary(self) -> Path:
        """TMPDIR of what runs here."""
        return self.folder / "tmp"

    def start(
        self,
        arguments: Sequence[str],
        *,
        program: Sequence[str] = (sys.executable, "-m", "flysim"),
        before: Callable[[], None] | None = None,
        **environment: str,
    ) -> subprocess.Popen[str]:
        """Starts flysim in the room."""
        path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
        given = {**os.environ, "PYTHONPATH": path, "TMPDIR": str(self.temporary), MARK: self.mark, **environment}

        def prepare() -> None:
            for name in (signal.SIGINT, signal.SIGHUP, signal.SIGTERM):
                signal.signal(name, signal.SIG_DFL)  # a shell in the background has its children ignore Ctrl-C
            signal.signal(signal.SIGINT, signal.default_int_handler)
            if before is not None:
                before()

        return subprocess.Popen(
            [*program, *map(str, arguments)],
            cwd=self.folder,
            env=given,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            preexec_fn=prepare,
        )

    def alive(self) -> list[int]:
        """Processes of the room that still run."""
        found = []
        for place in Path("/proc").glob("[0-9]*"):
            try:
                if self.mark.encode() in (place / "environ").read_bytes() and (place / "exe").exists():
                    found.append(int(place.name))
            except OSError:
                continue  # it has ended, or is somebody else's
        return found

    def orphans(self, patience: float = 3.0) -> list[int]:
        """Those that still run after a while; they are ended then."""
        until = time.monotonic() + patience
        while (left := self.alive()) and time.monotonic() < until:
            time.sleep(0.05)
        for one in left:
            try:
                os.kill(one, signal.SIGKILL)
            except ProcessLookupError:
                continue
        return left

    def litter(self) -> list[str]:
        """What nobody asked for: temporary files, and folders or files that are being written."""
        temporary = [path for path in self.temporary.iterdir() if not path.name.startswith("flysim-kernels-")]
        return [str(path.relative_to(self.folder)) for path in (*temporary, *self.folder.rglob("*.part"))]

    def half(self) -> list[str]:
        """What looks finished and is not: documents that cannot be read, run folders without a report."""
        found = []
        for path in self.folder.rglob("*.json"):
            try:
                json.loads(path.read_text(encoding="utf-8"))
            except ValueError:
                found.append(str(path.relative_to(self.folder)))
        runs = [path.parent for path in self.folder.rglob("recording.rrd") if ".part" not in str(path)]
        return found + [str(run.relative_to(self.folder)) for run in runs if not (run / "report.json").is_file()]
