"""Every long command, ended at a random moment by each signal: what it leaves, and whether the next run clears it."""

from __future__ import annotations

import importlib.util
import shutil
import signal
import subprocess
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
from watch import OBEYED, Room

FEW = "flies.population=1000"
STOPS = "stops=[{x = 1.629, y = -1.224, yaw_deg = 65}, {x = 1.735, y = -0.997, yaw_deg = 65}]"
# Command -> the longest wait before the signal [s], on two quiet cores.
COMMANDS: dict[str, tuple[tuple[str, ...], float]] = {
    "run": (("run", "paper_c", "--set", FEW, "--out", "out/run"), 8.0),
    "compare": (("compare", "paper_c", "--engines", "flies,sgbm", "--out", "out/compare"), 10.0),
    "suite": (("suite", "random-easy", "--seeds", "0:3", "--engines", "flies", "--out", "out/suite"), 25.0),
    "regress": (("regress", "paper_b"), 10.0),
    "nav": (("nav", "vfh", "--worlds", "random-medium", "--episodes", "6", "--out", "out/nav"), 20.0),
    "train": (
        ("train", "ppo", "--observation", "truth", "--minutes", "1", "--processes", "2", "--out", "out/ppo"),
        30.0,
    ),
    "table1": (("table1", "--seeds", "1", "--out", "out/table1"), 15.0),
    "bench stop": (("bench", "stop", "paper_a", "--repeats", "3"), 12.0),
    "bench env": (("bench", "env", "--steps", "100"), 12.0),
    "bench engine": (("bench", "engine", "--repeats", "1", "--out", "out/bench"), 20.0),
    "world": (("world", "random", "--seed", "3", "--out", "out/world"), 4.0),
    "preview": (("preview", "yard", "--out", "preview.png"), 4.0),
}
CODES = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGHUP: 129}
COLUMNS = ("kills", "crashes", "hangs", "tracebacks", "half folders", "leftovers", "orphans")


def kill(count: int, seed: int, told: Callable[[int], None], only: tuple[str, ...] = ()) -> dict[str, Counter[str]]:
    """Kills `count` commands, each kind in turn; a counter a signal."""
    rng = np.random.default_rng(seed)
    names = [name for name in only or COMMANDS if name != "train" or importlib.util.find_spec("stable_baselines3")]
    signals = (signal.SIGTERM, signal.SIGKILL, signal.SIGHUP, signal.SIGINT)
    found = {one.name: Counter[str]() for one in signals}
    for k in range(count):
        name, how = names[k % len(names)], signals[(k + k // len(names)) % len(signals)]
        arguments, longest = COMMANDS[name]
        place = Path(mkdtemp(prefix="campaign-"))
        try:
            seen = one_kill(Room(place), arguments, how, float(rng.uniform(0.0, longest)))
        finally:
            shutil.rmtree(place, ignore_errors=True)
        found[how.name].update({"kills": 1, **dict.fromkeys(seen, 1)})
        for what, text in seen.items():
            told(-1)
            found[how.name][f"! {what}: {name}, {text}"] += 1
        told(k + 1)
    return found


def one_kill(room: Room, arguments: tuple[str, ...], how: signal.Signals, after: float) -> dict[str, str]:
    """What was wrong about the end of one command, and a word on it."""
    wrong: dict[str, str] = {}
    process = room.start(arguments)
    time.sleep(after)
    process.send_signal(how)
    mark = time.monotonic()
    try:
        _, error = process.communicate(timeout=10.0 * OBEYED)
    except subprocess.TimeoutExpired:
        process.kill()
        _, error = process.communicate()
    if time.monotonic() - mark > OBEYED:
        wrong["hangs"] = f"{time.monotonic() - mark:.0f} s after {after:.2f} s"
    allowed = {0, how.value + 128, -how.value}  # it may have been done; before Python is up nobody handles a signal
    if process.returncode not in allowed:
        wrong["crashes"] = f"exit code {process.returncode} after {after:.2f} s: {error[-300:]}"
    if "Traceback" in error:
        wrong["tracebacks"] = f"after {after:.2f} s: {error[-600:]}"
    left = room.orphans()
    if left:
        wrong["orphans"] = f"{len(left)} after {after:.2f} s"
    half = room.half()
    if half:
        wrong["half folders"] = f"{half[:3]} after {after:.2f} s"
    if how == signal.SIGKILL:  # nobody is left to clear up: the next run does it
        for path in room.folder.glob("out/*"):
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        again = room.start(("run", "paper_c", "--set", STOPS, "--set", FEW, "--out", "out/next"))
        _, error = again.communicate()
        if again.returncode:
            wrong["crashes"] = f"the next run: {error[-300:]}"
    litter = room.litter()
    if litter:
        wrong["leftovers"] = f"{litter[:3]} after {after:.2f} s"
    return wrong
