"""The report as a Markdown page, for the recording."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from flysim.evaluate.report import DISTURBED
from flysim.evaluate.table import flaws
from flysim.plain import plain

_AXES = ("length", "width", "height")


def report_markdown(report: Mapping[str, Any]) -> str:
    """A page a person reads, from `Report.to_json()`. No wall-clock times: one seed is one page."""
    lines = [f"# {_text(report.get('scenario'))}, seed {report.get('seed')}", ""]
    lines += [
        f"Status **{report.get('status')}**, {report.get('engine')}, {report.get('renderer')} renderer.",
        "",
    ]
    disturbed = flaws({name: report.get(name) or {} for name in DISTURBED})
    lines += [f"Disturbed: {_text(disturbed)}.", ""] if disturbed else []
    lines += _scores(report) + _obstacles(report) + _surface(report) + _stops(report)
    lines += ["Wall-clock times are in `report.json`: they change from run to run.", ""]
    return "\n".join(lines)


def _scores(report: Mapping[str, Any]) -> list[str]:
    found = [o for o in report.get("obstacles") or () if o.get("detected")]
    size, center = report.get("size_error_m") or {}, report.get("center_error_m") or {}
    rows = [
        ("obstacles found", f"{len(found)} of {len(report.get('obstacles') or ())}"),
        ("false obstacles", _false(report.get("false_obstacles"))),
        (
            "precision / recall / F1",
            " / ".join(_number(report.get(k), 2) for k in ("precision", "recall", "f1")),
        ),
        ("centre error, median (largest)", f"{_cm(center.get('median'))} ({_cm(center.get('max'))}) cm"),
        ("size error, median (largest)", f"{_cm(size.get('median'))} ({_cm(size.get('max'))}) cm"),
    ]
    return _table(("", ""), rows)


def _obstacles(report: Mapping[str, Any]) -> list[str]:
    rows = []
    for o in report.get("obstacles") or ():
        true, visible = o.get("size_true_m") or (None,) * 3, o.get("size_visible_m") or (None,) * 3
        estimated = o.get("size_estimated_m") or (None,) * 3
        sizes = [f"{_cm(e)} ({_cm(v)} of {_cm(t)})" for e, v, t in zip(estimated, visible, true, strict=True)]
        rows.append((_text(o.get("name")), "yes" if o.get("detected") else "no", _cm(o.get("center_error_m")), *sizes))
    head = ("obstacle", "found", "centre error", *_AXES)
    return ["## Obstacles", "", "In cm; sizes: estimated (visible of true).", "", *_table(head, rows)]


def _surface(report: Mapping[str, Any]) -> list[str]:
    surface = report.get("surface") or {}
    median, p90 = surface.get("accuracy_median_m"), surface.get("accuracy_p90_m")
    lines = ["## Flies against the visible surface", ""]
    lines += [f"Distance to it: median {_cm(median, 2)} cm, 90 % within {_cm(p90, 2)} cm.", ""]
    scores = [surface.get(key) or {} for key in ("precision", "completeness", "f_score")]
    rows = [(f"{_cm(float(tau), 0)} cm", *(_number(s.get(tau), 3) for s in scores)) for tau in scores[0]]
    return lines + _table(("within", "precision", "completeness", "F-score"), rows)


def _stops(report: Mapping[str, Any]) -> list[str]:
    rows = [
        (s.get("index"), s.get("iterations"), "yes" if s.get("converged") else "no") for s in report.get("stops") or ()
    ]
    return ["## Stops", "", *_table(("stop", "generations", "converged"), rows)]


def _table(head: Iterable[Any], rows: Iterable[Iterable[Any]]) -> list[str]:
    head = list(head)
    lines = [_row(head), _row(["---"] * len(head))]
    return [*lines, *(_row(row) for row in rows), ""]


def _row(cells: Iterable[Any]) -> str:
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


def _text(value: Any) -> str:
    """Somebody else's words as they stand: no link, no picture, no HTML, no cell's end."""
    return re.sub(r"[\\`*\[\]<>|!&]", r"\\\g<0>", plain(str(value)))


def _false(value: Any) -> str:
    return str(len(value) if isinstance(value, (list, tuple)) else value)


def _cm(metres: Any, digits: int = 1) -> str:
    return "-" if metres is None else f"{100.0 * metres:.{digits}f}"


def _number(value: Any, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
