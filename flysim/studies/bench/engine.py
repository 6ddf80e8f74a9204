"""How fast the engine is: a generation, the paper's Table 1, and beside dense matchers at four image sizes."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, astuple
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.common.progress import Progress, silent
from flysim.engines.dense import Method, dense
from flysim.flies.compared import Compared, compare
from flysim.flies.evolution import evolve
from flysim.flies.parameters import FlyParams
from flysim.flies.threads import lanes, limited
from flysim.geometry.rig import ImagePair
from flysim.products.swarm import Swarm
from flysim.render.choose import RendererName
from flysim.studies.bench import quality
from flysim.studies.bench.engine_result import BodyFlies, EngineBench, SizeResult
from flysim.studies.bench.scene import Scene, Size, scenes
from flysim.studies.bench.timing import Done, Timed, interleaved
from flysim.studies.machine import machine
from flysim.studies.table1.grid import Cell
from flysim.studies.table1.published import PUBLISHED

SIZES: tuple[Size, ...] = ((320, 240), (640, 480), (1280, 720), (1920, 1080))
POPULATIONS = (3000, 5000, 10000)
THREADS = (1, 2)
METHODS: tuple[Method, ...] = ("sgbm", "bm")
REPEATS = 9
# A generation's time is the difference between a long and a short evolution over that of their generations: what an
# evolution does once falls out. Both are past the first generation, which evaluates everybody.
SHORT, LONG = 4, 20
# Shares of the whole that are done once the scenes are drawn, the sizes, the generations measured.
DRAWN, SIZED, GENERATED = 0.1, 0.6, 0.8


def bench_engine(
    *,
    repeats: int = REPEATS,
    renderer: RendererName = "auto",
    sizes: Sequence[Size] = SIZES,
    populations: Sequence[int] = POPULATIONS,
    reference: Size = (640, 480),
    progress: Progress | None = None,
) -> EngineBench:
    """Measures everything in this process, calls in turn, medians.

    Args:
        repeats: rounds that count, after one that does not.
        renderer: what draws the scene.
        sizes: images [px] on which flies and dense matchers meet.
        populations: flies whose generations are timed.
        reference: size [px] of the images of generations and of Table 1.
        progress: called with what is going on and the share that is done.

    Raises:
        FlysimError: the renderer cannot draw here.
        ValueError: fewer than one repeat, or no size or population.
    """
    if not sizes or not populations:
        raise ValueError(f"sizes and populations must not be empty, got {sizes} and {populations}")
    told = progress or silent
    told("draw the scene", 0.0)
    (first, *drawn), drawn_by = scenes((reference, *sizes), renderer)
    by_size = _sizes(drawn, repeats, lambda share: told("image sizes", DRAWN + (SIZED - DRAWN) * share))
    generations, evaluations = _generations(
        first.pair, populations, repeats, lambda share: told("generations", SIZED + (GENERATED - SIZED) * share)
    )
    cells = _cells(first.pair, range(repeats), lambda share: told("Table 1", GENERATED + (1.0 - GENERATED) * share))
    return EngineBench(
        machine=machine(),
        renderer=drawn_by,
        repeats=repeats,
        threads=lanes(),
        params=asdict(FlyParams()),
        ns_per_evaluation=evaluations,
        ms_per_generation=generations,
        cells=tuple(cells),
        sizes=tuple(by_size),
    )


def _sizes(drawn: Sequence[Scene], repeats: int, done: Done) -> list[SizeResult]:
    """Flies, their evolution alone and the dense matchers, all sizes in turn, on equally many threads."""
    params, threads = FlyParams(), lanes()
    found: dict[tuple[int, Method], NDArray[np.float32]] = {}  # the last of each: they are all the same
    works: dict[tuple[int, str], Callable[[int], Swarm | None]] = {}
    for k, scene in enumerate(drawn):
        works[k, "flies"] = _evolution(scene.pair, params)
        works[k, "evolve"] = _evolution(scene.pair, params, compare(scene.pair, params))
        for method in METHODS:

            def match(_turn: int, k: int = k, pair: ImagePair = scene.pair, method: Method = method) -> None:
                found[k, method] = dense(
                    pair, method, min_depth=params.min_depth, max_depth=params.max_depth, threads=threads
                )

            works[k, method] = match
    timed = interleaved(works, repeats, done)
    return [
        _size(
            scene,
            params,
            {name: timed[k, name] for name in ("flies", "evolve", *METHODS)},
            {method: found[k, method] for method in METHODS},
        )
        for k, scene in enumerate(drawn)
    ]


def _evolution(pair: ImagePair, params: FlyParams, compared: Compared | None = None) -> Callable[[int], Swarm]:
    """An evolution whose seed is the number of its round."""
    return lambda turn: evolve(pair, params, rng=np.random.default_rng(turn), compared=compared)


def _size(
    scene: Scene, params: FlyParams, timed: dict[str, Timed[Any]], found: dict[Method, NDArray[np.float32]]
) -> SizeResult:
    swarms: list[Swarm] = timed["flies"].results
    textured = quality.textured_cells(scene, min_depth=params.min_depth, max_depth=params.max_depth)
    flies = [_median(shares) for shares in zip(*(quality.flies_within(scene, swarm) for swarm in swarms), strict=True)]
    rivals = {
        method: [*quality.dense_within(scene, disparity), quality.dense_density(scene, disparity)]
        for method, disparity in found.items()
    }
    (sgbm_half, sgbm_one, sgbm_density), (bm_half, bm_one, bm_density) = (
        map(_finite, rivals[method]) for method in METHODS
    )
    width, height = scene.size
    return SizeResult(
        width=width,
        height=height,
        iterations=statistics.median(swarm.iterations for swarm in swarms),
        flies=statistics.median(len(swarm.points) for swarm in swarms),
        flies_ms=statistics.median(timed["flies"].ms),
        evolve_ms=statistics.median(timed["evolve"].ms),
        sgbm_ms=statistics.median(timed["sgbm"].ms),
        bm_ms=statistics.median(timed["bm"].ms),
        textured_cells=int(textured.sum()),
        coverage=_median(quality.coverage(textured, swarm) for swarm in swarms),
        flies_within_0_5px=flies[0],
        flies_within_1px=flies[1],
        sgbm_within_0_5px=sgbm_half,
        sgbm_within_1px=sgbm_one,
        bm_within_0_5px=bm_half,
        bm_within_1px=bm_one,
        sgbm_density=sgbm_density,
        bm_density=bm_density,
        bodies=tuple(
            BodyFlies(
                name=body.name,
                distance_m=body.distance,
                width_m=body.width,
                flies=statistics.median(quality.flies_on(scene, body, swarm) for swarm in swarms),
            )
            for body in scene.bodies
        ),
    )


def _generations(
    pair: ImagePair, populations: Sequence[int], repeats: int, done: Done
) -> tuple[dict[int, dict[int, float]], dict[int, float]]:
    """Threads -> population -> [ms] a generation; threads -> [ns] an evaluation, of about the default population."""
    threads = [count for count in THREADS if count <= lanes()]
    compared = compare(pair, FlyParams())
    works: dict[tuple[int, int, int], Callable[[int], Swarm]] = {}
    for count in threads:
        for population in populations:
            for generations in (SHORT, LONG):
                # All of them settled at once is what no swarm reaches: it runs to its last generation.
                params = FlyParams(population=population, stop=1.0, max_iterations=generations)
                evolution = _evolution(pair, params, compared)

                def run(turn: int, count: int = count, evolution: Callable[[int], Swarm] = evolution) -> Swarm:
                    with limited(count):
                        return evolution(turn)

                works[count, population, generations] = run
    timed = interleaved(works, repeats, done)
    typical = min(populations, key=lambda population: abs(population - FlyParams().population))
    ms = {
        count: {
            population: _slope(timed[count, population, SHORT], timed[count, population, LONG], _iterations)
            for population in populations
        }
        for count in threads
    }
    ns = {
        count: 1e6 * _slope(timed[count, typical, SHORT], timed[count, typical, LONG], _evaluations)
        for count in threads
    }
    return ms, ns


def _slope(short: Timed[Swarm], long: Timed[Swarm], count: Callable[[Swarm], int]) -> float:
    """Median time [ms] of one of what `count` counts, from a short and a long evolution of each round."""
    slopes = []
    for a, b, before, after in zip(short.ms, long.ms, short.results, long.results, strict=True):
        more = count(after) - count(before)
        # Where nothing can settle both may end at once: then the whole time is all there is to divide.
        slopes.append((b - a) / more if more > 0 else b / max(count(after), 1))
    return statistics.median(slopes)


def _iterations(swarm: Swarm) -> int:
    return swarm.iterations


def _evaluations(swarm: Swarm) -> int:
    return swarm.evaluations


def _cells(pair: ImagePair, seeds: Sequence[int], done: Done | None = None) -> list[dict[str, Any]]:
    """Every cell of the paper's Table 1: set, population, regions, stop, iterations, ms, paper_ms, times_faster."""
    compared = compare(pair, FlyParams())

    def work(cell: Cell) -> Callable[[int], Swarm]:
        params = cell.params(FlyParams())
        return lambda turn: evolve(pair, params, rng=np.random.default_rng(seeds[turn]), compared=compared)

    timed = interleaved({cell: work(cell) for cell in PUBLISHED}, len(seeds), done)
    rows = []
    for cell, paper in PUBLISHED.items():
        ms = statistics.median(timed[cell].ms)
        rows.append(
            {
                **dict(zip(("set", "population", "regions", "stop"), astuple(cell), strict=True)),
                "iterations": statistics.median(swarm.iterations for swarm in timed[cell].results),
                "ms": ms,
                "paper_ms": paper.ms,
                "times_faster": paper.ms / ms,
            }
        )
    return rows


def _median(values: Iterable[float]) -> float | None:
    """Of those that are numbers; None where none is."""
    numbers = [value for value in values if math.isfinite(value)]
    return statistics.median(numbers) if numbers else None


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
