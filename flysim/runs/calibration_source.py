"""`calibration = "..."` of a scenario: the files of a calibration, its truth, or so many images of a board."""

from __future__ import annotations

from pathlib import Path

from flysim.errors import ScenarioError
from flysim.plain import shown, shown_path

TRUTH, IMAGES = "truth", "images:"  # in place of a file's name
EYES = ("left.yaml", "right.yaml")
MOST_IMAGES = 200
MOST_TEXT = 1000  # characters


def is_file(source: str) -> bool:
    """Whether files are named."""
    return bool(source) and source != TRUTH and not source.startswith(IMAGES)


def count_of(source: str) -> int:
    """The images of `images:15`.

    Raises:
        ScenarioError: it is no such number.
    """
    text = source.removeprefix(IMAGES)
    if not text.isascii() or not text.isdecimal() or not 1 <= int(text[:9]) <= MOST_IMAGES:
        raise ScenarioError(
            f"calibration {shown(source)}: write images:N with N from 1 to {MOST_IMAGES}, as images:15."
        )
    return int(text)


def calibration_files(source: str, folder: Path | None) -> tuple[Path, Path]:
    """The files of the left and of the right eye.

    Raises:
        ScenarioError: there is none, or one eye's alone.
    """
    place = calibration_place(source, folder)
    if place.is_dir():
        found = place / EYES[0], place / EYES[1]
    else:
        side, other = ("left", "right") if "left" in place.name else ("right", "left")
        both = {side: place, other: place.with_name(place.name.replace(side, other))}
        found = both["left"], both["right"]
        if found[0] == found[1]:
            raise ScenarioError(
                f"calibration {shown_path(place)}: one camera's; a pair has left.yaml and right.yaml: name one of "
                "them, or their folder."
            )
    for path in found:
        if not path.is_file():
            raise ScenarioError(f"calibration {shown(source)}: there is no {shown_path(path)}; a pair has both eyes'.")
    return found


def calibration_place(source: str, folder: Path | None) -> Path:
    """The file or folder that is meant: from the scenario's folder, then from here.

    Raises:
        ScenarioError: there is none.
    """
    for place in [Path(source)] if folder is None else [folder / source, Path(source)]:
        if place.exists():
            return place
    raise ScenarioError(
        f"no calibration {shown(source)}. Give a folder with left.yaml and right.yaml (flysim calibrate writes one), "
        "'truth', or 'images:15'."
    )
