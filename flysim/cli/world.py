"""`flysim world`: make worlds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flysim.cli.options import MAX_SEED, AsJson, within
from flysim.cli.terminal import say, say_json

world = typer.Typer(help="Make worlds.", no_args_is_help=True)


def _difficulties(incomplete: str) -> list[str]:
    from flysim.worlds.random.difficulty import DIFFICULTIES

    return [name for name in DIFFICULTIES if name.startswith(incomplete)]


@world.command("random", epilog="Example: flysim world random --seed 7 --difficulty hard")
def world_random(
    seed: Annotated[
        int, typer.Option(help="The same seed gives the same bytes.", callback=within("--seed", 0, MAX_SEED))
    ] = 0,
    difficulty: Annotated[str, typer.Option(help="easy, medium or hard.", autocompletion=_difficulties)] = "medium",
    out: Annotated[Path | None, typer.Option(help="Folder to write. [random-DIFFICULTY-SEED]")] = None,
    as_json: AsJson = False,
) -> None:
    """Make a world of obstacles at random places: world.sdf and its textures."""
    from flysim.worlds.random.generate import describe, generate, write_random_world

    folder = Path(f"random-{difficulty}-{seed}") if out is None else out
    path = write_random_world(folder, seed=seed, difficulty=difficulty)
    if as_json:
        obstacles = [describe(model) for model in generate(seed, difficulty) if not model.structure]
        say_json({"path": str(path), "seed": seed, "difficulty": difficulty, "obstacles": obstacles})
        return
    say(path, f"look at it: flysim preview {path}")
