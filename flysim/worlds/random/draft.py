"""One attempt at a world: obstacles drawn and set down at random, and held to what their difficulty promises."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flysim.worlds.random.difficulty import Difficulty
from flysim.worlds.random.kinds import KINDS, Look
from flysim.worlds.random.plan import Outline, Places, apart, outlines, sees
from flysim.worlds.random.recipe import ORIGIN, Body, Colour, Model, floor
from flysim.worlds.shapes import Box

ROBOT_RADIUS = 0.195  # [m] of the rover
ROBOT_MARGIN = 0.055  # [m] round it, wherever it is to pass
THICKNESS = 100  # [mm] of walls
TRIES = 60  # places for one obstacle
VIEW_RANGE = (0.9, 2.4)  # [m] from an obstacle's middle to a place that it is seen from

OBJECT_COLOURS: tuple[Colour, ...] = (
    (0.78, 0.27, 0.20),
    (0.24, 0.62, 0.28),
    (0.22, 0.40, 0.80),
    (0.82, 0.68, 0.18),
    (0.85, 0.47, 0.14),
    (0.56, 0.30, 0.72),
    (0.20, 0.66, 0.68),
    (0.84, 0.44, 0.60),
    (0.55, 0.42, 0.30),
    (0.50, 0.52, 0.54),
)
FLOOR_COLOURS: tuple[Colour, ...] = ((0.52, 0.47, 0.38), (0.45, 0.46, 0.46), (0.50, 0.42, 0.36), (0.42, 0.47, 0.42))
WALL_COLOURS: tuple[Colour, ...] = ((0.40, 0.46, 0.54), (0.54, 0.52, 0.56), (0.56, 0.52, 0.44), (0.44, 0.52, 0.46))


class Draft:
    """One attempt at a world."""

    def __init__(self, rules: Difficulty, rng: np.random.Generator) -> None:
        self.rules, self.rng = rules, rng
        self.count = int(rng.integers(*rules.obstacles, endpoint=True))
        length, width = (
            (rules.side + rules.side_each * self.count + 100 * int(rng.integers(-3, 4))) // 100 * 100 for _ in range(2)
        )
        # The corners of the room [mm]: the start lies before the middle of its back wall, or beside that.
        back = -int(rng.integers(9, 13)) * 100
        right = -width // 2 + 100 * int(rng.integers(-8, 9))
        self.low, self.high = (back, right), (back + length, right + width)
        self.placed: list[tuple[Model, tuple[Outline, ...]]] = []
        self.walls = self._walls()

    def world(self) -> tuple[Model, ...] | None:
        """The models, or None where this attempt does not come out well."""
        low, high = self.low, self.high
        wanted = [*self._partitions(), *self._obstacles()]
        # The largest first, while there is room; the file names them in their own order.
        largest = sorted(wanted, key=lambda model: -_reach(model))
        for model in largest:
            if not self._place(model):
                return None
        if not self._drivable():
            return None
        done = {model.name: model for model, _ in self.placed}
        border = 0 if len(self.walls) == 4 else 1500
        ground = floor(
            (low[0] + high[0]) / 2000,
            (low[1] + high[1]) / 2000,
            (high[0] - low[0] + 2 * border) / 1000,
            (high[1] - low[1] + 2 * border) / 1000,
            _pick(self.rng, FLOOR_COLOURS),
        )
        models = [_with_contrast(ground, self.rules.structure_contrast)]
        if self.walls:
            models.append(Model("walls", self.walls, ORIGIN, structure=True))
        return (*models, *(done[model.name] for model in wanted))

    def _walls(self) -> tuple[Body, ...]:
        (x0, y0), (x1, y1) = self.low, self.high
        height, out = 100 * int(self.rng.integers(6, 12)), THICKNESS // 2
        along, across = x1 - x0 + 2 * THICKNESS, y1 - y0
        sides = (
            ("left", along, (x0 + x1) // 2, y1 + out, 0.0),
            ("right", along, (x0 + x1) // 2, y0 - out, 0.0),
            ("front", across, x1 + out, (y0 + y1) // 2, 90.0),
            ("back", across, x0 - out, (y0 + y1) // 2, 90.0),
        )
        walls = []
        for name, length, x, y, yaw_deg in sides:
            colour, stands = _pick(self.rng, WALL_COLOURS), self.rng.random() < self.rules.walled
            if stands:
                shape = Box((length / 1000, THICKNESS / 1000, height / 1000))
                pose = (x / 1000, y / 1000, height / 2000, 0.0, 0.0, yaw_deg)
                walls.append(Body(name, shape, pose, colour, self.rules.structure_contrast))
        return tuple(walls)

    def _partitions(self) -> list[Model]:
        """Free-standing walls."""
        rng, found = self.rng, []
        for i in range(int(rng.integers(*self.rules.partitions, endpoint=True))):
            length, height = 100 * int(rng.integers(8, 17)), 100 * int(rng.integers(5, 11))
            shape = Box((length / 1000, THICKNESS / 1000, height / 1000))
            pose = (0.0, 0.0, height / 2000, 0.0, 0.0, 0.0)
            body = Body("wall", shape, pose, _pick(rng, WALL_COLOURS), self.rules.structure_contrast)
            found.append(Model(f"partition_{i + 1}", (body,), ORIGIN, structure=True))
        return found

    def _obstacles(self) -> list[Model]:
        """The obstacles, all at the origin still."""
        rng, rules = self.rng, self.rules
        kinds = ["overhang"] * int(rng.integers(*rules.overhangs, endpoint=True))
        urn = [kind for kind, weight in rules.kinds.items() for _ in range(weight)]
        kinds += [urn[int(rng.integers(len(urn)))] for _ in range(self.count - len(kinds))]
        kinds.sort(key=list(KINDS).index)
        palette: list[Colour] = []
        found, number = [], dict.fromkeys(KINDS, 0)
        for kind in kinds:
            palette = palette or list(OBJECT_COLOURS)  # no colour twice before each has been used
            mean = palette.pop(int(rng.integers(len(palette))))
            red, green, blue = (round(c + int(rng.integers(-5, 6)) / 100, 2) for c in mean)
            contrast = int(rng.integers(*rules.contrast, endpoint=True)) / 100
            number[kind] += 1
            bodies = KINDS[kind](rng, Look((red, green, blue), contrast))
            found.append(Model(f"{kind}_{number[kind]}", bodies))
        return found

    def _place(self, model: Model) -> bool:
        """Puts a model where it keeps its distance; whether there was such a place."""
        rng, rules = self.rng, self.rules
        for _ in range(TRIES):
            x, y = (int(rng.integers(low, high, endpoint=True)) for low, high in zip(self.low, self.high, strict=True))
            pose = (x / 1000, y / 1000, 0.0, 0.0, 0.0, float(rng.integers(360)))
            there = Model(model.name, model.bodies, pose, model.structure)
            mine = outlines(there)
            if self._inside(mine) and all(apart(mine, other, rules.gap) for _, other in self.placed):
                self.placed.append((there, mine))
                return True
        return False

    def _inside(self, mine: tuple[Outline, ...]) -> bool:
        """Whether outlines keep their distance from the sides of the room and from the start."""
        low, high = (np.array(corner) / 1000 for corner in (self.low, self.high))
        for outline in mine:
            corners, reach = outline.corners(), outline.radius + self.rules.wall_gap
            if (corners - reach < low).any() or (corners + reach > high).any():
                return False
            if outline.distance(np.zeros((1, 2)))[0] < self.rules.clear:
                return False
        return True

    def _drivable(self) -> bool:
        """Whether the robot gets from the start to all that is free, and sees each obstacle from several sides."""
        walls = outlines(Model("walls", self.walls))
        bodies = [outline for _, some in self.placed for outline in some]
        (x0, y0), (x1, y1) = self.low, self.high
        places = Places.of((x0 / 1000, y0 / 1000), (x1 / 1000, y1 / 1000), [*walls, *bodies])
        labels, count = places.parts(ROBOT_RADIUS + ROBOT_MARGIN)
        if count != 1:
            return False
        return all(
            self._views(places, labels > 0, model, some) >= self.rules.views
            for model, some in self.placed
            if not model.structure
        )

    def _views(self, places: Places, free: NDArray[np.bool_], model: Model, mine: tuple[Outline, ...]) -> int:
        """From how many directions a model can be seen from a free place."""
        middles = np.array([(outline.x, outline.y) for outline in mine])
        middle = np.array([middles[:, 0].mean(), middles[:, 1].mean()])
        others = [outline for other, some in self.placed if other.name != model.name for outline in some]
        others = [outline for outline in others if outline.distance(middle[None])[0] < VIEW_RANGE[1]]
        offset = places.points - middle
        away = np.sqrt((offset * offset).sum(axis=-1))
        good = free & (away >= VIEW_RANGE[0]) & (away <= VIEW_RANGE[1])
        dx, dy = offset[good][sees(places.points[good], middle, others)].T
        # Eighths of the circle by signs and by which of the two is larger: no angle is computed.
        return len(np.unique((dx > 0) * 4 + (dy > 0) * 2 + (np.abs(dx) > np.abs(dy))))


def _reach(model: Model) -> float:
    """[m] from the model's origin to its farthest corner."""
    return max(
        float(np.sqrt((outline.corners() ** 2).sum(axis=1)).max()) + outline.radius for outline in outlines(model)
    )


def _pick(rng: np.random.Generator, colours: tuple[Colour, ...]) -> Colour:
    return colours[int(rng.integers(len(colours)))]


def _with_contrast(model: Model, contrast: float) -> Model:
    bodies = tuple(Body(b.name, b.shape, b.pose, b.colour, contrast) for b in model.bodies)
    return Model(model.name, bodies, model.pose, model.structure)
