"""What comparing derivatives costs: `python tests/bench/compared_cost.py [ROUNDS]` prints times and flies by ratio.

Both ways take turns on the pairs of `yard` in one process, so that a busy machine slows both alike.
"""

import sys
import time
from dataclasses import replace

import numpy as np

from flysim.flies.evolution import evolve
from flysim.runs.run import driven
from flysim.runs.scenario import read_scenario


def main(rounds: int) -> None:
    """Prints the medians over rounds and pairs."""
    plan = read_scenario("yard")
    frames, _ = driven(plan, seed=0)
    ways = {name: replace(plan.flies, prefilter=name) for name in ("gradient", "none")}
    spent, count = {name: [] for name in ways}, {name: [] for name in ways}
    for k in range(rounds + 1):  # the first one warms up
        for frame in frames.frames():
            for name, params in ways.items():
                began = time.perf_counter()
                swarm = evolve(frame.pair, params, rng=np.random.default_rng(k))
                if k:
                    spent[name].append(1e3 * (time.perf_counter() - began))
                    count[name].append(len(swarm.points))
    ms, flies = ({name: float(np.median(of[name])) for name in ways} for of in (spent, count))
    print(f"derivatives {ms['gradient']:.1f} ms, levels {ms['none']:.1f} ms: {ms['gradient'] / ms['none']:.2f} times")
    print(f"flies {flies['gradient']:.0f} and {flies['none']:.0f}: {flies['gradient'] / flies['none']:.2f} times")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
