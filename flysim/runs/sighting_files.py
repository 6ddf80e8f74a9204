"""Everything of one pair of photographs into a folder."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from flysim.common.plain_data import plain_data
from flysim.runs.sighting import Sighting

SEE = "see.json"


def write_sighting(folder: Path, sighting: Sighting) -> None:
    """Write see.json, pictures, flies as PLY and Parquet, and the recording, into an existing folder.

    Raises:
        RecordError: rerun is switched off by its environment variable.
        OSError: the disk is full or refuses.
    """
    from flysim.record.canvas import write_pngs
    from flysim.record.files import parquet_bytes, ply_bytes
    from flysim.record.photographs import above_figure, depth_figure, things_figure
    from flysim.record.recording import write_recording

    findings, metric = sighting.findings, sighting.photograph.metric
    _write_json(folder / SEE, sighting.to_json())
    table = parquet_bytes(findings.cloud, sighting.name, findings.sequence.seed, metric=metric)
    (folder / "flies.parquet").write_bytes(table)
    (folder / "flies.ply").write_bytes(ply_bytes(findings.cloud, metric=metric))
    write_pngs(
        folder,
        {
            "depth.png": depth_figure(findings, metric=metric),
            "things.png": things_figure(findings, sighting.things, metric=metric),
            "above.png": above_figure(findings, sighting.things, metric=metric),
        },
    )
    write_recording(folder / "recording.rrd", findings, None, None, config={"pair": sighting.name}, metric=metric)


def write_index(folder: Path, pairs: list[dict[str, Any]], refused: list[str]) -> None:
    """Write see.json of a sequence: what each pair's own has, and why others could not be seen.

    Raises:
        OSError: the disk is full or refuses.
    """
    _write_json(folder / SEE, {"pairs": pairs, "refused": refused})


def _write_json(path: Path, data: Any) -> None:
    text = json.dumps(plain_data(data), indent=1, allow_nan=False, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")
