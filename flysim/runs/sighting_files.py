"""Everything of one pair of photographs into a folder."""

from __future__ import annotations

import json
from pathlib import Path

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
    text = json.dumps(plain_data(sighting.to_json()), indent=1, allow_nan=False, ensure_ascii=False)
    (folder / SEE).write_text(text + "\n", encoding="utf-8")
    (folder / "flies.parquet").write_bytes(parquet_bytes(findings.cloud, sighting.name, findings.sequence.seed))
    (folder / "flies.ply").write_bytes(ply_bytes(findings.cloud))
    write_pngs(
        folder,
        {
            "depth.png": depth_figure(findings, metric=metric),
            "things.png": things_figure(findings, sighting.things, metric=metric),
            "above.png": above_figure(findings, sighting.things, metric=metric),
        },
    )
    write_recording(folder / "recording.rrd", findings, None, None, config={"pair": sighting.name})
