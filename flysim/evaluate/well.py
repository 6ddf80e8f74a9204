"""Which obstacles were found well: where they are and as large as they are, so that a robot could pass them closely.

F1 asks whether something was found at all; its gate is 30 cm wide, and it takes no notice of size.
"""

from __future__ import annotations

from collections.abc import Iterable

from flysim.evaluate.matching import harmonic
from flysim.evaluate.scores import ObstacleReport, Triple

CENTER_M = 0.03  # [m] of the centre, on the ground
SIZE_M, SIZE_SHARE = 0.03, 0.05  # of each visible dimension: [m], or as a share of it, whichever is more


def found_well(center_error: float | None, size_error: Triple | None, size: Triple | None) -> bool:
    """Whether an estimate is right to 3 cm in its centre, and to 3 cm or 5 % in each dimension, of what was visible."""
    if center_error is None or size_error is None or size is None:
        return False
    close = all(abs(error) <= max(SIZE_M, SIZE_SHARE * true) for error, true in zip(size_error, size, strict=True))
    return center_error <= CENTER_M and close


def well(obstacles: Iterable[ObstacleReport], false: int) -> dict[str, float]:
    """Precision, recall and F1, where only what was found well counts as found; by what `matching` counts.

    Args:
        obstacles: the true ones of one run, or of several.
        false: estimates that stand for nothing.
    """
    seen = [o for o in obstacles if o.visible]
    right, claimed = sum(o.share for o in seen if o.found_well), sum(o.share for o in seen) + false
    recall = right / len(seen) if seen else 1.0
    precision = right / claimed if claimed else float(not seen)
    return {"precision": precision, "recall": recall, "f1": harmonic(precision, recall)}
