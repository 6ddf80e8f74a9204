"""A function that kernels call and a user brings: told by its type, so that what is compiled for it can be kept.

numba compiles a kernel anew for each type of its arguments, and keeps what it compiled by those types. A function that
is handed over as it is has a type of this process alone; here its type is its place and a digest of its sources.
"""

from __future__ import annotations

import ast
import hashlib
import inspect
import re
import secrets
import sys
import sysconfig
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

from numba import njit, typeof, types
from numba.core.errors import NumbaError
from numba.extending import NativeValue, models, overload, register_model, typeof_impl, unbox

from flysim.errors import FlysimError


class PluggedType(types.Opaque):
    """The type of a `Plugged`, as numba knows it: by this name it is found again in another process."""

    def __init__(self, place: str, digest: str) -> None:
        self.place = f"{place}@{digest}"
        super().__init__(name=f"plugged({self.place})")


register_model(PluggedType)(models.OpaqueModel)


@unbox(PluggedType)
def _unbox(typ: Any, value: Any, c: Any) -> NativeValue:
    return NativeValue(c.context.get_dummy_value())


class Plugged:
    """Something with a function in it, as an argument of kernels.

    Attributes:
        what: what `by_plugged` chooses by; has `function`, whose place and sources make the type.
    """

    def __init__(self, what: Any) -> None:
        self.what = what
        function = what.function
        self._numba_type_ = PluggedType(f"{function.__module__}:{function.__qualname__}", sources_digest(function))
        _KNOWN[self._numba_type_.place] = what


_KNOWN: dict[str, Any] = {}  # by place: a kernel is compiled only where its arguments are at hand


@typeof_impl.register(Plugged)
def _typeof(value: Plugged, context: Any) -> PluggedType:
    return value._numba_type_


def by_plugged(like: Callable[..., Any]) -> Callable[[Callable[[Any], Callable[..., Any]]], Any]:
    """Makes of `choose` a function for kernels: the way that `choose(what)` gives for its first argument, a `Plugged`.

    Args:
        like: a function with the arguments of all ways.
    """

    def decorate(choose: Callable[[Any], Callable[..., Any]]) -> Any:
        def chosen(plugged: Plugged, *arguments: Any) -> Any:  # compiled code never calls it
            return choose(plugged.what)(plugged, *arguments)

        def choice(plugged: Any, *arguments: Any) -> Any:
            return choose(_KNOWN[plugged.place])

        choice.__signature__ = inspect.signature(like)  # type: ignore[attr-defined]
        overload(chosen, jit_options={"error_model": "numpy"}, strict=False)(choice)
        return chosen

    return decorate


@lru_cache(maxsize=256)
def callable_in_kernels(function: Callable[..., Any]) -> Any:
    """A function compiled as a part of who calls it, and kept with that alone; or what is compiled already."""
    return function if hasattr(function, "py_func") else njit(error_model="numpy")(function)


def refuse_what_does_not_compile(plugged: Plugged, what: str, name: str, arguments: tuple[Any, ...]) -> None:
    """Compiles a user's function alone, so that what numba finds wrong with it is said in one line.

    Args:
        plugged: with the function in it.
        what: it is, as an error calls it.
        name: as the user typed it.
        arguments: as kernels call it with.

    Raises:
        FlysimError: it cannot be compiled.
    """
    function = callable_in_kernels(plugged.what.function)
    try:
        function.compile(tuple(map(typeof, arguments)))
    except NumbaError as error:
        lines = [line.strip() for line in re.sub(r"\x1b\[[0-9;]*m", "", str(error)).splitlines()]
        told = next((line for line in lines if line and not line.startswith("Failed in")), "it says nothing")
        line = plugged.what.function.__code__.co_firstlineno
        raise FlysimError(f"{what} '{name}' (line {line}): numba cannot compile it: {told}") from error
    except AttributeError:  # NUMBA_DISABLE_JIT=1: nothing is compiled
        return


def sources_digest(function: Callable[..., Any]) -> str:
    """Of the file of a function and of all that it imports from beside it; of flysim's own the kernels' cache knows.

    A function without a file, as one typed into a notebook has, gets another digest in each process.
    """
    module = sys.modules.get(function.__module__)
    if function.__module__.partition(".")[0] == "flysim":
        return "flysim"
    told = hashlib.sha256()
    paths = _sources(module)
    if not paths:
        return secrets.token_hex(8)
    for path in sorted(paths):
        told.update(path.read_bytes())
    return told.hexdigest()[:16]


def _sources(module: ModuleType | None) -> set[Path]:
    """The files of a module and of what those import, but for installed packages that are not the module's own."""
    found: set[Path] = set()
    todo = [module] if module is not None else []
    own = module.__name__.partition(".")[0] if module is not None else ""
    installed = [Path(sysconfig.get_path(name)) for name in ("stdlib", "purelib", "platlib")]
    while todo:
        one = todo.pop()
        file = getattr(one, "__file__", None)
        path = Path(file) if file else None
        if path is None or path.suffix != ".py" or path in found or not path.is_file():
            continue
        top = one.__name__.partition(".")[0]
        if top == "flysim" or (top != own and any(path.is_relative_to(place) for place in installed)):
            continue
        found.add(path)
        todo += [sys.modules[name] for name in _imported(path, one) if name in sys.modules]
    return found


def _imported(path: Path, module: ModuleType) -> set[str]:
    """Names of modules that a file may import; some of them are names in a module instead."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                package = (module.__package__ or "").split(".")
                base = ".".join([*package[: len(package) - node.level + 1], *filter(None, [base])])
            names |= {base, *(f"{base}.{alias.name}" for alias in node.names)}
    return names
