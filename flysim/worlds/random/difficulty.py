"""What easy, medium and hard mean for a generated world."""

from __future__ import annotations

from dataclasses import dataclass

SECTORS = 8  # directions that an obstacle is seen from


@dataclass(frozen=True, slots=True, kw_only=True)
class Difficulty:
    """What a world of one difficulty is drawn from.

    Attributes:
        stream: number that goes into every seed with the seed itself; a difficulty keeps its own for good, so that its
            worlds stay what they are whatever others there are.
        obstacles: fewest and most.
        gap: least distance between two obstacles, and of one to a free-standing wall [m].
        wall_gap: least distance to the walls of the room [m].
        clear: radius [m] about the start that stays free.
        contrast: least and greatest of an obstacle's texture [% of the range].
        structure_contrast: of floor and walls.
        kinds: how often each kind is drawn, over their sum.
        overhangs: fewest and most of them.
        side: least length of the room's sides [mm].
        side_each: [mm] more for each obstacle.
        walled: the chance of each wall of the room.
        partitions: fewest and most free-standing walls.
        views: directions, of `SECTORS`, from which each obstacle can be seen from a place the robot gets to.
    """

    stream: int
    obstacles: tuple[int, int]
    gap: float
    wall_gap: float
    clear: float
    contrast: tuple[int, int]
    structure_contrast: float
    kinds: dict[str, int]
    overhangs: tuple[int, int]
    side: int
    side_each: int
    walled: float
    partitions: tuple[int, int]
    views: int


DIFFICULTIES = {
    "easy": Difficulty(
        stream=0,
        obstacles=(3, 5),
        gap=1.0,
        wall_gap=0.8,
        clear=0.7,
        contrast=(32, 32),
        structure_contrast=0.30,
        kinds={"box": 4, "cylinder": 3, "sphere": 2},
        overhangs=(0, 0),
        side=4000,
        side_each=250,
        walled=0.5,
        partitions=(0, 1),
        views=6,
    ),
    "medium": Difficulty(
        stream=1,
        obstacles=(6, 9),
        gap=0.6,
        wall_gap=0.6,
        clear=0.6,
        contrast=(20, 32),
        structure_contrast=0.26,
        kinds={"box": 5, "cylinder": 3, "sphere": 2, "post": 2, "kerb": 2, "corner": 2},
        overhangs=(0, 1),
        side=4500,
        side_each=200,
        walled=1.0,
        partitions=(0, 1),
        views=4,
    ),
    "hard": Difficulty(
        stream=2,
        obstacles=(10, 15),
        gap=0.35,
        wall_gap=0.5,
        clear=0.5,
        contrast=(10, 32),
        structure_contrast=0.20,
        kinds={"box": 5, "cylinder": 3, "sphere": 2, "post": 3, "kerb": 2, "corner": 3},
        overhangs=(1, 2),
        side=5000,
        side_each=160,
        walled=1.0,
        partitions=(0, 2),
        views=3,
    ),
}
