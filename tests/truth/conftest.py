"""The worlds built by hand, which the rooms that know the truth share."""

from by_hand import by_hand, yard

__all__ = ["by_hand", "yard"]
