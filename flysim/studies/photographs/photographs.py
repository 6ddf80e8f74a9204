"""Pairs with true disparities, seen by every engine, by the same scores."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from flysim.common.progress import Progress, silent
from flysim.common.sheet import Sheet
from flysim.engines.choose import warm
from flysim.errors import FlysimError
from flysim.evaluate.disparity_scores import MatchScores
from flysim.runs.photographs import SeeParams, see
from flysim.runs.sighting import scores_sheet
from flysim.studies.machine import machine
from flysim.studies.photographs.pairs import KnownPair


@dataclass(frozen=True, slots=True, kw_only=True)
class PhotographScores:
    """What every engine made of every pair.

    Attributes:
        suite: its name.
        engines: in the order of the tables.
        pairs: name -> engine -> scores.
        failed: name -> why it could not be seen, one line.
        seed: of all randomness.
    """

    suite: str
    engines: tuple[str, ...]
    pairs: dict[str, dict[str, MatchScores]]
    failed: dict[str, str]
    seed: int

    def to_json(self) -> dict[str, Any]:
        """`pairs` has a row a pair; figures are over pixels that both cameras see, `all_pixels` over all."""
        rows: list[dict[str, Any]] = [
            {"name": name, **{engine: one.to_json() for engine, one in scores.items()}}
            for name, scores in self.pairs.items()
        ]
        return {
            "suite": self.suite,
            "seed": self.seed,
            "pairs": rows,
            "failed": [{"name": name, "error": error} for name, error in self.failed.items()],
            "pixels": "those that both cameras see; all_pixels: all whose truth is known",
            "machine": machine(),
        }

    def sheets(self) -> list[Sheet]:
        """A table a pair, and one of what failed."""
        sheets = [scores_sheet(scores, name) for name, scores in self.pairs.items()]
        sheets = [*(replace(one, note="") for one in sheets[:-1]), *sheets[-1:]]
        if self.failed:
            rows = tuple(self.failed.items())
            sheets.append(Sheet(title="", columns=("failed", "why"), rows=rows, left=(0, 1)))
        return sheets


def run_photographs(
    suite: str,
    pairs: Sequence[KnownPair],
    engines: Sequence[str],
    *,
    seed: int = 0,
    progress: Progress = silent,
) -> PhotographScores:
    """Sees every pair by every engine, one after the other: their times are of a machine that does nothing else.

    Args:
        suite: what it is called.
        pairs: what to see.
        engines: who sees.
        seed: of all randomness.
        progress: called with a name and a share as the work goes on.
    """
    for name in engines:
        warm(name)
    params = SeeParams(engines=tuple(engines), seed=seed)
    done: dict[str, dict[str, MatchScores]] = {}
    failed: dict[str, str] = {}
    for count, pair in enumerate(pairs):
        progress(pair.name, count / len(pairs))
        try:
            found = see(pair.left, pair.right, calib=pair.calibration, truth=pair.truth, mask=pair.mask, params=params)
            done[pair.name] = found.scores
        except FlysimError as error:
            failed[pair.name] = str(error)
    return PhotographScores(suite=suite, engines=tuple(engines), pairs=done, failed=failed, seed=seed)
