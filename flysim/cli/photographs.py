"""`flysim suite photographs`, and any suite of pairs whose true disparities are known, by every engine."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

from flysim.cli.terminal import Bar, say, say_json, show
from flysim.errors import FlysimError

if TYPE_CHECKING:
    from flysim.common.whole_folder import Reserved
    from flysim.studies.photographs.pairs import KnownPair


def suite_of_pairs(
    name: str,
    pairs: Sequence[KnownPair],
    engines: tuple[str, ...],
    seeds: Sequence[int] | None,
    place: Reserved,
    *,
    as_json: bool,
) -> None:
    """Sees all pairs of a suite, prints their scores, and keeps them with a figure."""
    from flysim.record.canvas import write_pngs
    from flysim.studies.photographs.figure import scores_figure
    from flysim.studies.photographs.photographs import run_photographs

    with place.writing() as room:
        with Bar(f"suite {name}", quiet=as_json) as bar:
            result = run_photographs(name, pairs, engines, seed=seeds[0] if seeds else 0, progress=bar)
        if not result.pairs:
            raise FlysimError(f"none of {len(pairs)} pairs could be seen: {next(iter(result.failed.values()))}")
        (room / "suite.json").write_text(
            json.dumps(result.to_json(), indent=1, allow_nan=False) + "\n", encoding="utf-8"
        )
        write_pngs(room, {"scores.png": scores_figure(result)})
    if as_json:
        say_json({**result.to_json(), "folder": str(place.out)})
        return
    show(result.sheets())
    say(f"folder: {place.out}   (suite.json; scores.png)")
