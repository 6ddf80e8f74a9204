"""The fly algorithm: a population of 3-D points bred until it sits on what both cameras see (paper, section 3.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flysim.flies.finish import finish, honest
from flysim.flies.generation import breed
from flysim.flies.operators import CROSSOVER, IMMIGRATION, MUTATION
from flysim.flies.parameters import FlyParams
from flysim.flies.regions import equal_quotas, rectangles, split, steered_quotas
from flysim.flies.selection import select, shared_fitness
from flysim.flies.swarm import Generation, Swarm
from flysim.flies.views import Views, disparity_per_inverse_depth, prepare
from flysim.geometry.rig import ImagePair

# Times the settled fitness towards which fitness saturates in sharing. Measured on a render of `paper`: the preserved
# flies cover 5 to 10 % more of the image than without saturation.
ENOUGH = 1.5

# [px] of a refined fly. Measured on renders it is 0.02 to 0.05; 0.1 is the field's rule and holds for photographs.
DISPARITY_STD = 0.1


@dataclass(slots=True)
class _Population:
    """The flies of one generation, region by region, the preserved ones first in each."""

    pixels: NDArray[np.int32]  # [N, 2] left pixel u, v
    genes: NDArray[np.float32]  # [N, 3] inverse depth q [1/m] and its slopes qu, qv [1/m/px]
    fitness: NDArray[np.float32]
    region: NDArray[np.int32]
    age: NDArray[np.int32]


def evolve(pair: ImagePair, params: FlyParams, *, rng: np.random.Generator) -> Swarm:
    """Lets a swarm of flies evolve onto what both cameras see.

    Args:
        pair: two 8-bit RGB images and their rig.
        params: how it evolves.
        rng: the only source of randomness; the same state gives the same swarm on any number of threads.

    Returns:
        The preserved flies that are settled; empty, with a reason, where nothing could settle.

    Raises:
        ValueError: the images are smaller than the window.
    """
    _check_size(pair, params)
    views = prepare(pair, params.fitness)
    evolution = _Evolution(pair, views, params, np.uint64(rng.integers(0, 2**63)))
    history: list[Generation] = []
    converged = False
    while not converged and len(history) < params.max_iterations:
        history.append(evolution.step(len(history)))
        converged = history[-1].settled >= params.stop
    return evolution.harvest(tuple(history), converged)


def _check_size(pair: ImagePair, params: FlyParams) -> None:
    for side, camera in (("left", pair.rig.left), ("right", pair.rig.right)):
        # One pixel more on every side: slopes and interpolation read it.
        if min(camera.width, camera.height) < params.window + 3:
            raise ValueError(
                f"the {side} image is {camera.width}x{camera.height} px, too small for a window of {params.window} px"
            )


class _Evolution:
    """The state of one evolution and its generation step."""

    def __init__(self, pair: ImagePair, views: Views, params: FlyParams, seed: np.uint64) -> None:
        self.rig, self.views, self.params, self.seed = pair.rig, views, params, seed
        self.half = params.window // 2
        self.width, self.height = pair.rig.left.width, pair.rig.left.height
        self.rects = rectangles(self.width, self.height, params.regions)
        self.steered = steered_quotas(params.population, pair.left, self.rects)
        self.cell = params.cell(self.width, self.height)
        self.mutation = params.mutation_m if params.mutation == "metric" else params.mutation_px or self.cell
        self.q_near, self.q_far = 1.0 / params.min_depth, 1.0 / params.max_depth
        self.gain = disparity_per_inverse_depth(pair.rig)
        self.population = _empty(0)
        self.survivors: NDArray[np.int64] = np.empty(0, np.int64)

    def step(self, generation: int) -> Generation:
        """Breeds a generation, evaluates it, selects; the first one is all immigrants."""
        quotas = self.steered if generation else equal_quotas(self.params.population, self.params.regions)
        preserved, kept_by_region = self._kept(quotas)
        children = self._layout(quotas, kept_by_region)
        old, new = self.population, _empty(self.params.population)
        n = len(preserved)
        for name in ("pixels", "genes", "fitness", "region"):
            getattr(new, name)[:n] = getattr(old, name)[preserved]
        new.age[:n] = old.age[preserved] + 1
        kinds, regions = children
        new.region[n:] = regions[n:]
        first_parents = np.concatenate([[0], np.cumsum([len(k) for k in kept_by_region])]).astype(np.int64)
        params, views = self.params, self.views
        breed(
            views.left, views.right, views.grey_left, views.grey_right, views.gradient_left, views.gradient_right,
            views.to_right, views.shift, self.seed, generation, kinds, regions, preserved, first_parents, self.rects,
            old.pixels, old.genes, new.pixels, new.genes, new.fitness, n, self.half, (self.width, self.height),
            (self.rig.right.width, self.rig.right.height), self.q_near, self.q_far, self.gain, self.rig.left.K,
            params.mutation == "metric", float(self.mutation), params.mutation_disparity_px, params.slant,
            params.polish,
        )  # fmt: skip
        self.population = new
        return self._select(quotas)

    def _kept(self, quotas: NDArray[np.int64]) -> tuple[NDArray[np.int64], list[NDArray[np.int64]]]:
        """The last selection, cut to what each region may preserve of its present quota."""
        region = self.population.region[self.survivors]
        by_region = [self.survivors[region == r][: self._count(quota)[0]] for r, quota in enumerate(quotas)]
        return np.concatenate(by_region), by_region

    def _count(self, quota: int) -> NDArray[np.int64]:
        """Flies of a region that are preserved, crossed, mutated and immigrated; they sum to the quota."""
        return split(int(quota), np.array(self.params.shares))

    def _layout(
        self, quotas: NDArray[np.int64], kept: list[NDArray[np.int64]]
    ) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """What each slot is bred by, and its region: first all preserved flies, then the children by region."""
        kinds = [np.full(sum(len(k) for k in kept), -1, np.int32)]
        regions = [np.repeat(np.arange(len(kept), dtype=np.int32), [len(k) for k in kept])]
        for r, quota in enumerate(quotas):
            _, crossover, mutation, immigration = self._count(quota)
            # Slots that selection could not fill with flies in view go to immigrants.
            immigration = int(quota) - len(kept[r]) - crossover - mutation
            kinds.append(
                np.repeat(np.array([CROSSOVER, MUTATION, IMMIGRATION], np.int32), [crossover, mutation, immigration])
            )
            regions.append(np.full(crossover + mutation + immigration, r, np.int32))
        return np.concatenate(kinds), np.concatenate(regions)

    def _select(self, quotas: NDArray[np.int64]) -> Generation:
        now, params = self.population, self.params
        shared = shared_fitness(
            now.pixels,
            now.fitness,
            self.cell,
            self.width,
            params.sharing_strength,
            max(ENOUGH * params.settled_fitness, 1e-6),
        )
        chosen = [
            select(shared, np.flatnonzero(now.region == r), int(self._count(quota)[0]))
            for r, quota in enumerate(quotas)
        ]
        self.survivors = np.concatenate(chosen)
        fitness = now.fitness[self.survivors]
        fit = fitness >= self.params.settled_fitness
        places = max(int(sum(self._count(quota)[0] for quota in quotas)), 1)
        return Generation(
            best=float(fitness.max(initial=0.0)),
            mean=float(fitness.mean()) if len(fitness) else 0.0,
            settled=float((fit & (now.age[self.survivors] >= 1)).sum() / places),
            regions=tuple(int((now.region == r).sum()) for r in range(len(quotas))),
        )

    def harvest(self, history: tuple[Generation, ...], converged: bool) -> Swarm:
        """The settled survivors at sub-pixel depth, checked, fittest first."""
        now, views = self.population, self.views
        keep = self.survivors[now.fitness[self.survivors] >= self.params.settled_fitness]
        keep = keep[np.argsort(-now.fitness[keep], kind="stable")]
        pixels, genes = now.pixels[keep], now.genes[keep].astype(np.float64)
        own, unique = np.empty(len(keep), np.float32), np.empty(len(keep), np.bool_)
        energy = np.empty((len(keep), 2), np.float32)
        finish(
            views.left, views.right, views.grey_left, views.grey_right, views.gradient_left, views.to_right,
            views.shift, pixels, genes, own, energy, unique, self.half, self.q_near, self.q_far, self.gain,
            self.params.slant > 0.0, self.params.uniqueness,
        )  # fmt: skip
        good = unique & honest(own, energy, self.params.misfit)
        keep, pixels, genes = keep[good], pixels[good], genes[good]
        homogeneous = np.c_[pixels, np.ones(len(pixels))] @ views.to_right.T + genes[:, :1] * views.shift
        uv = pixels.astype(np.float32)
        points = self.rig.left.unproject(pixels, 1.0 / genes[:, 0])
        return Swarm(
            points=points.astype(np.float32),
            normals=self._normals(pixels, genes),
            spread=(points * (DISPARITY_STD / (self.gain * genes[:, :1]))).astype(np.float32),
            patches=self._patches(pixels, genes),
            fitness=now.fitness[keep],
            uv=uv,
            uv_right=(homogeneous[:, :2] / homogeneous[:, 2:]).astype(np.float32),
            region=now.region[keep],
            age=now.age[keep],
            history=history,
            converged=converged,
            reason=self._reason(len(keep), len(history), converged),
        )

    def _normals(self, pixels: NDArray[np.int32], genes: NDArray[np.float64]) -> NDArray[np.float32]:
        """`[N, 3]` unit normals: a plane n . p = 1 has the inverse depth n . (x / z, y / z, 1)."""
        camera = self.rig.left
        a, b = genes[:, 1] * camera.fx, genes[:, 2] * camera.fy
        c = genes[:, 0] - a * (pixels[:, 0] - camera.cx) / camera.fx - b * (pixels[:, 1] - camera.cy) / camera.fy
        n = -np.stack([a, b, c], axis=1)
        return (n / np.linalg.norm(n, axis=1, keepdims=True)).astype(np.float32)

    def _patches(self, pixels: NDArray[np.int32], genes: NDArray[np.float64]) -> NDArray[np.float32]:
        """`[N, 4, 3]` corners of the surface under each window, on the fly's plane."""
        reach = max(self.half - 1, 0)
        offsets = reach * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
        q = genes[:, :1] + genes[:, 1:] @ offsets.T
        uv = pixels[:, None, :] + offsets[None]
        # A plane that runs to infinity within the window has no patch: its corners stay at the fly's depth.
        q = np.where(q > 0.5 * genes[:, :1], q, genes[:, :1])
        return self.rig.left.unproject(uv, 1.0 / q).astype(np.float32)

    def _reason(self, flies: int, iterations: int, converged: bool) -> str:
        if flies == 0:
            return "no fly settled: the images hold no contrast along the epipolar lines that both cameras share"
        if converged:
            return f"{self.params.stop:.0%} of the preserved flies settled after {iterations} generations"
        return f"the limit of {iterations} generations came first"


def _empty(n: int) -> _Population:
    ints = [np.zeros(n, np.int32) for _ in range(2)]
    return _Population(
        np.zeros((n, 2), np.int32), np.zeros((n, 3), np.float32), np.zeros(n, np.float32), ints[0], ints[1]
    )
