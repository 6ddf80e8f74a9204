"""What a measure of fitness is, and where one is found by its name: flysim's own, and what a user brings."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

from flysim.common.registry import Registry
from flysim.errors import FlysimError, did_you_mean

OF = {
    "sums": ("gl", "gr", "n", "sl", "sr", "sll", "srr", "slr"),
    "difference": ("gl", "gr", "difference"),
}
MEASURES = Registry(
    "measure",
    "flysim.measures",
    {name: f"flysim.flies.fitness:{name}" for name in ("epipolar", "paper", "louchet", "zncc", "product")},
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Measure:
    """How alike the two windows of a fly are, as a number: the higher, the better it fits.

    Attributes:
        function: plain arithmetic, which is compiled. Never below 0, which is the mark of a rejected fly. Its
            arguments are those that `OF` has for `of`: `gl`, `gr` the gradients of both windows' centres
            [grey levels / px]; of "sums" the number `n` of samples of a window (pixels times colours) and the sums of
            L, R, L L, R R, L R over them; of "difference" the mean squared difference of the windows [grey levels^2].
        settled: fitness from which a fly counts as settled.
        of: "sums" for a measure of means and variances; "difference" for one of the difference alone, which takes half
            the time, and must fall as the difference grows.
        norm: the gradients are their norms, as eq. (1) is printed, and not along the epipolar line.
        limit: of "difference" alone: `(gl, gr, needed) -> difference`, above which the fitness is below `needed`. With
            it a window that cannot reach what is needed is not read to its end.
    """

    function: Callable[..., float]
    settled: float
    of: Literal["sums", "difference"] = "sums"
    norm: bool = False
    limit: Callable[[float, float, float], float] | None = field(default=None)

    def __post_init__(self) -> None:
        if self.of not in OF:
            raise ValueError(f"a measure is of 'sums' or of 'difference', got {self.of!r}")
        names = list(inspect.signature(getattr(self.function, "py_func", self.function)).parameters)
        if len(names) != len(OF[self.of]):
            raise ValueError(
                f"a measure of {self.of} takes the {len(OF[self.of])} arguments {', '.join(OF[self.of])}; "
                f"{self.function.__name__} takes {', '.join(names) or 'none'}"
            )
        if not self.settled >= 0.0:  # of NaN too
            raise ValueError(f"the settled fitness of a measure must be at least 0, got {self.settled}")
        if self.limit is not None and self.of != "difference":
            raise ValueError("a limit belongs to a measure of the difference alone")

    def __call__(self, *arguments: float) -> float:
        """What the function gives: in plain Python, to test it or to plot it."""
        return getattr(self.function, "py_func", self.function)(*arguments)


def measure(
    *,
    settled: float,
    of: Literal["sums", "difference"] = "sums",
    norm: bool = False,
    limit: Callable[[float, float, float], float] | None = None,
) -> Callable[[Callable[..., float]], Measure]:
    """Makes a measure of the function below it; `Measure` says what of."""

    def made(function: Callable[..., float]) -> Measure:
        return Measure(function=function, settled=settled, of=of, norm=norm, limit=limit)

    return made


def find_measure(name: str) -> Measure:
    """The measure of a name, or of a `module:object`.

    Raises:
        FlysimError: there is none of that name, or what is there is no measure.
    """
    if ":" not in name and name not in MEASURES.names:
        raise FlysimError(
            f"fitness must be one of {', '.join(MEASURES.names)}, or an own one as module:object, got {name!r}. "
            f"{did_you_mean(name, MEASURES.names)}"
        )
    found: Any = MEASURES.load(name)
    if not isinstance(found, Measure):
        raise FlysimError(
            f"measure '{name}' is {type(found).__name__}, not a measure: write @measure(settled=...) above its "
            "function, see docs/extending.md."
        )
    return found
