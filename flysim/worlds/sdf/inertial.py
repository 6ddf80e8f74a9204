"""SDF `<inertial>` elements: of bodies that move alone, since nobody uses the inertia of what stands still."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flysim.worlds.sdf.elements import Where, child_numbers, written_pose
from flysim.worlds.sdf.skipped import Skipped

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element


def read_inertial(
    link: Element, where: Where, dynamic: bool, skipped: Skipped
) -> tuple[float, tuple[float, float, float] | None]:
    """Mass [kg] and principal moments [kg m^2] of a link; None: not given, to be derived from its shape."""
    inertial = link.find("inertial")
    if inertial is None or not dynamic:
        return 1.0, None
    (mass,) = child_numbers(inertial, "mass", 1, where, (1.0,))
    inertia = inertial.find("inertia")
    moments = None
    if inertia is not None:
        ixx, iyy, izz = (child_numbers(inertia, tag, 1, where, (1.0,))[0] for tag in ("ixx", "iyy", "izz"))
        products = [child_numbers(inertia, tag, 1, where, (0.0,))[0] for tag in ("ixy", "ixz", "iyz")]
        moments = (ixx, iyy, izz)
        if any(abs(p) > 1e-9 for p in products):
            skipped.note("products of inertia (ixy, ixz, iyz) are not read", where)
    if mass <= 0.0:
        raise where.error(f"<mass> of a body that moves must be > 0 kg, got {mass:g}")
    if moments is not None and (min(moments) <= 0.0 or 2.0 * max(moments) > sum(moments) * (1.0 + 1e-6)):
        raise where.error(
            f"<inertia> must hold three moments > 0, each at most the sum of the others, got {moments}: "
            "correct them, or remove <inertia> to have it from the shape"
        )
    if not np.allclose(written_pose(inertial, where).T, np.eye(4), atol=1e-9):
        skipped.note("the <pose> of an <inertial> is not read and its mass sits at the link's origin", where)
    return mass, moments
