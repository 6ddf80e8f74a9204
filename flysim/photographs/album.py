"""The pairs that a user names: two files, folders or patterns, a folder of pairs, pictures side by side, a video."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flysim.errors import FlysimError
from flysim.foreign.picture import ENDINGS, eight_bits, read_picture
from flysim.foreign.video import ENDINGS as VIDEO_ENDINGS
from flysim.foreign.video import video
from flysim.plain import shown_path

MAX_PAIRS = 100_000
# What the left and the right picture, or their folders, are called by those who publish pairs.
FILES = (("left", "right"), ("im0", "im1"), ("im2", "im6"), ("view1", "view5"), ("im_left", "im_right"))
FOLDERS = (
    *(("image_02", "image_03"), ("image_2", "image_3"), ("image_00", "image_01"), ("image_0", "image_1")),
    *(("cam0", "cam1"), ("left", "right")),
)
SIDE_BY_SIDE = 1.8  # a picture that is so many times wider than high holds both eyes

Pictures = tuple[NDArray[np.uint8], NDArray[np.uint8]]


@dataclass(frozen=True, slots=True, kw_only=True)
class PairFiles:
    """One pair of files; `right` is None where the left one holds both eyes side by side."""

    name: str
    left: Path
    right: Path | None

    def pictures(self) -> Pictures:
        """`[H, W, 3]` uint8 RGB of both eyes.

        Raises:
            FlysimError: a file cannot be read, or cannot be divided.
        """
        first = read_picture(self.left)
        if self.right is None:
            (both,) = eight_bits(first)
            return halves(both, shown_path(self.left))
        left, right = eight_bits(first, read_picture(self.right))
        return left, right


@dataclass(frozen=True, slots=True, kw_only=True)
class Album:
    """Pairs in the order they were taken.

    Attributes:
        name: of it all.
        shots: pairs of files; none where they are in a video.
        videos: one of pictures side by side, or one an eye.
        planned: how many pairs there are, as far as files tell.
    """

    name: str
    shots: tuple[PairFiles, ...] = ()
    videos: tuple[Path, ...] = ()
    planned: int = 0

    @property
    def sequence(self) -> bool:
        """Whether it is more than one pair."""
        return bool(self.videos) or len(self.shots) > 1

    @property
    def first(self) -> Path:
        """The first left picture, or the video."""
        return self.videos[0] if self.videos else self.shots[0].left

    def pairs(self) -> Iterator[tuple[str, Pictures | FlysimError]]:
        """Name and pictures of each pair, or why it cannot be read; a video ends there, files go on."""
        if self.videos:
            yield from _of_videos(self.videos)
            return
        for shot in self.shots:
            try:
                yield shot.name, shot.pictures()
            except FlysimError as error:
                yield shot.name, error


def album(left: str | Path, right: str | Path | None = None) -> Album:
    """The pairs that two names stand for, or one.

    Args:
        left: a picture, a folder, a pattern as `left*.png`, or a video.
        right: the same of the right eye; None: `left` holds both, side by side, or it is a folder of pairs.

    Raises:
        FlysimError: there is no such file, or not as many right ones as left ones.
    """
    if right is None:
        return _of_one(Path(left))
    lefts, rights = _files(left), _files(right)
    if any(path.suffix.lower() in VIDEO_ENDINGS for path in (*lefts, *rights)):
        if len(lefts) != 1 or len(rights) != 1:
            raise FlysimError("give one video of pictures side by side, or one an eye.")
        return Album(name=lefts[0].stem, videos=(lefts[0], rights[0]), planned=_planned(lefts[0]))
    return _paired(lefts, rights, left, right)


def halves(both: NDArray[np.uint8], where: str) -> Pictures:
    """The two eyes of a picture that holds them side by side.

    Raises:
        FlysimError: it is not wide enough to be two.
    """
    height, width = both.shape[:2]
    if width < SIDE_BY_SIDE * height:
        raise FlysimError(f"{where}: {width}x{height} px are no two pictures side by side: give the right one as well.")
    half = width // 2
    return np.ascontiguousarray(both[:, :half]), np.ascontiguousarray(both[:, width - half :])


def _of_one(path: Path) -> Album:
    if path.is_dir():
        return _of_folder(path)
    files = _files(path)
    if files[0].suffix.lower() in VIDEO_ENDINGS:
        return Album(name=files[0].stem, videos=(files[0],), planned=_planned(files[0]))
    shots = tuple(PairFiles(name=one.stem, left=one, right=None) for one in files)
    return Album(
        name=files[0].stem if len(files) == 1 else path.parent.name or "pairs", shots=shots, planned=len(shots)
    )


def pair_in(folder: Path) -> tuple[Path, Path] | None:
    """The one pair of a folder as Middlebury and others publish them: left.png and right.png, im0.png and im1.png."""
    for names in FILES:
        found = [[folder / f"{name}{ending}" for ending in ENDINGS] for name in names]
        there = [next((path for path in paths if path.is_file()), None) for paths in found]
        if there[0] is not None and there[1] is not None:
            return there[0], there[1]
    return None


def _of_folder(folder: Path) -> Album:
    one = pair_in(folder)
    if one is not None:
        shot = PairFiles(name=folder.name, left=one[0], right=one[1])
        return Album(name=folder.name, shots=(shot,), planned=1)
    for names in FOLDERS:
        eyes = [folder / name / "data" if (folder / name / "data").is_dir() else folder / name for name in names]
        if all(eye.is_dir() for eye in eyes):
            return _paired(_files(eyes[0]), _files(eyes[1]), eyes[0], eyes[1], name=folder.name)
    files = _files(folder)
    eyes = [[path for path in files if path.stem.lower().startswith(name)] for name in ("left", "right")]
    if all(eyes):
        return _paired(eyes[0], eyes[1], f"{folder}/left*", f"{folder}/right*", name=folder.name)
    shots = tuple(PairFiles(name=path.stem, left=path, right=None) for path in files)
    return Album(name=folder.name, shots=shots, planned=len(shots))


def _files(name: str | Path) -> list[Path]:
    """The pictures of a folder or a pattern, in the order a person counts; or the one file."""
    path = Path(name)
    if path.is_dir():
        found = [one for one in path.iterdir() if one.suffix.lower() in ENDINGS]
    elif re.search(r"[*?\[]", path.name) and not path.exists():
        with contextlib.suppress(OSError, ValueError):
            found = [one for one in path.parent.glob(path.name) if one.suffix.lower() in (*ENDINGS, *VIDEO_ENDINGS)]
    else:
        return [path]
    if not found:
        raise FlysimError(f"{shown_path(path)}: no picture there: {', '.join(one[1:] for one in ENDINGS)} are read.")
    if len(found) > MAX_PAIRS:
        raise FlysimError(f"{shown_path(path)}: {len(found)} pictures; at most {MAX_PAIRS} are read.")
    return sorted(found, key=lambda one: [int(w) if w.isdecimal() else w for w in re.split(r"(\d+)", one.name)])


def _paired(
    lefts: Sequence[Path], rights: Sequence[Path], left: str | Path, right: str | Path, name: str | None = None
) -> Album:
    """Pictures of both eyes by their order, or by their names where one eye has more."""
    if len(lefts) != len(rights):
        by_name = {path.stem: path for path in rights}
        both = [(path, by_name[path.stem]) for path in lefts if path.stem in by_name]
        if not both:
            raise FlysimError(
                f"{shown_path(left)} has {len(lefts)} pictures, {shown_path(right)} {len(rights)}, and their names do "
                "not say which belong together."
            )
        lefts, rights = [pair[0] for pair in both], [pair[1] for pair in both]
    shots = tuple(PairFiles(name=one.stem, left=one, right=other) for one, other in zip(lefts, rights, strict=True))
    whole = name or (lefts[0].stem if len(shots) == 1 else lefts[0].parent.name)
    return Album(name=whole or "pairs", shots=shots, planned=len(shots))


def _planned(path: Path) -> int:
    with video(path) as film:
        return film.planned


def _of_videos(paths: Sequence[Path]) -> Iterator[tuple[str, Pictures | FlysimError]]:
    count = 0
    with contextlib.ExitStack() as stack:
        films = [stack.enter_context(video(path)) for path in paths]
        try:
            for pictures in zip(*(film.pictures() for film in films), strict=False):
                count += 1
                both = halves(pictures[0], shown_path(paths[0])) if len(pictures) == 1 else (pictures[0], pictures[1])
                yield f"{paths[0].stem}-{count:05d}", both
        except FlysimError as error:
            yield f"{paths[0].stem}-{count + 1:05d}", error
