"""How the links of a URDF hang together: one tree with any root, and the body in it that everything hangs on."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flysim.geometry.frames import Array, inverse
from flysim.plain import shown
from flysim.robots.joints import Joint
from flysim.robots.links import RobotLink
from flysim.robots.urdf import Origin, refusal

REFERENCES = ("base_link", "base_footprint")  # whose x axis points forward (REP-105, REP-120)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkTree:
    """A robot's links at their places, all joints at zero.

    Attributes:
        root: name of the link that hangs on none.
        T_root_links: `[4, 4]` of each link in the root.
        joints_at: the joints that hang on each link, by its name.
    """

    root: str
    T_root_links: dict[str, Array]
    joints_at: dict[str, list[Joint]]

    @property
    def reference(self) -> str:
        """The link whose axes say what is forward, left and up."""
        return next((name for name in REFERENCES if name in self.T_root_links), self.root)


def read_tree(path: Path, names: list[str], joints: tuple[Joint, ...]) -> LinkTree:
    """The tree that joints make of links.

    Raises:
        RobotError: they make none: a joint of no link, two parents, a ring, a link that hangs on nothing.
    """
    if not names:
        raise refusal(path, "no <link>: a robot has at least a body and two wheels")
    parents: dict[str, str] = {}
    edges: dict[str, list[Joint]] = {}
    for joint in joints:
        for end in (joint.parent, joint.child):
            if end not in names:
                raise refusal(path, f"joint {shown(joint.name)} joins {shown(end)}, which is no link: correct the name")
        if joint.child in parents:
            raise refusal(path, f"link {shown(joint.child)} has two parents. A robot is a tree")
        parents[joint.child] = joint.parent
        edges.setdefault(joint.parent, []).append(joint)
    root = _root(path, names, parents)
    poses, queue = {root: np.eye(4)}, [root]
    while queue:
        parent = queue.pop()
        for joint in edges.get(parent, []):
            poses[joint.child] = poses[parent] @ joint.origin.matrix
            queue.append(joint.child)
    lost = sorted(set(names) - set(poses))
    if lost:
        raise refusal(path, f"link {shown(lost[0])} is not joined to {root[:60]}. Add a joint")
    return LinkTree(root=root, T_root_links=poses, joints_at=edges)


def _root(path: Path, names: list[str], parents: dict[str, str]) -> str:
    """Above `base_link`, else above the first link."""
    root = next((name for name in REFERENCES if name in names), names[0])
    seen = {root}
    while root in parents:
        root = parents[root]
        if root in seen:
            raise refusal(path, f"its joints make a ring through link {shown(root)}. A robot is a tree")
        seen.add(root)
    return root


def body_of(path: Path, tree: LinkTree, links: tuple[RobotLink, ...]) -> str:
    """The link that the robot is, for a simulator: its root, or the heaviest that a massless root carries rigidly."""
    masses = {link.name: link.inertial.mass for link in links if link.inertial is not None}
    if tree.root in masses:
        return tree.root
    queue = [tree.root]
    for name in queue:
        queue.extend(joint.child for joint in tree.joints_at.get(name, []) if joint.kind == "fixed")
    body = max(queue, key=lambda name: masses.get(name, 0.0))
    if body not in masses:
        raise refusal(path, f"link {shown(tree.root)} has a body and no <inertial>: add its mass and inertia")
    return body


def hung_on(body: str, joints: tuple[Joint, ...]) -> tuple[Joint, ...]:
    """The same joints with `body` for their root: those above it, which are fixed, the other way round."""
    above = {joint.child: joint for joint in joints}
    turned, name = {}, body
    while name in above:
        joint = above[name]
        turned[joint.name] = replace(joint, parent=joint.child, child=joint.parent, origin=_inverse(joint.origin))
        name = joint.parent
    return tuple(turned.get(joint.name, joint) for joint in joints)


def _inverse(origin: Origin) -> Origin:
    T = inverse(origin.matrix)
    R = T[:3, :3]
    pitch = math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0]))
    if abs(abs(pitch) - math.pi / 2.0) < 1e-9:  # roll and yaw are one turn
        roll, yaw = 0.0, math.atan2(-R[0, 1], R[1, 1])
    else:
        roll, yaw = math.atan2(R[2, 1], R[2, 2]), math.atan2(R[1, 0], R[0, 0])
    x, y, z = T[:3, 3].tolist()
    return Origin((x, y, z), (roll, pitch, yaw))
