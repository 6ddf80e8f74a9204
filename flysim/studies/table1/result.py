"""What a run of Table 1 found, cell by cell, beside what the paper published."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.common.sheet import Sheet
from flysim.common.statistics import rank_correlation
from flysim.geometry.frames import frozen
from flysim.studies.table1.grid import FAVOURITES, Cell
from flysim.studies.table1.published import PUBLISHED, Published


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Example:
    """The swarm of a cell's first seed, for the pictures.

    Attributes:
        uv: `[N, 2]` float32 flies in the left image [px].
        on_object: `[N]` bool, within 2 cm of the object's visible surface.
        iterations: generations that ran.
    """

    uv: NDArray[np.float32]
    on_object: NDArray[np.bool_]
    iterations: int

    def __post_init__(self) -> None:
        for name in ("uv", "on_object"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellResult:
    """One setting over all seeds. A `ci95` is half the width of the mean's 95 % interval; None with one seed.

    Attributes:
        cell: the setting.
        iterations_mean: generations until the stop criterion, or the limit.
        iterations_ci95: generations.
        ms_mean: [ms] of evolution alone, without preparation of the images.
        ms_ci95: [ms]
        on_object: share of the swarm's flies within 2 cm of the object's visible surface, in [0, 1].
        on_surface: share within 2 cm of anything that both cameras saw, floor and walls included.
        flies: that the swarm held at the end.
        flies_on_object: how many of them were within 2 cm of the object's visible surface.
        flies_on_object_ci95: flies.
        converged: share of the seeds that reached the stop criterion before the limit of generations.
        on_front: no other cell costs as little and brings as many flies onto the object.
        example: the first seed's flies.
    """

    cell: Cell
    iterations_mean: float
    iterations_ci95: float | None
    ms_mean: float
    ms_ci95: float | None
    on_object: float
    on_surface: float
    flies: float
    flies_on_object: float
    flies_on_object_ci95: float | None
    converged: float
    on_front: bool
    example: Example

    @property
    def paper(self) -> Published:
        """What the paper published for this setting."""
        return PUBLISHED[self.cell]

    @property
    def speedup(self) -> float:
        """How many times faster than published."""
        return self.paper.ms / self.ms_mean

    def to_json(self) -> dict[str, Any]:
        """One of `cells[]`."""
        return {
            "set": self.cell.operators,
            "population": self.cell.population,
            "regions": self.cell.regions,
            "stop": self.cell.stop,
            "iterations_mean": self.iterations_mean,
            "iterations_ci95": self.iterations_ci95,
            "ms_mean": self.ms_mean,
            "ms_ci95": self.ms_ci95,
            "on_object": self.on_object,
            "paper_iterations": self.paper.iterations,
            "paper_ms": self.paper.ms,
            "speedup": self.speedup,
            "flies": self.flies,
            "flies_on_object": self.flies_on_object,
            "flies_on_object_ci95": self.flies_on_object_ci95,
            "on_surface": self.on_surface,
            "converged": self.converged,
            "on_front": self.on_front,
        }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Table1:
    """The whole table.

    Attributes:
        cells: in the order of the grid.
        seeds: evolutions of each.
        prepare_ms: [ms] that preparing the images takes, once a pair.
        renderer: "gl" or "tiny".
        scenario: whose first stop the pair shows.
        image: `[H, W, 3]` uint8, the left one.
        threads: that evolved.
        parameters: all of `FlyParams` that the grid does not vary.
        versions: Python and packages.
        commit: of the checkout; None where flysim is installed.
    """

    cells: tuple[CellResult, ...]
    seeds: int
    prepare_ms: float
    renderer: str
    scenario: str
    image: NDArray[np.uint8]
    threads: int
    parameters: dict[str, Any]
    versions: dict[str, str]
    commit: str | None

    @property
    def rank_correlation(self) -> dict[str, float | None]:
        """Spearman's, of iterations and milliseconds with those published; None where all cells are alike."""
        return {
            "iterations": rank_correlation(
                [one.iterations_mean for one in self.cells], [one.paper.iterations for one in self.cells]
            ),
            "ms": rank_correlation([one.ms_mean for one in self.cells], [one.paper.ms for one in self.cells]),
        }

    def of(self, cell: Cell) -> CellResult | None:
        """The result of a setting; None if it was not in the grid."""
        return next((one for one in self.cells if one.cell == cell), None)

    def beating(self, cell: Cell) -> tuple[CellResult, ...]:
        """The settings on the front that cost no more than this one and bring as many flies onto the object."""
        this = self.of(cell)
        if this is None or this.on_front:
            return ()
        return tuple(
            one
            for one in self.cells
            if one.on_front and one.ms_mean <= this.ms_mean and one.flies_on_object >= this.flies_on_object
        )

    def sheet(self) -> Sheet:
        """Each cell beside the paper's."""

        def spread(mean: float, ci95: float | None) -> str:
            return f"{mean:.1f}" if ci95 is None else f"{mean:.1f} ± {ci95:.1f}"

        rows = [
            (
                *(one.cell.operators, str(one.cell.population), str(one.cell.regions), f"{one.cell.stop}%"),
                *(spread(one.iterations_mean, one.iterations_ci95), str(one.paper.iterations)),
                *(spread(one.ms_mean, one.ms_ci95), str(one.paper.ms), f"{one.speedup:.0f}x"),
                f"{100 * one.on_object:.1f}%",
            )
            for one in self.cells
        ]
        columns = ("set", "flies", "reg.", "stop", "iterations", "paper", "ms", "paper", "faster", "on object")
        return Sheet(title="", columns=columns, rows=tuple(rows))

    def lines(self) -> list[str]:
        """What is true of the table as a whole, in words."""
        slowest = min(self.cells, key=lambda one: one.speedup)
        ranks = {key: "-" if value is None else f"{value:.2f}" for key, value in self.rank_correlation.items()}
        height, width = self.image.shape[:2]
        means = "One seed" if self.seeds == 1 else f"Means of {self.seeds} seeds with half their 95 % intervals"
        found = [
            "",
            f"{means}; on object: share of the flies within 2 cm of it.",
            f"{width}x{height} px, {self.renderer}, {self.threads} threads; preparing the pair takes "
            f"{self.prepare_ms:.1f} ms more, once.",
            f"rank correlation with the paper: iterations {ranks['iterations']}, ms {ranks['ms']}",
            f"faster than published: {slowest.speedup:.0f} times at least ({slowest.cell})",
        ]
        favourites = [cell for cell in FAVOURITES if self.of(cell) is not None]
        return found + [line for cell in favourites for line in self._verdict(cell)]

    def _verdict(self, cell: Cell) -> list[str]:
        """Whether the paper's favourite holds: its cost against the flies that it brings onto the object."""
        this, better = self.of(cell), self.beating(cell)
        assert this is not None
        head = f"the paper's best, {cell}: {this.ms_mean:.1f} ms, {this.flies_on_object:.0f} flies on the object"
        if not better:
            return [head, "  on average no setting beats it in both"]
        best = max(better, key=lambda one: one.flies_on_object)
        return [head, f"  on average beaten by {best.cell}: {best.ms_mean:.1f} ms, {best.flies_on_object:.0f} flies"]

    def to_json(self) -> dict[str, Any]:
        """What `table1.json` holds."""
        height, width = self.image.shape[:2]
        return {
            "prepare_ms": self.prepare_ms,
            "cells": [one.to_json() for one in self.cells],
            "rank_correlation": self.rank_correlation,
            "seeds": self.seeds,
            "renderer": self.renderer,
            "scenario": self.scenario,
            "width": width,
            "height": height,
            "threads": self.threads,
            "parameters": self.parameters,
            "versions": self.versions,
            "commit": self.commit,
        }
