"""The result of an evolution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array, transform


@dataclass(frozen=True, slots=True, kw_only=True)
class Generation:
    """One line of a swarm's history, after the selection of that generation.

    Attributes:
        best: highest fitness (unshared).
        mean: mean fitness of the preserved flies.
        settled: share of the places of selection held by settled flies, in [0, 1]: what the stop criterion reads.
        regions: flies that each image region holds.
    """

    best: float
    mean: float
    settled: float
    regions: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Swarm:
    """The flies that the last selection preserved and that sit on what both cameras see, fittest first.

    Attributes:
        points: `[N, 3]` float32 positions [m], left optical frame.
        fitness: `[N]` float32, unshared.
        uv: `[N, 2]` float32 projections in the left image [px].
        normals: `[N, 3]` float32 unit normals of the surface under each window, towards the camera.
        spread: `[N, 3]` float32 one standard deviation of each position [m], along its line of sight.
        patches: `[N, 4, 3]` float32 corners of the square of surface that each fly's window speaks for [m, left optical
            frame]: the window less its outermost pixels, on the fly's plane.
        uv_right: `[N, 2]` float32 projections in the right image [px].
        region: `[N]` int32 image region each fly was bred in.
        age: `[N]` int32 generations each fly has survived.
        history: one entry a generation.
        converged: the stop criterion was reached before the last allowed generation.
        reason: why the swarm is empty, or how the evolution ended; one sentence.
    """

    points: NDArray[np.float32]
    fitness: NDArray[np.float32]
    uv: NDArray[np.float32]
    normals: NDArray[np.float32]
    spread: NDArray[np.float32]
    patches: NDArray[np.float32]
    uv_right: NDArray[np.float32]
    region: NDArray[np.int32]
    age: NDArray[np.int32]
    history: tuple[Generation, ...]
    converged: bool
    reason: str

    @property
    def iterations(self) -> int:
        """Generations that ran."""
        return len(self.history)

    def to_frame(self, T_a_left: Array) -> Array:
        """`[N, 3]` float64 positions in frame a, `p_a = T_a_left @ p_left`."""
        return transform(T_a_left, self.points)
