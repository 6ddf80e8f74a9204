"""`make mutants`: of one-line mutants of stereo/, flies/, obstacles/, truth/, evaluate/, how many does a test kill?

A sample, drawn by a seed, file by file. Each mutant stands in a copy of the checkout and meets the tests of its room,
the quickest first: those of kernels uncompiled (NUMBA_DISABLE_JIT), which spares most mutants the compilation. The
checkout is not touched. Exit code 1: under 80 % killed; 2: the tests fail without any mutant.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue
from xml.etree import ElementTree

from mutations import Mutant, sample
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

ROOT = Path(__file__).resolve().parents[1]
NEEDED = 0.8  # share that is to be killed
PATIENCE, GRACE_S = 4.0, 30.0  # a run may take so many times as long as without a mutant, and so much longer
MEMORY_KB = 16_000_000  # that a mutant may address
LEFT_BEHIND = (".git", ".venv", "out", "*.nbc", "*.nbi", "kernels-*", ".hypothesis", ".*_cache", "dist")


@dataclass(frozen=True, slots=True, kw_only=True)
class Stage:
    """Tests that a mutant meets.

    Attributes:
        tests: files in the order in which they are run, or a folder, whose quickest file is the first.
        compiled: whether the kernels are.
    """

    tests: tuple[str, ...]
    compiled: bool = True


def _of_flies(*names: str, compiled: bool) -> Stage:
    return Stage(tests=tuple(f"tests/flies/test_{name}.py" for name in names), compiled=compiled)


ROOMS = {
    # The tests of whole surfaces and photographs are left out: of what these let through they hardly kill one.
    "flysim/flies": (
        _of_flies("generation", "finish", "golden", "oracle", compiled=False),
        _of_flies("parameters", "regions", "carry", "breeding", "evolution", "golden", compiled=True),
    ),
    "flysim/obstacles": (Stage(tests=("tests/obstacles",), compiled=False), Stage(tests=("tests/obstacles",))),
    "flysim/stereo": (
        Stage(tests=("tests/stereo", "tests/flies/test_oracle.py", "tests/flies/test_golden.py"), compiled=False),
        Stage(tests=("tests/stereo", "tests/flies/test_golden.py")),
    ),
    "flysim/evaluate": (Stage(tests=("tests/evaluate",)),),
    "flysim/truth": (Stage(tests=("tests/truth", "tests/evaluate")),),
}


class Bench:
    """A copy of the checkout in which one mutant after the other is tried."""

    def __init__(self, folder: Path) -> None:
        self.root, self.kernels, self.report = folder / "checkout", folder / "kernels", folder / "report.xml"
        shutil.copytree(ROOT, self.root, ignore=shutil.ignore_patterns(*LEFT_BEHIND), symlinks=True)
        self.running: subprocess.Popen[bytes] | None = None
        self.stopped = False

    def run(self, stage: Stage, tests: list[str], limit_s: float | None, own_kernels: bool) -> tuple[str, float]:
        """("passed", "failed" or "timed out", seconds) of a stage's tests, up to the first that fails."""
        env = {**os.environ, "PYTHONPATH": str(self.root), "PYTHONDONTWRITEBYTECODE": "1", "NUMBA_NUM_THREADS": "1"}
        env |= {} if stage.compiled else {"NUMBA_DISABLE_JIT": "1"}
        env |= {"NUMBA_CACHE_DIR": str(self.kernels)} if own_kernels else {}
        pytest = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", f"--junitxml={self.report}"]
        if self.stopped:
            return "stopped", 0.0
        limited = ["sh", "-c", f'ulimit -v {MEMORY_KB}; exec "$@"', "sh", *pytest, *tests]
        began = time.monotonic()
        self.running = subprocess.Popen(
            limited, cwd=self.root, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            start_new_session=True,
        )  # fmt: skip
        try:
            code = self.running.wait(limit_s)
            outcome = "passed" if code == 0 else "failed"
        except subprocess.TimeoutExpired:
            outcome = "timed out"
        finally:
            self.stop()
            shutil.rmtree(self.kernels, ignore_errors=True)
        return outcome, time.monotonic() - began

    def stop(self) -> None:
        """Ends what runs."""
        if self.running is not None and self.running.poll() is None:
            os.killpg(self.running.pid, signal.SIGKILL)
            self.running.wait()

    def seconds_of_files(self) -> dict[str, float]:
        """Of the last run, by test file."""
        found: dict[str, float] = {}
        for case in ElementTree.parse(self.report).iter("testcase"):
            path = case.get("classname", "").replace(".", "/") + ".py"
            found[path] = found.get(path, 0.0) + float(case.get("time", 0.0))
        return found


class Trial:
    """All that is tried, and what came of it."""

    def __init__(self, benches: list[Bench]) -> None:
        self.benches = benches
        self.order: dict[Stage, list[str]] = {}  # test files, the quickest first
        self.limits: dict[Stage, float] = {}
        self.outcomes: list[tuple[Mutant, str]] = []

    def clean(self, rooms: list[str]) -> list[str]:
        """Runs every stage without a mutant, on every bench, which also fills its kernels' cache; what fails."""
        failed: list[str] = []

        def work(bench: Bench) -> None:
            for stage in dict.fromkeys(stage for room in rooms for stage in ROOMS[room]):
                outcome, seconds = bench.run(stage, list(stage.tests), None, own_kernels=False)
                if outcome != "passed":
                    failed.append(f"{' '.join(stage.tests)} {outcome} without a mutant")
                    return
                files, folder = bench.seconds_of_files(), len(stage.tests) == 1
                self.order[stage] = sorted(files, key=lambda path: files[path]) if folder else list(stage.tests)
                # A mutant of a kernel is compiled as well.
                self.limits[stage] = max(self.limits.get(stage, 0.0), PATIENCE * seconds + GRACE_S)

        self._each(work)
        return failed

    def judge(self, bench: Bench, mutant: Mutant) -> str:
        """What became of a mutant: "survived", or how it was killed."""
        target = bench.root / mutant.path
        original = target.read_bytes()
        target.write_text(mutant.code, encoding="utf-8")
        try:
            for stage in next(stages for room, stages in ROOMS.items() if mutant.path.is_relative_to(room)):
                outcome, _ = bench.run(stage, self.order[stage], self.limits[stage], own_kernels=True)
                if outcome != "passed":
                    return outcome
            return "survived"
        finally:
            target.write_bytes(original)

    def run(self, mutants: list[Mutant], deadline: float, progress: Progress) -> None:
        """Judges mutants until there is none left, or no time."""
        todo: SimpleQueue[Mutant] = SimpleQueue()
        for mutant in mutants:
            todo.put(mutant)
        bar = progress.add_task("mutants", total=len(mutants), survived=0)

        def work(bench: Bench) -> None:
            while time.monotonic() < deadline and not bench.stopped:
                try:
                    mutant = todo.get_nowait()
                except Empty:
                    return
                outcome = self.judge(bench, mutant)
                if bench.stopped:
                    return
                self.outcomes.append((mutant, outcome))
                if outcome == "survived":
                    show(mutant, progress.console)
                survived = sum(outcome == "survived" for _, outcome in self.outcomes)
                progress.update(bar, advance=1, survived=survived)

        self._each(work)

    def _each(self, work: Callable[[Bench], None]) -> None:
        """Works on all benches side by side; Ctrl-C ends what they run."""
        workers = [threading.Thread(target=work, args=(bench,)) for bench in self.benches]
        for worker in workers:
            worker.start()
        try:
            for worker in workers:
                worker.join()
        except BaseException:
            for bench in self.benches:
                bench.stopped = True
                bench.stop()
            for worker in workers:
                worker.join()
            raise


def show(mutant: Mutant, console: Console) -> None:
    """Where it differs, and how."""
    console.print(f"\nsurvived: {mutant.path}:{mutant.line} ({mutant.operator})", markup=False)
    console.print(mutant.diff, markup=False, highlight=False, soft_wrap=True)


def table(outcomes: list[tuple[Mutant, str]]) -> Table:
    """A row a file, and one for all."""
    shown = Table("file", "mutants", "killed", "survived", "score", box=None)
    for column in shown.columns[1:]:
        column.justify = "right"
    paths = sorted({mutant.path for mutant, _ in outcomes})
    for name, chosen in [*((str(path), {path}) for path in paths), ("all", set(paths))]:
        told = [outcome for mutant, outcome in outcomes if mutant.path in chosen]
        survived = told.count("survived")
        share = f"{100.0 * (1.0 - survived / max(len(told), 1)):.0f} %"
        shown.add_row(name, str(len(told)), str(len(told) - survived), str(survived), share)
    return shown


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--sample", type=int, default=200, help="mutants to try (default 200)")
    parser.add_argument("--seed", type=int, default=0, help="which ones (default 0)")
    parser.add_argument("--minutes", type=float, default=30.0, help="after which no new one is begun (default 30)")
    parser.add_argument("--workers", type=int, default=2, help="copies of the checkout (default 2)")
    parser.add_argument("--only", default="", help="files whose path holds this")
    parser.add_argument("--json", type=Path, help="where to write outcomes and survivors as well")
    asked = parser.parse_args()
    deadline = time.monotonic() + 60.0 * asked.minutes
    console = Console()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    paths = [path.relative_to(ROOT) for room in ROOMS for path in sorted((ROOT / room).glob("*.py"))]
    paths = [path for path in paths if asked.only in str(path)]
    rooms = [room for room in ROOMS if any(path.is_relative_to(room) for path in paths)]
    mutants = [mutant for mutant, _ in zip(sample(ROOT, paths, asked.seed), range(asked.sample), strict=False)]
    if not mutants:
        console.print(
            f"no file of {', '.join(ROOMS)} has {asked.only!r} in its path and anything to mutate", markup=False
        )
        return 2
    with tempfile.TemporaryDirectory(prefix="flysim-mutants-") as scratch:
        folders = [Path(scratch) / str(k) for k in range(asked.workers)]
        trial = Trial([Bench(folder) for folder in folders])
        columns = ("{task.description}", "{task.fields[survived]} survived")
        with Progress(
            TextColumn(columns[0]), BarColumn(), MofNCompleteColumn(), TextColumn(columns[1]), TimeElapsedColumn(),
            console=console,
        ) as progress:  # fmt: skip
            waiting = progress.add_task("tests without a mutant", total=None, survived=0)
            if failed := trial.clean(rooms):
                console.print(failed[0], markup=False)
                return 2
            progress.remove_task(waiting)
            try:
                trial.run(mutants, deadline, progress)
            except KeyboardInterrupt:
                console.print("stopped; what was tried until then:", markup=False)
    return told(trial.outcomes, asked, console)


def told(outcomes: list[tuple[Mutant, str]], asked: argparse.Namespace, console: Console) -> int:
    """Says what came out; the exit code."""
    outcomes = sorted(outcomes, key=lambda pair: (pair[0].path, pair[0].line))
    survivors = [mutant for mutant, outcome in outcomes if outcome == "survived"]
    console.print()
    console.print(table(outcomes))
    score = 1.0 - len(survivors) / max(len(outcomes), 1)
    timed_out = sum(outcome == "timed out" for _, outcome in outcomes)
    console.print(
        f"\n{len(outcomes)} mutants of seed {asked.seed}: {len(outcomes) - len(survivors)} killed "
        f"({timed_out} by the time limit), {100.0 * score:.0f} %; {100.0 * NEEDED:.0f} % are needed",
        highlight=False,
    )
    if asked.json:
        rows = [
            {"file": str(m.path), "line": m.line, "operator": m.operator, "outcome": outcome, "diff": m.diff}
            for m, outcome in outcomes
        ]
        report = {"seed": asked.seed, "asked": asked.sample, "mutants": len(rows), "score": score, "outcomes": rows}
        asked.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    return 0 if outcomes and score >= NEEDED else 1


if __name__ == "__main__":
    sys.exit(main())
