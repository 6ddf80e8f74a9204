"""The same way with stops at other distances: what a robot with one camera has for a baseline."""

from __future__ import annotations

import numpy as np

from flysim.errors import ScenarioError
from flysim.runs.scenario import Scenario
from flysim.runs.scenario_parts import MAX_STOPS, StopPlan


def respaced(plan: Scenario, hop: float) -> Scenario:
    """A scenario along whose way there is a stop every `hop` metres, from its first one on.

    The way goes straight from stop to stop, over the points between them; the heading turns evenly on the way.

    Raises:
        ScenarioError: no hop of that length fits, or too many do.
    """
    places, at, yaws = [(plan.stops[0].x, plan.stops[0].y)], [0.0], [plan.stops[0].yaw_deg]
    along = 0.0
    lengths = [0.0]
    for stop in plan.stops[1:]:
        for x, y in (*stop.via, (stop.x, stop.y)):
            along += float(np.hypot(x - places[-1][0], y - places[-1][1]))
            places.append((x, y))
            lengths.append(along)
        at.append(along)
        yaws.append(stop.yaw_deg)
    if not 0.0 < hop <= along or along / hop >= MAX_STOPS:
        raise ScenarioError(
            f"scenario '{plan.name}': its way is {along:g} m long, and hops must be from {along / MAX_STOPS:.3g} to "
            f"{along:g} m, got {hop:g} m."
        )
    there = np.arange(0.0, along + 1e-9, hop)
    x, y = (np.interp(there, lengths, axis) for axis in np.array(places).T)
    heading = np.interp(there, at, np.degrees(np.unwrap(np.radians(yaws))))
    stops = tuple(
        StopPlan(x=round(float(a), 6), y=round(float(b), 6), yaw_deg=round(float((c + 180.0) % 360.0 - 180.0), 6))
        for a, b, c in zip(x, y, heading, strict=True)
    )
    return plan.model_copy(update={"stops": stops})
