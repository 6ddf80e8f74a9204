"""A folder of work in pieces: it appears with the first that is done, and who is stopped can go on with the next."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from flysim.common.held import hold
from flysim.common.whole_file import whole_file, write_whole
from flysim.common.whole_folder import Reserved, Taken, explained, reserved, whole_folder
from flysim.errors import RecordError
from flysim.foreign.data import read_json

LARGEST_FILE = 64 << 20  # [bytes]
LONGEST_VALUE = 60  # [characters] of what was asked for, in a message


class Growing:
    """The folder, and one JSON file in it that says what was asked for, what came of it, and whether that is all.

    Attributes:
        out: the folder.
        before: what the file said when this work began; None if it begins anew.
    """

    def __init__(
        self,
        place: Reserved | None,
        out: Path,
        file: str,
        asked: Mapping[str, Any],
        of: int,
        what: str,
        *,
        more: bool = False,
    ) -> None:
        self.out, self.before = out, None if place is not None else _read(out / file)
        self._place, self._file, self._asked, self._of, self._what = place, file, dict(asked), of, what
        self._more = more
        self._done = 0 if self.before is None else int(self.before["done"])
        if self.before is not None:
            self._check(self.before)

    def keep(
        self,
        data: Mapping[str, Any],
        done: int,
        pieces: Mapping[str, Mapping[str, bytes]] | None = None,
        files: Mapping[str, bytes] | None = None,
    ) -> None:
        """Takes over what is done by now: after this it is safe.

        Args:
            data: of the JSON file.
            done: pieces, failed ones too.
            pieces: folders to write, by their paths in `out`, each as its files by theirs. What has such a path already
                was never told of.
            files: to be written beside the JSON file, or to take the place of what they said before.

        Raises:
            RecordError: the disk is full, or another refusal of the system.
        """
        self._write(data, done, pieces or {}, files or {}, complete=False)

    def finish(
        self, data: Mapping[str, Any], drop: Iterable[str] = (), files: Mapping[str, bytes] | None = None
    ) -> None:
        """Says that this is all, and removes pieces that are not worth keeping; `files` as by `keep`.

        Raises:
            RecordError: as `keep`.
        """
        self._write(data, self._of, {}, files or {}, complete=True)
        for name in drop:
            shutil.rmtree(self.out / name, ignore_errors=True)

    @property
    def kept(self) -> str | None:
        """What to tell whoever stops the work; None while nothing is kept."""
        if self._place is not None and not self._place.kept:
            return None
        again = f"--out {self.out}" if self._more else "--resume"
        return f"{self._done} of {self._of} {self._what} are kept in {self.out}: the same command with {again} goes on"

    def _write(
        self,
        data: Mapping[str, Any],
        done: int,
        pieces: Mapping[str, Mapping[str, bytes]],
        files: Mapping[str, bytes],
        *,
        complete: bool,
    ) -> None:
        told = {**data, "asked": self._asked, "complete": complete, "done": done, "of": self._of}
        text = json.dumps(told, indent=1, allow_nan=False) + "\n"
        with explained(self.out):
            if self._place is not None and not self._place.kept:
                for name, content in pieces.items():
                    _write_files(self._place.room / name, content)
                _write_files(self._place.room, files)
                write_whole(self._place.room / self._file, text)
                self._place.keep()
            else:
                for name, content in pieces.items():
                    shutil.rmtree(self.out / name, ignore_errors=True)
                    with whole_folder(self.out / name) as room:
                        _write_files(room, content)
                _write_files(self.out, files)
                write_whole(self.out / self._file, text)
        self._done = done

    def _check(self, before: Mapping[str, Any]) -> None:
        if before["complete"] and not self._more:
            raise RecordError(
                f"{self.out} is complete, there is nothing to resume: name another folder with --out DIR."
            )
        for key, value in self._asked.items():
            if before["asked"].get(key) != value:
                was, now = (_short(v) for v in (before["asked"].get(key), value))
                raise RecordError(
                    f"{self.out} was begun with {key} {was}, not {now}: resume it with what it was begun with, "
                    "or name another folder with --out DIR."
                )
        if before["of"] != self._of and not self._more:
            raise RecordError(
                f"{self.out} was begun with {before['of']} {self._what}, not {self._of}: "
                "name another folder with --out DIR."
            )


@contextlib.contextmanager
def growing(
    outs: Iterable[Path],
    file: str,
    asked: Mapping[str, Any],
    of: int,
    what: str,
    *,
    resume: bool = False,
    more: bool = False,
) -> Iterator[Growing]:
    """A folder to keep finished work in; nobody else can have it meanwhile.

    Who interrupts the work is told, by a note on the KeyboardInterrupt, what is kept of it.

    Args:
        outs: names, the first free one of which is taken; to resume, the one.
        file: the JSON file's name.
        asked: what is done, as plain data: work is resumed with the same alone.
        of: how many pieces there will be.
        what: they are called: runs, episodes.
        resume: go on with what the folder holds, or begin where it holds nothing.
        more: what was asked for may be more or less than before, and a folder that is complete may grow on.

    Raises:
        RecordError: the folder cannot be had, or holds other work.
    """
    with contextlib.ExitStack() as stack:
        if resume:
            (out,) = outs = list(outs)
            if (out / file).is_file():
                stack.callback(os.close, _held(out))
                yield from _told(Growing(None, out, file, asked, of, what, more=more))
                return
        else:
            outs = _unfinished_refused(outs, file, what)
        place = stack.enter_context(reserved(outs))
        yield from _told(Growing(place, place.out, file, asked, of, what, more=more))


def _write_files(folder: Path, files: Mapping[str, bytes]) -> None:
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        with whole_file(folder / name) as part:
            part.write_bytes(content)


def _told(folder: Growing) -> Iterator[Growing]:
    try:
        yield folder
    except KeyboardInterrupt as stop:
        if folder.kept is not None:
            stop.add_note(folder.kept)
        raise


def _unfinished_refused(outs: Iterable[Path], file: str, what: str) -> Iterator[Path]:
    for out in outs:
        if (out / file).is_file():
            before = _read(out / file)
            if not before["complete"]:
                raise RecordError(
                    f"{out} holds {before['done']} of {before['of']} {what} of a work that was stopped: "
                    "go on with it by --resume, or name another folder with --out DIR."
                )
        yield out


def _held(out: Path) -> int:
    try:
        return hold(out.resolve())
    except BlockingIOError:
        raise Taken(f"{out} is being written by another run: name another folder with `--out DIR`") from None
    except OSError as error:
        raise RecordError(f"{out}: cannot use the folder: {error.strerror or error}.") from error


def _read(path: Path) -> dict[str, Any]:
    data = read_json(path, "record of what is done", LARGEST_FILE, RecordError)
    for key, kind in {"asked": dict, "complete": bool, "done": int, "of": int}.items():
        if not isinstance(data, dict) or not isinstance(data.get(key), kind):
            raise RecordError(f"{path}: cannot be resumed or replaced: it does not say what is '{key}'.")
    return data


def _short(value: Any) -> str:
    text = value if isinstance(value, str) else json.dumps(value)
    return text if len(text) <= LONGEST_VALUE else text[:LONGEST_VALUE] + "..."
