"""What all tests share: where compiled kernels are kept when two workers run side by side."""

import os
from pathlib import Path

# numba's cache is not made for two processes that compile different variants of one function at the same time.
if worker := os.environ.get("PYTEST_XDIST_WORKER"):
    kernels = Path(__file__).resolve().parents[1] / ".pytest_cache" / f"kernels-{worker}"
    os.environ["NUMBA_CACHE_DIR"] = str(kernels)
