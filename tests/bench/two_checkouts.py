"""Times two checkouts of flysim in turn, and prints the ratios: `python tests/bench/two_checkouts.py OLD NEW`.

Machines are shared and noisy, so a figure of today says nothing beside one of yesterday. Here each round runs the old
and the new checkout one after the other, and the medians over the rounds are compared. Each checkout needs its own
`.venv`, or a link to one that has what it needs.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
from pathlib import Path
from typing import Any

BENCHES = {
    "stop": ("bench", "stop", "paper_a", "yard", "--repeats", "3", "--json"),
    "env": ("bench", "env", "--steps", "100", "--json"),
    "engine": ("bench", "engine", "--repeats", "3", "--json"),
}


def measured(checkout: Path, bench: str) -> dict[str, float]:
    """Every time and rate that a bench of a checkout prints, by where it stands in the JSON."""
    done = subprocess.run(
        [checkout / ".venv/bin/python", "-m", "flysim", *BENCHES[bench]],
        cwd=checkout,
        env=os.environ | {"PYTHONPATH": str(checkout)},
        capture_output=True,
        text=True,
        check=True,
    )
    found: dict[str, float] = {}

    def walk(value: Any, at: str) -> None:
        if isinstance(value, dict):
            for key, item in value.items():
                walk(item, f"{at}.{key}" if at else key)
        elif isinstance(value, list):
            for k, item in enumerate(value):
                walk(item, f"{at}[{k}]")
        elif isinstance(value, int | float) and ("ms" in at.rpartition(".")[2] or "per_second" in at):
            found[at] = float(value)

    walk({key: value for key, value in json.loads(done.stdout).items() if key != "machine"}, "")
    return found


def main() -> None:
    """Prints, a line a figure, the old median, the new one, and new / old."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--benches", default="stop,env")
    asked = parser.parse_args()
    for bench in asked.benches.split(","):
        rounds = [[measured(where.resolve(), bench) for where in (asked.old, asked.new)] for _ in range(asked.rounds)]
        for name in rounds[0][0]:
            old, new = (statistics.median(turn[side].get(name, 0.0) for turn in rounds) for side in (0, 1))
            if old > 0.0:
                print(f"{bench:7s} {name:55s} {old:10.2f} {new:10.2f} {new / old:6.2f}")


if __name__ == "__main__":
    main()
