"""A scenario's `pairs`: two eyes, or which stops of one camera make a pair."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict

from flysim.errors import did_you_mean
from flysim.plain import shortened
from flysim.sources.pairing import PairRule

WORDS = ("stereo", "consecutive")
HOW = f'write pairs = "{WORDS[0]}", "{WORDS[1]}" or {{ baseline = [0.1, 0.6] }}'


class BaselineRange(BaseModel):
    """Each stop with the last one before it whose believed distance is in a range [m]."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    baseline: tuple[float, float]


def _checked(value: Any) -> Any:
    if isinstance(value, BaselineRange) or (isinstance(value, str) and value in WORDS):
        return value
    if isinstance(value, str):
        raise ValueError(f"{HOW}, got '{shortened(value, 40)}'. {did_you_mean(value, WORDS)}".removesuffix("."))
    if not isinstance(value, Mapping) or set(value) != {"baseline"}:
        raise ValueError(HOW)
    two = value["baseline"]
    numbers = isinstance(two, list | tuple) and len(two) == 2
    if not numbers or not all(isinstance(one, int | float) and not isinstance(one, bool) for one in two):
        raise ValueError(f"baseline must be two numbers [m]; {HOW}")
    PairRule(consecutive=False, least=float(two[0]), most=float(two[1]))
    return value


Pairs = Annotated[Literal["stereo", "consecutive"] | BaselineRange, BeforeValidator(_checked)]


def pair_rule(pairs: Pairs) -> PairRule | None:
    """Which stops are two eyes; None: the robot has two."""
    if isinstance(pairs, BaselineRange):
        least, most = pairs.baseline
        return PairRule(consecutive=False, least=least, most=most)
    return None if pairs == "stereo" else PairRule()
