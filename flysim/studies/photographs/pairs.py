"""Folders of pairs with true disparities, as Middlebury and KITTI publish them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flysim.errors import ScenarioError
from flysim.photographs.album import pair_in
from flysim.plain import shown_path

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
    """A pair and its truth; `mask` and `calibration` are None where it has none."""

    name: str
    left: Path
    right: Path
    truth: Path
    mask: Path | None = None
    calibration: Path | None = None


def known_pairs(seeds: Sequence[int] | None, data: Path | None) -> list[KnownPair]:
    """The pairs of a folder of folders, or the one of a folder: the suite `photographs`.

    Raises:
        ScenarioError: there is none with a truth, or more than one seed.
    """
    if seeds is not None and len(seeds) != 1:
        raise ScenarioError("suite photographs takes one seed: --seeds 3.")
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
