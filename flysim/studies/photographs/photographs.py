"""Folders of pairs with true disparities, as Middlebury and KITTI publish them: every engine by the same scores."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from flysim.common.progress import Progress, silent
from flysim.common.sheet import Sheet
from flysim.engines.choose import warm
from flysim.errors import FlysimError, ScenarioError
from flysim.evaluate.disparity_scores import MatchScores
from flysim.photographs.album import pair_in
from flysim.plain import shown_path
from flysim.runs.photographs import SeeParams, see
from flysim.runs.sighting import scores_sheet
from flysim.studies.machine import machine

SUITE = "photographs"
CALIBRATIONS = (
    "calib.txt",
    "calib.json",
    "calib_cam_to_cam.txt",
    "stereo.yml",
    "stereo.yaml",
    "stereo.xml",
    "dmin.txt",
)
TRUTHS = ("disp_gt.npy", "disp0GT.pfm", "disp0.pfm", "disp_gt.pfm", "disp_gt.png", "disp_occ.png", "truth.npy")
MASKS = ("nonocc_computed.png", "mask0nocc.png", "nonocc.png")
MAX_PAIRS = 10_000


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownPair:
    """A folder with a pair and its truth; `mask` and `calibration` are None where it has none."""

    name: str
    left: Path
    right: Path
    truth: Path
    mask: Path | None
    calibration: Path | None


@dataclass(frozen=True, slots=True, kw_only=True)
class PhotographScores:
    """What every engine made of every pair.

    Attributes:
        engines: in the order of the tables.
        pairs: name -> engine -> scores.
        failed: name -> why it could not be seen, one line.
        seed: of all randomness.
    """

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
            "suite": SUITE,
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


def known_pairs(data: Path | None) -> list[KnownPair]:
    """The pairs of a folder of folders, or the one of a folder.

    Raises:
        ScenarioError: there is none with a truth.
    """
    if data is None:
        raise ScenarioError("suite photographs needs the folder of its pairs: --data DIR.")
    if not data.is_dir():
        raise ScenarioError(f"{shown_path(data)}: no such folder. Give that of the pairs as --data DIR.")
    folders = sorted(path for path in data.iterdir() if path.is_dir())
    found = [one for folder in [data, *folders] if (one := _known(folder)) is not None]
    if not found:
        raise ScenarioError(
            f"{shown_path(data)}: no pair with a truth: a folder each, with left.png, right.png (or im0, im1) and "
            f"{', '.join(TRUTHS[:3])} or its like."
        )
    if len(found) > MAX_PAIRS:
        raise ScenarioError(f"{shown_path(data)}: {len(found)} pairs; at most {MAX_PAIRS} are seen.")
    return found


def _known(folder: Path) -> KnownPair | None:
    pair, truth = pair_in(folder), _first(folder, TRUTHS)
    if pair is None or truth is None:
        return None
    return KnownPair(
        name=folder.resolve().name,
        left=pair[0],
        right=pair[1],
        truth=truth,
        mask=_first(folder, MASKS),
        calibration=_first(folder, CALIBRATIONS),
    )


def _first(folder: Path, names: Sequence[str]) -> Path | None:
    return next((folder / name for name in names if (folder / name).is_file()), None)


def run_photographs(
    pairs: Sequence[KnownPair], engines: Sequence[str], *, seed: int = 0, progress: Progress = silent
) -> PhotographScores:
    """Sees every pair by every engine, one after the other: their times are of a machine that does nothing else.

    Args:
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
    return PhotographScores(engines=tuple(engines), pairs=done, failed=failed, seed=seed)
