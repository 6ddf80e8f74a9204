"""`flysim sensors`: what each flaw of a camera, and each light, looks like."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flysim.cli.options import OwnSeed, Renderer, within
from flysim.cli.study import renderer_named, scenario_names
from flysim.cli.terminal import say


def sensors(
    scenario: Annotated[
        str, typer.Argument(help="Name (flysim list) or path of a scenario file.", autocompletion=scenario_names)
    ],
    out: Annotated[Path | None, typer.Option(help="PNG to write. [SCENARIO-sensors.png]")] = None,
    stop: Annotated[int, typer.Option(help="Which of its stops, from 1.", callback=within("--stop", 1, 1000))] = 1,
    width: Annotated[
        int,
        typer.Option(
            help="Pixels of an eye's image across; figures in px count these.", callback=within("--width", 32, 2048)
        ),
    ] = 320,
    seed: OwnSeed = None,
    overrides: Annotated[
        list[str] | None, typer.Option("--set", help="KEY=VALUE for a scenario's key; may be repeated.")
    ] = None,
    renderer: Renderer = "auto",
) -> None:
    """Draw what the robot sees at one stop under each disturbance: the scenario's own, or else all.

    Its own are those of its tables sensors, calibration and light, or of --set. The robot turns to the left by
    1 rad/s, which a rolling shutter shows.
    """
    from flysim.runs.scenario import read_scenario

    drawn_by, plan = renderer_named(renderer), read_scenario(scenario, overrides or ())
    from flysim.studies.sensors.grid import draw_effects

    target = out or Path(f"{plan.name}-sensors.png")
    draw_effects(plan, target, stop=stop, width=width, seed=plan.seed if seed is None else seed, renderer=drawn_by)
    say(target)
