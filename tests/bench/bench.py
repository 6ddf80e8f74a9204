"""How long the parts take on this machine: medians of several calls, and their ratio to the first row of a table.

Nothing here fails: a figure of one machine on one day is no test. `make bench` runs it.
"""

import os
import platform
import statistics
import time

import numpy as np

from flysim.flies.evolution import evolve
from flysim.flies.parameters import FlyParams
from flysim.pipeline import looks_of
from flysim.scenario import read_scenario
from flysim.sim.look import look
from flysim.sim.renderer import gl_works, open_renderer
from flysim.sim.robot import read_robot
from flysim.sim.simulation import Simulation
from flysim.world.sdf import read_world

SCENARIOS = ("paper_a", "yard")
REPEATS, ENOUGH_S = 9, 6.0  # calls of each, fewer where they take longer than this together, but 3 at least


def timed(work):
    """Median, least and greatest time of a call [ms]; one call beforehand does not count."""
    work()
    times = []
    while len(times) < 3 or (len(times) < REPEATS and sum(times) < 1e3 * ENOUGH_S):
        began = time.perf_counter()
        work()
        times.append(1e3 * (time.perf_counter() - began))
    return statistics.median(times), min(times), max(times)


def show(title, rows):
    print(f"\n{title:<34}{'median':>10}{'least':>10}{'most':>10}{'ratio':>8}")
    first = next(iter(rows.values()))[0]
    for name, (median, least, most) in rows.items():
        print(f"  {name:<32}{median:>8.1f}ms{least:>8.1f}ms{most:>8.1f}ms{median / first:>8.2f}")


def bench(scenario):
    plan = read_scenario(scenario)
    world, robot = read_world(plan.world_path), read_robot(plan.robot_path)
    renderers = ("gl", "tiny") if gl_works() else ("tiny",)
    with Simulation(world, robot, plan.stops[0].pose, textured=True) as simulation:
        eyes = {name: open_renderer(name, simulation) for name in renderers}
        pair, _ = look(simulation, eyes[renderers[0]])

        def evolution(**parameters):
            params = FlyParams(**parameters)
            return timed(lambda: evolve(pair, params, rng=np.random.default_rng(1)))

        show(
            f"{scenario}: one evolution",
            {
                "3000 flies, set C, 4 regions": evolution(population=3000, operators="C"),
                "5000 flies, set A, 4 regions": evolution(population=5000, operators="A"),
                "5000 flies, set A, 1 region": evolution(population=5000, operators="A", regions=1),
                "5000 flies, set A, fitness=paper": evolution(population=5000, operators="A", fitness="paper"),
            },
        )
        show(
            f"{scenario}: one stereo pair, 2 x 640x480",
            {name: timed(lambda eye=eye: look(simulation, eye)) for name, eye in eyes.items()},
        )
        here = plan.model_copy(update={"stops": plan.stops[:1]})
        show(
            f"{scenario}: one stop, no way to drive",
            {
                name: timed(lambda eye=eye: list(looks_of(here, simulation, eye, np.random.default_rng(1))))
                for name, eye in eyes.items()
            },
        )
        for eye in eyes.values():
            eye.close()


if __name__ == "__main__":
    threads = os.environ.get("NUMBA_NUM_THREADS", os.cpu_count())
    print(f"{platform.machine()}, {os.cpu_count()} cores, {threads} threads, Python {platform.python_version()}")
    print(f"medians of up to {REPEATS} calls after one that does not count")
    for name in SCENARIOS:
        bench(name)
