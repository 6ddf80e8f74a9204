"""Where compiled kernels outlive the process: in a folder named by all the sources they are made of.

numba's own cache knows the file of the outermost function alone: after a change in a function that it calls, the old
code goes on. Here any change among the sources is another folder, and the folders of older sources are cleared away.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import pickle
import re
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile

PACKAGE = Path(__file__).resolve().parents[1]
SHIPPED = PACKAGE / "__pycache__"  # where whoever installed flysim may have compiled it for all
USED_BY = "flysim.compute.compiled"  # who imports this has kernels
_IMPORT = re.compile(r"^\s*from (flysim[\w.]*) import (\([^)]*\)|.*)$|^\s*import (flysim[\w.]*)", re.MULTILINE)


def kernel_sources(package: Path = PACKAGE) -> dict[str, bytes]:
    """The sources that kernels are made of, by module: all that have some, and whatever those import of flysim.

    Args:
        package: the folder of flysim.
    """
    texts: dict[str, bytes] = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        texts[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path.read_bytes()
    used_by = USED_BY.encode()
    todo = [name for name, text in texts.items() if used_by in text and name != __name__]
    found: dict[str, bytes] = {}
    while todo:
        name = todo.pop()
        if name in found or name not in texts:
            continue
        found[name] = texts[name]
        for module, names, plain in _IMPORT.findall(texts[name].decode("utf-8", "replace")):
            todo += [plain] if plain else [module, *(f"{module}.{word}" for word in re.findall(r"\w+", names))]
    return dict(sorted(found.items()))


@lru_cache(maxsize=1)
def digest() -> str:
    """A digest of the sources of all kernels: it names the folder that they are kept in."""
    told = hashlib.sha256()
    for name, text in kernel_sources().items():
        told.update(f"{name} {len(text)}\n".encode() + text)
    return told.hexdigest()[:16]


@lru_cache(maxsize=1)
def folder() -> Path:
    """The folder for this process's kernels: in NUMBA_CACHE_DIR if that is set, else in the package.

    Where that cannot be written it is in the user's cache, else in the folder for temporary files; and where none of
    them can be, each process compiles for itself.
    """
    for base in _bases():
        place = base / _name()
        with contextlib.suppress(OSError):
            new = not place.exists()
            place.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=place).close()
            if new:
                _clear_older(place)
            return place
    return SHIPPED / _name()


def _bases() -> Iterator[Path]:
    if numba.config.CACHE_DIR:  # type: ignore[attr-defined]
        yield Path(numba.config.CACHE_DIR)  # type: ignore[attr-defined]
    yield SHIPPED
    with contextlib.suppress(RuntimeError):  # no home
        yield Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "flysim"
    # What lies there is run, and anybody may write beside it: a folder of this name that is not ours is left alone.
    with contextlib.suppress(OSError):
        base = Path(tempfile.gettempdir()) / f"flysim-kernels-{os.geteuid()}"
        base.mkdir(mode=0o700, exist_ok=True)
        about = base.lstat()
        if stat.S_ISDIR(about.st_mode) and about.st_uid == os.geteuid() and not about.st_mode & 0o022:
            yield base


def _name() -> str:
    """`kernels-<python>-<numba>-<where flysim is>-<sources>`: what differs in one of these does not meet."""
    where = hashlib.sha256(str(PACKAGE).encode()).hexdigest()[:8]
    return f"kernels-{sys.implementation.cache_tag}-{numba.__version__}-{where}-{digest()}"


def _clear_older(place: Path) -> None:
    """Removes what older sources have left beside a new folder."""
    kind = place.name.rpartition("-")[0]
    for old in place.parent.glob(f"{kind}-*"):
        if old != place:
            shutil.rmtree(old, ignore_errors=True)


class _Place:
    """What numba asks of a place for one function's code."""

    def __init__(self, function: Any) -> None:
        room = function.__module__.split(".")[-2]  # files of one name in two rooms are two
        self._told = f"{room}-{function.__code__.co_firstlineno}"

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> _Place:
        return cls(py_func)

    def get_cache_path(self) -> str:
        return str(folder())

    def get_source_stamp(self) -> str:
        return digest()

    def get_disambiguator(self) -> str:
        return self._told

    def ensure_cache_path(self) -> None:
        Path(self.get_cache_path()).mkdir(parents=True, exist_ok=True)


class _Impl(CompileResultCacheImpl):
    _locator_classes = [_Place]  # noqa: RUF012 (numba's own attribute)


class KernelCache(FunctionCache):
    """numba's cache of a function, in `folder()`; what goes wrong with it costs a compilation and nothing else."""

    _impl_class = _Impl

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The code for a signature, or None."""
        target_context.refresh()
        key = self._index_key(sig, target_context.codegen())
        for place in dict.fromkeys((self.cache_path, str(SHIPPED / _name()))):
            kept = IndexDataCacheFile(place, self._impl.filename_base, digest())
            with contextlib.suppress(Exception):  # a damaged file can raise anything: it is compiled anew
                data = kept.load(key)
                if data is not None:
                    return self._impl.rebuild(target_context, data)
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keeps the code for a signature.

        One process at a time: numba numbers the files of a function, and two that compile two variants of it would
        give both one number.
        """
        with contextlib.suppress(OSError):  # a full disk, or a folder that newer sources have cleared away
            self._impl.locator.ensure_cache_path()
            place = os.open(self.cache_path, os.O_RDONLY)
            try:
                fcntl.flock(place, fcntl.LOCK_EX)
                try:
                    super().save_overload(sig, data)
                except (pickle.UnpicklingError, EOFError, ValueError, TypeError):  # an index that is damaged
                    self.flush()
                    super().save_overload(sig, data)
            finally:
                os.close(place)
