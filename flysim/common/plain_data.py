"""Data in JSON's own types: what is written must be what any other program reads."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np


def plain_data(value: Any, *, digits: int | None = None) -> Any:
    """The value in JSON's own types: numpy, tuples and sets turned, paths to text, NaN and infinity to null.

    Args:
        value: mappings, sequences, arrays and scalars, nested as they like.
        digits: decimals that floats are rounded to, so that the last bits of a sum do not show, and -0.0 becomes 0.0;
            None keeps all.
    """
    if isinstance(value, Mapping):
        return {str(key): plain_data(item, digits=digits) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain_data(value.tolist(), digits=digits)
    if isinstance(value, list | tuple | set | frozenset):
        return [plain_data(item, digits=digits) for item in value]
    if isinstance(value, float):
        if not math.isfinite(value):
            return None
        return value if digits is None else round(float(value), digits) + 0.0
    if value is None or isinstance(value, str | int):
        return value
    return str(value)
