"""What an episode is worth: SPL, SoftSPL and the BARN score.

SPL: Anderson et al., "On evaluation of embodied navigation agents", 2018. SoftSPL: Datta et al., 2020. BARN: the rules
of the BARN challenge of 2024.
"""

from __future__ import annotations

BARN_SPEED = 2.0  # [m/s] at which the rules' shortest time is driven
BARN_MOST = 0.5  # for who takes no longer than twice that time


def spl(success: bool, shortest: float, driven: float) -> float:
    """Success weighted by path length, in [0, 1]: S l / max(l, p), lengths in metres."""
    return float(success) * shortest / max(shortest, driven, 1e-9)


def soft_spl(left: float, shortest: float, driven: float) -> float:
    """SPL with max(0, 1 - d / l) for S, where d is the way that is left [m]."""
    return max(0.0, 1.0 - left / max(shortest, 1e-9)) * shortest / max(shortest, driven, 1e-9)


def barn_score(success: bool, seconds: float, length: float) -> float:
    """S T / clip(t, 2 T, 8 T) with T = length / (2 m/s): at most BARN_MOST.

    Args:
        success: without a collision and in time.
        seconds: t of simulated time that the run took.
        length: [m] of the way that counts as the shortest.
    """
    least = length / BARN_SPEED
    return float(success) * least / min(max(seconds, 2.0 * least), 8.0 * least)
