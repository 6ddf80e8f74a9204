"""`flysim see`: two photographs and a calibration to flies, a floor and things in metres."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from flysim.cli.options import MAX_SEED, AsJson, bundled, within
from flysim.cli.study import engine_names, reserved_folder
from flysim.cli.terminal import Bar, complain, say, say_json, show
from flysim.errors import FlysimError

if TYPE_CHECKING:
    from flysim.geometry.calibration.calibration import Calibration
    from flysim.photographs.album import Album
    from flysim.runs.sighting import Sighting


class CalibrationByHand(NamedTuple):
    """The figures of a calibration, where no file has them.

    Attributes:
        fx, baseline: focal length [px], and distance of the two cameras [m].
        cx, cy, doffs: principal point of the left one [px], and by how much that of the right one is further right.
    """

    fx: Annotated[float | None, typer.Option("--fx", help="Focal length [px], in place of a file.")] = None
    baseline: Annotated[float | None, typer.Option(help="Distance of the cameras [m].")] = None
    cx: Annotated[float | None, typer.Option("--cx", help="Principal point [px]. [the middle]")] = None
    cy: Annotated[float | None, typer.Option("--cy", help="Principal point [px]. [the middle]")] = None
    doffs: Annotated[float | None, typer.Option(help="cx of the right eye less that of the left one [px]. [0]")] = None


class TruthGiven(NamedTuple):
    """What a pair is judged by.

    Attributes:
        truth, mask, truth_scale: as `fs.see` has them.
    """

    truth: Annotated[Path | None, typer.Option(help="True disparities: PFM, 16-bit PNG, .npy; or a folder.")] = None
    mask: Annotated[Path | None, typer.Option(help="Picture, white where both cameras see. [worked out]")] = None
    truth_scale: Annotated[float | None, typer.Option(help="Grey levels a pixel of an 8-bit truth.")] = None


BY_HAND, NO_TRUTH = CalibrationByHand(), TruthGiven()


@bundled
def see(
    left: Annotated[str, typer.Argument(help="Left picture, folder, pattern or video; or both eyes side by side.")],
    right: Annotated[str | None, typer.Argument(help="The right one. [LEFT holds both]")] = None,
    calib: Annotated[
        list[Path] | None, typer.Option(help="Calibration file; twice where there is one an eye. [pixels alone]")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder to write. [runs/out/see-...]")] = None,
    engines: Annotated[str, typer.Option(help="Names with commas; the first one's things are told.")] = "flies",
    depths: Annotated[str | None, typer.Option(help="NEAREST:FARTHEST to search [m]. [as calibration tells]")] = None,
    rectified: Annotated[bool, typer.Option("--rectified", help="The pictures are rectified already.")] = False,
    as_is: Annotated[bool, typer.Option("--as-is", help="Take distortion out, but do not rectify.")] = False,
    seed: Annotated[int, typer.Option(help="Seed of all randomness.", callback=within("--seed", 0, MAX_SEED))] = 0,
    by_hand: CalibrationByHand = BY_HAND,
    known: TruthGiven = NO_TRUTH,
    as_json: AsJson = False,
) -> None:
    """See what stands before a stereo camera: depths, floor and things with their sizes, from two pictures or many."""
    names = engine_names(engines)
    if known.truth is None and (known.mask is not None or known.truth_scale is not None):
        raise FlysimError("--mask and --truth-scale go with --truth FILE.")
    from flysim.photographs.album import album
    from flysim.runs.photographs import SeeParams, see_all

    found = album(left, right)
    params = SeeParams(
        engines=names,
        depths=_depths(depths),
        rectified=rectified,
        as_is=as_is,
        truth_scale=known.truth_scale,
        seed=seed,
    )
    given = {
        "calib": _calibration(calib or [], by_hand, found),
        "truth": known.truth,
        "mask": known.mask,
        "params": params,
    }
    told: list[dict[str, Any]] = []
    refused: list[str] = []
    with contextlib.ExitStack() as stack:
        place = stack.enter_context(reserved_folder(out, f"see-{found.name}", None))
        room: Path | None = None
        with Bar(f"see {found.name}", quiet=as_json or not found.sequence) as bar:
            for one in see_all(left, right, **given, progress=bar):
                if isinstance(one, FlysimError):
                    refused.append(str(one))
                    continue
                if not as_json:
                    _tell(one, brief=found.sequence)
                room = stack.enter_context(place.writing()) if room is None else room
                _write(room / _folder(one.name, len(told)) if found.sequence else room, one)
                told.append(one.to_json())
        if room is not None and found.sequence:
            from flysim.runs.sighting_files import write_index

            write_index(room, told, refused)
    _end(told, refused, place.out, sequence=found.sequence, as_json=as_json)


def _end(told: list[dict[str, Any]], refused: list[str], out: Path, *, sequence: bool, as_json: bool) -> None:
    """What is printed last; exit 2 where a pair could not be seen."""
    if as_json and (told or not refused):
        many = {"pairs": told, "refused": refused}
        say_json({**(many if sequence else told[0]), "folder": str(out)})
    elif told:
        say(f"folder: {out}   (see.json; depth.png, things.png, above.png; flies.ply; recording.rrd)")
    for line in refused:
        complain(line)
    if refused:
        raise typer.Exit(2)


def _tell(one: Sighting, *, brief: bool) -> None:
    lines = one.headline()
    say(*(lines[:1] if brief else lines))
    if not brief:
        show(one.sheets())


def _write(folder: Path, one: Sighting) -> None:
    from flysim.runs.sighting_files import write_sighting

    folder.mkdir(exist_ok=True)
    write_sighting(folder, one)


def _folder(name: str, count: int) -> str:
    return f"{count:05d}-{re.sub(r'[^A-Za-z0-9_.-]+', '_', name)[:80]}"


def _depths(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    try:
        near, far = map(float, text.split(":"))
    except ValueError:
        raise FlysimError(f"--depths {text}: write NEAREST:FARTHEST in metres, as in --depths 0.5:6.") from None
    return near, far


def _calibration(files: list[Path], by_hand: CalibrationByHand, of: Album) -> tuple[Path, ...] | Calibration | None:
    given = {name: value for name, value in by_hand._asdict().items() if value is not None}
    if not given:
        return tuple(files) or None
    if files:
        raise FlysimError(f"give --calib, or --{next(iter(given))} and its like, not both.")
    if not {"fx", "baseline"} <= given.keys():
        raise FlysimError("a calibration by hand needs --fx [px] and --baseline [m].")
    from flysim.geometry.calibration.choose import plain_numbers

    if not {"cx", "cy"} <= given.keys():  # the middle of the pictures
        pictures = next((pair for _, pair in of.pairs() if not isinstance(pair, FlysimError)), None)
        if pictures is not None:
            given |= {"width": pictures[0].shape[1], "height": pictures[0].shape[0]}
    return plain_numbers(given, "the calibration given")
