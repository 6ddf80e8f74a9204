"""VFH: the vector field histogram on the fly map.

Borenstein and Koren, "The vector field histogram - fast obstacle avoidance for mobile robots", 1991; sectors widened by
the robot's radius and the cost of a direction as in VFH+ (Ulrich and Borenstein, 1998).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.common.ranges import ranged
from flysim.common.records import record_of
from flysim.geometry.frames import Array, wrap_angle
from flysim.nav.agents.agent import Observation, RobotLimits, action
from flysim.nav.agents.chart import Chart
from flysim.nav.agents.chart_params import ChartParams
from flysim.nav.agents.recovery import Recovery


@dataclass(frozen=True, slots=True, kw_only=True)
class VfhParams:
    """How VFH chooses a direction; chosen on `random-medium` and `random-hard`.

    Attributes:
        directions: how many are weighed, all round.
        look: what is farther off does not block a direction [m].
        replan: periods between two plans over the chart.
        margin: kept free beyond the robot's radius [m].
        tight: kept free where a way leads through a narrow place [m].
        spare: of the room that such a place has, what is not used [m].
        w_doubt: weight, in a direction's cost, of how soon floor that has not been in view would be under the robot.
        doubt_reach: how far such floor counts [m]: what is farther off will be in view before the robot is there.
        doubt_slack: it may be so far under the robot's edge [m]: a cell that is half in view counts as not seen.
        beside: floor that has not been in view and is nearer than this to a thing that has [m] is taken for the rest of
            that thing, as long as another direction is open.
        hidden_to: of such floor, how far off it counts [m].
        patience: so long it may stay in one place [s] before it recovers: turns to the widest opening, goes there,
            forgets what it has entered, and plans anew.
        stay: radius of one place [m].
        escape: so far it goes out of it [m].
        most_escape: for at most so long [s].
        margins: how many are tried, from `margin` on down to what a narrow place leaves.
        near_aim: a margin will do if a direction is open that is no farther from the aim [rad].
        open_enough: and it is if it is so for so far [m].
        carrot: of the point on the way that it heads for, how far it is [m].
        w_goal: weight of a direction's angle to that point, in its cost.
        w_heading: of its angle to the heading.
        w_last: of its angle to the direction chosen last.
        w_blocked: of how far it is blocked.
        least_run: a direction that is open for less is taken only where all are [m].
        turn: yaw rate by the chosen direction [1/s].
        open_share: a direction that is open for this share of what is looked at costs nothing for being blocked.
        shut: cost of a direction that is open for less than `least_run`: more than all else together.
        slack: kept free beyond the robot's radius straight ahead, where its speed is chosen [m].
        brake: deceleration for which that speed is chosen, twice [m/s^2].
        stand_off: it would stand so far before what is ahead [m].
        arrive: speed with which it comes to the goal [m/s].
        slow_down: and so much more for each metre that is left [1/s].
        chart: of its chart, a `ChartParams` or a dict of its fields.
    """

    directions: int = 72
    look: float = 1.6
    replan: int = 5
    margin: float = 0.08
    tight: float = 0.01
    spare: float = 0.01
    w_doubt: float = 6.0
    doubt_reach: float = 0.7
    doubt_slack: float = 0.02
    beside: float = 0.2
    hidden_to: float = 0.8
    patience: float = 5.0
    stay: float = 0.5
    escape: float = 0.6
    most_escape: float = 4.0
    margins: int = 4
    near_aim: float = 0.6
    open_enough: float = 0.4
    carrot: float = 0.9
    w_goal: float = 5.0
    w_heading: float = 1.5
    w_last: float = 1.5
    w_blocked: float = 8.0
    least_run: float = 0.12
    turn: float = 3.0
    open_share: float = 0.8
    shut: float = 50.0
    slack: float = 0.03
    brake: float = 0.9
    stand_off: float = 0.06
    arrive: float = 0.2
    slow_down: float = 1.5
    chart: ChartParams = field(default_factory=ChartParams)

    def __post_init__(self) -> None:
        weights = dict.fromkeys(("w_goal", "w_heading", "w_last", "w_blocked"), (0.0, 1e3))
        ranged(
            self,
            directions=(8, 720),
            look=(0.1, 20.0),
            replan=(1, 1000),
            margin=(0.0, 1.0),
            tight=(0.0, 1.0),
            spare=(0.0, 1.0),
            w_doubt=(0.0, 1e3),
            doubt_reach=(0.05, 5.0),
            doubt_slack=(0.0, 1.0),
            beside=(0.0, 5.0),
            hidden_to=(0.0, 5.0),
            patience=(0.5, 1e3),
            stay=(0.01, 10.0),
            escape=(0.01, 10.0),
            most_escape=(0.1, 100.0),
            margins=(1, 100),
            near_aim=(0.05, math.pi),
            open_enough=(0.0, 20.0),
            carrot=(0.05, 20.0),
            least_run=(0.0, 5.0),
            turn=(0.01, 50.0),
            open_share=(0.01, 1.0),
            shut=(0.0, 1e6),
            slack=(0.0, 1.0),
            brake=(0.01, 100.0),
            stand_off=(0.0, 5.0),
            arrive=(0.0, 10.0),
            slow_down=(0.0, 100.0),
            **weights,
        )
        object.__setattr__(self, "chart", record_of(ChartParams, "chart", self.chart))


class VfhAgent:
    """Heads for the open direction nearest to where the way over its chart leads."""

    Params = VfhParams

    def __init__(self, limits: RobotLimits, params: VfhParams | None = None) -> None:
        self._limits, self._params = limits, params or VfhParams()
        self._chart = Chart(
            limits.radius + self._params.tight,
            limits.period,
            self._params.chart,
            margin=self._params.margin - self._params.tight,
        )
        count = self._params.directions
        self._ways = np.asarray((np.arange(count) + 0.5) * (math.tau / count) - math.pi, np.float64)
        self._recovery = Recovery(
            self._chart,
            limits.period,
            patience=self._params.patience,
            stay=self._params.stay,
            escape=self._params.escape,
            most=self._params.most_escape,
        )
        self._turn = 0
        self._last = 0.0

    def begin(self, rng: np.random.Generator) -> None:
        """Forgets the last episode: a new one begins."""
        self._chart.clear()
        self._recovery.clear()
        self._turn, self._last = 0, 0.0

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Shares of the largest speed and yaw rate."""
        p = self._params
        distance, bearing = (float(v) for v in observation["goal"])
        self._chart.update(observation["velocity"], observation["obstacles"])
        points, reach = self._chart.taken(p.look), min(p.look, distance + 0.1)
        if self._recovery.due():
            self._recovery.begin(self._ways, free_run(points, self._ways, self._limits.radius + p.tight, reach))
            self._turn = 0
        if self._turn % p.replan == 0:
            self._chart.plan(distance, bearing)
        self._turn += 1
        carrot = self._chart.ahead(p.carrot)
        aim = carrot[1] if carrot is not None else bearing
        margin, room = self._room(points, aim, reach)
        if self._recovery.active:
            heading = self._recovery.heading()
        else:
            heading = self._heading(aim, room / reach, room < p.least_run, float(observation["velocity"][1]))
        self._last = heading
        open_ahead = float(free_run(points, np.zeros(1), self._limits.radius + min(p.slack, margin), reach)[0])
        v = min(
            self._limits.v_max,
            math.sqrt(max(0.0, p.brake * (open_ahead - p.stand_off))),
            p.arrive + p.slow_down * distance,
        )
        v *= max(0.0, math.cos(heading)) ** 2 if abs(heading) < math.pi / 2.0 else 0.0
        return action(self._limits, v, p.turn * heading)

    def _heading(self, aim: float, room: Array, shut: NDArray[np.bool_], turning: float) -> float:
        """[rad] The cheapest direction, each of them open for `room` of what is looked at."""
        p = self._params
        doubts = self._chart.unseen(p.doubt_reach)
        doubt = free_run(doubts, self._ways, self._limits.radius - p.doubt_slack, p.doubt_reach)
        now = self._last - turning * self._limits.period
        cost = (
            p.w_goal * np.abs(_wrapped(self._ways - aim))
            + p.w_heading * np.abs(self._ways)
            + p.w_last * np.abs(_wrapped(self._ways - now))
            + p.w_blocked * np.maximum(0.0, p.open_share - room)
            + p.w_doubt * (1.0 - doubt / p.doubt_reach)
            + p.shut * shut
        )
        heading = float(self._ways[int(np.argmin(cost))])
        # Between two directions: the aim itself, where it is open.
        return aim if abs(wrap_angle(aim - heading)) < math.tau / p.directions else heading

    @property
    def info(self) -> dict[str, Any]:
        """`recoveries`: how often in this episode it came no farther; `recovering`: whether it is getting out."""
        return {"recoveries": self._recovery.count, "recovering": self._recovery.active}

    def _room(self, points: Array, aim: float, reach: float) -> tuple[float, Array]:
        """The margin [m] that leaves a direction near the aim open, and `[n]` how far [m] each one is with it.

        Round what is hidden beside the things seen if there is a way, else as if there were nothing.
        """
        p = self._params
        towards = np.abs(_wrapped(self._ways - aim)) < p.near_aim
        hidden = self._chart.hidden(p.hidden_to, p.beside)
        margin, room = 0.0, np.zeros(0)
        for some in [np.concatenate([points, hidden]), points] if len(hidden) else [points]:
            for margin in np.linspace(p.margin, self._margin(some), p.margins):
                room = free_run(some, self._ways, self._limits.radius + margin, reach)
                if (room[towards] >= min(p.open_enough, reach)).any():
                    return float(margin), room
        return float(margin), room

    def _margin(self, points: Array) -> float:
        """[m] kept free beyond the robot's radius: less where it stands in a narrow place, or the way leads there."""
        p = self._params
        narrowest = self._chart.narrowest(p.carrot)
        if len(points):
            narrowest = min(narrowest, float(np.hypot(points[:, 0], points[:, 1]).min()))
        return float(np.clip(narrowest - self._limits.radius - p.spare, p.tight, p.margin))


def free_run(points: Array, directions: Array, room: float, reach: float) -> Array:
    """`[k]` how far [m] a circle of radius `room` can go in each direction before it meets a point, `reach` at most."""
    if not len(points):
        return np.full(len(directions), reach)
    cos, sin = np.cos(directions)[:, None], np.sin(directions)[:, None]
    along = points[:, 0] * cos + points[:, 1] * sin
    aside = np.abs(points[:, 1] * cos - points[:, 0] * sin)
    meets = (aside < room) & (along > 0.0)
    run = along - np.sqrt(np.maximum(room**2 - aside**2, 0.0))
    return np.clip(np.where(meets, run, reach).min(axis=1), 0.0, reach)


def _wrapped(angle: Array) -> Array:
    return (angle + math.pi) % math.tau - math.pi
