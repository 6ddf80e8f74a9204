"""Whatever has a name is found here: what flysim brings, what an installed package adds, and `module:object` as typed.

A registry maps names to places, such as "flysim.engines.matchers:sgbm", and imports a place when it is first asked for
what is there: to know a name costs nothing. A package adds names by entry points of the registry's group
(https://packaging.python.org/specifications/entry-points/); `docs/extending.md` has an example of each.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module, metadata
from pathlib import Path
from typing import Any

from flysim.errors import FlysimError, did_you_mean
from flysim.plain import shown

FLYSIM = "flysim"  # the origin of what is built in


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A name that a registry knows.

    Attributes:
        name: as a user types it.
        place: "module:object".
        origin: "flysim", or the package that adds it, with its version.
    """

    name: str
    place: str
    origin: str


class Registry:
    """One kind of thing that a user chooses by name."""

    def __init__(
        self,
        what: str,
        group: str,
        builtin: Mapping[str, str],
        error: type[FlysimError] = FlysimError,
        *,
        schemes: Mapping[str, str] | None = None,
    ) -> None:
        """A registry that knows what flysim brings, and looks for more when it is asked for more.

        Args:
            what: what it holds, as an error calls one of them: "engine".
            group: of the entry points by which packages add to it: "flysim.engines".
            builtin: name -> "module:object", in the order in which they are told.
            error: raised where there is nothing of a name.
            schemes: what a name may begin with before a colon, for things outside of Python -> "module:object" of what
                is called with the rest of the name: "exec" makes "exec:./matcher" a name.
        """
        self.what, self.group, self.schemes = what, group, dict(schemes or {})
        self._builtin, self._error = dict(builtin), error

    @property
    def builtin(self) -> tuple[str, ...]:
        """The names that flysim brings."""
        return tuple(self._builtin)

    def entries(self) -> tuple[Entry, ...]:
        """All that has a name: flysim's own first, whose names nobody else can take, then what packages add."""
        own = (Entry(name=name, place=place, origin=FLYSIM) for name, place in self._builtin.items())
        return (*own, *(entry for entry in _installed(self.group) if entry.name not in self._builtin))

    @property
    def names(self) -> tuple[str, ...]:
        """The names of `entries`."""
        return tuple(entry.name for entry in self.entries())

    def scheme(self, name: str) -> tuple[str, str] | None:
        """Which of `schemes` a name begins with, and the rest of it; None where it begins with none."""
        first, colon, rest = name.partition(":")
        return (first, rest) if colon and first in self.schemes else None

    def check(self, name: str) -> str:
        """The name, if something has it, or it has the form of `module:object` or a scheme; nothing is imported.

        Raises:
            FlysimError: of the registry's kind; nothing has that name, and the message has the nearest one.
        """
        self._place(name)
        return name

    def load(self, name: str) -> Any:
        """What is at a name or at a `module:object`, imported if it was not yet; of a scheme, what takes the rest.

        Raises:
            FlysimError: of the registry's kind; nothing has that name, or its module cannot be imported.
        """
        module, _, path = self._place(name).partition(":")
        if name not in self._builtin and self.scheme(name) is None:
            _let_find_here()
        try:
            found: Any = import_module(module)
        except Exception as error:  # a user's module may fail in any way
            raise self._error(f"{self.what} {shown(name)}: {_why(module, error)}") from error
        for step in path.split("."):
            if not hasattr(found, step):
                public = (
                    [other for other in vars(found) if not other.startswith("_")] if hasattr(found, "__dict__") else []
                )
                raise self._error(f"{self.what} {shown(name)}: no '{step}' in {module}. {did_you_mean(step, public)}")
            found = getattr(found, step)
        return found

    def _place(self, name: str) -> str:
        if name in self._builtin:
            return self._builtin[name]
        if (scheme := self.scheme(name)) is not None:
            return self.schemes[scheme[0]]
        module, colon, path = name.partition(":")
        if colon:
            if all(part.isidentifier() for part in (*module.split("."), *path.split("."))):
                return name
            raise self._error(f"{self.what} {shown(name)}: write module:object, as in mypkg.mine:{self.what}.")
        for entry in self.entries():
            if entry.name == name:
                return entry.place
        raise self._error(f"no {self.what} {shown(name)}. {did_you_mean(name, self.names)}")


@cache
def _installed(group: str) -> tuple[Entry, ...]:
    """What installed packages add to a group, by name; looked for once a process."""
    points: Iterable[metadata.EntryPoint] = metadata.entry_points(group=group)
    found = {}
    for point in sorted(points, key=lambda point: (point.name, point.value)):
        origin = f"{point.dist.name} {point.dist.version}" if point.dist is not None else "unknown"
        found.setdefault(point.name, Entry(name=point.name, place=point.value.split("[")[0].strip(), origin=origin))
    return tuple(found.values())


def _let_find_here() -> None:
    """Lets the folder that flysim was started in be imported from, as `python -m` does; installed packages go first."""
    here = str(Path.cwd())
    if "" not in sys.path and here not in sys.path:
        sys.path.append(here)


def _why(module: str, error: Exception) -> str:
    if isinstance(error, ModuleNotFoundError) and error.name and f"{module}.".startswith(f"{error.name}."):
        return f"no module '{error.name}'. Install it, or start flysim in the folder that holds it."
    return f"its module {module} cannot be imported: {type(error).__name__}: {error}."
