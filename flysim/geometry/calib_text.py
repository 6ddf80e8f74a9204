"""A rectified rig as the text of a Middlebury 2014 calib.txt, which `read_pair` reads."""

from __future__ import annotations

import math

from flysim.geometry.camera import Camera
from flysim.geometry.rig import StereoRig


def calib_text(rig: StereoRig, *, min_depth: float, max_depth: float) -> str:
    """Lines cam0, cam1, doffs, baseline [mm], width, height, and the disparities [px] of a range of depths.

    Lengths have all their digits. `doffs` is what the principal points differ by, cx of the right less cx of the left.

    Args:
        rig: whose; of one that is not rectified, the turn and the other two axes of the baseline are not in the text.
        min_depth, max_depth: nearest and farthest that is searched [m], for `ndisp`, `vmin` and `vmax`.
    """
    doffs, gain = rig.right.cx - rig.left.cx, rig.left.fx * rig.baseline
    low, high = gain / max_depth - doffs, gain / min_depth - doffs
    lines = {
        "cam0": _matrix(rig.left),
        "cam1": _matrix(rig.right),
        "doffs": repr(float(doffs)),
        "baseline": repr(1000.0 * rig.baseline),
        "width": str(rig.left.width),
        "height": str(rig.left.height),
        "ndisp": str(max(math.ceil(high) + 1, 1)),
        "vmin": str(max(math.floor(low), 0)),
        "vmax": str(max(math.ceil(high), 1)),
    }
    return "".join(f"{name}={value}\n" for name, value in lines.items())


def _matrix(camera: Camera) -> str:
    fx, fy, cx, cy = map(float, (camera.fx, camera.fy, camera.cx, camera.cy))
    return f"[{fx!r} 0 {cx!r}; 0 {fy!r} {cy!r}; 0 0 1]"
