"""The machine a figure was measured on."""

from __future__ import annotations

import os
import platform
from pathlib import Path
from typing import Any

from flysim.common.provenance import git_commit, versions
from flysim.flies.threads import lanes


def machine() -> dict[str, Any]:
    """Processor, cores, threads of the kernels, versions of Python and packages and the commit."""
    return {
        "processor": _processor(),
        "cpu_count": os.cpu_count(),
        "cpus_usable": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "threads": lanes(),
        "versions": versions(),
        "commit": git_commit(),
    }


def _processor() -> str:
    """Its name; on Linux `platform` knows its architecture alone."""
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except (OSError, UnicodeDecodeError):
        pass
    return platform.processor() or platform.machine()
