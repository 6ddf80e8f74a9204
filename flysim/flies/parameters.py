"""The parameters of an evolution: names, units, ranges, and where each default comes from."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

from flysim.errors import FlysimError
from flysim.flies.measure import MEASURES, find_measure
from flysim.flies.operator import KINDS, find_operator
from flysim.flies.tuning import RefineParams, SearchParams

# Paper, section 4.1: shares of selection, crossover, mutation and immigration.
OPERATOR_SETS: dict[str, tuple[float, float, float, float]] = {
    "A": (0.4, 0.1, 0.4, 0.1),
    "B": (0.5, 0.2, 0.2, 0.1),
    "C": (0.4, 0.2, 0.2, 0.2),
}
MIN_POPULATION, MAX_POPULATION = 10, 1_000_000
MAX_WINDOW = 31
MAX_REGIONS = 16  # along each side of the image
_CHOICES = {"prefilter": ("gradient", "none"), "parents": ("uniform", "tournament"), "tails": ("gaussian", "heavy")}

Shares = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class FlyParams:
    """How a swarm evolves. Refuses nonsense with a ValueError that names the figure.

    Attributes:
        population: flies. 3000 with set C in 4 regions is what the paper concludes with; its navigation runs use 5000
            of set A.
        operators: "A", "B" or "C" (paper, section 4.1), or four shares (selection, crossover, mutation,
            immigration) that sum to 1.
        regions: image divisions: 1, 2 (left and right half), 4 (quadrants), as in the paper's Table 1, or
            (rows, columns).
        fitness: "epipolar" (eq. 1 with the gradient along the epipolar line), "paper" (eq. 1 as printed, which
            gathers flies on edges that run along the baseline), "louchet", "zncc", "product" (`fitness.py` has the
            formulas), or an own one as `module:object`. Measured on renders and photographs: as good as "product",
            closely followed by "louchet"; of the flies on photographs 6 % fewer are within a pixel with "paper", 14 %
            fewer with "zncc".
        prefilter: "gradient": flies compare derivatives along the rows, each picture in its own unit, so that exposure
            and contrast of either eye count for nothing; "none": the grey levels as they are. Eq. (1) as printed
            (`fitness = "paper"`) and pairs whose rows do not meet always take them as they are.
        blur_px: standard deviation of the smoothing in that derivative [px]; None: by the picture's own noise, at
            least 1.
        window: side of the square neighbourhood N of eq. (1) [px], odd. Median error on renders: 0.025 px with 5,
            0.020 with 7, 0.016 with 9; a larger one takes longer and bridges narrow things.
        sharing_cell: side of the cells in which flies share their fitness [px]; None: as many cells as flies are
            preserved, so that each can have a cell of its own.
        sharing_strength: a fly's fitness is divided by its rank in its cell to this power; 0 turns sharing off. With 2
            a fifth fewer flies settle on photographs, and no more of the image is covered.
        parents: "uniform" (any of the preserved flies of a region) or "tournament" (the fitter of two). The latter ends
            after 8 or 9 generations instead of 10, but covers less: on seed 0 of `paper_c` a dimension is 3.6 cm off
            instead of 2.0.
        crossover: "interpolate" (between the parents, as the paper) or "extrapolate" (to half their distance beyond),
            or an own one as `module:object`.
            The latter covers 4 to 8 % more of a render's textured cells.
        mutation: "image" (in pixels and inverse depth) or "metric" (in x, y, z, as the paper), or an own
            one as `module:object`.
        tails: of a mutation's steps: "gaussian" or "heavy" (a normal over a uniform number).
        mutation_px: standard deviation of an image mutation sideways [px]; None: one sharing cell, so that children
            land in cells their parents have not filled.
        mutation_disparity_px: standard deviation of an image mutation in disparity [px]; with 3 px a third of the
            flies on a thin post of `yard` are lost.
        mutation_m: standard deviation of a metric mutation, each coordinate [m].
        slant: steepest disparity slope that is bred [px/px]; 0 breeds the paper's flies, whose windows all face the
            camera and starve on the sides and the top of a box.
        polish: Gauss-Newton steps on a child that promises to survive; 0 leaves all to chance. On a render of `paper`
            one step ends an evolution after 9 generations instead of 17.
        stop: evolution ends once this share of the settled flies of now were there two generations ago already: their
            number has levelled out (paper: 0.90 and 0.95 of a threshold it does not state); 1: never before
            `max_iterations`. Thin things are found late: a higher share is patience with them.
        settled_fitness: fitness from which a fly is settled; None: what the measure of fitness has for it. Eq. (1) is
            scaled so that a fitness of 1 / e^2 is what a misplacement by e pixels leaves on a window with the gradient
            of its centre.
        max_iterations: generations after which evolution ends in any case.
        min_depth: nearest depth searched [m].
        max_depth: farthest depth searched [m].
        misfit: a fly is dropped at the end if its whole window differs by more than a shift of this many pixels
            would explain; 0 turns the test off. On renders of `yard` and `corridor` 0.3 drops 6 of 7 flies that hang
            over a silhouette, and 3 % of the others.
        uniqueness: a fly is dropped if another place on its epipolar line matches better than this many
            times its own difference; 0 turns the test off.
        left_right: a fly is dropped if the best match of its right pixel in the left image lies further than this from
            it [px]; 0 turns the test off. Off: on photographs it drops 1 fly in 100, and no more wrong ones than right.
        align: whether the engine asks the flies of a sequence's first frames if the rows of both eyes meet, and makes
            them meet where they do not. Rigs that are not level are taken as they are.
        carry_below: flies that sit on what stands, lower than this above the floor [m], are carried along to the next
            frame and bred from there; 0: each frame begins anew. The environment has its robot's height.
        search: of the generations, what was measured once.
        refine: of the last refinement and its tests, the same.
    """

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012 (how a scenario file reads this record)

    population: int = 3000
    operators: str | Shares = "C"
    regions: int | tuple[int, int] = 4
    fitness: str = "epipolar"
    prefilter: Literal["gradient", "none"] = "gradient"
    blur_px: float | None = None
    window: int = 7
    sharing_cell: int | None = None
    sharing_strength: float = 1.0
    parents: Literal["uniform", "tournament"] = "uniform"
    crossover: str = "extrapolate"
    mutation: str = "image"
    tails: Literal["gaussian", "heavy"] = "gaussian"
    mutation_px: float | None = None
    mutation_disparity_px: float = 1.0
    mutation_m: float = 0.05
    slant: float = 1.0
    polish: int = 1
    stop: float = 0.9
    settled_fitness: float | None = None
    max_iterations: int = 40
    min_depth: float = 0.5
    max_depth: float = 4.0
    misfit: float = 0.3
    uniqueness: float = 1.2
    left_right: float = 0.0
    align: bool = True
    carry_below: float = 0.0
    search: SearchParams = field(default_factory=SearchParams)
    refine: RefineParams = field(default_factory=RefineParams)

    def __post_init__(self) -> None:
        _between("population", self.population, MIN_POPULATION, MAX_POPULATION, " flies")
        if isinstance(self.operators, str):
            if self.operators not in OPERATOR_SETS:
                raise ValueError(f"operators must be A, B, C or four shares, got {self.operators!r}")
        else:
            shares = tuple(float(share) for share in self.operators)
            if len(shares) != 4 or not all(0.0 <= s <= 1.0 for s in shares) or abs(sum(shares) - 1.0) > 1e-6:
                raise ValueError(f"operators must be four shares in [0, 1] that sum to 1, got {self.operators!r}")
            if not 0.0 < shares[0] < 1.0:
                raise ValueError(f"the share of selection must be in (0, 1), got {shares[0]}")
            object.__setattr__(self, "operators", shares)
        if not isinstance(self.regions, int):
            object.__setattr__(self, "regions", tuple(self.regions))
        sides = self.regions if isinstance(self.regions, tuple) else ()
        if self.regions not in (1, 2, 4) and not (len(sides) == 2 and all(1 <= n <= MAX_REGIONS for n in sides)):
            raise ValueError(f"regions must be 1, 2, 4 or (rows, columns) up to {MAX_REGIONS}, got {self.regions}")
        _check_plugins(self.fitness, self.crossover, self.mutation)
        for name, known in _CHOICES.items():
            if getattr(self, name) not in known:
                raise ValueError(f"{name} must be one of {', '.join(known)}, got {getattr(self, name)!r}")
        _between("window", self.window, 3, MAX_WINDOW, " px")
        if self.window % 2 == 0:
            raise ValueError(f"window must be odd, got {self.window} px")
        if self.blur_px is not None:
            _between("blur_px", self.blur_px, 0.3, 10.0, " px")
        if self.sharing_cell is not None:
            _between("sharing_cell", self.sharing_cell, 1, 512, " px")
        _between("sharing_strength", self.sharing_strength, 0.0, 100.0, "")
        if self.mutation_px is not None:
            _between("mutation_px", self.mutation_px, 1e-3, 1e3, " px")
        _between("mutation_disparity_px", self.mutation_disparity_px, 0.0, 1e3, " px")
        _between("mutation_m", self.mutation_m, 1e-6, 1e3, " m")
        _between("slant", self.slant, 0.0, 10.0, " px/px")
        _between("polish", self.polish, 0, 100, " steps")
        _between("stop", self.stop, 1e-6, 1.0, "")
        if self.settled_fitness is not None:
            _between("settled_fitness", self.settled_fitness, 0.0, 1e9, "")
        _between("max_iterations", self.max_iterations, 1, 100_000, "")
        _between("min_depth", self.min_depth, 1e-3, 1e4, " m")
        _between("max_depth", self.max_depth, 1e-3, 1e5, " m")
        if self.max_depth <= self.min_depth:
            raise ValueError(f"max_depth must be > min_depth = {self.min_depth} m, got {self.max_depth} m")
        _between("misfit", self.misfit, 0.0, 100.0, " px")
        _between("uniqueness", self.uniqueness, 0.0, 100.0, "")
        _between("left_right", self.left_right, 0.0, 100.0, " px")
        _between("carry_below", self.carry_below, 0.0, 100.0, " m")

    def cell(self, width: int, height: int) -> int:
        """Side of a sharing cell [px] in an image of that size."""
        if self.sharing_cell is not None:
            return self.sharing_cell
        return max(2, round(math.sqrt(width * height / (self.population * self.shares[0]))))

    @property
    def shares(self) -> Shares:
        """Selection, crossover, mutation, immigration; they sum to 1."""
        return OPERATOR_SETS[self.operators] if isinstance(self.operators, str) else self.operators


def _check_plugins(fitness: str, crossover: str, mutation: str) -> None:
    """Refuses names that nothing has; a user's own are loaded, so that what is wrong with them is said at once."""
    try:
        if fitness not in MEASURES.builtin:
            find_measure(fitness)
        if KINDS.get(crossover) != "crossover":
            find_operator("crossover", crossover)
        if KINDS.get(mutation) != "mutation":
            find_operator("mutation", mutation)
    except FlysimError as error:
        raise ValueError(str(error).rstrip(".")) from error


def _between(name: str, value: float, low: float, high: float, unit: str) -> None:
    if not low <= value <= high:  # of NaN too
        raise ValueError(f"{name} must be in [{low}, {high}]{unit}, got {value}")
