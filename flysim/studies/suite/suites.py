"""The suites: many worlds, each with a path, by a name."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flysim.errors import ScenarioError, did_you_mean
from flysim.runs.scenario import Scenario, read_scenario

PAPER = ("paper_a", "paper_b", "paper_c")
DIFFICULTIES = ("easy", "medium", "hard")
NAMES = ("paper", *(f"random-{difficulty}" for difficulty in DIFFICULTIES), "barn")
SEEDS = {"paper": range(5), "barn": range(1)}
RANDOM_SEEDS = range(20)
MAX_CASES = 100_000  # so many more are a typing error, and would fill the memory
DATA = "FLYSIM_BARN"  # environment variable: the folder of BARN's worlds
BESIDE = Path("../shared/data/barn")  # where they are looked for without it


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One world or scenario and the seed of all that is random about it.

    Attributes:
        name: what a table calls it.
        seed: of the drive and the engines; of the world too where that is generated.
        scenario: name or path of a scenario file, or None.
        difficulty: of a world to generate, or None.
        world: a world's file, or None.
        path: kind of path that is planned through a world.
        texture: what dresses a bare world.
    """

    name: str
    seed: int
    scenario: str | None = None
    difficulty: str | None = None
    world: str | None = None
    path: str = "orbit"
    texture: str | None = None

    def plan(self, folder: Path) -> Scenario:
        """Its scenario; a world that must be generated is written into `folder`.

        Raises:
            FlysimError: the scenario or the world cannot be read, or no path be planned.
        """
        if self.scenario is not None:
            return read_scenario(self.scenario)
        from flysim.runs.planned import world_scenario

        world = self.world
        if self.difficulty is not None:
            from flysim.worlds.random.generate import write_random_world

            world = write_random_world(folder / self.name, seed=self.seed, difficulty=self.difficulty)
        assert world is not None
        return world_scenario(world, robot="rover", path=self.path, texture=self.texture)


def cases(name: str, seeds: Sequence[int] | None = None, data: Path | None = None) -> tuple[Case, ...]:
    """The cases of a suite.

    Args:
        name: one of `NAMES`.
        seeds: None takes the suite's own.
        data: where the worlds of BARN are; None looks into $FLYSIM_BARN, then `../shared/data/barn`.

    Raises:
        ScenarioError: no such suite, no seed, or no world of BARN.
    """
    if name not in NAMES:
        raise ScenarioError(f"no suite '{name}'. {did_you_mean(name, NAMES)}")
    seeds = SEEDS.get(name, RANDOM_SEEDS) if seeds is None else seeds
    if not len(seeds):
        raise ScenarioError("a suite needs a seed: give --seeds 0:20 for the seeds 0 to 19.")
    files = _barn(data) if name == "barn" else []
    places = len(PAPER) if name == "paper" else len(files) or 1
    if places * len(seeds) > MAX_CASES:
        raise ScenarioError(
            f"{places} worlds by {len(seeds)} seeds are more than {MAX_CASES:,} runs: give fewer seeds."
        )
    if name == "paper":
        return tuple(Case(name=scenario, seed=seed, scenario=scenario) for scenario in PAPER for seed in seeds)
    if files:
        return tuple(
            Case(name=f"barn-{file.name.split('.')[0]}", seed=seed, world=str(file), texture="speckle")
            for file in files
            for seed in seeds
        )
    difficulty = name.removeprefix("random-")
    return tuple(Case(name=f"{name}-{seed}", seed=seed, difficulty=difficulty) for seed in seeds)


def _barn(data: Path | None) -> list[Path]:
    folder = data or (Path(os.environ[DATA]) if os.environ.get(DATA) else BESIDE)
    found = [path for path in folder.glob("*") if path.name.endswith((".world", ".world.gz", ".sdf", ".sdf.gz"))]
    if not found:
        raise ScenarioError(
            f"no world of BARN in {folder}: give the folder that holds world_0.world.gz and its like as --data DIR, "
            f"or as ${DATA}."
        )
    return sorted(found, key=lambda path: (len(path.name), path.name))  # world_2 before world_10
