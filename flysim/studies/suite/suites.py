"""The suites by name: each a function that gives its cases: worlds with a path and a seed, or pairs of photographs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flysim.common.catalogue import BARN, barn_folder
from flysim.common.registry import Registry
from flysim.errors import ScenarioError
from flysim.runs.scenario import Scenario, read_scenario
from flysim.studies.photographs.pairs import KnownPair

PAPER = ("paper_a", "paper_b", "paper_c")
SUITES = Registry(
    "suite",
    "flysim.suites",
    {
        "paper": "flysim.studies.suite.suites:paper",
        "random-easy": "flysim.studies.suite.suites:random_easy",
        "random-medium": "flysim.studies.suite.suites:random_medium",
        "random-hard": "flysim.studies.suite.suites:random_hard",
        "barn": "flysim.studies.suite.suites:barn",
        "photographs": "flysim.studies.photographs.pairs:known_pairs",
    },
    ScenarioError,
)
MAX_CASES = 100_000  # so many more are a typing error, and would fill the memory


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
        overrides: `KEY=VALUE` for the scenario's keys.
    """

    name: str
    seed: int
    scenario: str | None = None
    difficulty: str | None = None
    world: str | None = None
    path: str = "orbit"
    texture: str | None = None
    overrides: tuple[str, ...] = ()

    def plan(self, folder: Path) -> Scenario:
        """Its scenario; a world that must be generated is written into `folder`.

        Raises:
            FlysimError: the scenario or the world cannot be read, or no path be planned.
        """
        if self.scenario is not None:
            return read_scenario(self.scenario, self.overrides)
        from flysim.runs.planned import world_scenario

        world = self.world
        if self.difficulty is not None:
            from flysim.worlds.random.generate import write_random_world

            world = write_random_world(folder / self.name, seed=self.seed, difficulty=self.difficulty)
        assert world is not None
        return world_scenario(world, robot="rover", path=self.path, texture=self.texture, overrides=self.overrides)


def cases(
    name: str, seeds: Sequence[int] | None = None, data: Path | None = None
) -> tuple[Case, ...] | tuple[KnownPair, ...]:
    """The cases of a suite, all of one kind.

    Args:
        name: of a suite, or the `module:object` of a function `suite(seeds, data)` that gives its cases.
        seeds: None takes the suite's own.
        data: folder of the suite's own worlds or pairs, where it needs one.

    Raises:
        ScenarioError: no such suite, no seed, no world, or more cases than anybody can mean.
    """
    suite = SUITES.load(name)
    if seeds is not None and not len(seeds):
        raise ScenarioError("a suite needs a seed: give --seeds 0:20 for the seeds 0 to 19.")
    found = tuple(suite(seeds, data))
    if not found or not any(all(isinstance(one, kind) for one in found) for kind in (Case, KnownPair)):
        raise ScenarioError(
            f"suite '{name}' gave no cases: it must return at least one flysim.studies.suite.suites.Case, or "
            "flysim.studies.photographs.pairs.KnownPair."
        )
    _refuse_many(len(found), 1)
    return found


def paper(seeds: Sequence[int] | None, data: Path | None) -> list[Case]:
    """The paper's three paths, five seeds each."""
    seeds = range(5) if seeds is None else seeds
    _refuse_many(len(PAPER), len(seeds))
    return [Case(name=scenario, seed=seed, scenario=scenario) for scenario in PAPER for seed in seeds]


def random_easy(seeds: Sequence[int] | None, data: Path | None) -> list[Case]:
    """Twenty generated worlds of few obstacles, far apart."""
    return _random("easy", seeds)


def random_medium(seeds: Sequence[int] | None, data: Path | None) -> list[Case]:
    """Twenty generated worlds of posts, kerbs and corners too."""
    return _random("medium", seeds)


def random_hard(seeds: Sequence[int] | None, data: Path | None) -> list[Case]:
    """Twenty generated worlds of many obstacles with faint textures, close together."""
    return _random("hard", seeds)


def _random(difficulty: str, seeds: Sequence[int] | None) -> list[Case]:
    seeds = range(20) if seeds is None else seeds
    _refuse_many(1, len(seeds))
    return [Case(name=f"random-{difficulty}-{seed}", seed=seed, difficulty=difficulty) for seed in seeds]


def barn(seeds: Sequence[int] | None, data: Path | None) -> list[Case]:
    """The worlds of the BARN benchmark, dressed, each by one seed."""
    seeds, files = range(1) if seeds is None else seeds, _barn_files(data)
    _refuse_many(len(files), len(seeds))
    return [
        Case(name=f"barn-{file.name.split('.')[0]}", seed=seed, world=str(file), texture="speckle")
        for file in files
        for seed in seeds
    ]


def _refuse_many(worlds: int, seeds: int) -> None:
    if worlds * seeds > MAX_CASES:
        raise ScenarioError(f"{worlds} worlds by {seeds} seeds are more than {MAX_CASES:,} runs: give fewer seeds.")


def _barn_files(data: Path | None) -> list[Path]:
    folder = barn_folder(data)
    found = [path for path in folder.glob("*") if path.name.endswith((".world", ".world.gz", ".sdf", ".sdf.gz"))]
    if not found:
        raise ScenarioError(
            f"no world of BARN in {folder}: give the folder that holds world_0.world.gz and its like as --data DIR, "
            f"or as ${BARN}."
        )
    return sorted(found, key=lambda path: (len(path.name), path.name))  # world_2 before world_10
