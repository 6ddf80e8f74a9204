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

LONGEST = 5.0  # [s] for one input
START = 60.0  # [s] until the first
FAULTS = ("crashes", "hangs", "tracebacks")
SLOW = {"obj": 0.7, "stl": 0.7}  # share of the usual number, of kinds that say little


def damage(count: int, seed: int, kept: Path, told: Callable[[int], None]) -> dict[str, Counter[str]]:
    """Reads `count` damaged inputs on two processes; a counter a kind. What was at fault is copied to `kept`."""
    jobs: SimpleQueue[tuple[str, str, int, int]] = SimpleQueue()
    each = count / sum(SLOW.get(kind, 1.0) for kind in KINDS)
    for number, kind in enumerate(KINDS):
        jobs.put((kind, "sound", seed, 1))
        some = round(each * SLOW.get(kind, 1.0))
        by_words = some // 2 if kind in TEXT else 0
        for part in range(-(-some // 400)):  # not in one go: the last kind shall not keep one process alone busy
            share = lambda of, part=part, some=some: len(range(part, of, -(-some // 400)))  # noqa: E731
            jobs.put((kind, "words", seed + 1000 * number + part, share(by_words)))
            jobs.put((kind, "flips", seed + 1000 * number + part, share(some - by_words)))
    found = {kind: Counter[str]() for kind in KINDS}
    lock = threading.Lock()

    def count_one(kind: str, word: str) -> None:
        with lock:
            found[kind][word] += 1
            told(sum(counter["inputs"] for counter in found.values()))

    with TemporaryDirectory(prefix="campaign-") as room:
        first = Path(room) / "0"
        first.mkdir()
        sow(first)
        shutil.copytree(first, Path(room) / "1")

        def work(folder: Path) -> None:
            while True:
                try:
                    kind, how, at, left = jobs.get_nowait()
                except Empty:
                    return
                while left > 0:
                    done = _watched(folder, kind, how, at, left, kept, count_one)
                    left, at = left - done if done else 0, at + 500_000

        threads = [threading.Thread(target=work, args=(Path(room) / str(k),)) for k in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    return found


def _watched(
    folder: Path, kind: str, how: str, seed: int, count: int, kept: Path, count_one: Callable[[str, str], None]
) -> int:
    """Runs one process until it has read `count` inputs or one was its end; how many it has read."""
    command = [
        sys.executable,
        str(Path(__file__).with_name("reading.py")),
        str(folder),
        str(seed),
        kind,
        how,
        str(count),
    ]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    lines: SimpleQueue[dict[str, Any] | None] = SimpleQueue()

    def read() -> None:
        assert process.stdout is not None
        for line in process.stdout:
            lines.put(json.loads(line))
        lines.put(None)

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    done, at_work, sound = 0, False, (folder / FILES[kind]).read_bytes()
    while True:
        try:
            line = lines.get(timeout=2.0 * LONGEST if at_work else START)
        except Empty:
            process.kill()
            _fault(kept, folder, kind, seed, done, "hangs", "no answer")
            count_one(kind, "hangs")
            break
        if line is None:
            if process.wait() != 0 or at_work:
                _fault(kept, folder, kind, seed, done, "crashes", f"exit code {process.returncode}")
                count_one(kind, "crashes")
            break
        if "began" in line:
            at_work = True
            continue
        at_work, done = False, done + 1
        count_one(kind, "inputs")
        if line["seconds"] > LONGEST:
            _fault(kept, folder, kind, seed, done, "hangs", f"{line['seconds']:.1f} s")
            count_one(kind, "hangs")
        elif line["ended"] == "fault" or (how == "sound" and line["ended"] != "read"):
            _fault(kept, folder, kind, seed, done, "tracebacks", line["text"])
            count_one(kind, "tracebacks")
        else:
            count_one(kind, line["ended"])
    process.wait()
    reader.join()
    if at_work:
        done += 1
        count_one(kind, "inputs")
    (folder / FILES[kind]).write_bytes(sound)
    return done


def _fault(kept: Path, folder: Path, kind: str, seed: int, number: int, what: str, text: str) -> None:
    """Keeps an input that was at fault, and what became of it."""
    place = kept / f"{kind}-{seed}-{number}-{what}"
    place.mkdir(parents=True, exist_ok=True)
    shutil.copy(folder / FILES[kind], place)
    (place / "what.txt").write_text(text + "\n", encoding="utf-8")
