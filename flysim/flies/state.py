"""What an evolution's generations hand on: flies, region by region, the preserved ones first in each."""

from __future__ import annotations

import numpy as np

FLY = np.dtype(
    [
        ("u", np.int32),  # left pixel
        ("v", np.int32),
        ("q", np.float32),  # inverse depth [1/m]
        ("qu", np.float32),  # its slopes [1/m/px]
        ("qv", np.float32),
        ("fitness", np.float32),  # unshared
        ("shared", np.float32),  # fitness, after sharing
        ("age", np.int32),  # generations survived
    ]
)
REGION = np.dtype(
    [
        *((name, np.int64) for name in ("u0", "u1", "v0", "v1")),  # its pixels, half-open
        *((name, np.int64) for name in ("first", "last")),  # its slots, half-open
        ("places", np.int64),  # flies that it may preserve
        *((name, np.int64) for name in ("crossed", "mutated")),  # children of each kind; the others are immigrants
        ("parents", np.int64),  # where in the list of parents its own begin
        # Of the last selection:
        ("kept", np.int64),  # flies preserved
        ("needed", np.float64),  # fitness without which nothing is preserved
        ("best", np.float64),  # highest fitness
        ("total", np.float64),  # sum of the fitness of the preserved
        ("settled", np.int64),  # settled flies among them
    ]
)
