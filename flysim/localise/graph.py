"""Poses on the floor that agree best with all hops between them: a graph of poses, solved by sparse least squares.

The cost is Cauchy's, so that a hop that nothing else agrees with is outvoted. A planar graph of a thousand frames is
solved in a second by what SciPy has; a library of factors (GTSAM) would bring nothing but its 30 MB.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from flysim.geometry.frames import Array, Pose2

STEPS = 20  # of Gauss and Newton
SETTLED = 1e-7  # [m, rad] a step that is smaller is the last
Ends = NDArray[np.intp]  # the frames of ties
DOUBT = 2.0  # deviations off from which on a hop is trusted less


class Tie(NamedTuple):
    """A pose of frame `b` in base_link of frame `a`, and how sure it is.

    Attributes:
        pose: x, y [m], yaw [rad].
        covariance: `[3, 3]` of those.
        robust: whether it may be outvoted.
    """

    a: int
    b: int
    pose: Pose2
    covariance: Array
    robust: bool


def solved(poses: Array, ties: Sequence[Tie], steps: int = STEPS) -> tuple[Array, csc_matrix]:
    """`[n, 3]` poses x, y [m], yaw [rad] that agree best; the first one stays. Second, what `covariances` asks for.

    Args:
        poses: `[n, 3]` to begin from.
        ties: every frame hangs together with the first one by some of them.
        steps: of Gauss and Newton at most.
    """
    x = np.array(poses, np.float64)
    n = len(x)
    if n < 2 or not ties:
        return x, csc_matrix((0, 0))
    a, b = (np.array([tie[k] for tie in ties], np.intp) for k in range(2))
    told = np.array([[tie.pose.x, tie.pose.y, tie.pose.yaw] for tie in ties])
    W = np.asarray(np.linalg.inv([tie.covariance for tie in ties]), np.float64)
    robust = np.array([tie.robust for tie in ties])
    H = csc_matrix((3 * n - 3, 3 * n - 3))
    for _ in range(steps):
        e, A, B = _errors(x, a, b, told)
        off = np.sqrt((e[:, None] @ W @ e[..., None])[:, 0, 0])
        trust = np.where(robust, 1.0 / (1.0 + (off / DOUBT) ** 2), 1.0)
        weighed = np.asarray(W * trust[:, None, None], np.float64)
        H, g = _normal(n, a, b, A, B, weighed, e)
        step = splu(H).solve(g).reshape(-1, 3)
        x[1:] -= step
        if np.abs(step).max() < SETTLED:
            break
    x[:, 2] = (x[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    return x, H


def covariances(H: csc_matrix) -> Array:
    """`[n, 3, 3]` how sure solved poses are, each held against the first one, which is sure."""
    side = int(H.get_shape()[0])
    found = np.zeros((side // 3 + 1, 3, 3))
    if not side:
        return found
    factors = splu(H)
    for k in range(0, side, 3):
        unit = np.zeros((side, 3))
        unit[k : k + 3] = np.eye(3)
        found[k // 3 + 1] = factors.solve(unit)[k : k + 3]
    return found


def _errors(x: Array, a: Ends, b: Ends, told: Array) -> tuple[Array, Array, Array]:
    """`[m, 3]` how far each tie is off, and `[m, 3, 3]` its derivatives by the poses of both ends."""
    (c, s), d = (f(x[a, 2]) for f in (np.cos, np.sin)), x[b] - x[a]
    dx, dy = c * d[:, 0] + s * d[:, 1], c * d[:, 1] - s * d[:, 0]
    turn = (d[:, 2] - told[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    e = np.column_stack([dx - told[:, 0], dy - told[:, 1], turn])
    B = np.zeros((len(a), 3, 3))
    B[:, 0, 0], B[:, 0, 1], B[:, 1, 0], B[:, 1, 1], B[:, 2, 2] = c, s, -s, c, 1.0
    A = -B
    A[:, 0, 2], A[:, 1, 2] = dy, -dx
    return e, A, B


def _normal(n: int, a: Ends, b: Ends, A: Array, B: Array, W: Array, e: Array) -> tuple[csc_matrix, Array]:
    """The normal equations of all poses but the first one."""
    ends = ((a, A), (b, B))
    g = np.zeros((n, 3))
    rows, columns, values = [], [], []
    three = np.arange(3)
    for i, J in ends:
        JtW = J.transpose(0, 2, 1) @ W
        np.add.at(g, i, (JtW @ e[..., None])[..., 0])
        for j, L in ends:
            block = JtW @ L
            rows.append(np.broadcast_to(3 * i[:, None, None] + three[:, None], block.shape).ravel())
            columns.append(np.broadcast_to(3 * j[:, None, None] + three, block.shape).ravel())
            values.append(block.ravel())
    H = csc_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(3 * n, 3 * n))
    return csc_matrix(H[3:, 3:]), g[1:].ravel()
