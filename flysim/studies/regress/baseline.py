"""A baseline: the figures that a run once reached, and how far each may fall behind them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeVar

from flysim.common import catalogue as assets
from flysim.common.whole_file import write_whole
from flysim.errors import RecordError, did_you_mean
from flysim.evaluate.report import Report
from flysim.evaluate.scores import TAUS
from flysim.foreign.data import read_json
from flysim.plain import shown, shown_path
from flysim.studies.compare.figures_of import pooled

Better = Literal["higher", "lower"]
Verdict = Literal["same", "moved", "better", "worse"]

# What is held: which way is better, and how far a figure may fall behind before it counts as worse. A change of the
# engine draws other random numbers, and another machine rounds otherwise: so the tolerances of centres, sizes and
# surfaces are some two standard deviations over the seeds of `yard` (docs/compare.md); a baseline's file may have
# tighter ones. What is counted may not change at all.
FIGURES: dict[str, tuple[Better, float]] = {
    "f1": ("higher", 0.0),
    "precision": ("higher", 0.0),
    "recall": ("higher", 0.0),
    "missed_big": ("lower", 0.0),
    "center_error_m": ("lower", 0.0015),
    "center_error_max_m": ("lower", 0.012),
    "size_error_m": ("lower", 0.001),
    "size_error_max_m": ("lower", 0.015),
    "size_error_rel": ("lower", 0.002),
    "accuracy_median_m": ("lower", 0.0002),
    **{f"surface_f_{tau}": ("higher", 0.01) for tau in TAUS},
}
SAME = 1e-6  # what a report's figures are rounded to
FOLDER = assets.ROOT / "runs" / "baselines"
MAX_STOPS = 1000
MAX_BYTES = 2**20

T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class Held:
    """One figure: its value (None where there was nothing to measure), and how far it may fall behind."""

    value: float | None
    tolerance: float
    better: Better


@dataclass(frozen=True, slots=True, kw_only=True)
class Moved:
    """A figure then and now."""

    figure: str
    old: float | None
    new: float | None
    tolerance: float
    verdict: Verdict


@dataclass(frozen=True, slots=True, kw_only=True)
class Baseline:
    """What to run, and the figures to hold it to.

    Attributes:
        path: its file.
        scenario: name or path of a scenario.
        engine: what sees.
        seed: of all randomness.
        renderer: "gl" or "tiny": figures of the two are not the same.
        stops: only the first so many; None for all.
        overrides: `KEY=VALUE` for the scenario.
        figures: by name.
        updates: when and why the figures were changed: dicts of date and reason, the latest last.
    """

    path: Path
    scenario: str
    engine: str
    seed: int
    renderer: Literal["gl", "tiny"]
    stops: int | None
    overrides: tuple[str, ...]
    figures: dict[str, Held]
    updates: tuple[dict[str, str], ...]

    @property
    def name(self) -> str:
        """Of its file, without the ending."""
        return self.path.stem

    def judge(self, new: dict[str, float | None]) -> tuple[Moved, ...]:
        """Each held figure beside the new one."""
        return tuple(
            Moved(
                figure=figure,
                old=held.value,
                new=new.get(figure),
                tolerance=held.tolerance,
                verdict=_verdict(held, new.get(figure)),
            )
            for figure, held in self.figures.items()
        )

    def updated(self, new: dict[str, float | None], reason: str, date: str) -> dict[str, Any]:
        """The file's new content: new values, the same tolerances, one more update.

        Raises:
            RecordError: no reason.
        """
        if not reason.strip():
            raise RecordError("new figures need a reason: flysim regress --update --reason 'why they may change'")
        figures = {}
        for name, (better, usual) in FIGURES.items():
            held = self.figures.get(name)
            tolerance = usual if held is None else held.tolerance
            figures[name] = {"value": new[name], "tolerance": tolerance, "better": better}
        return {
            "scenario": self.scenario,
            "engine": self.engine,
            "seed": self.seed,
            "renderer": self.renderer,
            "stops": self.stops,
            "overrides": list(self.overrides),
            "figures": figures,
            "updates": [*self.updates, {"date": date, "reason": reason.strip()}],
        }


def figures_of_report(report: Report) -> dict[str, float | None]:
    """What a baseline holds of a report: never a time."""
    figures = pooled([report])
    found: dict[str, float | None] = {name: figures[name] for name in FIGURES if name in figures}
    found |= {
        "center_error_max_m": report.center_visible_error.max,
        "size_error_max_m": report.size_visible_error.max,
        "accuracy_median_m": report.surface.accuracy_median,
        **{f"surface_f_{tau}": figures["surface_f"][tau] for tau in TAUS},
    }
    return {name: None if found[name] is None else round(float(found[name] or 0.0), 6) for name in FIGURES}


def _verdict(held: Held, new: float | None) -> Verdict:
    if held.value is None or new is None:
        # Nothing to measure means that nothing was found: that is worse than any error.
        return "same" if held.value is new else "worse" if new is None else "better"
    gain = (new - held.value) * (1.0 if held.better == "higher" else -1.0)
    if abs(gain) <= SAME:
        return "same"
    if abs(gain) <= held.tolerance + SAME:
        return "moved"
    return "better" if gain > 0.0 else "worse"


def find_baselines(names: Sequence[str], folder: Path = FOLDER) -> list[Baseline]:
    """The baselines of some names, or all of a folder.

    Raises:
        RecordError: no such baseline, or a file that is none.
    """
    known = {path.stem: path for path in sorted(folder.glob("*.json"))}
    if not known:
        raise RecordError(f"no baseline in {folder}: give a folder that holds some as --baselines DIR.")
    for name in names:
        if name not in known:
            raise RecordError(f"no baseline '{name}'. {did_you_mean(name, known)}")
    return [read_baseline(known[name]) for name in (names or known)]


def read_baseline(path: Path) -> Baseline:
    """The baseline of a file.

    Raises:
        RecordError: it cannot be read, or a key is missing or wrong.
    """
    data = read_json(path, "baseline", MAX_BYTES, RecordError)
    try:
        if not isinstance(data, dict):
            raise ValueError(f"it holds {shown(repr(data))}")
        stops = data.get("stops")
        if stops is not None and not (isinstance(stops, int) and 1 <= stops <= MAX_STOPS):
            raise ValueError(f"stops must be in [1, {MAX_STOPS}] or null, got {stops!r}")
        if data["renderer"] not in ("gl", "tiny"):
            raise ValueError(f"renderer must be gl or tiny, got {data['renderer']!r}")
        if not (isinstance(data["seed"], int) and data["seed"] >= 0):
            raise ValueError(f"seed must be a whole number from 0, got {data['seed']!r}")
        return Baseline(
            path=path,
            scenario=_of_kind(str, "scenario", data["scenario"]),
            engine=_of_kind(str, "engine", data.get("engine", "flies")),
            seed=data["seed"],
            renderer=data["renderer"],
            stops=stops,
            overrides=tuple(_of_kind(str, "an override", one) for one in data.get("overrides", ())),
            figures={name: _held(name, held) for name, held in data.get("figures", {}).items()},
            updates=tuple(_of_kind(dict, "an update", one) for one in data.get("updates", ())),
        )
    except KeyError as error:
        raise RecordError(f"{shown_path(path)}: no baseline: it lacks {error}.") from error
    except (ValueError, TypeError, AttributeError) as error:
        raise RecordError(f"{shown_path(path)}: no baseline: {error}.") from error


def _of_kind(kind: type[T], what: str, value: Any) -> T:
    if not isinstance(value, kind):
        raise ValueError(f"{what} is of another kind: {value!r}")
    return value


def _held(name: str, data: dict[str, Any]) -> Held:
    if name not in FIGURES:
        raise ValueError(f"no figure {shown(name)}. {did_you_mean(name, FIGURES).removesuffix('.')}")
    value, tolerance = data["value"], float(data["tolerance"])
    if not tolerance >= 0.0:
        raise ValueError(f"the tolerance of {name} must be >= 0, got {tolerance}")
    return Held(value=None if value is None else float(value), tolerance=tolerance, better=FIGURES[name][0])


def write_baseline(path: Path, data: dict[str, Any]) -> None:
    """Write a baseline's file, whole or not at all.

    Raises:
        OSError: the folder refuses, or the disk is full.
    """
    write_whole(path, json.dumps(data, indent=1, allow_nan=False) + "\n")
