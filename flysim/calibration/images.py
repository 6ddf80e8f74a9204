"""The images of a calibration: which of them are one eye's, which pair up, and what each shows of the board."""

from __future__ import annotations

import glob
import hashlib
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from flysim.calibration.board import Board
from flysim.calibration.detect import Corners, find_corners
from flysim.common.progress import Progress, silent
from flysim.errors import FlysimError
from flysim.foreign.image import read_image
from flysim.plain import shown, shown_path

ENDINGS = frozenset({".png", ".jpg", ".jpeg", ".ppm", ".pgm", ".bmp"})
MOST = 500  # images of an eye
_SIDE = re.compile(r"left|right", re.IGNORECASE)
_NUMBERS = re.compile(r"\d+")


@dataclass(frozen=True, slots=True, kw_only=True)
class Sightings:
    """What the images show, one by one.

    Attributes:
        size: width and height of all images [px].
        names: of the images in which an eye sees the board; of a pair the left one's.
        shots: of each of those, what every eye saw; None where it saw no board.
        left_out: the images that show no board.
    """

    size: tuple[int, int]
    names: tuple[str, ...]
    shots: tuple[tuple[Corners | None, ...], ...]
    left_out: tuple[str, ...]


def image_sets(given: Sequence[str], right: Sequence[str] = ()) -> tuple[tuple[Path, ...], ...]:
    """The images of one eye, or those of the left and of the right one, each in the order of their names.

    Args:
        given: files, folders and patterns. Where each name, or its folder's, says left or right, they are a pair's.
        right: those of the right eye; then `given` are the left one's.

    Raises:
        FlysimError: nothing is there, eyes of different counts, or an image without its other.
    """
    if right:
        return _paired(_files(given), _files(right))
    files = _files(given)
    sides = [_side(path) for path in files]
    if not {"left", "right"} <= set(sides):
        return (tuple(files),)
    if None in sides:
        raise FlysimError(
            f"{shown_path(files[sides.index(None)])}: is it the left eye's or the right one's? Say so in its name or "
            "its folder's, or give the right eye's images by --right."
        )
    return _paired(
        *([path for path, side in zip(files, sides, strict=True) if side == one] for one in ("left", "right"))
    )


def look_at(sets: Sequence[Sequence[Path]], board: Board, progress: Progress = silent) -> Sightings:
    """Reads the images and finds the board in them.

    Raises:
        FlysimError: an image that cannot be read, two sizes, one image twice, or no board in any.
    """
    size: tuple[int, int] | None = None
    seen: dict[bytes, Path] = {}
    names, shots, left_out = [], [], []
    for k, paths in enumerate(zip(*sets, strict=True)):
        found: list[Corners | None] = []
        for path in paths:
            image = read_image(path)
            here = (image.shape[1], image.shape[0])
            size = size or here
            if here != size:
                raise FlysimError(
                    f"{shown_path(path)}: {here[0]}x{here[1]} px, the images before it {size[0]}x{size[1]}: all must "
                    "have one size."
                )
            other = seen.setdefault(hashlib.sha256(image.tobytes()).digest(), path)
            if other is not path:
                raise FlysimError(f"{shown_path(path)}: the same image as {shown_path(other)}: leave one of them out.")
            corners = find_corners(image, board)
            found.append(corners)
            if corners is None:
                left_out.append(path.name)
        if any(corners is not None for corners in found):
            names.append(paths[0].name)
            shots.append(tuple(found))
        progress(f"image {k + 1} of {len(sets[0])}", (k + 1) / len(sets[0]))
    assert size is not None  # no set is empty
    if not shots:
        raise FlysimError(
            f"none of {len(sets[0])} images shows a {board.name}: are its inner corners counted, where four squares "
            "meet, and is all of it in the image?"
        )
    return Sightings(size=size, names=tuple(names), shots=tuple(shots), left_out=tuple(left_out))


def _files(given: Iterable[str]) -> list[Path]:
    found: list[Path] = []
    for text in given:
        path = Path(text)
        if path.is_dir():
            some = [one for one in _listed(path.iterdir) if one.suffix.lower() in ENDINGS]
            if not some:  # folders of the two eyes
                some = [
                    one
                    for eye in _listed(path.iterdir)
                    if eye.is_dir() and _SIDE.search(eye.name)
                    for one in _files([str(eye)])
                ]
            if not some:
                raise FlysimError(f"{shown_path(path)}: no image in it. PNG, JPEG, PPM, PGM and BMP are read.")
        elif glob.has_magic(text) and not path.exists():
            some = [Path(one) for one in glob.glob(text, recursive=True)]  # noqa: PTH207 (a pattern may begin at the root)
            if not some:
                raise FlysimError(f"no file is called {shown(text)}. Give images, folders or patterns.")
        else:
            some = [path]  # whether it is there is told by who reads it
        found += some
        if len(found) > 2 * MOST:
            raise FlysimError(f"more than {MOST} images of an eye. Take fewer: 20 are enough.")
    if not found:
        raise FlysimError("give the images of a board: files, folders or patterns.")
    return sorted(found, key=lambda one: [*map(str, one.parts[:-1]), *_natural(one.name)])


def _listed(work: Callable[[], Iterable[Path]]) -> list[Path]:
    return sorted(work())


def _natural(name: str) -> list[str]:
    """So that image 10 comes after image 9."""
    return [_NUMBERS.sub(lambda digits: digits[0].zfill(20), name)]


def _side(path: Path) -> str | None:
    for name in (path.name, path.parent.name):
        found = {word.lower() for word in _SIDE.findall(name)}
        if len(found) == 1:
            return found.pop()
    return None


def _paired(left: Sequence[Path], right: Sequence[Path]) -> tuple[tuple[Path, ...], ...]:
    if len(left) != len(right):
        raise FlysimError(
            f"{len(left)} images of the left eye and {len(right)} of the right one: each needs its other."
        )
    for one, other in zip(left, right, strict=True):
        if _NUMBERS.findall(one.name) != _NUMBERS.findall(other.name) and _side(one) and _side(other):
            raise FlysimError(
                f"{shown_path(one)} stands beside {shown_path(other)}: each needs its other, of one number."
            )
    return tuple(left), tuple(right)
