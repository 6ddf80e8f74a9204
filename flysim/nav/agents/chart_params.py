"""What a chart keeps and what a way over it costs: the figures that a user may turn."""

from __future__ import annotations

from dataclasses import dataclass

from flysim.common.ranges import ranged


@dataclass(frozen=True, slots=True, kw_only=True)
class ChartParams:
    """How a chart is drawn and what a way over it costs; chosen on `random-medium`, `random-hard` and BARN.

    Attributes:
        cell: side of a cell [m].
        reach: it covers so much to each side of the start [m]; what is farther off is not entered.
        seen: evidence that a look adds where it finds something.
        unseen: evidence that it takes away where it looks through.
        most: evidence that a cell holds at most: what has gone must be forgotten in time.
        taken: evidence from which a cell is taken.
        relied: what is farther off only makes ways dear [m]: a sector is wider there than the gaps that matter.
        relied_by_eye: the same of cameras, whose depth is worse by the square of the distance [m].
        far_to: what is farther off is not entered at all [m].
        far_cleared_to: up to where a look gives up what was entered from far off [m].
        far_dear: how much more a metre costs in what was seen from far off alone.
        berth: nearer than this to things, beyond the robot's room, a metre costs more [m].
        dear: how much more a metre costs there, at most, in metres.
        narrow_dear: how much more where there is less room than the robot likes.
        unseen_dear: how much more where it would stand on floor that has not been in view.
        shut: how much more where there is no room: the last resort.
        avoided: radius of a place that is avoided [m].
        avoided_dear: how much more there.
        looked_from, looked_to: distances of the floor of which a look tells that nothing low stands there [m].
        looks: so many looks tell it: what is at the view's edge for a moment has no flies yet.
        cleared_from, cleared_to: distances at which a look gives up what it does not find: it goes over low things that
            are nearer, and finds too little farther off [m].
        view_deg: to each side that a look shows; what is not looked at stays as it was [degrees].
        behind_deg: bearing from which on no pair of cameras sees [degrees]. Who is told of things there before the
            robot has moved is told exact distances all round.
        space: about the start that is taken for known [m].
        detour: round robot and goal in which a way is looked for; ways round large things need room [m].
    """

    cell: float = 0.05
    reach: float = 12.0
    seen: float = 1.0
    unseen: float = 0.2
    most: float = 4.0
    taken: float = 1.0
    relied: float = 3.0
    relied_by_eye: float = 2.0
    far_to: float = 4.5
    far_cleared_to: float = 3.5
    far_dear: float = 8.0
    berth: float = 0.35
    dear: float = 4.0
    narrow_dear: float = 12.0
    unseen_dear: float = 1.5
    shut: float = 60.0
    avoided: float = 0.4
    avoided_dear: float = 3.0
    looked_from: float = 0.65
    looked_to: float = 1.7
    looks: int = 3
    cleared_from: float = 0.9
    cleared_to: float = 2.0
    view_deg: float = 30.0
    behind_deg: float = 120.0
    space: float = 0.5
    detour: float = 2.5

    def __post_init__(self) -> None:
        lengths = (
            "far_to",
            "far_cleared_to",
            "relied",
            "relied_by_eye",
            "looked_from",
            "looked_to",
            "cleared_from",
            "cleared_to",
        )
        ranged(
            self,
            cell=(0.02, 0.5, "m"),
            reach=(3.0, 30.0, "m"),
            taken=(0.01, 100.0),
            berth=(0.01, 5.0, "m"),
            avoided=(0.0, 5.0, "m"),
            looks=(1, 100),
            view_deg=(0.0, 180.0, "degrees"),
            behind_deg=(0.0, 180.0, "degrees"),
            space=(0.0, 3.0, "m"),
            detour=(0.0, 10.0, "m"),
            **dict.fromkeys(("seen", "unseen", "most"), (0.0, 100.0)),
            **dict.fromkeys(
                ("dear", "narrow_dear", "unseen_dear", "far_dear", "shut", "avoided_dear"), (0.0, 1e4, "metres")
            ),
            **dict.fromkeys(lengths, (0.0, 10.0, "m")),
        )
