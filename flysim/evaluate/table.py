"""A report as a person reads it: plain text, centimetres."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from flysim.evaluate.scores import ObstacleReport, Scores, Spread, SurfaceReport
from flysim.plain import plain, shortened

NOTHING = "-"
LABEL = 11  # characters before what a line says
OTHER_SHAPE = "*"
NOT_VISIBLE = "(not visible)"
COLUMNS = (
    "obstacle",
    "found as",
    "centre",
    "true l x w x h",
    "visible",
    "estimated",
    "error",
    "to visible",
    "yaw",
)


NARROW = (  # what stands beside each other where one row is too wide: sizes, then errors
    ("obstacle", "true l x w x h", "visible", "estimated"),
    ("obstacle", "found as", "centre", "error", "to visible", "yaw"),
)
LONGEST_NAME = 12  # of an obstacle there


def table(report: Scores, width: int | None = None) -> str:
    """The obstacles line by line with their errors, then the figures over all of them.

    Args:
        report: whose.
        width: characters of a line; None: as many as it takes.
    """
    ran = f"{len(report.stops)} of {report.stops_planned} stops"
    head = f"{report.scenario} in world {report.world}: seed {report.seed}, {report.renderer}, {report.engine}"
    dressed = [f"dressed in {report.texture}"] if report.texture else []
    # Names come from files: here already, not only at the terminal's border, since `print(report)` goes past it.
    lines = [plain(", ".join([head, ran, *dressed, *([report.blocked] if report.blocked else [])])), ""]
    rows = [tuple(plain(cell) for cell in _row(obstacle)) for obstacle in report.obstacles]
    disturbed = flaws({name: getattr(report, name) for name in ("sensors", "calibration", "light", "odometry")})
    lines[1:1] = [plain(f"disturbed: {disturbed}")] if disturbed else []
    lines += _obstacles(rows, width)
    seen = [o for o in report.obstacles if o.visible]
    found = round(sum(o.share for o in seen), 2)
    also = f", {report.structure_obstacles} on ground or walls" if report.structure_obstacles else ""
    surface, part, whole = report.surface, report.size_visible_error, report.size_error
    starred = "; * is another shape" if any(OTHER_SHAPE in _shape(o) for o in report.obstacles) else ""
    parts = "; a long structure's share that was found" if any(o.pieces > 1 for o in report.obstacles) else ""
    lines += [
        f"(lengths in cm; errors are estimated minus true, and estimated minus the part that was visible"
        f"{starred}{parts})",
        "",
        f"found      {found:g} of {len(seen)} visible, {report.false_obstacles} false{also}: "
        f"recall {report.recall:.2f}, precision {report.precision:.2f}, F1 {report.f1:.2f}",
        f"well       {sum(o.found_well for o in seen)} of {len(seen)} to 3 cm, or 5 % of a dimension: "
        f"F1 {report.well.get('f1', 0.0):.2f}",
        f"centre     {_spread(report.center_visible_error)} cm from the visible part; "
        f"{_spread(report.center_error)} cm from the whole (median / 95 % / max)",
        f"size       {_spread(part)} cm from the visible part; {_spread(whole)} cm from the whole",
        f"height     {_spread(report.height_visible_error)} cm from the visible part; "
        f"{_spread(report.height_error)} cm from the whole",
        f"shape      {_share(report.shape_accuracy)} right; overlap {_share(report.iou_plan)} from above, "
        f"{_share(report.iou_3d)} in space",
        f"flies      median {_cm(surface.accuracy_median, 2)} cm, "
        f"90 % within {_cm(surface.accuracy_p90, 2)} cm of the visible surface",
        *_by_threshold(report.surface),
        *([f"plain      {100.0 * report.plain:.0f} % of the pictures show nothing to match"] if report.plain else []),
        *_way(report.whereabouts),
        *_rows_apart(report.alignment),
        *_explained(report.explained),
        "time       " + ", ".join(f"{plain(part)} {seconds:.2f} s" for part, seconds in report.time.items()),
    ]
    return "\n".join(part for line in lines for part in _broken(line, width))


def _obstacles(rows: Sequence[tuple[str, ...]], width: int | None) -> list[str]:
    """The table of them; in two parts where it is too wide."""
    whole = [line.rstrip() for line in aligned([COLUMNS, *rows])]
    if width is None or max(map(len, whole)) <= width:
        return whole
    lines = []
    for names in NARROW:
        places = [COLUMNS.index(name) for name in names]
        cut = [tuple(_cut(row)[i] for i in places) for row in rows]
        left = 2 if "found as" in names else 1
        lines += [*([""] if lines else []), *(line.rstrip() for line in aligned([names, *cut], left))]
    return lines


def _cut(row: tuple[str, ...]) -> tuple[str, ...]:
    """A row whose words are as short as 80 characters ask for."""
    name, found, *rest = row
    return shortened(name, LONGEST_NAME), "unseen" if found.endswith(NOT_VISIBLE) else found, *rest


def _broken(line: str, width: int | None) -> list[str]:
    """A line of text on as many as it takes, under what it says; figures' columns stay as they are."""
    if width is None or len(line) <= width or "   " in line[LABEL:]:
        return [line]
    indent = " " * (LABEL if line[LABEL - 2 : LABEL] == "  " else 0)
    return textwrap.wrap(line, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def flaws(disturbed: Mapping[str, Mapping[str, Any]]) -> str:
    """What was disturbed, by table and name, as a person reads it; empty where nothing was."""
    return ", ".join(f"{name}.{key} {value}" for name, table in disturbed.items() for key, value in table.items())


def _way(whereabouts: Mapping[str, Any]) -> list[str]:
    """How far off the robot believed itself, if anything was wrong with its wheels or somebody else was asked."""
    tellers = (("odometry", "odometry"), ("located", str(whereabouts.get("by"))))
    found = [(name, whereabouts[key]) for key, name in tellers if key in whereabouts]
    return [
        f"way        {_cm(one['ape_m'], 2)} cm off by {plain(name)} (root mean square), {_cm(one['ape_max_m'], 2)} at "
        f"most; from stop to stop {_cm(one['rpe_m'], 2)} cm, "
        f"{NOTHING if one['rpe_deg'] is None else format(one['rpe_deg'], '.2f')} deg"
        for name, one in found
    ]


def _rows_apart(alignment: dict[str, float] | None) -> list[str]:
    """What was corrected of the right camera, if anything was."""
    if not alignment:
        return []
    lines, blur = [], alignment.get("right_blur_px", 0.0)
    if alignment["row_shift_px"] or alignment["right_roll_deg"]:
        lines.append(
            f"rows       the right picture lies {alignment['row_shift_px']:.2f} px lower than the rig says, its camera "
            f"is rolled by {alignment['right_roll_deg']:.2f} deg: corrected"
        )
    if blur:
        side = "right" if blur > 0.0 else "left"
        lines.append(
            f"focus      the {side} picture is blurred by {abs(blur):.2f} px: the other one was softened alike"
        )
    return lines


def _explained(explained: Mapping[str, Any]) -> list[str]:
    """How much of the errors is the calibration's, if that is wrong."""
    if not explained:
        return []
    center, size = (100.0 * explained[key] for key in ("center_share", "size_share"))
    return [f"calibration explains {center:.0f} % of the centres' errors and {size:.0f} % of the sizes'"]


def _by_threshold(surface: SurfaceReport) -> list[str]:
    rows = [("surface", "within", *(f"{float(tau) * 100:.0f} cm" for tau in surface.precision))]
    shares = {
        "precision": surface.precision,
        "completeness": surface.completeness,
        "F-score": surface.f_score,
    }
    rows += [("", name, *(f"{value:.3f}" for value in share.values())) for name, share in shares.items()]
    return [line[:7] + "  " + line[7:] for line in aligned(rows)]


def aligned(rows: Sequence[Sequence[str]], left: int = 2) -> list[str]:
    """Rows as lines of equal columns: the first ones flush left, the rest flush right."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return [
        "  ".join(
            cell.ljust(w) if i < left else cell.rjust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]


def _row(o: ObstacleReport) -> tuple[str, ...]:
    found = _shape(o)
    return (
        o.name,
        found if o.visible else f"{found} {NOT_VISIBLE}",
        _cm(o.center_error),
        _sizes(o.size_true),
        _sizes(o.size_visible),
        _sizes(o.size_estimated),
        _sizes(o.size_error, "+"),
        _sizes(o.size_visible_error, "+"),
        NOTHING if o.yaw_error_deg is None else f"{o.yaw_error_deg:.1f} deg",
    )


def _shape(o: ObstacleReport) -> str:
    """What it was found as, with a star where it truly is another shape."""
    if o.shape_estimated is None:
        return "no"
    part = f" {100.0 * o.share:.0f} %" if 0.0 < o.share < 1.0 or o.pieces > 1 else ""
    return o.shape_estimated + OTHER_SHAPE * (o.shape_estimated != o.shape_true) + part


def _cm(metres: float | None, digits: int = 1) -> str:
    return NOTHING if metres is None else f"{metres * 100:.{digits}f}"


def _spread(errors: Spread) -> str:
    return " / ".join(_cm(value) for value in (errors.median, errors.p95, errors.max))


def _share(value: float | None) -> str:
    return NOTHING if value is None else f"{value:.2f}"


def _sizes(metres: Sequence[float] | None, sign: str = "") -> str:
    if metres is None:
        return NOTHING
    separator = " " if sign else " x "
    return separator.join(f"{round(value * 100, 1) + 0.0:{sign}.1f}" for value in metres)
