"""Tells gymnasium of the environment, whichever of the two is imported first, and imports neither for the other's sake.

gymnasium's convention is that `import flysim` makes `gym.make("flysim/FlyNav-v0")` work. Importing gymnasium for that
takes 0.15 s, which who has no agents would pay for nothing.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from types import ModuleType

REGISTRY = "gymnasium.envs"  # the package that has read its own environments once it is imported


class _Watch:
    """Waits for gymnasium's registry to be imported, and registers ours with it."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Nothing that others do not find; of the registry, what they find, with a word to say at the end."""
        if fullname != REGISTRY or self not in sys.meta_path:
            return None
        sys.meta_path.remove(self)  # so that the others are asked, and each import but this one costs nothing
        spec = find_spec(fullname)
        if spec is None or spec.loader is None:
            return None
        execute = spec.loader.exec_module

        def then_register(module: ModuleType) -> None:
            execute(module)
            _register()

        spec.loader.exec_module = then_register  # type: ignore[method-assign]
        return spec


def register() -> None:
    """Registers the environment now, or as soon as gymnasium is imported."""
    if REGISTRY in sys.modules:
        _register()
    elif not any(isinstance(finder, _Watch) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Watch())


def _register() -> None:
    import flysim.nav  # noqa: F401  it registers, if it is not just being imported and about to
