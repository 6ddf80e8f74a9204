"""Episodes as rows of a table: a Parquet file, and a name for the film of each."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from flysim.nav.episode import FILM, Episode
from flysim.products.tables import parquet

ROWS, FILMS = "episodes.parquet", "videos"
KINDS = {"str": "string", "bool": "bool", "int": "int64", "float": "float64"}
UNITS = {"clearance": "m", "path_length": "m", "shortest": "m", "time": "s"}


def episode_rows(observation: str, episodes: Sequence[Episode]) -> bytes:
    """A Parquet file with a row an episode, in the order given; units are in the metadata of its columns."""
    columns = [field for field in fields(Episode) if field.name != FILM]
    values: dict[str, list[Any]] = {
        field.name: [getattr(episode, field.name) for episode in episodes] for field in columns
    }
    return parquet(
        values,
        about={"observation": observation},
        about_columns={name: {"unit": unit} for name, unit in UNITS.items()},
        kinds={field.name: KINDS[str(field.type)] for field in columns},
    )


def films(episodes: Sequence[Episode]) -> dict[str, bytes]:
    """The films that are there, by the paths of their files."""
    return {f"{FILMS}/{_safe(e.agent)}-{_safe(e.world)}-s{e.seed}.webp": e.film for e in episodes if e.film is not None}


def _safe(name: str) -> str:
    return re.sub(r"[^\w.-]+", "_", name).strip("._")[-60:]
