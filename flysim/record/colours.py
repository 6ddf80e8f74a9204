"""One set of colours for the figures and the recording: what is true is blue, what is believed orange.

These two, black and grey stay apart for every kind of colour vision (Okabe and Ito, "Color Universal
Design", 2008).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

RGB = tuple[int, int, int]

TRUE: RGB = (0, 114, 178)
BELIEVED: RGB = (213, 94, 0)
FLY: RGB = (120, 120, 120)
STRUCTURE: RGB = (190, 190, 190)
ROBOT: RGB = (50, 60, 75)


def hexadecimal(rgb: RGB) -> str:
    """`#rrggbb`."""
    return "#{:02x}{:02x}{:02x}".format(*rgb)


def ranks(fitness: ArrayLike) -> NDArray[np.float64]:
    """`[N]` share of the flies that are less fit, 0 for the worst and 1 for the best.

    Fitness is heavy-tailed: coloured by its value, all flies but a few would look alike.
    """
    fitness = np.asarray(fitness)
    rank = np.empty(len(fitness))
    rank[np.argsort(fitness, kind="stable")] = np.arange(len(fitness))
    return rank / max(len(fitness) - 1, 1)


def by_fitness(fitness: ArrayLike) -> NDArray[np.uint8]:
    """`[N, 3]` viridis by rank: dark blue for the least fit, yellow for the fittest."""
    from matplotlib import colormaps

    return colormaps["viridis"](ranks(fitness), bytes=True)[:, :3]
