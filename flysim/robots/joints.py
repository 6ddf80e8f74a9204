"""The joints of a URDF, checked: how its links hang together."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from flysim.plain import shown
from flysim.robots.account import Account
from flysim.robots.urdf import Origin, Three, at_least_zero, attribute, named, numbers, origin, refusal

KINDS = ("fixed", "continuous", "revolute", "prismatic")
JOINT_TAGS = {"parent", "child", "origin", "axis", "limit", "dynamics"}
EXTRA_TAGS = {"mimic", "safety_controller", "calibration"}  # URDF's own, which nothing here needs
LIMITED = ("revolute", "prismatic")  # URDF asks for a <limit>


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit:
    """How far, how strongly and how fast a joint moves; in rad or m, N m or N, rad/s or m/s."""

    lower: float = 0.0
    upper: float = 0.0
    effort: float = 0.0
    velocity: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """How one link hangs on another.

    Attributes:
        kind: one of `KINDS`.
        parent: name of the link that carries.
        child: name of the link that is carried.
        origin: the child's place in the parent, the joint at zero.
        axis: of length 1, in the child's frame, which the child turns about or slides along.
        limit: None where the file gives none.
        damping: N m s/rad, or N s/m.
        friction: N m, or N.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: Origin
    axis: Three = (1.0, 0.0, 0.0)
    limit: Limit | None = None
    damping: float = 0.0
    friction: float = 0.0


def read_joints(path: Path, root: Element, account: Account) -> tuple[Joint, ...]:
    """Every joint, in the order of the file; what is left out of them is noted.

    Raises:
        RobotError: a joint says nothing, or nonsense, where URDF asks for something.
    """
    elements = named(path, root, "joint")
    for name, element in elements.items():
        for tag in element:
            if tag.tag not in JOINT_TAGS:
                account.note(
                    "joint extras" if tag.tag in EXTRA_TAGS else "unknown", f"<{tag.tag}> of joint {shown(name)}"
                )
    return tuple(_joint(path, name, element) for name, element in elements.items())


def _joint(path: Path, name: str, element: Element) -> Joint:
    where = f"joint {shown(name)}"
    kind = attribute(path, element, "type")
    if kind not in KINDS:
        raise refusal(path, f"{where} has type={shown(kind)}; simulated are {', '.join(KINDS)}")
    ends = []
    for end in ("parent", "child"):
        tag = element.find(end)
        if tag is None:
            raise refusal(path, f"{where} has no <{end} link=...>: add it")
        ends.append(attribute(path, tag, "link"))
    dynamics = element.find("dynamics")
    damping, friction = (
        at_least_zero(path, dynamics.get(what, "0") if dynamics is not None else "0", f"{what} of {where}")
        for what in ("damping", "friction")
    )
    return Joint(
        name=name,
        kind=kind,
        parent=ends[0],
        child=ends[1],
        origin=origin(path, element),
        axis=_axis(path, element, kind, where),
        limit=_limit(path, element, kind, where),
        damping=damping,
        friction=friction,
    )


def _axis(path: Path, element: Element, kind: str, where: str) -> Three:
    tag = element.find("axis")
    if tag is None:
        return (1.0, 0.0, 0.0)
    axis = np.array(numbers(path, tag.get("xyz"), 3, f"the axis of {where}"))
    length = float(np.linalg.norm(axis))
    if kind == "fixed":  # nothing turns; exporters write 0 0 0
        return (1.0, 0.0, 0.0)
    if not length > 1e-6:
        raise refusal(path, f"the axis of {where} must have a length, got {shown(tag.get('xyz', ''))}")
    x, y, z = (axis / length).tolist()
    return (x, y, z)


def _limit(path: Path, element: Element, kind: str, where: str) -> Limit | None:
    tag = element.find("limit")
    if tag is None:
        if kind in LIMITED:
            raise refusal(path, f"{where} is {kind} and has no <limit>: add it, with effort= and velocity=")
        return None
    lower, upper = (numbers(path, tag.get(end, "0"), 1, f"the {end} limit of {where}")[0] for end in ("lower", "upper"))
    if lower > upper:
        raise refusal(path, f"the lower limit of {where} must be at most the upper one, got {lower:g} and {upper:g}")
    default = None if kind in LIMITED else "0"
    effort, velocity = (
        at_least_zero(path, tag.get(what, default), f"the {what} limit of {where}") for what in ("effort", "velocity")
    )
    return Limit(lower=lower, upper=upper, effort=effort, velocity=velocity)
