"""Two photographs and a calibration to flies, a floor and things in metres; or many pairs, one after the other."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flysim.common.progress import Progress, silent
from flysim.engines.choose import engine
from flysim.engines.dense import dense, farthest
from flysim.errors import FlysimError
from flysim.evaluate.disparity_scores import (
    DisparityTruth,
    MatchScores,
    coverage,
    score_map,
    score_points,
    textured_cells,
)
from flysim.flies.parameters import FlyParams
from flysim.geometry.calibration.calibration import Calibration
from flysim.geometry.calibration.choose import read_calibration
from flysim.geometry.frames import se3
from flysim.obstacles.afloat import lifted
from flysim.obstacles.parameters import ObstacleParams
from flysim.photographs.album import Album, Pictures, album
from flysim.photographs.depths import depths
from flysim.photographs.floor import Floor, find_floor, without_floor
from flysim.photographs.inspection import refuse_unfit, remarks
from flysim.photographs.known import read_mask, read_truth
from flysim.photographs.level import Leveller, Photograph
from flysim.photographs.matches import matches
from flysim.photographs.settings import fly_params, obstacle_params
from flysim.plain import shown_path
from flysim.products.findings import Findings, Seen
from flysim.products.frame import Frame, FrameSequence
from flysim.products.swarm import Swarm
from flysim.products.thing import Thing
from flysim.runs.see import gathered
from flysim.runs.sighting import Sighting, thing_of

DENSE = ("sgbm", "bm")  # whose every pixel is judged


@dataclass(frozen=True, slots=True, kw_only=True)
class SeeParams:
    """How pairs are seen. Refuses nonsense with a FlysimError that names the figure.

    Attributes:
        engines: who sees; floor and things are the first one's, the others are scored where there is a truth.
        flies: how flies evolve; None: by the size of the pictures. Its depths are not read.
        obstacles: how flies become things; None: in proportion to how far apart they lie.
        depths: nearest and farthest depth to search [m]; None: as calibration or pictures tell.
        rectified: whether the pictures are rectified already, whatever the calibration knows of lenses.
        as_is: whether lenses are made straight alone, and the cameras left as they stand.
        truth_scale: grey levels a pixel of an 8-bit truth; None: the truth is none.
        seed: of all randomness.
    """

    engines: tuple[str, ...] = ("flies",)
    flies: FlyParams | None = None
    obstacles: ObstacleParams | None = None
    depths: tuple[float, float] | None = None
    rectified: bool = False
    as_is: bool = False
    truth_scale: float | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        if not self.engines:
            raise FlysimError("engines: name at least one.")
        if self.depths is not None and not 0.0 < self.depths[0] < self.depths[1] <= 1e5:
            raise FlysimError(f"depths must be 0 < nearest < farthest, got {self.depths[0]} m and {self.depths[1]} m.")


def see(
    left: str | Path,
    right: str | Path | None = None,
    *,
    calib: str | Path | tuple[str | Path, ...] | Calibration | None = None,
    truth: str | Path | None = None,
    mask: str | Path | None = None,
    params: SeeParams | None = None,
) -> Sighting:
    """What one pair of photographs shows.

    Args:
        left: a picture, 8 or 16 bits; or a folder that holds one pair.
        right: the right one; None where `left` holds both side by side, or is a folder.
        calib: a calibration file, two of them (one an eye), or what `read_calibration` gave; None: pixels, no metres.
        truth: true disparities, of which scores are told.
        mask: a picture that is white where both cameras see a pixel; None: worked out from the truth.
        params: how it is seen.

    Raises:
        FlysimError: a file cannot be read, the pair cannot be seen, or there is more than one.
    """
    found = album(left, right)
    if found.sequence:
        raise FlysimError(f"{shown_path(left)} holds {found.planned} pairs: see_all gives them one by one.")
    for sighting in see_all(left, right, calib=calib, truth=truth, mask=mask, params=params):
        if isinstance(sighting, FlysimError):
            raise sighting
        return sighting
    raise FlysimError(f"{shown_path(left)}: no pair there.")


def see_all(
    left: str | Path,
    right: str | Path | None = None,
    *,
    calib: str | Path | tuple[str | Path, ...] | Calibration | None = None,
    truth: str | Path | None = None,
    mask: str | Path | None = None,
    params: SeeParams | None = None,
    progress: Progress = silent,
) -> Iterator[Sighting | FlysimError]:
    """What each of many pairs shows, in order; of one that cannot be seen, why.

    Arguments are those of `see`, but that `left` and `right` may be folders, patterns or videos, and `truth` a folder
    or a pattern with as many files.

    Raises:
        FlysimError: what is wrong with all of them: the calibration, an engine, or no pair at all.
    """
    params = params or SeeParams()
    found = album(left, right)
    for name in params.engines:
        engine(name)
    leveller: Leveller | None = None
    truths = None if truth is None else _truths(found, truth)
    for count, (name, pictures) in enumerate(found.pairs()):
        progress(name, count / max(found.planned, count + 1))
        if isinstance(pictures, FlysimError):
            yield pictures
            continue
        began = time.perf_counter()
        if leveller is None:
            leveller = _leveller(calib, found, pictures, params)
        try:
            yield _seen(name, pictures, leveller, None if truths is None else truths[count], mask, params, began)
        except FlysimError as error:
            yield error


def _leveller(
    calib: str | Path | tuple[str | Path, ...] | Calibration | None, of: Album, pictures: Pictures, params: SeeParams
) -> Leveller:
    if calib is None or isinstance(calib, Calibration):
        return Leveller(calib, "the calibration", rectified=params.rectified, as_is=params.as_is)
    files = [calib] if isinstance(calib, str | Path) else list(calib)
    read = read_calibration(files, picture=of.first, width=pictures[0].shape[1])
    return Leveller(read, shown_path(Path(files[0])), rectified=params.rectified, as_is=params.as_is)


def _truths(of: Album, truth: str | Path) -> list[Path]:
    path = Path(truth)
    if not of.sequence:
        return [path]
    found = sorted(path.iterdir()) if path.is_dir() else sorted(path.parent.glob(path.name))
    if len(found) != of.planned:
        raise FlysimError(f"{shown_path(path)}: {len(found)} files of truth for {of.planned} pairs.")
    return found


def _seen(
    name: str,
    pictures: Pictures,
    leveller: Leveller,
    truth: Path | None,
    mask: str | Path | None,
    params: SeeParams,
    began: float,
) -> Sighting:
    photograph = leveller(name, *pictures)
    rig, camera = photograph.pair.rig, photograph.pair.rig.left
    known = None
    if truth is not None:
        disparity = read_truth(truth, (camera.height, camera.width), params.truth_scale)
        seen = None if mask is None else read_mask(Path(mask), disparity.shape)
        known = DisparityTruth.of(disparity, seen)
    shown = matches(photograph.pair.left, photograph.pair.right)
    refuse_unfit(photograph, shown)
    if params.depths is not None and not photograph.metric:
        raise FlysimError(
            f"{photograph.name}: --depths are metres, and without a calibration nothing has any: give one."
        )
    searched = depths(rig, camera.width, photograph.disparities, shown, params.depths)
    flies = fly_params(rig, searched, params.flies)
    swarms, scores = {}, {}
    for one in params.engines:
        swarms[one], seconds = _swarm(one, photograph, flies, params.seed)
        if known is not None:
            scores[one] = _scored(one, photograph, swarms[one], seconds, known, flies)
    first = params.engines[0]
    findings, floor, things = _found(first, photograph, swarms[first], flies, params)
    return Sighting(
        photograph=photograph,
        depths=searched,
        findings=findings,
        floor=floor,
        things=things,
        remarks=remarks(photograph, searched, shown, swarms[first]),
        scores=scores,
        seconds=time.perf_counter() - began,
    )


def _swarm(name: str, photograph: Photograph, flies: FlyParams, seed: int) -> tuple[Swarm, float]:
    eyes = engine(name)
    mark = time.perf_counter()
    try:
        eyes.begin(photograph.pair.rig, flies)
        swarm = eyes.see(Frame.alone(photograph.pair), rng=np.random.default_rng(seed))
    except ValueError as error:  # pictures smaller than a window, a rig that a dense matcher cannot use
        raise FlysimError(f"{photograph.name}: {error}.") from error
    return swarm, time.perf_counter() - mark


def _found(
    name: str, photograph: Photograph, swarm: Swarm, flies: FlyParams, params: SeeParams
) -> tuple[Findings, Floor | None, tuple[Thing, ...]]:
    """Floor first, then what stands on it or does not."""
    rng = np.random.default_rng(params.seed)
    floor = find_floor(swarm.points, swarm.normals, swarm.spread, rng=rng) if photograph.metric else None
    T_base_left = without_floor(swarm.points.astype(np.float64)) if floor is None else floor.T_base_left
    frame = Frame(
        index=0, time=0.0, pair=photograph.pair, T_world_base=se3(np.eye(3), np.zeros(3)), T_base_left=T_base_left
    )
    sequence = FrameSequence(name=photograph.name, frames=(frame,), planned=1, seed=params.seed, notes=photograph.notes)
    made = obstacle_params(photograph.pair.rig, swarm, params.obstacles)
    seen = Seen(frame=frame, swarm=swarm, seconds=0.0)
    findings = gathered(name, sequence, [seen], made, max_range=flies.max_depth)
    bodies, afloat = lifted(findings.cloud, findings.obstacles, made, floor=floor is not None)
    findings = replace(findings, obstacles=bodies)
    things = tuple(thing_of(one, hangs, findings) for one, hangs in zip(bodies, afloat, strict=True))
    return findings, floor, things


def _scored(
    name: str, photograph: Photograph, swarm: Swarm, seconds: float, known: DisparityTruth, flies: FlyParams
) -> MatchScores:
    rig = photograph.pair.rig
    offset = rig.left.cx - rig.right.cx
    gain = rig.left.fx * rig.baseline if photograph.metric else 0.0
    cells = textured_cells(photograph.pair.left, known)
    if name not in DENSE:
        disparity = swarm.uv[:, 0].astype(np.float64) - swarm.uv_right[:, 0]
        both, everywhere = score_points(swarm.uv, disparity, known, gain, offset)
        held, count, density = coverage(cells, swarm.uv), len(swarm.uv), None
    else:
        mark = time.perf_counter()
        reach = farthest(rig, flies.max_depth)
        found = dense(photograph.pair, name, min_depth=flies.min_depth, max_depth=reach)  # type: ignore[arg-type]
        seconds = time.perf_counter() - mark
        both, everywhere, density = score_map(found, known, gain, offset)
        v, u = np.nonzero(np.isfinite(found))
        held, count = coverage(cells, np.stack([u, v], axis=1)), len(u)
    return MatchScores(
        engine=name, seen=both, everywhere=everywhere, matches=count, density=density, coverage=held,
        ms=1000.0 * seconds,
    )  # fmt: skip
