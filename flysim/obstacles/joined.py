"""Clusters that are one obstacle: what stands under another's roof, what touches it, what stands close beside it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array
from flysim.geometry.plan_view import axes
from flysim.obstacles.parameters import ObstacleParams
from flysim.obstacles.shape import FittedShape, distance_to, fit_solid
from flysim.products.cloud import FlyCloud

ROOF_FLIES = 3  # of another cluster that lie over the footprint of one, and over its upper end, make a roof
AFLOAT = 0.95  # share of a cluster's flies that lie higher than what stands in its footprint: so does all of it
# A rim has flies within so many metres in six of eight directions; a room has not.
AROUND, SECTORS, SURROUNDED = 0.6, 8, 6
ROOFED = 0.8  # share of a cluster's flies that stand within another's footprint, for it to stand under its roof
TOUCHING = 4  # flies of a cluster on what was fitted to another: they may be two sides of one body
EAVES = 0.03  # [m] that they may stand out, and that a roof may seem to be lower than what stands under it
OUTLINE = 48  # points of a body's outline, seen from above, whose distance to another body is asked

Cluster = tuple[NDArray[np.int64], FittedShape]  # flies, and the body they lie on


def joined(cloud: FlyCloud, clusters: list[Cluster], params: ObstacleParams) -> list[Cluster]:
    """The clusters with those under another's roof, those that are one body with it, and those whose bodies stand
    closer to it than flies of one obstacle may, made a part of that one.

    The last are one obstacle by what the truth calls one (`APART`): of two posts side by side both cameras see the
    fronts alone, whose flies may be farther apart than the posts are. The smallest come first.
    """
    if len(clusters) < 2:
        return clusters
    clusters = sorted(clusters, key=lambda cluster: _plan_area(cluster[1]))
    low, high = (np.array(ends) for ends in zip(*(_plan(cloud, one) for one in clusters), strict=True))
    near = max(params.link_distance, 2.0 * EAVES)
    for k, (flies, body) in enumerate(clusters):
        # Of hundreds of clusters most are far from one another, and asking each of each takes long.
        close = np.all((low <= high[k] + near) & (low[k] <= high + near), axis=1)
        for other in range(len(clusters) - 1, k, -1):
            if not close[other]:
                continue
            roof_flies, roof = clusters[other]
            under = _under(cloud.points[flies], body, cloud.points[roof_flies], roof)
            touching = _touching(cloud.points[flies], body, cloud.points[roof_flies], roof)
            # Where all is a box, so is the room about it, and everything stands close beside that.
            beside = params.round and _beside(
                cloud.points[flies], body, cloud.points[roof_flies], roof, params.link_distance
            )
            if not (under or touching or beside):
                continue
            together = np.sort(np.concatenate([roof_flies, flies]))
            whole = fit_solid(cloud, together, params)
            if under or beside or whole.shape != "other":
                clusters[other] = together, whole
                low[other], high[other] = _plan(cloud, clusters[other])
                clusters[k] = np.empty(0, np.int64), body
                break
    return [cluster for cluster in clusters if len(cluster[0])]


def _plan_area(body: FittedShape) -> float:
    return float(body.size[0] * body.size[1])


def _plan(cloud: FlyCloud, cluster: Cluster) -> tuple[Array, Array]:
    """`[2]` and `[2]` [m]: within them, seen from above, are a cluster's flies and its body."""
    flies, body = cluster
    seen = np.concatenate([cloud.points[flies, :2], _outline(body)[:, :2]])
    return seen.min(axis=0), seen.max(axis=0)


def _touching(points: Array, body: FittedShape, other_points: Array, other: FittedShape) -> bool:
    """Whether flies of one cluster lie on what was fitted to the other: two sides of a box, a bare strip between."""
    if "other" in (body.shape, other.shape):
        return False
    return any(
        (np.abs(distance_to(there, on)) <= EAVES).sum() >= TOUCHING
        for there, on in ((points, other), (other_points, body))
    )


def _beside(points: Array, body: FittedShape, other_points: Array, other: FittedShape, gap: float) -> bool:
    """Whether two bodies stand at most `gap` [m] apart. Where one is none, its flies are asked; of two, nothing is."""
    if body.shape == other.shape == "other":
        return False
    if "other" in (body.shape, other.shape):
        there, on = (points, other) if body.shape == "other" else (other_points, body)
        return bool((distance_to(there, on) <= gap).sum() >= TOUCHING)
    outline = _outline(body)
    low, high = outline[0, 2] - body.size[2] / 2.0, outline[0, 2] + body.size[2] / 2.0
    outline[:, 2] = np.clip(other.center[2], low, high)  # at the height that is nearest to the other one
    return bool(distance_to(outline, other).min() <= gap)


def _outline(body: FittedShape) -> Array:
    """`[OUTLINE, 3]` points round a body at half its height: a circle, or the sides of its box."""
    turn = np.linspace(0.0, 2.0 * np.pi, OUTLINE, endpoint=False)
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    if body.shape not in ("cylinder", "sphere"):
        ring /= np.abs(ring).max(axis=1, keepdims=True)
    plan = body.center[:2] + (ring * body.size[:2] / 2.0) @ axes(body.yaw)
    return np.column_stack([plan, np.full(OUTLINE, body.center[2])])


def _under(points: Array, body: FittedShape, roof_points: Array, roof: FittedShape) -> bool:
    """Whether a cluster stands within another's footprint and under its flies."""
    if _over(points, roof).mean() < ROOFED:
        return False
    higher = roof_points[:, 2] > body.size[2] - EAVES
    # A roof as high as the camera is hardly seen from above; but then its rim floats over what stands below.
    return bool(
        (_over(roof_points, body) & higher).sum() >= ROOF_FLIES
        or (higher.mean() >= AFLOAT and _sectors(roof_points - body.center) >= SURROUNDED)
    )


def _sectors(ways: Array) -> int:
    """In how many of eight directions, seen from above, some way `[N, 3]` is shorter than AROUND."""
    near = ways[np.linalg.norm(ways[:, :2], axis=1) <= AROUND]
    turn = np.arctan2(near[:, 1], near[:, 0]) / (2.0 * np.pi) % 1.0
    return len(np.unique((turn * SECTORS).astype(int)))


def _over(points: Array, body: FittedShape) -> NDArray[np.bool_]:
    """`[N]` which points `[N, 3]` are over the footprint of a body."""
    c, s = np.cos(body.yaw), np.sin(body.yaw)
    x, y = (points[:, :2] - body.center[:2]).T
    along = np.abs(np.stack([c * x + s * y, c * y - s * x], axis=1))
    return np.all(along <= body.size[:2] / 2.0 + EAVES, axis=1)
