"""Somebody else's program as an engine: `exec:./matcher {left} {right} {calib} {out}`, started once a frame.

No shell reads the command: it is split as a shell would split it, and what stands in braces is filled in. The program
gets a temporary folder with the pair and its calibration, leaves one file there, and is gone when the frame is done,
with all that it started.
"""

from __future__ import annotations

import contextlib
import os
import re
import select
import shlex
import shutil
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
from PIL import Image

from flysim.common.lifeline import Lifeline
from flysim.common.scratch import Scratch
from flysim.engines.disparity import check_disparities, disparity_swarm
from flysim.engines.points import points_swarm
from flysim.engines.settings import leading
from flysim.errors import EngineError, did_you_mean
from flysim.flies.parameters import FlyParams
from flysim.foreign.disparity import MAX_BYTES, parse_map
from flysim.foreign.files import read_bytes
from flysim.foreign.points import parse_ply
from flysim.geometry.calib_text import calib_text
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.plain import shown, shown_path
from flysim.products.frame import Frame
from flysim.products.swarm import Swarm

TIMEOUT_S = 60.0  # [s] for a frame, unless the command begins with timeout=SECONDS
LONGEST_S = 86400.0
FILES = {"left": "left.png", "right": "right.png", "calib": "calib.txt", "out": "out"}
PLACES = (*FILES, "ndisp")
NEEDED = ("left", "right", "out")
LAST_WORDS = 4096  # bytes of what it printed that are kept
_PLACE = re.compile(r"\{(\w*)\}")


class Program:
    """An `Engine` that is another program."""

    def __init__(self, command: str) -> None:
        """The program of a command, which is not started yet.

        Args:
            command: what follows `exec:`.

        Raises:
            EngineError: it lacks a place, has an unknown one, or there is no such program.
        """
        settings, rest = leading(command, {"timeout": (TIMEOUT_S, 1e-3, LONGEST_S)}, "exec:")
        self._timeout, self._name = settings["timeout"], f"exec:{command}"
        try:
            self._words = shlex.split(rest)
        except ValueError as error:
            raise EngineError(f"engine {shown(self._name)}: {str(error).lower()}. Close its quotes.") from None
        asked = {place for word in self._words for place in _PLACE.findall(word)}
        for place in sorted(asked.difference(PLACES)):
            raise EngineError(f"engine {shown(self._name)}: nothing fills '{{{place}}}'. {did_you_mean(place, PLACES)}")
        missing = [f"{{{place}}}" for place in NEEDED if place not in asked]
        if missing or not self._words:
            raise EngineError(
                f"engine {shown(self._name)}: it lacks {', '.join(missing)}. "
                "Write 'exec:./matcher {left} {right} {calib} {out}'."
            )
        if shutil.which(self._words[0]) is None:
            raise EngineError(f"engine exec: no program {shown(self._words[0])} that may be executed. Name one.")

    def begin(self, rig: StereoRig, params: FlyParams) -> None:
        """A new sequence: remembers its parameters; the program knows nothing of the frame before."""
        self._params = params

    def see(self, frame: Frame, *, rng: np.random.Generator) -> Swarm:
        """What the program makes of the frame's pair; takes nothing from `rng`.

        Raises:
            EngineError: it took too long, failed, or left no disparity map and no points.
        """
        del rng
        scratch = Scratch()
        try:
            return self._seen(frame, Path(scratch.name))
        finally:
            scratch.cleanup()

    def _seen(self, frame: Frame, folder: Path) -> Swarm:
        pair, where = frame.pair, f"frame {frame.index}: {shown(self._words[0])}"
        depths = {"min_depth": self._params.min_depth, "max_depth": self._params.max_depth}
        text = calib_text(pair.rig, **depths)
        (folder / FILES["calib"]).write_text(text, encoding="ascii")
        for side, image in (("left", pair.left), ("right", pair.right)):
            Image.fromarray(image).save(folder / FILES[side], compress_level=1)
        places = {place: str(folder / name) for place, name in FILES.items()}
        places["ndisp"] = next(line[6:] for line in text.splitlines() if line.startswith("ndisp="))
        words = [_PLACE.sub(lambda found: places[found[1]], word) for word in self._words]
        _run(words, self._timeout, where)
        return _swarm(folder, pair, self._params, where)


def _run(words: list[str], timeout: float, where: str) -> None:
    """Runs a program to its end, and then ends what it started.

    Raises:
        EngineError: it cannot be started, does not end in time, or fails.
    """
    line = Lifeline()
    try:
        process = line.start_guarded(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    except OSError as error:
        raise EngineError(f"{where} cannot be started: {error.strerror}.") from error
    try:
        said = _listen(process, time.monotonic() + timeout)
        if said is None:
            raise EngineError(
                f"{where} had not ended after {timeout:g} s. Mend it, or begin with exec:timeout=SECONDS."
            )
        code = process.wait()
        if code:
            with contextlib.suppress(ValueError):
                raise EngineError(f"{where} was ended by {signal.Signals(code - 128).name}{said}.")
            raise EngineError(f"{where} ended with code {code}{said}.")
    finally:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        line.cut()
        assert process.stdout is not None
        process.stdout.close()


def _listen(process: subprocess.Popen[bytes], until: float) -> str | None:
    """The last line that it printed, as ": line"; None where it had not ended by then."""
    assert process.stdout is not None
    pipe, last = process.stdout.fileno(), b""
    waiting = select.poll()
    waiting.register(pipe, select.POLLIN)
    while (left := until - time.monotonic()) > 0.0:
        if process.poll() is not None and not waiting.poll(0):
            break  # a child that it left behind holds the pipe
        if not waiting.poll(min(left, 0.2) * 1000.0):
            continue
        chunk = os.read(pipe, 65536)
        if not chunk:
            try:
                process.wait(max(until - time.monotonic(), 0.01))
            except subprocess.TimeoutExpired:
                return None
            break
        last = (last + chunk)[-LAST_WORDS:]
    else:
        return None
    lines = [line for line in last.decode("utf-8", "replace").splitlines() if line.strip()]
    return ": " + lines[-1].strip().rstrip(".") if lines else ""


def _swarm(folder: Path, pair: ImagePair, params: FlyParams, where: str) -> Swarm:
    """What a program left.

    Raises:
        EngineError: nothing, or nothing that can be read.
    """
    found = [path for path in sorted(folder.glob("out*")) if path.is_file() and not path.is_symlink()]
    if len(found) != 1:
        got = "no file" if not found else f"{len(found)} files"
        raise EngineError(
            f"{where} left {got} at {{out}}. Write one disparity map (PFM, PNG, .npy), or a PLY of points."
        )
    data = read_bytes(found[0], "result", MAX_BYTES, EngineError)
    name = shown_path(found[0].name)
    try:
        if data.startswith(b"ply"):
            points = parse_ply(data)
            return points_swarm(pair, params, points[np.isfinite(points).all(axis=1)], name="the program")
        disparity = parse_map(data)
    except ValueError as refusal:
        raise EngineError(f"{where} left {name}, which cannot be read: {refusal}.") from None
    check_disparities(pair.rig, "exec")
    if disparity.shape != pair.left.shape[:2]:
        got, asked = ("x".join(map(str, shape[1::-1])) for shape in (disparity.shape, pair.left.shape))
        raise EngineError(
            f"{where} left a map of {got} px for a pair of {asked} px. Give one of the left image's size."
        )
    return disparity_swarm(pair, params, disparity, name="the program")
