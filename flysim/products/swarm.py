"""The result of an evolution."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array, transform
from flysim.products.tables import parquet, ply


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
        uv_right: `[N, 2]` float32 projections in the right image [px].
        region: `[N]` int32 image region each fly was bred in.
        age: `[N]` int32 generations each fly has survived.
        history: one entry a generation.
        converged: the stop criterion was reached before the last allowed generation.
        reason: why the swarm is empty, or how the evolution ended; one sentence.
        evaluations: flies that were bred and evaluated, over all generations.
        dropped: settled flies that a test at the end dropped, by the test: "out of view", "uniqueness", "left_right",
            "misfit", "an empty half" (`FlyParams` has what they ask); those that dropped none are not there.
        residual: what the windows of settled flies differ by where they fit best, as a share of their contrast; the
            median. 0.1 on clean pictures; noise, blur in one eye, compression or rows that do not meet raise it.
        plain: share of the left picture in which nothing changes along the rows: what is there no fly can see. None
            where nobody asked.
        rows_px, roll_deg: how much lower the right picture was found to lie than its rig says, and how far turned about
            its middle; both were taken from it before the flies evolved. None where nobody asked.
        softened_left_px, softened_right_px: deviations [px], along rows and columns, of the blur that the sharper
            picture got before the flies evolved, so that both are equally sharp.
    """

    points: NDArray[np.float32]
    fitness: NDArray[np.float32]
    uv: NDArray[np.float32]
    normals: NDArray[np.float32]
    spread: NDArray[np.float32]
    uv_right: NDArray[np.float32]
    region: NDArray[np.int32]
    age: NDArray[np.int32]
    history: tuple[Generation, ...]
    converged: bool
    reason: str
    evaluations: int = 0
    dropped: Mapping[str, int] = field(default_factory=dict)
    residual: float = 0.0
    plain: float | None = None
    rows_px: float | None = None
    roll_deg: float | None = None
    softened_left_px: tuple[float, float] = (0.0, 0.0)
    softened_right_px: tuple[float, float] = (0.0, 0.0)

    @property
    def iterations(self) -> int:
        """Generations that ran."""
        return len(self.history)

    def to_world(self, T_world_left: Array) -> Array:
        """`[N, 3]` float64 positions [m] in the world frame, `p_world = T_world_left @ p_left`; or in any other."""
        return transform(T_world_left, self.points)

    def to_parquet(self, path: str | Path) -> None:
        """Write a row a fly: x, y, z [m, left optical frame], fitness, u, v, u_right, v_right [px], region, age.

        Raises:
            OSError: the file cannot be written.
        """
        Path(path).write_bytes(parquet(self._columns()))

    def to_ply(self, path: str | Path) -> None:
        """Write a binary PLY cloud: x, y, z [m, left optical frame], nx, ny, nz, fitness.

        Raises:
            OSError: the file cannot be written.
        """
        names = ("x", "y", "z", "nx", "ny", "nz", "fitness")
        columns = np.column_stack([self.points, self.normals, self.fitness]).astype(np.float32).T
        Path(path).write_bytes(ply(dict(zip(names, columns, strict=True))))

    def _columns(self) -> dict[str, NDArray]:
        x, y, z = self.points.T
        u, v = self.uv.T
        u_right, v_right = self.uv_right.T
        places = {"x": x, "y": y, "z": z, "fitness": self.fitness, "u": u, "v": v, "u_right": u_right}
        columns = {**places, "v_right": v_right, "region": self.region, "age": self.age}
        return {name: np.ascontiguousarray(column) for name, column in columns.items()}
