"""Settings that stand before a program or a network in an engine's name: `timeout=5 ./matcher ...`."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from flysim.errors import EngineError, did_you_mean
from flysim.plain import shown

_SETTING = re.compile(r"\s*([a-z_]+)=(\S*)\s+")


def leading(text: str, known: Mapping[str, tuple[float, float, float]], scheme: str) -> tuple[dict[str, float], str]:
    """The settings that a text begins with, with the defaults of those it does not name; and the rest of the text.

    Args:
        text: what follows the scheme.
        known: name -> default, least, most.
        scheme: for errors.

    Raises:
        EngineError: an unknown name, or a value that is no number from least to most.
    """
    values = {name: default for name, (default, _, _) in known.items()}
    while (found := _SETTING.match(text)) is not None:
        name, word = found[1], found[2]
        if name not in known:
            raise EngineError(f"engine {scheme} has no setting '{name}'. {did_you_mean(name, known)}")
        _, least, most = known[name]
        try:
            value = float(word)
        except ValueError:
            value = math.nan
        if not least <= value <= most:
            raise EngineError(f"engine {scheme} {name} must be from {least:g} to {most:g}, got {shown(word)}.")
        values[name], text = value, text[found.end() :]
    return values, text.strip()
