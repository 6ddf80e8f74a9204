"""The campaign: damaged inputs, kills, want, and a thousand resets. `python tests/campaign --help` has the options.

It prints a table of counts; what is at fault is printed below it, and damaged inputs that were are kept in a folder.
Exit code 1 if anything is.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from inputs import FAULTS, damage
from kills import COLUMNS as KILLED
from kills import kill
from resets import reset
from starved import COLUMNS as STARVED
from starved import starve

from flysim.cli.terminal import Bar, say, show
from flysim.common.sheet import Sheet

READ = ("inputs", "read", "refused", *FAULTS)
MOST_GROWTH = 0.05  # of memory over all resets


def sheet(title: str, columns: Sequence[str], found: Mapping[str, Counter[str]]) -> Sheet:
    """Counts by kind, with their sum."""
    rows = [(name, *(str(counter[column]) for column in columns)) for name, counter in found.items()]
    if len(rows) > 1:
        total = sum(found.values(), Counter())
        rows.append(("all", *(str(total[column]) for column in columns)))
    return Sheet(title=title, columns=("", *columns), rows=tuple(rows))


def main() -> int:
    """Runs the parts that were asked for."""
    ask = argparse.ArgumentParser(prog="tests/campaign", description=__doc__, epilog="Example: make campaign")
    ask.add_argument("--inputs", type=int, default=10_000, help="damaged inputs, of all kinds together")
    ask.add_argument("--kills", type=int, default=48, help="commands that are ended by a signal")
    ask.add_argument("--only", default="", help="commands to kill, with commas between; all by default")
    ask.add_argument("--resets", type=int, default=1000, help="of one environment")
    ask.add_argument("--no-want", action="store_true", help="leave out full disks, small memories and their like")
    ask.add_argument("--seed", type=int, default=0, help="of all randomness")
    ask.add_argument("--kept", type=Path, default=Path("runs/out/campaign"), help="folder for inputs at fault")
    ask.add_argument("--json", action="store_true", help="print one JSON object, nothing else")
    asked = ask.parse_args()
    sheets: list[Sheet] = []
    data: dict[str, object] = {"seed": asked.seed}
    faults: list[str] = []

    def took(title: str, columns: Sequence[str], good: Sequence[str], found: Mapping[str, Counter[str]]) -> None:
        sheets.append(sheet(title, columns, found))
        data[title] = {name: {column: counter[column] for column in columns} for name, counter in found.items()}
        for name, counter in found.items():
            faults.extend(f"{title}, {name}: {key.removeprefix('! ')}" for key in counter if key.startswith("! "))
            wrong = {column: counter[column] for column in columns if column not in good and counter[column]}
            if wrong:
                faults.append(f"{title}, {name}: {wrong}")

    began = time.monotonic()
    with Bar("campaign", quiet=asked.json) as bar:
        if asked.inputs:
            told = lambda done: bar(f"input {done} of {asked.inputs}", min(done / asked.inputs, 1.0))  # noqa: E731
            found = damage(asked.inputs, asked.seed, asked.kept, told)
            took("damaged inputs", READ, READ[:3], found)
        if asked.kills:
            only = tuple(filter(None, asked.only.split(",")))
            killed = kill(asked.kills, asked.seed, lambda done: bar(f"kill {done} of {asked.kills}", 0.0), only)
            took("killed commands", KILLED, KILLED[:1], killed)
        if not asked.no_want:
            took("want", STARVED, STARVED[:3], starve(lambda done: bar(f"want {done}", 0.0)))
        if asked.resets:
            curve = reset(asked.resets, lambda done: bar(f"reset {done} of {asked.resets}", done / asked.resets))
            files = "constant" if len(set(curve.files)) == 1 else f"{min(curve.files)} to {max(curve.files)}"
            row = (str(asked.resets), f"{100.0 * curve.growth:+.1f} %", files, str(curve.temporary))
            sheets.append(Sheet(title="resets", columns=("resets", "memory", "open files", "left behind"), rows=(row,)))
            data["resets"] = {
                "memory_mb": curve.memory,
                "files": curve.files,
                "left": curve.temporary,
                "at": curve.resets,
            }
            if curve.growth > MOST_GROWTH or len(set(curve.files)) > 1 or curve.temporary:
                faults.append(f"resets: {row}")
    data |= {"seconds": round(time.monotonic() - began, 1), "faults": faults}
    if asked.json:
        sys.stdout.write(json.dumps(data, indent=1) + "\n")
    else:
        show(sheets)
        say(*faults, f"{len(faults)} at fault in {data['seconds']} s")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
