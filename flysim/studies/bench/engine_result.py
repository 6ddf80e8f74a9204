"""What `flysim bench engine` measured, as a record, as JSON and as tables."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from flysim.common.sheet import Sheet, number, percent
from flysim.studies.bench.picture import write_sizes

JSON_FILE, PICTURE_FILE = "bench.json", "sizes.png"


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyFlies:
    """An obstacle of the scene: its distance and the width seen of it [m], and the flies on it."""

    name: str
    distance_m: float
    width_m: float
    flies: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SizeResult:
    """One image size: the default engine beside the rivals, medians over the repeats. None: nothing to measure.

    Attributes:
        width: [px]
        height: [px]
        iterations: generations until the swarm converged.
        flies: in the swarm.
        flies_ms: an evolution, image preparation included.
        evolve_ms: the evolution alone.
        sgbm_ms: StereoSGBM, three-way, from RGB images to disparities.
        bm_ms: StereoBM, likewise.
        textured_cells: cells of the image that hold texture which both cameras see within the depths searched.
        coverage: share of them in which a fly sits.
        flies_within_0_5px: share of the flies whose disparity is that close to the truth; likewise the others.
        sgbm_within_0_5px: share of the pixels that it gives, of those that both cameras see; likewise the others.
        sgbm_density: share of the pixels that both cameras see for which it gives a disparity.
        bodies: obstacles in view.
    """

    width: int
    height: int
    iterations: float
    flies: float
    flies_ms: float
    evolve_ms: float
    sgbm_ms: float
    bm_ms: float
    textured_cells: int
    coverage: float | None
    flies_within_0_5px: float | None
    flies_within_1px: float | None
    sgbm_within_0_5px: float | None
    sgbm_within_1px: float | None
    bm_within_0_5px: float | None
    bm_within_1px: float | None
    sgbm_density: float | None
    bm_density: float | None
    bodies: tuple[BodyFlies, ...]

    def to_json(self) -> dict[str, Any]:
        """All attributes, and the flies' time as a share of each rival's."""
        ratios = {"flies_over_sgbm": self.flies_ms / self.sgbm_ms, "flies_over_bm": self.flies_ms / self.bm_ms}
        return {**asdict(self), **ratios}


@dataclass(frozen=True, slots=True, kw_only=True)
class EngineBench:
    """How fast the engine is, and beside what.

    Attributes:
        machine: what it ran on.
        renderer: what drew the scene.
        repeats: rounds that counted.
        threads: that flies and rivals alike ran on.
        params: the flies' parameters but where a figure says otherwise.
        ns_per_evaluation: threads -> [ns] of a generation's time for each of its evaluations.
        ms_per_generation: threads -> population -> [ms].
        cells: each cell of the paper's Table 1: `set`, `population`, `regions`, `stop` [%], `iterations`, `ms` of the
            evolution alone, `paper_ms`, `times_faster`.
        sizes: one entry an image size.
    """

    machine: Mapping[str, Any]
    renderer: str
    repeats: int
    threads: int
    params: Mapping[str, Any]
    ns_per_evaluation: Mapping[int, float]
    ms_per_generation: Mapping[int, Mapping[int, float]]
    cells: tuple[Mapping[str, Any], ...]
    sizes: tuple[SizeResult, ...]

    def to_json(self) -> dict[str, Any]:
        """Plain data. `ms_per_generation` is that of the most threads; that of each is beside it."""
        by_threads = {
            str(threads): {str(population): ms for population, ms in row.items()}
            for threads, row in self.ms_per_generation.items()
        }
        return {
            "machine": dict(self.machine),
            "renderer": self.renderer,
            "repeats": self.repeats,
            "threads": self.threads,
            "params": dict(self.params),
            "ns_per_evaluation": {str(threads): ns for threads, ns in self.ns_per_evaluation.items()},
            "ms_per_generation": by_threads[str(max(self.ms_per_generation))],
            "ms_per_generation_by_threads": by_threads,
            "cells": [dict(cell) for cell in self.cells],
            "sizes": [size.to_json() for size in self.sizes],
        }

    def write(self, folder: Path) -> None:
        """`bench.json` and `sizes.png` into an existing folder.

        Raises:
            OSError: the disk is full or refuses.
        """
        text = json.dumps(self.to_json(), indent=1, allow_nan=False)
        (folder / JSON_FILE).write_text(text + "\n", encoding="utf-8")
        write_sizes(folder / PICTURE_FILE, self.to_json()["sizes"])

    def sheets(self) -> tuple[Sheet, ...]:
        """The tables a person reads."""
        return _generations(self), _cells(self), _times(self), _accuracy(self)


def _generations(bench: EngineBench) -> Sheet:
    populations = list(next(iter(bench.ms_per_generation.values())))
    return Sheet(
        title="A generation",
        columns=("threads", "ns an evaluation", *(f"ms, {n} flies" for n in populations)),
        rows=tuple(
            (str(threads), number(bench.ns_per_evaluation[threads], 0), *(number(row[n], 2) for n in populations))
            for threads, row in bench.ms_per_generation.items()
        ),
        note="Breeding, evaluation and selection; without what an evolution does once.",
    )


def _cells(bench: EngineBench) -> Sheet:
    return Sheet(
        title="The paper's Table 1, the evolution alone",
        columns=("set", "flies", "regions", "stop", "generations", "ms", "paper ms", "times faster"),
        rows=tuple(
            (
                cell["set"],
                str(cell["population"]),
                str(cell["regions"]),
                f"{cell['stop']} %",
                number(cell["iterations"], 0),
                number(cell["ms"]),
                number(cell["paper_ms"], 0),
                number(cell["times_faster"], 0),
            )
            for cell in bench.cells
        ),
    )


def _times(bench: EngineBench) -> Sheet:
    return Sheet(
        title=f"An image pair, {bench.threads} threads, ms",
        columns=("size", "flies", "of that evolution", "SGBM 3WAY", "BM", "flies / SGBM", "flies / BM"),
        rows=tuple(
            (
                f"{size.width}x{size.height}",
                number(size.flies_ms),
                number(size.evolve_ms),
                number(size.sgbm_ms),
                number(size.bm_ms),
                number(size.flies_ms / size.sgbm_ms, 3),
                number(size.flies_ms / size.bm_ms, 3),
            )
            for size in bench.sizes
        ),
    )


def _accuracy(bench: EngineBench) -> Sheet:
    names = [body.name for body in bench.sizes[0].bodies]
    return Sheet(
        title="How good",
        columns=(
            *("size", "flies", "coverage", "flies 0.5 px", "1 px", "SGBM 0.5 px", "1 px", "BM 0.5 px", "1 px"),
            *(f"flies on {name}" for name in names),
        ),
        rows=tuple(
            (
                f"{size.width}x{size.height}",
                number(size.flies, 0),
                percent(size.coverage),
                percent(size.flies_within_0_5px),
                percent(size.flies_within_1px),
                percent(size.sgbm_within_0_5px),
                percent(size.sgbm_within_1px),
                percent(size.bm_within_0_5px),
                percent(size.bm_within_1px),
                *(number(body.flies, 0) for body in size.bodies),
            )
            for size in bench.sizes
        ),
        note="Shares within so much of the true disparity: of all flies; of the pixels a rival gives and both see. "
        + " ".join(f"{b.name}: {b.width_m:.2f} m wide, {b.distance_m:.1f} m away." for b in bench.sizes[0].bodies),
    )
