"""A path as its flies tell it: hop by hop, with loops closed where the same things are seen again."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from flysim.geometry.frames import Array, Pose2, inverse, yaw_of
from flysim.localise.floor import laid
from flysim.localise.glimpse import Glimpse
from flysim.localise.graph import Tie, covariances, solved
from flysim.localise.hop import CLOSE_PX, FLIES, FLOOR, LEAST, Hop, hop
from flysim.localise.windows import looked_for
from flysim.products.frame import Frame
from flysim.products.located import Located
from flysim.products.swarm import Swarm

BACK = 3  # frames back that are tried until one is found again
LOOPS = 1  # older frames that it is then looked for in, at most
ON_THE_WAY = 3  # steps of the graph after a loop; in the end there are more
TRIED, FAR_M, TURNED = 6, 4.0, math.radians(70.0)  # of those that are asked how much they share: most, and least near
# How far odometry is trusted where flies tell nothing: deviations on a way of 1 m, a turn by 1 rad, and at the least.
WAY_M, WAY_DEG, TURN_DEG, LEAST_M, LEAST_DEG = 0.05, 5.0, 3.0, 0.01, 0.3
LARGEST = 4.0  # deviations that a loop may be off what is known already


class ByFlies:
    """A `Localiser`: the frames so far, where each is thought to have been taken, and what is known of their hops."""

    def __init__(self, *, rng: np.random.Generator) -> None:
        """Before the first frame, which is where odometry has it.

        Args:
            rng: for guesses of poses.
        """
        self._rng = rng
        self._glimpses: list[Glimpse] = []
        self._odometry: list[Array] = []
        self._poses = np.zeros((0, 3))
        self._ties: list[Tie] = []
        self._seconds = 0.0
        self._times: list[float] = []
        self._stops: dict[int, int] = {}  # place of the frame or picture of each
        self._effort = FLIES
        self._swarms: dict[int, Glimpse] = {}  # of one camera, by place: the flies that its pair gave

    def paired(self, frame: Frame) -> Frame:
        """How one camera was moved between two pictures, by the floor that both show: a frame with that rig."""
        began = time.perf_counter()
        rig, mounted = frame.pair.rig, frame.T_base_left
        self._effort = FLOOR
        T_world_other = frame.T_world_left @ inverse(rig.T_right_left) @ inverse(mounted)
        j = self._stops.get(frame.other) if frame.other is not None else None
        if j is None:
            then = frame.time if frame.other_time is None else frame.other_time
            j = self._enter(laid(frame.pair.right, rig.right, mounted), T_world_other, then, frame.other)
        k = self._enter(laid(frame.pair.left, rig.left, mounted), frame.T_world_base, frame.time, frame.index)
        T_other, T = self._placed(j, T_world_other), self._placed(k, frame.T_world_base)
        found = replace(rig, T_right_left=inverse(T_other @ mounted) @ T @ mounted)
        self._seconds += time.perf_counter() - began
        return replace(frame, pair=replace(frame.pair, rig=found))

    def add(self, frame: Frame, swarm: Swarm) -> Array:
        """Looks for one more frame in the one before, and in those that ought to show the same; where it was taken."""
        began, k = time.perf_counter(), None if frame.other is None else self._stops.get(frame.index)
        if k is None:
            k = self._enter(
                Glimpse.of(frame, swarm), frame.T_world_base, frame.time, None if frame.glance else frame.index
            )
        elif any(tie.robust and tie.b == k for tie in self._ties):  # of a pair as odometry has it they are too few
            self._swarms[k] = Glimpse.of(frame, swarm)
        self._seconds += time.perf_counter() - began
        return self._placed(k, frame.T_world_base)

    def _enter(self, glimpse: Glimpse, T_world_base: Array, then: float, stop: int | None) -> int:
        """One more frame or picture, looked for in those before; its place among them."""
        T, k = T_world_base, len(self._poses)
        self._glimpses.append(glimpse)
        self._odometry.append(np.array([T[0, 3], T[1, 3], yaw_of(T)]))
        self._times.append(then)
        if stop is not None:
            self._stops[stop] = k
        if k:
            told = between(self._odometry[k - 1], self._odometry[k])
            self._ties.append(Tie(k - 1, k, told, _by_wheels(told), robust=False))
            self._poses = np.vstack([self._poses, onwards(self._poses[k - 1], told)])
            self._find(k)
        else:
            self._poses = np.array([self._odometry[0]])
        return k

    def _placed(self, k: int, T_world_base: Array) -> Array:
        return placed(self._odometry[k], self._poses[k], T_world_base)

    def located(self) -> Located:
        """Where all frames were taken, and how sure that is."""
        began = time.perf_counter()
        poses, H = solved(self._poses, self._ties)
        found = [tie for tie in self._ties if tie.robust]
        # The other eye of a pair may be older than pictures that came before it.
        order = np.argsort(self._times, kind="stable")
        rank = np.argsort(order, kind="stable")
        stops = sorted((int(rank[k]), stop) for stop, k in self._stops.items())
        return Located(
            by="flies",
            times=np.array(self._times)[order],
            stops=tuple(k for k, _ in stops),
            numbers=tuple(stop for _, stop in stops),
            odometry=np.reshape(self._odometry, (-1, 3))[order],
            poses=poses[order],
            covariance=covariances(H)[order],
            hops=len(found),
            loops=sum(tie.b - tie.a > 1 for tie in found),
            lost=_lost([(int(rank[tie.a]), int(rank[tie.b])) for tie in found], len(order), stops),
            seconds=self._seconds + time.perf_counter() - began,
        )

    def _find(self, k: int) -> None:
        """Frame `k` in the one before, or in one that is a little further back, and then in older ones."""
        for j in range(k - 1, max(k - 1 - BACK, -1), -1):
            found = self._hop(j, k, None)
            if found is not None and self._believed(j, k, found):
                self._ties.append(Tie(j, k, found.pose, found.covariance, robust=True))
                self._poses[k] = onwards(self._poses[j], found.pose)
                break
        else:
            j = k
        if self._close_loops(j, k):
            self._poses, _ = solved(self._poses, self._ties, ON_THE_WAY)

    def _hop(self, j: int, k: int, near: float | None) -> Hop | None:
        believed = between(self._poses[j], self._poses[k])
        there, here = self._glimpses[j], self._glimpses[k]
        found = hop(there, here, believed, rng=self._rng, near=near, effort=self._effort)
        if found is None and j in self._swarms:  # a floor that shows nothing: flies of the pair before, the other way
            back = hop(here, self._swarms[j], between(self._poses[k], self._poses[j]), rng=self._rng, near=near)
            found = None if back is None else back.inverted()
        return found

    def _believed(self, j: int, k: int, found: Hop) -> bool:
        """Whether a hop may be by what the wheels tell; two cameras know better."""
        told = between(self._odometry[j], self._odometry[k])
        return self._effort is FLIES or _agree(told, found, _by_wheels(told))

    def _close_loops(self, known: int, k: int) -> bool:
        """Looks for frame `k` in those before `known` that ought to show the same; whether it was found in one."""
        seen = [(flies, j) for j in self._near(known, k) if (flies := self._shared(j, k)) >= LEAST]
        closed = False
        for _, j in sorted(seen, reverse=True)[:LOOPS]:
            doubt, believed = self._doubt(j, k), between(self._poses[j], self._poses[k])
            found = self._hop(j, k, None if doubt[2, 2] > math.radians(0.5) ** 2 else 2.0 * CLOSE_PX)
            if found is not None and _agree(believed, found, doubt):
                self._ties.append(Tie(j, k, found.pose, found.covariance, robust=True))
                closed = True
        return closed

    def _near(self, known: int, k: int) -> list[int]:
        """Frames before `known` that were taken near frame `k` and look its way, the nearest first."""
        off = self._poses[:known] - self._poses[k]
        far, turned = np.hypot(off[:, 0], off[:, 1]), np.abs((off[:, 2] + np.pi) % (2.0 * np.pi) - np.pi)
        near = np.flatnonzero((far < FAR_M) & (turned < TURNED))
        return near[np.argsort((far / FAR_M + turned / TURNED)[near], kind="stable")][:TRIED].tolist()

    def _shared(self, j: int, k: int) -> int:
        """Flies of frame `k` that the camera of frame `j` ought to see; 0 where it is far away."""
        believed = between(self._poses[j], self._poses[k])
        return len(looked_for(self._glimpses[j], self._glimpses[k], believed.matrix))

    def _doubt(self, j: int, k: int) -> Array:
        """`[3, 3]` how far the pose of frame `k` in frame `j` may be off: the sum of the surest hop of each frame."""
        total, end = np.zeros((3, 3)), self._poses[k]
        b = k
        while b > j:
            tie = min((one for one in self._ties if one.b == b), key=lambda one: np.trace(one.covariance))
            lever = between(self._poses[tie.b], end)
            far = math.hypot(lever.x, lever.y)
            spread = tie.covariance[0, 0] + tie.covariance[1, 1] + far**2 * tie.covariance[2, 2]
            total += np.diag([spread, spread, tie.covariance[2, 2]])
            b = tie.a
        return total


def _lost(found: Sequence[tuple[int, int]], n: int, stops: Sequence[tuple[int, int]]) -> tuple[int, ...]:
    """Stops on the way to which there are no hops, neither from the first frame nor from what hangs together."""
    hung = csr_matrix((np.ones(len(found)), ([a for a, _ in found], [b for _, b in found])), shape=(n, n))
    _, part = connected_components(hung, directed=False)
    first = [int(np.flatnonzero(part == one)[0]) for one in np.unique(part)]
    nearest = np.searchsorted([k for k, _ in stops], [k for k in first if k])
    return tuple(sorted({stops[min(k, len(stops) - 1)][1] for k in nearest.tolist()}))


def placed(odometry: Array, pose: Array, T_world_base: Array) -> Array:
    """`[4, 4]` a pose about one that odometry has, put where that one truly is thought to be."""
    return Pose2(*pose.tolist()).matrix @ inverse(Pose2(*odometry.tolist()).matrix) @ T_world_base


def between(a: Array, b: Array) -> Pose2:
    """Pose `b` `[3]` in the frame of pose `a`."""
    T = inverse(Pose2(*a.tolist()).matrix) @ Pose2(*b.tolist()).matrix
    return Pose2(float(T[0, 3]), float(T[1, 3]), yaw_of(T))


def onwards(a: Array, hop: Pose2) -> Array:
    """`[3]` the pose that is a hop away from pose `a`."""
    T = Pose2(*a.tolist()).matrix @ hop.matrix
    return np.array([T[0, 3], T[1, 3], yaw_of(T)])


def _by_wheels(hop: Pose2) -> Array:
    way, turn = math.hypot(hop.x, hop.y), abs(hop.yaw)
    place = LEAST_M + WAY_M * way
    heading = math.radians(LEAST_DEG + WAY_DEG * way + TURN_DEG * turn)
    side = place + heading * way
    return np.diag([side**2, side**2, heading**2])


def _agree(believed: Pose2, found: Hop, doubt: Array) -> bool:
    e = between(
        np.array([believed.x, believed.y, believed.yaw]), np.array([found.pose.x, found.pose.y, found.pose.yaw])
    )
    off = np.array([e.x, e.y, e.yaw])
    return float(off @ np.linalg.inv(doubt + found.covariance) @ off) < LARGEST**2
