"""Means with their confidence, rank correlation, and who is beaten by nobody."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy import stats

CONFIDENCE = 0.95


def mean_ci95(values: Sequence[float]) -> tuple[float, float | None]:
    """The mean and the half width of its 95 % confidence interval (Student's t); None for one value alone."""
    n = len(values)
    mean = float(np.mean(values))
    if n < 2:
        return mean, None
    return mean, float(stats.t.ppf((1.0 + CONFIDENCE) / 2.0, n - 1) * np.std(values, ddof=1) / math.sqrt(n))


def rank_correlation(a: Sequence[float], b: Sequence[float]) -> float | None:
    """Spearman's rank correlation, ties at their mean rank; None where one side has no order at all."""
    if len(set(a)) < 2 or len(set(b)) < 2:
        return None
    # Spearman's coefficient is Pearson's of the ranks.
    return float(np.corrcoef(stats.rankdata(a), stats.rankdata(b))[0, 1])


def front(cost: Sequence[float], quality: Sequence[float]) -> tuple[int, ...]:
    """Indices of what nothing beats (the Pareto front), by rising cost.

    One beats another if it costs no more and is no worse, and is better in one of the two.
    """
    found: list[int] = []
    for i in sorted(range(len(cost)), key=lambda i: (cost[i], -quality[i])):
        best = found[-1] if found else None
        if best is None or quality[i] > quality[best] or (cost[i], quality[i]) == (cost[best], quality[best]):
            found.append(i)
    return tuple(found)
