"""How the robot stood in one frame as seen from another: the pose on the floor that brings flies to their windows."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array, Pose2, inverse, transform
from flysim.localise.glimpse import Glimpse
from flysim.localise.windows import CELLS, MOST, FoundAgain, found_again, looked_for

STEPS, SETTLING = 4, 5  # of Gauss and Newton for each of them, and in the end
NEAR_PX = 3.0  # of a window from where a guessed pose has it
PIXEL_PX = 0.25  # deviation of a window that was found, at whole size
TOGETHER = 4.0  # windows on one surface err together: as if there were so many times fewer
LARGEST = 3.0  # deviations that a window may be off
LEAST = 15  # windows that agree, for a hop to be believed
CLOSE_PX, FAR_PX = 5.0, 60.0  # of the searches, first and second


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How many windows a hop is told by.

    Attributes:
        rough: that are looked for in the small pictures.
        most: that are looked for at whole size.
        cells: that a picture has across, for windows evenly spread.
        tries: sets of windows that a pose is guessed from.
        together: windows of such a set; two tell a pose.
        guessed: share of the windows found in the small pictures that agree, for a guess to be gone on with.
        share: of the windows found that agree, for a hop to be believed.
    """

    rough: int = 64
    most: int = MOST
    cells: int = CELLS
    tries: int = 64
    together: int = 3
    guessed: float = 0.3
    share: float = 0.3


FLIES = Effort()
# Much of what is laid on the floor stands on it, or looks another way from there: many are asked, few agree at first.
# Where the floor is bare, what stands on it may agree on a pose that is none: there it was a quarter of what was found.
FLOOR = Effort(rough=250, most=400, cells=24, tries=512, together=2, guessed=0.08)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hop:
    """A pose of base_link in an earlier frame's base_link, as flies tell it.

    Attributes:
        pose: x, y [m], yaw [rad].
        covariance: `[3, 3]` of those.
        agreed: windows that it rests on.
        found: windows that were found at all.
    """

    pose: Pose2
    covariance: Array
    agreed: int
    found: int

    def inverted(self) -> Hop:
        """The pose of the earlier frame in the later one."""
        c, s, x, y = math.cos(self.pose.yaw), math.sin(self.pose.yaw), self.pose.x, self.pose.y
        J = np.array([[-c, -s, s * x - c * y], [s, -c, c * x + s * y], [0.0, 0.0, -1.0]])
        pose = Pose2(-c * x - s * y, s * x - c * y, -self.pose.yaw)
        return replace(self, pose=pose, covariance=J @ self.covariance @ J.T)


def hop(
    there: Glimpse,
    here: Glimpse,
    believed: Pose2,
    *,
    rng: np.random.Generator,
    near: float | None = None,
    effort: Effort = FLIES,
) -> Hop | None:
    """Where `here` was taken, in base_link of `there`; None where too few of its flies are found again there.

    Args:
        there: the earlier frame.
        here: the later one.
        believed: what is known of it so far.
        rng: for the guesses.
        near: how far off a window may be by that [px]; None: as far as odometry may go astray, which costs a search in
            smaller pictures first.
        effort: how many windows are asked.
    """
    pose, radius = believed, near
    if near is None:
        flies = looked_for(there, here, believed.matrix, effort.rough, effort.cells)
        if len(flies) < LEAST:
            return None
        first = found_again(there, here, believed.matrix, flies, radius=FAR_PX, coarse=True)
        rough = _guessed(there, here, first, believed, rng, effort)
        if rough is None:
            return None
        pose, radius = rough, CLOSE_PX
    settled = None
    # The second time windows are bent as the first one's pose has it.
    for most, reach in ((effort.most // 2, radius or CLOSE_PX), (effort.most, CLOSE_PX)):
        flies = looked_for(there, here, pose.matrix, most, effort.cells)
        matches = found_again(there, here, pose.matrix, flies, radius=reach, coarse=False)
        settled = _settled(there, here, matches, pose, effort)
        if settled is None:
            return None
        pose = settled.pose
    return settled


def _guessed(
    there: Glimpse, here: Glimpse, matches: FoundAgain, believed: Pose2, rng: np.random.Generator, effort: Effort
) -> Pose2 | None:
    """The pose that most windows agree with, of those that a few of them tell."""
    n, tries = len(matches.fly), effort.tries
    if n < LEAST:
        return None
    sets = np.argsort(rng.random((tries, n)), axis=1)[:, : effort.together]
    points = here.points[matches.fly]
    x: Array = np.tile([believed.x, believed.y, believed.yaw], (tries, 1))
    for _ in range(STEPS):
        uv, J = _projected(there, points[sets], x)
        e = (uv - matches.uv[sets]).reshape(tries, -1, 1)
        J = J.reshape(tries, -1, 3)
        Jt = J.transpose(0, 2, 1)
        x -= np.linalg.solve(Jt @ J + np.eye(3), Jt @ e)[..., 0]
    off = np.linalg.norm(_projected(there, points[None].repeat(tries, 0), x)[0] - matches.uv, axis=2)
    limit = NEAR_PX * 2.0**there.halvings / 2.0
    votes = np.minimum(off / limit, 1.0).sum(axis=1)  # the least is the best
    best = int(np.argmin(votes))
    agreed = int((off[best] < limit).sum())
    if agreed < LEAST or agreed < effort.guessed * n:
        return None
    return Pose2(*x[best].tolist())


def _settled(there: Glimpse, here: Glimpse, matches: FoundAgain, pose: Pose2, effort: Effort) -> Hop | None:
    """By weighted least squares from a pose nearby."""
    points, spread = here.points[matches.fly], here.spread[matches.fly]
    x, good = np.array([pose.x, pose.y, pose.yaw]), np.ones(len(points), np.bool_)
    H = np.zeros((3, 3))
    for k in range(SETTLING):
        (uv, J), (moved, _) = (_projected(there, p[None], x[None]) for p in (points, points + spread))
        e, J, along = uv[0] - matches.uv, J[0], moved[0] - uv[0]
        # What a fly's depth may be off shifts its window along a line.
        covariance = PIXEL_PX**2 * np.eye(2) + along[:, :, None] * along[:, None, :]
        W = np.linalg.inv(covariance)
        off = np.sqrt((e[:, None] @ W @ e[..., None])[:, 0, 0])
        good = off < max(LARGEST, LARGEST * 2.0 ** (SETTLING - 2 - k))
        if good.sum() < LEAST:
            return None
        W = W * (1.0 / np.maximum(off, 1.0))[:, None, None]
        JtW = J[good].transpose(0, 2, 1) @ W[good]
        H = (JtW @ J[good]).sum(axis=0)
        x -= np.linalg.solve(H + 1e-9 * np.eye(3), (JtW @ e[good][..., None]).sum(axis=0)[:, 0])
    if good.sum() < max(LEAST, effort.share * len(good)):
        return None
    covariance = np.asarray(np.linalg.inv(H) * TOGETHER, np.float64)
    return Hop(pose=Pose2(*x.tolist()), covariance=covariance, agreed=int(good.sum()), found=len(good))


def _projected(there: Glimpse, points: Array, x: NDArray[np.float64]) -> tuple[Array, Array]:
    """Pixels there `[t, n, 2]` of points `[t, n, 3]` in here's base_link by poses `[t, 3]`, and `[t, n, 2, 3]` of them.

    The second has the derivatives by x, y and yaw.
    """
    c, s = np.cos(x[:, 2])[:, None], np.sin(x[:, 2])[:, None]
    px, py = points[..., 0], points[..., 1]
    rx, ry = c * px - s * py, s * px + c * py
    base = np.stack([rx + x[:, 0, None], ry + x[:, 1, None], points[..., 2]], axis=-1)
    T = inverse(there.T_base_left)
    R, q = T[:3, :3], transform(T, base)
    z = np.maximum(q[..., 2], 1e-3)
    uv = np.stack(
        [there.camera.fx * q[..., 0] / z + there.camera.cx, there.camera.fy * q[..., 1] / z + there.camera.cy], axis=-1
    )
    turn = -ry[..., None] * R[:, 0] + rx[..., None] * R[:, 1]
    dq = np.stack([np.broadcast_to(R[:, 0], turn.shape), np.broadcast_to(R[:, 1], turn.shape), turn], axis=-1)
    du = there.camera.fx * (dq[..., 0, :] - (q[..., 0] / z)[..., None] * dq[..., 2, :]) / z[..., None]
    dv = there.camera.fy * (dq[..., 1, :] - (q[..., 1] / z)[..., None] * dq[..., 2, :]) / z[..., None]
    return uv, np.stack([du, dv], axis=-2)
