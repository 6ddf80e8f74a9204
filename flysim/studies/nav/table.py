"""Agents' scores as a table a person reads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flysim.common.sheet import Sheet

COLUMNS = {
    "success": "success",
    "spl": "SPL",
    "soft_spl": "SoftSPL",
    "collision": "collision",
    "time_out": "time-out",
    "clearance": "clearance, m",
    "barn": "BARN",
}


def nav_sheet(worlds: str, data: Mapping[str, Any]) -> Sheet:
    """A row an agent: each mean with its 95 % interval."""
    rows = []
    for agent in data["agents"]:
        cells = [_cell(agent[name], agent[f"{name}_ci95"]) for name in COLUMNS]
        rows.append((agent["agent"], str(agent["episodes"]), *cells, f"{agent['steps_per_second']:.0f}"))
    return Sheet(
        title=f"{worlds}, seen by {data['observation']}",
        columns=("agent", "episodes", *COLUMNS.values(), "steps/s"),
        rows=tuple(rows),
        note="In brackets 95 % intervals over the episodes. Steps a second of each process, the agent's part included.",
    )


def _cell(mean: float, interval: list[float] | None) -> str:
    return f"{mean:.3f}" if interval is None else f"{mean:.3f} [{interval[0]:.3f}, {interval[1]:.3f}]"
