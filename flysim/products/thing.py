"""An obstacle as one photograph shows it."""

from __future__ import annotations

from dataclasses import dataclass

from flysim.products.obstacle import Obstacle


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Thing:
    """A body, and where it is in the left picture.

    Attributes:
        obstacle: its body; z is above the floor, or above the lowest fly where there is none.
        afloat: whether it does not stand on the floor.
        distance: from the left camera to its nearest side, along the optical axis [m].
        rect_px: u, v of the upper left corner, width, height of what it covers in the left picture [px].
        disparity_px: median of its flies.
    """

    obstacle: Obstacle
    afloat: bool
    distance: float
    rect_px: tuple[int, int, int, int]
    disparity_px: float
