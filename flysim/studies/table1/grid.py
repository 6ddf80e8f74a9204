"""The grid of the paper's Table 1: operator sets, populations, regions, stop criteria."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

from flysim.flies.parameters import FlyParams

SETS = ("A", "B", "C")
POPULATIONS = (500, 1500, 3000, 5000)
REGIONS = (2, 4)
STOPS = (90, 95)
VARIED = ("operators", "population", "regions", "stop")  # of `FlyParams`


@dataclass(frozen=True, slots=True, order=True)
class Cell:
    """One setting of Table 1.

    Attributes:
        operators: "A", "B" or "C" (paper, section 4.1); `set` in JSON.
        population: flies.
        regions: parts into which the images are divided.
        stop: the stop criterion [%].
    """

    operators: str
    population: int
    regions: int
    stop: int

    def params(self, base: FlyParams) -> FlyParams:
        """The parameters of an evolution in this setting; all that Table 1 does not vary is `base`'s."""
        return replace(
            base,
            operators=self.operators,
            population=self.population,
            regions=self.regions,
            stop=self.stop / 100,
        )

    def __str__(self) -> str:
        return f"set {self.operators}, {self.population} flies, {self.regions} regions, {self.stop} %"


GRID = tuple(Cell(*setting) for setting in product(SETS, POPULATIONS, REGIONS, STOPS))

# Paper, section 5: "a population of 3000 flies, the use of the set C and an image division in four regions present the
# best results". It does not say at which stop criterion.
FAVOURITES = tuple(Cell("C", 3000, 4, stop) for stop in STOPS)
