"""What a genetic operator is, and where one is found by its name: flysim's own, and what a user brings."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

from flysim.common.registry import Registry
from flysim.errors import FlysimError, did_you_mean

Kind = Literal["crossover", "mutation"]
ARGUMENTS = {
    "crossover": ("views", "rules", "one", "other", "state", "n"),
    "mutation": ("views", "rules", "one", "state", "n"),
}
OPERATORS = Registry(
    "operator",
    "flysim.operators",
    {
        "interpolate": "flysim.flies.operators:barycentric",
        "extrapolate": "flysim.flies.operators:barycentric",
        "image": "flysim.flies.operators:random_step",
        "metric": "flysim.flies.operators:random_step",
    },
)
KINDS: dict[str, Kind] = {
    "interpolate": "crossover",
    "extrapolate": "crossover",
    "image": "mutation",
    "metric": "mutation",
}  # of flysim's own, so that a name is told of the wrong kind before anything is imported


class Genes(NamedTuple):
    """A fly as operators see it.

    Attributes:
        u, v: left pixel; need not be whole, and may lie outside: then the child is drawn again.
        q: inverse depth there [1/m]; not above 0: behind the camera, and drawn again.
        qu, qv: slopes of inverse depth along u and v [1/m/px].
    """

    u: float
    v: float
    q: float
    qu: float
    qv: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Operator:
    """How a child comes of its parents.

    Attributes:
        function: compiled; returns the child's `Genes`. Its arguments are `views` (a record of `stereo.views`), `rules`
            (one of `rules.RULES`), one or two parents' `Genes`, and the random numbers `n` to `n + 10` of the stream
            `state` (`compute.randomness`: `gaussian(state, n, 0)`, `uniform(state, n)`).
        kind: "crossover" of two parents, or "mutation" of one.
    """

    function: Callable[..., Genes]
    kind: Kind

    def __post_init__(self) -> None:
        names = list(inspect.signature(getattr(self.function, "py_func", self.function)).parameters)
        if len(names) != len(ARGUMENTS[self.kind]):
            raise ValueError(
                f"a {self.kind} takes the {len(ARGUMENTS[self.kind])} arguments {', '.join(ARGUMENTS[self.kind])}; "
                f"{self.function.__name__} takes {', '.join(names) or 'none'}"
            )


def crossover(function: Callable[..., Genes]) -> Operator:
    """Makes a crossover of the function below it; `Operator` says what of."""
    return Operator(function=function, kind="crossover")


def mutation(function: Callable[..., Genes]) -> Operator:
    """Makes a mutation of the function below it; `Operator` says what of."""
    return Operator(function=function, kind="mutation")


def find_operator(kind: Kind, name: str) -> Operator:
    """The operator of a name, or of a `module:object`.

    Raises:
        FlysimError: there is none of that name, or what is there is none of that kind.
    """
    if KINDS.get(name, kind) != kind or (":" not in name and name not in OPERATORS.names):
        known = [one for one in OPERATORS.names if KINDS.get(one, kind) == kind]
        raise FlysimError(
            f"{kind} must be one of {', '.join(known)}, or an own one as module:object, got {name!r}. "
            f"{did_you_mean(name, known)}"
        )
    found: Any = OPERATORS.load(name)
    if not isinstance(found, Operator) or found.kind != kind:
        raise FlysimError(f"{kind} '{name}': write @{kind} above its function, see docs/extending.md.")
    return found
