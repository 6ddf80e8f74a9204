"""The driven wheels of a URDF, and the robot's own frame, which lies on the floor between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flysim.geometry.frames import Array, frozen, inverse, se3, transform
from flysim.plain import shown
from flysim.robots.account import Account
from flysim.robots.driven import DrivenPair
from flysim.robots.joints import Joint
from flysim.robots.links import LinkShape, RobotLink
from flysim.robots.tree import LinkTree
from flysim.robots.urdf import Origin, refusal
from flysim.worlds.shapes import Cylinder, Sphere

NEAR_ENOUGH = 1e-3  # of a direction, and [m] of a place
ROUND = 0.05  # of its radius, that a wheel's mesh may be out of round
EXACT = 1e-9  # closer than this the robot's frame is base_link itself
WIDE, BAND, CROWN = 0.005, 0.004, 0.002  # [m] a tyre wider than this touches on so much, and is so much higher there
DIFFER = 0.02  # of a length that the plugin gives, before it is told


@dataclass(frozen=True, slots=True, kw_only=True)
class Wheel:
    """A driven wheel.

    Attributes:
        joint: the name of its joint.
        left: on which side it is.
        sense: -1.0 where its axis points right: it rolls forward by turning backward.
    """

    joint: str
    left: bool
    sense: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Axle:
    """Two wheels on one axle.

    Attributes:
        wheels: the left and the right one.
        radius: [m].
        track: between their planes [m].
        T_base_root: `[4, 4]` the tree's root in the robot's own frame.
        links: all, with wheels that roll.
    """

    wheels: tuple[Wheel, ...]
    radius: float
    track: float
    T_base_root: Array
    links: tuple[RobotLink, ...]


def read_axle(path: Path, drive: DrivenPair, tree: LinkTree, links: tuple[RobotLink, ...], account: Account) -> Axle:
    """Where two driven wheels stand, and the frame between them.

    Raises:
        RobotError: they are not round, not equal, not on one axle, or left is right.
    """
    by_name = {link.name: link for link in links}
    centers, radii, axes = [], [], []
    for joint in drive.joints:
        T, link = tree.T_root_links[joint.child], by_name[joint.child]
        solid = _rolling(path, link, joint, drive.radius, account)
        if solid not in link.collisions:
            link = replace(link, collisions=(solid,))
        by_name[joint.child] = _crowned(link, solid, account)
        centers.append(transform(T, np.array(solid.origin.xyz)))
        radii.append(_radius(solid))
        axes.append(T[:3, :3] @ joint.axis)
    T_root_base = _base(path, drive, tree, centers, radii, account)
    wheels = []
    for joint, left, axis in zip(drive.joints, (True, False), axes, strict=True):
        along = float(axis @ T_root_base[:3, 1])
        if abs(along) < 1.0 - NEAR_ENOUGH:
            got = (np.round(T_root_base[:3, :3].T @ axis, 3) + 0.0).tolist()
            raise refusal(
                path, f"{shown(joint.name)} must turn about the line between the wheels, the robot's y axis, got {got}"
            )
        if along < 0.0:
            account.note("sense", f"joint {shown(joint.name)}")
        wheels.append(Wheel(joint=joint.name, left=left, sense=math.copysign(1.0, along)))
    track = float((centers[0] - centers[1]) @ T_root_base[:3, 1])
    for what, said, is_so in (("radius", drive.radius, radii[0]), ("separation", drive.track, track)):
        if said is not None and abs(said - is_so) > DIFFER * is_so:
            account.note("plugin sizes", f"wheel {what} {said:g} m, where it is {is_so:.4g} m")
    return Axle(
        wheels=tuple(wheels),
        radius=radii[0],
        track=track,
        T_base_root=frozen(inverse(T_root_base)),
        links=tuple(by_name[link.name] for link in links),
    )


def _radius(solid: LinkShape) -> float:
    assert isinstance(solid.shape, Cylinder | Sphere)
    return solid.shape.radius


def _base(
    path: Path, drive: DrivenPair, tree: LinkTree, centers: Sequence[Array], radii: Sequence[float], account: Account
) -> Array:
    """`[4, 4]` the frame on the floor between two wheels, in the tree's root: x forward, y left, z up."""
    T_root_reference = tree.T_root_links[tree.reference]
    left, right = (transform(inverse(T_root_reference), center) for center in centers)
    across = left - right
    track = float(np.linalg.norm(across))
    if abs(radii[0] - radii[1]) > NEAR_ENOUGH * radii[0] or track <= NEAR_ENOUGH or across[1] < -NEAR_ENOUGH:
        why = "" if across[1] >= -NEAR_ENOUGH else ": the left wheel stands to the right"
        raise refusal(
            path,
            f"wheels need one radius and a positive track, got {radii} m and {float(across[1]):g} m{why}",
        )
    # Up is the root's: a robot is set down by it.
    R_root = np.eye(3) if tree.root == tree.reference else inverse(T_root_reference)[:3, :3]
    up = R_root @ np.array([0.0, 0.0, 1.0])
    if abs(float(across @ up)) > NEAR_ENOUGH:
        got = [np.round(center, 4).tolist() for center in (left, right)]
        raise refusal(path, f"the driven wheels must be equally high, their centres are at {got} m")
    middle = (left + right) / 2.0 - up * radii[0]
    ahead = np.cross(across / track, up)
    straight = bool(np.abs(ahead - (1.0, 0.0, 0.0)).max() < EXACT)
    if straight and np.abs(middle).max() < EXACT:
        return T_root_reference
    if abs(ahead[1]) > math.sin(math.radians(1.0)):
        account.note("turned base", f"{math.degrees(math.atan2(ahead[1], ahead[0])):.0f} degrees from it")
    y = np.cross(up, ahead)
    R = np.eye(3) if straight else np.stack([ahead, y / np.linalg.norm(y), up], axis=1)
    return T_root_reference @ se3(R, middle)


def _rolling(path: Path, link: RobotLink, joint: Joint, told: float | None, account: Account) -> LinkShape:
    """What a wheel rolls on: its one round collision, or a cylinder as large as what it has instead, or as it is told.

    Raises:
        RobotError: nothing about it is round about its axle.
    """
    where = f"wheel {shown(link.name)}"
    axis = np.array(joint.axis)
    round_ones = [solid for solid in link.collisions if isinstance(solid.shape, Cylinder | Sphere)]
    solid = max(round_ones, key=_radius, default=None)
    if solid is None:
        solid = _like(path, link, axis, told, where)
        account.note("wheel mesh", where)
    away = np.array(solid.origin.xyz) - axis * (axis @ np.array(solid.origin.xyz))
    upright = solid.origin.matrix[:3, 2] @ axis
    if np.linalg.norm(away) > NEAR_ENOUGH or (isinstance(solid.shape, Cylinder) and abs(upright) < 1.0 - NEAR_ENOUGH):
        raise refusal(path, f"{where} is not round about its axle: turn its collision, or the axis of its joint")
    return solid


def _crowned(link: RobotLink, solid: LinkShape, account: Account) -> RobotLink:
    """A wheel that touches the floor on a narrow band: a line as wide as the tyre would drag in turns."""
    shape = solid.shape
    if not isinstance(shape, Cylinder) or shape.length <= WIDE or shape.radius <= 2.0 * CROWN:
        return link
    account.note("tyre", f"wheel {shown(link.name)}")
    band = replace(solid, shape=Cylinder(shape.radius, BAND))
    rest = replace(solid, shape=Cylinder(shape.radius - CROWN, shape.length))
    others = tuple(one for one in link.collisions if one is not solid)
    return replace(link, collisions=(band, rest, *others))


def _like(path: Path, link: RobotLink, axis: Array, told: float | None, where: str) -> LinkShape:
    """A cylinder about the axle, as large as the wheel's collisions, or its visuals, or of the radius that is told."""
    solids = link.collisions or link.visuals
    if not solids and told is not None and told > NEAR_ENOUGH:
        return _about(axis, told, NEAR_ENOUGH, 0.0)
    if not solids:
        raise refusal(path, f"{where} must have a collision or a visual: a cylinder, a sphere or a mesh")
    points = np.concatenate([transform(solid.origin.matrix, solid.shape.outline()) for solid in solids])
    along = points @ axis
    off = points - along[:, None] * axis
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first /= np.linalg.norm(first)
    spokes = np.stack([first, np.cross(axis, first)])
    turns = np.linspace(0.0, math.tau, 16, endpoint=False)
    reach = (off @ (np.stack([np.cos(turns), np.sin(turns)], axis=1) @ spokes).T).max(axis=0)
    radius = float(np.linalg.norm(off, axis=1).max())
    if radius <= NEAR_ENOUGH or reach.min() < radius * (1.0 - ROUND):
        raise refusal(path, f"{where} must be round: one collision, a cylinder or a sphere")
    width = max(float(along.max() - along.min()), NEAR_ENOUGH)
    return _about(axis, radius, width, float(along.max() + along.min()) / 2.0)


def _about(axis: Array, radius: float, width: float, middle: float) -> LinkShape:
    """A cylinder about an axle, its middle so far along it."""
    x, y, z = (axis * middle).tolist()
    roll, pitch = -math.asin(max(-1.0, min(1.0, axis[1]))), math.atan2(axis[0], axis[2])
    return LinkShape(shape=Cylinder(radius, width), origin=Origin((x, y, z), (roll, pitch, 0.0)))
