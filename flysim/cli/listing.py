"""`flysim list`: all that has a name, and where it comes from."""

from __future__ import annotations

from importlib import import_module
from typing import Annotated, Any

import typer

from flysim.cli.terminal import say_json, show
from flysim.common import catalogue
from flysim.common.registry import Registry

# What a user chooses by name, beside scenarios, worlds and robots: the registry of each kind.
KINDS = {
    "engines": "flysim.engines.choose:ENGINES",
    "localisations": "flysim.localise.localiser:LOCALISATIONS",
    "measures": "flysim.flies.measure:MEASURES",
    "operators": "flysim.flies.operator:OPERATORS",
    "agents": "flysim.nav.agents.choose:AGENTS",
    "formats": "flysim.datasets.layout:FORMATS",
    "suites": "flysim.studies.suite.suites:SUITES",
    "studies": "flysim.studies.sweep.study:STUDIES",
}


def registry(kind: str) -> Registry:
    """The registry of one of `KINDS`."""
    module, _, name = KINDS[kind].partition(":")
    return getattr(import_module(module), name)


def list_names(
    kinds: Annotated[
        list[str] | None,
        typer.Argument(help=f"scenarios, worlds, robots, {', '.join(KINDS)}. [all]"),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """List whatever has a name: scenarios, worlds, robots, and what is found by name, with where each comes from.

    All but scenarios, worlds and robots may also be typed as module:object, as in --engine mypkg.mine:see.
    """
    data = _wanted(kinds or ())
    if as_json:
        say_json(data)
        return
    show(_sheets(data))


def _wanted(kinds: list[str] | tuple[()]) -> dict[str, Any]:
    from flysim.errors import FlysimError, did_you_mean
    from flysim.runs.scenario import read_scenario

    known = ("scenarios", "worlds", "robots", *KINDS)
    for kind in kinds:
        if kind not in known:
            raise FlysimError(f"nothing is called '{kind}' here. {did_you_mean(kind, known)}")
    data: dict[str, Any] = {}
    for kind in kinds or known:
        if kind == "scenarios":
            scenarios = [read_scenario(name) for name in catalogue.names("runs")]
            data[kind] = [
                {
                    "name": s.name,
                    "description": s.description,
                    "world": s.world,
                    "robot": s.robot,
                    "stops": len(s.stops),
                }
                for s in scenarios
            ]
        elif kind in KINDS:
            data[kind] = [
                {"name": entry.name, "from": entry.origin, "place": entry.place} for entry in registry(kind).entries()
            ]
        else:
            data[kind] = catalogue.world_names() if kind == "worlds" else catalogue.names(kind)
    return data


def _sheets(data: dict[str, Any]) -> list[Any]:
    from flysim.common.sheet import Sheet

    sheets = []
    if "scenarios" in data:
        columns = ("name", "world", "robot", "stops", "description")
        rows = tuple(tuple(str(one[column]) for column in columns) for one in data["scenarios"])
        sheets.append(Sheet(title="scenarios", columns=columns, rows=rows, left=(0, 1, 2, 4)))
    rows = []
    for kind, entries in data.items():
        if kind in ("worlds", "robots"):
            own = catalogue.names(kind)
            rows.append((kind, "flysim", ", ".join(own)))
            if kind == "worlds":
                rows += [
                    (kind, entry.origin, entry.name) for entry in catalogue.WORLDS.entries() if entry.name not in own
                ]
        elif kind != "scenarios":
            origins = dict.fromkeys(entry["from"] for entry in entries)
            rows += [
                (kind, origin, ", ".join(entry["name"] for entry in entries if entry["from"] == origin))
                for origin in origins
            ]
    if rows:
        note = f"worlds, {', '.join(KINDS)} may also be module:object: see docs/extending.md"
        sheets.append(Sheet(title="", columns=("what", "from", "names"), rows=tuple(rows), left=(0, 1, 2), note=note))
    return sheets
