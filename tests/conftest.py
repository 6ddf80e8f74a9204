"""For two workers side by side: a place for compiled kernels each, and what takes longest first."""

import os
from pathlib import Path

# numba's cache is not made for two processes that compile different variants of one function at the same time.
if worker := os.environ.get("PYTEST_XDIST_WORKER"):
    kernels = Path(__file__).resolve().parents[1] / ".pytest_cache" / f"kernels-{worker}"
    os.environ["NUMBA_CACHE_DIR"] = str(kernels)


def pytest_collection_modifyitems(items):
    items.sort(key=lambda item: item.path.name != "test_wheel.py")
