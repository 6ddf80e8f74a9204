"""Which estimate stands for which true obstacle, and what that makes of precision and recall."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from flysim.evaluate.lengths import Pieces, pieces
from flysim.geometry.frames import Array
from flysim.geometry.plan_view import axes
from flysim.products.cloud import FlyCloud
from flysim.products.obstacle import Obstacle
from flysim.truth.body import surface_distance
from flysim.truth.motion import Motion
from flysim.truth.obstacles import TrueObstacle
from flysim.worlds.model import World

GATE = 0.3  # [m] between centres
# [m] An estimate's centre may lie this far off the true footprint: a face seen alone makes a flat box.
MARGIN = 0.1
ON_STRUCTURE = 0.03  # [m] median distance of a cluster's flies to ground and walls
# [m] That all but 1 % of them keep: what reaches farther into the room claims something there.
OFF_STRUCTURE, ALL_BUT = 0.1, 0.99


@dataclass(frozen=True, slots=True, kw_only=True)
class Matching:
    """What became of every estimate, as indices of true obstacles and of estimates.

    Attributes:
        pairs: true obstacle -> estimate, visible ones and not; of a long structure, its largest piece.
        pieces: of long structures, all pieces and the share of the structure that they hold (`lengths`).
        found: how many visible true obstacles are in `pairs`, a long one by the share of it.
        visible: how many there are.
        false: estimates that stand for nothing.
        on_structure: estimates that lie on ground or walls: neither right nor wrong.
    """

    pairs: dict[int, int]
    pieces: Mapping[int, Pieces]
    found: float
    visible: int
    false: tuple[int, ...]
    on_structure: tuple[int, ...]

    @property
    def recall(self) -> float:
        """Share of the visible true obstacles that were found; 1 where none is visible."""
        return self.found / self.visible if self.visible else 1.0

    @property
    def precision(self) -> float:
        """Share of the estimates that stand for a true obstacle; those neither right nor wrong are left out.

        Where no estimate is left to judge: 1 if nothing was to be found, else 0.
        """
        claimed = self.found + len(self.false)
        return self.found / claimed if claimed else float(self.visible == 0)

    @property
    def f1(self) -> float:
        """Harmonic mean of precision and recall; 0 where both are 0."""
        return harmonic(self.precision, self.recall)


def harmonic(precision: float, recall: float) -> float:
    """2PR / (P + R), and 0 at P = R = 0."""
    return 2.0 * precision * recall / (precision + recall) if precision + recall > 0.0 else 0.0


def match(
    truth: Sequence[TrueObstacle],
    estimates: Sequence[Obstacle],
    *,
    world: World,
    motion: Motion,
    cloud: FlyCloud,
) -> Matching:
    """Pairs estimates with true obstacles so that the sum of their centre distances is least (Hungarian).

    An estimate may stand for a true obstacle when their centres are at most 0.3 m apart on the ground, or
    when its centre is over the true footprint widened by 0.1 m: a long obstacle seen in part has its centre
    elsewhere. Visible obstacles choose first. Ones that are not visible may take an estimate that is left,
    which is then neither right nor wrong; so is an estimate whose flies lie on structure. A long structure is found by
    the pieces that lie on it, as far as they hold it (`lengths.pieces`).
    """
    long = pieces(truth, estimates, world=world, motion=motion, cloud=cloud)
    taken = {j for held in long.values() for j in held.estimates}
    visible = [i for i, t in enumerate(truth) if t.visible and i not in long]
    hidden = [i for i, t in enumerate(truth) if not t.visible]
    pairs = assign(truth, visible, estimates, [j for j in range(len(estimates)) if j not in taken])
    found = len(pairs) + sum(held.share for held in long.values())
    left = [j for j in range(len(estimates)) if j not in taken and j not in pairs.values()]
    pairs |= {i: held.estimates[0] for i, held in long.items()}
    pairs |= assign(truth, hidden, estimates, left)
    left = [j for j in left if j not in pairs.values()]
    on_structure = [j for j in left if lies_on_structure(estimates[j], truth, world=world, motion=motion, cloud=cloud)]
    return Matching(
        pairs=dict(sorted(pairs.items())),
        pieces=long,
        found=found,
        visible=len(visible) + len(long),
        false=tuple(j for j in left if j not in on_structure),
        on_structure=tuple(on_structure),
    )


def assign(
    truth: Sequence[TrueObstacle], rows: list[int], estimates: Sequence[Obstacle], columns: list[int]
) -> dict[int, int]:
    """True obstacle -> estimate among the given ones, gated, of least total distance."""
    cost = np.array([[_cost(truth[i], estimates[j]) for j in columns] for i in rows]).reshape(len(rows), len(columns))
    # A pair out of the gate costs as much as one at its rim, so it never drives a good pair apart; it is
    # dropped after.
    chosen = zip(*linear_sum_assignment(cost), strict=True)
    return {rows[a]: columns[b] for a, b in chosen if cost[a, b] < 1.0}


def _cost(true: TrueObstacle, estimate: Obstacle) -> float:
    """Centre distance on the ground as a share of the farthest that may match; 1 where it may not."""
    offset = np.asarray(estimate.center[:2]) - true.center[:2]
    distance = float(np.linalg.norm(offset))
    half = true.size[:2] / 2.0
    over = np.linalg.norm(np.maximum(np.abs(axes(true.yaw) @ offset) - half, 0.0)) <= MARGIN
    farthest = max(GATE, float(np.linalg.norm(half)) + MARGIN)
    # A centre that is not finite compares false and is never matched.
    return min(distance / (farthest * (1.0 + 1e-9)), 1.0) if over or distance <= GATE else 1.0


def lies_on_structure(
    estimate: Obstacle, truth: Sequence[TrueObstacle], *, world: World, motion: Motion, cloud: FlyCloud
) -> bool:
    """Whether a cluster sits on ground or walls and nowhere else.

    Its median fly is within 3 cm of them, and nearer to no obstacle; and 99 % of them are within 10 cm of something
    that is there: a wall with a slab across the room is no wall.
    """
    flies = np.asarray(cloud.points[estimate.flies], dtype=np.float64).reshape(-1, 3)
    stops = cloud.stop[estimate.flies]
    if not len(flies):
        return False

    def distances(links: list[int]) -> Array:
        nearest = np.full(len(flies), np.inf)
        for i in links:
            points = motion.carry_all(i, stops, flies)
            np.minimum(nearest, surface_distance(world.links[i], motion.last[i], points), out=nearest)
        return nearest

    to_structure = distances([i for i, link in enumerate(world.links) if link.structure])
    if not np.median(to_structure) < ON_STRUCTURE:
        return False
    bodies = {i for t in truth for i in t.links if _reaches(t, motion.carry_all(t.links[0], stops, flies))}
    to_bodies = distances(sorted(bodies))
    if np.quantile(np.minimum(to_structure, to_bodies), ALL_BUT) > OFF_STRUCTURE:
        return False
    return bool(np.median(to_structure) <= np.median(to_bodies))


def _reaches(true: TrueObstacle, flies: Array) -> bool:
    """Whether some fly is near enough to the circle round the obstacle: a quick look before the exact one."""
    reach = np.linalg.norm(true.size[:2]) / 2.0 + ON_STRUCTURE
    return bool((np.linalg.norm(flies[:, :2] - true.center[:2], axis=1) <= reach).any())
