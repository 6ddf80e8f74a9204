"""The parameters that turn flies into obstacles."""

from __future__ import annotations

from dataclasses import dataclass, fields

from flysim.geometry.plan_view import APART

MAX_NUMBER = 1e6  # flies or metres: beyond it is a typing error


@dataclass(frozen=True, slots=True, kw_only=True)
class ObstacleParams:
    """How flies become obstacles. Refuses nonsense with a ValueError that names the figure.

    Attributes:
        ground_clearance: flies lower than this lie on the floor [m]. The rover drives over less.
        link_distance: flies nearer to one another than this may belong to one obstacle [m].
        min_neighbours: flies within `link_distance` that make a fly part of an obstacle, itself included.
        min_flies: flies an obstacle has at least.
        min_height: obstacles lower than this are none [m].
        trim: share of an obstacle's flies that may lie outside each face of its box.
        silhouettes: whether the surface under each fly is followed to where it ends. Without, a side that no stop saw
            is where the last flies on its neighbours are, half a window short.
        climb: whether what is upright is followed to its upper end, however far above the fly that is.
        again: whether every stop is asked how high an obstacle goes whose top no fly lies on, where its sides are
            known to stand; with `climb` and `silhouettes` alone.
        round: whether an obstacle may be a cylinder or a sphere; else all are boxes.
    """

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012 (how a scenario file reads this record)

    ground_clearance: float = 0.04
    link_distance: float = APART
    min_neighbours: int = 4
    min_flies: int = 25
    min_height: float = 0.06
    trim: float = 0.003
    silhouettes: bool = True
    climb: bool = True
    again: bool = True
    round: bool = True

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0.0 <= value <= MAX_NUMBER:
                raise ValueError(f"{field.name} must be finite and >= 0, at most {MAX_NUMBER:g}, got {value}")
        if self.link_distance <= 0.0:
            raise ValueError(f"link_distance must be > 0 m, got {self.link_distance}")
        if self.trim >= 0.5:
            raise ValueError(f"trim must be < 0.5, got {self.trim}")
