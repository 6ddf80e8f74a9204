"""Damaged inputs of every kind, read by processes that are watched: none may crash, hang or trace back."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from queue import Empty, SimpleQueue
from tempfile import TemporaryDirectory
from typing import Any

from seeds import FILES, KINDS, TEXT, sow

LONGEST = 5.0  # [s] of processor time for one input
PATIENCE = 60.0  # [s] for an answer, on a machine that may have other work
START = 60.0  # [s] until the first
FAULTS = ("crashes", "hangs", "tracebacks")


Job = list[Any]  # kind, how, seed, count


def damage(count: int, seed: int, kept: Path, told: Callable[[int], None]) -> dict[str, Counter[str]]:
    """Reads `count` damaged inputs on two processes; a counter a kind. What was at fault is copied to `kept`."""
    parts: SimpleQueue[list[Job]] = SimpleQueue()
    number = max(2, count // 600)
    for part in range(number):
        share = len(range(part, count, number)) / len(KINDS)
        jobs: list[Job] = []
        for k, kind in enumerate(KINDS):
            at, some = seed + 1000 * (k + 1) + part, len(range(k, round(share * len(KINDS)), len(KINDS)))
            by_words = some // 2 if kind in TEXT else 0
            jobs += [[kind, "sound", at, 1]] if part == 0 else []
            jobs += [[kind, "words", at, by_words], [kind, "flips", at, some - by_words]]
        parts.put([job for job in jobs if job[3]])
    found = {kind: Counter[str]() for kind in KINDS}
    lock = threading.Lock()

    def count_one(kind: str, word: str) -> None:
        with lock:
            found[kind][word] += 1
            told(sum(counter["inputs"] for counter in found.values()))

    def work(folder: Path) -> None:
        while True:
            try:
                jobs = parts.get_nowait()
            except Empty:
                return
            while jobs:
                jobs = _watched(folder, jobs, kept, count_one)

    with TemporaryDirectory(prefix="campaign-") as room:
        first = Path(room) / "0"
        first.mkdir()
        sow(first)
        shutil.copytree(first, Path(room) / "1")
        threads = [threading.Thread(target=work, args=(Path(room) / str(k),)) for k in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    return found


def _watched(folder: Path, jobs: list[Job], kept: Path, count_one: Callable[[str, str], None]) -> list[Job]:
    """Runs one process until it has done its jobs, or one input was its end; what is left to do."""
    sound = {kind: (folder / FILES[kind]).read_bytes() for kind in KINDS}
    command = [sys.executable, str(Path(__file__).with_name("reading.py")), str(folder), json.dumps(jobs)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    lines: SimpleQueue[dict[str, Any] | None] = SimpleQueue()

    def read() -> None:
        assert process.stdout is not None
        for line in process.stdout:
            lines.put(json.loads(line))
        lines.put(None)

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    done, at_work, job = [0] * len(jobs), False, 0

    def fault(what: str, text: str) -> None:
        kind, _, seed, _ = jobs[job]
        place = kept / f"{kind}-{seed}-{done[job]}-{what}"
        place.mkdir(parents=True, exist_ok=True)
        shutil.copy(folder / FILES[kind], place)
        (place / "what.txt").write_text(text + "\n", encoding="utf-8")
        count_one(kind, what)

    while True:
        try:
            line = lines.get(timeout=PATIENCE if at_work else START)
        except Empty:
            process.kill()
            fault("hangs", "no answer")
            break
        if line is None:
            if process.wait() != 0 or at_work:
                fault("crashes", f"exit code {process.returncode}")
            break
        if "began" in line:
            at_work, job = True, line["began"]
            continue
        at_work, done[job] = False, done[job] + 1
        count_one(jobs[job][0], "inputs")
        if line["seconds"] > LONGEST:
            fault("hangs", f"{line['seconds']:.1f} s of processor time")
        elif line["ended"] == "fault" or (jobs[job][1] == "sound" and line["ended"] != "read"):
            fault("tracebacks", line["text"])
        else:
            count_one(jobs[job][0], line["ended"])
    process.wait()
    reader.join()
    for kind, data in sound.items():
        (folder / FILES[kind]).write_bytes(data)
    if not at_work:
        return [] if process.returncode == 0 else jobs[job + 1 :]
    count_one(jobs[job][0], "inputs")
    kind, how, seed, count = jobs[job]
    rest = [[kind, how, seed + 500_000, count - done[job] - 1]] if count > done[job] + 1 else []
    return rest + jobs[job + 1 :]
