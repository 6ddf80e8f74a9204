"""The fly algorithm: a population of 3-D points bred until it sits on what both cameras see (paper, section 3.1)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.flies import fitness, operators
from flysim.flies.carry import Carried
from flysim.flies.compared import Compared, compare
from flysim.flies.generation import BLOCK, Draws, Population, Selection, Workspace, generation
from flysim.flies.parameters import FlyParams
from flysim.flies.regions import equal_quotas, rectangles, split, steered_quotas
from flysim.flies.rules import rules_of
from flysim.flies.state import FLY, REGION
from flysim.flies.survivors import survivors
from flysim.flies.threads import share
from flysim.geometry.rig import ImagePair
from flysim.products.swarm import Generation, Swarm
from flysim.stereo.views import prepare

Search = Callable[..., Any]  # a kernel: lane, counters, views, rules, measure, pixels, genes, fitness


def evolve(
    pair: ImagePair,
    params: FlyParams,
    *,
    rng: np.random.Generator,
    compared: Compared | None = None,
    carried: Carried | None = None,
    exact: bool = True,
) -> Swarm:
    """Lets a swarm of flies evolve onto what both cameras see.

    Args:
        pair: two 8-bit RGB images and their rig.
        params: how it evolves.
        rng: the only source of randomness; the same state gives the same swarm on any number of threads.
        compared: what `compare` made of the pair, for whoever evolves on one pair more than once.
        carried: flies of an earlier pair that the first generation preserves and breeds from, where it would else be
            all immigrants; as many as there are places.
        exact: place the flies once more, by grey levels, where derivatives were compared; not for whoever only asks
            about where they are.

    Returns:
        The preserved flies that are settled; empty, with a reason, where nothing could settle.

    Raises:
        ValueError: the images are smaller than the window.
    """
    _check_size(pair, params)
    compared = compared or compare(pair, params)
    evolution = _Evolution(pair, compared, params, np.uint64(rng.integers(0, 2**63)))
    if carried is not None:
        evolution.begin_with(carried)
    history: list[Generation] = []
    converged = False
    while not converged and len(history) < params.max_iterations:
        history.append(evolution.step(len(history)))
        converged = _calm(history, params)
    return evolution.harvest(tuple(history), converged, exact=exact)


def settled(pair: ImagePair, params: FlyParams, search: Search, pixels: NDArray[np.int32]) -> Swarm:
    """What another search than evolution finds, put through the same tests as flies at the end, fittest first.

    Args:
        pair: as `evolve`.
        params: as `evolve`; what breeds is not read.
        search: fills genes and fitness of the pixels, as `exhaustive.search` does.
        pixels: `[N, 2]` left pixels u, v, a window and two pixels away from the border.

    Raises:
        ValueError: the images are smaller than the window.
    """
    _check_size(pair, params)
    evolution = _Evolution(pair, compare(pair, params), params, np.uint64(0))
    genes, found = np.zeros((len(pixels), 3), np.float32), np.zeros(len(pixels), np.float32)
    taken = np.zeros(1, np.int64)
    share(search, taken, evolution.record, evolution.rules, evolution.measure, pixels, genes, found)
    keep = np.flatnonzero(found >= evolution.settled)
    keep = keep[np.argsort(-found[keep], kind="stable")]
    return survivors(pair, evolution.compared, params, evolution.rules, pixels[keep], genes[keep], found[keep])[0]


def _calm(history: list[Generation], params: FlyParams) -> bool:
    """Whether the share `stop` of the settled flies of now were there some generations ago: the number has levelled."""
    now, calm = history[-1].settled, params.search.calm
    levelled = len(history) > calm and history[-1 - calm].settled >= params.stop * now
    return params.stop < 1.0 and now >= params.search.start and levelled


def _check_size(pair: ImagePair, params: FlyParams) -> None:
    for side, camera in (("left", pair.rig.left), ("right", pair.rig.right)):
        # One pixel more on every side: slopes and interpolation read it.
        if min(camera.width, camera.height) < params.window + 3:
            raise ValueError(
                f"the {side} image is {camera.width}x{camera.height} px, too small for a window of {params.window} px"
            )


class _Layout:
    """What is the same for all pairs of one size that flies evolve on by the same parameters. Nobody writes to it."""

    def __init__(self, params: FlyParams, width: int, height: int, gain: float) -> None:
        n = params.population
        self.rects = rectangles(width, height, params.regions)
        self.cell = params.cell(width, height)
        self.measure = fitness.plugged(params.fitness)
        given = params.settled_fitness
        self.settled: float = self.measure.what.settled if given is None else given
        self.equal = equal_quotas(n, len(self.rects))
        self.shares = np.array(params.shares)
        strength = params.sharing_strength
        ranks = np.arange(1, n + 1, dtype=np.float64)
        self.weights = (ranks**-strength if strength > 0.0 else np.empty(0)).astype(np.float32)
        # A region has at most two columns and two rows of cells more than whole ones: those its borders cut.
        sides = (self.rects[:, 1::2] - self.rects[:, ::2]) // self.cell + 2
        self.cells = len(self.rects), int(sides.prod(axis=1).max()) + 1
        norm = self.measure.what.norm
        self.rules = rules_of(params, norm=norm, settled=self.settled, cell=self.cell, gain=gain)
        self.operators = (
            operators.plugged("crossover", params.crossover),
            operators.plugged("mutation", params.mutation),
        )
        self.enough = max(params.search.saturation * self.settled, 1e-6)


_layout = lru_cache(maxsize=16)(_Layout)


class _Evolution:
    """The state of one evolution and its generation step."""

    def __init__(self, pair: ImagePair, compared: Compared, params: FlyParams, seed: np.uint64) -> None:
        self.pair, self.rig, self.params, self.seed = pair, pair.rig, params, seed
        self.compared, views = compared, compared.views
        # A plain array: a recarray is slow to hand to a kernel, and slow to read.
        self.record = views.record.view(np.ndarray)
        width, height, n = pair.rig.left.width, pair.rig.left.height, params.population
        layout = _layout(params, width, height, float(self.record["gain"][0]))
        self.settled, self.rules, rects = layout.settled, layout.rules, layout.rects
        self.measure, self.operators = layout.measure, layout.operators
        self.selection = Selection(layout.cell, layout.weights, layout.enough, layout.settled)
        self.quotas = layout.equal, steered_quotas(n, views.grey_left, rects)
        self.counts = np.array([split(int(quota), layout.shares)[:3] for quota in self.quotas[1]], dtype=np.int64)
        self.regions = np.zeros(len(rects), REGION)
        for k, name in enumerate(("u0", "u1", "v0", "v1")):
            self.regions[name] = rects[:, k]
        self.regions["places"] = self.counts[:, 0]
        self.regions["parents"] = np.cumsum(self.counts[:, 0]) - self.counts[:, 0]
        self.parents = np.zeros(int(self.counts[:, 0].sum()), np.int32)
        self.flies, self.next = np.zeros(n, FLY), np.zeros(n, FLY)
        self.scratch = Workspace(np.empty(n, np.uint64), np.empty(n, np.int32), np.empty(layout.cells, np.int32))
        self.begun = False  # whether there are flies before the first generation

    def begin_with(self, carried: Carried) -> None:
        """Flies that the first generation evaluates and breeds from."""
        edge = self.params.window // 2 + 1
        (u, v), q = carried.pixels.T, carried.genes[:, 0]
        inside = (u >= edge) & (v >= edge) & (u < self.rig.left.width - edge) & (v < self.rig.left.height - edge)
        keep = np.flatnonzero(inside & (q >= 1.0 / self.params.max_depth) & (q <= 1.0 / self.params.min_depth))
        slot = 0
        for region in self.regions:
            mine = keep[(u[keep] >= region["u0"]) & (u[keep] < region["u1"])]
            mine = mine[(v[mine] >= region["v0"]) & (v[mine] < region["v1"])][: int(region["places"])]
            flies = self.flies[slot : slot + len(mine)]
            for name, values in zip(("u", "v", "q", "qu", "qv"), (u, v, *carried.genes.T), strict=True):
                flies[name] = values[mine]
            self.parents[region["parents"] : region["parents"] + len(mine)] = np.arange(slot, slot + len(mine))
            region["kept"] = len(mine)
            slot += len(mine)
        self.begun = slot > 0

    def step(self, number: int) -> Generation:
        """Breeds a generation, evaluates it, selects; the first one is all immigrants, but for carried flies."""
        regions, bred = self.regions, number > 0 or self.begun
        quotas = self.quotas[int(bred)]
        if number < 2:
            regions["last"] = np.cumsum(quotas)
            regions["first"] = regions["last"] - quotas
            self.todo = np.concatenate([[0], np.maximum(-(-quotas // BLOCK), 1)])
        if bred and number < 2:
            regions["crossed"], regions["mutated"] = self.counts[:, 1], self.counts[:, 2]
        population = Population(regions, self.parents, self.flies, self.next)
        share(
            generation, self.todo.copy(), self.record, self.rules, self.measure, *self.operators,
            Draws(self.seed, number), population, self.selection, self.scratch,
        )  # fmt: skip
        self.flies, self.next = self.next, self.flies
        return Generation(
            best=float(regions["best"].max()),
            mean=float(regions["total"].sum() / max(int(regions["kept"].sum()), 1)),
            settled=float(regions["settled"].sum() / max(len(self.parents), 1)),
            regions=tuple(quotas.tolist()),
        )

    def harvest(self, history: tuple[Generation, ...], converged: bool, *, exact: bool) -> Swarm:
        """The settled survivors at sub-pixel depth, checked, fittest first."""
        now = self.flies
        keep = np.concatenate([self.parents[r["parents"] : r["parents"] + r["kept"]] for r in self.regions])
        keep = np.sort(keep[now["fitness"][keep] >= self.settled])
        keep = keep[np.argsort(-now["fitness"][keep], kind="stable")]
        pixels = np.stack([now["u"][keep], now["v"][keep]], axis=1)
        genes = np.stack([now["q"][keep], now["qu"][keep], now["qv"][keep]], axis=1, dtype=np.float64)
        found = pixels, genes, now["fitness"][keep]
        swarm, good = survivors(self.pair, self.compared, self.params, self.rules, *found, exact=exact)
        keep = keep[good]
        bred = len(history) * self.params.population - (len(history) - 1) * len(self.parents)
        return replace(
            swarm,
            region=np.searchsorted(self.regions["last"], keep, side="right").astype(np.int32),
            age=now["age"][keep],
            history=history,
            converged=converged,
            evaluations=bred,
            reason=self._reason(swarm, history, converged),
        )

    def _reason(self, swarm: Swarm, history: tuple[Generation, ...], converged: bool) -> str:
        """What was found, what was dropped and why, in one sentence."""
        flies, settled = len(swarm.points), len(swarm.points) + sum(swarm.dropped.values())
        if settled == 0:
            none = f"no fly settled in {len(history)} generations"
            contrast = prepare(self.pair).contrast()
            if contrast < 1.0:
                return f"{none}: the left image holds no contrast along the epipolar lines"
            return (
                f"{none}: slopes along the epipolar lines reach {contrast:.0f} grey levels a pixel, but none has its "
                f"like in the right image at a depth of {self.params.min_depth:g} to {self.params.max_depth:g} m"
            )
        dropped = ", ".join(f"{count} by {test}" for test, count in swarm.dropped.items())
        if flies == 0:
            return f"all {settled} flies that settled were dropped: {dropped}"
        end = f"the limit of {len(history)} generations came first"
        if converged:
            end = f"the number of settled flies levelled out after {len(history)} generations"
        return end + (f"; of {settled} dropped: {dropped}" if dropped else "")
