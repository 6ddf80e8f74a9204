"""The paper's Table 1 again: every setting over many seeds on one rendered pair, each beside what was published.

Time is that of the evolution alone: the pair is prepared (gradients and the like) once. The cells are interleaved, each
seed going once through the whole grid in an order of its own, so that a machine that is busy for a while, or warms up,
slows all cells alike.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field

import numpy as np
from numpy.typing import NDArray

from flysim.common.progress import Progress, silent
from flysim.common.provenance import git_commit, versions
from flysim.common.statistics import front, mean_ci95
from flysim.evaluate.landing import Landing
from flysim.flies.compared import Compared, compare
from flysim.flies.evolution import evolve
from flysim.flies.parameters import FlyParams
from flysim.flies.threads import lanes
from flysim.products.swarm import Swarm
from flysim.render.choose import RendererName
from flysim.studies.table1.grid import GRID, VARIED, Cell
from flysim.studies.table1.pair import Rendered, render_pair
from flysim.studies.table1.result import CellResult, Example, Table1

RENDERED = 0.02  # share of the work that is done once the pair is there and the kernels are loaded


@dataclass(slots=True)
class _Runs:
    """What the evolutions of one cell gave, one entry a seed."""

    iterations: list[int] = field(default_factory=list)
    ms: list[float] = field(default_factory=list)
    converged: list[bool] = field(default_factory=list)
    flies: list[int] = field(default_factory=list)
    landed: list[int] = field(default_factory=list)  # on the object
    on_object: list[float] = field(default_factory=list)
    on_surface: list[float] = field(default_factory=list)
    example: Example | None = None  # the first seed's flies


def run_table1(
    *,
    seeds: int = 20,
    renderer: RendererName = "auto",
    grid: Sequence[Cell] = GRID,
    base: FlyParams | None = None,
    rendered: Rendered | None = None,
    progress: Progress | None = None,
) -> Table1:
    """Runs the grid on a pair of `paper`.

    Args:
        seeds: evolutions of each cell; seed k is the same random generator in all of them.
        renderer: "gl", "tiny", or "auto": gl where an OpenGL context opens.
        grid: the settings, of those that the paper published.
        base: all that the grid does not vary; the defaults where None.
        rendered: a pair that is there already; None renders the first stop of `paper_a`.
        progress: called with a word and a share as the work goes on.

    Raises:
        ValueError: no seed, or an empty grid.
        FlysimError: `gl` asked for where no context opens.
    """
    if seeds < 1:
        raise ValueError(f"seeds must be >= 1, got {seeds}")
    if not grid:
        raise ValueError("grid must hold a cell at least, got none")
    base, told = base or FlyParams(), progress or silent
    told("render the pair", 0.0)
    rendered = rendered or render_pair(renderer=renderer)
    ground = Landing.of(rendered.world, rendered.stop, base.max_depth)
    told("load the engine", RENDERED / 2)
    # One warm-up, of the largest swarm: kernels are compiled or loaded and threads started before any clock runs.
    largest = max(grid, key=lambda cell: cell.population)
    evolve(rendered.pair, largest.params(base), rng=np.random.default_rng(0))
    runs, preparing = {cell: _Runs() for cell in grid}, []
    for seed in range(seeds):
        told(f"seed {seed + 1} of {seeds}", RENDERED + (1.0 - RENDERED) * seed / seeds)
        began = time.perf_counter()
        compared = compare(rendered.pair, base)
        preparing.append(1e3 * (time.perf_counter() - began))
        swarms = _pass(rendered, compared, runs, base, seed)
        _judge(ground, swarms, runs)  # after the whole pass, so that it does not push the images out of the caches
    return Table1(
        cells=_results(runs),
        seeds=seeds,
        prepare_ms=mean_ci95(preparing)[0],
        renderer=rendered.renderer,
        scenario=rendered.scenario,
        image=rendered.pair.left,
        threads=lanes(),
        parameters={key: value for key, value in asdict(base).items() if key not in VARIED},
        versions=versions(),
        commit=git_commit(),
    )


def _pass(
    rendered: Rendered, compared: Compared, runs: dict[Cell, _Runs], base: FlyParams, seed: int
) -> dict[Cell, Swarm]:
    """One evolution of every cell, timed."""
    grid, swarms = list(runs), {}
    for i in np.random.default_rng(seed).permutation(len(grid)).tolist():
        cell = grid[i]
        params, rng = cell.params(base), np.random.default_rng(seed)
        began = time.perf_counter()
        swarm = evolve(rendered.pair, params, rng=rng, compared=compared)
        runs[cell].ms.append(1e3 * (time.perf_counter() - began))
        runs[cell].iterations.append(swarm.iterations)
        runs[cell].converged.append(bool(swarm.converged))
        swarms[cell] = swarm
    return swarms


def _judge(ground: Landing, swarms: dict[Cell, Swarm], runs: dict[Cell, _Runs]) -> None:
    """Counts the flies of a pass that sit on what is there. All cells at once: a tree of the surface is built once."""
    ends = np.cumsum([len(swarm.points) for swarm in swarms.values()])[:-1]
    points = np.concatenate([swarm.points for swarm in swarms.values()])
    on_object, on_anything = (
        np.split(landed, ends) for landed in (ground.on_object(points), ground.on_anything(points))
    )
    for (cell, swarm), on, anywhere in zip(swarms.items(), on_object, on_anything, strict=True):
        run = runs[cell]
        run.flies.append(len(on))
        run.landed.append(int(on.sum()))
        run.on_object.append(_share(on))
        run.on_surface.append(_share(anywhere))
        if run.example is None:
            run.example = Example(uv=np.asarray(swarm.uv), on_object=on, iterations=swarm.iterations)


def _share(landed: NDArray[np.bool_]) -> float:
    return float(landed.mean()) if len(landed) else 0.0  # a swarm without a fly has none on the object


def _results(runs: dict[Cell, _Runs]) -> tuple[CellResult, ...]:
    unbeaten = front(
        [mean_ci95(run.ms)[0] for run in runs.values()], [mean_ci95(run.landed)[0] for run in runs.values()]
    )
    results = []
    for i, (cell, run) in enumerate(runs.items()):
        assert run.example is not None
        iterations, ms, landed = mean_ci95(run.iterations), mean_ci95(run.ms), mean_ci95(run.landed)
        results.append(
            CellResult(
                cell=cell,
                iterations_mean=iterations[0],
                iterations_ci95=iterations[1],
                ms_mean=ms[0],
                ms_ci95=ms[1],
                on_object=float(np.mean(run.on_object)),
                on_surface=float(np.mean(run.on_surface)),
                flies=float(np.mean(run.flies)),
                flies_on_object=landed[0],
                flies_on_object_ci95=landed[1],
                converged=float(np.mean(run.converged)),
                on_front=i in unbeaten,
                example=run.example,
            )
        )
    return tuple(results)
