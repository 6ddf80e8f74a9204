"""The small tables of a scenario: its stops, and how the truth is read."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from flysim.geometry.frames import Pose2
from flysim.geometry.plan_view import APART

MAX_STOPS = 1000


class Strict(BaseModel):
    """A table in which no key is unknown, no number infinite, and nothing changes."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


Metres = Annotated[float, Field(ge=-1e4, le=1e4)]


class StopPlan(Strict):
    """Where to stop: x, y [m] and heading [degrees, counter-clockwise], world frame.

    `via` are points [m] that are driven through on the way there, without a look.
    """

    x: Metres
    y: Metres
    yaw_deg: float = Field(default=0.0, ge=-360.0, le=360.0)
    via: tuple[tuple[Metres, Metres], ...] = Field(default=(), max_length=MAX_STOPS)

    @property
    def pose(self) -> Pose2:
        """The stop as a pose."""
        return Pose2(self.x, self.y, math.radians(self.yaw_deg))


class TruthParams(Strict):
    """How the truth is read.

    Attributes:
        merge_gap: bodies that touch or stand closer than this are one obstacle [m].
    """

    merge_gap: float = Field(default=APART, ge=0.0, le=10.0)
